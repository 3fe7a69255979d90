//! What was measured of two meshes, as tables and JSON, and how it stands against limits.

use super::document::{Document, Figure, Table};
use super::images::significant;
use super::measured::{Field, Measured, OctreeNumbers, Side};
use crate::compare::{Norms, OneSided};
use crate::mesh::quality::{Metric, Summary};
use crate::mesh::{Association, thousands};
use glam::DVec3;
use serde_json::{Value, json};

/// How two meshes stand against one limit.
pub struct Verdict {
    pub name: &'static str,
    pub value: Option<f64>,
    pub limit: f64,
    pub passed: bool,
    pub text: String,
}

/// Judges by the limits that are given.
pub fn judge(measured: &Measured, max_distance: Option<f64>, max_difference: Option<f64>, envelope: Option<f64>) -> Vec<Verdict> {
    let mut verdicts = Vec::new();
    let distances = &measured.distances;
    if let Some(limit) = max_distance {
        let value = relative(distances.hausdorff(), distances.diagonal);
        let passed = value <= limit;
        let side = if passed { "within" } else { "above" };
        let text = format!("the Hausdorff distance is {} of the diagonal, {side} --max-distance {limit}", short(value));
        verdicts.push(Verdict { name: "max_distance", value: Some(value), limit, passed, text });
    }
    if let (Some(limit), Some(field)) = (max_difference, &measured.field) {
        let value = field.difference.largest.map(|l| field.difference.relative((l.a - l.b).abs()));
        let passed = value.is_some_and(|value| value <= limit);
        let text = match value {
            Some(value) => {
                let side = if passed { "within" } else { "above" };
                format!("the largest difference is {} of the range, {side} --max-difference {limit}", short(value))
            }
            None => "--max-difference needs a place where both fields have a value".into(),
        };
        verdicts.push(Verdict { name: "max_difference", value: value.filter(|v| v.is_finite()), limit, passed, text });
    }
    if let Some(limit) = envelope {
        // The surface is the file that is one; of two meshes the first.
        let [a, b] = &measured.sides;
        let surface_is_b = a.mesh.is_some() && b.mesh.is_none();
        let (mesh, surface, side) = if surface_is_b { (a, b, &distances.a_to_b) } else { (b, a, &distances.b_to_a) };
        let diagonal = surface.bounds.diagonal();
        let (found, bound) = (relative(side.max, diagonal), relative(side.bound, diagonal));
        let (passed, word) = if bound <= limit {
            (true, "kept")
        } else if found > limit {
            (false, "not kept")
        } else {
            (false, "undecided")
        };
        let text = format!(
            "envelope {limit} {word}: the surface of {} is up to {} away from {}, {} of the latter's diagonal",
            mesh.name,
            short(side.max),
            surface.name,
            short(found)
        );
        verdicts.push(Verdict { name: "envelope", value: Some(found), limit, passed, text });
    }
    verdicts
}

/// The tables, with the pictures that were drawn.
pub fn document(measured: &Measured, verdicts: &[Verdict], figures: Vec<Figure>) -> Document {
    let [a, b] = &measured.sides;
    let mut tables = vec![sides(measured), distances(measured)];
    tables.extend(quality(measured));
    if let Some(field) = &measured.field {
        tables.push(fields(measured, field));
    }
    if let Some(octrees) = &measured.octrees {
        tables.push(octree(measured, octrees));
    }
    let mut summary = vec![summary(measured)];
    summary.extend(verdicts.iter().map(|verdict| verdict.text.clone()));
    summary.extend(measured.notes.iter().cloned());
    for side in &measured.sides {
        summary.extend(side.notes.iter().map(|note| format!("{}: {note}", side.name)));
    }
    Document { title: format!("{} (B) against {} (A)", b.name, a.name), summary, tables, figures }
}

