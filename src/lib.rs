//! octetra shows what is inside a tetrahedral mesh.

pub mod app;
pub mod cli;
pub mod cpu;
pub mod exact;
pub mod format;
pub mod geometry;
pub mod gpu;
pub mod image;
pub mod mesh;
pub mod octree;
pub mod optics;
pub mod progress;
pub mod render;
pub mod study;
pub mod view;
