// Stage: lines. Draws lines in the space of the data over the marched picture.

@group(0) @binding(0) var<uniform> clip_from_data: mat4x4<f32>;

struct Point {
    @builtin(position) position: vec4<f32>,
    @location(0) color: vec4<f32>,
}

@vertex
fn place(@location(0) position: vec3<f32>, @location(1) color: vec4<f32>) -> Point {
    return Point(clip_from_data * vec4<f32>(position, 1.0), color);
}

@fragment
fn paint(point: Point) -> @location(0) vec4<f32> {
    return vec4<f32>(point.color.rgb * point.color.a, point.color.a);
}
