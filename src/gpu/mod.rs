//! The GPU: device, shaders, their data, the march over the octree texture and that through the mesh itself.
//!
//! Immutable renderer ([`Marcher`]), separate data ([`OctreeVolume`], [`ExactMesh`]), separate view (frame, classifier, settings): the window and the
//! command call the same functions. Device errors come back as [`GpuError`].

mod activity;
mod context;
mod cut_edges;
mod exact_mesh;
mod in_flight;
mod intervals;
pub mod layout;
mod lines;
mod march;
pub mod shader;
mod slices;
mod surface;
mod target;
mod timing;
mod volume;
mod voxels;

pub use activity::CLEARANCE_BITS;
pub use context::{Context, GpuError, device_descriptor};
pub use exact_mesh::ExactMesh;
pub use in_flight::{FrameTime, InFlight};
pub use intervals::Placing;
pub use lines::{LinePipeline, LineVertex, Lines};
pub use march::{GpuFrame, GpuSeconds, Marched, Marcher};
pub use slices::{
    ABSENT, DrawnSlice, SliceLevel, SliceLook, SlicePainter, SlicePicture, SlicePool, SliceQuad, SliceStyle, TINTS, flat_projection,
    outline, plane_axes,
};
pub use surface::GpuSurface;
pub use target::Target;
pub use timing::FrameTimes;
pub use volume::OctreeVolume;
pub use voxels::BLOCK_CELLS;
