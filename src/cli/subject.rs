//! What a file gives to draw, within the budget of memory.

use super::args::{MeshArgs, RawArgs};
use super::long_work::with_bar;
use crate::format::{self, Contents, Data, ReadOptions, SolutionFile};
use crate::mesh::generate::WING_VTU;
use crate::octree::{Octree, OctreeParams, Subject};
use crate::progress::Progress;
use anyhow::Result;
use std::sync::Arc;

/// Reads the file that the arguments name and picks the field.
pub fn read_subject(args: &MeshArgs, raw: &RawArgs) -> Result<Subject> {
    Ok(match read_data(args, raw, true)? {
        Data::Mesh(mesh) => {
            let field = args.field(&mesh)?;
            Subject::Mesh(Arc::new(mesh), Arc::new(field))
        }
        Data::Grid(grid) => Subject::Volume(Arc::new(grid)),
    })
}

/// `Err` if an octree of the subject may take more than the budget.
pub fn check_budget(args: &MeshArgs, subject: &Subject) -> Result<()> {
    args.check_bytes(&subject.size_in_words(), subject.working_bytes())
}

/// The octree, if the budget of memory allows it.
pub fn regularized(args: &MeshArgs, subject: &Subject, params: &OctreeParams) -> Result<Octree> {
    check_budget(args, subject)?;
    with_bar(|progress| subject.regularize(params, progress))
}

/// How files are read.
pub fn read_options(args: &MeshArgs, raw: &RawArgs) -> ReadOptions {
    ReadOptions { raw: raw.layout(), segy: raw.segy.options(), ..args.options() }
}

/// Reads the file that the arguments name, or the bundled mesh, its cells as they are. A PLOT3D grid needs no solution.
pub fn read_contents(args: &MeshArgs, raw: &RawArgs) -> Result<Contents> {
    let Some(path) = &args.mesh else { return Ok(format::embedded_contents("wing.vtu", WING_VTU, &Progress::new())?) };
    let mut options = read_options(args, raw);
    if options.solution == SolutionFile::Beside {
        options.solution = SolutionFile::IfBeside;
    }
    with_bar(|progress| format::read_contents(path, &options, progress))
}

/// Reads the file that the arguments name, or the bundled mesh. `needs_solution`: a PLOT3D grid without one is an error.
pub fn read_data(args: &MeshArgs, raw: &RawArgs, needs_solution: bool) -> Result<Data> {
    let Some(path) = &args.mesh else { return Ok(Data::Mesh(args.read()?)) };
    let mut options = read_options(args, raw);
    if !needs_solution && options.solution == SolutionFile::Beside {
        options.solution = SolutionFile::IfBeside;
    }
    with_bar(|progress| format::read(path, &options, progress))
}
