//! Separable filters on rows of numbers. Meant to be inlined into a function compiled for the machine's vector instructions.

/// Numbers that are summed side by side, in registers.
pub(super) const TILE: usize = 32;

/// What a row of `count` numbers takes, so that it is made of whole tiles.
pub(super) fn padded(count: usize) -> usize {
    count.next_multiple_of(TILE)
}

/// `out[x]` = sum of `weights[i] * row[x + i]`. `out` is made of whole tiles, `row` longer by the weights.
#[inline(always)]
pub(super) fn along(row: &[f32], weights: &[f32], out: &mut [f32]) {
    for (tile, out) in out.as_chunks_mut::<TILE>().0.iter_mut().enumerate() {
        *out = down(row, tile * TILE, 1, weights);
    }
}

/// The sum, tile by tile, of `weights[i]` times the tile that begins at `first + i * stride`.
#[inline(always)]
pub(super) fn down(plane: &[f32], first: usize, stride: usize, weights: &[f32]) -> [f32; TILE] {
    let mut sums = [0.0; TILE];
    for (i, &weight) in weights.iter().enumerate() {
        let values = plane[first + i * stride..].first_chunk::<TILE>().expect("rows are padded to whole tiles");
        for x in 0..TILE {
            sums[x] += weight * values[x];
        }
    }
    sums
}
