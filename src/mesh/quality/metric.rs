//! The metrics: names, ranges, which way is worse.

use std::fmt;
use std::str::FromStr;

/// A measure of how well a tet is shaped: all of Verdict's for tets, the energy of fTetWild, and two angles that Verdict has not.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Metric {
    /// Longest by shortest edge.
    EdgeRatio,
    /// Longest edge by inradius.
    AspectRatio,
    /// Circumradius by inradius.
    RadiusRatio,
    /// Root mean square of the edges, cubed, by volume.
    AspectGamma,
    /// Frobenius condition number of the map from the regular tet, by traces and determinant.
    AspectFrobenius,
    /// Condition number of the map from the regular tet.
    Condition,
    /// Smallest height by the longest edge of its base.
    CollapseRatio,
    /// Six volumes.
    Jacobian,
    /// The Jacobian by the largest product of three edges at a vertex.
    ScaledJacobian,
    /// 1 by the aspect Frobenius.
    Shape,
    /// Volume by the mesh's mean volume or the other way round, squared.
    RelativeSizeSquared,
    /// Shape times relative size squared.
    ShapeAndSize,
    /// Volume by the cube of the root mean square of the edges.
    MeanRatio,
    /// Smallest dihedral angle.
    MinAngle,
    /// Largest dihedral angle.
    MaxAngle,
    /// Smallest solid angle.
    SolidAngle,
    /// How far dihedral and face angles are from those of the regular tet.
    EquiangleSkew,
    /// How much the volume lacks to that of the regular tet of the same circumsphere.
    EquivolumeSkew,
    /// How far normals are from where the centres of the faces lie.
    SquishIndex,
    /// Radius of the inscribed sphere.
    Inradius,
    /// Smallest inradius of the parts by the circumradius.
    NormalizedInradius,
    /// 1 for every linear tet.
    Distortion,
    /// Volume.
    Volume,
    /// fTetWild's energy.
    Amips,
}

/// Which values are bad.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Worse {
    /// Large ones.
    High,
    /// Small ones.
    Low,
}

/// Where values count as acceptable, and who says so.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Acceptable {
    /// From the least to the largest.
    pub range: [f64; 2],
    /// Who says so.
    pub source: &'static str,
}

/// What there is to say of a metric.
struct Facts {
    name: &'static str,
    label: &'static str,
    formula: &'static str,
    worse: Worse,
    /// Ends of the bins of histograms; those of the data where there are none.
    bins: Option<[f64; 2]>,
    acceptable: Option<Acceptable>,
}

/// No metric has such a name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no metric \"{name}\"; there are {}", names())]
pub struct UnknownMetric {
    /// The name.
    pub name: String,
}

const INF: f64 = f64::INFINITY;

impl Metric {
    /// All of them.
    pub const ALL: [Metric; 24] = [
        Metric::ScaledJacobian,
        Metric::Shape,
        Metric::AspectRatio,
        Metric::RadiusRatio,
        Metric::EdgeRatio,
        Metric::AspectGamma,
        Metric::AspectFrobenius,
        Metric::Amips,
        Metric::Condition,
        Metric::MeanRatio,
        Metric::CollapseRatio,
        Metric::MinAngle,
        Metric::MaxAngle,
        Metric::SolidAngle,
        Metric::EquiangleSkew,
        Metric::EquivolumeSkew,
        Metric::SquishIndex,
        Metric::NormalizedInradius,
        Metric::RelativeSizeSquared,
        Metric::ShapeAndSize,
        Metric::Distortion,
        Metric::Inradius,
        Metric::Jacobian,
        Metric::Volume,
    ];

    /// Those that a first look asks for.
    pub const USUAL: [Metric; 8] = [
        Metric::ScaledJacobian,
        Metric::Shape,
        Metric::AspectRatio,
        Metric::EdgeRatio,
        Metric::MinAngle,
        Metric::MaxAngle,
        Metric::Amips,
        Metric::Volume,
    ];

