//! Planes that clip what is drawn, or are drawn themselves where they cut it.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// What a plane does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", deny_unknown_fields)]
pub enum PlaneUse {
    /// Only what lies on the side that the normal points to is drawn.
    Clip,
    /// The plane is drawn inside the data, in the colours of the values on it.
    Cut {
        /// From 0 (not seen) to 1 (nothing is seen behind it).
        opacity: f32,
        /// Whether the tets' edges are drawn on it.
        edges: bool,
    },
}

/// A plane in the world, and what it does.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "PlaneFile", into = "PlaneFile")]
pub struct Plane {
    /// A point on it.
    pub point: DVec3,
    /// Its normal, of any length that can be told from 0 and infinity when squared.
    pub normal: DVec3,
    /// What it does.
    pub used: PlaneUse,
}

/// A plane as files have it: `{"point": [x, y, z], "normal": [x, y, z], "use": "clip"}`, or
/// `"use": {"cut": {"opacity": 1, "edges": false}}`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaneFile {
    point: [f64; 3],
    normal: [f64; 3],
    #[serde(rename = "use")]
    used: PlaneUse,
}

impl From<PlaneFile> for Plane {
    fn from(file: PlaneFile) -> Self {
        Plane { point: file.point.into(), normal: file.normal.into(), used: file.used }
    }
}

impl From<Plane> for PlaneFile {
    fn from(plane: Plane) -> Self {
        PlaneFile { point: plane.point.into(), normal: plane.normal.into(), used: plane.used }
    }
}

/// Some planes, at most [`Planes::MOST`].
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(try_from = "Vec<Plane>", into = "Vec<Plane>")]
pub struct Planes {
    list: [Option<Plane>; Planes::MOST],
}

impl TryFrom<Vec<Plane>> for Planes {
    type Error = PlaneError;

    fn try_from(planes: Vec<Plane>) -> Result<Self, PlaneError> {
        Planes::new(&planes)
    }
}

impl From<Planes> for Vec<Plane> {
    fn from(planes: Planes) -> Self {
        planes.iter().collect()
    }
}

/// Why planes cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlaneError {
    /// More than there is room for.
    #[error("{0} planes, expected at most {max} that clip and cut together", max = Planes::MOST)]
    TooMany(usize),
    /// A point or a normal that is none.
    #[error("the plane through {} along {} is none: expected finite numbers and a normal that is not 0", .0.point, .0.normal)]
    NotAPlane(Plane),
    /// An opacity out of range.
    #[error("the opacity of a cut is {0}, expected a number in [0, 1]")]
    Opacity(f32),
}

/// Why a text is no plane.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("expected x=C, y=C or z=C (-x=C for the other side), or a point and a normal X,Y,Z:NX,NY,NZ")]
pub struct NotAPlane;

impl Plane {
    /// `x=C` and the like, or `X,Y,Z:NX,NY,NZ`.
    pub fn parse(text: &str, used: PlaneUse) -> Result<Self, NotAPlane> {
        let vector = |text: &str| -> Option<DVec3> {
            let numbers: Option<Vec<f64>> = text.split(',').map(|number| f64::from_str(number.trim()).ok()).collect();
            Some(DVec3::from_array(numbers?.try_into().ok()?)).filter(|v| v.is_finite())
        };
        let axes = [("x", DVec3::X), ("y", DVec3::Y), ("z", DVec3::Z), ("-x", DVec3::NEG_X), ("-y", DVec3::NEG_Y), ("-z", DVec3::NEG_Z)];
        let (point, normal) = if let Some((axis, position)) = text.split_once('=') {
            let normal = axes.into_iter().find(|(name, _)| *name == axis.trim()).ok_or(NotAPlane)?.1;
            let position: f64 = position.trim().parse().ok().filter(|p: &f64| p.is_finite()).ok_or(NotAPlane)?;
            (normal.abs() * position, normal)
        } else {
            let (point, normal) = text.split_once(':').ok_or(NotAPlane)?;
            vector(point).zip(vector(normal)).ok_or(NotAPlane)?
        };
        if normal.try_normalize().is_none() { Err(NotAPlane) } else { Ok(Plane { point, normal, used }) }
    }
}

impl Planes {
    /// No more of them are used.
    pub const MOST: usize = 6;

    /// None.
    pub const NONE: Planes = Planes { list: [None; Planes::MOST] };

    /// These.
    pub fn new(planes: &[Plane]) -> Result<Self, PlaneError> {
        if planes.len() > Self::MOST {
            return Err(PlaneError::TooMany(planes.len()));
        }
        for plane in planes {
            if !(plane.point.is_finite() && plane.normal.try_normalize().is_some()) {
                return Err(PlaneError::NotAPlane(*plane));
            }
            if let PlaneUse::Cut { opacity, .. } = plane.used
                && !(0.0..=1.0).contains(&opacity)
            {
                return Err(PlaneError::Opacity(opacity));
            }
        }
        let mut list = [None; Self::MOST];
        list.iter_mut().zip(planes).for_each(|(place, plane)| *place = Some(*plane));
        Ok(Planes { list })
    }

