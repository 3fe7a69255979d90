// Stage: viewport. Puts marched images into the window: texel for pixel at the same size, linearly in between at another. One image, two
// beside each other, mixed, or their difference. The window's target is display-encoded already, so values are written as they are, premultiplied,
// over what was painted before.

@group(0) @binding(0) var image: texture_2d<f32>;
@group(0) @binding(1) var other: texture_2d<f32>;
@group(0) @binding(2) var<uniform> comparison: Comparison;

const ONE: u32 = 0u;
const WIPE: u32 = 1u;
const BLEND: u32 = 3u;

// ONE: the image; WIPE: left of the divider the image, right of it the other; BLEND: a mixture; else their difference, by channel. Neither this nor whether
// images have another size than the viewport is a uniform: Mesa's software adapter goes through all branches.
override shown: u32 = 0u;
override stretched: bool = true;

struct Comparison {
    // In images from the left.
    divider: f32,
    // What differences are multiplied by; of a mixture the first image's share.
    gain: f32,
}

struct Corner {
    @builtin(position) position: vec4<f32>,
    // From the image's upper left, in images.
    @location(0) at: vec2<f32>,
}

// One triangle that covers the viewport.
@vertex
fn cover(@builtin(vertex_index) index: u32) -> Corner {
    let at = vec2<f32>(f32(index & 1u), f32(index >> 1u)) * 2.0;
    return Corner(vec4<f32>(at.x * 2.0 - 1.0, 1.0 - at.y * 2.0, 0.0, 1.0), at);
}

fn texel(source: texture_2d<f32>, at: vec2<i32>, size: vec2<i32>) -> vec4<f32> {
    return textureLoad(source, clamp(at, vec2<i32>(0), size - 1), 0);
}

fn sampled(source: texture_2d<f32>, place: vec2<f32>) -> vec4<f32> {
    let size = vec2<i32>(textureDimensions(source));
    let at = place * vec2<f32>(size) - 0.5;
    if (!stretched) { return texel(source, vec2<i32>(round(at)), size); }
    // At equal sizes `at` is a texel but for rounding, which must not blend in the next one.
    let nearest = round(at);
    let exact = select(at, nearest, abs(at - nearest) < vec2<f32>(0.01));
    let first = floor(exact);
    let weight = exact - first;
    let low = vec2<i32>(first);
    let upper = mix(texel(source, low, size), texel(source, low + vec2<i32>(1, 0), size), weight.x);
    let lower = mix(texel(source, low + vec2<i32>(0, 1), size), texel(source, low + vec2<i32>(1, 1), size), weight.x);
    return mix(upper, lower, weight.y);
}

@fragment
fn show(corner: Corner) -> @location(0) vec4<f32> {
    let color = sampled(image, corner.at);
    if (shown == ONE) { return color; }
    if (shown == WIPE) { return select(color, sampled(other, corner.at), corner.at.x >= comparison.divider); }
    if (shown == BLEND) { return mix(sampled(other, corner.at), color, comparison.gain); }
    // Differences are on black, whatever lies behind the picture.
    return vec4<f32>(abs(color - sampled(other, corner.at)).rgb * comparison.gain, 1.0);
}
