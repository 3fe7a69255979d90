// What all rays of an image share. Lengths are in edges of the root cube, which is [0, 1)^3.

const MOST_PLANES: u32 = 6u;

struct Frame {
    origin: vec3<f32>,
    eye_distance: f32,
    right_origin: vec3<f32>,
    width: u32,
    up_origin: vec3<f32>,
    height: u32,
    forward: vec3<f32>,
    min_transmittance: f32,
    right: vec3<f32>,
    step: f32,
    up: vec3<f32>,
    depth: u32,
    pixel_size: vec2<f32>,
    cell_edge: f32,
    // The axis that the halving plane is perpendicular to; 3 if rays are cut into equal parts.
    split_axis: u32,
    split_position: f32,
    clip_count: u32,
    cut_count: u32,
    // Normal of length 1 and offset: of planes that clip, on whose far side all is drawn, and of those that are drawn.
    clips: array<vec4<f32>, MOST_PLANES>,
    cuts: array<vec4<f32>, MOST_PLANES>,
    // Opacity, and whether edges are drawn.
    cut_looks: array<vec4<f32>, MOST_PLANES>,
}

// Parts that rays are cut into; 0 if they are not.
override parts: u32 = 0u;

@group(0) @binding(0) var<uniform> frame: Frame;

// A ray from the plane through the cube's centre (t = 0); the eye is at t_eye. The direction is not
// normalised: its length is the number of cube edges per unit of t.
struct CubeRay {
    origin: vec3<f32>,
    direction: vec3<f32>,
    length: f32,
    t_eye: f32,
}

fn in_image(pixel: vec2<u32>) -> bool {
    return pixel.x < frame.width && pixel.y < frame.height;
}

// The ray through the centre of a pixel, row 0 at the top.
fn pixel_ray(pixel: vec2<u32>) -> CubeRay {
    let at = vec3<f32>(vec2<f32>(pixel) + 0.5, 0.0);
    let x = mul_add(at, vec3<f32>(frame.pixel_size.x), vec3<f32>(-1.0)).x;
    let y = mul_add(at, vec3<f32>(-frame.pixel_size.y), vec3<f32>(1.0)).y;
    let direction = mul_add(frame.up, vec3<f32>(y), mul_add(frame.right, vec3<f32>(x), frame.forward));
    let origin = mul_add(frame.up_origin, vec3<f32>(y), mul_add(frame.right_origin, vec3<f32>(x), frame.origin));
    return CubeRay(origin, direction, length(direction), -frame.eye_distance);
}

// a b + c with the same bits on every processor. A compiler may fuse a product with a sum and so round once where another rounds twice;
// products of 12-bit halves are exact, which leaves nothing to fuse.
fn mul_add(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec3<f32> {
    let a_high = high_bits(a);
    let b_high = high_bits(b);
    let a_low = a - a_high;
    let b_low = b - b_high;
    return c + a_high * b_high + a_high * b_low + a_low * b_high + a_low * b_low;
}

fn high_bits(x: vec3<f32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(bitcast<vec3<u32>>(x) & vec3<u32>(0xfffff000u));
}
