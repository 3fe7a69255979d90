//! How the boundary of the data is drawn.

use serde::{Deserialize, Serialize};

/// How the mesh's boundary faces are drawn: all of them, in depth order with the volume, from outside and from inside. Where planes clip
/// there are none. Of a volume the boundary is its box.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Faces {
    /// From 0 (not seen) to 1 (nothing is seen behind them).
    pub opacity: f32,
    /// Linear RGB in [0, 1]; `None`: the transfer function's colours of the values on them.
    pub color: Option<[f32; 3]>,
    /// Whether the edges of the mesh's faces are drawn; a volume has none.
    pub edges: bool,
}

impl Default for Faces {
    fn default() -> Self {
        Faces { opacity: 1.0, color: None, edges: false }
    }
}
