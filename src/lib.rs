//! octetra shows what is inside a tetrahedral mesh. It turns the mesh into an adaptive octree texture, ray-marches it on the GPU with a
//! step that follows the octree's depth, and stands an exact renderer of the mesh itself beside it. Regular volumes go the same way, but for
//! the exact renderer; curvilinear grids of hexahedra become tets when they are read. [`octree::Subject`] is a field on a mesh or a volume.
//!
//! # The flow
//!
//! ```text
//! file ─format─▶ TetMesh ─octree::regularize─▶ Octree ─OctreeTexture::encode─▶ OctreeTexture ─gpu─▶ GPU march ─▶ Image
//!   │               │                             ▲                                 └─────────cpu─▶ CPU march ─▶ Image
//!   └─────▶ Grid ──octree::regularize_grid────────┘
//!                   │
//!                   ├─BoundarySurface: where rays enter and leave, for both marches
//!                   ├─CompactMesh─gpu (tet by tet, f32)────────────────────────────────────────────────────────▶ Image
//!                   └─exact (ray by ray, f64)──────────────────────────────────────────────────────────────────▶ Image
//!
//! SEG-Y, Grid, OctreeTexture ─VoxelSource─▶ bricks::store (Zarr) ─BrickSource─▶ BrickCache ─gpu::slices─▶ slices in the window
//!                                                  └──────────bricks::slice───────────────────────────────▶ values, Image
//!
//! Image, Image ─compare─▶ numbers, difference map;  Surface, Surface ─compare─▶ distances;  OnMesh, OnMesh ─compare─▶ norms
//! Subject, OctreeTexture ─study::FieldError, octree::error_bound─▶ the stated error
//!
//! View = Camera + TransferFunction + RenderSettings goes into every renderer and decides everything else about an image
//! ```
//!
//! Nothing flows back. [`app`] (the window) and [`cli`] (the command) sit on top, call the library and contain no algorithm.
//!
//! # The layers
//!
//! Lowest first. A module imports lower layers and its own folder only; `tests/layers.rs` holds that.
//!
//! 1. [`geometry`], [`progress`], [`words`]
//! 2. [`mesh`], [`volume`], [`view`], [`image`]
//! 3. [`optics`], [`format`](mod@format), [`octree`], [`exact`], [`furniture`]
//! 4. [`bricks`]
//! 5. [`cpu`], [`gpu`], [`compare`], [`session`]
//! 6. [`render`]
//! 7. [`study`]
//! 8. [`app`]
//! 9. [`cli`]
//!
//! `wgpu` is named in `gpu/` and `app/viewport.rs` only, `egui` in `app/`, `clap` in `cli/`, `anyhow` in `cli/` and `app/`. [`exact`] shares
//! no code with what it judges: not with [`optics`], [`octree`], [`cpu`] or [`gpu`].
//!
//! # An example
//!
//! ```
//! use octetra::{Camera, OctreeParams, OctreeTexture, RenderSettings, Renderer, ScalarField, TransferFunction, View};
//! use octetra::{mesh, octree, progress::Progress, render::DeviceChoice};
//!
//! // A ball whose field is the distance from its centre.
//! let layers = mesh::generate::plan(mesh::generate::Shape::Ball, Some(6000))?;
//! let ball = mesh::collect(&*layers)?;
//! let radius = ScalarField::select(&ball, &Default::default())?;
//!
//! // The octree texture, at most 6 levels deep.
//! let params = OctreeParams { max_depth: 6, ..Default::default() };
//! let tree = octree::regularize(&ball, &radius, &params, &Progress::new())?;
//! let texture = OctreeTexture::encode(&tree)?;
//!
//! // A picture from the first view of the standard orbit.
//! let view = View {
//!     camera: Camera::orbit(ball.bounds().translated(ball.center()), 0, 1.0),
//!     transfer_function: TransferFunction::standard(),
//!     settings: RenderSettings::new(64, 64),
//! };
//! let renderer = Renderer::new(DeviceChoice::Cpu)?;
//! let (scene, _) = renderer.octree_scene(&ball, texture, params.surface(&ball, &radius))?;
//! let picture = renderer.render(&scene, &view, &Progress::new())?;
//! assert!(picture.image.pixels[32 * 64 + 32][3] > 0.5, "the middle of the ball is not transparent");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod app;
pub mod bricks;
pub mod cli;
pub mod compare;
pub mod cpu;
pub mod exact;
pub mod format;
pub mod furniture;
pub mod geometry;
pub mod gpu;
pub mod image;
pub mod mesh;
pub mod octree;
pub mod optics;
pub mod progress;
pub mod render;
pub mod session;
pub mod study;
pub mod view;
pub mod volume;
pub mod words;

pub use exact::ExactScene;
pub use image::Image;
pub use mesh::{ScalarField, TetMesh};
pub use octree::{Octree, OctreeParams, OctreeTexture};
pub use render::{Renderer, Scene};
pub use view::{Camera, RenderSettings, TransferFunction, View};
pub use volume::Grid;
