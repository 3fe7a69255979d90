// Steps of one length: at the multiples of the step from where the ray enters the cube, and at the ends of spans; the field is linear in
// between. Whatever is skipped, no sample moves. A stage says what the field is at a place (`sample_at`), whether anything active is there
// (`is_active_here`), and where the next that is begins (`next_active`).

// The sample where there is nothing.
const NOTHING: f32 = -1.0;

// Marches a ray; returns the number of samples taken in full leaves. One loop that takes a sample a turn, wherever stretches begin and end:
// so the lanes of a group stay together.
fn march(ray: Ray, pixel: vec2<u32>, light: ptr<function, Light>) -> u32 {
    var samples = 0u;
    let step = max(step_along(ray), MIN_STEP);
    // The step that begins at t.
    var i = 0.0;
    var t = 0.0;
    // The last sample, where a step begins if there is one.
    var front = NOTHING;
    var last = 0.0;
    var has_front = false;
    // Whether another stretch is to be found, and where the present one ends.
    var is_over = true;
    var end = 0.0;
    start_way(ray, pixel);
    loop {
        if (is_over) {
            if (!find_stretch(ray)) { break; }
            is_over = false;
            end = min(span.y, part.y);
            let begin = max(span.x, t);
            let steps = floor(max(part.x, begin) / step);
            let first = max(steps * step, begin);
            if (first >= end) {
                is_over = true;
                leave_stretch(ray);
                continue;
            }
            if (has_front && first <= last) {
                // Stretches that follow each other share a step.
                i += 1.0;
                t = min(i * step, span.y);
            } else {
                i = steps;
                t = first;
                has_front = false;
                forget_place();
            }
        }
        let value = sample_at(ray, t, &samples);
        if (has_front) {
            add_segment(light, front, value, (t - last) * ray.length);
            if ((*light).transmittance < frame.min_transmittance) { break; }
        }
        front = value;
        last = t;
        has_front = true;
        is_over = t >= end;
        if (!is_over && skipping && !is_active_here()) {
            let next_begin = next_active(ray, t, end);
            forget_place();
            is_over = next_begin >= end;
            let steps = floor(next_begin / step);
            if (!is_over && steps > i) {
                i = steps;
                t = max(i * step, t);
                has_front = false;
                continue;
            }
        }
        if (is_over) {
            leave_stretch(ray);
        } else {
            i += 1.0;
            t = min(i * step, span.y);
        }
    }
    return samples;
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
