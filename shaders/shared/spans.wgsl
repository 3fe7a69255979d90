// What of a ray is marched: all of it in the cube, or what lies inside the mesh's surface; of that, the parts that hold something active.
// A stretch is where a span inside the surface and a part overlap.

// Whether the surface cuts rays, and whether leaves have samples at their corners.
override clipped: bool = false;
override continuous: bool = false;

// The span and the part that the ray is in.
var<private> span: vec2<f32>;
var<private> part: vec2<f32>;

// Begins with a ray, before its first stretch.
fn start_way(ray: Ray, pixel: vec2<u32>) {
    start_descent();
    start_parts(pixel);
    part = next_part();
    span = vec2<f32>(0.0, ray.t_out);
    if (clipped) {
        // Rays on which nothing is seen need not look for the surface.
        if (skipping) { part.x = next_active(ray, 0.0, ray.t_out); }
        if (part.x >= ray.t_out) { return; }
        start_surface(ray);
        span = next_span(ray);
    }
}

// Goes on to the next stretch, or stays in the one that the ray is in; whether there is one.
fn find_stretch(ray: Ray) -> bool {
    while (span.x < span.y && part.x < ray.t_out) {
        if (part.x < span.y && span.x < part.y) { return true; }
        leave_stretch(ray);
    }
    return false;
}

// What ends first makes room for the next.
fn leave_stretch(ray: Ray) {
    if (part.y < span.y) {
        part = next_part();
    } else if (clipped) {
        span = next_span(ray);
    } else {
        span = vec2<f32>(FAR, -FAR);
    }
}

// The next interval inside the surface, cut to the cube.
fn next_span(ray: Ray) -> vec2<f32> {
    let next = next_interval();
    return vec2<f32>(next.x, min(next.y, ray.t_out));
}
