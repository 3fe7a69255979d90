//! Which bricks a picture of a slice takes at the resolution of the screen, and which of them first.

use super::{BRICK_EDGE, BrickKey, Pyramid, SlicePlane};
use glam::{DMat4, DVec2, DVec3, DVec4};
use std::collections::HashMap;

/// A slice as a picture shows it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenSlice {
    /// The slice, index space.
    pub plane: SlicePlane,
    /// From index space to clip space: x / w and y / w in [-1, 1] over the picture; w is the distance along the view direction, or 1.
    pub clip_from_index: DMat4,
    /// Width and height of the picture in pixels.
    pub pixels: DVec2,
    /// Whether the finest level is wanted whatever the picture can show.
    pub is_whole: bool,
}

/// The bricks that pictures ask for.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Asked {
    /// Most wanted first: from coarse to fine, and of a level what is nearest to the eye first. The bricks that lie above others are among
    /// them, since the picture shows them until the others are there.
    pub bricks: Vec<BrickKey>,
    /// Whether more bricks would be needed than there is room for: the picture stays coarser.
    pub is_cut: bool,
}

impl SeenSlice {
    /// Two directions that span the plane, index space, of length 1.
    fn directions(&self) -> [DVec3; 2] {
        let u = self.plane.normal.any_orthonormal_vector();
        [u, self.plane.normal.cross(u)]
    }

    /// Voxels of level 0 a pixel where the slice is nearest to a point: the root of the area. 0 at and behind the eye.
    fn voxels_a_pixel(&self, point: DVec3) -> f64 {
        let on = point - self.plane.normal * self.plane.distance(point);
        let at = self.clip_from_index * on.extend(1.0);
        if at.w <= 0.0 {
            return 0.0;
        }
        let [a, b] = self.directions().map(|along| {
            let change = self.clip_from_index * along.extend(0.0);
            (change.truncate().truncate() * at.w - at.truncate().truncate() * change.w) / (at.w * at.w) * self.pixels / 2.0
        });
        let area = a.perp_dot(b).abs();
        if area > 0.0 { area.sqrt().recip() } else { f64::INFINITY }
    }

    /// Whether a brick may be in the picture, with a voxel around it.
    pub(crate) fn shows(&self, key: BrickKey) -> bool {
        let size = key.voxel_size();
        let low = key.first() - size;
        let edge = (f64::from(BRICK_EDGE) + 1.0) * size;
        let corner = |i: usize| low + DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64) * edge;
        let corners: [DVec4; 8] = std::array::from_fn(|i| self.clip_from_index * corner(i).extend(1.0));
        let beyond = |outside: fn(DVec4) -> bool| corners.iter().all(|&at| outside(at));
        !(beyond(|at| at.x < -at.w) || beyond(|at| at.x > at.w) || beyond(|at| at.y < -at.w) || beyond(|at| at.y > at.w))
    }

    /// Whether the slice needs a brick, as [`Pyramid::cut`] has it.
    fn meets(&self, key: BrickKey) -> bool {
        let half = (f64::from(BRICK_EDGE) + 1.0) / 2.0 * key.voxel_size() * self.plane.normal.abs().element_sum();
        self.plane.distance(key.center()).abs() < half
    }

    /// The level whose voxels are nearest to pixels in size where a brick is, by its nearest corner.
    fn level_at(&self, key: BrickKey) -> u8 {
        if self.is_whole {
            return 0;
        }
        let reach = f64::from(BRICK_EDGE) * key.voxel_size() / 2.0;
        let corner = |i: usize| key.center() + (DVec3::new((i & 1) as f64, (i >> 1 & 1) as f64, (i >> 2) as f64) * 2.0 - 1.0) * reach;
        let least = (0..8).map(|i| self.voxels_a_pixel(corner(i))).fold(f64::INFINITY, f64::min);
        level_for(least)
    }

    /// Where a brick stands in the queue of its level: less is sooner.
    fn distance(&self, key: BrickKey) -> f64 {
        let at = self.clip_from_index * key.center().extend(1.0);
        let across = at.truncate().truncate() / at.w.abs().max(f64::MIN_POSITIVE);
        at.w.max(0.0) * (1.0 + across.length().min(4.0))
    }
}

