//! A session: all that decides a picture, in one JSON file. The window saves and opens it, `octetra render --session` draws it.
//!
//! ```text
//! {"octetra_session": 1,
//!  "data": {"file": "flow.vtu"}, "array": "pressure", "component": "magnitude",
//!  "thresholds": {..}, "camera": {..}, "transfer_function": {..}, "render": {"width": 800, "height": 600, "mode": "composite", ..},
//!  "background": [0, 0, 0], "transparent": false, "furniture": "bar,axes", "furniture_in_pictures": true}
//! ```
//!
//! Data of a series are `{"file": "flow.pvd", "step": 3}`, or `{"file": "flow_*.vtu"}`, its first step.
//!
//! All but the version may be left out; what is unknown is refused by name.

mod file;
mod source;

use crate::furniture::Parts;
use crate::mesh::Component;
use crate::octree::OctreeParams;
use crate::view::{Camera, RenderSettings, TransferFunction};
pub use file::SessionError;
use serde::{Deserialize, Serialize};
pub use source::Source;

/// All that decides a picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Session {
    /// The version of the file's format, [`Session::VERSION`].
    #[serde(rename = "octetra_session")]
    pub version: u32,
    /// What is drawn.
    pub data: Source,
    /// The array; `None`: the file's active scalars, else the first.
    pub array: Option<String>,
    /// What is taken of a vector.
    #[serde(with = "crate::words")]
    pub component: Component,
    /// How the octree is built.
    pub thresholds: OctreeParams,
    /// From where; `None`: the first view of the standard orbit.
    pub camera: Option<Camera>,
    /// Colours and opacity.
    pub transfer_function: TransferFunction,
    /// Size, renderer, mode, steps.
    pub render: RenderSettings,
    /// Colour behind the picture, linear RGB in [0, 1].
    pub background: [f32; 3],
    /// Whether pictures keep their alpha instead.
    pub transparent: bool,
    /// What stands around the picture.
    #[serde(with = "crate::words")]
    pub furniture: Parts,
    /// Whether it stands in saved pictures, too.
    pub furniture_in_pictures: bool,
    /// Pixels a point of the furniture; `None`: letters grow with the picture.
    pub furniture_scale: Option<f64>,
}

impl Default for Session {
    fn default() -> Self {
        Session {
            version: Session::VERSION,
            data: Source::default(),
            array: None,
            component: Component::default(),
            thresholds: OctreeParams::default(),
            camera: None,
            transfer_function: TransferFunction::default(),
            render: RenderSettings::default(),
            background: [0.0; 3],
            transparent: false,
            furniture: Parts::NONE,
            furniture_in_pictures: true,
            furniture_scale: None,
        }
    }
}

impl Session {
    /// The version that is written, and the newest that is read.
    pub const VERSION: u32 = 1;
}
