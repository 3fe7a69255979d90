//! What is seen at a pixel: the place on its ray that gives most of its light. No shader has a twin of this.

use super::ray::Ray;
use super::surface::intervals_on;
use crate::mesh::BoundarySurface;
use crate::octree::OctreeTexture;
use crate::optics::Classifier;
use crate::view::{CubeRays, RayFrame};
use glam::DVec3;

/// A ray is looked at in at most so many pieces.
const MAX_PIECES: f32 = 4096.0;

/// Behind this nothing is seen.
const LEAST_TRANSMITTANCE: f64 = 1e-4;

/// What a ray sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Picked {
    /// Where, relative to the centre that the frame is relative to.
    pub at: DVec3,
    /// The share of the pixel that the piece of the ray around it makes up, above 0 and at most 1.
    pub opacity: f64,
}

/// The place on the ray of pixel (column, row) that counts most in the picture: the middle, by opacity, of the piece of the ray with the
/// largest opacity times the transmittance before it. Pieces are half as long as the finest leaves' edge; of pieces that count alike it is
/// the first. `None` where nothing is seen.
///
/// The ray is followed inside `surface`, where there is one, and where the frame's planes do not clip it, through the texture's reconstructed field, classified piece by piece.
pub fn pick(
    texture: &OctreeTexture,
    surface: Option<&BoundarySurface>,
    frame: &RayFrame,
    [column, row]: [u32; 2],
    classifier: &Classifier,
) -> Option<Picked> {
    let rays = CubeRays::new(frame, texture.root_min(), texture.root_edge());
    let ray = Ray::enter(rays.ray(column, row), &rays.clips);
    if ray.t_out <= 0.0 {
        return None;
    }
    let mut spans = surface.map_or_else(|| vec![(0.0, ray.t_out)], |surface| intervals_on(surface, &ray));
    spans.iter_mut().for_each(|span| span.1 = span.1.min(ray.t_out));
    spans.retain(|span| span.0 < span.1);
    let whole = spans.iter().map(|span| span.1 - span.0).sum::<f32>() * ray.length;
    let step = (0.5 * (-f32::from(texture.depth())).exp2()).max(whole / MAX_PIECES);
    let table = classifier.table(texture.root_edge());
    let (mut transmittance, mut best): (f64, Option<Picked>) = (1.0, None);
    for (begin, end) in spans {
        let length = (end - begin) * ray.length;
        let pieces = (length / step).ceil().max(1.0);
        for k in 0..pieces as u32 {
            let place = |part: f32| ray.origin + ray.direction * (begin + (end - begin) * ((k as f32 + part) / pieces));
            let Some(value) = texture.value_at(place(0.5).as_dvec3()) else { continue };
            let depth = f64::from(table.classify(table.interval(value), value).extinction * (length / pieces));
            let alpha = -(-depth).exp_m1();
            let opacity = transmittance * alpha;
            if opacity > best.map_or(0.0, |best| best.opacity) {
                // Where half of the piece's opacity lies before it.
                let part = if depth > 1e-6 { -(-0.5 * alpha).ln_1p() / depth } else { 0.5 };
                best = Some(Picked { at: texture.root_min() + place(part as f32).as_dvec3() * texture.root_edge(), opacity });
            }
            transmittance *= 1.0 - alpha;
            if transmittance < best.map_or(0.0, |best| best.opacity).max(LEAST_TRANSMITTANCE) {
                return best;
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::generate::{Shape, plan};
    use crate::mesh::{FieldSelection, ScalarField, collect};
    use crate::octree::{CellKind, Octree};
    use crate::view::{Camera, Projection, TransferFunction};
    use glam::UVec3;

    const DEPTH: u8 = 5;

    /// Leaves of one depth over [-1, 1]^3 with the value of their centre.
    fn texture(value: impl Fn(DVec3) -> f32) -> OctreeTexture {
        let kind = |at: UVec3, depth: u8| match depth {
            DEPTH => CellKind::Leaf(value((at.as_dvec3() + 0.5) / f64::from(1 << (DEPTH - 1)) - 1.0)),
            _ => CellKind::Split,
        };
        OctreeTexture::encode(&Octree::from_fn(DVec3::splat(-1.0), 2.0, [0.0, 1.0], kind)).expect("fits")
    }

    /// The edge of a leaf.
    const CELL: f64 = 2.0 / (1 << DEPTH) as f64;

    /// A transfer function by opacity a unit of length.
    fn classifier(opacity: &[[f64; 2]]) -> Classifier {
        let tf = TransferFunction { opacity: opacity.to_vec(), unit_distance: Some(1e-3), ..TransferFunction::standard() };
        Classifier::new(&tf, [0.0, 1.0], 1.0)
    }

    /// From the side along x, through (y, z) = (0.03, 0.01) in the middle.
    fn frame(projection: Projection) -> RayFrame {
        let (eye, target) = (DVec3::new(-5.0, 0.03, 0.01), DVec3::new(0.0, 0.03, 0.01));
        Camera { eye, target, up: DVec3::Z, projection }.frame(DVec3::ZERO, 65, 65)
    }

    const PARALLEL: Projection = Projection::Parallel { view_height: 2.0 };

    #[test]
    fn an_opaque_slab_is_seen_at_its_face() {
        // From x = 0.25 on, four cells thick; a veil of 1/1000 of its extinction before.
        let texture = texture(|p| if (0.25..0.5).contains(&p.x) { 1.0 } else { 0.25 });
        let classifier = classifier(&[[0.0, 0.0], [0.5, 1e-5], [0.5, 1.0], [1.0, 1.0]]);
        // Oblique rays meet the face somewhere in a piece, which is seen by its middle.
        for (projection, within) in [(PARALLEL, 1e-5), (Projection::Perspective { fov_y_degrees: 20.0 }, 0.26 * CELL)] {
            let frame = frame(projection);
            for pixel in [[32, 32], [20, 40]] {
                let picked = pick(&texture, None, &frame, pixel, &classifier).expect("the slab");
                let (origin, direction) = frame.ray(pixel[0], pixel[1]);
                let off = (picked.at - origin).reject_from(direction).length();
                // Half of the light comes from the first ln 2 of optical depth.
                let expected = 0.25 + std::f64::consts::LN_2 / 1000.0;
                assert!((picked.at.x - expected).abs() < within && off < 1e-5, "{picked:?}, {off} beside the ray");
                assert!(picked.opacity > 0.9);
            }
        }
        let nothing = classifier_of_nothing();
        assert_eq!(pick(&texture, None, &frame(PARALLEL), [32, 32], &nothing), None);
    }

    fn classifier_of_nothing() -> Classifier {
        classifier(&[[0.0, 0.0], [1.0, 0.0]])
    }

    #[test]
    fn a_shell_is_seen_before_the_core_only_if_it_counts_for_more() {
        // A shell of radii 0.7 to 0.8 and a core of 0.3 in an empty ball.
        let texture = texture(|p| match p.length() {
            r if r < 0.3 => 1.0,
            r if (0.7..0.8).contains(&r) => 0.5,
            _ => 0.0,
        });
        // Extinction 0.3 per unit in the shell: pieces of half a cell have less than 1 % of opacity; the core is opaque.
        let seen = |shell: f64| {
            let knots = [[0.0, 0.0], [0.25, 0.0], [0.25, shell], [0.75, shell], [0.75, 1.0], [1.0, 1.0]];
            pick(&texture, None, &frame(PARALLEL), [32, 32], &classifier(&knots)).expect("something").at.length()
        };
        assert!((seen(3e-4) - 0.3).abs() < CELL, "the core through a thin shell: {}", seen(3e-4));
        assert!((seen(1.0) - 0.8).abs() < CELL, "the outside of an opaque shell: {}", seen(1.0));
    }

    #[test]
    fn what_lies_behind_counts_for_what_gets_through() {
        // Two slabs of one cell, two pieces each: of opacity `front` and 0.7 a piece.
        let texture = texture(|p| match p.x {
            x if (-0.5..-0.4375).contains(&x) => 0.5,
            x if (0.25..0.3125).contains(&x) => 1.0,
            _ => 0.0,
        });
        // Opacity of a thousandth of a unit that makes that of a piece.
        let thin = |piece: f64| -(-piece).ln_1p() / (0.5 * CELL) * 1e-3;
        let seen = |front: f64| {
            let (front, back) = (thin(front), thin(0.7));
            let knots = [[0.0, 0.0], [0.25, 0.0], [0.25, front], [0.75, front], [0.75, back], [1.0, back]];
            pick(&texture, None, &frame(PARALLEL), [32, 32], &classifier(&knots)).expect("something")
        };
        // 0.35 before 0.65^2 0.7 = 0.296, and 0.2 before 0.8^2 0.7 = 0.448.
        let (front, back) = (seen(0.35), seen(0.2));
        assert!((-0.5..-0.5 + CELL / 2.0).contains(&front.at.x) && (front.opacity - 0.35).abs() < 1e-4, "{front:?}");
        assert!((0.25..0.25 + CELL / 2.0).contains(&back.at.x) && (back.opacity - 0.448).abs() < 1e-4, "{back:?}");
    }

    #[test]
    fn rays_see_what_lies_inside_the_surface() {
        let ball = collect(&*plan(Shape::Ball, Some(6 * 20 * 20 * 20)).expect("a size")).expect("valid");
        let field = ScalarField::select(&ball, &FieldSelection::default()).expect("a field");
        let surface = BoundarySurface::new(&ball, &field);
        let (low, edge) = ball.root_cube();
        let kind = |_: UVec3, depth: u8| if depth == 4 { CellKind::Leaf(0.5) } else { CellKind::Split };
        let texture = OctreeTexture::encode(&Octree::from_fn(low, edge, [0.0, 1.0], kind)).expect("fits");
        let opaque = classifier(&[[0.0, 1.0]]);
        let radius = ball.bounds().size().x / 2.0;
        let picked = pick(&texture, Some(&surface), &frame(PARALLEL), [32, 32], &opaque).expect("the ball").at;
        assert!((picked.length() / radius - 1.0).abs() < 0.01 && picked.x < 0.0, "{picked}");
        assert_eq!(pick(&texture, Some(&surface), &frame(PARALLEL), [1, 1], &opaque), None, "a corner of the cube beside the ball");
        let through = pick(&texture, None, &frame(PARALLEL), [1, 1], &opaque).expect("the cube").at;
        assert!((through.x - low.x).abs() < 0.01 * edge, "{through}");
    }
}
