//! The paper's policy and its plain relative: how far a brick is from the slices.

use super::EvictionPolicy;
use crate::bricks::{BRICK_EDGE, BrickKey, KeyMap, Pyramid, SliceSet};
use glam::DVec3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// The constants of equation (3): a brick is evicted by the largest `k_d min(s d_stand, m d_mov) + k_l L + k_t T`.
///
/// `d_stand` and `d_mov` are the distances of the brick's middle from the nearest slice that rests and from the one that moves, in bricks of
/// level 0, whatever the brick's own level is: it is the slices that travel, and they cover the same way for all. `L` is the level counted as
/// the paper counts, from the coarsest; `T` the number of frames since the last use.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MdfoParams {
    /// Weight of the distance, 5.
    pub k_d: f64,
    /// Weight of the level, 10.
    pub k_l: f64,
    /// Weight of the time, 1.
    pub k_t: f64,
    /// Factor of the distance from slices at rest, 1.5.
    pub s: f64,
    /// Factor of the distance from the moving slice, 1.
    pub m: f64,
}

impl Default for MdfoParams {
    fn default() -> Self {
        MdfoParams { k_d: 5.0, k_l: 10.0, k_t: 1.0, s: 1.5, m: 1.0 }
    }
}

impl MdfoParams {
    /// Distance alone; of equals, the least recently used goes first.
    pub const DISTANCE: MdfoParams = MdfoParams { k_d: 1.0, k_l: 0.0, k_t: 1e-9, s: 1.0, m: 1.0 };
    /// Those of the areas on the GPU.
    pub const GPU: MdfoParams = MdfoParams { k_d: 1.0, k_l: 2.0, k_t: 0.0, s: 1.5, m: 1.0 };

    /// How soon a brick is to be evicted, with slices where they are now: the larger the sooner.
    pub fn priority(&self, pyramid: &Pyramid, slices: &SliceSet, key: BrickKey, frames_unused: u64) -> f64 {
        let middle = key.center();
        let mut nearest = f64::INFINITY;
        for (i, plane) in slices.planes.iter().enumerate() {
            let weight = if slices.moving == Some(i) { self.m } else { self.s };
            nearest = nearest.min(weight * plane.distance(middle).abs());
        }
        let nearest = if nearest.is_finite() { nearest / f64::from(BRICK_EDGE) } else { 0.0 };
        self.k_d * nearest + self.k_l * f64::from(pyramid.levels() - 1 - key.level) + self.k_t * frames_unused as f64
    }
}

/// Maximum distance first out: the paper's policy, and by [`MdfoParams::DISTANCE`] that of distance alone.
///
/// The priorities of all bricks change in every frame, but by no more than the slices have moved: an entry of the heap holds an upper bound,
/// and only those that come to the top are worked out anew.
#[derive(Debug)]
pub struct Mdfo {
    name: &'static str,
    params: MdfoParams,
    pyramid: Pyramid,
    slices: SliceSet,
    frame: u64,
    /// By how much a priority can have grown since the beginning.
    growth: f64,
    used: KeyMap<u64>,
    heap: BinaryHeap<Bound>,
    aside: Vec<BrickKey>,
}

/// Beyond this growth, priorities would lose their decimals.
const MOST_GROWTH: f64 = 1e9;

/// Entries that the heap may have beside two for each resident brick: those of bricks that have left.
const SPARE: usize = 1024;

/// A brick and its priority, less the growth until it was worked out, at most.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Bound(f64, BrickKey);

impl Eq for Bound {}

impl PartialOrd for Bound {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Bound {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then_with(|| other.1.cmp(&self.1))
    }
}

impl Mdfo {
    /// The paper's policy.
    pub fn new(pyramid: &Pyramid, params: MdfoParams) -> Self {
        Self::called("MDFO", pyramid, params)
    }

    /// The distance alone.
    pub fn distance(pyramid: &Pyramid) -> Self {
        Self::called("distance", pyramid, MdfoParams::DISTANCE)
    }

    fn called(name: &'static str, pyramid: &Pyramid, params: MdfoParams) -> Self {
        Mdfo {
            name,
            params,
            pyramid: *pyramid,
            slices: SliceSet::default(),
            frame: 0,
            growth: 0.0,
            used: KeyMap::default(),
            heap: BinaryHeap::new(),
            aside: Vec::new(),
        }
    }

    /// How long the heap is.
    #[cfg(test)]
    pub(super) fn entries(&self) -> usize {
        self.heap.len()
    }

    fn bound(&self, key: BrickKey) -> Option<Bound> {
        let unused = self.frame - self.used.get(&key)?;
        Some(Bound(self.params.priority(&self.pyramid, &self.slices, key, unused) - self.growth, key))
    }

    fn push(&mut self, key: BrickKey) {
        self.heap.extend(self.bound(key));
    }

    /// By how much the distance of any brick can have grown, in bricks; infinite where the slices or their weights are others.
    fn step(&self, slices: &SliceSet) -> f64 {
        if slices.planes.len() != self.slices.planes.len() || slices.moving != self.slices.moving {
            return f64::INFINITY;
        }
        let size = DVec3::from(self.pyramid.dims(0).map(f64::from));
        // Bricks at the end may reach beyond the volume, by the edge of the coarsest at most.
        let reach = size + f64::from(BRICK_EDGE) * self.pyramid.top().voxel_size();
        let mut most: f64 = 0.0;
        for (new, old) in slices.planes.iter().zip(&self.slices.planes) {
            for i in 0..8 {
                let corner = DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64) * (reach + 1.0) - 1.0;
                most = most.max((new.distance(corner) - old.distance(corner)).abs());
            }
        }
        most / f64::from(BRICK_EDGE) * self.params.s.max(self.params.m)
    }
}

impl EvictionPolicy for Mdfo {
    fn name(&self) -> &'static str {
        self.name
    }

    fn frame(&mut self, slices: &SliceSet) {
        let step = self.step(slices);
        self.frame += 1;
        self.slices.clone_from(slices);
        self.reconsider();
        let growth = self.growth + self.params.k_d * step + self.params.k_t;
        if growth < MOST_GROWTH && self.heap.len() <= 2 * self.used.len() + SPARE {
            self.growth = growth;
        } else {
            self.growth = 0.0;
            self.heap = self.used.keys().filter_map(|&key| self.bound(key)).collect();
        }
    }

    fn reconsider(&mut self) {
        for key in std::mem::take(&mut self.aside) {
            self.push(key);
        }
    }

    fn hit(&mut self, key: BrickKey) {
        if let Some(used) = self.used.get_mut(&key) {
            *used = self.frame;
        }
    }

    fn insert(&mut self, key: BrickKey) {
        self.used.insert(key, self.frame);
        self.push(key);
    }

    fn remove(&mut self, key: BrickKey) {
        self.used.remove(&key);
    }

    fn victim(&mut self, may: &dyn Fn(BrickKey) -> bool) -> Option<BrickKey> {
        while let Some(top) = self.heap.pop() {
            // Bricks that have left are met here.
            let Some(now) = self.bound(top.1) else { continue };
            if self.heap.peek().is_some_and(|next| now < *next) {
                self.heap.push(now);
            } else if may(top.1) {
                self.heap.push(now);
                return Some(top.1);
            } else {
                self.aside.push(top.1);
            }
        }
        None
    }
}
