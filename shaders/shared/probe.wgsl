// The octree's field and its gradient anywhere on a ray, apart from the march, whose place in the tree is lost. src/cpu/probe.rs says more.

// A layer for each plane that is drawn; elsewhere 0.
@group(0) @binding(24) var cut_edges: texture_2d_array<f32>;

// A surface is looked for in at most so many steps.
const MAX_STEPS: u32 = 6u;
// Values so near to a surface's are its.
const CLOSE: f32 = 1e-6;

// The field at a place; below 0 where the octree is empty.
struct Probe {
    value: f32,
    gradient: vec3<f32>,
}

fn probe(ray: Ray, t: f32) -> Probe {
    let cells = grid_cells();
    let found = descend(cell_at(ray, t, Cell(vec3<u32>(0u), cells), cells), ALL);
    if (found.word == EMPTY) { return Probe(-1.0, vec3<f32>(0.0)); }
    if (!continuous) { return Probe(leaf_value(found.word), differences(found)); }
    let corners = leaf_corners();
    let at = within(ray, t, found.cell, cells);
    return Probe(trilinear(corners, at), trilinear_gradient(corners, at) * (f32(cells) / f32(found.cell.size)));
}

// The gradient where leaves have one value each: by the leaves on either side.
fn differences(leaf: Found) -> vec3<f32> {
    let cells = grid_cells();
    let value = leaf_value(leaf.word);
    var gradient = vec3<f32>(0.0);
    for (var axis = 0u; axis < 3u; axis += 1u) {
        let is_axis = vec3<bool>(axis == 0u, axis == 1u, axis == 2u);
        var rise = 0.0;
        var run = 0.0;
        for (var side = 0u; side < 2u; side += 1u) {
            let beside = select(leaf.cell.low - 1u, leaf.cell.low + leaf.cell.size, side == 1u);
            let at = select(leaf.cell.low + leaf.cell.size / 2u, beside, is_axis);
            // Below 0 wraps to far beyond.
            if (any(at >= vec3<u32>(cells))) { continue; }
            let beyond = descend(at, ALL);
            if (beyond.word != EMPTY) {
                rise += select(-1.0, 1.0, side == 1u) * (leaf_value(beyond.word) - value);
                let apart = abs(middle(beyond.cell) - middle(leaf.cell));
                run += dot(select(vec3<f32>(0.0), apart, is_axis), vec3<f32>(1.0));
            }
        }
        if (run > 0.0) { gradient += select(vec3<f32>(0.0), vec3<f32>(rise * f32(cells) / run), is_axis); }
    }
    return gradient;
}

fn middle(cell: Cell) -> vec3<f32> {
    return vec3<f32>(cell.low) + 0.5 * f32(cell.size);
}

// Where the ray goes through a face of the surface. The octree may be empty there by rounding: then what is a little farther inside counts.
fn octree_face(ray: Ray, hit: Hit) -> FacePlace {
    let vertices = surface_faces[hit.word >> 1u].xyz;
    let a = bitcast<vec3<f32>>(surface_vertices[vertices.x].xyz);
    let b = bitcast<vec3<f32>>(surface_vertices[vertices.y].xyz);
    let c = bitcast<vec3<f32>>(surface_vertices[vertices.z].xyz);
    var value = probe(ray, hit.t).value;
    let farther = select(0.5, -0.5, is_exit(hit)) * frame.cell_edge / ray.length;
    if (value < 0.0) { value = probe(ray, hit.t + farther).value; }
    return face_place(ray, hit.t, a, b, c, value);
}

// How much of a pixel an edge of the mesh covers on a plane: drawn before, by the stage `cut_edges`.
fn edge_on_plane(ray: Ray, t: f32, i: u32) -> f32 {
    return textureLoad(cut_edges, ray_pixel, i, 0).r;
}

fn jump_gradient(ray: Ray, t: f32) -> vec3<f32> {
    return probe(ray, t).gradient;
}

// Where in a piece the field has a value that lies between those at its ends: by false position, in which an end that stays a second
// time counts for half (the Illinois method).
fn meet(ray: Ray, piece: Piece, value: f32) -> Meeting {
    var low = piece.span.x;
    var high = piece.span.y;
    var below = piece.ends.x - value;
    var above = piece.ends.y - value;
    var side = 0;
    var met = Meeting(low + (high - low) * (below / (below - above)), vec3<f32>(0.0));
    for (var step = 0u; step < MAX_STEPS; step += 1u) {
        let here = probe(ray, met.t);
        if (here.value < 0.0) { break; }
        met.gradient = here.gradient;
        let off = here.value - value;
        if (!continuous || abs(off) <= CLOSE || step + 1u == MAX_STEPS) { break; }
        if ((off < 0.0) == (below < 0.0)) {
            low = met.t;
            below = off;
            if (side < 0) { above *= 0.5; }
            side = -1;
        } else {
            high = met.t;
            above = off;
            if (side > 0) { below *= 0.5; }
            side = 1;
        }
        met.t = clamp(low + (high - low) * (below / (below - above)), piece.span.x, piece.span.y);
    }
    return met;
}

// Passes what lies between two places.
fn pass_between(ray: Ray, span: vec2<f32>, ends: vec2<f32>, light: ptr<function, Light>) {
    var gradient = vec3<f32>(0.0);
    if (shade_volume) { gradient = probe(ray, 0.5 * (span.x + span.y)).gradient; }
    pass_piece(ray, Piece(span, ends, (span.y - span.x) * ray.length, gradient), light);
}

fn add_light(light: ptr<function, Light>, front: f32, back: f32, piece_length: f32) {
    add_linear(light, front, back, piece_length);
}
