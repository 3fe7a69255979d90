//! From scalar to light: classification by a transfer function, the Psi table, partial pre-integration of a segment and its splitting
//! at the transfer function's knots (maths 1 and 2).

mod classifier;
mod light;
mod psi;
mod segment;

pub use classifier::{ClassKnot, Classifier, INDEX_SIZE, Knot, KnotTable, Medium};
pub use light::Light;
pub use psi::{PSI_SIZE, psi, psi_table};
pub use segment::{Weights, em1, segment};
