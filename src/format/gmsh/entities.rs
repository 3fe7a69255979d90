//! The section `$Entities`: which physical groups a geometrical entity is in.

use super::super::parse::ParseError;
use super::{Section, Version};
use std::collections::HashMap;

/// The physical groups of entities.
#[derive(Debug, Default)]
pub(super) struct Entities {
    /// By dimension and number.
    physical: HashMap<(i64, i64), i64>,
    /// Whether an entity is in more than one, of which the first is kept.
    pub has_several_groups: bool,
}

impl Entities {
    /// The physical group of an entity.
    pub fn physical(&self, dimension: i64, tag: i64) -> Option<i64> {
        self.physical.get(&(dimension, tag)).copied()
    }

    /// Reads the section, or the one of entities that are cut into partitions.
    pub fn read(&mut self, section: &mut Section<'_, '_>, is_partitioned: bool) -> Result<(), ParseError> {
        let mut numbers = section.numbers();
        if is_partitioned {
            numbers.size("a count of partitions")?;
            let ghosts = numbers.size("a count of ghost entities")?;
            for _ in 0..2 * numbers.room(ghosts, 2, "ghost entities")? {
                numbers.int("a ghost entity")?;
            }
        }
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = numbers.size("a count of entities")?;
        }
        for (dimension, count) in (0..).zip(counts) {
            for _ in 0..numbers.room(count, 5, "entities")? {
                numbers.check()?;
                let tag = numbers.int("the number of an entity")?;
                if is_partitioned {
                    numbers.int("the dimension of a parent")?;
                    numbers.int("the number of a parent")?;
                    let partitions = numbers.size("a count of partitions")?;
                    for _ in 0..numbers.room(partitions, 1, "partitions")? {
                        numbers.int("a partition")?;
                    }
                }
                let bounds = if dimension == 0 && section.version == Version::FourOne { 3 } else { 6 };
                for _ in 0..bounds {
                    numbers.real("the bounds of an entity")?;
                }
                let groups = numbers.size("a count of physical groups")?;
                for i in 0..numbers.room(groups, 1, "physical groups")? {
                    let group = numbers.int("a physical group")?;
                    if i == 0 {
                        self.physical.insert((dimension, tag), group);
                    } else {
                        self.has_several_groups = true;
                    }
                }
                if dimension > 0 {
                    let boundary = numbers.size("a count of entities around")?;
                    for _ in 0..numbers.room(boundary, 1, "entities around")? {
                        numbers.int("an entity around")?;
                    }
                }
            }
        }
        section.leave(&numbers);
        Ok(())
    }
}