/// The numbers that people look for first.
fn summary(measured: &Measured) -> String {
    let distances = &measured.distances;
    let hausdorff = distances.hausdorff();
    let mut text = format!("Hausdorff distance {}, {} of the diagonal", short(hausdorff), percent(hausdorff / distances.diagonal));
    if let Some(Field { fields, difference }) = &measured.field {
        let norms = difference.over_a;
        let of = |v: f64| percent(difference.relative(v));
        let all = difference.largest.map_or(f64::NAN, |l| (l.a - l.b).abs());
        text += &format!("; {} differs by {} of its range in the L2 norm, by at most {}", fields[0].name, of(norms.l2), of(all));
    }
    if let Some(pictures) = &measured.pictures {
        let figures = pictures.covered.map_or(pictures.all.figures, |part| part.figures);
        text += &match figures.is_identical() {
            true => "; the pictures are identical".to_owned(),
            false => format!("; the pictures' PSNR is {:.1} dB", figures.psnr_db()),
        };
    }
    text
}

/// What the columns of most tables are of.
const NAMES: [&str; 2] = ["A", "B"];

/// What each is.
fn sides(measured: &Measured) -> Table {
    let mut table = Table::new("Meshes", &NAMES);
    table.columns = [0, 1].map(|i| format!("{}: {}", NAMES[i], measured.sides[i].name)).to_vec();
    let each = |say: &dyn Fn(&Side) -> String| measured.sides.iter().map(say).collect::<Vec<_>>();
    table.row("kind", each(&|side| if side.mesh.is_some() { "mesh".into() } else { "surface".into() }));
    table.row("points", each(&|side| thousands(side.points as u64)));
    let mut types: Vec<_> = measured.sides.iter().flat_map(|side| side.counts.iter().map(|count| count.0)).collect();
    types.sort_unstable();
    types.dedup();
    for cell_type in types {
        let count = |side: &Side| side.counts.iter().find(|count| count.0 == cell_type).map_or("-".into(), |count| thousands(count.1));
        table.row(cell_type.name().1, each(&count));
    }
    if measured.sides.iter().any(|side| side.mesh.as_ref().is_some_and(|mesh| !mesh.file_cells().is_tets())) {
        table.row("tets made of them", each(&|side| side.mesh.as_ref().map_or("-".into(), |mesh| thousands(mesh.tets().len() as u64))));
    }
    table.row("components", each(&|side| thousands(side.components)));
    for (name, axis) in [("x", 0), ("y", 1), ("z", 2)] {
        table.row(name, each(&|side| format!("{} .. {}", short(side.bounds.min[axis]), short(side.bounds.max[axis]))));
    }
    table.row("diagonal", each(&|side| short(side.bounds.diagonal())));
    table.row("volume", each(&|side| side.volume.map_or("- (not closed)".into(), short)));
    table.row("boundary area", each(&|side| short(side.figures.area)));
    table.row("boundary triangles", each(&|side| thousands(side.surface.triangles.len() as u64)));
    if measured.sides.iter().any(|side| side.figures.open_edges + side.figures.crowded_edges > 0) {
        table.row("open edges", each(&|side| thousands(side.figures.open_edges)));
        table.row("edges of 3 and more", each(&|side| thousands(side.figures.crowded_edges)));
    }
    table
}

/// How well the tets are shaped.
fn quality(measured: &Measured) -> Option<Table> {
    let mut table = Table::new("Quality", &NAMES);
    let all = measured.sides.each_ref().map(|side| &side.quality[..]);
    let one = |summary: Option<&Summary>| {
        summary.filter(|s| !s.min.is_nan()).map_or("-".into(), |s| format!("{} .. {} .. {}", short(s.min), short(s.median), short(s.max)))
    };
    let worst = |summary: Option<&Summary>| {
        let cell = summary.and_then(|summary| summary.worst.first()).map(|worst| worst.cell);
        cell.map_or("-".into(), |cell| format!("cell {cell}"))
    };
    let count = all.iter().map(|summaries| summaries.len()).max().unwrap_or(0);
    for i in 0..count {
        let metric = all.iter().find_map(|summaries| summaries.get(i))?.metric;
        table.row(metric.label(), all.map(|summaries| one(summaries.get(i))));
        if metric == Metric::Shape {
            table.row("  worst shape", all.map(|summaries| worst(summaries.get(i))));
        }
    }
    let infinite = all.iter().flat_map(|summaries| summaries.iter()).any(|summary| summary.infinite > 0);
    table.note = "smallest .. median .. largest; octetra quality says more".into();
    if infinite {
        table.note += "; tets of no volume are left out where a metric has no value for them";
    }
    (count > 0).then_some(table)
}

