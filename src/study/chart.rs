//! The chart of a sweep: PSNR over bytes, frame time and build time, as SVG or as pixels.

use super::tune::{Clock, Kind, Pick, Row, picture_front};
use crate::image::Image;
use plotters::coord::Shift;
use plotters::coord::combinators::BindKeyPoints;
use plotters::prelude::*;
use plotters::style::register_font;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::sync::LazyLock;

/// What a chart shows.
#[derive(Debug, Clone, Copy)]
pub struct Chart<'a> {
    /// Said above it.
    pub title: &'a str,
    /// The measured settings, at least one.
    pub rows: &'a [Row],
    /// Rows that are named, each with a ring.
    pub picks: &'a [Pick],
}

/// Why no chart was drawn.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the chart could not be drawn: {0}")]
pub struct ChartError(String);

/// Width and height in units of the SVG.
const SIZE: (u32, u32) = (1200, 640);

/// Pixels of the picture along one unit, and samples along one pixel.
const PIXELS: u32 = 1;
const SAMPLES: u32 = 3;

const INK: RGBColor = RGBColor(40, 40, 40);
const FAINT: RGBColor = RGBColor(225, 225, 225);

/// Colours that the colour-blind tell apart (Okabe & Ito 2008).
fn color(kind: Kind) -> RGBColor {
    match kind {
        Kind::Tolerance => RGBColor(0, 114, 178),
        Kind::ToleranceLeaf => RGBColor(204, 121, 167),
        Kind::Thresholds => RGBColor(0, 158, 115),
        Kind::ThresholdsLeaf => RGBColor(213, 94, 0),
    }
}

/// The font of the window, by the name that SVG knows: widths are measured with it, and pixels drawn.
static FONT: LazyLock<Result<&'static str, ChartError>> = LazyLock::new(|| {
    let name = "sans-serif";
    let registered = register_font(name, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
    registered.map(|()| name).map_err(|_| ChartError("the font is damaged".into()))
});

