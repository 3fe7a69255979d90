// The march of a ray, stretch by stretch. A stage says how one is marched, and whether there may be more to see behind it.

// Marches a ray; returns the number of full leaves looked up.
fn march(ray: Ray, pixel: vec2<u32>, light: ptr<function, Light>) -> u32 {
    var samples = 0u;
    start_way(ray, pixel, light);
    while (find_stretch(ray, light)) {
        forget_last();
        if (!march_span(ray, vec2<f32>(max(span.x, part.x), min(span.y, part.y)), light, &samples)) { break; }
        leave_stretch(ray, light);
    }
    return samples;
}