/// How far the surfaces are from each other.
fn distances(measured: &Measured) -> Table {
    let distances = &measured.distances;
    let sides = [&distances.a_to_b, &distances.b_to_a];
    let mut table = Table::new("Distance of surfaces", &["A from B", "B from A"]);
    type Number = fn(&OneSided) -> f64;
    let rows: [(&str, Number); 5] =
        [("max", |s| s.max), ("max at points", |s| s.max_at_points), ("mean", |s| s.mean), ("RMS", |s| s.rms), ("min", |s| s.min)];
    for (name, of) in rows {
        table.row(name, sides.map(|side| format!("{}  ({})", short(of(side)), percent(of(side) / distances.diagonal))));
    }
    table.row("max at", sides.map(|side| place(side.max_at + measured.sides[0].surface.origin)));
    table.row("samples", sides.map(|side| thousands(side.samples)));
    let open = distances.bound() - distances.hausdorff();
    table.note = format!(
        "in brackets parts of A's diagonal, {}. The maxima are over whole triangles; no place of either surface is further away than {}, {} more. \
         Mean and RMS are over the area",
        short(distances.diagonal),
        short(distances.bound()),
        short(open)
    );
    table
}

/// How far the fields are from each other.
fn fields(measured: &Measured, Field { fields, difference }: &Field) -> Table {
    let mut table = Table::new("Fields", &["over A", "over B"]);
    let norms = [difference.over_a, difference.over_b];
    let each = |say: &dyn Fn(&Norms) -> String| norms.iter().map(say).collect::<Vec<_>>();
    let kind = |i: usize| if fields[i].association == Association::Points { "point" } else { "cell" };
    table.row("array", [0, 1].map(|i| format!("{} ({} data)", fields[i].name, kind(i))));
    table.row("range", fields.each_ref().map(|field| format!("{} .. {}", short(field.range[0]), short(field.range[1]))));
    let with_share = |v: f64| format!("{}  ({})", short(v), percent(difference.relative(v)));
    table.row("L1 difference", each(&|n| with_share(n.l1)));
    table.row("L2 difference", each(&|n| with_share(n.l2)));
    table.row("largest difference", each(&|n| with_share(n.max)));
    table.row("mean difference", each(&|n| with_share(n.mean)));
    table.row("own integral", each(&|n| short(n.own_integral)));
    table.row("other's integral", each(&|n| short(n.other_integral)));
    table.row("volume with both", each(&|n| format!("{}  ({})", short(n.both), percent(n.both / (n.both + n.alone)))));
    table.row("volume with one only", each(&|n| format!("{}  ({})", short(n.alone), percent(n.alone / (n.both + n.alone)))));
    if norms.iter().any(|n| n.snapped > 0.0) {
        table.row("volume snapped", each(&|n| format!("{}  ({})", short(n.snapped), percent(n.snapped / (n.both + n.alone)))));
    }
    table.row("places with one only", each(&|n| format!("{} of {}", thousands(n.places_alone), thousands(n.places))));
    table.note =
        "differences are A less B, in brackets parts of A's range; norms are means over the volume, of 4 places in each tet".into();
    if norms.iter().any(|n| n.alone > 0.0 || n.places_alone > 0) {
        table.note += "; places outside the other mesh have no value of it, unless --snap takes that of its surface";
    }
    if difference.same_mesh {
        table.note += "; points and tets are equal, values are compared by number";
    }
    if let Some(largest) = difference.largest {
        let side = usize::from(!largest.is_of_a);
        let cell = measured.sides[side].mesh.as_ref().map_or(0, |mesh| mesh.file_cells().number(largest.tet as usize));
        table.note += &format!(
            ". The largest is at {}, in cell {cell} of {}: {} and {}",
            place(largest.at),
            NAMES[side],
            short(largest.a),
            short(largest.b)
        );
    }
    table
}

