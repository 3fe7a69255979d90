// One segment with linear extinction and luminance (maths 2.5).

// Samples along each axis of the Psi table, which has the front's depth fastest.
const PSI_SIZE: u32 = 129u;

@group(0) @binding(4) var<storage, read> psi_table: array<f32>;

// 1 - exp(-g), g >= 0, without cancellation.
fn em1(g: f32) -> f32 {
    if (g >= 0.5) { return 1.0 - exp(-g); }
    let tail = 1.0 - g * (1.0 / 6.0) * (1.0 - g * (1.0 / 7.0) * (1.0 - g * (1.0 / 8.0)));
    return g * (1.0 - g * (1.0 / 2.0) * (1.0 - g * (1.0 / 3.0) * (1.0 - g * (1.0 / 4.0) * (1.0 - g * (1.0 / 5.0) * tail))));
}

// (weight of the front's luminance, of the back's, opacity) for extinction times length from a at the front to b at the back.
fn segment(a: f32, b: f32) -> vec3<f32> {
    let mean = 0.5 * (a + b);
    let alpha = em1(mean);
    var front: f32;
    if (mean <= 0.5) {
        // 4-point Gauss-Legendre on [0, 1].
        front = 0.173927423 * em1(depth_to(0.069431844, a, b)) + 0.326072577 * em1(depth_to(0.330009478, a, b))
            + 0.326072577 * em1(depth_to(0.669990522, a, b)) + 0.173927423 * em1(depth_to(0.930568156, a, b));
    } else {
        front = 1.0 - psi_lookup(1.0 / sqrt(1.0 + 0.5 * a), 1.0 / sqrt(1.0 + 0.5 * b));
    }
    return vec3<f32>(front, max(alpha - front, 0.0), alpha);
}

// Optical depth from the front of a segment to its part u.
fn depth_to(u: f32, a: f32, b: f32) -> f32 {
    return u * (a + (b - a) * 0.5 * u);
}

// Bilinear look-up at axis positions in [0, 1].
fn psi_lookup(s_a: f32, s_b: f32) -> f32 {
    let x = s_a * f32(PSI_SIZE - 1u);
    let y = s_b * f32(PSI_SIZE - 1u);
    let i = min(u32(x), PSI_SIZE - 2u);
    let j = min(u32(y), PSI_SIZE - 2u);
    let at = i + PSI_SIZE * j;
    let fx = x - f32(i);
    let low = psi_table[at] + fx * (psi_table[at + 1u] - psi_table[at]);
    let high = psi_table[at + PSI_SIZE] + fx * (psi_table[at + PSI_SIZE + 1u] - psi_table[at + PSI_SIZE]);
    return low + (y - f32(j)) * (high - low);
}
