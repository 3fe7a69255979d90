//! The octree's leaves as boxes over the picture.

use super::jobs::{Job, Polled};
use super::projector::Projector;
use super::viewer::Viewer;
use super::widgets::{choice, row, rows, significant, thousands};
use crate::geometry::Placed;
use crate::gpu::{GpuError, LineVertex, Lines};
use crate::octree::{LeafBox, OctreeTexture};
use egui::{Color32, Rect, RichText, Slider, Ui};
use glam::DVec3;
use std::sync::Arc;

/// At most so many leaves are drawn on a plane, and as whole boxes.
const MOST_CUT: usize = 60_000;
const MOST_BOXES: usize = 1_500;

/// Which leaves are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LeafShow {
    /// None.
    #[default]
    Off,
    /// Those on a plane, as its squares.
    Cut,
    /// Whole boxes, the nearest to the viewer.
    Boxes,
}

/// What is drawn, and what is on its way.
pub struct Leaves {
    /// Which leaves.
    pub show: LeafShow,
    /// Across which axis the plane is.
    pub axis: usize,
    /// Where it is, in sizes of the bounds.
    pub position: f32,
    /// How many are drawn, of how many on the plane or in all.
    pub drawn: Option<(usize, usize)>,
    job: Option<Job<Drawn>>,
    key: Option<Key>,
}

/// Lines on the device, and how many leaves they are of how many.
struct Drawn {
    lines: Result<Option<Lines>, GpuError>,
    leaves: usize,
    of: usize,
}

/// What decides the lines: the octree by where it lies.
#[derive(Debug, Clone, PartialEq)]
enum Key {
    Cut(usize, usize, f32),
    Boxes(usize, DVec3),
}

impl Default for Leaves {
    fn default() -> Self {
        Leaves { show: LeafShow::Off, axis: 2, position: 0.5, drawn: None, job: None, key: None }
    }
}

impl Viewer {
    /// Takes lines that are made and has those made that the settings ask for.
    pub(super) fn run_leaves(&mut self, ctx: &egui::Context) -> anyhow::Result<()> {
        match self.leaves.job.as_ref().map(Job::poll) {
            None | Some(Polled::Pending) => {}
            Some(Polled::Result(drawn)) => {
                self.leaves.job = None;
                if self.leaves.show != LeafShow::Off {
                    self.leaves.drawn = Some((drawn.leaves, drawn.of));
                    self.viewport.put_lines(drawn.lines?);
                }
            }
            Some(Polled::Ended) => self.leaves.job = None,
        }
        let octree = self.octree.model.clone();
        let (Some(octree), true) = (octree, self.leaves.show != LeafShow::Off) else {
            if self.leaves.key.take().is_some() || self.leaves.drawn.take().is_some() {
                self.viewport.put_lines(None);
            }
            return Ok(());
        };
        let address = Arc::as_ptr(&octree) as usize;
        let key = match self.leaves.show {
            LeafShow::Boxes => Key::Boxes(address, self.settings.camera.eye),
            _ => Key::Cut(address, self.leaves.axis, self.leaves.position),
        };
        // One that is on its way is shown: a plane that moves is followed.
        if self.leaves.job.is_some() || self.leaves.key.as_ref() == Some(&key) {
            return Ok(());
        }
        let (bounds, eye) = (self.document.data.bounds(), self.settings.camera.eye - self.document.data.center());
        let (of, depths) = (key.clone(), octree.leaves_by_depth.clone());
        self.leaves.key = Some(key);
        let upload = self.viewport.line_uploader();
        self.leaves.job = Some(Job::start(ctx, move |_, results| {
            let Some(texture) = octree.scene.texture() else { return };
            let unit = |p: DVec3| (p - texture.root_min()) / texture.root_edge();
            results.give(match of {
                Key::Cut(_, axis, position) => {
                    let at = bounds.min[axis] + f64::from(position) * bounds.size()[axis];
                    let at = unit(DVec3::splat(at))[axis];
                    let mut leaves = texture.leaves_cut(axis, at);
                    let of = leaves.len();
                    leaves.truncate(MOST_CUT);
                    Drawn { lines: upload(&squares(texture, &leaves, axis, at, &depths)), leaves: leaves.len(), of }
                }
                Key::Boxes(..) => {
                    let (leaves, of) = texture.nearest_leaves(unit(eye), MOST_BOXES);
                    Drawn { lines: upload(&boxes(texture, &leaves, &depths)), leaves: leaves.len(), of }
                }
            });
        }));
        Ok(())
    }

    /// Paints what is made.
    pub(super) fn leaves_over(&self, ui: &Ui, rect: Rect) {
        if self.leaves.drawn.is_some() {
            let projector = Projector::new(&self.settings.camera, self.document.data.center(), rect);
            self.viewport.paint_lines(ui.painter(), rect, projector.matrix());
        }
    }

