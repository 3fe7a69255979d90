//! The plane mesh around an aerofoil: a constrained Delaunay triangulation whose triangles follow a size field.
//!
//! Only the points of the two boundary curves pass through trigonometry, and they are rounded to a grid. Everything after that is
//! `+ - * /` and square roots, which every machine rounds alike, and spade's exact predicates: the mesh is the same everywhere.

use super::aerofoil::Aerofoil;
use glam::DVec2;
use spade::{AngleLimit, HasPosition, Point2, PositionInTriangulation, RefinementParameters, Triangulation};

type Cdt = spade::ConstrainedDelaunayTriangulation<Point2<f64>>;

/// Seeds lie on multiples of this, in chords.
const SEED_GRID: f64 = 1.0 / (1u64 << 30) as f64;

/// Middle of the outer boundary, an ellipse along the free stream, in the chord frame; and its semi-axes along and across the stream.
const OUTER_CENTER: DVec2 = DVec2::new(0.56, 0.05);
const OUTER_AXES: DVec2 = DVec2::new(1.0, 0.66);

/// A plane triangulation around an aerofoil, in its chord frame.
#[derive(Debug, Clone)]
pub struct Section {
    /// The points, by ascending x.
    pub points: Vec<DVec2>,
    /// Point indices, counter-clockwise, the smallest first.
    pub triangles: Vec<[u32; 3]>,
}

impl Section {
    /// A mesh of `triangles` triangles, met within 1 % or as near as eight attempts come.
    pub fn with_triangles(foil: &Aerofoil, triangles: u64) -> Self {
        // A small mesh first: its count tells a spacing from which a large one is met at once.
        let mut spacing = (1.7 / triangles as f64).sqrt();
        if triangles > 10_000 {
            let small = Section::with_spacing(foil, 0.03).triangles.len();
            spacing = 0.03 * (small as f64 / triangles as f64).sqrt();
        }
        let mut best: Option<(f64, Section)> = None;
        for _ in 0..8 {
            let section = Section::with_spacing(foil, spacing);
            let ratio = section.triangles.len() as f64 / triangles as f64;
            if best.as_ref().is_none_or(|&(least, _)| (ratio - 1.0).abs() < least) {
                best = Some(((ratio - 1.0).abs(), section));
            }
            if best.as_ref().is_some_and(|&(least, _)| least < 0.01) {
                break;
            }
            spacing *= ratio.sqrt(); // the count goes with the inverse square of the spacing
        }
        best.expect("the loop runs at least once").1
    }

    /// A mesh whose edges are about `spacing` chords long on the middle of the aerofoil, shorter at its ends, longer far away.
    pub fn with_spacing(foil: &Aerofoil, spacing: f64) -> Self {
        let size = |point: DVec2| spacing * relative_size(foil, point);
        let outer = |turn: f64| {
            let on_circle = DVec2::from_angle(turn * std::f64::consts::TAU);
            OUTER_CENTER + foil.stream().rotate(OUTER_AXES * on_circle)
        };
        let loops = [walk(|turn| foil.contour(turn), size, 0.0), walk(outer, size, 0.37)];
        let mut cdt = triangulate(&loops);
        grade(&mut cdt, size, |point| is_inside_outer(foil, point) && foil.clearance(point) > 0.0);
        let parameters = RefinementParameters::<f64>::new()
            .with_angle_limit(AngleLimit::from_radius_to_shortest_edge_ratio(1.15)) // 25.8 degrees
            .with_max_additional_vertices(cdt.num_vertices())
            .keep_constraint_edges()
            .exclude_outer_faces(true);
        let hole = cdt.refine(parameters).excluded_faces;
        extract(&cdt, &hole)
    }
}

/// Wanted edge length at a point relative to the middle of the aerofoil: graded away from the nose, the tail, the wake and the surface.
fn relative_size(foil: &Aerofoil, point: DVec2) -> f64 {
    let tail = point - DVec2::X;
    let along_wake = tail.dot(foil.stream()).clamp(0.0, 0.5);
    let from_wake = tail.distance(foil.stream() * along_wake);
    let sizes = [0.12 + 2.0 * point.length(), 0.2 + 2.0 * tail.length(), 0.5 + 0.8 * along_wake + 3.0 * from_wake];
    sizes.into_iter().fold(0.9 + 1.6 * foil.clearance(point).max(0.0), f64::min)
}

