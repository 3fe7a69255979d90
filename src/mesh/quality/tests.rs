//! The metrics against closed forms, and against themselves under what must not matter.

use super::*;
use crate::mesh::{DataArray, FieldSelection, MeshParts, Values};
use glam::{DQuat, DVec3};
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

const REGULAR: [DVec3; 4] =
    [DVec3::ZERO, DVec3::X, DVec3::new(0.5, 0.866_025_403_784_438_6, 0.0), DVec3::new(0.5, 0.288_675_134_594_812_9, 0.816_496_580_927_726)];
const CORNER: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
const ODD: [DVec3; 4] = [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.3, 1.7, 0.0), DVec3::new(0.5, 0.4, 1.1)];

fn mirrored([a, b, c, d]: [DVec3; 4]) -> [DVec3; 4] {
    [a, b, d, c]
}

fn mesh(tets: &[[DVec3; 4]]) -> TetMesh {
    let indices = (0..tets.len() as u32).map(|i| [0, 1, 2, 3].map(|k| 4 * i + k)).collect();
    TetMesh::new(MeshParts { points: tets.concat(), tets: indices, ..MeshParts::default() }).expect("valid")
}

fn all(mesh: &TetMesh, metric: Metric, rule: Rule) -> Vec<f64> {
    values(mesh, metric, rule, &Progress::new()).expect("not cancelled")
}

/// The regular tet, the corner of a cube, and a third, whose values were also taken from VTK 9.7.
#[rustfmt::skip]
const KNOWN: [(Metric, [f64; 3]); 22] = [
    (Metric::EdgeRatio, [1.0, SQRT_2, 1.88888889]),
    (Metric::AspectRatio, [1.0, 1.3660254, 1.44524609]),
    (Metric::RadiusRatio, [1.0, 1.3660254, 1.19857098]),
    (Metric::AspectGamma, [1.0, 1.29903811, 1.23268338]),
    (Metric::AspectFrobenius, [1.0, 1.19055079, 1.14965543]),
    (Metric::Condition, [1.0, 1.22474487, 1.14758643]),
    (Metric::CollapseRatio, [0.81649658, 0.40824829, 0.45753968]),
    (Metric::Jacobian, [FRAC_1_SQRT_2, 1.0, 3.74]),
    (Metric::ScaledJacobian, [1.0, FRAC_1_SQRT_2, 0.57814716]),
    (Metric::Shape, [1.0, 0.83994737, 0.86982584]),
    (Metric::MeanRatio, [1.0, 0.76980036, 0.81123833]),
    (Metric::MinAngle, [70.5287794, 54.7356103, 54.7356103]),
    (Metric::EquiangleSkew, [0.0, 0.25, 0.36724349]),
    (Metric::EquivolumeSkew, [0.0, 0.5, 0.33268793]),
    (Metric::SquishIndex, [0.0, 0.09546597, 0.0574849]),
    (Metric::Inradius, [0.20412415, 0.21132487, 0.33955998]),
    (Metric::NormalizedInradius, [1.0, 0.61401441, 0.7590656]),
    (Metric::Distortion, [1.0, 1.0, 1.0]),
    (Metric::Volume, [0.11785113, 0.16666667, 0.62333333]),
    (Metric::Amips, [3.0, 3.57165, 3.44897]),
    // Not Verdict's. The corner has three right angles.
    (Metric::MaxAngle, [70.5287794, 90.0, 88.2913501]),
    // The three dihedral angles at a vertex less pi: 3 acos(1/3) - pi, 2 acos(1/sqrt 3) + pi/2 - pi.
    (Metric::SolidAngle, [0.55128560, 0.33983691, 0.25400366]),
];

