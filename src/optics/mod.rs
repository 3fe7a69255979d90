//! From scalar to light: classification by a transfer function, the Psi table, partial pre-integration of a segment and its splitting
//! at the transfer function's knots (maths 1 and 2); Phong's reflection, and the colours of what is no light.

mod classifier;
mod light;
mod phong;
mod psi;
mod segment;
mod style;

pub use classifier::{ClassKnot, Classifier, INDEX_SIZE, Knot, KnotTable, Medium};
pub use light::Light;
pub use phong::Lit;
pub use psi::{PSI_SIZE, psi, psi_table};
pub use segment::{Weights, em1, segment};
pub use style::{Style, Surface};