fn is_inside_outer(foil: &Aerofoil, point: DVec2) -> bool {
    let along_stream = DVec2::new(foil.stream().x, -foil.stream().y).rotate(point - OUTER_CENTER);
    (along_stream / OUTER_AXES).length_squared() < 1.0
}

/// Points on a closed curve over turns 0 to 1, about `size` apart; `phase` in [0, 1) shifts the first away from turn 0.
fn walk(curve: impl Fn(f64) -> DVec2, size: impl Fn(DVec2) -> f64, phase: f64) -> Vec<DVec2> {
    // Sum up how many points the curve wants up to each of many samples, ...
    let samples = 1 << 16;
    let turn = |sample: f64| sample / samples as f64;
    let mut wanted = vec![0.0];
    let mut last = curve(0.0);
    for sample in 1..=samples {
        let next = curve(turn(sample as f64));
        wanted.push(wanted[sample - 1] + last.distance(next) / size((last + next) / 2.0));
        last = next;
    }
    // ... and set one where that sum passes each whole number, stretched so that it closes.
    let total = wanted[samples];
    let count = total.round().max(12.0);
    (0..count as usize)
        .map(|k| {
            let target = (k as f64 + phase) * total / count;
            let sample = wanted.partition_point(|&sum| sum <= target).clamp(1, samples) - 1;
            let fraction = (target - wanted[sample]) / (wanted[sample + 1] - wanted[sample]);
            (curve(turn(sample as f64 + fraction)) / SEED_GRID).round() * SEED_GRID
        })
        .collect()
}

/// The constrained Delaunay triangulation of closed loops.
fn triangulate(loops: &[Vec<DVec2>]) -> Cdt {
    let mut vertices = Vec::new();
    let mut edges = Vec::new();
    for points in loops {
        let first = vertices.len();
        edges.extend((0..points.len()).map(|k| [first + k, first + (k + 1) % points.len()]));
        vertices.extend(points.iter().map(|p| Point2::new(p.x, p.y)));
    }
    Cdt::bulk_load_cdt(vertices, edges).expect("seeds are finite and the two curves, each sampled in order, do not cross")
}

/// Delaunay refinement by a size field: adds the centres of circumcircles that are too large for their place, the worst first, until
/// none is left that keeps its distance from the points there are.
fn grade(cdt: &mut Cdt, size: impl Fn(DVec2) -> f64, inside: impl Fn(DVec2) -> bool) {
    loop {
        let mut centers: Vec<(f64, DVec2, _)> = cdt
            .inner_faces()
            .filter_map(|face| {
                let (center, squared_radius) = face.circumcircle();
                let center = DVec2::new(center.x, center.y);
                let excess = squared_radius.sqrt() / size(center);
                (excess > 0.8 && inside(center)).then(|| (excess, center, face.vertices()[0].fix()))
            })
            .collect();
        centers.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.x.total_cmp(&b.1.x)).then(a.1.y.total_cmp(&b.1.y)));
        let before = cdt.num_vertices();
        for (_, center, hint) in centers {
            let position = Point2::new(center.x, center.y);
            if let PositionInTriangulation::OnFace(face) = cdt.locate_with_hint(position, hint)
                && keeps_distance(&cdt.face(face), center, 0.75 * size(center))
            {
                cdt.insert_with_hint(position, hint).expect("the centre lies between finite points");
            }
        }
        if cdt.num_vertices() == before {
            break;
        }
    }
}

type Face<'a> = spade::handles::FaceHandle<'a, spade::handles::InnerTag, Point2<f64>, (), spade::CdtEdge<()>, ()>;

/// Whether a point in a face is `distance` away from its corners and outside the diametral circles of its constraint edges.
fn keeps_distance(face: &Face, point: DVec2, distance: f64) -> bool {
    let at = |p: Point2<f64>| DVec2::new(p.x, p.y) - point;
    let is_far = face.positions().into_iter().all(|corner| at(corner).length() >= distance);
    is_far
        && face.adjacent_edges().into_iter().filter(|edge| edge.is_constraint_edge()).all(|edge| {
            let [a, b] = edge.positions().map(at);
            a.dot(b) > 0.0
        })
}