    #[rustfmt::skip]
    fn facts(self) -> Facts {
        use Worse::{High, Low};
        let facts = |name, label, formula, worse, bins, acceptable: Option<[f64; 2]>| Facts {
            name, label, formula, worse, bins,
            acceptable: acceptable.map(|range| Acceptable { range, source: "Verdict" }),
        };
        match self {
            Metric::EdgeRatio => facts("edge_ratio", "Edge ratio", "Lmax / Lmin", High, Some([1.0, 10.0]), Some([1.0, 3.0])),
            Metric::AspectRatio => facts("aspect_ratio", "Aspect ratio", "Lmax / (2 sqrt 6 |r|), r the inradius", High, Some([1.0, 10.0]), Some([1.0, 3.0])),
            Metric::RadiusRatio => facts("radius_ratio", "Radius ratio", "R / (3 |r|), R the circumradius", High, Some([1.0, 10.0]), Some([1.0, 3.0])),
            Metric::AspectGamma => facts("aspect_gamma", "Aspect gamma", "Lrms^3 / (6 sqrt 2 |V|)", High, Some([1.0, 10.0]), Some([1.0, 3.0])),
            Metric::AspectFrobenius => facts("aspect_frobenius", "Aspect Frobenius", "|M|^2 / (3 |det M|^(2/3)), M maps the regular tet", High, Some([1.0, 5.0]), Some([1.0, 1.3])),
            Metric::Condition => facts("condition", "Condition", "sign(J) |M| |M^-1| / 3, M maps the regular tet", High, Some([1.0, 10.0]), Some([1.0, 3.0])),
            Metric::CollapseRatio => facts("collapse_ratio", "Collapse ratio", "smallest height / longest edge of its base", Low, Some([0.0, 1.0]), Some([0.1, INF])),
            Metric::Jacobian => facts("jacobian", "Jacobian", "J = 6 V", Low, None, Some([0.0, INF])),
            Metric::ScaledJacobian => facts("scaled_jacobian", "Scaled Jacobian", "sqrt 2 J / largest product of the 3 edges at a vertex", Low, Some([-1.0, 1.0]), Some([0.5, 1.0])),
            Metric::Shape => facts("shape", "Shape", "1 / aspect Frobenius, 0 where J <= 0", Low, Some([0.0, 1.0]), Some([0.3, 1.0])),
            Metric::RelativeSizeSquared => facts("relative_size_squared", "Relative size squared", "min(V / mean, mean / V)^2", Low, Some([0.0, 1.0]), Some([0.3, 1.0])),
            Metric::ShapeAndSize => facts("shape_and_size", "Shape and size", "shape x relative size squared", Low, Some([0.0, 1.0]), Some([0.2, 1.0])),
            Metric::MeanRatio => facts("mean_ratio", "Mean ratio", "6 sqrt 2 V / Lrms^3", Low, Some([-1.0, 1.0]), None),
            Metric::MinAngle => facts("min_angle", "Min dihedral angle", "smallest dihedral angle, degrees", Low, Some([0.0, 72.0]), Some([40.0, REGULAR_DEGREES])),
            Metric::MaxAngle => facts("max_angle", "Max dihedral angle", "largest dihedral angle, degrees", High, Some([60.0, 180.0]), None),
            Metric::SolidAngle => facts("solid_angle", "Min solid angle", "smallest solid angle, steradians", Low, Some([0.0, 0.6]), None),
            Metric::EquiangleSkew => facts("equiangle_skew", "Equiangle skew", "largest deviation of an angle from the regular tet's, in parts of what is possible", High, Some([0.0, 1.0]), None),
            Metric::EquivolumeSkew => facts("equivolume_skew", "Equivolume skew", "1 - V / volume of the regular tet in the circumsphere", High, Some([0.0, 1.0]), None),
            Metric::SquishIndex => facts("squish_index", "Squish index", "max 1 - cos(face normal, tet centre to face centre)", High, Some([0.0, 1.0]), None),
            Metric::Inradius => facts("inradius", "Inradius", "r = 3 V / surface area", Low, None, None),
            Metric::NormalizedInradius => facts("normalized_inradius", "Normalized inradius", "smallest inradius of 12 parts / R, 1 for the regular tet", Low, Some([-1.0, 1.0]), None),
            Metric::Distortion => facts("distortion", "Distortion", "1 for linear tets", Low, Some([0.0, 1.0]), Some([0.5, 1.0])),
            Metric::Volume => facts("volume", "Volume", "V", Low, None, Some([0.0, INF])),
            Metric::Amips => Facts {
                acceptable: Some(Acceptable { range: [3.0, 10.0], source: "fTetWild's stop energy" }),
                ..facts("amips", "AMIPS energy", "3 / shape, infinite where J <= 0", High, Some([3.0, 15.0]), None)
            },
        }
    }

    /// Its name as arrays and flags have it.
    pub fn name(self) -> &'static str {
        self.facts().name
    }

    /// Its name in words.
    pub fn label(self) -> &'static str {
        self.facts().label
    }

    /// Its definition in a line.
    pub fn formula(self) -> &'static str {
        self.facts().formula
    }

    /// Which values are bad.
    pub fn worse(self) -> Worse {
        self.facts().worse
    }

    /// From where to where histograms go; `None` for those in units of the mesh, whose histograms span their values.
    pub fn bins(self) -> Option<[f64; 2]> {
        self.facts().bins
    }

    /// Where values count as acceptable; `None` where neither Verdict nor fTetWild says it.
    pub fn acceptable(self) -> Option<Acceptable> {
        self.facts().acceptable
    }

    /// What VTK 9.7 does otherwise, if anything.
    pub fn vtk_differs(self) -> Option<&'static str> {
        match self {
            Metric::MinAngle => Some("VTK takes 180 degrees minus the angle at two of the six edges"),
            Metric::CollapseRatio => Some("VTK takes edge 13 for 12 and 12 for 13 in two of the four faces"),
            _ => None,
        }
    }

    /// The limit as the volume goes to 0, where rounding would decide what is computed.
    pub(super) fn of_flat(self) -> Option<f64> {
        match self {
            Metric::AspectRatio
            | Metric::RadiusRatio
            | Metric::AspectGamma
            | Metric::AspectFrobenius
            | Metric::Condition
            | Metric::Amips => Some(INF),
            Metric::EquivolumeSkew => Some(1.0),
            Metric::NormalizedInradius => Some(0.0),
            _ => None,
        }
    }
}

/// The dihedral angle of the regular tet, acos(1/3), in degrees.
pub(super) const REGULAR_DEGREES: f64 = 70.52877936550931;

/// All names as text.
fn names() -> String {
    Metric::ALL.map(Metric::name).join(", ")
}

impl fmt::Display for Metric {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Metric {
    type Err = UnknownMetric;

    /// Reads a name; `-` and spaces stand for `_`, capitals do not matter.
    fn from_str(text: &str) -> Result<Self, UnknownMetric> {
        let name = text.trim().to_lowercase().replace(['-', ' '], "_");
        Metric::ALL.into_iter().find(|metric| metric.name() == name).ok_or_else(|| UnknownMetric { name: text.to_owned() })
    }
}
