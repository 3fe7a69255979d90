// Steps of one length: at the multiples of the step from where the ray enters the cube, and at the ends of spans; the field is linear in
// between. Whatever is skipped, no sample moves. A stage says what the field is at a place (`sample_at`), whether anything active is there
// (`is_active_here`), and where the next that is begins (`next_active`).

// The sample where there is nothing.
const NOTHING: f32 = -1.0;

// Up to where the ray has been marched: parts that follow each other may share a step.
var<private> marched_to: f32;

// Marches the steps of a span that touch a part; adds the samples taken in full leaves.
fn march_span(ray: Ray, span: vec2<f32>, part: vec2<f32>, light: ptr<function, Light>, samples: ptr<function, u32>) -> bool {
    let step = max(step_along(ray), MIN_STEP);
    let begin = max(span.x, marched_to);
    let end = min(span.y, part.y);
    var i = floor(max(part.x, begin) / step);
    var t = max(i * step, begin);
    if (t >= end) { return true; }
    forget_place();
    var front = sample_at(ray, t, samples);
    loop {
        if (skipping && !is_active_here()) {
            let next_begin = next_active(ray, t, end);
            forget_place();
            if (next_begin >= end) { return true; }
            let steps = floor(next_begin / step);
            if (steps > i) {
                i = steps;
                t = max(i * step, t);
                front = sample_at(ray, t, samples);
            }
        }
        i += 1.0;
        let next = min(i * step, span.y);
        let back = sample_at(ray, next, samples);
        add_segment(light, front, back, (next - t) * ray.length);
        marched_to = next;
        if ((*light).transmittance < frame.min_transmittance) { return false; }
        if (next >= end) { return true; }
        t = next;
        front = back;
    }
    return true;
}

// Passes a step. Where one end is empty the other's value holds for half of it; without samples at corners the front's does for all.
fn add_segment(light: ptr<function, Light>, front: f32, back: f32, segment_length: f32) {
    if (!continuous) {
        if (front != NOTHING) { add_constant(light, front, segment_length); }
    } else if (front != NOTHING && back != NOTHING) {
        add_linear(light, front, back, segment_length);
    } else if (front != NOTHING || back != NOTHING) {
        add_constant(light, max(front, back), 0.5 * segment_length);
    }
}

// The leaf that the last sample fell into, and where the ray leaves it.
var<private> leaf: Found;
var<private> leaf_exit: f32;
var<private> corners: Corners;

fn forget_place() {
    leaf_exit = -FAR;
}

// The octree's field at t, or NOTHING.
fn octree_sample(ray: Ray, t: f32) -> f32 {
    let cells = grid_cells();
    if (t >= leaf_exit) {
        leaf = descend(cell_at(ray, t, Cell(vec3<u32>(0u), cells), cells), ALL);
        let leaving = exits(ray, leaf.cell);
        leaf_exit = min(leaving.x, min(leaving.y, leaving.z));
        if (continuous && leaf.word != EMPTY) { corners = leaf_corners(); }
    }
    if (leaf.word == EMPTY) { return NOTHING; }
    if (!continuous) { return leaf_value(leaf.word); }
    return trilinear(corners, within(ray, t, leaf.cell, cells));
}
