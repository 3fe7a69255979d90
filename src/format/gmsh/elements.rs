//! The section `$Elements`.

use super::super::parse::{ParseError, Tags};
use super::element_type::ElementType;
use super::numbers::{Encoding, Numbers};
use super::{Mesh, Section, Version};

/// What an element's number is called in messages.
const ELEMENT: &str = "the number of an element";

impl Mesh {
    /// Reads all elements.
    pub(super) fn read_elements(&mut self, section: &mut Section<'_, '_>) -> Result<(), ParseError> {
        let mut tags = Vec::new();
        let numbers = match section.version {
            Version::Two => self.elements_of_version_2(section, &mut tags)?,
            _ => self.elements_of_version_4(section, &mut tags)?,
        };
        section.leave(&numbers);
        self.elements = Tags::new(&tags);
        Ok(())
    }

    /// As text an element says its type and how many tags it has, in binary a block of elements does.
    fn elements_of_version_2<'a>(&mut self, section: &mut Section<'_, 'a>, tags: &mut Vec<u64>) -> Result<Numbers<'a>, ParseError> {
        let count: u64 = section.words.integer("a count of elements")?;
        let is_text = section.encoding == Encoding::Text;
        let mut numbers = section.numbers();
        let count = numbers.room(count, 2, "elements")?;
        let mut element_type = None;
        let mut nodes = Vec::new();
        while tags.len() < count {
            let mut block = 1;
            let mut tag = 0;
            if is_text {
                tag = numbers.tag(false, ELEMENT)?;
            }
            let number = numbers.int("a type of elements")?;
            let element_type = of_number(&mut element_type, number, &numbers)?;
            if !is_text {
                block = numbers.tag(false, "a count of elements")?;
                if block == 0 || block > (count - tags.len()) as u64 {
                    let found = format!("a block of {block} elements");
                    return Err(ParseError::invalid(numbers.place(), found, format!("1 to {}", count - tags.len())));
                }
            }
            let tag_count = numbers.tag(false, "a count of tags")?;
            let tag_count = numbers.room(tag_count, 1, "tags of an element")?;
            for _ in 0..block {
                numbers.check()?;
                if !is_text {
                    tag = numbers.tag(false, ELEMENT)?;
                }
                let mut groups = [f64::NAN; 2];
                for i in 0..tag_count {
                    let group = numbers.int("a tag of an element")?;
                    if let Some(place) = groups.get_mut(i) {
                        *place = group as f64;
                    }
                }
                tags.push(tag);
                self.push(element_type, tag, groups, false, &mut numbers, &mut nodes)?;
            }
        }
        Ok(numbers)
    }

    /// Blocks of an entity each.
    fn elements_of_version_4<'a>(&mut self, section: &mut Section<'_, 'a>, tags: &mut Vec<u64>) -> Result<Numbers<'a>, ParseError> {
        let is_4_1 = section.version == Version::FourOne;
        let mut numbers = section.numbers();
        let blocks = numbers.size("a count of blocks of elements")?;
        let total = numbers.size("a count of elements")?;
        let total = numbers.room(total, 2, "elements")?;
        if is_4_1 {
            numbers.size("the smallest number of an element")?;
            numbers.size("the largest number of an element")?;
        }
        let mut element_type = None;
        let mut nodes = Vec::new();
        for _ in 0..numbers.room(blocks, 4, "blocks of elements")? {
            let first = numbers.int("an entity")?;
            let second = numbers.int("an entity")?;
            let (dimension, entity) = if is_4_1 { (first, second) } else { (second, first) };
            let groups = [self.entities.physical(dimension, entity).map_or(f64::NAN, |group| group as f64), entity as f64];
            let number = numbers.int("a type of elements")?;
            let element_type = of_number(&mut element_type, number, &numbers)?;
            let count = numbers.size("a count of elements")?;
            for _ in 0..numbers.room(count, 1 + element_type.nodes, "elements")? {
                numbers.check()?;
                let tag = numbers.tag(is_4_1, ELEMENT)?;
                tags.push(tag);
                self.push(element_type, tag, groups, is_4_1, &mut numbers, &mut nodes)?;
            }
        }
        if tags.len() != total {
            return Err(ParseError::invalid(
                numbers.place(),
                format!("{} elements in blocks", tags.len()),
                format!("the {total} announced"),
            ));
        }
        Ok(numbers)
    }

    /// Reads the nodes of an element, and adds it. `groups` are its physical group and its entity.
    fn push(
        &mut self,
        element_type: &ElementType,
        tag: u64,
        groups: [f64; 2],
        has_wide_tags: bool,
        numbers: &mut Numbers<'_>,
        nodes: &mut Vec<u32>,
    ) -> Result<(), ParseError> {
        nodes.clear();
        for _ in 0..element_type.nodes {
            let node = numbers.tag(has_wide_tags, "a node of an element")?;
            let missing =
                || ParseError::invalid(format!("{}, element {tag}", numbers.place()), format!("node {node}"), "a node that is in the file");
            nodes.push(self.nodes.find(node).ok_or_else(missing)?);
        }
        // The cell's nodes come behind the element's.
        nodes.resize(element_type.nodes + element_type.order.len(), 0);
        let (element, cell) = nodes.split_at_mut(element_type.nodes);
        cell.iter_mut().zip(&element_type.order).for_each(|(node, &i)| *node = element[usize::from(i)]);
        self.cells.push(element_type.cell_type, cell)?;
        self.types.push(element_type.number);
        self.physical.push(groups[0]);
        self.geometrical.push(groups[1]);
        if !element_type.is_whole() {
            *self.cut_down.entry(element_type.number).or_default() += 1;
        }
        Ok(())
    }
}

/// The type of a number; `last` is the one before, which it usually is again.
fn of_number<'t>(last: &'t mut Option<ElementType>, number: i64, numbers: &Numbers<'_>) -> Result<&'t ElementType, ParseError> {
    if last.as_ref().is_none_or(|last| i64::from(last.number) != number) {
        *last = ElementType::of(number);
    }
    last.as_ref().ok_or_else(|| {
        ParseError::invalid(numbers.place(), format!("elements of type {number}"), "a type of Gmsh's with a fixed count of nodes")
    })
}
