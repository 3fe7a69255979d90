//! Procedural meshes that carry known fields.
