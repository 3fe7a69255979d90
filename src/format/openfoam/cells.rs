//! Cells from the faces of a mesh.

use super::super::parse::ParseError;
use crate::mesh::{CellType, Cells};
use crate::progress::Progress;

/// The faces of a mesh. A face's points go round it so that by the right hand its normal leaves its owner.
#[derive(Debug, Clone, Default)]
pub(super) struct Faces {
    /// Where the points of each end in `points`.
    pub ends: Vec<u32>,
    pub points: Vec<u32>,
    /// The cell of each face.
    pub owner: Vec<u32>,
    /// The cell beyond each face, as far as there is one; [`u32::MAX`] if not.
    pub neighbour: Vec<u32>,
}

impl Faces {
    fn of(&self, face: usize) -> &[u32] {
        let start = if face == 0 { 0 } else { self.ends[face - 1] as usize };
        &self.points[start..self.ends[face] as usize]
    }

    /// The points of a face in the order in which its normal leaves a cell.
    fn leaving(&self, face: u32, cell: u32) -> impl Iterator<Item = u32> + Clone {
        let points = self.of(face as usize);
        let is_owned = self.owner[face as usize] == cell;
        (0..points.len()).map(move |i| if is_owned || i == 0 { points[i] } else { points[points.len() - i] })
    }

    /// The faces of each cell: where they end, and all of them.
    fn by_cell(&self) -> Result<(Vec<u32>, Vec<u32>), ParseError> {
        let faces = self.ends.len();
        if self.owner.len() != faces {
            let found = format!("{} owners", self.owner.len());
            return Err(ParseError::invalid("constant/polyMesh/owner", found, format!("one for each of the {faces} faces")));
        }
        let sides = || {
            let neighbours = self.neighbour.iter().enumerate().filter(|&(_, &cell)| cell != u32::MAX);
            self.owner.iter().enumerate().chain(neighbours).map(|(face, &cell)| (face, cell))
        };
        let cells = sides().map(|(_, cell)| cell as usize + 1).max().unwrap_or(0);
        if cells > faces.saturating_mul(2) {
            let expected = format!("no cell beyond {} of {faces} faces", faces * 2);
            return Err(ParseError::invalid("constant/polyMesh/owner", format!("the cell {}", cells - 1), expected));
        }
        if let Some(face) = (0..faces.min(self.neighbour.len())).find(|&face| self.neighbour[face] == self.owner[face]) {
            let found = format!("face {face} between cell {} and itself", self.owner[face]);
            return Err(ParseError::invalid("constant/polyMesh/neighbour", found, "two cells"));
        }
        let mut ends = vec![0_u32; cells + 1];
        sides().for_each(|(_, cell)| ends[cell as usize + 1] += 1);
        for cell in 0..cells {
            ends[cell + 1] += ends[cell];
        }
        // Each place is where the next face of a cell goes; in the end that is where its faces end.
        let mut list = vec![0_u32; ends[cells] as usize];
        for (face, cell) in sides() {
            let place = &mut ends[cell as usize];
            list[*place as usize] = face as u32;
            *place += 1;
        }
        ends.pop();
        Ok((ends, list))
    }

    /// All cells: tets, pyramids, wedges and hexahedra where the faces make one, else polyhedra.
    pub fn cells(&self, progress: &Progress) -> Result<Cells, ParseError> {
        let (ends, list) = self.by_cell()?;
        let mut cells = Cells::with_capacity(ends.len(), ends.len() * 8);
        let (mut start, mut stream) = (0, Vec::new());
        for (cell, &end) in ends.iter().enumerate() {
            let own = &list[start..end as usize];
            start = end as usize;
            match self.corners(cell as u32, own) {
                Some((cell_type, corners, count)) => cells.push(cell_type, &corners[..count])?,
                None => {
                    stream.clear();
                    stream.push(own.len() as u32);
                    for &face in own {
                        stream.push(self.of(face as usize).len() as u32);
                        stream.extend(self.leaving(face, cell as u32));
                    }
                    cells.push(CellType::POLYHEDRON, &stream)?;
                }
            }
            if cell.is_multiple_of(1 << 14) {
                progress.check()?;
            }
        }
        Ok(cells)
    }

    /// The type of a cell and its corners in VTK's order, and how many these are; `None` if it is a polyhedron of no special kind.
    fn corners(&self, cell: u32, faces: &[u32]) -> Option<(CellType, [u32; 8], usize)> {
        let sides = |face: &u32| self.of(*face as usize).len();
        let quads = faces.iter().filter(|face| sides(face) == 4).count();
        let triangles = faces.iter().filter(|face| sides(face) == 3).count();
        let (cell_type, base_sides, tops) = match (triangles, quads, faces.len()) {
            (4, 0, 4) => (CellType::TETRA, 3, 1),
            (4, 1, 5) => (CellType::PYRAMID, 4, 1),
            (2, 3, 5) => (CellType::WEDGE, 3, 3),
            (0, 6, 6) => (CellType::HEXAHEDRON, 4, 4),
            _ => return None,
        };
        let base = *faces.iter().find(|face| sides(face) == base_sides)?;
        let mut corners = [0; 8];
        let mut leaving = self.leaving(base, cell);
        corners[..base_sides].fill_with(|| leaving.next().unwrap_or(0));
        // VTK's base faces look into the cell, also (from VTK 9.7 on) the wedge's.
        corners[..base_sides].reverse();
        for i in 0..tops {
            corners[base_sides + i] = self.above(corners[i], &corners[..base_sides], faces, base)?;
        }
        let count = base_sides + tops;
        let own = &corners[..count];
        let are_apart = (1..count).all(|i| !own[..i].contains(&own[i]));
        let are_all = faces.iter().all(|&face| self.of(face as usize).iter().all(|point| own.contains(point)));
        let top = &own[base_sides..];
        let has_top = tops == 1 || faces.iter().any(|&face| self.of(face as usize).iter().all(|point| top.contains(point)));
        (are_apart && are_all && has_top).then_some((cell_type, corners, count))
    }

    /// The one point that edges lead to from a point of the base and that is not of the base.
    fn above(&self, point: u32, base_points: &[u32], faces: &[u32], base: u32) -> Option<u32> {
        let mut above = None;
        for &face in faces.iter().filter(|&&face| face != base) {
            let points = self.of(face as usize);
            let Some(at) = points.iter().position(|&p| p == point) else { continue };
            for next in [points[(at + 1) % points.len()], points[(at + points.len() - 1) % points.len()]] {
                if !base_points.contains(&next) && *above.get_or_insert(next) != next {
                    return None;
                }
            }
        }
        above
    }
}
