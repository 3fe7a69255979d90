//! Parts of a mesh, each with arrays of its own, as one.

use super::Pieces;
use crate::mesh::{DataArray, UnstructuredGrid, Values};

/// Arrays over the points or cells of all parts so far. A part that lacks an array of another has no values there.
#[derive(Debug, Default)]
pub(in crate::format) struct Columns(Vec<Column>);

#[derive(Debug)]
struct Column {
    name: String,
    components: usize,
    pieces: Pieces,
}

impl Columns {
    /// Adds a part's array, whose first tuple is that of the point or cell `start`. Says what is wrong if it does not go with the array
    /// of this name of another part.
    pub fn add(&mut self, name: &str, components: usize, start: usize, values: Values) -> Result<(), String> {
        let column = match self.0.iter_mut().position(|column| column.name == name) {
            Some(place) => &mut self.0[place],
            None => {
                self.0.push(Column { name: name.to_owned(), components, pieces: Pieces::new() });
                let last = self.0.len() - 1;
                &mut self.0[last]
            }
        };
        if column.components != components {
            return Err(format!(
                "array \"{name}\" has {components} components in one part and {} in another; the latter were read",
                column.components
            ));
        }
        column.pieces.fill_to(start * components);
        column.pieces.append(values);
        Ok(())
    }

    /// How many numbers they have for so many points or cells.
    pub fn numbers(&self, tuples: usize) -> usize {
        self.0.iter().fold(0usize, |sum, column| sum.saturating_add(column.components.saturating_mul(tuples)))
    }

    /// The arrays over so many points or cells.
    pub fn arrays(self, tuples: usize) -> Vec<DataArray> {
        let array = |Column { name, components, mut pieces }: Column| {
            pieces.fill_to(tuples * components);
            DataArray { name, components, values: pieces.values() }
        };
        self.0.into_iter().map(array).collect()
    }
}

/// A grid that is put together of parts.
#[derive(Debug, Default)]
pub(in crate::format) struct Joined {
    /// Its points, cells and notes; the arrays are elsewhere.
    pub grid: UnstructuredGrid,
    /// How many cells of the file were gone through, those that are not in the grid too.
    pub seen: usize,
    /// Its arrays over points.
    pub point_data: Columns,
    /// Its arrays over cells.
    pub cell_data: Columns,
}

impl Joined {
    /// Says something once.
    pub fn note(&mut self, note: String) {
        if !self.grid.notes.contains(&note) {
            self.grid.notes.push(note);
        }
    }

    /// Numbers the cells of a part that went to the grid, where there were `before`: those of the part's that are kept.
    pub fn number(&mut self, before: usize, keep: &[bool]) {
        if keep.contains(&false) || !self.grid.numbers.is_empty() {
            let number = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
            self.grid.numbers.extend((self.grid.numbers.len()..before).map(number));
            self.grid.numbers.extend((self.seen..).zip(keep).filter(|(_, keep)| **keep).map(|(n, _)| number(n)));
        }
        self.seen += keep.len();
    }

    /// How many numbers all arrays have together.
    pub fn numbers(&self) -> usize {
        self.point_data.numbers(self.grid.points.len()).saturating_add(self.cell_data.numbers(self.grid.cells.len()))
    }

    /// The grid with its arrays.
    pub fn finish(self) -> UnstructuredGrid {
        let mut grid = self.grid;
        grid.point_data = self.point_data.arrays(grid.points.len());
        grid.cell_data = self.cell_data.arrays(grid.cells.len());
        grid
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_numbered_as_the_file_has_them() {
        let mut joined = Joined::default();
        joined.number(0, &[true, true]);
        assert!(joined.grid.numbers.is_empty());
        joined.number(2, &[false, true, false, true]);
        joined.number(4, &[true]);
        assert_eq!(joined.grid.numbers, [0, 1, 3, 5, 6]);
    }

    #[test]
    fn parts_without_an_array_have_no_values() {
        let mut columns = Columns::default();
        columns.add("a", 1, 0, Values::F32(vec![1.0, 2.0])).expect("the first");
        columns.add("b", 2, 2, Values::F64(vec![0.1, 0.2])).expect("the first");
        columns.add("a", 1, 3, Values::F32(vec![4.0])).expect("like the first");
        assert!(columns.add("a", 3, 4, Values::F32(vec![4.0; 3])).is_err_and(|e| e.contains("\"a\" has 3 components")));
        assert_eq!(columns.numbers(5), 15);
        let arrays = columns.arrays(5);
        let text = |i: usize| format!("{:?}", arrays[i].values);
        assert_eq!(text(0), "F32([1.0, 2.0, NaN, 4.0, NaN])");
        assert_eq!(text(1), "F64([NaN, NaN, NaN, NaN, 0.1, 0.2, NaN, NaN, NaN, NaN])");
    }
}
