//! The numbers that files give their points and cells, and where those lie.

/// Finds things by the number that a file gives them: any numbers, in any order.
#[derive(Debug, Clone, Default)]
pub(in crate::format) struct Tags {
    lookup: Lookup,
    len: usize,
    repeated: usize,
}

#[derive(Debug, Clone)]
enum Lookup {
    /// They count up from this one.
    Counted(u64),
    /// By number less the smallest; `NONE` where there is nothing.
    Table(u64, Vec<u32>),
    /// Sorted by number.
    Sorted(Vec<(u64, u32)>),
}

impl Default for Lookup {
    fn default() -> Self {
        Lookup::Counted(0)
    }
}

const NONE: u32 = u32::MAX;

impl Tags {
    /// From the numbers in the order of the file, fewer than 2^32 of them. Of equal ones the first is found.
    pub fn new(tags: &[u64]) -> Self {
        let len = tags.len();
        let Some((&first, &smallest)) = tags.first().zip(tags.iter().min()) else { return Tags::default() };
        if tags.iter().enumerate().all(|(i, &tag)| first.checked_add(i as u64) == Some(tag)) {
            return Tags { lookup: Lookup::Counted(first), len, repeated: 0 };
        }
        let span = tags.iter().max().map_or(0, |largest| largest - smallest);
        if span < 4 * len as u64 + 1024 {
            let mut table = vec![NONE; span as usize + 1];
            let mut repeated = 0;
            for (i, &tag) in tags.iter().enumerate() {
                let place = &mut table[(tag - smallest) as usize];
                if *place == NONE { *place = i as u32 } else { repeated += 1 }
            }
            return Tags { lookup: Lookup::Table(smallest, table), len, repeated };
        }
        let mut sorted: Vec<(u64, u32)> = tags.iter().zip(0..).map(|(&tag, i)| (tag, i)).collect();
        sorted.sort_unstable();
        sorted.dedup_by_key(|(tag, _)| *tag);
        let repeated = len - sorted.len();
        Tags { lookup: Lookup::Sorted(sorted), len, repeated }
    }

    /// Where the thing of a number lies in the order of the file.
    pub fn find(&self, tag: u64) -> Option<u32> {
        match &self.lookup {
            Lookup::Counted(first) => tag.checked_sub(*first).filter(|&i| i < self.len as u64).map(|i| i as u32),
            Lookup::Table(smallest, table) => {
                let place = usize::try_from(tag.checked_sub(*smallest)?).ok()?;
                table.get(place).copied().filter(|&i| i != NONE)
            }
            Lookup::Sorted(sorted) => sorted.binary_search_by_key(&tag, |(tag, _)| *tag).ok().map(|i| sorted[i].1),
        }
    }

    /// How many have a number that one before them has.
    pub fn repeated(&self) -> usize {
        self.repeated
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counted_scattered_and_sparse_numbers_are_found() {
        for (tags, repeated) in [
            (vec![5, 6, 7], 0),
            (vec![9, 3, 3, 1], 1),
            (vec![u64::MAX, 1 << 40, 7, 1 << 40], 1),
            (vec![u64::MAX - 1, u64::MAX, u64::MAX], 1),
            (vec![], 0),
        ] {
            let found = Tags::new(&tags);
            for &tag in &tags {
                let first = tags.iter().position(|&t| t == tag).map(|i| i as u32);
                assert_eq!(found.find(tag), first, "{tag} of {tags:?}");
            }
            assert_eq!(found.repeated(), repeated, "{tags:?}");
            for tag in [0, 2, 4, 8, 1 << 41, u64::MAX - 2] {
                assert!(tags.contains(&tag) || found.find(tag).is_none(), "{tag} of {tags:?}");
            }
        }
    }
}
