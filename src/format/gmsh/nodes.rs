//! The section `$Nodes`.

use super::super::parse::{ParseError, Tags};
use super::numbers::{Encoding, Numbers};
use super::{Mesh, Section, Version};
use glam::DVec3;

/// What a point's number is called in messages.
const NODE: &str = "the number of a node";

impl Mesh {
    /// Reads all points; `is_parametric` is version 2's section of points that lie on entities.
    pub(super) fn read_nodes(&mut self, section: &mut Section<'_, '_>, is_parametric: bool) -> Result<(), ParseError> {
        let mut tags = Vec::new();
        let numbers = match section.version {
            Version::Two => self.nodes_of_version_2(section, is_parametric, &mut tags)?,
            _ => self.nodes_of_version_4(section, &mut tags)?,
        };
        section.leave(&numbers);
        if u32::try_from(tags.len()).is_err() {
            return Err(ParseError::invalid(numbers.place(), format!("{} nodes", tags.len()), "fewer than 2^32"));
        }
        self.nodes = Tags::new(&tags);
        Ok(())
    }

    fn nodes_of_version_2<'a>(
        &mut self,
        section: &mut Section<'_, 'a>,
        is_parametric: bool,
        tags: &mut Vec<u64>,
    ) -> Result<Numbers<'a>, ParseError> {
        let count = section.words.integer("a count of nodes")?;
        let mut numbers = section.numbers();
        let numbers_each = if section.encoding == Encoding::Text { 4 } else { 7 };
        let count = numbers.room(count, numbers_each, "nodes")?;
        self.points.reserve(count);
        tags.reserve(count);
        for _ in 0..count {
            numbers.check()?;
            tags.push(numbers.tag(false, NODE)?);
            self.points.push(point(&mut numbers)?);
            if is_parametric {
                let dimension = numbers.int("the dimension of an entity")?;
                numbers.int("the number of an entity")?;
                skip_parameters(&mut numbers, if dimension < 3 { dimension } else { 0 })?;
            }
        }
        Ok(numbers)
    }

    /// Blocks of an entity each. In 4.0 a node's number stands before its coordinates, in 4.1 all numbers of a block stand before all
    /// coordinates.
    fn nodes_of_version_4<'a>(&mut self, section: &mut Section<'_, 'a>, tags: &mut Vec<u64>) -> Result<Numbers<'a>, ParseError> {
        let is_4_1 = section.version == Version::FourOne;
        let mut numbers = section.numbers();
        let blocks = numbers.size("a count of blocks of nodes")?;
        let total = numbers.size("a count of nodes")?;
        let total = numbers.room(total, 4, "nodes")?;
        if is_4_1 {
            numbers.size("the smallest number of a node")?;
            numbers.size("the largest number of a node")?;
        }
        self.points.reserve(total);
        tags.reserve(total);
        for _ in 0..numbers.room(blocks, 4, "blocks of nodes")? {
            let first = numbers.int("an entity")?;
            let second = numbers.int("an entity")?;
            let dimension = if is_4_1 { first } else { second };
            let is_parametric = numbers.int("whether nodes have parameters")? != 0;
            let parameters = if is_parametric { dimension } else { 0 };
            let count = numbers.size("a count of nodes")?;
            let count = numbers.room(count, 4, "nodes")?;
            if is_4_1 {
                for _ in 0..count {
                    tags.push(numbers.tag(true, NODE)?);
                }
            }
            for _ in 0..count {
                numbers.check()?;
                if !is_4_1 {
                    tags.push(numbers.tag(false, NODE)?);
                }
                self.points.push(point(&mut numbers)?);
                skip_parameters(&mut numbers, parameters)?;
            }
        }
        if self.points.len() != total {
            return Err(ParseError::invalid(
                numbers.place(),
                format!("{} nodes in blocks", self.points.len()),
                format!("the {total} announced"),
            ));
        }
        Ok(numbers)
    }
}

fn point(numbers: &mut Numbers<'_>) -> Result<DVec3, ParseError> {
    const WHAT: &str = "a coordinate of a node";
    Ok(DVec3::new(numbers.real(WHAT)?, numbers.real(WHAT)?, numbers.real(WHAT)?))
}

/// Passes over where a node lies on its curve, surface or volume.
fn skip_parameters(numbers: &mut Numbers<'_>, dimension: i64) -> Result<(), ParseError> {
    for _ in 0..dimension.clamp(0, 3) {
        numbers.real("a parameter of a node")?;
    }
    Ok(())
}