/// The octrees, and pictures of them.
fn octree(measured: &Measured, octrees: &[OctreeNumbers; 2]) -> Table {
    let mut table = Table::new("Octrees", &NAMES);
    let each = |say: &dyn Fn(&OctreeNumbers) -> String| octrees.iter().map(say).collect::<Vec<_>>();
    table.row("nodes", each(&|o| thousands(o.nodes as u64)));
    table.row("leaves", each(&|o| thousands(o.leaves as u64)));
    table.row("depth", each(&|o| o.depth.to_string()));
    table.row("texture", each(&|o| format!("{:.2} MiB", o.bytes as f64 / f64::from(1 << 20))));
    table.row("RMSE of the field", each(&|o| percent(o.error.by_volume.rmse_rel)));
    table.row("largest error", each(&|o| percent(o.error.by_volume.max_rel)));
    table.row("time", each(&|o| format!("{:.3} s", o.seconds)));
    table.note = "the same thresholds for both; errors are against each mesh's own field, parts of its range".into();
    if let Some(pictures) = &measured.pictures {
        let (part, of) = pictures.covered.map_or((pictures.all, "all"), |part| (part, "covered"));
        let psnr = if part.figures.is_identical() { "identical".into() } else { format!("PSNR {:.2} dB", part.figures.psnr_db()) };
        let ssim = part.ssim.map_or(String::new(), |ssim| format!(", SSIM {ssim:.5}"));
        table.note += &format!(
            ". Their pictures of {} x {} pixels: {psnr}{ssim} over {of} pixels, mean FLIP {:.5}",
            pictures.width, pictures.height, pictures.flip.mean
        );
    }
    table
}

/// Everything as JSON.
pub fn numbers(measured: &Measured, verdicts: &[Verdict]) -> Value {
    let side = |side: &Side| {
        json!({
            "file": side.path.display().to_string(), "kind": if side.mesh.is_some() { "mesh" } else { "surface" },
            "points": side.points, "tets": side.mesh.as_ref().map(|mesh| mesh.tets().len()),
            "cells": side.counts.iter().map(|(t, n)| (t.key(), json!(n))).collect::<serde_json::Map<_, _>>(),
            "bounds": [side.bounds.min.to_array(), side.bounds.max.to_array()], "diagonal": side.bounds.diagonal(),
            "volume": side.volume, "area": side.figures.area, "triangles": side.surface.triangles.len(),
            "open_edges": side.figures.open_edges, "crowded_edges": side.figures.crowded_edges, "components": side.components,
            "quality": side.quality.iter().map(|s| {
                let worst = s.worst.first().map(|worst| worst.cell);
                let of = json!({ "min": s.min, "median": s.median, "max": s.max, "mean": s.mean, "infinite": s.infinite, "worst_cell": worst });
                (s.metric.name().to_owned(), of)
            }).collect::<serde_json::Map<_, _>>(),
            "notes": side.notes,
        })
    };
    let origin = measured.sides[0].surface.origin;
    let distances = &measured.distances;
    let one_sided = |side: &OneSided| {
        json!({
            "min": side.min, "mean": side.mean, "rms": side.rms, "max": side.max, "max_bound": side.bound, "max_at_points": side.max_at_points,
            "max_at": (side.max_at + origin).to_array(), "max_near": (side.max_near + origin).to_array(), "samples": side.samples,
            "relative": {
                "min": relative(side.min, distances.diagonal), "mean": relative(side.mean, distances.diagonal),
                "rms": relative(side.rms, distances.diagonal), "max": relative(side.max, distances.diagonal),
                "max_bound": relative(side.bound, distances.diagonal),
            },
        })
    };
    let limit = |v: &Verdict| json!({ "value": v.value, "limit": v.limit, "passed": v.passed });
    json!({
        "reference": side(&measured.sides[0]), "other": side(&measured.sides[1]),
        "distance": {
            "diagonal": distances.diagonal, "tolerance": measured.options.tolerance,
            "hausdorff": distances.hausdorff(), "hausdorff_bound": distances.bound(),
            "hausdorff_relative": relative(distances.hausdorff(), distances.diagonal),
            "reference_to_other": one_sided(&distances.a_to_b), "other_to_reference": one_sided(&distances.b_to_a),
        },
        "field": measured.field.as_ref().map(|field| field_numbers(measured, field)),
        "octree": measured.octrees.as_ref().map(|octrees| octrees.each_ref().map(octree_numbers)),
        "pictures": measured.pictures.as_ref().map(|pictures| {
            let psnr = |part: Option<crate::compare::Part>| part.map(|part| part.figures.psnr_db()).filter(|v| v.is_finite());
            json!({
                "width": pictures.width, "height": pictures.height, "identical": pictures.is_identical,
                "psnr_db": psnr(Some(pictures.all)), "psnr_covered_db": psnr(pictures.covered),
                "ssim": pictures.all.ssim, "ssim_covered": pictures.covered.and_then(|part| part.ssim),
                "flip_mean": pictures.flip.mean, "flip_max": pictures.flip.max,
            })
        }),
        "notes": measured.notes,
        "limits": verdicts.iter().map(|verdict| (verdict.name.to_owned(), limit(verdict))).collect::<serde_json::Map<_, _>>(),
    })
}

