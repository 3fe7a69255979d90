//! The window for a volume of bricks: slices through it, three of them seen straight on and all in space.
//!
//! ```text
//! window    what is open, what is chosen, what a frame does
//! panel     the widgets beside the pictures
//! colors    colour map, range, missing values
//! flat      slices seen straight on: crosshair, wheel, panning
//! spatial   slices in space: camera, handles
//! cut       a slice as it is chosen
//! space     from voxels to the window
//! view      a picture: what is drawn in it, and when
//! stream    bricks on their way to the pictures
//! probe     what is under the pointer
//! play      a slice that moves by itself
//! ```

mod colors;
mod cut;
mod flat;
mod panel;
mod play;
mod probe;
mod space;
mod spatial;
mod stream;
mod view;
mod window;

pub use cut::Cut;
pub use play::Turn;
pub use probe::Probed;
pub use stream::Progress;
pub use window::StoreWindow;

use crate::bricks::BrickSource;
use crate::view::TransferFunction;
use anyhow::Result;
use std::sync::Arc;

/// What the window for a volume of bricks opens on.
#[derive(Debug)]
pub struct StoreOptions {
    /// What the volume is called: the title.
    pub name: String,
    /// Where the bricks come from.
    pub source: Arc<dyn BrickSource>,
    /// Most bytes of bricks in memory.
    pub memory_bytes: u64,
    /// Most bytes of bricks on the GPU; `None`: what suits the adapter.
    pub gpu_bytes: Option<u64>,
    /// Colours and range; `None`: what suits the values.
    pub transfer_function: Option<TransferFunction>,
}

/// Opens the window and returns when it is closed.
pub fn run_store(options: StoreOptions) -> Result<()> {
    super::open_window(&options.name.clone(), "octetra slice draws without one", move |creation| {
        Ok(Box::new(StoreWindow::new(creation, options)?))
    })
}
