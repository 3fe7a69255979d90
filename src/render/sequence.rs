//! Many pictures of one scene, one file each.

use super::{RenderError, Renderer, Scene};
use crate::image::{Background, Image, ImageError, write_png};
use crate::progress::{Cancelled, Progress};
use crate::view::{Camera, View};
use std::path::PathBuf;

/// Why a sequence is not complete. What was written before is whole.
#[derive(Debug, thiserror::Error)]
pub enum SequenceError {
    /// The caller asked to stop.
    #[error("stopped; {written} of {count} pictures are written")]
    Stopped {
        /// So many are.
        written: usize,
        /// Of so many.
        count: usize,
    },
    /// A picture could not be drawn.
    #[error(transparent)]
    Render(RenderError),
    /// A picture could not be written.
    #[error(transparent)]
    Image(#[from] ImageError),
}

impl Renderer {
    /// Draws a scene from each view and writes each picture when it is whole. `finish` paints what belongs over a picture and says what
    /// lies behind it.
    pub fn write_sequence(
        &self,
        scene: &Scene,
        pictures: &[(View, PathBuf)],
        finish: impl Fn(&mut Image, &Camera) -> Background,
        progress: &Progress,
    ) -> Result<(), SequenceError> {
        let count = pictures.len();
        progress.begin("pictures", count as u64);
        for (written, (view, path)) in pictures.iter().enumerate() {
            let stopped = SequenceError::Stopped { written, count };
            let drawn = progress.check().map_err(RenderError::from).and_then(|()| self.render(scene, view, &progress.part()));
            let mut image = match drawn {
                Ok(picture) => picture.image,
                Err(RenderError::Cancelled(Cancelled)) => return Err(stopped),
                Err(error) => return Err(SequenceError::Render(error)),
            };
            let background = finish(&mut image, &view.camera);
            write_png(path, &image, background)?;
            progress.add(1);
        }
        Ok(())
    }
}
