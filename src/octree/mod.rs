//! Regularization: from a tet mesh or a regular volume to an adaptive octree, and on to the octree texture.
//!
//! Tong & Xu, *High Accuracy in Visualization of Tetrahedral Volume Data Based on an Adaptive Octree*, 2014.

mod activity;
mod bound;
mod brick;
mod cut_edges;
mod grid_bound;
mod lattice;
mod leaf_boxes;
mod params;
mod patch;
mod procedural;
mod regularize;
mod regularize_grid;
mod resolve;
mod sampling;
mod subject;
mod texture;
mod tree;
mod voxel_source;
mod voxels;

pub use activity::{ActiveBox, Activity, KeptActivity, Split};
pub use bound::{ErrorBound, error_bound};
pub use brick::{BRICK_WORDS, Brick, LATTICE, trilinear, trilinear_gradient};
pub use cut_edges::{Cut, CutEdges};
pub use grid_bound::grid_error_bound;
pub use leaf_boxes::LeafBox;
pub use params::{Boundary, OctreeParams, ParamsError, Preset, Reconstruction, Sampling};
pub use procedural::CellKind;
pub use regularize::{RegularizeError, regularize, working_bytes};
pub use regularize_grid::{grid_working_bytes, regularize_grid};
pub use subject::Subject;
pub use texture::{Node, OctreeTexture, TextureError};
pub use tree::{Level, Octree, Unmet};
pub use voxel_source::OctreeVolume;