#[test]
fn known_tets_have_their_values_in_any_orientation_of_space_and_order_of_corners() {
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 1.1);
    // Even permutations keep the orientation.
    for order in [[0, 1, 2, 3], [1, 2, 0, 3], [3, 0, 2, 1], [2, 3, 0, 1]] {
        for (metric, expected) in KNOWN {
            for (tet, expected) in [REGULAR, CORNER, ODD].into_iter().zip(expected).filter(|(_, expected)| !expected.is_nan()) {
                let tet = order.map(|i| turn * tet[i] + DVec3::new(0.3, 5.0, -1.0));
                let found = of_tet(tet, metric, Rule::Definition);
                assert!(
                    (found - expected).abs() <= 6e-9 * expected.abs().max(1.0)
                        || metric == Metric::Amips && (found - expected).abs() < 1e-5,
                    "{metric} in order {order:?}: {found}, expected {expected}"
                );
            }
        }
    }
    let energies = [CORNER, ODD].map(|tet| of_tet(tet, Metric::Amips, Rule::Definition) * of_tet(tet, Metric::Shape, Rule::Definition));
    assert!(energies.iter().all(|product| (product - 3.0).abs() < 1e-14), "{energies:?}");
}

#[test]
fn the_rules_of_vtk_are_those_it_has() {
    assert!((of_tet(ODD, Metric::CollapseRatio, Rule::Vtk) - 0.48029211).abs() < 1e-8);
    // Of the corner's edges, 02 has a right angle, and 13 one of acos(1/sqrt 3), from 180 degrees 125: the least stays.
    assert!((of_tet(CORNER, Metric::MinAngle, Rule::Vtk) - 54.7356103).abs() < 1e-7);
    // Turned so that the largest angle lies at edge 02, it makes a smallest that there is not.
    let [a, b, c, d] = ODD;
    let least = [[a, b, c, d], [a, c, d, b], [a, d, b, c]].map(|tet| of_tet(tet, Metric::MinAngle, Rule::Vtk));
    assert!(least.iter().any(|angle| (angle - 54.7356103).abs() > 1.0), "{least:?}");
}

#[test]
fn inverted_tets_are_judged_as_the_file_has_them() {
    let mesh = mesh(&[CORNER, mirrored(CORNER), mirrored(ODD)]);
    assert_eq!(mesh.inverted_count(), 2);
    for (metric, expected) in KNOWN {
        let found = all(&mesh, metric, Rule::Definition);
        let [_, corner, odd] = expected;
        let expected = match metric {
            Metric::Shape => [0.0, 0.0],
            Metric::Amips => [f64::INFINITY; 2],
            // Normals point inwards.
            Metric::SquishIndex => [2.0, 1.96505662],
            // The least of negative heights, and of radii, is the one furthest below 0.
            Metric::CollapseRatio => [-FRAC_1_SQRT_2, -1.06495559],
            Metric::NormalizedInradius => [-0.75802069, -0.90922833],
            Metric::Condition | Metric::Jacobian | Metric::ScaledJacobian | Metric::MeanRatio | Metric::Inradius | Metric::Volume => {
                [-corner, -odd]
            }
            _ => [corner, odd],
        };
        for (found, expected) in found[1..].iter().zip(expected).filter(|(_, expected)| !expected.is_nan()) {
            assert!(
                *found == expected || (found - expected).abs() <= 6e-9 * expected.abs().max(1.0),
                "{metric}: {found}, expected {expected}"
            );
        }
        let by_itself = [CORNER, mirrored(CORNER), mirrored(ODD)].map(|tet| of_tet(tet, metric, Rule::Definition));
        for (of_mesh, alone) in found.iter().zip(by_itself) {
            assert!(*of_mesh == alone || (of_mesh - alone).abs() < 1e-14 * alone.abs(), "{metric}: {of_mesh}, by itself {alone}");
        }
    }
}

#[test]
fn sizes_are_against_the_mean_of_the_mesh() {
    // Volumes 1/6, 8/6 and -1/6, the mean 8/18.
    let mesh = mesh(&[CORNER, CORNER.map(|p| p * 2.0), mirrored(CORNER)]);
    let size = all(&mesh, Metric::RelativeSizeSquared, Rule::Definition);
    let (small, large) = ((3.0f64 / 8.0).powi(2), (1.0f64 / 3.0).powi(2));
    assert!((size[0] - small).abs() < 1e-15 && (size[1] - large).abs() < 1e-15 && size[2] == 0.0, "{size:?}");
    let both = all(&mesh, Metric::ShapeAndSize, Rule::Definition);
    assert!((both[1] - large * 0.83994737).abs() < 1e-8 && both[2] == 0.0);
    // Against a mean that is not above 0 there are none.
    let mesh = self::mesh(&[CORNER, mirrored(ODD)]);
    assert!(all(&mesh, Metric::RelativeSizeSquared, Rule::Definition).iter().all(|size| size.is_infinite()));
}

