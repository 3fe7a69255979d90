//! Tuning: many settings of the subdivision thresholds, each built, measured and drawn, and which of them to take.
//!
//! ```text
//! plan        which settings to go through
//! sweep       builds and measures each
//! record      what was measured, of what and on what: a file that a later sweep continues
//! front       the settings that no other beats
//! recommend   the one to take for a budget or for a quality
//! ```

mod front;
mod plan;
mod recommend;
mod record;
mod sweep;

pub use front::{front, picture_front};
pub use plan::{Kind, Plan};
pub use recommend::{Goal, Pick, recommend};
pub use record::{Record, RecordError, RecordSubject};
pub use sweep::{BEST_DB, Clock, Dropped, Effort, Row, Sweep, TuneError};
