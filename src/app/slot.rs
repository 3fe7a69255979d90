//! The pictures that the window holds.

use crate::view::RendererKind;

/// A picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Slot {
    /// The octree's.
    Octree,
    /// The mesh's own.
    Exact,
    /// That of an octree which was kept to compare with.
    Kept,
}

impl Slot {
    /// How many there are.
    pub const COUNT: usize = 3;

    /// All of them, in the order of their numbers.
    pub const ALL: [Slot; Slot::COUNT] = [Slot::Octree, Slot::Exact, Slot::Kept];

    /// What draws it.
    pub fn renderer(self) -> RendererKind {
        match self {
            Slot::Octree | Slot::Kept => RendererKind::Octree,
            Slot::Exact => RendererKind::Exact,
        }
    }
}

impl From<RendererKind> for Slot {
    fn from(kind: RendererKind) -> Self {
        match kind {
            RendererKind::Octree => Slot::Octree,
            RendererKind::Exact => Slot::Exact,
        }
    }
}
