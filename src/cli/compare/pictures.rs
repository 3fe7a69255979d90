//! Octrees of both meshes under the same thresholds, and pictures from one view.

use super::super::long_work::with_bar;
use super::super::render::say_if_fallen_back;
use super::document::{Figure, Picture};
use super::measured::{Field, Measured, OctreeNumbers};
use super::meshes::MeshesArgs;
use super::tables::percent;
use crate::compare::{DEFAULT_PIXELS_PER_DEGREE, DifferenceMap, compare_images, difference_map, paint_surface};
use crate::furniture::{self, Furniture, Part, Parts};
use crate::image::{Background, Image, bytes_png};
use crate::mesh::{ScalarField, TetMesh};
use crate::octree::{OctreeParams, OctreeTexture, Subject};
use crate::render::Renderer;
use crate::study::{ErrorSampling, FieldError};
use crate::view::{Camera, ColorMap, RenderSettings, TransferFunction, View};
use anyhow::{Context, Result};
use glam::DVec2;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// What the files of a Markdown report's pictures are called behind its name.
pub const NAMES: [&str; 6] = ["reference", "other", "flip", "difference", "distance_reference", "distance_other"];

/// Behind volumes and behind surfaces.
const BACKGROUND: [f32; 3] = [0.0; 3];
const PAPER: [f32; 3] = [0.96; 3];

/// Builds the octrees and compares their pictures if there are fields, and gives the pictures if there is a report.
pub fn draw(measured: &mut Measured, transfer: TransferFunction, args: &MeshesArgs) -> Result<Vec<Figure>> {
    let mut figures = Vec::new();
    let bounds = measured.sides[0].bounds;
    let camera = Camera::orbit(bounds, args.orbit, 1.0);
    if let Some(field) = measured.field.take() {
        figures = fields(measured, &field, transfer, camera, args)?;
        measured.field = Some(field);
    }
    let Some(path) = &args.report else { return Ok(figures) };
    figures.push(surfaces(measured, camera, args, path)?);
    Ok(figures)
}

/// The view of both meshes: one range, one camera, one length that opacity refers to.
fn view(measured: &Measured, field: &Field, transfer: TransferFunction, camera: Camera, args: &MeshesArgs) -> View {
    let diagonal = measured.sides[0].bounds.diagonal();
    let transfer = args.transfer.scaled(transfer, diagonal);
    let [a, b] = field.fields.each_ref().map(|field| field.range);
    let range = transfer.range.or(Some([a[0].min(b[0]), a[1].max(b[1])])).filter(|range| range[0] < range[1]);
    let unit_distance = Some(transfer.unit_distance_world(diagonal));
    let transfer_function = TransferFunction { range, unit_distance, ..transfer };
    View { camera, transfer_function, settings: RenderSettings::new(args.size[0], args.size[1]) }
}

fn fields(measured: &mut Measured, field: &Field, transfer: TransferFunction, camera: Camera, args: &MeshesArgs) -> Result<Vec<Figure>> {
    let Field { fields, difference } = field;
    let [Some(a), Some(b)] = measured.sides.each_ref().map(|side| side.mesh.clone()) else { return Ok(vec![]) };
    let view = view(measured, field, transfer, camera, args);
    for (side, field) in measured.sides.iter().zip(fields) {
        view.transfer_function.check_range(field.range).with_context(|| side.path.display().to_string())?;
    }
    let renderer = Renderer::new(args.device.into())?;
    say_if_fallen_back(&renderer);
    let params = args.octree.params();
    let (numbers_a, image_a) = octree(&renderer, &a, &fields[0], &params, &view)?;
    let (numbers_b, image_b) = octree(&renderer, &b, &fields[1], &params, &view)?;
    measured.octrees = Some([numbers_a, numbers_b]);
    let compared = compare_images(&image_a.clone().into(), &image_b.clone().into(), DEFAULT_PIXELS_PER_DEGREE)?;

    let mut figures = Vec::new();
    if let Some(path) = &args.report {
        let size = [compared.width, compared.height];
        let furnish = |mut image: Image, title: &str, range: [f64; 2], tf: &TransferFunction| {
            furnish(&mut image, title, range, tf, measured, &camera, BACKGROUND);
            bytes_png(path, &image.to_bytes(Background::Color(BACKGROUND)), size)
        };
        let title = furniture::title(&fields[0].name, None);
        let range = view.transfer_function.range.unwrap_or(fields[0].range);
        let names = [0, 1].map(|i| format!("{}: {}", ["A", "B"][i], measured.sides[i].name));
        let (mean, worst) = (compared.flip.mean, compared.flip.max);
        let mut pictures = vec![
            Picture { name: NAMES[0], caption: names[0].clone(), png: furnish(image_a, &title, range, &view.transfer_function)? },
            Picture { name: NAMES[1], caption: names[1].clone(), png: furnish(image_b, &title, range, &view.transfer_function)? },
            Picture {
                name: NAMES[2],
                caption: format!("FLIP of the two, black 0 to pale yellow 1: mean {mean:.4}, at most {worst:.3}"),
                png: bytes_png(path, &difference_map(&compared, DifferenceMap::Flip), size)?,
            },
        ];
        if let Some((image, tf, range)) = difference_picture(&renderer, measured, field, &a, &params, &view)? {
            let caption = "A less B, on A".into();
            pictures.push(Picture { name: NAMES[3], caption, png: furnish(image, "difference", range, &tf)? });
        }
        let note = format!(
            "{} through octrees of the same thresholds; one view, one range of colours. The difference is opaque where it is large; its colours \
             end at {} of A's range.",
            title,
            percent(difference_limit(field) / difference.range)
        );
        figures.push(Figure { title: "Fields", pictures, note });
    }
    measured.pictures = Some(compared);
    Ok(figures)
}

