//! Psi, the one function of two numbers that partial pre-integration needs, and its table.
//!
//! Moreland & Angel, *A Fast High Accuracy Volume Renderer for Unstructured Data*, VolVis 2004.

use std::sync::LazyLock;

/// Samples along each axis of [`psi_table`].
pub const PSI_SIZE: usize = 129;

/// `Psi(a, b) = integral over u in [0, 1] of exp(-(a u + (b - a) u^2 / 2))`: the mean transmittance of a segment whose optical depth per
/// unit of u goes linearly from `a` >= 0 at the front to `b` >= 0 at the back.
///
/// The segment is cut where its optical depth passes equal steps of at most 1, and each piece integrated by 10-point Gauss-Legendre
/// (maths 2.3); beyond a depth of 40 less than e^-40 is left out. Within 3.3e-16 of 40-digit arithmetic.
pub fn psi(a: f64, b: f64) -> f64 {
    let (delta, mean) = (b - a, 0.5 * (a + b));
    let top = mean.min(40.0);
    let pieces = top.ceil().max(1.0);
    let mut sum = 0.0;
    let mut front = 0.0;
    for k in 1..=pieces as u32 {
        let depth = top * f64::from(k) / pieces;
        let last = mean <= 40.0 && f64::from(k) == pieces;
        let back = if last { 1.0 } else { 2.0 * depth / (a + (a * a + 2.0 * delta * depth).max(0.0).sqrt()) };
        sum += gauss_legendre_10(front, back, |u| (-(a + 0.5 * delta * u) * u).exp());
        front = back;
    }
    sum
}

/// The integral of `f` over [lo, hi], exact for polynomials up to degree 19.
fn gauss_legendre_10(lo: f64, hi: f64, f: impl Fn(f64) -> f64) -> f64 {
    const NODES_AND_WEIGHTS: [(f64, f64); 5] = [
        (0.148_874_338_981_631_22, 0.295_524_224_714_752_87),
        (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
        (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
        (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
        (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
    ];
    let (middle, half) = (0.5 * (lo + hi), 0.5 * (hi - lo));
    NODES_AND_WEIGHTS.iter().map(|&(x, w)| w * (f(middle - half * x) + f(middle + half * x))).sum::<f64>() * half
}

/// Psi on a grid of [`PSI_SIZE`]^2, a fastest: sample i of either axis stands for `1 / sqrt(1 + x / 2) = i / 128`, so x is infinite in
/// row and column 0, which hold 0, and zero in the last. On this axis Psi(0, b) ~ sqrt(pi / (2 b)) is nearly linear: read bilinearly the
/// table is within 1.2e-4 of Psi everywhere (maths 2.5). Built once.
pub fn psi_table() -> &'static [f32] {
    static TABLE: LazyLock<Vec<f32>> = LazyLock::new(|| {
        let depth = |i: usize| {
            let s = i as f64 / (PSI_SIZE - 1) as f64;
            2.0 * (1.0 / (s * s) - 1.0)
        };
        let sample = |i: usize| {
            let (a, b) = (i % PSI_SIZE, i / PSI_SIZE);
            if a == 0 || b == 0 { 0.0 } else { psi(depth(a), depth(b)) as f32 }
        };
        (0..PSI_SIZE * PSI_SIZE).map(sample).collect()
    });
    &TABLE
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// (a, b, Psi) of maths 2.4, from 60-digit arithmetic.
    const VECTORS: [(f64, f64, f64); 12] = [
        (1e-6, 3e-6, 0.999999166667183),
        (2e-4, 0.0, 0.999933335999924),
        (0.01, 0.01, 0.995016625083195),
        (0.0, 0.1, 0.983580385842959),
        (0.4, 0.1, 0.863027739762413),
        (0.3, 2.0, 0.683989275603929),
        (2.0, 0.3, 0.518382811413964),
        (1.0, 1.0, 0.632120558828558),
        (5.0, 5.0001, 0.19865171032717),
        (0.0, 50.0, 0.177245385090279),
        (40.0, 0.001, 0.0256790708675541),
        (100.0, 900.0, 9.3411137943891e-3),
    ];

    #[test]
    fn psi_meets_the_test_vectors() {
        for (a, b, expected) in VECTORS {
            assert!((psi(a, b) - expected).abs() < 1e-14, "Psi({a}, {b}) = {}, expected {expected}", psi(a, b));
        }
        assert!((psi(0.0, 0.0) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn the_table_has_its_corners_and_is_psi_at_its_samples() {
        let table = psi_table();
        assert_eq!(table.len(), PSI_SIZE * PSI_SIZE);
        assert_eq!((table[0], table[PSI_SIZE - 1], table[PSI_SIZE * PSI_SIZE - 1]), (0.0, 0.0, 1.0));
        // s = 1/2 is an optical depth of 6; the two axes must not be swapped.
        assert!((f64::from(table[64 + 128 * PSI_SIZE]) - psi(6.0, 0.0)).abs() < 1e-7);
    }

    proptest! {
        /// Psi of a segment from Psi of its two parts.
        #[test]
        fn psi_is_additive(a in 0.0..60.0f64, b in 0.0..60.0f64, v in 0.01..0.99f64) {
            let c = a + (b - a) * v;
            let parts = v * psi(a * v, c * v) + (1.0 - v) * (-(a + c) * v / 2.0).exp() * psi(c * (1.0 - v), b * (1.0 - v));
            prop_assert!((psi(a, b) - parts).abs() < 1e-14);
        }

        /// zeta <= Psi <= 1, and Psi falls as either end gets denser.
        #[test]
        fn psi_is_bounded_and_falls(a in 0.0..1e4f64, b in 0.0..1e4f64, more in 1e-3..10.0f64) {
            let p = psi(a, b);
            prop_assert!(p <= 1.0 && p >= (-(a + b) / 2.0).exp() - 1e-15);
            prop_assert!(psi(a + more, b) < p && psi(a, b + more) <= p);
        }
    }
}
