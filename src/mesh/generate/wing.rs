//! A swept wing of Joukowski sections between its surface and an outer boundary, layer by layer along the span.

use super::aerofoil::Aerofoil;
use super::section::Section;
use crate::mesh::{ArrayLayout, LayeredMesh, Precision, Values};
use glam::{DVec2, DVec3};

/// The array that shows itself first. With opacity rising with the value, the air that carries the wing glows and the rest is clear.
const ACTIVE: &str = "suction";

/// Thickness and camber as [`Aerofoil::new`] takes them, and the angle of attack in degrees.
const AEROFOIL: (f64, f64, f64) = (0.085, 0.1, 9.0);

/// From root to tip, in root chords.
const SPAN: f64 = 2.2;

/// A half wing, as it stands on the wall of a wind tunnel: y along the free stream, z up, the root in the plane x = 0 and the tip at
/// negative x; lengths in root chords, the root's quarter-chord point at the origin. Standard orbit views look at the root from +x.
///
/// All sections are one aerofoil, scaled, moved aft and up towards the tip. Each point carries the exact plane potential flow around
/// *its own section* (strip theory: no tip vortex, no flow along the span):
///
/// * `velocity`, 3 components in units of the free stream,
/// * `pressure_coefficient`, `1 - |v|^2`, 1 where the flow stands still,
/// * `suction`, the pressure coefficient's negative: large over the nose, 0 in the free stream.
///
/// The prism over a triangle is cut along the diagonals that start at the smaller point index, so that neighbours agree.
pub struct Wing {
    section: Section,
    /// Section points in the wind frame: quarter chord at the origin, the stream along the first axis, lengths in local chords.
    profile: Vec<DVec2>,
    velocity: Vec<f32>,
    pressure_coefficient: Vec<f32>,
    suction: Vec<f32>,
    /// Slabs of prisms along the span; one less than there are layers of points.
    slabs: usize,
}

impl Wing {
    /// The smallest number of tets that still looks like a wing.
    pub const FEWEST: u64 = 5_000;

    /// A wing of `tets` tets, met within 3 % from [`Wing::FEWEST`] on.
    pub fn new(tets: u64) -> Self {
        // Slabs and the plane mesh are refined alike: the number of slabs goes with the cube root.
        let slabs = (10.0 * (tets as f64 / 60_000.0).cbrt()).round().max(4.0);
        let foil = Self::aerofoil();
        let section = Section::with_triangles(&foil, (tets as f64 / (3.0 * slabs)).round() as u64);
        let slabs = (tets as f64 / (3 * section.triangles.len()) as f64).round().max(2.0) as usize;

        let to_wind = |v: DVec2| DVec2::new(foil.stream().x, -foil.stream().y).rotate(v);
        let flow: Vec<DVec2> = section.points.iter().map(|&p| to_wind(foil.velocity(p))).collect();
        Wing {
            profile: section.points.iter().map(|&p| to_wind(p - DVec2::new(0.25, 0.0))).collect(),
            velocity: flow.iter().flat_map(|v| [0.0, v.x as f32, v.y as f32]).collect(),
            pressure_coefficient: flow.iter().map(|v| (1.0 - v.length_squared()) as f32).collect(),
            suction: flow.iter().map(|v| (v.length_squared() - 1.0) as f32).collect(),
            section,
            slabs,
        }
    }

    /// The aerofoil of every section.
    pub fn aerofoil() -> Aerofoil {
        let (thickness, camber, incidence_degrees) = AEROFOIL;
        Aerofoil::new(thickness, camber, incidence_degrees)
    }

    /// Points in each layer.
    fn layer_points(&self) -> usize {
        self.section.points.len()
    }
}

/// The chord, and where the quarter-chord point lies, at `eta` from 0 (root) to 1 (tip): tapered, swept back and bent up.
fn planform(eta: f64) -> (f64, DVec3) {
    let (aft, up) = (0.25 * eta + 0.4 * eta * eta, 0.05 * eta + 0.1 * eta * eta);
    (1.0 - 0.25 * eta - 0.3 * eta * eta, DVec3::new(-SPAN * eta, aft, up))
}

/// The three tets of the prism between a triangle and the same in the next layer, `step` indices on. The triangle is counter-clockwise
/// seen against the direction in which layers follow each other.
fn split_prism(triangle: [u32; 3], step: u32) -> [[u32; 4]; 3] {
    let mut sorted = triangle;
    sorted.sort_unstable();
    let [a, b, c] = sorted;
    let tets = [[a, b, c, c + step], [a, b, c + step, b + step], [a, a + step, b + step, c + step]];
    // Its normal points away from the next layer, so that the tets above are positive for triangles of odd order.
    let is_even = triangle == [a, b, c] || triangle == [b, c, a] || triangle == [c, a, b];
    if is_even { tets.map(|[i, j, k, l]| [j, i, k, l]) } else { tets }
}