#[test]
fn neither_size_nor_number_of_tets_changes_a_value() {
    // More than a block, whose last is not full, of tets far smaller and larger than 1.
    for size in [1e-60, 1.0, 1e90] {
        let tets: Vec<_> = (0..150).map(|i| if i % 3 == 1 { mirrored(ODD) } else { ODD }.map(|p| p * size)).collect();
        let mesh = mesh(&tets);
        for metric in Metric::ALL.into_iter().filter(|m| ![Metric::RelativeSizeSquared, Metric::ShapeAndSize].contains(m)) {
            let unit = match metric {
                Metric::Inradius => size,
                Metric::Jacobian | Metric::Volume => size * size * size,
                _ => 1.0,
            };
            let expected = [ODD, mirrored(ODD)].map(|tet| of_tet(tet, metric, Rule::Definition) * unit);
            for (i, found) in all(&mesh, metric, Rule::Definition).into_iter().enumerate() {
                let expected = expected[usize::from(i % 3 == 1)];
                assert!(
                    found == expected || (found - expected).abs() < 1e-12 * expected.abs(),
                    "{metric} at {size:e}: {found}, expected {expected}"
                );
            }
        }
    }
}

#[test]
fn flat_tets_are_counted_apart_and_come_first_among_the_worst() {
    let flat = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)];
    let point = [DVec3::X; 4];
    let mesh = mesh(&[REGULAR, flat, CORNER, point]);
    for metric in Metric::ALL {
        let values = all(&mesh, metric, Rule::Definition);
        let summary = Summary::new(&mesh, metric, &values, 10, 2);
        assert!(values[0].is_finite() && values[2].is_finite(), "{metric}");
        let infinite = match metric {
            Metric::Distortion | Metric::Volume | Metric::Jacobian | Metric::RelativeSizeSquared => 0,
            _ if metric.of_flat() == Some(f64::INFINITY) => 2,
            // A point has no ratios and angles.
            Metric::Shape | Metric::ShapeAndSize | Metric::EquivolumeSkew | Metric::NormalizedInradius => 0,
            _ => 1,
        };
        assert_eq!(summary.infinite, infinite, "{metric}: {values:?}");
        assert_eq!(summary.bins.iter().map(|bin| bin.count).sum::<usize>() + summary.below + summary.above + infinite, 4, "{metric}");
        if infinite == 2 {
            assert_eq!(summary.worst.iter().map(|worst| worst.tet).collect::<Vec<_>>(), [1, 3], "{metric}");
        }
    }
}

#[test]
fn summaries_are_those_of_the_numbers() {
    let tets: Vec<_> = (1..=9).map(|i| CORNER.map(|p| p * f64::from(i).cbrt())).collect();
    let mesh = mesh(&tets);
    let volumes = all(&mesh, Metric::Jacobian, Rule::Definition);
    let s = Summary::new(&mesh, Metric::Jacobian, &volumes, 4, 2);
    let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
    assert!(
        [(s.min, 1.0), (s.q1, 3.0), (s.median, 5.0), (s.q3, 7.0), (s.max, 9.0), (s.mean, 5.0), (s.std, (60.0f64 / 9.0).sqrt())]
            .iter()
            .all(|&(a, b)| near(a, b)),
        "{s:?}"
    );
    assert_eq!((s.outside, s.infinite, s.tets, s.below, s.above), (Some(0), 0, 9, 0, 0));
    assert_eq!(s.bins.iter().map(|bin| bin.count).sum::<usize>(), 9);
    assert!(near(s.bins[0].low, 1.0) && near(s.bins[3].high, 9.0));
    assert_eq!(s.worst.iter().map(|w| (w.tet, w.cell)).collect::<Vec<_>>(), [(0, 0), (1, 1)]);
    assert!((s.worst[0].center - DVec3::splat(0.25)).length() < 1e-12, "world coordinates: {}", s.worst[0].center);
    let even = Summary::new(&mesh, Metric::Jacobian, &volumes[..4], 1, 0);
    assert!(near(even.q1, 1.75) && near(even.median, 2.5) && even.worst.is_empty());
    let shapes = Summary::new(&mesh, Metric::MinAngle, &all(&mesh, Metric::MinAngle, Rule::Definition), 9, 1);
    assert_eq!((shapes.outside, shapes.bins[6].count), (Some(0), 9), "54.7 degrees are in the bin from 48 to 56");
}

