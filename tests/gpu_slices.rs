//! Slices on the GPU against a lookup on the CPU: the values of the finest resident level, to the bit where a voxel is shown as it is.
//! Needs an adapter; Mesa's software one will do.

#[path = "slices/made_up.rs"]
mod made_up;

use glam::{DMat4, DVec3, DVec4};
use made_up::MadeUp;
use octetra::bricks::{BRICK_EDGE, Brick, BrickKey, BrickSource, Pyramid, SlicePlane};
use octetra::gpu::{Context, DrawnSlice, SlicePainter, SlicePicture, SlicePool, SliceStyle, TINTS, flat_projection};
use octetra::view::TransferFunction;
use octetra::volume::Samples;
use std::collections::HashSet;

const DIMS: [u32; 3] = [200, 150, 100];

/// Unlike at each voxel and level, and missing at some.
fn value(level: u8, [x, y, z]: [u32; 3]) -> f32 {
    if (x + 2 * y + 3 * z) % 97 == 5 {
        return f32::NAN;
    }
    (x as f32).mul_add(0.25, y as f32 * 7.0) + z as f32 * 0.125 + 1e4 * f32::from(level) + ((x * y + z) % 7) as f32
}

struct Slices {
    context: Context,
    pool: SlicePool,
    painter: SlicePainter,
    source: MadeUp,
    resident: HashSet<BrickKey>,
}

impl Slices {
    /// The coarser levels, and of level 0 the bricks of a checkerboard.
    fn new() -> Self {
        let context = Context::new().expect("an adapter; on Debian: apt install mesa-vulkan-drivers");
        let source = MadeUp::new(DIMS, DVec3::ONE, [0.0, 3e4], value);
        let mut pool = SlicePool::new(&context, source.pyramid(), 4, 64 << 20).expect("room");
        let mut resident = HashSet::new();
        for level in 0..source.pyramid().levels() {
            let [nx, ny, nz] = source.pyramid().bricks(level);
            for at in (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z]))) {
                let key = BrickKey { level, at };
                if level == 0 && at.iter().sum::<u32>() % 2 == 1 || level == 1 && at == [1, 0, 0] {
                    continue;
                }
                let slot = resident.len() as u32;
                assert!(slot < pool.capacity());
                pool.put(&context, slot, key, &source.load(key).expect("computed"));
                resident.insert(key);
            }
        }
        let painter = SlicePainter::new(&context);
        Slices { context, pool, painter, source, resident }
    }

    fn measure(&mut self, slice: DrawnSlice, is_smooth: bool, size: [u32; 2]) -> Vec<[f32; 4]> {
        let style = style(is_smooth);
        self.painter.measure(&self.context, &mut self.pool, &style, &[slice], size).expect("a picture").pixels
    }

    /// The finest resident level's value at a point, in f64: value, if known, and level.
    fn expected(&self, point: DVec3, is_smooth: bool) -> (Option<f64>, u8) {
        let pyramid = self.source.pyramid();
        for level in 0..pyramid.levels() {
            let last = DVec3::from(pyramid.dims(level).map(|n| f64::from(n) - 1.0));
            let at = ((point + 0.5) / f64::from(1u32 << level) - 0.5).clamp(DVec3::ZERO, last);
            let low = if is_smooth { at.floor() } else { (at + 0.5).floor().min(last) };
            let part = if is_smooth { at - low } else { DVec3::ZERO };
            let mut sum = Some(0.0);
            let mut is_resident = true;
            for i in 0..8 {
                let corner = glam::BVec3::new(i & 1 > 0, i & 2 > 0, i & 4 > 0);
                let weight = DVec3::select(corner, part, 1.0 - part).to_array().iter().product::<f64>();
                if weight == 0.0 {
                    continue;
                }
                let voxel = (low + DVec3::select(corner, DVec3::ONE, DVec3::ZERO)).as_uvec3().to_array();
                is_resident &= self.resident.contains(&BrickKey { level, at: voxel.map(|v| v / BRICK_EDGE) });
                let value = (self.source.value)(level, voxel);
                sum = sum.filter(|_| !value.is_nan()).map(|sum| sum + weight * f64::from(value));
            }
            if is_resident {
                return (sum, level);
            }
        }
        panic!("the coarsest level is resident")
    }
}

