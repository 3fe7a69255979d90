//! The GPU: device, shaders, their data, and the march over the octree texture.
//!
//! Immutable renderer ([`Marcher`]), separate data ([`OctreeVolume`]), separate view (frame, classifier, settings): the window and the
//! command call the same functions. Device errors come back as [`GpuError`].

mod context;
mod in_flight;
pub mod layout;
mod march;
pub mod shader;
mod surface;
mod target;
mod timing;
mod volume;

pub use context::{Context, GpuError, device_descriptor};
pub use in_flight::{FrameTime, InFlight};
pub use march::{GpuFrame, Marcher};
pub use surface::GpuSurface;
pub use target::Target;
pub use timing::FrameTimes;
pub use volume::OctreeVolume;
