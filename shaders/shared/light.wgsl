// What a ray has gathered, front to back.

struct Light {
    // Linear RGB, premultiplied.
    color: vec3<f32>,
    // From 1 (nothing met) to 0 (opaque).
    transmittance: f32,
}

fn dark() -> Light {
    return Light(vec3<f32>(0.0), 1.0);
}

// Passes a segment of constant value.
fn add_constant(light: ptr<function, Light>, value: f32, segment_length: f32) {
    let medium = classify(interval_of(value), value);
    let alpha = em1(medium.extinction * segment_length);
    (*light).color += ((*light).transmittance * alpha) * medium.color;
    (*light).transmittance *= 1.0 - alpha;
}

// Passes a segment whose value goes linearly from front to back: cut at each knot between, in the order of the ray, with the knots'
// one-sided limits (maths 2.6).
fn add_linear(light: ptr<function, Light>, front: f32, back: f32, segment_length: f32) {
    if (front == back) {
        add_constant(light, front, segment_length);
        return;
    }
    let rising = back > front;
    var interval: u32;
    if (rising) { interval = interval_of(front); } else { interval = interval_below(front); }
    var value = front;
    var part = 0.0;
    loop {
        // The piece ends at the interval's far knot, or with the segment. `part` is the part of the length before it.
        let knot = knots[select(interval, interval + 1u, rising)].value;
        let last = select(back >= knot || interval == 0u, back <= knot || interval + 2u >= arrayLength(&knots), rising);
        let end = select(knot, back, last);
        let end_part = select(clamp((knot - front) / (back - front), part, 1.0), 1.0, last);
        add_piece(light, interval, value, end, segment_length * (end_part - part));
        if (last) { break; }
        value = end;
        part = end_part;
        interval = select(interval - 1u, interval + 1u, rising);
    }
}

// Passes a piece of a segment inside one interval of knots, where extinction and colour are linear.
fn add_piece(light: ptr<function, Light>, interval: u32, front: f32, back: f32, piece_length: f32) {
    if (piece_length <= 0.0) { return; }
    let f = classify(interval, front);
    let b = classify(interval, back);
    if (f.extinction + b.extinction <= 0.0) { return; }
    let w = segment(f.extinction * piece_length, b.extinction * piece_length);
    (*light).color += (*light).transmittance * (w.x * f.color + w.y * b.color);
    (*light).transmittance *= 1.0 - w.z;
}
