//! What decides an image besides the data: camera, transfer function, render settings. All renderers take the same [`View`].

mod camera;
mod color_map;
mod cube_rays;
mod orbit;
mod scale;
mod settings;
mod skip;
mod tabulate;
mod transfer_function;

pub use camera::{Camera, CameraError, Projection, RayFrame};
pub use color_map::{ColorMap, ColorSpace};
pub use cube_rays::{CubeRay, CubeRays, high_bits, mul_add};
pub use scale::Scale;
pub use settings::{RenderSettings, RendererKind, Steps, View};
pub use skip::{Intervals, NotASkip, Skip};
pub use transfer_function::{OpacityModel, TransferFunction, TransferFunctionError};
