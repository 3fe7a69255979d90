//! Frames that nobody waits for: the window goes on while the GPU marches.

use super::context::{Context, GpuError};
use super::march::{Marched, Marcher};
use super::target::Target;
use super::timing::Timestamps;
use crate::optics::Classifier;
use crate::view::{RayFrame, RenderSettings};
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::time::Instant;

/// A march that was submitted.
#[derive(Debug)]
pub struct InFlight {
    done: Receiver<FrameTime>,
}

/// What one frame took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameTime {
    /// Seconds from submission until the GPU was seen to be done: an upper bound, other work of the device and the time to the next look
    /// included.
    pub wall_s: f64,
    /// Seconds by the GPU's timestamps; `None` where they cannot be trusted.
    pub gpu_s: Option<f64>,
}

impl InFlight {
    /// The frame's time once it is done; `None` before. Looks at the device without waiting. A device that was lost gives an error.
    pub fn poll(&self, context: &Context) -> Result<Option<FrameTime>, GpuError> {
        context.device.poll(wgpu::PollType::Poll).map_err(|e| GpuError::Device(e.to_string()))?;
        match self.done.try_recv() {
            Ok(time) => Ok(Some(time)),
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => Err(GpuError::Device("a frame was given up".into())),
        }
    }
}

impl Marcher {
    /// Submits the march of one frame into `target`, which must have the frame's size. Work submitted later finds the image in it.
    pub fn start<'a>(
        &self,
        context: &Context,
        volume: impl Into<Marched<'a>>,
        frame: &RayFrame,
        classifier: &Classifier,
        settings: &RenderSettings,
        target: &Target,
    ) -> Result<InFlight, GpuError> {
        let timestamps = Timestamps::new(context)?;
        let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let volume = volume.into();
        let (_, _held) = self.encode_timed(context, &mut encoder, volume, frame, classifier, settings, target, timestamps.as_ref())?;
        let (sender, done) = mpsc::channel();
        context.scoped(|| {
            if let Some(timestamps) = &timestamps {
                timestamps.resolve(&mut encoder);
            }
            let submitted = Instant::now();
            context.queue.submit([encoder.finish()]);
            // Nobody may be left to tell.
            let tell = move |gpu_s| {
                let _ = sender.send(FrameTime { wall_s: submitted.elapsed().as_secs_f64(), gpu_s });
            };
            match &timestamps {
                Some(timestamps) => timestamps.read_later(context, tell),
                None => context.queue.on_submitted_work_done(move || tell(None)),
            }
        })?;
        Ok(InFlight { done })
    }
}
