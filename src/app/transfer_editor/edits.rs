//! What the editor does to knots: `[x, values..]`, ascending in x, at least one.

/// Adds a knot at its place, behind those at the same x; gives its number.
pub fn insert<const N: usize>(knots: &mut Vec<[f64; N]>, knot: [f64; N]) -> usize {
    let at = knots.partition_point(|k| k[0] <= knot[0]);
    knots.insert(at, knot);
    at
}

/// Takes a knot away, unless it is the only one; whether it did.
pub fn remove<const N: usize>(knots: &mut Vec<[f64; N]>, i: usize) -> bool {
    let is_there = knots.len() > 1 && i < knots.len();
    if is_there {
        knots.remove(i);
    }
    is_there
}

/// Moves a knot to `x`, no further than its neighbours and the ends of [0, 1].
pub fn shift<const N: usize>(knots: &mut [[f64; N]], i: usize, x: f64) {
    let least = if i > 0 { knots[i - 1][0] } else { 0.0 };
    let most = knots.get(i + 1).map_or(1.0, |k| k[0]);
    // Knots of files may lie beyond [0, 1]; they come in when they are moved, unless a neighbour is in the way.
    knots[i][0] = x.clamp(0.0, 1.0).max(least).min(most);
}

/// The knots the other way around over [0, 1].
pub fn inverted<const N: usize>(knots: &[[f64; N]]) -> Vec<[f64; N]> {
    let mirrored = |knot: &[f64; N]| {
        let mut knot = *knot;
        knot[0] = 1.0 - knot[0];
        knot
    };
    knots.iter().rev().map(mirrored).collect()
}

/// The value at `x`: linear between knots, constant beyond them.
pub fn at<const N: usize>(knots: &[[f64; N]], x: f64) -> [f64; N] {
    let after = knots.partition_point(|k| k[0] <= x);
    let (a, b) = (knots[after.saturating_sub(1)], knots[after.min(knots.len() - 1)]);
    let f = if b[0] > a[0] { (x - a[0]) / (b[0] - a[0]) } else { 0.0 };
    let mut value: [f64; N] = std::array::from_fn(|c| a[c] + f * (b[c] - a[c]));
    value[0] = x;
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knots_stay_ascending() {
        let mut knots = vec![[0.0, 0.1], [0.5, 0.2], [0.5, 0.3], [1.0, 0.4]];
        assert_eq!(insert(&mut knots, [0.5, 0.9]), 3);
        assert_eq!(insert(&mut knots, [0.2, 0.8]), 1);
        for (i, x) in [(1, 7.0), (2, -7.0), (0, 0.4), (5, 0.1)] {
            shift(&mut knots, i, x);
            assert!(knots.is_sorted_by(|a, b| a[0] <= b[0]), "{knots:?}");
        }
        assert_eq!((knots[1][0], knots[5][0]), (0.5, 0.5), "as far as the neighbour");
        let mut alone = vec![[0.3, 0.5]];
        shift(&mut alone, 0, 2.0);
        assert_eq!(alone, [[1.0, 0.5]]);
        assert!(!remove(&mut alone, 0) && remove(&mut knots, 5) && !remove(&mut knots, 5));
    }

    #[test]
    fn inverted_twice_is_as_before() {
        let knots = vec![[0.0, 0.1], [0.25, 0.2], [0.25, 0.3], [1.0, 0.4]];
        assert_eq!(inverted(&knots), [[0.0, 0.4], [0.75, 0.3], [0.75, 0.2], [1.0, 0.1]]);
        assert_eq!(inverted(&inverted(&knots)), knots);
    }

    #[test]
    fn values_between_knots_are_linear() {
        let knots = [[0.25, 0.0], [0.75, 1.0]];
        assert_eq!([0.0, 0.5, 0.9].map(|x| at(&knots, x)[1]), [0.0, 0.5, 1.0]);
    }
}
