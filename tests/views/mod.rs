//! Scenes and views for tests of pictures.
#![allow(dead_code)] // not every test that has this module uses all of it

use glam::DVec3;
use octetra::mesh::{ScalarField, TetMesh};
use octetra::octree::{OctreeParams, OctreeTexture, regularize, regularize_grid};
use octetra::progress::Progress;
use octetra::render::{Renderer, Scene};
use octetra::view::{Camera, Projection, RenderSettings, TransferFunction, View};
use octetra::volume::{Grid, GridFrame, Samples};

/// The octree of a mesh.
pub fn octree(renderer: &Renderer, mesh: &TetMesh, field: &ScalarField, params: &OctreeParams) -> Scene {
    let tree = regularize(mesh, field, params, &Progress::new()).expect("regularizes");
    let texture = OctreeTexture::encode(&tree).expect("fits");
    renderer.octree_scene(mesh, texture, params.surface(mesh, field)).expect("fits").0
}

/// A volume of `n`^3 points over the cube [-1, 1]^3.
pub fn volume(n: u32, value: impl Fn(DVec3) -> f64) -> Grid {
    let at = |i: u32| DVec3::new((i % n).into(), (i / n % n).into(), (i / n / n).into()) * (2.0 / f64::from(n - 1)) - 1.0;
    let frame = GridFrame::along_axes([n; 3], DVec3::NEG_ONE, DVec3::splat(2.0 / f64::from(n - 1)));
    Grid::new(frame, "s".into(), Samples::F32((0..n * n * n).map(|i| value(at(i)) as f32).collect())).expect("valid")
}

pub fn volume_scene(renderer: &Renderer, grid: &Grid) -> Scene {
    let params = OctreeParams { max_depth: 7, ..OctreeParams::default().by_thresholds() };
    let params = OctreeParams { max_leaf_tets: 0, max_leaf_variance: 0.0, ..params };
    let tree = regularize_grid(grid, &params, &Progress::new()).expect("regularizes");
    let surface = tree.grid_surface(grid);
    renderer.octree_scene(grid, OctreeTexture::encode(&tree).expect("fits"), surface).expect("fits").0
}

/// A view along y of [-1, 1] across, from y = -5, in parallel.
pub fn front(settings: RenderSettings) -> View {
    let camera =
        Camera { eye: DVec3::NEG_Y * 5.0, target: DVec3::ZERO, up: DVec3::Z, projection: Projection::Parallel { view_height: 2.0 } };
    let white = TransferFunction { color: vec![[0.0, 1.0, 1.0, 1.0]], ..TransferFunction::standard() };
    View { camera, transfer_function: white, settings }
}

/// x and z of a pixel of such a view.
pub fn across(i: usize, size: u32) -> [f64; 2] {
    let at = |k: u32| 2.0 * (f64::from(k) + 0.5) / f64::from(size) - 1.0;
    [at(i as u32 % size), -at(i as u32 / size)]
}