/// The faces outside the hole, points renumbered by ascending x so that neighbours have near indices.
fn extract(cdt: &Cdt, hole: &[spade::handles::FixedFaceHandle<spade::handles::InnerTag>]) -> Section {
    let mut in_hole = vec![false; cdt.num_all_faces()];
    hole.iter().for_each(|face| in_hole[face.index()] = true);
    let kept: Vec<[usize; 3]> =
        cdt.inner_faces().filter(|face| !in_hole[face.fix().index()]).map(|face| face.vertices().map(|v| v.fix().index())).collect();

    let position = |index: usize| cdt.vertex(spade::handles::FixedVertexHandle::from_index(index)).data().position();
    let mut used: Vec<usize> = kept.iter().flatten().copied().collect();
    used.sort_by(|&a, &b| {
        let (a, b) = (position(a), position(b));
        a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
    });
    used.dedup();
    let mut renumbered = vec![0; cdt.num_vertices()];
    used.iter().enumerate().for_each(|(new, &old)| renumbered[old] = new as u32);

    let smallest_first = |[a, b, c]: [u32; 3]| match a.min(b).min(c) {
        least if least == a => [a, b, c],
        least if least == b => [b, c, a],
        _ => [c, a, b],
    };
    let mut triangles: Vec<[u32; 3]> = kept.iter().map(|triangle| smallest_first(triangle.map(|v| renumbered[v]))).collect();
    triangles.sort_unstable();
    let point = |&index: &usize| DVec2::new(position(index).x, position(index).y);
    Section { points: used.iter().map(point).collect(), triangles }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn foil() -> Aerofoil {
        Aerofoil::new(0.1, 0.08, 8.0)
    }

    fn corners(section: &Section, triangle: [u32; 3]) -> [DVec2; 3] {
        triangle.map(|i| section.points[i as usize])
    }

    #[test]
    fn triangles_are_positive_and_none_is_a_needle() {
        let section = Section::with_spacing(&foil(), 0.03);
        let smallest_angle = |p: [DVec2; 3]| {
            let angle = |i: usize| (p[(i + 1) % 3] - p[i]).angle_to(p[(i + 2) % 3] - p[i]);
            angle(0).min(angle(1)).min(angle(2)).to_degrees()
        };
        let angles: Vec<f64> = section.triangles.iter().map(|&t| smallest_angle(corners(&section, t))).collect();
        assert!(angles.iter().all(|&a| a > 5.0), "{:?}", angles.iter().copied().fold(90.0, f64::min));
        assert!(angles.iter().filter(|&&a| a < 25.0).count() * 20 < angles.len(), "few below the limit");
    }

    #[test]
    fn the_area_is_the_ellipse_without_the_aerofoil() {
        let section = Section::with_spacing(&foil(), 0.02);
        let area = |p: [DVec2; 3]| (p[1] - p[0]).perp_dot(p[2] - p[0]) / 2.0;
        let meshed: f64 = section.triangles.iter().map(|&t| area(corners(&section, t))).sum();
        let n = 20_000;
        let contour = |k: usize| foil().contour(k as f64 / n as f64);
        let hole: f64 = (0..n).map(|k| contour(k).perp_dot(contour(k + 1)) / 2.0).sum();
        let ellipse = std::f64::consts::PI * OUTER_AXES.x * OUTER_AXES.y;
        assert!((meshed - (ellipse - hole)).abs() < 2e-3 * ellipse, "{meshed} {ellipse} {hole}");
    }

    #[test]
    fn the_number_of_triangles_is_met() {
        for target in [700, 3000, 20_000] {
            let found = Section::with_triangles(&foil(), target).triangles.len() as f64;
            assert!((found / target as f64 - 1.0).abs() < 0.02, "{found} for {target}");
        }
    }

    #[test]
    fn sizes_follow_the_field_and_surface_points_lie_on_the_aerofoil() {
        let (foil, spacing) = (foil(), 0.03);
        let section = Section::with_spacing(&foil, spacing);
        let mut on_surface = 0;
        for &[a, b, _] in &section.triangles {
            let [p, q] = [a, b].map(|i| section.points[i as usize]);
            let ratio = p.distance(q) / (spacing * relative_size(&foil, (p + q) / 2.0));
            assert!((0.3..2.0).contains(&ratio), "{ratio} at {p}");
            on_surface += usize::from(foil.clearance(p).abs() < 1e-5);
        }
        assert!(section.points.contains(&DVec2::X), "the trailing edge is a point");
        assert!(on_surface > 50);
    }
}
