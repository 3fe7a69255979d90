//! Slices in motion: where they are in one frame ([`SliceSet`]).

use super::SlicePlane;

/// The slices of one frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SliceSet {
    /// The planes. A slice keeps its place in the list from frame to frame.
    pub planes: Vec<SlicePlane>,
    /// Which of them moves, by place in the list; `None` where none does.
    pub moving: Option<usize>,
}
