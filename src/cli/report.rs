//! `--stats`: everything measured, as JSON; the keys of `conventions.md` as nested objects.

use super::args::{MeshArgs, OctreeArgs, ViewArgs};
use crate::image::write_atomically;
use crate::mesh::Component;
use crate::octree::{Octree, OctreeTexture, Subject};
use crate::render::{Picture, Renderer, Scene};
use crate::study::{ErrorFigures, FieldError};
use crate::view::View;
use anyhow::{Context, Result};
use glam::DVec3;
use serde_json::{Map, Value, json};
use std::path::Path;

/// The numbers of one run. What was not measured is null.
pub struct Report(Map<String, Value>);

impl Report {
    /// The numbers of a mesh or a volume, those of the other null; every other key is null until it is known.
    pub fn new(subject: &Subject, load_s: f64) -> Self {
        let mesh = match subject {
            Subject::Mesh(mesh, _) => json!({
                "points": mesh.points().len(), "tets": mesh.tets().len(), "bytes": mesh.bytes(),
                "zero_volume": mesh.zero_volume_count(), "inverted": mesh.inverted_count(),
            }),
            Subject::Volume(_) => json!({ "points": null, "tets": null, "bytes": null, "zero_volume": null, "inverted": null }),
        };
        let volume = match subject {
            Subject::Mesh(..) => {
                json!({ "dims": null, "spacing": null, "origin": null, "type": null, "bytes": null, "missing": null, "mapped": null })
            }
            Subject::Volume(grid) => json!({
                "dims": grid.frame().dims, "spacing": grid.frame().spacing().to_array(), "origin": grid.frame().origin.to_array(),
                "type": grid.samples().type_name(), "bytes": grid.samples().bytes(), "missing": grid.missing(),
                "mapped": grid.samples().is_mapped(),
            }),
        };
        let value = json!({
            "mesh": mesh,
            "volume": volume,
            "field": { "array": subject.array(), "range": subject.range() },
            "octree": { "nodes": null, "leaves": null, "empty": null, "leaves_by_depth": null, "bytes": null },
            "boundary": { "bytes": 0 },
            "exact": { "bytes": null },
            "error": {
                "rmse_rel": null, "max_rel": null, "bound_rel": null, "bound_at": null, "psnr_db": null, "p99_rel": null, "p999_rel": null,
                "uncovered": null, "max_at": null, "above_tolerance": null, "points": null, "seed": null, "by_tet": null,
            },
            "time": { "load": load_s, "regularize": null, "boundary": null, "error": null, "bound": null, "upload": null, "frame": null, "frame_gpu": null, "intervals_gpu": null },
            "samples": { "taken": null, "needed": null, "active_leaves": null },
            "adapter": { "name": "CPU", "backend": null, "driver": null },
            "params": null,
        });
        match value {
            Value::Object(map) => Report(map),
            _ => unreachable!("the literal is an object"),
        }
    }

    /// Sets `group.key`.
    pub fn set(&mut self, group: &str, key: &str, value: impl Into<Value>) {
        self.0[group][key] = value.into();
    }

    /// The octree's numbers; places become world positions by the mesh's centre.
    pub fn octree(&mut self, tree: &Octree, texture: &OctreeTexture, center: DVec3) {
        let unmet = tree.unmet.map(|u| json!({ "leaves": u.leaves, "worst_rel": u.worst_rel, "at": (u.at + center).to_array() }));
        self.0["octree"] = json!({
            "nodes": tree.node_count(), "leaves": tree.leaf_count(), "empty": tree.empty_count(),
            "leaves_by_depth": tree.leaves_by_depth(), "bytes": texture.bytes(), "unmet": unmet,
        });
    }

    /// The measured error of the octree, and the seconds that measuring took. Over the volume; over the tets under `by_tet`.
    pub fn error(&mut self, error: &FieldError, seconds: f64) {
        let figures = |f: &ErrorFigures| {
            json!({
                "rmse_rel": f.rmse_rel, "max_rel": f.max_rel, "psnr_db": f.psnr_db, "p99_rel": f.p99_rel, "p999_rel": f.p999_rel,
                "uncovered": f.uncovered, "max_at": f.max_at.map(|at| at.to_array()), "above_tolerance": f.above_tolerance,
                "points": f.points,
            })
        };
        if let (Value::Object(all), Value::Object(by_volume)) = (&mut self.0["error"], figures(&error.by_volume)) {
            all.extend(by_volume);
        }
        self.set("error", "seed", error.sampling.seed);
        self.set("error", "by_tet", figures(&error.by_tet));
        self.set("time", "error", seconds);
    }

    /// The picture's numbers and the device's.
    pub fn picture(&mut self, renderer: &Renderer, scene: &Scene, picture: &Picture) {
        self.set("time", "frame", picture.wall_s);
        self.set("time", "frame_gpu", picture.gpu_s.map(|s| s.frame));
        self.set("time", "intervals_gpu", picture.gpu_s.map(|s| s.intervals));
        self.set("samples", "taken", picture.samples);
        if let (Some([name, backend, driver]), true) = (renderer.adapter(), scene.is_on_device()) {
            self.0["adapter"] = json!({ "name": name, "backend": backend, "driver": driver });
        }
    }

    /// All flags as used.
    pub fn params(&mut self, mesh: &MeshArgs, array: &str, octree: &OctreeArgs, view: Option<(&ViewArgs, &View)>) -> Result<()> {
        let mut params = serde_json::to_value(octree.params()).context("parameters as JSON")?;
        let component = match mesh.component {
            Component::Magnitude => "magnitude".to_owned(),
            Component::Index(i) => ["x", "y", "z"].get(i).map_or(i.to_string(), |&name| name.to_owned()),
        };
        let on_orbit = |view: &ViewArgs| view.camera.is_none() && view.session.as_ref().is_none_or(|session| session.camera.is_none());
        let data = json!({ "mesh": mesh.mesh, "array": array, "component": component, "memory": mesh.budget_bytes() });
        let seen = view.map(|(view, used)| {
            json!({
                "size": [used.settings.width, used.settings.height], "camera": used.camera, "transfer_function": used.transfer_function,
                "orbit": on_orbit(view).then_some(view.orbit), "zoom": on_orbit(view).then_some(view.zoom),
                "renderer": format!("{:?}", used.settings.renderer).to_lowercase(), "device": format!("{:?}", view.device).to_lowercase(),
                "steps": format!("{:?}", used.settings.steps).to_lowercase(), "step": used.settings.step_world,
                "voxels": used.settings.voxels, "skip": used.settings.skip().to_string(), "intervals": format!("{:?}", used.settings.intervals).to_lowercase(),
                "min_transmittance": used.settings.min_transmittance,
                "mode": used.settings.mode.to_string(), "iso": used.settings.isosurfaces.iter().map(|surface| surface.value).collect::<Vec<_>>(),
                "isosurfaces": used.settings.isosurfaces, "planes": used.settings.planes, "faces": used.settings.faces, "shading": used.settings.shading,
                "session": view.session.as_ref().map(|_| used.settings), // as it was drawn, with the flags beside it counted in
            })
        });
        if let Value::Object(all) = &mut params {
            all.extend([Some(data), seen].into_iter().flatten().filter_map(|more| more.as_object().cloned()).flatten());
        }
        self.0["params"] = params;
        Ok(())
    }

    /// Writes the report.
    pub fn write(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(&self.0).context("the report as JSON")? + "\n";
        write_atomically(path, |out| out.write_all(text.as_bytes())).with_context(|| path.display().to_string())
    }
}