fn field_numbers(measured: &Measured, Field { fields, difference }: &Field) -> Value {
    let norms = |n: &Norms| {
        json!({
            "volume_both": n.both, "volume_alone": n.alone, "volume_snapped": n.snapped, "mean": n.mean, "l1": n.l1, "l2": n.l2, "max": n.max,
            "own_integral": n.own_integral, "other_integral": n.other_integral, "places": n.places, "places_alone": n.places_alone,
            "relative": {
                "mean": difference.relative(n.mean), "l1": difference.relative(n.l1), "l2": difference.relative(n.l2),
                "max": difference.relative(n.max),
            },
        })
    };
    json!({
        "arrays": fields.each_ref().map(|field| &field.name), "ranges": fields.each_ref().map(|field| field.range),
        "same_mesh": difference.same_mesh, "over_reference": norms(&difference.over_a), "over_other": norms(&difference.over_b),
        "largest": difference.largest.map(|l| {
            let side = &measured.sides[usize::from(!l.is_of_a)];
            json!({
                "reference": l.a, "other": l.b, "at": l.at.to_array(), "of": if l.is_of_a { "reference" } else { "other" },
                "cell": side.mesh.as_ref().map(|mesh| mesh.file_cells().number(l.tet as usize)),
            })
        }),
    })
}

fn octree_numbers(octree: &OctreeNumbers) -> Value {
    let error = &octree.error.by_volume;
    json!({
        "nodes": octree.nodes, "leaves": octree.leaves, "empty": octree.empty, "depth": octree.depth, "bytes": octree.bytes,
        "seconds": octree.seconds, "rmse_rel": error.rmse_rel, "max_rel": error.max_rel,
    })
}

/// A distance in parts of a diagonal.
fn relative(distance: f64, diagonal: f64) -> f64 {
    if distance == 0.0 { 0.0 } else { distance / diagonal }
}

fn place(at: DVec3) -> String {
    format!("({}, {}, {})", short(at.x), short(at.y), short(at.z))
}

/// A number with five digits, small and large ones with an exponent.
pub fn short(value: f64) -> String {
    if value == 0.0 {
        "0".into()
    } else if (1e-4..1e7).contains(&value.abs()) {
        significant(format!("{value:.4e}").parse().unwrap_or(value))
    } else {
        format!("{value:.3e}")
    }
}

/// A share in percent.
pub fn percent(share: f64) -> String {
    if share.is_finite() { format!("{} %", short(format!("{:.2e}", share * 100.0).parse().unwrap_or(0.0))) } else { "-".into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let said = [0.0, 1.0, 0.123_456_7, -12_345.678, 1.5e-7, 3.2e9, f64::NAN].map(short);
        assert_eq!(said, ["0", "1", "0.12346", "-12346", "1.500e-7", "3.200e9", "NaN"]);
        assert_eq!([0.0, 0.012_345, 1.0, f64::NAN].map(percent), ["0 %", "1.23 %", "100 %", "-"]);
    }
}
