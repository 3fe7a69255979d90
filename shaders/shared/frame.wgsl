// What all rays of an image share. Lengths are in edges of the root cube, which is [0, 1)^3.

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
}

@group(0) @binding(0) var<uniform> frame: Frame;

// A ray from the plane through the cube's centre (t = 0); the eye is at t_eye.
struct CubeRay {
    origin: vec3<f32>,
    direction: vec3<f32>,
    t_eye: f32,
}

fn in_image(pixel: vec2<u32>) -> bool {
    return pixel.x < frame.width && pixel.y < frame.height;
}

// The ray through the centre of a pixel, row 0 at the top.
fn pixel_ray(pixel: vec2<u32>) -> CubeRay {
    let x = (f32(pixel.x) + 0.5) * frame.pixel_size.x - 1.0;
    let y = 1.0 - (f32(pixel.y) + 0.5) * frame.pixel_size.y;
    let toward = frame.forward + frame.right * x + frame.up * y;
    let length_toward = length(toward);
    let origin = frame.origin + frame.right_origin * x + frame.up_origin * y;
    return CubeRay(origin, toward / length_toward, -frame.eye_distance * length_toward);
}
