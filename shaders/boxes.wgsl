// Stage: boxes. The paper's way to where rays begin and end: the boxes of all that is active, rasterised (method 2.1). Each box is drawn
// by its faces that look away from the eye, so that it covers a pixel once, also if the eye is in it; where the pixel's own ray enters
// and leaves the box is computed, and widens the parts of the ray that it lies in.
// #import shared/frame.wgsl
// #import shared/ray.wgsl
// #import shared/cuts.wgsl
// #import shared/placing.wgsl

// Boxes are drawn larger by this part of a pixel: rasterisers round corners to 1/256 of one.
const MARGIN: f32 = 0.0625;

// Lowest corner and edge on the grid of the deepest level.
@group(0) @binding(17) var<storage, read> boxes: array<vec4<u32>>;
// The words of `parts`, two a part.
@group(0) @binding(16) var<storage, read_write> part_words: array<atomic<u32>>;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) number: u32,
}

// Corners of the cube's 12 triangles, x + 2 y + 4 z, counterclockwise from outside.
const CORNERS = array<u32, 36>(
    0u, 4u, 6u, 0u, 6u, 2u, 1u, 3u, 7u, 1u, 7u, 5u,
    0u, 1u, 5u, 0u, 5u, 4u, 2u, 6u, 7u, 2u, 7u, 3u,
    0u, 2u, 3u, 0u, 3u, 1u, 4u, 5u, 7u, 4u, 7u, 6u,
);

@vertex
fn place(@builtin(vertex_index) vertex: u32, @builtin(instance_index) number: u32) -> Corner {
    var corners = CORNERS;
    let corner = corners[vertex];
    let side = vec3<f32>(vec3<u32>(corner, corner >> 1u, corner >> 2u) & vec3<u32>(1u));
    let cell = boxes[number];
    let at = (vec3<f32>(cell.xyz) + side * f32(cell.w)) * frame.cell_edge;
    let outward = (2.0 * side - 1.0) * (MARGIN * placing.pixel * abs(clip(at).w));
    return Corner(clip(at + outward), number);
}

@fragment
fn widen(corner: Corner) -> @location(0) vec4<f32> {
    let pixel = vec2<u32>(corner.position.xy);
    let ray = enter(pixel_ray(pixel));
    let cube = boxes[corner.number];
    let cell = Cell(cube.xyz, cube.w);
    let leaving = exits(ray, cell);
    let begin = max(entry(ray, cell), 0.0);
    let end = min(min(leaving.x, min(leaving.y, leaving.z)), ray.t_out);
    if (begin < end && !is_beside(ray, cell)) {
        for (var part = 0u; part < parts; part += 1u) {
            let words = part_from(max(begin, cut(ray, part)), min(end, cut(ray, part + 1u)));
            if (words.x != 0u) {
                let at = 2u * (part + parts * (pixel.x + frame.width * pixel.y));
                atomicMax(&part_words[at], words.x);
                atomicMax(&part_words[at + 1u], words.y);
            }
        }
    }
    return vec4<f32>(0.0);
}

// Whether a ray that does not move along an axis passes a cell by.
fn is_beside(ray: Ray, cell: Cell) -> bool {
    let low = vec3<f32>(cell.low) * frame.cell_edge;
    let high = vec3<f32>(cell.low + cell.size) * frame.cell_edge;
    return any((ray.direction == vec3<f32>(0.0)) & ((ray.origin < low) | (ray.origin >= high)));
}
