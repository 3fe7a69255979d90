//! Times of frames, by the GPU's timestamps and by the clock.

use super::context::{Context, GpuError};
use super::march::{Marched, Marcher};
use super::target::Target;
use crate::optics::Classifier;
use crate::view::{RayFrame, RenderSettings};
use std::time::Instant;

/// Seconds of many frames, frame by frame, the repeats of one frame together.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameTimes {
    /// By timestamps round the pass; `None` where they cannot be trusted.
    pub gpu_s: Option<Vec<f64>>,
    /// By the clock, from submission to the end of the work; nothing is read back in that time.
    pub wall_s: Vec<f64>,
}

/// Two timestamps, at the beginning and the end of a pass.
pub(super) struct Timestamps {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    mappable: wgpu::Buffer,
}

impl Timestamps {
    /// `None` where they cannot be trusted.
    pub fn new(context: &Context) -> Result<Option<Self>, GpuError> {
        if !context.timestamps {
            return Ok(None);
        }
        let buffer = |usage| wgpu::BufferDescriptor { label: Some("timestamps"), size: 16, usage, mapped_at_creation: false };
        use wgpu::BufferUsages as Usage;
        context.scoped(|| {
            let descriptor = wgpu::QuerySetDescriptor { label: Some("march"), ty: wgpu::QueryType::Timestamp, count: 2 };
            Some(Timestamps {
                queries: context.device.create_query_set(&descriptor),
                resolved: context.device.create_buffer(&buffer(Usage::QUERY_RESOLVE | Usage::COPY_SRC)),
                mappable: context.device.create_buffer(&buffer(Usage::COPY_DST | Usage::MAP_READ)),
            })
        })
    }

    /// What makes a pass write them.
    pub fn round_pass(&self) -> wgpu::ComputePassTimestampWrites<'_> {
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: Some(0),
            end_of_pass_write_index: Some(1),
        }
    }

    /// Records their way to where they can be read.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..2, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.mappable, 0, 16);
    }

    /// Seconds between the two, once submitted.
    pub fn read_s(&self, context: &Context) -> Result<f64, GpuError> {
        Ok(seconds(&context.read(&self.mappable)?, context.queue.get_timestamp_period()))
    }

    /// Calls `then` with the seconds between the two when the work submitted before is done and somebody polls the device; `None` if they
    /// cannot be read.
    pub fn read_later(&self, context: &Context, then: impl FnOnce(Option<f64>) + Send + 'static) {
        let (buffer, period) = (self.mappable.clone(), context.queue.get_timestamp_period());
        self.mappable.map_async(wgpu::MapMode::Read, .., move |result| {
            let content = result.ok().and_then(|()| buffer.get_mapped_range(..).ok().map(|range| seconds(&range, period)));
            then(content);
        });
    }
}

/// Seconds between two timestamps as they lie in a buffer, `period` nanoseconds a tick.
fn seconds(bytes: &[u8], period: f32) -> f64 {
    let [begin, end]: [u64; 2] = bytemuck::pod_read_unaligned(bytes);
    end.wrapping_sub(begin) as f64 * f64::from(period) * 1e-9
}

impl Marcher {
    /// Times the march of each frame `repeats` times, after rounds over all frames for at least `warmup_s` seconds, in which an idle
    /// GPU raises its clocks. All frames have one size.
    pub fn time<'a>(
        &self,
        context: &Context,
        volume: impl Into<Marched<'a>>,
        frames: &[RayFrame],
        classifier: &Classifier,
        settings: &RenderSettings,
        warmup_s: f64,
        repeats: u32,
    ) -> Result<FrameTimes, GpuError> {
        let mut times = FrameTimes { gpu_s: context.timestamps.then(Vec::new), wall_s: Vec::new() };
        let Some(first) = frames.first() else { return Ok(times) };
        let volume = volume.into();
        let target = Target::new(context, first.width, first.height)?;
        let timestamps = Timestamps::new(context)?;
        let once = |frame: &RayFrame| -> Result<(f64, Option<f64>), GpuError> {
            let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            self.encode_timed(context, &mut encoder, volume, frame, classifier, settings, &target, timestamps.as_ref())?;
            if let Some(timestamps) = &timestamps {
                context.scoped(|| timestamps.resolve(&mut encoder))?;
            }
            let commands = context.scoped(|| encoder.finish())?;
            let start = Instant::now();
            context.scoped(|| context.queue.submit([commands]))?;
            context.wait()?;
            let wall_s = start.elapsed().as_secs_f64();
            Ok((wall_s, timestamps.as_ref().map(|t| t.read_s(context)).transpose()?))
        };
        let start = Instant::now();
        while start.elapsed().as_secs_f64() < warmup_s {
            frames.iter().try_for_each(|frame| once(frame).map(drop))?;
        }
        for frame in frames {
            for _ in 0..repeats {
                let (wall_s, gpu_s) = once(frame)?;
                times.wall_s.push(wall_s);
                if let (Some(all), Some(gpu_s)) = (&mut times.gpu_s, gpu_s) {
                    all.push(gpu_s);
                }
            }
        }
        Ok(times)
    }
}
