// The parts of a ray that are marched: all of it in the cube, or what lies inside the mesh's surface.

// Whether the surface cuts rays, and whether leaves have samples at their corners.
override clipped: bool = false;
override continuous: bool = false;

// Marches a ray through the cube, or through the parts of it that the surface leaves; returns the number of full leaves looked up. A stage
// says how a span from t = x to y is marched, and whether there may be more to see behind it.
fn march(ray: Ray, light: ptr<function, Light>) -> u32 {
    var samples = 0u;
    start_descent();
    if (!clipped) {
        march_span(ray, vec2<f32>(0.0, ray.t_out), light, &samples);
        return samples;
    }
    start_surface(ray);
    loop {
        var span = next_interval();
        span.y = min(span.y, ray.t_out);
        if (span.x >= span.y) { break; }
        if (!march_span(ray, span, light, &samples)) { break; }
    }
    return samples;
}