impl LayeredMesh for Wing {
    fn point_count(&self) -> u64 {
        self.layer_points() as u64 * (self.slabs as u64 + 1)
    }

    fn tet_count(&self) -> u64 {
        self.section.triangles.len() as u64 * 3 * self.slabs as u64
    }

    fn layer_count(&self) -> usize {
        self.slabs + 1
    }

    fn position_precision(&self) -> Precision {
        Precision::F32
    }

    fn points(&self, layer: usize) -> Vec<DVec3> {
        let (chord, quarter) = planform(layer as f64 / self.slabs as f64);
        self.profile.iter().map(|p| quarter + chord * DVec3::new(0.0, p.x, p.y)).collect()
    }

    fn tets(&self, layer: usize) -> Vec<[u32; 4]> {
        if layer == self.slabs {
            return Vec::new(); // the last layer has points only
        }
        let (first, step) = ((layer * self.layer_points()) as u32, self.layer_points() as u32);
        self.section.triangles.iter().flat_map(|triangle| split_prism(triangle.map(|i| first + i), step)).collect()
    }

    fn point_arrays(&self) -> Vec<ArrayLayout> {
        let layout = |name: &str, components| ArrayLayout { name: name.into(), components, precision: Precision::F32 };
        vec![layout("velocity", 3), layout("pressure_coefficient", 1), layout("suction", 1)]
    }

    fn point_values(&self, array: usize, _layer: usize) -> Values {
        Values::F32([&self.velocity, &self.pressure_coefficient, &self.suction][array].clone())
    }

    fn active_scalars(&self) -> Option<&str> {
        Some(ACTIVE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::signed_volume;

    #[test]
    fn a_prism_is_filled_by_three_positive_tets() {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]; // counter-clockwise in (y, z)
        for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [1, 0, 2], [0, 2, 1], [2, 1, 0]] {
            // Vertex `order[k]` sits at corner k.
            let mut at = [DVec3::ZERO; 6];
            for (k, vertex) in order.into_iter().enumerate() {
                at[vertex] = DVec3::new(0.0, corners[k][0], corners[k][1]);
                at[vertex + 3] = at[vertex] - DVec3::X;
            }
            let volumes = split_prism(order.map(|v| v as u32), 3).map(|tet| signed_volume(&tet.map(|i| at[i as usize])));
            assert!(volumes.iter().all(|&v| (v - 1.0 / 6.0).abs() < 1e-15), "{order:?}: {volumes:?}");
        }
    }

    #[test]
    fn diagonals_start_at_the_smaller_index() {
        for tet in split_prism([4, 9, 7], 100) {
            for (low, high) in tet.iter().flat_map(|&i| tet.iter().map(move |&j| (i, j))) {
                assert!(low >= 100 || high < 100 || low <= high - 100, "{low} to {high}");
            }
        }
    }

    #[test]
    fn the_arrays_are_one_flow() {
        let wing = Wing::new(8_000);
        let Values::F32(velocity) = wing.point_values(0, 0) else { panic!("f32") };
        let foil = Wing::aerofoil();
        for (i, v) in velocity.as_chunks::<3>().0.iter().enumerate() {
            let speed = DVec3::from(v.map(f64::from)).length();
            assert!((speed - foil.velocity(wing.section.points[i]).length()).abs() < 1e-6, "turned, not scaled");
            assert!((f64::from(wing.pressure_coefficient[i]) - (1.0 - speed * speed)).abs() < 1e-5);
            assert_eq!(wing.suction[i], -wing.pressure_coefficient[i]);
            assert_eq!(v[0], 0.0, "no flow along the span");
        }
        let suction = wing.pressure_coefficient.iter().copied().fold(0.0, f32::min);
        assert!(suction < -2.0, "the nose's upper side sucks: {suction}");
    }

    #[test]
    fn sections_are_the_same_aerofoil_scaled() {
        let wing = Wing::new(8_000);
        let [root, tip] = [0, wing.slabs].map(|layer| wing.points(layer));
        let scale = |i: usize, j: usize| tip[i].distance(tip[j]) / root[i].distance(root[j]);
        assert!(root.iter().all(|p| p.x == 0.0) && (scale(0, 50) - scale(20, 70)).abs() < 1e-12 && scale(0, 50) < 0.8);
    }
}
