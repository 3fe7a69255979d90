// From a normalised scalar to extinction and colour.

// Entries of the table from a value to its interval of knots.
const INDEX_SIZE: u32 = 256u;

struct Knot {
    color: vec3<f32>,
    extinction: f32,
    value: f32,
    inverse_width: f32,
}

struct Medium {
    extinction: f32,
    color: vec3<f32>,
}

@group(0) @binding(2) var<storage, read> knots: array<Knot>;
@group(0) @binding(3) var<storage, read> knot_index: array<u32, INDEX_SIZE>;

// The interval that holds a value: the last knot at or below it that has a knot after it.
fn interval_of(value: f32) -> u32 {
    let count = arrayLength(&knots);
    var i = knot_index[min(u32(value * f32(INDEX_SIZE)), INDEX_SIZE - 1u)];
    while (i + 2u < count && knots[i + 1u].value <= value) { i += 1u; }
    return min(i, count - 2u);
}

// The interval that holds the values just below a value.
fn interval_below(value: f32) -> u32 {
    var i = interval_of(value);
    while (i > 0u && knots[i].value >= value) { i -= 1u; }
    return i;
}

// Extinction and colour by the linear functions of an interval, so that at a step the interval picks the side.
fn classify(interval: u32, value: f32) -> Medium {
    let k = knots[interval];
    let next = knots[interval + 1u];
    let f = clamp((value - k.value) * k.inverse_width, 0.0, 1.0);
    return Medium(k.extinction + f * (next.extinction - k.extinction), k.color + f * (next.color - k.color));
}