impl Chart<'_> {
    /// The chart as SVG.
    pub fn svg(&self) -> Result<String, ChartError> {
        let mut svg = String::new();
        self.draw(SVGBackend::with_string(&mut svg, SIZE), 1)?;
        Ok(svg)
    }

    /// The chart as an image of 1200 x 640 pixels.
    pub fn image(&self) -> Result<Image, ChartError> {
        let scale = PIXELS * SAMPLES;
        let (width, height) = (SIZE.0 * scale, SIZE.1 * scale);
        let mut rgb = vec![0; 3 * width as usize * height as usize];
        self.draw(BitMapBackend::with_buffer(&mut rgb, (width, height)), scale)?;
        Ok(averaged(&rgb, width as usize, height as usize))
    }

    fn draw<B: DrawingBackend>(&self, backend: B, scale: u32) -> Result<(), ChartError> {
        let failed = |e: DrawingAreaErrorKind<B::ErrorType>| ChartError(e.to_string());
        let font = FONT.clone()?;
        let root = backend.into_drawing_area();
        root.fill(&WHITE).map_err(failed)?;
        let pen = Pen { font, scale };
        let body = root.margin(8 * scale, 0, 0, 0).titled(self.title, pen.text(20, INK)).map_err(failed)?;
        let (left, right) = body.split_horizontally((SIZE.0 * 3 / 5) * scale);
        let right = right.split_evenly((2, 1));
        let clock = if self.rows.iter().all(|row| row.frame_by == Clock::Gpu) { "GPU" } else { "clock" };
        self.panel(&left, pen, "octree, MiB", |row| row.bytes as f64 / f64::from(1 << 20), true).map_err(failed)?;
        self.panel(&right[0], pen, &format!("frame, ms ({clock})"), |row| row.frame_s * 1e3, false).map_err(failed)?;
        self.panel(&right[1], pen, "build, s", |row| row.build_s, false).map_err(failed)?;
        root.present().map_err(failed)
    }

    /// PSNR over one cost on a logarithmic axis: all rows, the line of the best ones, the picks; names and a legend in the main panel.
    fn panel<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        pen: Pen,
        name: &str,
        cost: impl Fn(&Row) -> f64,
        main: bool,
    ) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        let at = |row: &Row| (cost(row).max(1e-9), row.psnr_db);
        let (costs, decibels) = self.ranges(&at);
        let mut chart = ChartBuilder::on(area)
            .margin(10 * pen.scale)
            .margin_right(18 * pen.scale)
            .x_label_area_size(46 * pen.scale)
            .y_label_area_size(54 * pen.scale)
            .build_cartesian_2d(costs.clone().log_scale().with_key_points(ticks(costs, if main { 9 } else { 6 })), decibels)?;
        chart
            .configure_mesh()
            .light_line_style(WHITE)
            .bold_line_style(pen.line(FAINT))
            .axis_style(pen.line(INK))
            .set_all_tick_mark_size(5 * pen.scale)
            .y_labels(if main { 10 } else { 6 })
            .label_style(pen.text(15, INK))
            .axis_desc_style(pen.text(16, INK))
            .x_label_formatter(&|v| two_digits(*v))
            .y_label_formatter(&|v| format!("{:.1}", v).trim_end_matches(".0").to_owned())
            .x_desc(name)
            .y_desc(if self.is_of_field() { "PSNR of the field, dB" } else { "PSNR of the worst view, dB" })
            .draw()?;

        let front = picture_front(self.rows, |row| at(row).0);
        chart.draw_series(LineSeries::new(front.iter().map(|&i| at(&self.rows[i])), pen.line(INK).stroke_width(2 * pen.scale)))?;
        for (kind, name) in Kind::ALL {
            let color = color(kind);
            let of_kind: Vec<&Row> = self.rows.iter().filter(|row| Kind::of(&row.params) == kind).collect();
            let points = of_kind.iter().map(|row| Circle::new(at(row), 5 * pen.scale, color.filled()));
            let series = chart.draw_series(points)?;
            if main && !of_kind.is_empty() {
                series.label(name).legend(move |(x, y)| Circle::new((x + 10 * pen.scale as i32, y), 5 * pen.scale, color.filled()));
            }
        }
        for pick in self.picks {
            let place = at(&self.rows[pick.row]);
            chart.draw_series([Circle::new(place, 9 * pen.scale, pen.line(INK).stroke_width(2 * pen.scale))])?;
            if main {
                // Up and to the left of the front, where settings would be better and smaller, there are none: names are legible.
                let style = pen.text(17, INK).pos(Pos::new(HPos::Right, VPos::Bottom));
                let away = -8 * pen.scale as i32;
                chart.draw_series([EmptyElement::at(place) + Text::new(pick.name, (away, away), style)])?;
            }
        }
        if main {
            chart
                .configure_series_labels()
                .position(SeriesLabelPosition::LowerRight)
                .margin(12 * pen.scale)
                .legend_area_size(24 * pen.scale)
                .background_style(WHITE.mix(0.9))
                .border_style(FAINT)
                .label_font(pen.text(16, INK))
                .draw()?;
        }
        Ok(())
    }

    /// Whether PSNR is the field's, as of a volume, and not the pictures'.
    fn is_of_field(&self) -> bool {
        self.rows.iter().all(|row| row.psnr_db_by_view.is_empty())
    }

    /// Axes that hold all rows, with room at the left for names and above.
    fn ranges(&self, at: &impl Fn(&Row) -> (f64, f64)) -> (std::ops::Range<f64>, std::ops::Range<f64>) {
        let fold = |range: [f64; 2], v: f64| [range[0].min(v), range[1].max(v)];
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let [low, high] = self.rows.iter().map(|row| at(row).0).fold(none, fold);
        let [worst, best] = self.rows.iter().map(|row| at(row).1).fold(none, fold);
        let room = (high / low).powf(0.06).max(1.3);
        let height = (best - worst).max(1.0);
        (low / (room * room)..high * room, worst - 0.06 * height..best + 0.1 * height)
    }
}

/// Sizes in units of the chart, for a backend with `scale` pixels a unit.
#[derive(Clone, Copy)]
struct Pen {
    font: &'static str,
    scale: u32,
}

impl Pen {
    fn text(self, size: u32, color: RGBColor) -> TextStyle<'static> {
        (self.font, size * self.scale).into_font().color(&color)
    }

    fn line(self, color: RGBColor) -> ShapeStyle {
        color.stroke_width(self.scale)
    }
}

/// Marks on a logarithmic axis: the finest of 1 to 9, 1 2 5 and 1 in each decade that gives at most so many;
fn ticks(range: std::ops::Range<f64>, most: usize) -> Vec<f64> {
    let decades = range.start.log10().floor() as i32..=range.end.log10().ceil() as i32;
    let of = |digits: &[u32]| -> Vec<f64> {
        let all = decades.clone().flat_map(|e| digits.iter().map(move |&d| f64::from(d) * 10f64.powi(e)));
        all.filter(|v| range.contains(v)).collect()
    };
    let choices = [&[1, 2, 3, 4, 5, 6, 7, 8, 9][..], &[1, 2, 5], &[1]].map(of);
    choices.iter().find(|ticks| ticks.len() <= most).unwrap_or(&choices[2]).clone()
}

