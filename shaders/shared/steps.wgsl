// Steps of one length: at the multiples of the step from where the ray enters the cube, and at the ends of spans; the field is linear in
// between. Whatever is skipped, no sample moves. A stage says what the field is at a place (`sample_at`), whether anything active is there
// (`is_active_here`), where the next that is begins (`next_active`), and how it finds its place in the tree again (`regain_place`).

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
    start_way(ray, pixel, light);
    loop {
        if (is_over) {
            if (!find_stretch(ray, light)) { break; }
            is_over = false;
            if (boundary_faces) { forget_place(); }
            end = min(span.y, part.y);
            let begin = max(span.x, t);
            let steps = floor(max(part.x, begin) / step);
            let first = max(steps * step, begin);
            if (first >= end) {
                is_over = true;
                leave_stretch(ray, light);
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
                forget_last();
            }
        }
        let value = sample_at(ray, t, &samples);
        if (has_front) {
            pass_step(ray, vec2<f32>(last, t), front, value, light);
            if ((*light).transmittance < frame.min_transmittance) { break; }
            if (with_surfaces || shade_volume) {
                regain_place(ray, t);
            }
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
                forget_last();
                continue;
            }
        }
        if (is_over) {
            leave_stretch(ray, light);
        } else {
            i += 1.0;
            t = min(i * step, span.y);
        }
    }
    return samples;
}

// Passes a step. Where one end is empty the other's value holds for half of it; without samples at corners the front's does for all.
fn pass_step(ray: Ray, span: vec2<f32>, front: f32, back: f32, light: ptr<function, Light>) {
    let middle = span.x + 0.5 * (span.y - span.x);
    if (!continuous && front != NOTHING) {
        pass_between(ray, span, vec2<f32>(front), light);
    } else if (continuous && front != NOTHING && back != NOTHING) {
        pass_between(ray, span, vec2<f32>(front, back), light);
    } else if (continuous && front != NOTHING) {
        pass_between(ray, vec2<f32>(span.x, middle), vec2<f32>(front), light);
    } else {
        forget_last();
        if (continuous && back != NOTHING) { pass_between(ray, vec2<f32>(middle, span.y), vec2<f32>(back), light); }
    }
}

// The leaf that the last sample fell into, and where the ray leaves it.
var<private> leaf: Found;
var<private> leaf_exit: f32;
var<private> corners: Corners;

fn forget_place() {
    leaf_exit = -FAR;
}

// Finds the leaf at t, if it is another than before.
fn look(ray: Ray, t: f32) {
    let cells = grid_cells();
    if (t >= leaf_exit) {
        leaf = descend(cell_at(ray, t, Cell(vec3<u32>(0u), cells), cells), ALL);
        let leaving = exits(ray, leaf.cell);
        leaf_exit = min(leaving.x, min(leaving.y, leaving.z));
        if (continuous && leaf.word != EMPTY) { corners = leaf_corners(); }
    }
}

// The octree's field at t, or NOTHING.
fn octree_sample(ray: Ray, t: f32) -> f32 {
    look(ray, t);
    if (leaf.word == EMPTY) { return NOTHING; }
    if (!continuous) { return leaf_value(leaf.word); }
    return trilinear(corners, within(ray, t, leaf.cell, grid_cells()));
}
