//! What decides an image besides the data: camera, transfer function, render settings. All renderers take the same [`View`].

mod camera;
mod color_map;
mod cube_rays;
mod faces;
mod mode;
mod orbit;
mod path;
mod plane_handle;
mod planes;
mod poses;
mod projected;
mod scale;
mod settings;
mod skip;
mod tabulate;
mod transfer_function;

pub use camera::{Camera, CameraError, Projection, RayFrame};
pub use color_map::{ColorMap, ColorSpace};
pub use cube_rays::{CubePlanes, CubeRay, CubeRays, high_bits, mul_add};
pub use faces::Faces;
pub use mode::{Isosurface, IsosurfaceError, Isosurfaces, LightSource, Mode, NotAMode, Output, Phong, Shading};
pub use path::{CameraPath, PathError};
pub use plane_handle::PlaneHandle;
pub use planes::{NotAPlane, Plane, PlaneError, PlaneUse, Planes};
pub use scale::Scale;
pub use settings::{RenderSettings, RendererKind, SettingsError, Steps, View};
pub use skip::{Intervals, NotASkip, Skip};
pub use transfer_function::{OpacityModel, TransferFunction, TransferFunctionError};
