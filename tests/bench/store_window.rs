//! What frames take while three slices are dragged through a volume of 16 GiB with a cache of 512 MiB, on the software adapter, widgets and
//! reading back included: `cargo bench --bench store_window`.

#![allow(clippy::print_stdout)]

#[path = "../slices/made_up.rs"]
mod made_up;

use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use glam::DVec3;
use made_up::MadeUp;
use octetra::app::store::{StoreOptions, StoreWindow};
use octetra::app::wgpu_setup;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Layers over 2048 x 2048 x 1024 voxels of 4 bytes, 16 GiB.
fn layers(level: u8, voxel: [u32; 3]) -> f32 {
    let size = (1u32 << level) as f32;
    let [x, y, z] = voxel.map(|v| (v as f32 + 0.5) * size - 0.5);
    let fold = 60.0 * (x / 400.0).sin();
    (z + fold + 0.1 * y).rem_euclid(64.0) / 64.0
}

type Window = Harness<'static, StoreWindow>;

fn settle(window: &mut Window) {
    window.step();
    let start = Instant::now();
    while !window.state().is_settled() {
        assert!(start.elapsed() < Duration::from_secs(600), "it never comes to rest: {:?}", window.state().progress());
        std::thread::sleep(Duration::from_millis(5));
        window.step();
    }
}

/// A frame as the window makes it, milliseconds.
fn frame(window: &mut Window) -> f64 {
    let start = Instant::now();
    window.step();
    window.render().expect("a frame");
    start.elapsed().as_secs_f64() * 1e3
}

fn told(mut ms: Vec<f64>) -> String {
    ms.sort_by(f64::total_cmp);
    let at = |share: f64| ms[(share * (ms.len() - 1) as f64) as usize];
    format!("{} frames, ms: median {:.1}, 95 % {:.1}, most {:.1}", ms.len(), at(0.5), at(0.95), at(1.0))
}

fn main() {
    let source = MadeUp::new([2048, 2048, 1024], DVec3::ONE, [0.0, 1.0], layers);
    let options =
        StoreOptions { name: "layers".into(), source: Arc::new(source), memory_bytes: 512 << 20, gpu_bytes: None, transfer_function: None };
    let builder = Harness::builder().with_size(egui::vec2(1280.0, 800.0)).with_render_cursor(false).wgpu_setup(wgpu_setup());
    let mut window = builder.build_eframe(|creation| StoreWindow::new(creation, options).expect("a window"));
    settle(&mut window);
    println!("at rest: {}", told((0..20).map(|_| frame(&mut window)).collect()));
    let mut ms = Vec::new();
    for name in ["line x in z", "line y in z", "line z in x"] {
        let from = window.get_by_label(name).rect().center();
        window.hover_at(from);
        window.step();
        window.drag_at(from);
        window.step();
        for step in 0..60 {
            let by = 60.0 * (step as f32 / 16.0).sin();
            let by = if name.starts_with("line x") { egui::vec2(by, 0.0) } else { egui::vec2(0.0, by) };
            window.hover_at(from + by);
            ms.push(frame(&mut window));
        }
        window.drop_at(from);
        window.step();
    }
    println!("dragging: {}", told(ms));
    println!("the window's own, without the harness: {:?}", window.state().frame_times());
    let start = Instant::now();
    settle(&mut window);
    println!("complete after {:.1} s: {:?}", start.elapsed().as_secs_f64(), window.state().progress());
}
