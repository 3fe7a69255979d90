// Where points of the cube lie in the image, for what is rasterised.

// Points relative to the frame's origin.
struct Placing {
    // To (x w, y w, t).
    to_image: mat3x3<f32>,
    // w is the first and t times the second: 1 for parallel rays, the distance from the eye's plane for others.
    w: vec2<f32>,
    // A pixel's size where w is 1.
    pixel: f32,
}

@group(0) @binding(18) var<uniform> placing: Placing;

// Clip coordinates. All depths are alike: nothing lies before or behind anything, and only the eye's plane cuts.
fn clip(at: vec3<f32>) -> vec4<f32> {
    let placed = placing.to_image * (at - frame.origin);
    let w = placing.w.x + placing.w.y * placed.z;
    return vec4<f32>(placed.xy, 0.5 * w, w);
}
