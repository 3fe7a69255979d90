//! The paper's cache on the GPU: [`Areas`].

use super::{EvictionPolicy, Mdfo, MdfoParams};
use crate::bricks::{BrickKey, KeyMap, Pyramid, SliceSet};

/// Three areas: *Active* for what has just been loaded, *Stable* for what has been used in several frames, *Unused* for what the frame before
/// did not use. A hit in Unused brings a brick to Active, the `hits`-th hit in Active to Stable. A full area gives up its brick of the highest
/// `k_d min(s d_stand, m d_mov) + k_l L` ([`MdfoParams::GPU`]): Stable to Active, Active to Unused; what leaves Unused is freed.
///
/// The paper does not say how large the areas are: here Stable and Active have a share of the whole each, Unused is the rest.
#[derive(Debug)]
pub struct Areas {
    /// Stable, Active, Unused, each with the priorities of its bricks.
    areas: [Mdfo; 3],
    counts: [usize; 3],
    limits: [usize; 2],
    hits: u32,
    frame: u64,
    places: KeyMap<Place>,
}

#[derive(Debug, Clone, Copy)]
struct Place {
    area: usize,
    hits: u32,
    frame: u64,
}

const STABLE: usize = 0;
const ACTIVE: usize = 1;
const UNUSED: usize = 2;

impl Areas {
    /// The areas of a cache of so many bricks: 40 % Stable, 40 % Active, and 3 hits to become stable.
    pub fn new(pyramid: &Pyramid, capacity: usize) -> Self {
        Self::with_shares(pyramid, capacity, [0.4, 0.4], 3)
    }

    /// The same with other shares of Stable and Active, and hits.
    pub fn with_shares(pyramid: &Pyramid, capacity: usize, shares: [f64; 2], hits: u32) -> Self {
        Areas {
            areas: std::array::from_fn(|_| Mdfo::new(pyramid, MdfoParams::GPU)),
            counts: [0; 3],
            limits: shares.map(|share| ((share * capacity as f64) as usize).max(1)),
            hits,
            frame: 0,
            places: KeyMap::default(),
        }
    }

    fn put(&mut self, key: BrickKey, area: usize, hits: u32) {
        if let Some(old) = self.places.insert(key, Place { area, hits, frame: self.frame }) {
            self.areas[old.area].remove(key);
            self.counts[old.area] -= 1;
        }
        self.areas[area].insert(key);
        self.counts[area] += 1;
        if area < UNUSED && self.counts[area] > self.limits[area] {
            // The one just put in stays.
            if let Some(out) = self.areas[area].victim(&|other| other != key) {
                let place = self.places[&out];
                self.put(out, area + 1, 0);
                // Moving is no use.
                self.places.entry(out).and_modify(|moved| moved.frame = place.frame);
            }
        }
    }
}

impl EvictionPolicy for Areas {
    fn name(&self) -> &'static str {
        "areas"
    }

    fn frame(&mut self, slices: &SliceSet) {
        let unused: Vec<BrickKey> =
            self.places.iter().filter(|(_, place)| place.area == ACTIVE && place.frame < self.frame).map(|(&key, _)| key).collect();
        for key in unused {
            let frame = self.places[&key].frame;
            self.put(key, UNUSED, 0);
            self.places.entry(key).and_modify(|moved| moved.frame = frame);
        }
        self.frame += 1;
        self.areas.iter_mut().for_each(|area| area.frame(slices));
    }

    fn reconsider(&mut self) {
        self.areas.iter_mut().for_each(|area| area.reconsider());
    }

    fn hit(&mut self, key: BrickKey) {
        let Some(place) = self.places.get_mut(&key) else { return };
        place.frame = self.frame;
        match place.area {
            STABLE => {}
            ACTIVE => {
                place.hits += 1;
                if place.hits >= self.hits {
                    self.put(key, STABLE, 0);
                }
            }
            _ => self.put(key, ACTIVE, 0),
        }
    }

    fn insert(&mut self, key: BrickKey) {
        self.put(key, ACTIVE, 0);
    }

    fn remove(&mut self, key: BrickKey) {
        if let Some(place) = self.places.remove(&key) {
            self.areas[place.area].remove(key);
            self.counts[place.area] -= 1;
        }
    }

    fn victim(&mut self, may: &dyn Fn(BrickKey) -> bool) -> Option<BrickKey> {
        [UNUSED, ACTIVE, STABLE].into_iter().find_map(|area| self.areas[area].victim(may))
    }
}
