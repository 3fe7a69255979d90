//! Where a survey lies in the world.

use super::SegyOptions;
use super::error::SegyError;
use super::input::Input;
use super::layout::{Fields, Layout, TRACE_HEADER};
use super::scan::Survey;
use crate::volume::GridFrame;
use glam::{DMat2, DMat3, DVec2, DVec3};

/// Positions along each axis whose traces are asked for their coordinates.
const ASKED: usize = 48;
/// Bytes of a trace's header with x and y: those of the ensemble, those of the source.
const COORDINATES: [[usize; 2]; 2] = [[181, 185], [73, 77]];
/// Units of coordinates (byte 89) that are angles, and the largest longitude and latitude: seconds, degrees, and degrees with minutes and seconds.
const ANGLES: [(i16, f64, f64); 3] = [(2, 1_296_000.0, 324_000.0), (3, 360.0, 90.0), (4, 3_600_000.0, 900_000.0)];
/// The axes are as good as parallel where the sine of their angle is below this.
const PARALLEL: f64 = 0.05;

/// A plane map from position (crossline, inline), counted from 0, to the world.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Plan {
    origin: DVec2,
    crossline: DVec2,
    inline: DVec2,
}

/// Why there is no map.
enum NoPlan {
    /// No coordinates, or all the same.
    None,
    /// They are angles on the globe.
    Angles,
    /// They do not lie on a grid: so far off, world units.
    Off(f64),
}

/// What is asked of a trace.
struct Asked {
    /// Crossline and inline, counted from 0.
    at: DVec2,
    /// Coordinates at each of [`COORDINATES`].
    places: [DVec2; 2],
    /// Unit of the coordinates, [`ANGLES`] those of angles.
    unit: i16,
    /// Milliseconds until the first sample.
    delay: f64,
}

/// The frame: sample, crossline and inline along x, y and z of the grid. Notes say what it is made of.
pub(super) fn frame(
    input: &Input,
    layout: &Layout,
    survey: &Survey,
    options: &SegyOptions,
    notes: &mut Vec<String>,
) -> Result<GridFrame, SegyError> {
    let dims = [layout.samples, survey.crosslines.count, survey.inlines.count];
    let asked = ask(input, layout, survey)?;
    let interval = layout.interval / 1000.0;
    let step = options.sample_step.unwrap_or(if interval > 0.0 { interval } else { 1.0 });
    if !(step.is_finite() && step > 0.0) {
        return Err(SegyError::Step(step));
    }
    let delay = asked.first().map_or(0.0, |first| first.delay);
    let first_sample = if interval > 0.0 { delay * step / interval } else { delay };
    if interval > 0.0 {
        let unit = if options.sample_step.is_some() { format!("{step} world units") } else { "1 ms is 1 world unit".into() };
        notes.push(format!("samples are {interval} ms apart ({unit}), the first at {delay} ms; z points up"));
    } else {
        notes.push(format!("no sample interval is given: samples are {step} world units apart; z points up"));
    }
    let [least, most] = survey.delays;
    if least != most {
        notes.push(format!("the first sample is at {least} to {most} ms (byte 109); the first trace's is taken for all"));
    }
    let plan = match plan(&asked, COORDINATES.map(|bytes| bytes[0])) {
        Ok((plan, byte)) => {
            let (x, y) = (plan.crossline.length(), plan.inline.length());
            notes.push(format!("coordinates from bytes {byte} and {}: crosslines {x:.3} and inlines {y:.3} world units apart", byte + 4));
            plan
        }
        Err(why) => {
            let why = match why {
                NoPlan::None => "there are no coordinates (bytes 181 and 185, 73 and 77)".to_owned(),
                NoPlan::Angles => "the coordinates are angles (byte 89)".to_owned(),
                NoPlan::Off(by) => format!("the coordinates do not lie on a regular grid ({by:.3} off)"),
            };
            notes.push(format!("x and y are crossline and inline numbers: {why}"));
            let (crosslines, inlines) = (survey.crosslines, survey.inlines);
            Plan {
                origin: DVec2::new(crosslines.first.into(), inlines.first.into()),
                crossline: DVec2::X * f64::from(crosslines.step),
                inline: DVec2::Y * f64::from(inlines.step),
            }
        }
    };
    let steps = DMat3::from_cols(DVec3::NEG_Z * step, plan.crossline.extend(0.0), plan.inline.extend(0.0));
    let frame = GridFrame { dims, origin: plan.origin.extend(-first_sample), steps };
    frame.validate()?;
    Ok(frame)
}

