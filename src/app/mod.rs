//! The window: state, input, and jobs on threads. What it shows is computed by the library.
//!
//! ```text
//! viewer           the window: what is open, what is chosen, what is shown, and what is on its way
//! panel            the widgets beside the picture
//! mode             what a pixel shows: light, surfaces, numbers
//! planes           what clips, and what is drawn where it cuts
//! plane_handles    the same taken by hand, over the picture
//! transfer_editor  colours, opacity, range: the transfer function
//! thresholds       those of the octree, and its numbers
//! files            opening and reloading; sessions
//! recent           the files that were open lately
//! time_stage       the steps of a series: shown, read ahead, their range
//! time_bar         their bar under the picture
//! problem          why a file could not be opened
//! pictures         screenshots and turntables
//! camera_panel     the camera's buttons, clipboard and files
//! furniture        what is around and behind the picture
//! help             the sheet of keys
//! widgets          what they are made of
//! color_choice     a colour
//! keys             what keys do: one table
//! actions          doing it
//! navigate         mouse to cameras
//! history          what was chosen before
//! settings         what the user has chosen
//! octree_stage     the octree: being built, built, measured
//! marching         which pictures are marched, and when
//! slot             which pictures there are
//! viewport         the picture on the GPU
//! probe_tool       what is under the pointer, pins, a line: state and jobs
//! picked           what is seen at a place of the picture
//! quality          how well cells are shaped: histogram, the worst, one marked
//! probe_view       the same over the picture and in the panel
//! projector        from the world to the window
//! wipe             two pictures in one
//! linked           two files in one window
//! leaves           the octree's leaves over the picture
//! store            the window for a volume of bricks
//! tuning           the chart of settings
//! dock             the panel under the picture
//! model            the long work: opening, regularizing, measuring, exact pictures, saving
//! jobs             work in the background, with progress, cancelled when dropped
//! pace             how fine to draw while the view moves
//! stats            what frames take
//! ```

mod actions;
mod camera_panel;
mod color_choice;
mod dock;
mod drawing;
mod files;
mod furniture;
mod help;
mod history;
mod jobs;
pub mod keys;
mod leaves;
mod linked;
mod marching;
mod mode;
mod model;
mod navigate;
mod octree_stage;
mod pace;
mod panel;
mod picked;
mod pictures;
mod plane_handles;
mod planes;
mod probe_tool;
mod probe_view;
mod problem;
mod projector;
mod quality;
mod recent;
mod settings;
mod slot;
mod stats;
pub mod store;
mod thresholds;
mod time_bar;
mod time_stage;
mod transfer_editor;
mod tuning;
mod viewer;
mod viewport;
mod widgets;
mod wipe;

use crate::mesh::Component;
use crate::octree::{OctreeParams, Subject};
use crate::render::DeviceChoice;
use crate::session::{Session, Source};
use crate::study::ErrorSampling;
use crate::view::View;
use anyhow::{Context, Result, anyhow, bail};
pub use pictures::PictureSize;
pub use probe_tool::Pin;
pub use recent::recent_file;
use stats::SharedStats;
pub use stats::{Figures, Spread, WindowStats};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
pub use viewer::{OctreeNumbers, Viewer};
pub use viewport::wgpu_setup;

/// What the window opens on.
#[derive(Debug)]
pub struct Options {
    /// What the mesh or volume is called: title and name of screenshots.
    pub name: String,
    /// Where it was read from.
    pub source: Source,
    /// What is around and behind the picture, and the size of screenshots, if the window opens on a session.
    pub session: Option<Session>,
    /// Where the list of files that were open lately is kept; `None`: nowhere.
    pub recent: Option<PathBuf>,
    /// A mesh and the field of it that is shown first, or a volume.
    pub subject: Subject,
    /// What is taken of a vector.
    pub component: Component,
    /// A second file, opened beside: the first is A then, and this is B.
    pub compare_with: Option<PathBuf>,
    /// The first view; its size counts for nothing, the window's does.
    pub view: View,
    /// The first thresholds.
    pub params: OctreeParams,
    /// How the octree's error is measured; its tolerance counts for nothing, the octree's does.
    pub error: ErrorSampling,
    /// Budget for mesh and octree in bytes, checked before another mesh is opened.
    pub memory_bytes: u64,
    /// What draws the pictures: with [`DeviceChoice::Auto`] the CPU, where the window's adapter computes there as well.
    pub device: DeviceChoice,
    /// Where screenshots are written.
    pub folder: PathBuf,
}

/// Opens the window and returns when it is closed, with what its frames took.
pub fn run(options: Options) -> Result<WindowStats> {
    let shared: Arc<Mutex<Option<SharedStats>>> = Arc::default();
    let kept = shared.clone();
    open_window(&options.name.clone(), "`octetra render` draws without one", move |creation| {
        let viewer = Viewer::new(creation, options)?;
        *kept.lock().unwrap_or_else(PoisonError::into_inner) = Some(viewer.stats.clone());
        Ok(Box::new(viewer))
    })?;
    let stats = shared.lock().unwrap_or_else(PoisonError::into_inner).take();
    stats.map(|stats| stats::lock(&stats).clone()).context("the window was closed before it was open")
}

/// Opens a window of this name and returns when it is closed. `instead`: what to do where there is no display.
fn open_window(
    name: &str,
    instead: &str,
    create: impl FnOnce(&eframe::CreationContext<'_>) -> Result<Box<dyn eframe::App>> + 'static,
) -> Result<()> {
    if cfg!(all(unix, not(target_os = "macos"))) {
        let set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
        if !["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"].into_iter().any(set) {
            bail!("there is no display to open a window on (DISPLAY and WAYLAND_DISPLAY are not set); {instead}");
        }
    }
    let mut native = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_title(title(name))
            .with_app_id("octetra")
            .with_inner_size([1280.0, 800.0])
            .with_min_inner_size([640.0, 400.0]),
        ..Default::default()
    };
    native.wgpu_options.wgpu_setup = wgpu_setup();
    let create = move |creation: &eframe::CreationContext<'_>| Ok(create(creation)?);
    let opened = eframe::run_native("octetra", native, Box::new(create));
    opened.map_err(|error| match error {
        eframe::Error::AppCreation(error) => anyhow!("{error:#}"),
        eframe::Error::Winit(_) | eframe::Error::WinitEventLoop(_) => {
            // What comes before the last colon is where in winit it happened.
            let text = error.to_string();
            anyhow!("no window can be opened: {}; {instead}", text.rsplit(": ").next().unwrap_or(&text))
        }
        error => anyhow!("{error}"),
    })
}

/// The window's title.
fn title(name: &str) -> String {
    format!("{name} - octetra")
}
