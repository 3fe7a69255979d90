// Stage: edges. Draws the lines in which a plane cuts the mesh's faces: how much of each pixel they cover where its ray meets the plane.
// #import shared/frame.wgsl
// #import shared/placing.wgsl

struct Line {
    a: vec4<f32>,
    b: vec4<f32>,
}

// The plane's normal, then the lines, in edges of the cube.
@group(0) @binding(25) var<storage, read> lines: array<Line>;

// Half the width of what is drawn around a line, in pixels: beyond it nothing is covered.
const REACH: f32 = 1.5;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) at: vec3<f32>,
    @location(1) @interpolate(flat) number: u32,
}

// Where the two triangles around a line have their corners: along it and across.
const CORNERS = array<vec2<f32>, 6>(
    vec2<f32>(-1.0, -1.0), vec2<f32>(1.0, -1.0), vec2<f32>(1.0, 1.0), vec2<f32>(-1.0, -1.0), vec2<f32>(1.0, 1.0), vec2<f32>(-1.0, 1.0),
);

@vertex
fn place(@builtin(vertex_index) vertex: u32, @builtin(instance_index) number: u32) -> Corner {
    var corners = CORNERS;
    let corner = corners[vertex];
    let line = lines[number + 1u];
    let normal = lines[0].a.xyz;
    var along = line.b.xyz - line.a.xyz;
    if (dot(along, along) <= 0.0) { along = cross(normal, select(vec3<f32>(1.0, 0.0, 0.0), vec3<f32>(0.0, 1.0, 0.0), abs(normal.x) > 0.5)); }
    along = normalize(along);
    let end = select(line.a.xyz, line.b.xyz, corner.x > 0.0);
    let at = end + (along * corner.x + cross(normal, along) * corner.y) * (REACH * pixel_width_at(end));
    return Corner(clip(at), at, number);
}

@fragment
fn cover(corner: Corner) -> @location(0) vec4<f32> {
    let line = lines[corner.number + 1u];
    let along = line.b.xyz - line.a.xyz;
    let squared = dot(along, along);
    var part = 0.0;
    if (squared > 0.0) { part = clamp(dot(corner.at - line.a.xyz, along) / squared, 0.0, 1.0); }
    let distance = length(corner.at - (line.a.xyz + along * part));
    return vec4<f32>(clamp(1.0 - (distance / pixel_width_at(corner.at) - 0.5), 0.0, 1.0));
}

// The width of a pixel at a place.
fn pixel_width_at(at: vec3<f32>) -> f32 {
    return length(frame.right_origin + frame.right * dot(at - frame.origin, frame.forward)) * frame.pixel_size.x;
}