    /// Which leaves are drawn, in the panel.
    pub(super) fn leaves_section(&mut self, ui: &mut Ui) {
        const SHOWS: [(LeafShow, &str, &str); 3] = [
            (LeafShow::Off, "off", "No leaves"),
            (LeafShow::Cut, "on a plane", "The leaves that a plane cuts, as squares on it"),
            (LeafShow::Boxes, "nearest", "Boxes of the leaves nearest to the viewer"),
        ];
        const AXES: [(usize, &str, &str); 3] = [(0, "x", "Across x"), (1, "y", "Across y"), (2, "z", "Across z")];
        let (bounds, center) = (self.document.data.bounds(), self.document.data.center());
        let leaves = &mut self.leaves;
        rows(ui, "leaf boxes", |ui| {
            choice(ui, "Leaves", "Draw the octree's leaves over the picture, coloured by depth", &mut leaves.show, &SHOWS);
            if leaves.show == LeafShow::Cut {
                choice(ui, "Plane", "The axis that the plane is across", &mut leaves.axis, &AXES);
                let (low, size) = (bounds.min[leaves.axis] + center[leaves.axis], bounds.size()[leaves.axis]);
                let position = Slider::new(&mut leaves.position, 0.0..=1.0)
                    .custom_formatter(move |part, _| significant(low + part * size))
                    .custom_parser(move |text| Some((text.trim().parse::<f64>().ok()? - low) / size));
                row(ui, "At", "Where the plane is, world coordinates", position);
            }
        });
        let (Some((drawn, of)), Some(octree)) = (self.leaves.drawn, &self.octree.model) else { return };
        let what = if self.leaves.show == LeafShow::Cut { "on the plane" } else { "in all" };
        ui.weak(format!("{} of {} leaves {what} are drawn", thousands(drawn), thousands(of)));
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.x = 6.0;
            ui.weak("depth");
            for (depth, _) in octree.leaves_by_depth.iter().enumerate().filter(|(_, count)| **count > 0) {
                let [r, g, b, _] = depth_color(depth, &octree.leaves_by_depth);
                ui.label(RichText::new(depth.to_string()).strong().color(Color32::from_rgb(r, g, b)));
            }
        });
    }
}

/// From blue for the shallowest leaves that there are to red for the deepest.
pub fn depth_color(depth: usize, leaves_by_depth: &[usize]) -> [u8; 4] {
    let first = leaves_by_depth.iter().position(|&count| count > 0).unwrap_or(0);
    let last = leaves_by_depth.iter().rposition(|&count| count > 0).unwrap_or(0).max(first + 1);
    let part = ((depth.max(first) - first) as f32 / (last - first) as f32).min(1.0);
    let [r, g, b] = egui::ecolor::Hsva::new(0.62 * (1.0 - part), 0.75, 1.0, 1.0).to_srgb();
    [r, g, b, 220]
}

/// The squares in which a plane cuts leaves.
fn squares(texture: &OctreeTexture, leaves: &[LeafBox], axis: usize, position: f64, depths: &[usize]) -> Vec<LineVertex> {
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut vertices = Vec::with_capacity(8 * leaves.len());
    for leaf in leaves {
        let corner = |i: f64, j: f64| {
            leaf.low.with_axis(axis, position).with_axis(u, leaf.low[u] + i * leaf.edge).with_axis(v, leaf.low[v] + j * leaf.edge)
        };
        let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
        let color = depth_color(leaf.depth.into(), depths);
        (0..4).for_each(|i| vertices.extend([corners[i], corners[(i + 1) % 4]].map(|p| vertex(texture, p, color))));
    }
    vertices
}

/// The edges of leaves.
fn boxes(texture: &OctreeTexture, leaves: &[LeafBox], depths: &[usize]) -> Vec<LineVertex> {
    let mut vertices = Vec::with_capacity(24 * leaves.len());
    for leaf in leaves {
        let [r, g, b, _] = depth_color(leaf.depth.into(), depths);
        let color = [r, g, b, 130]; // many lie behind each other
        let corner = |i: usize| leaf.low + DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64) * leaf.edge;
        for from in 0..8 {
            for bit in [1, 2, 4].into_iter().filter(|bit| from & bit == 0) {
                vertices.extend([corner(from), corner(from | bit)].map(|p| vertex(texture, p, color)));
            }
        }
    }
    vertices
}

fn vertex(texture: &OctreeTexture, unit: DVec3, color: [u8; 4]) -> LineVertex {
    LineVertex { position: (texture.root_min() + unit * texture.root_edge()).as_vec3().to_array(), color }
}

/// A vector with one coordinate replaced.
trait WithAxis {
    fn with_axis(self, axis: usize, value: f64) -> Self;
}

impl WithAxis for DVec3 {
    fn with_axis(mut self, axis: usize, value: f64) -> Self {
        self[axis] = value;
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::octree::{CellKind, Octree};

    #[test]
    fn lines_go_round_leaves_in_the_datas_own_space() {
        let kind = |_, depth: u8| if depth == 2 { CellKind::Leaf(0.5) } else { CellKind::Split };
        let tree = Octree::from_fn(DVec3::new(-2.0, -4.0, 0.0), 8.0, [0.0, 1.0], kind);
        let texture = OctreeTexture::encode(&tree).expect("fits");
        let depths = tree.leaves_by_depth();
        let length = |vertices: &[LineVertex]| -> f32 {
            vertices.chunks(2).map(|ends| glam::Vec3::from(ends[0].position).distance(ends[1].position.into())).sum()
        };
        let cut = squares(&texture, &texture.leaves_cut(1, 0.3), 1, 0.3, &depths);
        assert_eq!((cut.len(), length(&cut)), (8 * 16, 16.0 * 4.0 * 2.0));
        assert!(cut.iter().all(|v| (v.position[1] - (-4.0 + 0.3 * 8.0)).abs() < 1e-6 && (-2.0..=6.0).contains(&v.position[0])));
        let (all, _) = texture.nearest_leaves(DVec3::ZERO, 1000);
        let edges = boxes(&texture, &all, &depths);
        assert_eq!((edges.len(), length(&edges)), (24 * 64, 64.0 * 12.0 * 2.0));
        let [shallow, deep] = [3, 5].map(|depth| depth_color(depth, &[0, 0, 0, 7, 0, 9]));
        assert!(shallow[2] == 255 && deep[0] == 255 && shallow != deep);
    }
}