/// Traces spread over the survey, the first of the file among them.
fn ask(input: &Input, layout: &Layout, survey: &Survey) -> Result<Vec<Asked>, SegyError> {
    let (columns, rows) = (survey.crosslines.count as usize, survey.inlines.count as usize);
    let spread = |count: usize| {
        let asked = count.min(ASKED);
        (0..asked).map(move |n| n * (count - 1) / (asked - 1).max(1))
    };
    let first = survey.index.iter().enumerate().filter(|(_, trace)| **trace > 0).min_by_key(|(_, trace)| **trace).map(|(place, _)| place);
    let places = first.into_iter().chain(spread(rows).flat_map(|row| spread(columns).map(move |column| row * columns + column)));
    let mut found = Vec::new();
    for (place, trace) in places.map(|place| (place, survey.index[place])).filter(|(_, trace)| *trace > 0) {
        let header: [u8; TRACE_HEADER as usize] = input.array_at(layout.first + u64::from(trace - 1) * layout.stride)?;
        let header = Fields { bytes: &header, is_little: layout.is_little };
        let scale = |by: i16| match by {
            0 => 1.0,
            1.. => f64::from(by),
            _ => 1.0 / -f64::from(by),
        };
        let coordinate_scale = scale(header.i16(71));
        let xy = |[x, y]: [usize; 2]| DVec2::new(header.i32(x).into(), header.i32(y).into()) * coordinate_scale;
        found.push(Asked {
            at: DVec2::new((place % columns) as f64, (place / columns) as f64),
            places: COORDINATES.map(xy),
            unit: header.i16(89),
            delay: f64::from(header.i16(109)) * if layout.has_revision { scale(header.i16(215)) } else { 1.0 },
        });
    }
    Ok(found)
}

/// The map by the first coordinates that make one, and the byte of their x.
fn plan(asked: &[Asked], bytes: [usize; 2]) -> Result<(Plan, usize), NoPlan> {
    let mut why = NoPlan::None;
    for (n, byte) in bytes.into_iter().enumerate() {
        // A trace without coordinates has zeros.
        let known: Vec<(DVec2, DVec2)> =
            asked.iter().map(|asked| (asked.at, asked.places[n])).filter(|(_, place)| *place != DVec2::ZERO).collect();
        match fit(&known) {
            // Some files call metres degrees.
            Ok(_) if asked.iter().all(|asked| is_angle(asked.unit, asked.places[n])) => return Err(NoPlan::Angles),
            Ok(plan) => return Ok((plan, byte)),
            Err(off @ NoPlan::Off(_)) if matches!(why, NoPlan::None) => why = off,
            Err(_) => {}
        }
    }
    Err(why)
}

/// Whether coordinates can be what their unit says, if that is an angle.
fn is_angle(unit: i16, place: DVec2) -> bool {
    ANGLES.iter().any(|&(code, x, y)| code == unit && place.x.abs() <= x && place.y.abs() <= y)
}

/// The map that comes nearest, if all places are within half of a step of it.
fn fit(known: &[(DVec2, DVec2)]) -> Result<Plan, NoPlan> {
    let mean = |of: fn(&(DVec2, DVec2)) -> DVec2| known.iter().map(of).sum::<DVec2>() / known.len().max(1) as f64;
    let (middle, center) = (mean(|known| known.0), mean(|known| known.1));
    let (mut moments, mut mixed) = (DMat2::ZERO, DMat2::ZERO);
    for &(at, place) in known {
        let (at, place) = (at - middle, place - center);
        moments += DMat2::from_cols(at * at.x, at * at.y);
        mixed += DMat2::from_cols(place * at.x, place * at.y);
    }
    // Places on one line fix no map.
    let determinant = moments.determinant();
    if determinant.is_nan() || determinant <= 1e-9 * moments.x_axis.x * moments.y_axis.y {
        return Err(NoPlan::None);
    }
    let map = mixed * moments.inverse();
    let (crossline, inline) = (map.x_axis, map.y_axis);
    let (shorter, longer) = (crossline.length().min(inline.length()), crossline.length().max(inline.length()));
    let farthest = known.iter().map(|&(at, place)| (map * (at - middle)).distance(place - center)).fold(0.0, f64::max);
    if !map.is_finite() || longer <= 1e-9 * center.length() {
        return Err(NoPlan::None);
    }
    let is_flat = shorter < 1e-6 * longer || crossline.perp_dot(inline).abs() < PARALLEL * shorter * longer;
    if farthest > shorter / 2.0 || is_flat {
        return Err(NoPlan::Off(farthest));
    }
    Ok(Plan { origin: center - map * middle, crossline, inline })
}