fn style(is_smooth: bool) -> SliceStyle {
    let transfer_function = TransferFunction { range: Some([0.0, 1024.0]), ..TransferFunction::preset("grey").expect("a preset") };
    SliceStyle { transfer_function, value_range: [0.0, 3e4], is_smooth, tint: 0.0 }
}

/// The whole slice across an axis, `scale` pixels a voxel, half a voxel of margin around it.
fn across(axis: usize, position: f64, scale: u32) -> (DrawnSlice, [u32; 2]) {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let size = [(DIMS[u] + 1) * scale, (DIMS[v] + 1) * scale];
    let mut center = DVec3::from(DIMS.map(f64::from)) / 2.0 - 0.5;
    center[axis] = position;
    let half = |axis: usize| DVec3::AXES[axis] * 2.0 / f64::from(DIMS[axis] + 1);
    let clip_from_index = flat_projection(center, half(u), half(v));
    (DrawnSlice { plane: SlicePlane::across(axis, position), clip_from_index, is_whole: true, border: None, opacity: 1.0 }, size)
}

/// The index position of a pixel of such a picture.
fn position(axis: usize, at: f64, scale: u32, size: [u32; 2], pixel: usize) -> DVec3 {
    let (column, row) = (pixel as u32 % size[0], pixel as u32 / size[0]);
    let mut point = DVec3::ZERO;
    point[axis] = at;
    point[(axis + 1) % 3] = (f64::from(column) + 0.5) / f64::from(scale) - 1.0;
    point[(axis + 2) % 3] = (f64::from(size[1] - 1 - row) + 0.5) / f64::from(scale) - 1.0;
    point
}

fn is_inside(point: DVec3) -> bool {
    point.cmpgt(DVec3::splat(-0.5)).all() && point.cmplt(DVec3::from(DIMS.map(|n| f64::from(n) - 0.5))).all()
}

#[test]
fn slices_have_the_values_of_their_voxels_to_the_bit_and_others_those_between() {
    let mut slices = Slices::new();
    let mut levels = HashSet::new();
    for (axis, at) in [(0, 70.0), (1, 0.0), (2, 63.0), (2, 64.0), (2, 99.0)] {
        let (slice, size) = across(axis, at, 2);
        for is_smooth in [false, true] {
            let shown = slices.measure(slice, is_smooth, size);
            for (pixel, shown) in shown.iter().enumerate() {
                let point = position(axis, at, 2, size, pixel);
                if !is_inside(point) {
                    assert_eq!(*shown, [0.0; 4], "beside the volume at {point}");
                    continue;
                }
                let (value, level) = slices.expected(point, is_smooth);
                levels.insert(level);
                let near = if is_smooth { 1e-3 * (1.0 + value.unwrap_or(0.0).abs() * 1e-2) } else { 0.0 };
                assert_eq!((shown[1], shown[2]), (f32::from(level), f32::from(u8::from(value.is_some()))), "{point} across {axis}");
                assert!((f64::from(shown[0]) - value.unwrap_or(0.0)).abs() <= near, "{shown:?} for {value:?} at {point} across {axis}");
            }
        }
    }
    assert_eq!(levels.len(), 3, "all levels are seen");

    // Between two voxels.
    let (slice, size) = across(2, 63.25, 1);
    let shown = slices.measure(slice, true, size);
    for (pixel, shown) in shown.iter().enumerate() {
        let point = position(2, 63.25, 1, size, pixel);
        let (Some(value), level) = (if is_inside(point) { slices.expected(point, true) } else { continue }) else { continue };
        assert!(shown[1] == f32::from(level) && (f64::from(shown[0]) - value).abs() < 1e-2 + 1e-6 * value, "{shown:?}, {value} at {point}");
    }

    // Oblique, seen straight on: x to the right, and up what is up on the slice.
    let plane = SlicePlane::new(DVec3::new(100.0, 75.0, 50.0), DVec3::new(0.0, -0.6, 0.8)).expect("a plane");
    let up = DVec3::new(0.0, 0.8, 0.6);
    let clip_from_index = flat_projection(plane.point, DVec3::X / 100.0, up / 80.0);
    let slice = DrawnSlice { plane, clip_from_index, is_whole: true, border: None, opacity: 1.0 };
    let shown = slices.measure(slice, true, [200, 160]);
    let mut compared = 0;
    for (pixel, shown) in shown.iter().enumerate() {
        let (column, row) = (pixel % 200, pixel / 200);
        let point = plane.point + DVec3::X * (column as f64 + 0.5 - 100.0) + up * (80.0 - 0.5 - row as f64);
        if !is_inside(point) {
            continue;
        }
        let (value, level) = slices.expected(point, true);
        // Rounding may put a point on the other side of where bricks meet or voxels are missing.
        if shown[1] == f32::from(level) && (shown[2] == 1.0) == value.is_some() {
            let near = 0.1 + 1e-5 * value.unwrap_or(0.0);
            assert!((f64::from(shown[0]) - value.unwrap_or(0.0)).abs() < near, "{shown:?} for {value:?} at {point}");
            compared += 1;
        }
    }
    assert!(compared > 25_000, "{compared}");

    coarser_pictures_show_coarser_levels(&mut slices);
    colours_tints_and_depth(&mut slices);
    bricks_that_leave_are_not_drawn(&mut slices);
    whole_numbers_are_kept_as_they_are(&mut slices);
}

