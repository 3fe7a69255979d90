//! Files to meshes: one file a format, one registry line each.

pub mod vtu;