/// An octree's numbers and picture.
fn octree(
    renderer: &Renderer,
    mesh: &Arc<TetMesh>,
    field: &ScalarField,
    params: &OctreeParams,
    view: &View,
) -> Result<(OctreeNumbers, Image)> {
    let subject = Subject::Mesh(mesh.clone(), Arc::new(field.clone()));
    let start = Instant::now();
    let tree = with_bar(|progress| subject.regularize(params, progress))?;
    let texture = OctreeTexture::encode(&tree)?;
    let seconds = start.elapsed().as_secs_f64();
    let sampling = ErrorSampling { points: 1 << 18, tolerance: tree.params.tolerance, ..Default::default() };
    let error = with_bar(|progress| FieldError::of(&subject, &texture, &sampling, progress))?;
    let (nodes, leaves, empty) = (tree.node_count(), tree.leaf_count(), tree.empty_count());
    let numbers = OctreeNumbers { nodes, leaves, empty, depth: texture.depth(), bytes: texture.bytes(), seconds, error };
    let surface = subject.surface(&tree);
    let (scene, _) = renderer.octree_scene(&subject, texture, surface)?;
    let picture = with_bar(|progress| renderer.render(&scene, view, progress))?;
    Ok((numbers, picture.image))
}

/// The difference at which colours end: four times its L2 norm, or the largest if that is less.
fn difference_limit(field: &Field) -> f64 {
    let norms = field.difference.over_a;
    (4.0 * norms.l2).min(norms.max)
}

/// The difference on the first mesh, blue and red about 0; `None` where there is none.
fn difference_picture(
    renderer: &Renderer,
    measured: &Measured,
    field: &Field,
    mesh: &Arc<TetMesh>,
    params: &OctreeParams,
    view: &View,
) -> Result<Option<(Image, TransferFunction, [f64; 2])>> {
    let limit = difference_limit(field);
    let shown = ScalarField::new("difference".into(), field.fields[0].association, field.difference.on_a.clone());
    let is_seen = limit > 0.0 && (0..mesh.tets().len()).any(|tet| shown.is_usable(mesh, tet));
    let Some(map) = ColorMap::preset("coolwarm").filter(|_| is_seen) else { return Ok(None) };
    let transfer_function = TransferFunction {
        color: map.bake(),
        opacity: vec![[0.0, 0.9], [0.5, 0.0], [1.0, 0.9]],
        range: Some([-limit, limit]),
        unit_distance: Some(measured.sides[0].bounds.diagonal() / 20.0),
        ..TransferFunction::standard()
    };
    let view = View { transfer_function, ..view.clone() };
    let (_, image) = octree(renderer, mesh, &shown, params, &view)?;
    Ok(Some((image, view.transfer_function, [-limit, limit])))
}

/// Both surfaces in the colours of their distances.
fn surfaces(measured: &Measured, camera: Camera, args: &MeshesArgs, path: &Path) -> Result<Figure> {
    let distances = [&measured.distances.a_to_b, &measured.distances.b_to_a];
    let most = distances.iter().map(|side| side.max_at_points).fold(0.0, f64::max);
    let colors = ColorMap::preset("viridis").map(|map| map.bake()).unwrap_or_default();
    let tf = TransferFunction {
        range: Some([0.0, most]).filter(|_| most > 0.0),
        opacity: vec![[0.0, 1.0], [1.0, 1.0]],
        ..TransferFunction::of_color(colors.clone())
    };
    let mut pictures = Vec::new();
    for (i, side) in measured.sides.iter().enumerate() {
        let values = &distances[i].at_points;
        let mut image = paint_surface(&side.surface, &measured.nearest[i], values, [0.0, most], &colors, &camera, args.size);
        furnish(&mut image, "distance", [0.0, most], &tf, measured, &camera, PAPER);
        let png = bytes_png(path, &image.to_bytes(Background::Color(PAPER)), args.size)?;
        let caption = format!("{}: {}, by its distance from {}", ["A", "B"][i], side.name, ["B", "A"][i]);
        pictures.push(Picture { name: NAMES[4 + i], caption, png });
    }
    let note = "Distances are those of the surfaces' points, linear between them, in world units.".into();
    Ok(Figure { title: "Surfaces", pictures, note })
}

/// A colour bar.
fn furnish(
    image: &mut Image,
    title: &str,
    value_range: [f64; 2],
    transfer_function: &TransferFunction,
    measured: &Measured,
    camera: &Camera,
    background: [f32; 3],
) {
    let size = DVec2::new(f64::from(image.width), f64::from(image.height));
    let scale = (size.min_element() / 600.0).max(1.0);
    let drawing = Furniture {
        parts: Parts::of(&[Part::Bar]),
        title: title.to_owned(),
        value_range,
        transfer_function,
        camera,
        bounds: measured.sides[0].bounds,
        background,
        frame_time: None,
    };
    furniture::paint(image, &drawing.drawing(size / scale), scale);
}