/// The mean of each square of samples.
fn averaged(rgb: &[u8], width: usize, height: usize) -> Image {
    let samples = SAMPLES as usize;
    let mut image = Image::new((width / samples) as u32, (height / samples) as u32);
    for (i, pixel) in image.pixels.iter_mut().enumerate() {
        let (x, y) = (i % (width / samples) * samples, i / (width / samples) * samples);
        let mean = |c: usize| {
            let sum: u32 = (0..samples * samples).map(|s| u32::from(rgb[3 * ((y + s / samples) * width + x + s % samples) + c])).sum();
            sum as f32 / (255 * samples * samples) as f32
        };
        *pixel = [mean(0), mean(1), mean(2), 1.0];
    }
    image
}

/// A number with two digits that count, zeros behind the point left out.
fn two_digits(value: f64) -> String {
    let digits = (1.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::super::tune::{Goal, recommend};
    use super::*;
    use crate::octree::{OctreeParams, Reconstruction};

    fn rows() -> Vec<Row> {
        let row = |i: usize| Row {
            params: OctreeParams {
                tolerance: i.is_multiple_of(2).then_some(0.01),
                reconstruction: if i.is_multiple_of(3) { Reconstruction::Leaf } else { Reconstruction::Continuous },
                ..OctreeParams::default()
            },
            depth: 9,
            nodes: 10,
            leaves: 8,
            bytes: 100_000 << i,
            build_s: 0.05 * (i + 1) as f64,
            rmse_rel: 0.01,
            max_rel: 0.1,
            uncovered: 0.0,
            psnr_db: 30.0 + 4.0 * i as f64 - (i % 2) as f64 * 5.0,
            psnr_db_by_view: vec![30.0],
            frame_s: 0.001 * (i + 1) as f64,
            frame_by: Clock::Wall,
        };
        (0..7).map(row).collect()
    }

    #[test]
    fn the_svg_holds_every_row_and_names_the_picks() {
        let rows = rows();
        let picks = recommend(&rows, Goal::default());
        let svg = Chart { title: "ball <1> & more", rows: &rows, picks: &picks }.svg().expect("draws");
        let kinds = Kind::ALL.iter().filter(|(kind, _)| rows.iter().any(|row| Kind::of(&row.params) == *kind)).count();
        assert_eq!(svg.matches("<circle").count(), 3 * (rows.len() + picks.len()) + kinds, "points, rings, legend");
        assert!(picks.iter().all(|pick| svg.contains(pick.name)) && svg.contains("octree, MiB") && svg.contains("&lt;1&gt; &amp;"));
        let one = Chart { title: "", rows: &rows[..1], picks: &[] };
        assert!(one.svg().expect("draws").contains("frame, ms (clock)"), "one row has no extent");
    }

    #[test]
    fn the_image_shows_each_kind_in_its_colour() {
        let rows = rows();
        let image = Chart { title: "ball", rows: &rows, picks: &[] }.image().expect("draws");
        assert_eq!((image.width, image.height), SIZE);
        let count = |color: RGBColor| {
            let [r, g, b] = [color.0, color.1, color.2].map(|c| f32::from(c) / 255.0);
            image.pixels.iter().filter(|p| [p[0] - r, p[1] - g, p[2] - b].iter().all(|d| d.abs() < 0.01)).count()
        };
        assert!(Kind::ALL.iter().all(|&(kind, _)| count(color(kind)) > 100));
        assert!(count(WHITE) > 500_000);
    }

    #[test]
    fn ticks_are_few_and_short() {
        let about = |range, expected: &[f64]| {
            let found = ticks(range, 6);
            assert!(found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a / b - 1.0).abs() < 1e-12), "{found:?}");
        };
        about(0.15..4.5, &[0.2, 0.5, 1.0, 2.0]);
        about(30.0..75.0, &[30.0, 40.0, 50.0, 60.0, 70.0]);
        about(0.02..3000.0, &[0.1, 1.0, 10.0, 100.0, 1000.0]);
        assert_eq!([0.05, 0.30000000000000004, 1.0, 20.0, 1536.0].map(two_digits), ["0.05", "0.3", "1", "20", "1536"]);
    }
}