#[test]
fn metrics_are_fields_by_name() {
    let flat = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)];
    let mesh = mesh(&[REGULAR, flat, CORNER]);
    let select = |mesh: &TetMesh, name: &str| ScalarField::select(mesh, &FieldSelection { name: Some(name.into()), ..Default::default() });
    let field = select(&mesh, "quality:aspect_ratio").expect("a metric");
    assert_eq!((field.name.as_str(), field.association, field.values.len()), ("quality:aspect_ratio", Association::Cells, 3));
    assert!(field.values[1].is_nan() && (field.range[1] - 1.3660254).abs() < 1e-7);
    assert_eq!(select(&mesh, "quality:Min-Angle").expect("a metric").name, "quality:min_angle");
    let message = select(&mesh, "quality:beauty").expect_err("no metric").to_string();
    assert!(message.starts_with("there is no metric \"beauty\"; there are scaled_jacobian, shape,"), "{message}");
    // An array of the file that has the name is that array.
    let points = CORNER.to_vec();
    let cell_data = vec![DataArray { name: "quality:shape".into(), components: 1, values: Values::F32(vec![7.0]) }];
    let own = TetMesh::new(MeshParts { points, tets: vec![[0, 1, 2, 3]], cell_data, ..MeshParts::default() }).expect("valid");
    assert_eq!(select(&own, "quality:shape").expect("an array").values, [7.0]);
}

#[test]
fn names_are_read_back_and_no_two_are_alike() {
    for (i, metric) in Metric::ALL.into_iter().enumerate() {
        assert_eq!(metric.name().parse(), Ok(metric));
        assert_eq!(Metric::ALL.iter().position(|other| other.name() == metric.name()), Some(i));
        let [low, high] = metric.bins().unwrap_or([0.0, 1.0]);
        assert!(low < high && !metric.label().is_empty() && !metric.formula().is_empty());
        // The regular tet is acceptable, wherever something is.
        let regular = of_tet(REGULAR, metric, Rule::Definition);
        assert!(metric.acceptable().is_none_or(|a| a.range[0] - 1e-9 <= regular && regular <= a.range[1] + 1e-9), "{metric}: {regular}");
    }
}

#[test]
fn a_mesh_with_its_values_is_written_as_the_file_had_it() {
    let mesh = mesh(&[CORNER, mirrored(ODD)]);
    let metrics = vec![(Metric::Volume, all(&mesh, Metric::Volume, Rule::Definition))];
    let again = crate::mesh::collect(&WithValues { mesh: &mesh, metrics }).expect("valid");
    assert_eq!((again.is_inverted(0), again.is_inverted(1)), (false, true));
    let array = &again.cell_data()[0];
    assert_eq!((array.name.as_str(), array.values.get(1)), ("quality:volume", all(&again, Metric::Volume, Rule::Definition)[1]));
    assert!(array.values.get(1) < 0.0);
}

#[test]
fn the_functions_of_our_own_are_as_good_as_the_standard_ones() {
    for i in 0..=100_000 {
        let x = f64::from(i) * std::f64::consts::PI / 100_000.0;
        let found = formulas::angle(3.0 * x.sin(), 3.0 * x.cos());
        assert!((found - x).abs() <= 1e-15 * x.max(0.4), "{x}: {found}");
        let y = 10f64.powf(f64::from(i) / 250.0 - 200.0);
        assert!((formulas::cube_root(y) - y.cbrt()).abs() <= 1e-15 * y.cbrt(), "{y}");
    }
    assert!(formulas::angle(0.0, 0.0).is_nan() && formulas::angle(f64::NAN, 1.0).is_nan());
    assert_eq!(
        (formulas::cube_root(0.0), formulas::angle(0.0, -2.0), formulas::angle(1.0, 0.0)),
        (0.0, std::f64::consts::PI, std::f64::consts::FRAC_PI_2)
    );
}
