//! Colour maps as ParaView writes them, and back.

use super::*;
use crate::view::Scale;

fn one(text: &str) -> TransferFunction {
    let mut all = parse(text, "stem").unwrap_or_else(|problem| panic!("{text}: {problem}"));
    assert_eq!(all.len(), 1);
    all.remove(0).function
}

fn problem(text: &str) -> String {
    parse(text, "stem").expect_err(text).to_string()
}

/// Colour at x, by the function's own knots.
fn color_at(function: &TransferFunction, x: f64) -> [f64; 3] {
    let i = function.color.partition_point(|k| k[0] <= x).clamp(1, function.color.len() - 1);
    let (a, b) = (function.color[i - 1], function.color[i]);
    let f = ((x - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0);
    [1, 2, 3].map(|c| a[c] + f * (b[c] - a[c]))
}

fn assert_near<const N: usize>(found: &[[f64; N]], expected: &[[f64; N]]) {
    assert_eq!(found.len(), expected.len(), "{found:?}, expected {expected:?}");
    for (f, e) in found.as_flattened().iter().zip(expected.as_flattened()) {
        assert!((f - e).abs() < 1e-12, "{found:?}, expected {expected:?}");
    }
}

#[test]
fn every_colour_space_is_interpolated_in_itself() {
    let map = |space: &str, more: &str| {
        one(&format!(r#"[{{"ColorSpace": "{space}", "Name": "m", {more} "RGBPoints": [-1, 1, 0, 0, 3, 0, 0, 1]}}]"#))
    };
    let near = |found: [f64; 3], expected: [f64; 3]| {
        assert!(found.iter().zip(expected).all(|(f, e)| (f - e).abs() < 0.01), "{found:?}, expected {expected:?}");
    };
    near(color_at(&map("RGB", ""), 0.5), [0.5, 0.0, 0.5]);
    near(color_at(&map("HSV", ""), 0.5), [0.0, 1.0, 0.0]);
    near(color_at(&map("HSV", r#""HSVWrap": 1,"#), 0.5), [1.0, 0.0, 1.0]);
    near(color_at(&map("HSV", r#""HSVWrap": false,"#), 0.5), [0.0, 1.0, 0.0]);
    // Halfway in CIELAB: L 42.8, a 79.6, b -20.3 (the mean of the CIE's numbers for sRGB's red and blue).
    near(color_at(&map("Lab", ""), 0.5), [0.792, 0.0, 0.536]);
    assert_eq!(map("CIELAB", ""), map("Lab", ""));
    let [r, g, b] = color_at(&map("Diverging", ""), 0.5);
    assert!(r > 0.8 && (r - g).abs() < 0.01 && (g - b).abs() < 0.01, "through white: {r}, {g}, {b}");
    assert_eq!(map("Step", "").color, [[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0]]);
    assert_eq!(map("RGB", "").opacity, [[0.0, 0.0], [1.0, 0.5]], "the usual ramp");
    assert!(problem(r#"{"ColorSpace": "YUV", "RGBPoints": [0, 0, 0, 0]}"#).contains("ColorSpace is \"YUV\""));
}

#[test]
fn paraviews_own_file_ends_in_commas() {
    let text = r#"[ {"Name": "a, ]", "RGBPoints": [0,0,0,0, 1,1,1,1,], }, {"Name": "b\",]", "NanColor": [1, 1, 0], "IndexedColors": [0,0,0, 1,0,0], } , ]"#;
    let all = parse(text, "stem").expect("lenient");
    assert_eq!(all.iter().map(|map| map.name.as_str()).collect::<Vec<_>>(), ["a, ]", "b\",]"], "strings stay as they are");
    assert_eq!(all[1].function.color, [[0.0, 0.0, 0.0, 0.0], [0.5, 0.0, 0.0, 0.0], [0.5, 1.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0]]);
    assert_eq!((all[0].function.nan, all[1].function.nan), (None, Some([1.0, 1.0, 0.0])));
    assert!(problem("[,]").contains("line 1 column 2"), "{}", problem("[,]"));
    assert_eq!(parse(r#"[{"RGBPoints": [0,0,0,0]}, {"RGBPoints": [0,0,0,0]}]"#, "f").expect("unnamed")[1].name, "f 2");
}

#[test]
fn log_scales_are_normalised_by_logarithms() {
    let map = one(
        r#"{"Name": "m", "UseLogScale": 1, "RGBPoints": [0.01, 0,0,0, 0.1, 1,0,0, 100, 1,1,1], "Points": [0.01, 0, 0.5, 0, 1, 1, 0.5, 0, 100, 0.5, 0.5, 0]}"#,
    );
    assert_eq!(map.scale, Scale::Log);
    assert_near(&map.color, &[[0.0, 0.0, 0.0, 0.0], [0.25, 1.0, 0.0, 0.0], [1.0, 1.0, 1.0, 1.0]]);
    assert_near(&map.opacity, &[[0.0, 0.0], [0.5, 1.0], [1.0, 0.5]]);
    // A map over [0, 1] can be meant for a log scale.
    let unit = one(r#"{"UseLogScale": true, "RGBPoints": [0, 0,0,0, 0.5, 1,0,0, 1, 1,1,1]}"#);
    assert_eq!((unit.scale, unit.color[1][0]), (Scale::Log, 0.5));
}

#[test]
fn opacity_has_midpoints_and_sharpness() {
    let opacity = |points: &str| one(&format!(r#"{{"RGBPoints": [0, 0,0,0, 8, 1,1,1], "Points": [{points}]}}"#)).opacity;
    assert_near(&opacity("0, 0.2, 0.5, 0, 4, 0.6, 0.25, 0, 8, 1, 0.5, 0"), &[[0.0, 0.2], [0.5, 0.6], [0.625, 0.8], [1.0, 1.0]]);
    assert_near(&opacity("0, 0, 0.25, 1, 8, 1, 0.5, 0"), &[[0.0, 0.0], [0.25, 0.0], [0.25, 1.0], [1.0, 1.0]]);
    let smooth = opacity("0, 0, 0.5, 0.5, 8, 1, 0.5, 0");
    assert!(smooth.is_sorted() && smooth.len() > 10);
    let middle = smooth.iter().find(|k| k[0] == 0.5).expect("a knot at the midpoint");
    assert!((middle[1] - 0.5).abs() < 1e-12);
    assert!(smooth[2][1] < 0.01 && smooth[smooth.len() - 3][1] > 0.99, "steeper than a line in the middle: {smooth:?}");
}

#[test]
fn what_is_wrong_is_named() {
    assert!(problem(r#"{"Name": "m", "RGBPoints": [0, 0, 0]}"#).contains("\"m\": RGBPoints has 3 numbers"));
    assert!(problem(r#"{"Name": "m", "RGBPoints": [0, 0, 0, 255]}"#).contains("\"m\": color knot 0 is [0.0, 0.0, 0.0, 255.0]"));
    assert!(problem(r#"{"Name": "m", "RGBPoints": "none"}"#).contains("\"m\": invalid type"));
    assert!(problem(r#"{"Name": "m", "RGBPoints": []}"#).contains("has no colours"));
    for other in ["[]", "3", "{\"a\": 1}", "[{\"a\": 1}]"] {
        assert!(problem(other).contains("RGBPoints"), "{other}");
    }
    assert!(problem("{\"color\": [[0,1,1,1]],\n \"opacity\": [[0,0]], \"colour\": 3}").contains("line 2"));
    assert!(problem(r#"{"color": [[0,1,1,2]], "opacity": [[0,0]]}"#).contains("color knot 0"));
}

#[test]
fn what_is_exported_is_imported() {
    let base = TransferFunction {
        opacity: vec![[0.0, 0.1], [0.3, 0.2], [0.3, 0.8], [1.0, 0.4]],
        nan: Some([1.0, 1.0, 0.0]),
        below: Some([0.25; 3]),
        above: Some([0.75; 3]),
        ..TransferFunction::standard()
    };
    for (scale, range) in [(Scale::Linear, None), (Scale::Linear, Some([-3.0, 7.0])), (Scale::Log, None), (Scale::Log, Some([1e-4, 50.0]))]
    {
        let function = TransferFunction { scale, range, ..base.clone() };
        let text = to_paraview("mine", &function).expect("can be").to_string();
        let back = parse(&text, "stem").expect("valid").remove(0);
        assert_eq!(back.name, "mine");
        let back = back.function;
        assert_near(&back.color, &function.color);
        assert_near(&back.opacity, &function.opacity);
        assert_eq!((back.scale, back.nan, back.below, back.above), (scale, function.nan, function.below, function.above));
        let x = serde_json::from_str::<Value>(&text).expect("JSON")[0]["RGBPoints"][0].as_f64();
        assert!(range.is_none_or(|[lo, _]| x == Some(lo)), "x is in data units: {x:?}");
    }
    // Knots that do not reach the ends, or go beyond them.
    let short = TransferFunction { color: vec![[-1.0, 0.0, 0.0, 0.0], [0.5, 1.0, 1.0, 1.0]], ..base.clone() };
    let back = one(&to_paraview("s", &short).expect("can be").to_string());
    assert_near(&back.color, &[[0.0, 2.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0], [0.5, 1.0, 1.0, 1.0], [1.0, 1.0, 1.0, 1.0]]);
    // What ParaView does not have becomes what it has.
    let stepped = one(&to_paraview("s", &TransferFunction { steps: Some(3), ..base.clone() }).expect("can be").to_string());
    assert_eq!((stepped.color.len(), stepped.steps), (6, None));
    let symlog = TransferFunction { scale: Scale::Symlog(None), ..base };
    assert!(to_paraview("s", &symlog).is_err());
    let tabulated = one(&to_paraview("s", &TransferFunction { range: Some([-1.0, 2.0]), ..symlog }).expect("can be").to_string());
    assert!(tabulated.color.len() > 20 && tabulated.scale == Scale::Linear);
}

#[test]
fn files_are_found_by_name() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("maps.json");
    let text = r#"[{"Name": "a: b", "RGBPoints": [0,0,0,0]}, {"Name": "Second", "RGBPoints": [0,1,0,0]}]"#;
    std::fs::write(&path, text).expect("written");
    let named = |name: &str| read_one(&format!("{}{name}", path.display()));
    assert_eq!(named(":a: b").expect("found").function.color, [[0.0; 4]]);
    assert_eq!(named(":second").expect("in small letters").name, "Second");
    let several = named("").expect_err("two").to_string();
    assert!(several.contains("maps.json") && several.contains("2 colour maps") && several.contains("a: b, Second"), "{several}");
    let missing = named(":third").expect_err("no third").to_string();
    assert!(missing.contains("no colour map \"third\"") && missing.contains("a: b, Second"), "{missing}");

    let own = folder.path().join("own.json");
    let function = TransferFunction { scale: Scale::Symlog(Some(0.5)), steps: Some(4), ..TransferFunction::standard() };
    write(&own, &function).expect("written");
    assert_eq!(read(&own).expect("read"), [NamedTransfer { name: "own".into(), function: function.clone() }]);
    write_paraview(&own, "p", &TransferFunction { scale: Scale::Log, ..function }).expect("written over it");
    assert_eq!(read_one(&own.to_string_lossy()).expect("one").name, "p");
    assert!(read_one("no/such.json").expect_err("missing").to_string().starts_with("no/such.json: "));
}
