//! Pictures of which other programs measured the difference.

/// Width and height of [`pairs`].
pub const SIZE: [usize; 2] = [64, 48];

/// RGB bytes from a rule for column and row.
pub fn picture(size: [usize; 2], rule: impl Fn(usize, usize) -> [u8; 3]) -> Vec<u8> {
    (0..size[0] * size[1]).flat_map(|i| rule(i % size[0], i / size[0])).collect()
}

/// Five pairs: gradients against other gradients, against checks, black against white, checks against black, a gradient against itself
/// with a pattern of up to 16 levels on it.
pub fn pairs() -> [[Vec<u8>; 2]; 5] {
    let gradient = || picture(SIZE, |x, y| [(4 * x) as u8, (5 * y) as u8, (x + y) as u8]);
    let other = picture(SIZE, |x, y| [(4 * x) as u8, (5 * y) as u8 / 2, (x + 2 * y) as u8]);
    let checks = || picture(SIZE, |x, y| if (x / 4 + y / 4) % 2 == 0 { [250, 240, 230] } else { [10, 20, 30] });
    let plain = |v: u8| picture(SIZE, |_, _| [v; 3]);
    let soft = |noise: usize| {
        let level = move |x, y| (7 * x + 13 * y) % 17 * noise;
        picture(SIZE, move |x, y| [200 - 2 * y, 60 + 2 * x, 90 + x + y].map(|v| (v + level(x, y)) as u8))
    };
    [[gradient(), other], [gradient(), checks()], [plain(0), plain(255)], [checks(), plain(0)], [soft(0), soft(1)]]
}