fn coarser_pictures_show_coarser_levels(slices: &mut Slices) {
    let plane = SlicePlane::across(2, 0.0);
    let shown_level = |slices: &mut Slices, voxels: f64| {
        // Bricks (0, 0, 0) of all levels are resident.
        let half = 10.0 * voxels;
        let clip_from_index = flat_projection(DVec3::new(30.0, 30.0, 0.0), DVec3::X / half, DVec3::Y / half);
        let slice = DrawnSlice { plane, clip_from_index, is_whole: false, border: None, opacity: 1.0 };
        let levels: HashSet<i32> = slices.measure(slice, false, [20, 20]).iter().map(|shown| shown[1] as i32).collect();
        assert_eq!(levels.len(), 1, "one level all over the picture");
        levels.into_iter().next().unwrap_or(-1)
    };
    assert_eq!([0.5, 1.0, 1.4, 1.45, 2.8, 2.9].map(|voxels| shown_level(slices, voxels)), [0, 0, 0, 1, 1, 2]);
}

/// Two slices that cross, seen along y from a distance in perspective, are drawn as deep as they lie.
fn colours_tints_and_depth(slices: &mut Slices) {
    let eye_y = -400.0;
    let clip_from_index = DMat4::from_cols(
        DVec4::new(4.0, 0.0, 0.0, 0.0),
        DVec4::new(0.0, 0.0, 0.0, 1.0),
        DVec4::new(0.0, 4.0, 0.0, 0.0),
        DVec4::new(-4.0 * 100.0, -4.0 * 50.0, 1.0, -eye_y),
    );
    let far = DrawnSlice { plane: SlicePlane::across(1, 140.0), clip_from_index, is_whole: true, border: None, opacity: 1.0 };
    let normal = DVec3::new(1.0, 1.0, 0.0);
    // Before the far one on the left, behind it on the right.
    let turned = DrawnSlice { plane: SlicePlane::new(DVec3::new(100.0, 140.0, 50.0), normal).expect("a plane"), ..far };
    let picture = SlicePicture::new(&slices.context, [200, 200]).expect("a picture");
    let mut drawn = |drawn: &[DrawnSlice], style: &SliceStyle| {
        slices.painter.draw(&slices.context, &mut slices.pool, style, drawn, &picture).expect("drawn");
        slices.painter.read(&slices.context, &picture).expect("read")
    };
    let bordered = |slice: DrawnSlice, color| DrawnSlice { border: Some((1e9, color)), ..slice };
    let (red, green) = ([1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0]);
    for order in [[bordered(far, red), bordered(turned, green)], [bordered(turned, green), bordered(far, red)]] {
        let pixels = drawn(&order, &style(false));
        let count = |color: [u8; 4], columns: std::ops::Range<usize>| {
            (0..200).flat_map(|row| columns.clone().map(move |x| row * 200 + x)).filter(|&i| pixels[i] == color).count()
        };
        assert_eq!(count([0, 255, 0, 255], 0..99), 0, "on the left the far one is nearer");
        assert!(count([255, 0, 0, 255], 60..99) > 1000 && count([0, 255, 0, 255], 101..140) > 1000);
        assert_eq!(count([255, 0, 0, 255], 101..140), 0);
    }
    // Grey by value, missing ones transparent; then coloured, and tinted.
    let (slice, size) = across(2, 0.0, 1);
    let picture = SlicePicture::new(&slices.context, size).expect("a picture");
    let pixels = {
        slices.painter.draw(&slices.context, &mut slices.pool, &style(false), &[slice], &picture).expect("drawn");
        slices.painter.read(&slices.context, &picture).expect("read")
    };
    let mut shown = [0; 2];
    for (pixel, shade) in pixels.iter().enumerate() {
        let point = position(2, 0.0, 1, size, pixel);
        if !is_inside(point) || slices.expected(point, false).1 > 0 {
            continue;
        }
        match slices.expected(point, false).0 {
            None => assert_eq!(*shade, [0; 4]),
            Some(value) => {
                let expected = (value / 1024.0).clamp(0.0, 1.0) * 255.0;
                assert!(shade[..3].iter().all(|&v| (f64::from(v) - expected).abs() < 1.01) && shade[3] == 255, "{shade:?}, {expected}");
            }
        }
        shown[usize::from(*shade == [0; 4])] += 1;
    }
    assert!(shown[0] > 5000 && shown[1] > 50, "{shown:?}");
    let mut tinted = SliceStyle { tint: 1.0, ..style(false) };
    tinted.transfer_function.nan = Some([1.0, 0.0, 1.0]);
    slices.painter.draw(&slices.context, &mut slices.pool, &tinted, &[slice], &picture).expect("drawn");
    let pixels = slices.painter.read(&slices.context, &picture).expect("read");
    for (pixel, shade) in pixels.iter().enumerate().filter(|(pixel, _)| is_inside(position(2, 0.0, 1, size, *pixel))) {
        let level = slices.expected(position(2, 0.0, 1, size, pixel), false).1;
        let [r, g, b] = TINTS[usize::from(level)].map(|v| (v * 255.0).round() as i16);
        assert!(shade.iter().zip([r, g, b, 255]).all(|(&a, b)| (i16::from(a) - b).abs() <= 1), "{shade:?} at level {level}");
    }
}

