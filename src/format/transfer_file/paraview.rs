//! ParaView's colour maps to transfer functions and back.

use super::{NamedTransfer, TransferFileProblem};
use crate::view::{ColorMap, ColorSpace, Scale, TransferFunction};
use serde::Deserialize;
use serde_json::{Value, json};

/// Pieces that a smooth part of an opacity function becomes.
const PIECES: u32 = 16;

/// A colour map as ParaView writes it; other keys are of no use here.
#[derive(Deserialize)]
struct Map {
    #[serde(rename = "ColorSpace")]
    space: Option<String>,
    #[serde(rename = "HSVWrap")]
    wraps: Option<Flag>,
    /// x, r, g, b again and again.
    #[serde(rename = "RGBPoints", default)]
    points: Vec<f64>,
    /// r, g, b again and again.
    #[serde(rename = "IndexedColors", default)]
    indexed: Vec<f64>,
    /// x, opacity, midpoint, sharpness again and again.
    #[serde(rename = "Points", default)]
    opacity: Vec<f64>,
    #[serde(rename = "UseLogScale")]
    is_log: Option<Flag>,
    #[serde(rename = "NanColor")]
    nan: Option<[f64; 3]>,
    #[serde(rename = "BelowRangeColor")]
    below: Option<[f64; 3]>,
    #[serde(rename = "AboveRangeColor")]
    above: Option<[f64; 3]>,
    #[serde(rename = "UseBelowRangeColor")]
    has_below: Option<Flag>,
    #[serde(rename = "UseAboveRangeColor")]
    has_above: Option<Flag>,
}

/// What is written as a truth value or a number.
#[derive(Deserialize, Clone, Copy)]
#[serde(untagged, expecting = "expected true, false, 0 or 1")]
enum Flag {
    Truth(bool),
    Number(f64),
}

fn is_set(flag: Option<Flag>, default: bool) -> bool {
    match flag {
        Some(Flag::Truth(truth)) => truth,
        Some(Flag::Number(number)) => number != 0.0,
        None => default,
    }
}

/// Whether it looks like a colour map.
pub fn is_map(value: &Value) -> bool {
    value.get("RGBPoints").is_some() || value.get("IndexedColors").is_some()
}

/// The transfer function of a colour map; `unnamed` is what one without a name is called.
pub fn from_paraview(value: &Value, unnamed: &str) -> Result<NamedTransfer, TransferFileProblem> {
    let name = value.get("Name").and_then(Value::as_str).unwrap_or(unnamed).to_owned();
    let wrong = |what: String| TransferFileProblem::Map { name: name.clone(), what };
    let map = Map::deserialize(value).map_err(|error| wrong(error.to_string()))?;
    let points = tuples::<4>(&map.points, "RGBPoints", "x, r, g, b").map_err(wrong)?;
    let indexed = tuples::<3>(&map.indexed, "IndexedColors", "r, g, b").map_err(wrong)?;
    let opacity = tuples::<4>(&map.opacity, "Points", "x, opacity, midpoint, sharpness").map_err(wrong)?;
    let is_log = is_set(map.is_log, false);
    let color = if points.is_empty() {
        // Categories are bands of one width.
        let width = 1.0 / indexed.len().max(1) as f64;
        let band = |(i, &[r, g, b]): (usize, &[f64; 3])| [[i as f64 * width, r, g, b], [(i + 1) as f64 * width, r, g, b]];
        indexed.iter().enumerate().flat_map(band).collect()
    } else {
        let space = match map.space.as_deref().unwrap_or("RGB") {
            "RGB" => ColorSpace::Rgb,
            "Lab" | "CIELAB" | "Lab/CIEDE2000" | "Lab/CIED2000" => ColorSpace::Lab,
            "HSV" => ColorSpace::Hsv { wraps: is_set(map.wraps, false) },
            "Diverging" => ColorSpace::Diverging,
            "Step" => ColorSpace::Step,
            other => return Err(wrong(format!("ColorSpace is \"{other}\", expected RGB, Lab, CIELAB, HSV, Diverging or Step"))),
        };
        ColorMap { name: name.clone(), space, points: over_unit_range(points, is_log) }.bake()
    };
    if color.is_empty() {
        return Err(wrong("has no colours".into()));
    }
    let mut function = TransferFunction::of_color(color);
    if !opacity.is_empty() {
        function.opacity = opacity_knots(&over_unit_range(opacity, is_log));
    }
    if is_log {
        function.scale = Scale::Log;
    }
    function.nan = map.nan;
    function.below = map.below.filter(|_| is_set(map.has_below, true));
    function.above = map.above.filter(|_| is_set(map.has_above, true));
    function.validate().map_err(|error| wrong(error.to_string()))?;
    Ok(NamedTransfer { name: name.clone(), function })
}

