//! Times of frames, by the GPU's timestamps and by the clock.

use super::context::{Context, GpuError};
use super::march::{GpuSeconds, Marched, Marcher};
use super::target::Target;
use super::volume::OctreeVolume;
use crate::optics::{Classifier, Style};
use crate::view::{RayFrame, RenderSettings};
use std::cell::Cell;
use std::time::Instant;

/// Seconds of many frames, frame by frame, the repeats of one frame together.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameTimes {
    /// By timestamps round the passes; `None` where they cannot be trusted.
    pub gpu_s: Option<Vec<f64>>,
    /// Of these, what the passes take that find intervals.
    pub intervals_s: Option<Vec<f64>>,
    /// By the clock, from submission to the end of the work; nothing is read back in that time.
    pub wall_s: Vec<f64>,
}

/// Timestamps of a frame: where its first pass begins, where its last one ends, and, if passes find intervals, where those end.
pub(super) struct Timestamps {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    mappable: wgpu::Buffer,
    /// How many are written.
    count: Cell<u32>,
}

const BEGIN: u32 = 0;
const END: u32 = 1;
const INTERVALS_END: u32 = 2;

impl Timestamps {
    /// `None` where they cannot be trusted.
    pub fn new(context: &Context) -> Result<Option<Self>, GpuError> {
        if !context.timestamps {
            return Ok(None);
        }
        let buffer = |usage| wgpu::BufferDescriptor { label: Some("timestamps"), size: 24, usage, mapped_at_creation: false };
        use wgpu::BufferUsages as Usage;
        context.scoped(|| {
            let descriptor = wgpu::QuerySetDescriptor { label: Some("march"), ty: wgpu::QueryType::Timestamp, count: 3 };
            Some(Timestamps {
                queries: context.device.create_query_set(&descriptor),
                resolved: context.device.create_buffer(&buffer(Usage::QUERY_RESOLVE | Usage::COPY_SRC)),
                mappable: context.device.create_buffer(&buffer(Usage::COPY_DST | Usage::MAP_READ)),
                count: Cell::new(2),
            })
        })
    }

    /// What the frame's own pass writes: whether it is the first, and whether it is the last.
    pub fn compute(&self, is_first: bool, is_last: bool) -> wgpu::ComputePassTimestampWrites<'_> {
        if is_first {
            self.count.set(2);
        }
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: is_first.then_some(BEGIN),
            end_of_pass_write_index: is_last.then_some(END),
        }
    }

    /// What a pass writes that finds intervals: whether it is the frame's first, and whether they are found at its end.
    pub fn intervals(&self, is_first: bool, is_last: bool) -> wgpu::ComputePassTimestampWrites<'_> {
        self.count.set(3);
        wgpu::ComputePassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: is_first.then_some(BEGIN),
            end_of_pass_write_index: is_last.then_some(INTERVALS_END),
        }
    }

    /// What the pass writes that draws boxes, after which intervals are found.
    pub fn boxes(&self) -> wgpu::RenderPassTimestampWrites<'_> {
        wgpu::RenderPassTimestampWrites {
            query_set: &self.queries,
            beginning_of_pass_write_index: None,
            end_of_pass_write_index: Some(INTERVALS_END),
        }
    }

    /// Records their way to where they can be read.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        encoder.resolve_query_set(&self.queries, 0..self.count.get(), &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.mappable, 0, 24);
    }

    /// Seconds between them, once submitted.
    pub fn read_s(&self, context: &Context) -> Result<GpuSeconds, GpuError> {
        Ok(seconds(&context.read(&self.mappable)?, self.count.get(), context.queue.get_timestamp_period()))
    }

    /// Calls `then` with the seconds of the frame when the work submitted before is done and somebody polls the device; `None` if they
    /// cannot be read.
    pub fn read_later(&self, context: &Context, then: impl FnOnce(Option<f64>) + Send + 'static) {
        let (buffer, count, period) = (self.mappable.clone(), self.count.get(), context.queue.get_timestamp_period());
        self.mappable.map_async(wgpu::MapMode::Read, .., move |result| {
            let content = result.ok().and_then(|()| buffer.get_mapped_range(..).ok().map(|range| seconds(&range, count, period).frame));
            then(content);
        });
    }
}

/// What `count` timestamps say as they lie in a buffer, `period` nanoseconds a tick.
fn seconds(bytes: &[u8], count: u32, period: f32) -> GpuSeconds {
    let [begin, end, intervals_end]: [u64; 3] = bytemuck::pod_read_unaligned(bytes);
    let since = |ticks: u64| ticks.wrapping_sub(begin) as f64 * f64::from(period) * 1e-9;
    GpuSeconds { frame: since(end), intervals: if count > 2 { since(intervals_end) } else { 0.0 } }
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
        let by_gpu = || context.timestamps.then(Vec::new);
        let mut times = FrameTimes { gpu_s: by_gpu(), intervals_s: by_gpu(), wall_s: Vec::new() };
        let Some(first) = frames.first() else { return Ok(times) };
        let volume = volume.into();
        let target = Target::new(context, first.width, first.height)?;
        let timestamps = Timestamps::new(context)?;
        let once = |frame: &RayFrame| -> Result<(f64, Option<GpuSeconds>), GpuError> {
            let mut encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            let (_, held) = self.encode_timed(context, &mut encoder, volume, frame, classifier, settings, &target, timestamps.as_ref())?;
            if let Some(timestamps) = &timestamps {
                context.scoped(|| timestamps.resolve(&mut encoder))?;
            }
            let commands = context.scoped(|| encoder.finish())?;
            let start = Instant::now();
            context.scoped(|| context.queue.submit([commands]))?;
            drop(held);
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
                if let (Some(frames), Some(intervals), Some(gpu_s)) = (&mut times.gpu_s, &mut times.intervals_s, gpu_s) {
                    frames.push(gpu_s.frame);
                    intervals.push(gpu_s.intervals);
                }
            }
        }
        Ok(times)
    }

    /// Seconds that finding anew what is active takes, each time of `repeats`: by timestamps where they can be trusted, else by the clock
    /// with the submission.
    pub fn time_activity(
        &self,
        context: &Context,
        volume: &OctreeVolume,
        classifier: &Classifier,
        settings: &RenderSettings,
        repeats: u32,
    ) -> Result<Vec<f64>, GpuError> {
        let seen = Style::seen_with(settings, classifier, volume.root_edge);
        // What follows makes the masks those of these values; the next march finds out by itself.
        let _shown = volume.activity.forget();
        let timestamps = Timestamps::new(context)?;
        let once = |_| {
            let start = Instant::now();
            self.activity.submit(context, volume, &seen, timestamps.as_ref())?;
            context.wait()?;
            let wall_s = start.elapsed().as_secs_f64();
            Ok(timestamps.as_ref().map(|t| t.read_s(context)).transpose()?.map_or(wall_s, |s| s.frame))
        };
        (0..repeats).map(once).collect()
    }
}
