//! What of a ray is marched: how the march gets past what the transfer function does not show.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// How empty space is skipped (method 2, maths 5). All give the same picture under [`Steps::Leaf`](super::Steps) and
/// [`Steps::Fixed`](super::Steps). A leaf is *active* if the transfer function shows any value in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum Skip {
    /// Nothing: rays are marched from where they enter the cube or the mesh to where they leave it (Krüger & Westermann 2003).
    None,
    /// The march goes from active leaf to active leaf and leaps over whole subtrees without one.
    #[default]
    Octree,
    /// Octree encoding (Kang 2012): blocks of 8^3 voxels with something active, packed into one 3D texture, are marched and all others leapt
    /// over. With [`Steps::Fixed`](super::Steps) on the GPU; elsewhere this is [`Skip::Octree`].
    Encoding,
    /// Half-splitting (Yu et al. 2016): a plane halves the volume; in each half a ray is marched from its first active leaf to its last.
    Half,
    /// A ray's own way through the cube is cut into so many equal parts, 1 to [`Skip::MAX_PARTS`]; in each it is marched from the first
    /// active leaf to the last. 1 is `bounds`, 2 is `half=ray`.
    Parts(u32),
}

/// Where first and last active leaves of rays come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Intervals {
    /// A compute pass that follows each ray from leaf to leaf.
    #[default]
    Compute,
    /// The boxes of all active leaves, rasterised.
    Raster,
}

/// Why a text names no way to skip.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected none, bounds, octree, encoding, half, half=ray or k=N with N from 1 to {}", Skip::MAX_PARTS)]
pub struct NotASkip;

impl Skip {
    /// A ray is cut into at most so many parts.
    pub const MAX_PARTS: u32 = 64;

    /// Whether the march itself leaps over what is not active.
    pub fn is_in_march(self) -> bool {
        matches!(self, Skip::Octree | Skip::Encoding)
    }

    /// Into how many parts rays are cut that are each marched from their first active leaf to the last; `None` where intervals play no
    /// part.
    pub fn parts(self) -> Option<u32> {
        match self {
            Skip::None | Skip::Octree | Skip::Encoding => None,
            Skip::Half => Some(2),
            Skip::Parts(parts) => Some(parts.clamp(1, Skip::MAX_PARTS)),
        }
    }
}

impl fmt::Display for Skip {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Skip::None => f.write_str("none"),
            Skip::Octree => f.write_str("octree"),
            Skip::Encoding => f.write_str("encoding"),
            Skip::Half => f.write_str("half"),
            Skip::Parts(1) => f.write_str("bounds"),
            Skip::Parts(2) => f.write_str("half=ray"),
            Skip::Parts(parts) => write!(f, "k={parts}"),
        }
    }
}

impl FromStr for Skip {
    type Err = NotASkip;

    fn from_str(text: &str) -> Result<Self, NotASkip> {
        match text {
            "none" => Ok(Skip::None),
            "octree" => Ok(Skip::Octree),
            "encoding" => Ok(Skip::Encoding),
            "half" => Ok(Skip::Half),
            "bounds" => Ok(Skip::Parts(1)),
            "half=ray" => Ok(Skip::Parts(2)),
            _ => {
                let parts = text.strip_prefix("k=").and_then(|n| n.parse().ok()).ok_or(NotASkip)?;
                if (1..=Skip::MAX_PARTS).contains(&parts) { Ok(Skip::Parts(parts)) } else { Err(NotASkip) }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        for skip in [Skip::None, Skip::Octree, Skip::Encoding, Skip::Half, Skip::Parts(1), Skip::Parts(2), Skip::Parts(64)] {
            assert_eq!(skip.to_string().parse(), Ok(skip));
        }
        for text in ["", "k", "k=", "k=0", "k=65", "k=-1", "half=", "Half", "all"] {
            assert_eq!(text.parse::<Skip>(), Err(NotASkip), "{text}");
        }
    }
}