/// Numbers that stand one behind the other.
fn tuples<const N: usize>(numbers: &[f64], key: &str, of: &str) -> Result<Vec<[f64; N]>, String> {
    let (tuples, rest) = numbers.as_chunks::<N>();
    if rest.is_empty() { Ok(tuples.to_vec()) } else { Err(format!("{key} has {} numbers, expected {of} again and again", numbers.len())) }
}

/// Points in ascending order with x from 0 to 1, by the logarithm of x if it has one.
fn over_unit_range(mut points: Vec<[f64; 4]>, is_log: bool) -> Vec<[f64; 4]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0])); // stable: steps keep their order
    let range = [points[0][0], points[points.len() - 1][0]];
    // Maps from 0 to 1 may be meant for a log scale too.
    let scale = if is_log { Scale::Log.or_linear(range) } else { Scale::Linear };
    for point in &mut points {
        point[0] = if point[0] == range[1] && range[0] < range[1] { 1.0 } else { scale.position(range, point[0]) };
    }
    points
}

/// Knots `[x, opacity]` of points with a midpoint and a sharpness, which say how opacity gets to the next (vtkPiecewiseFunction).
fn opacity_knots(points: &[[f64; 4]]) -> Vec<[f64; 2]> {
    let mut knots = vec![[points[0][0], points[0][1]]];
    for pair in points.windows(2) {
        let ([x0, y0, middle, sharpness], [x1, y1, ..]) = (pair[0], pair[1]);
        let middle = middle.clamp(1e-5, 1.0 - 1e-5);
        let at = |half: f64| x0 + (x1 - x0) * if half <= 0.5 { 2.0 * half * middle } else { middle + (2.0 * half - 1.0) * (1.0 - middle) };
        if x1 > x0 && y0 != y1 && sharpness > 0.99 {
            knots.extend([[at(0.5), y0], [at(0.5), y1]]);
        } else if x1 > x0 && y0 != y1 && sharpness >= 0.01 {
            // `half` goes from 0 to 1, with the midpoint at 0.5.
            for half in (1..PIECES).map(|i| f64::from(i) / f64::from(PIECES)) {
                let power = 1.0 + 10.0 * sharpness;
                let t = if half < 0.5 { 0.5 * (2.0 * half).powf(power) } else { 1.0 - 0.5 * (2.0 - 2.0 * half).powf(power) };
                let (t2, t3) = (t * t, t * t * t);
                let tangent = (1.0 - sharpness) * (y1 - y0);
                let y = y0 * (2.0 * t3 - 3.0 * t2 + 1.0) + y1 * (3.0 * t2 - 2.0 * t3) + tangent * (2.0 * t3 - 3.0 * t2 + t);
                knots.push([at(half), y.clamp(y0.min(y1), y0.max(y1))]);
            }
        } else if x1 > x0 && middle != 0.5 {
            knots.push([at(0.5), 0.5 * (y0 + y1)]);
        }
        knots.push([x1, y1]);
    }
    knots
}

/// A transfer function as an array of one colour map that ParaView imports: colours in RGB and opacity over the range (data units) or over
/// [0, 1], log scale, colours for NaN and beyond the range. Discrete colours are written as steps, a symlog scale as what it is over its
/// range. What opacity refers to, its model and thresholds ParaView has elsewhere.
pub fn to_paraview(name: &str, function: &TransferFunction) -> Result<Value, TransferFileProblem> {
    function.validate()?;
    let color = function.stepped_color().into_owned();
    let plain = TransferFunction { color, steps: None, below: None, above: None, threshold: None, ..function.clone() };
    let plain = match (function.scale, function.range) {
        (Scale::Symlog(_), None) => return Err(TransferFileProblem::NoRange),
        (Scale::Symlog(_), Some(range)) => plain.in_data(range).into_owned(),
        _ => plain,
    };
    let (plain, scale) = (plain.over_unit_range(), plain.scale);
    // Any range will do for a map that is laid over the data's.
    let range = function.range.unwrap_or(if scale == Scale::Log { [1.0, 10.0] } else { [0.0, 1.0] });
    let place = |x: f64| scale.value(range, x);
    let points: Vec<f64> = plain.color.iter().flat_map(|&[x, r, g, b]| [place(x), r, g, b]).collect();
    let opacity: Vec<f64> = plain.opacity.iter().flat_map(|&[x, opacity]| [place(x), opacity, 0.5, 0.0]).collect();
    let mut map = json!({ "ColorSpace": "RGB", "Name": name, "Points": opacity, "RGBPoints": points });
    if scale == Scale::Log {
        map["UseLogScale"] = 1.into();
    }
    for (key, flag, color) in [
        ("NanColor", None, function.nan),
        ("BelowRangeColor", Some("UseBelowRangeColor"), function.below),
        ("AboveRangeColor", Some("UseAboveRangeColor"), function.above),
    ] {
        if let Some(color) = color {
            map[key] = json!(color);
            if let Some(flag) = flag {
                map[flag] = 1.into();
            }
        }
    }
    Ok(json!([map]))
}
