//! What is measured of two meshes.

use super::super::long_work::with_bar;
use crate::compare::{
    DistanceOptions, FieldDifference, ImageComparison, Nearest, OnMesh, Surface, SurfaceDistances, SurfaceFigures, components,
};
use crate::format::{self, Contents, ReadOptions, Series};
use crate::geometry::{Aabb, signed_volume};
use crate::mesh::quality::{Metric, Rule, Summary, values};
use crate::mesh::{CellType, ScalarField, TetMesh, to_tets};
use crate::study::FieldError;
use anyhow::{Context, Result, bail};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A mesh or a surface.
pub struct Side {
    pub path: PathBuf,
    /// The file's name.
    pub name: String,
    /// Cells of the file by type.
    pub counts: Vec<(CellType, u64)>,
    /// Points of the file.
    pub points: usize,
    /// The mesh; `None` of a surface.
    pub mesh: Option<Arc<TetMesh>>,
    /// The mesh's boundary or the surface.
    pub surface: Surface,
    pub figures: SurfaceFigures,
    /// World bounds.
    pub bounds: Aabb,
    /// The sum of the tets' volumes, or what a closed surface encloses.
    pub volume: Option<f64>,
    /// Parts that have no point in common.
    pub components: u64,
    /// How well its tets are shaped, by each of [`Metric::USUAL`]; nothing of a surface.
    pub quality: Vec<Summary>,
    /// What of the file was left out.
    pub notes: Vec<String>,
}

/// Both fields and their difference.
pub struct Field {
    pub fields: [ScalarField; 2],
    pub difference: FieldDifference,
}

/// An octree of one mesh.
pub struct OctreeNumbers {
    pub nodes: usize,
    pub leaves: usize,
    pub empty: usize,
    pub depth: u8,
    pub bytes: usize,
    pub seconds: f64,
    pub error: FieldError,
}

/// Everything.
pub struct Measured {
    pub sides: [Side; 2],
    pub nearest: [Nearest; 2],
    pub options: DistanceOptions,
    pub distances: SurfaceDistances,
    pub field: Option<Field>,
    pub octrees: Option<[OctreeNumbers; 2]>,
    /// The octrees' pictures from one view.
    pub pictures: Option<ImageComparison>,
    pub notes: Vec<String>,
}

impl Side {
    /// Reads a file and takes its surface.
    pub fn read(path: &Path) -> Result<Self> {
        if Series::open(path, &[]).is_ok_and(|series| series.is_some()) {
            bail!("{}: a series; octetra compare takes one of its files", path.display());
        }
        let contents = with_bar(|progress| format::read_contents(path, &ReadOptions::default(), progress))?;
        let named = || path.display().to_string();
        let name = path.file_name().map_or_else(named, |name| name.to_string_lossy().into_owned());
        let (counts, points, mesh, surface, notes) = match contents {
            Contents::Grid(_) => bail!("{}: a regular volume; octetra compare takes meshes, surfaces and pictures", path.display()),
            Contents::Tets(parts) => {
                let (points, tets) = (parts.points.len(), parts.tets.len() as u64);
                let mesh = TetMesh::new(parts).with_context(named)?;
                let shape = mesh.file_cells().shape;
                let counts = vec![(shape, tets / mesh.file_cells().tets_per_cell.max(1) as u64)];
                (counts, points, Some(mesh), None, vec![])
            }
            Contents::Cells(grid) => {
                let (counts, points) = (grid.cells.counts(), grid.points.len());
                if counts.iter().any(|(cell_type, _)| cell_type.dimension() == Some(3)) {
                    let mesh = to_tets(grid).and_then(TetMesh::new).with_context(named)?;
                    (counts, points, Some(mesh), None, vec![])
                } else {
                    (counts, points, None, Some(Surface::of_grid(&grid).with_context(named)?), grid.notes)
                }
            }
        };
        let (surface, notes) = match (surface, &mesh) {
            (Some(surface), _) => (surface, notes),
            (None, Some(mesh)) => (Surface::of_mesh(mesh), mesh.notes().to_vec()),
            (None, None) => bail!("{}: neither a mesh nor a surface", path.display()),
        };
        if surface.triangles.is_empty() {
            bail!("{}: the mesh has no boundary", path.display());
        }
        let figures = surface.figures();
        let quality = mesh.as_ref().map(quality).transpose()?.unwrap_or_default();
        let tets = mesh.as_ref().map(|mesh| (0..mesh.tets().len()).map(|tet| signed_volume(&mesh.corners(tet)).abs()).sum());
        Ok(Side {
            path: path.to_owned(),
            name,
            counts,
            points,
            bounds: surface.bounds().translated(surface.origin),
            volume: tets.or(figures.volume),
            components: mesh
                .as_ref()
                .map_or(figures.components, |mesh| components(mesh.points().len(), mesh.tets().iter().map(|tet| &tet[..]))),
            mesh: mesh.map(Arc::new),
            surface,
            figures,
            quality,
            notes,
        })
    }

    /// The same with the surface's points relative to the other's origin.
    pub fn relative_to(self, other: &Side) -> Self {
        Side { surface: self.surface.relative_to(other.surface.origin), ..self }
    }
}

fn quality(mesh: &TetMesh) -> Result<Vec<Summary>> {
    let of = |&metric: &Metric| {
        let values = with_bar(|progress| values(mesh, metric, Rule::Definition, progress))?;
        Ok(Summary::new(mesh, metric, &values, 1, 1))
    };
    Metric::USUAL.iter().map(of).collect()
}

impl Measured {
    /// Measures surfaces and fields.
    pub fn new(sides: [Side; 2], fields: Option<[ScalarField; 2]>, snap: f64) -> Result<Self> {
        let options = DistanceOptions::default();
        let [a, b] = &sides;
        let (near_a, near_b) = rayon::join(|| Nearest::new(&a.surface), || Nearest::new(&b.surface));
        let nearest = [near_a, near_b];
        let distances =
            with_bar(|progress| SurfaceDistances::between([&a.surface, &b.surface], [&nearest[0], &nearest[1]], &options, progress))?;
        let field = match (fields, &a.mesh, &b.mesh) {
            (Some(fields), Some(on_a), Some(on_b)) => {
                let [of_a, of_b] = [(on_a, &fields[0]), (on_b, &fields[1])].map(|(mesh, field)| OnMesh { mesh, field });
                let snap = snap * distances.diagonal;
                let difference = with_bar(|progress| FieldDifference::measure(of_a, of_b, snap, progress))?;
                Some(Field { fields, difference })
            }
            _ => None,
        };
        Ok(Measured { sides, nearest, options, distances, field, octrees: None, pictures: None, notes: vec![] })
    }
}
