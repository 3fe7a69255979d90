//! Files of other people's making, against what segyio 1.9 reads from them.

use super::{SegyOptions, SegyVolume};
use crate::progress::Progress;
use crate::volume::{VoxelSource, VoxelType};
use std::path::PathBuf;

fn path(name: &str) -> PathBuf {
    let shared = std::env::var("OCTETRA_SHARED").expect("OCTETRA_SHARED names the folder of shared test data");
    PathBuf::from(shared).join("data/seismic").join(name)
}

fn open(name: &str, options: &SegyOptions) -> SegyVolume {
    SegyVolume::open(&path(name), options, &Progress::new()).unwrap_or_else(|error| panic!("{error}"))
}

/// Points along x, y, z, missing values, smallest, largest and mean value, and the values at the first point, at the last, at (7, 1, 2) and in the middle.
struct Expected {
    dims: [u32; 3],
    missing: usize,
    range: [f64; 2],
    mean: f64,
    voxels: [f64; 4],
}

const F3: Expected =
    Expected { dims: [75, 18, 23], missing: 0, range: [-10239.0, 10827.0], mean: 25.128856682769726, voxels: [0.0, -121.0, 0.0, -2222.0] };

fn check(name: &str, options: &SegyOptions, voxel: VoxelType, expected: &Expected) {
    let volume = open(name, options);
    let grid = volume.grid(&Progress::new()).expect("a grid");
    assert_eq!((volume.frame().dims, volume.voxel_type(), grid.missing()), (expected.dims, voxel, expected.missing), "{name}");
    let near = |a: f64, b: f64| (a - b).abs() <= 1e-6 * b.abs();
    assert!((0..2).all(|end| near(grid.range()[end], expected.range[end])), "{name}: {:?}", grid.range());
    let mut known = (0.0, 0usize);
    grid.samples().each(0..grid.samples().len(), 1, |value| {
        if !value.is_nan() {
            known = (known.0 + value, known.1 + 1);
        }
    });
    assert!(near(known.0 / known.1 as f64, expected.mean), "{name}: {known:?}");
    let [nx, ny, nz] = expected.dims.map(|n| n as usize);
    for ([x, y, z], value) in [[0; 3], [nx - 1, ny - 1, nz - 1], [7, 1, 2], [nx / 2, ny / 2, nz / 2]].into_iter().zip(expected.voxels) {
        let found = grid.samples().get(x + nx * (y + ny * z));
        assert!(found == value || found.is_nan() && value.is_nan(), "{name}: {found} at {x} {y} {z}, expected {value}");
    }
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn files_have_the_values_that_segyio_reads() {
    let default = SegyOptions::default();
    let of_f3 = [
        ("segyio_f3.sgy", VoxelType::I16),
        ("segyio_f3-lsb.sgy", VoxelType::I16),
        ("formats/Format1lsb.sgy", VoxelType::F32),
        ("formats/Format1msb.sgy", VoxelType::F32),
        ("formats/Format2msb.sgy", VoxelType::I32),
        ("formats/Format3msb.sgy", VoxelType::I16),
        ("formats/Format5msb.sgy", VoxelType::F32),
        ("formats/Format6msb.sgy", VoxelType::F64),
    ];
    for (name, voxel) in of_f3 {
        check(name, &default, voxel, &F3);
    }
    let bytes = Expected { range: [-128.0, 127.0], mean: -0.6360386473429952, voxels: [0.0, -121.0, 0.0, 82.0], ..F3 };
    check("formats/Format8msb.sgy", &default, VoxelType::I8, &bytes);
    let holed = Expected { missing: 13125, mean: 24.791352859135287, voxels: [0.0, f64::NAN, 0.0, -2222.0], ..F3 };
    check("f3-withdead.sgy", &default, VoxelType::F32, &holed);
    let small = Expected {
        dims: [50, 5, 5],
        missing: 0,
        range: [1.1999998092651367, 5.240489959716797],
        mean: 3.2202446830749514,
        voxels: [1.1999998092651367, 5.240489959716797, 3.2100696563720703, 3.2202491760253906],
    };
    check("segyio_small.sgy", &default, VoxelType::F32, &small);
    check("segyio_small-lsb.sgy", &default, VoxelType::F32, &small);
    let gathers = Expected {
        dims: [10, 3, 4],
        missing: 0,
        range: [101.00999450683594, 104.03009033203125],
        mean: 102.52004000345866,
        voxels: [101.00999450683594, 104.03009033203125, 103.02006530761719, 103.02005004882812],
    };
    check("segyio_small-ps.sgy", &default, VoxelType::F32, &gathers);
    let second = open("segyio_small-ps.sgy", &SegyOptions { offset: Some(2), ..default.clone() });
    assert_eq!(second.grid(&Progress::new()).expect("a grid").range(), [201.00999450683594, 204.03009033203125]);
    let survey = Expected {
        dims: [26, 71, 75],
        missing: 0,
        range: [-0.42006295919418335, 0.3620249032974243],
        mean: 0.03663075959597185,
        voxels: [-0.323604941368103, 0.3484131097793579, -0.3193276524543762, 0.07664191722869873],
    };
    check("xtgeo_ex2_complete_3d_75x71x26.segy", &default, VoxelType::F32, &survey);
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn surveys_lie_in_the_world() {
    let volume = open("xtgeo_ex2_complete_3d_75x71x26.segy", &SegyOptions::default());
    let spacing = volume.frame().spacing();
    assert!((spacing - glam::DVec3::new(4.0, 12.5, 12.5)).length() < 0.02, "{:?}", volume.frame());
    let volume = open("segyio_f3.sgy", &SegyOptions::default());
    let frame = volume.frame();
    assert!((frame.origin - glam::DVec3::new(620_197.2, 6_074_232.9, -4.0)).length() < 0.2, "{frame:?}");
    assert!((frame.spacing() - glam::DVec3::new(4.0, 25.0, 25.0)).length() < 0.1, "{frame:?}");
}

#[test]
#[ignore = "needs OCTETRA_SHARED, the folder of shared test data"]
fn a_broken_file_is_refused_by_name() {
    let error = SegyVolume::open(&path("segyio_broken.sgy"), &SegyOptions::default(), &Progress::new()).expect_err("broken").to_string();
    assert!(error.contains("segyio_broken.sgy: ends after 68 of the 256 bytes of trace 4 (4 samples of 4 bytes"), "{error}");
}
