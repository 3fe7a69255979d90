//! Parts and their instances: where an assembly has them.

use super::super::parse::ParseError;
use super::Model;
use crate::mesh::CellType;
use glam::{DQuat, DVec3};
use std::collections::HashMap;
use std::ops::Range;

/// Bytes of memory that copies of parts may take for each byte of the files.
const BYTES_PER_BYTE: usize = 256;

/// A part: its points and cells, where it is defined.
#[derive(Debug)]
struct Part {
    points: Range<usize>,
    cells: Range<usize>,
    is_placed: bool,
}

/// All parts and instances.
#[derive(Debug, Default)]
pub(super) struct Assembly {
    parts: Vec<Part>,
    /// By name in capitals.
    by_name: HashMap<String, usize>,
    instances: Vec<Instance>,
    /// The part that is being read, and where it began.
    open: Option<(String, usize, usize)>,
}

/// Where a part is put.
#[derive(Debug)]
struct Instance {
    part: String,
    /// What its lines say: a shift, then two points of an axis and an angle in degrees.
    numbers: Vec<f64>,
}

impl Assembly {
    /// A part begins.
    pub fn begin_part(&mut self, name: &str, points: usize, cells: usize) {
        self.open = Some((name.to_ascii_uppercase(), points, cells));
    }

    /// The part that is being read, if there is one, ends.
    pub fn end_part(&mut self, points: usize, cells: usize) {
        if let Some((name, first_point, first_cell)) = self.open.take() {
            self.by_name.insert(name, self.parts.len());
            self.parts.push(Part { points: first_point..points, cells: first_cell..cells, is_placed: false });
        }
    }

    /// An instance of a part begins.
    pub fn begin_instance(&mut self, part: &str) {
        self.instances.push(Instance { part: part.to_ascii_uppercase(), numbers: Vec::new() });
    }

    /// A line of where the instance is; gives whether it may have so many.
    pub fn place(&mut self, numbers: &[f64]) -> bool {
        let Some(instance) = self.instances.last_mut() else { return false };
        instance.numbers.extend_from_slice(numbers);
        instance.numbers.len() <= 10
    }
}

impl Instance {
    /// A point of the part in the assembly: shifted, then turned about the axis.
    fn placed(&self, point: DVec3) -> DVec3 {
        let number = |i: usize| self.numbers.get(i).copied().unwrap_or(0.0);
        let at = |i: usize| DVec3::new(number(i), number(i + 1), number(i + 2));
        let shifted = point + at(0);
        let (start, end, angle) = (at(3), at(6), number(9));
        match (end - start).try_normalize() {
            Some(axis) if angle != 0.0 => start + DQuat::from_axis_angle(axis, angle.to_radians()) * (shifted - start),
            _ => shifted,
        }
    }
}

impl Model {
    /// Puts all parts where their instances are; a part with several is there several times. `file_bytes` bounds what that may take.
    pub(super) fn assemble(&mut self, file_bytes: usize, notes: &mut Vec<String>) -> Result<(), ParseError> {
        let mut assembly = std::mem::take(&mut self.assembly);
        let (mut budget, mut missing, mut turned) = (BYTES_PER_BYTE.saturating_mul(file_bytes).saturating_add(1 << 20), 0u64, Vec::new());
        for instance in &assembly.instances {
            let Some(&index) = assembly.by_name.get(&instance.part) else {
                missing += 1;
                continue;
            };
            let part = &mut assembly.parts[index];
            if !std::mem::replace(&mut part.is_placed, true) {
                // The first takes the part's place once all others are copied from it.
                turned.push((index, instance));
                continue;
            }
            let points = part.points.len();
            let nodes: usize = part.cells.clone().map(|cell| self.cells.get(cell).1.len()).sum();
            let bytes = 24 * points + 4 * nodes + 13 * part.cells.len();
            budget = budget.checked_sub(bytes).ok_or_else(|| {
                ParseError::invalid("the assembly", "instances of large parts", "a mesh of a size in keeping with the file's")
            })?;
            let first = u32::try_from(self.points.len()).ok().filter(|_| u32::try_from(self.points.len() + points).is_ok());
            let first = first.ok_or_else(|| ParseError::invalid("the assembly", "too many nodes", "fewer than 2^32"))?;
            self.points.extend_from_within(part.points.clone());
            self.points[first as usize..].iter_mut().for_each(|point| *point = instance.placed(*point));
            for cell in part.cells.clone() {
                let (cell_type, own) = self.cells.get(cell);
                let (cell_type, mut copy, len): (CellType, [u32; 27], usize) = (cell_type, [0; 27], own.len());
                copy[..len].copy_from_slice(own);
                copy[..len].iter_mut().for_each(|point| *point = *point - part.points.start as u32 + first);
                self.cells.push(cell_type, &copy[..len])?;
                self.sets.push(self.sets[cell]);
            }
        }
        for (index, instance) in turned {
            let points = assembly.parts[index].points.clone();
            self.points[points].iter_mut().for_each(|point| *point = instance.placed(*point));
        }
        if missing > 0 {
            notes.push(format!("{missing} instances are of parts that are not in the file"));
        }
        let loose = assembly.parts.iter().filter(|part| !part.is_placed && !part.points.is_empty()).count();
        if loose > 0 && !assembly.instances.is_empty() {
            notes.push(format!("{loose} parts have no instance; they are where they are defined"));
        }
        Ok(())
    }
}
