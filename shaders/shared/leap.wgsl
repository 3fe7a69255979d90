// Leaps over what is not active.
// #import shared/clearance.wgsl

// Where the last leap ended: in the first cell of an active leaf, if it found one.
var<private> leapt_to: vec3<u32>;

// The t, from t_begin on, at which the ray enters an active leaf; FAR if there is none before t_end.
fn next_active(ray: Ray, t_begin: f32, t_end: f32) -> f32 {
    let cells = grid_cells();
    leapt_to = cell_at(ray, t_begin, Cell(vec3<u32>(0u), cells), cells);
    // The largest cell without anything active may lie above the leaf found last.
    stack_level = 0u;
    return leap(ray, t_begin, t_end);
}

// The same from the cell `leapt_to`, which the ray enters at t_begin.
fn leap(ray: Ray, t_begin: f32, t_end: f32) -> f32 {
    let cells = grid_cells();
    var t = t_begin;
    loop {
        let clear = clearance_at(leapt_to);
        var low = clear.low;
        var high = clear.high;
        if (!clear.is_clear) {
            let found = descend(leapt_to, ACTIVE);
            if (found.word != EMPTY) { return t; }
            low = found.cell.low;
            high = low + found.cell.size;
        }
        let leaving = exits_of(ray, low, high);
        let t_exit = min(leaving.x, min(leaving.y, leaving.z));
        if (t_exit >= t_end) { return FAR; }
        leapt_to = step_out_of(ray, low, high, leaving, t_exit, cells);
        if (any(leapt_to >= vec3<u32>(cells))) { return FAR; }
        t = max(t, t_exit);
    }
    return FAR;
}
