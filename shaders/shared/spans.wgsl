// What of a ray is marched: all of it in the cube, or what lies inside the mesh's surface; of that, the parts that hold something active.

// Whether the surface cuts rays, and whether leaves have samples at their corners.
override clipped: bool = false;
override continuous: bool = false;

// Marches a ray; returns the number of full leaves looked up. A stage says how a span is marched from where both it and a part of the
// ray begin to where one of them ends, and whether there may be more to see behind it.
fn march(ray: Ray, pixel: vec2<u32>, light: ptr<function, Light>) -> u32 {
    var samples = 0u;
    start_descent();
    start_parts(pixel);
    var part = next_part();
    if (part.x >= ray.t_out) { return 0u; }
    var span = vec2<f32>(0.0, ray.t_out);
    if (clipped) {
        // Rays on which nothing is seen need not look for the surface.
        if (skipping) {
            part.x = next_active(ray, 0.0, ray.t_out);
            if (part.x >= ray.t_out) { return 0u; }
        }
        start_surface(ray);
        span = next_span(ray);
    }
    while (span.x < span.y && part.x < ray.t_out) {
        if (part.x < span.y && span.x < part.y && !march_span(ray, span, part, light, &samples)) { break; }
        // What ends first makes room for the next.
        if (part.y < span.y) {
            part = next_part();
        } else if (clipped) {
            span = next_span(ray);
        } else {
            break;
        }
    }
    return samples;
}

// The next interval inside the surface, cut to the cube.
fn next_span(ray: Ray) -> vec2<f32> {
    let span = next_interval();
    return vec2<f32>(span.x, min(span.y, ray.t_out));
}