/// The level whose voxels are nearest to a pixel in size, with so many voxels of level 0 a pixel.
pub fn level_for(voxels_a_pixel: f64) -> u8 {
    (voxels_a_pixel.log2() + 0.5).floor().clamp(0.0, 31.0) as u8
}

/// The finest level of which all bricks, and those of all coarser levels, are at most `most`; at least the coarsest is taken.
pub fn kept_level(pyramid: &Pyramid, most: u64) -> u8 {
    let (mut level, mut sum) = (pyramid.levels() - 1, 1);
    while level > 0 && sum + pyramid.brick_count(level - 1) <= most {
        level -= 1;
        sum += pyramid.brick_count(level);
    }
    level
}

/// All bricks of a level and the coarser ones, coarsest first.
pub fn kept_bricks(pyramid: &Pyramid, level: u8) -> Vec<BrickKey> {
    let of_level = |level: u8| {
        let [nx, ny, nz] = pyramid.bricks(level);
        (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| BrickKey { level, at: [x, y, z] })))
    };
    (level..pyramid.levels()).rev().flat_map(of_level).collect()
}

/// The bricks finer than `kept` that slices ask for, at most `most`. Beneath a brick that is `enough` nothing is asked for.
pub fn asked(pyramid: &Pyramid, seen: &[SeenSlice], kept: u8, most: usize, enough: impl Fn(BrickKey) -> bool) -> Asked {
    let mut asked = Asked::default();
    // The bricks of one level that some slice shows, with the slices that do.
    let mut open: HashMap<BrickKey, Vec<usize>> = HashMap::from([(pyramid.top(), (0..seen.len()).collect())]);
    for level in (0..pyramid.levels()).rev() {
        let mut beneath: HashMap<BrickKey, Vec<usize>> = HashMap::new();
        let mut here: Vec<(f64, BrickKey)> = Vec::new();
        for (key, slices) in open {
            let showing: Vec<usize> = slices.into_iter().filter(|&i| seen[i].meets(key) && seen[i].shows(key)).collect();
            if showing.is_empty() {
                continue;
            }
            if level < kept {
                here.push((showing.iter().map(|&i| seen[i].distance(key)).fold(f64::INFINITY, f64::min), key));
            }
            if level == 0 || enough(key) {
                continue;
            }
            let refining: Vec<usize> = showing.into_iter().filter(|&i| seen[i].level_at(key) < level).collect();
            if refining.is_empty() {
                continue;
            }
            for i in 0..8u32 {
                let child = BrickKey { level: level - 1, at: std::array::from_fn(|axis| key.at[axis] * 2 + (i >> axis & 1)) };
                if pyramid.has(child) {
                    beneath.entry(child).or_default().extend(&refining);
                }
            }
        }
        here.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let room = most - asked.bricks.len();
        asked.is_cut |= here.len() > room;
        asked.bricks.extend(here.into_iter().take(room).map(|(_, key)| key));
        open = beneath;
    }
    asked
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of the plane across z at `z`, so many voxels a pixel, with its middle over (x, y).
    fn flat(z: f64, [x, y]: [f64; 2], voxels_a_pixel: f64, pixels: [f64; 2]) -> SeenSlice {
        let pixels = DVec2::from(pixels);
        let half = pixels / 2.0 * voxels_a_pixel;
        let scale = DMat4::from_scale(DVec3::new(1.0 / half.x, 1.0 / half.y, 0.0));
        let clip_from_index = scale * DMat4::from_translation(DVec3::new(-x, -y, 0.0));
        SeenSlice { plane: SlicePlane::across(2, z), clip_from_index, pixels, is_whole: false }
    }

    #[test]
    fn a_picture_of_all_at_a_pixel_a_voxel_takes_the_whole_slice() {
        let pyramid = Pyramid::new([500, 300, 200]);
        let seen = flat(70.0, [250.0, 150.0], 1.0, [520.0, 320.0]);
        let found = asked(&pyramid, &[seen], pyramid.levels(), usize::MAX, |_| false);
        for level in 0..pyramid.levels() {
            let mut of_level: Vec<_> = found.bricks.iter().copied().filter(|key| key.level == level).collect();
            of_level.sort_unstable();
            assert_eq!(of_level, pyramid.cut(&seen.plane, level), "level {level}");
        }
        assert!(found.bricks.windows(2).all(|pair| pair[0].level >= pair[1].level), "coarse ones come first");
    }

    #[test]
    fn smaller_pictures_stop_at_the_level_of_their_pixels() {
        let pyramid = Pyramid::new([4096, 4096, 64]);
        let finest = |voxels: f64| {
            let seen = flat(3.0, [2048.0, 2048.0], voxels, [400.0, 400.0]);
            asked(&pyramid, &[seen], pyramid.levels(), usize::MAX, |_| false).bricks.last().expect("some").level
        };
        assert_eq!([0.2, 1.0, 1.4, 1.42, 2.8, 2.9, 8.0].map(finest), [0, 0, 0, 1, 1, 2, 3]);
        let whole = SeenSlice { is_whole: true, ..flat(3.0, [2048.0, 2048.0], 8.0, [400.0, 400.0]) };
        assert_eq!(asked(&pyramid, &[whole], 7, usize::MAX, |_| false).bricks.last().map(|key| key.level), Some(0));
    }

    #[test]
    fn what_is_outside_the_picture_or_kept_or_enough_or_beyond_the_room_is_not_asked_for() {
        let pyramid = Pyramid::new([1024, 1024, 1024]);
        let seen = flat(500.0, [96.0, 96.0], 1.0, [20.0, 20.0]);
        let found = asked(&pyramid, &[seen], 1, usize::MAX, |_| false);
        assert_eq!(found, Asked { bricks: vec![BrickKey { level: 0, at: [1, 1, 7] }], is_cut: false });
        assert_eq!(asked(&pyramid, &[seen], 5, usize::MAX, |key| key.level == 2).bricks.last().map(|key| key.level), Some(2));
        let wide = flat(500.0, [512.0, 512.0], 1.0, [900.0, 900.0]);
        let few = asked(&pyramid, &[wide], 3, 30, |_| false);
        assert!(few.is_cut && few.bricks.len() == 30);
        assert_eq!(few.bricks.iter().filter(|key| key.level == 2).count(), 16, "the coarser ones are all there");
        let nearest = few.bricks.iter().find(|key| key.level == 1).expect("room for some");
        assert!(nearest.at[..2].iter().all(|at| [3, 4].contains(at)), "the middle comes first: {nearest:?}");
    }

    #[test]
    fn near_the_eye_finer_ones_are_asked_for() {
        let pyramid = Pyramid::new([4096, 256, 256]);
        // The eye looks along x: w is the distance.
        let clip_from_index = DMat4::from_cols(
            DVec4::new(0.0, 0.0, 0.0, 1.0),
            DVec4::new(1.0, 0.0, 0.0, 0.0),
            DVec4::new(0.0, 1.0, 0.0, 0.0),
            DVec4::new(-128.0, -128.0, 0.0, 300.0),
        );
        let plane = SlicePlane::new(DVec3::new(0.0, 128.0, 100.0), DVec3::new(0.0, 0.3, 1.0)).expect("a plane");
        let seen = SeenSlice { plane, clip_from_index, pixels: DVec2::splat(4000.0), is_whole: false };
        let found = asked(&pyramid, &[seen], pyramid.levels(), usize::MAX, |_| false);
        let far = |level: u8| found.bricks.iter().filter(|key| key.level == level).map(|key| key.at[0]).max();
        assert!(far(0) < far(1).map(|x| 2 * x), "{:?} {:?}", far(0), far(1));
        assert!(found.bricks.iter().any(|key| key.level == 0 && key.at[0] == 0));
    }

    #[test]
    fn kept_levels_fit() {
        let pyramid = Pyramid::new([1024; 3]);
        assert_eq!([0, 1, 8, 9, 72, 73].map(|most| kept_level(&pyramid, most)), [4, 4, 4, 3, 3, 2]);
        let kept = kept_bricks(&pyramid, 3);
        assert_eq!((kept.len(), kept[0], kept[8]), (9, pyramid.top(), BrickKey { level: 3, at: [1, 1, 1] }));
    }
}