    /// In the order in which they were given.
    pub fn iter(&self) -> impl Iterator<Item = Plane> {
        self.list.into_iter().flatten()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.list[0].is_none()
    }

    /// How many of them clip, and how many are drawn.
    pub fn counts(&self) -> [u32; 2] {
        let clips = self.iter().filter(|plane| plane.used == PlaneUse::Clip).count() as u32;
        [clips, self.iter().count() as u32 - clips]
    }

    /// Whether one of them is drawn.
    pub fn are_drawn(&self) -> bool {
        self.iter().any(|plane| plane.used != PlaneUse::Clip)
    }

    /// The t from and to which a ray, `origin + t direction`, is not clipped; from infinity to minus infinity where it is all along.
    pub fn unclipped(&self, origin: DVec3, direction: DVec3) -> [f64; 2] {
        let [mut begin, mut end] = [f64::NEG_INFINITY, f64::INFINITY];
        for plane in self.iter().filter(|plane| plane.used == PlaneUse::Clip) {
            let (along, before) = (direction.dot(plane.normal), (plane.point - origin).dot(plane.normal));
            match along {
                along if along > 0.0 => begin = begin.max(before / along),
                along if along < 0.0 => end = end.min(before / along),
                _ if before > 0.0 => return [f64::INFINITY, f64::NEG_INFINITY],
                _ => {}
            }
        }
        [begin, end]
    }

    /// The same, moved.
    pub fn translated(&self, by: DVec3) -> Planes {
        Planes { list: self.list.map(|plane| plane.map(|plane| Plane { point: plane.point + by, ..plane })) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_are_read_as_people_write_them() {
        let clip = |text| Plane::parse(text, PlaneUse::Clip).map(|plane| (plane.point, plane.normal));
        assert_eq!(clip("x=0.5"), Ok((DVec3::new(0.5, 0.0, 0.0), DVec3::X)));
        assert_eq!(clip("-z=-2"), Ok((DVec3::new(0.0, 0.0, -2.0), DVec3::NEG_Z)));
        assert_eq!(clip("1,2,3:0,0.5,-1"), Ok((DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, 0.5, -1.0))));
        for text in ["", "x", "w=1", "x=a", "1,2,3", "1,2,3:0,0,0", "1,2:0,0,1", "1,2,3:0,0,inf", "0,0,0:1e300,1,0", "0,0,0:0,1e-200,0"] {
            assert_eq!(clip(text), Err(NotAPlane), "{text}");
        }
    }

    #[test]
    fn what_is_no_plane_is_refused() {
        let plane = Plane { point: DVec3::ONE, normal: DVec3::Y, used: PlaneUse::Clip };
        assert_eq!(Planes::new(&[plane; 7]), Err(PlaneError::TooMany(7)));
        assert!(matches!(Planes::new(&[Plane { normal: DVec3::ZERO, ..plane }]), Err(PlaneError::NotAPlane(_))));
        let cut = Plane { used: PlaneUse::Cut { opacity: 1.5, edges: false }, ..plane };
        assert_eq!(Planes::new(&[cut]), Err(PlaneError::Opacity(1.5)));
        let moved = Planes::new(&[plane]).expect("valid").translated(DVec3::X);
        assert_eq!(moved.iter().next().map(|plane| plane.point), Some(DVec3::new(2.0, 1.0, 1.0)));
        assert!(!moved.are_drawn() && !moved.is_empty() && Planes::NONE.is_empty());
    }

    #[test]
    fn rays_are_clipped_from_both_sides() {
        let of = |text| Plane::parse(text, PlaneUse::Clip).expect("a plane");
        let planes = Planes::new(&[
            of("x=1"),
            of("-x=3"),
            of("0,0,0:0,-2,0"),
            Plane { used: PlaneUse::Cut { opacity: 1.0, edges: false }, ..of("x=2") },
        ]);
        let planes = planes.expect("valid");
        assert_eq!(planes.unclipped(DVec3::NEG_X, DVec3::X * 2.0), [1.0, 2.0]);
        assert_eq!(planes.unclipped(DVec3::X * 7.0, DVec3::NEG_X), [4.0, 6.0]);
        let beside = planes.unclipped(DVec3::Y, DVec3::X);
        assert!(beside[0] > beside[1]);
        assert_eq!(Planes::NONE.unclipped(DVec3::Y, DVec3::X), [f64::NEG_INFINITY, f64::INFINITY]);
    }
}
