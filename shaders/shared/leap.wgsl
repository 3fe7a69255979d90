// To the next active leaf.

// The t, from t_begin on, at which the ray enters an active leaf; FAR if there is none before t_end.
fn next_active(ray: Ray, t_begin: f32, t_end: f32) -> f32 {
    let cells = grid_cells();
    // The largest cell without anything active may lie above the leaf found last.
    stack_level = 0u;
    var t = t_begin;
    var at = cell_at(ray, t, Cell(vec3<u32>(0u), cells), cells);
    loop {
        let found = descend(at, ACTIVE);
        if (found.word != EMPTY) { return t; }
        let leaving = exits(ray, found.cell);
        let t_exit = min(leaving.x, min(leaving.y, leaving.z));
        if (t_exit >= t_end) { return FAR; }
        at = step_out(ray, found.cell, leaving, t_exit, cells);
        if (any(at >= vec3<u32>(cells))) { return FAR; }
        t = max(t, t_exit);
    }
    return FAR;
}
