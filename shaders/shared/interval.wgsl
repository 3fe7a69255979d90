// The interval of knots that a ray is in, kept from segment to segment: most lie in the one before them.

var<private> interval_low: Knot;
var<private> interval_high: Knot;
// Whether nothing in it is seen.
var<private> interval_clear: bool;
// Whether it has its upper end too, and not the interval above.
var<private> interval_closed: bool;

fn start_interval() {
    load_interval(0u);
}

fn load_interval(i: u32) {
    interval_low = knots[i];
    interval_high = knots[i + 1u];
    interval_clear = interval_low.extinction + interval_high.extinction <= 0.0;
    interval_closed = i + 2u >= arrayLength(&knots);
}

fn is_in_interval(least: f32, most: f32) -> bool {
    return interval_low.value <= least && most <= interval_high.value && (least < interval_high.value || interval_closed);
}

// `classify` in the interval kept.
fn classify_kept(value: f32) -> Medium {
    let f = clamp((value - interval_low.value) * interval_low.inverse_width, 0.0, 1.0);
    let extinction = interval_low.extinction + f * (interval_high.extinction - interval_low.extinction);
    return Medium(extinction, interval_low.color + f * (interval_high.color - interval_low.color));
}

// Passes a segment whose value goes linearly from front to back, as add_linear does.
fn add_cut(light: ptr<function, Light>, front: f32, back: f32, segment_length: f32) {
    let least = min(front, back);
    let most = max(front, back);
    if (!is_in_interval(least, most)) {
        load_interval(interval_of(least));
        if (!is_in_interval(least, most)) {
            add_linear(light, front, back, segment_length);
            return;
        }
    }
    if (interval_clear) { return; }
    let f = classify_kept(front);
    let b = classify_kept(back);
    let w = segment(f.extinction * segment_length, b.extinction * segment_length);
    (*light).color += (*light).transmittance * (w.x * f.color + w.y * b.color);
    (*light).transmittance *= 1.0 - w.z;
}