fn bricks_that_leave_are_not_drawn(slices: &mut Slices) {
    let (slice, size) = across(2, 10.0, 1);
    let key = BrickKey { level: 0, at: [0, 0, 0] };
    let pixel = (size[1] as usize - 1 - 20) * size[0] as usize + 20;
    assert_eq!(slices.measure(slice, false, size)[pixel][1], 0.0);
    slices.pool.remove(key);
    assert_eq!(slices.measure(slice, false, size)[pixel][1], 1.0);
}

fn whole_numbers_are_kept_as_they_are(slices: &mut Slices) {
    let count = (BRICK_EDGE * BRICK_EDGE * BRICK_EDGE) as usize;
    let all = [
        Samples::U8((0..count).map(|i| (i * 7) as u8).collect::<Vec<_>>().into()),
        Samples::I8((0..count).map(|i| (i * 7) as i8).collect::<Vec<_>>().into()),
        Samples::U16((0..count).map(|i| (i * 77) as u16).collect::<Vec<_>>().into()),
        Samples::I16((0..count).map(|i| (i * 77) as i16).collect::<Vec<_>>().into()),
        Samples::I32((0..count).map(|i| i as i32 - 1000).collect::<Vec<_>>().into()),
    ];
    let pyramid = Pyramid::new([BRICK_EDGE; 3]);
    let half = 1.0 / 32.0;
    let clip_from_index = flat_projection(DVec3::new(31.5, 31.5, 5.0), DVec3::X * half, DVec3::Y * half);
    let slice = DrawnSlice { plane: SlicePlane::across(2, 5.0), clip_from_index, is_whole: true, border: None, opacity: 1.0 };
    for samples in all {
        let mut pool = SlicePool::new(&slices.context, &pyramid, samples.bytes() / count, 1 << 20).expect("room");
        let brick = Brick { samples };
        pool.put(&slices.context, 0, pyramid.top(), &brick);
        for is_smooth in [false, true] {
            let shown = slices.painter.measure(&slices.context, &mut pool, &style(is_smooth), &[slice], [64, 64]).expect("a picture");
            for (pixel, shown) in shown.pixels.iter().enumerate() {
                let voxel = pixel % 64 + 64 * (63 - pixel / 64) + 64 * 64 * 5;
                assert_eq!(f64::from(shown[0]), brick.samples.get(voxel), "{} at {voxel}", brick.samples.type_name());
            }
        }
    }
}
