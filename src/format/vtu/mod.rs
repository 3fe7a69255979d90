//! VTK's XML file of unstructured grids, `.vtu`.

pub mod write;
