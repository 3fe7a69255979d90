// What of a ray is marched: all of it in the cube, or what lies inside the mesh's surface; of that, the parts that hold something active.
// A stretch is where a span inside the surface and a part overlap.

// Whether the surface cuts rays, and whether leaves have samples at their corners.
override clipped: bool = false;
override continuous: bool = false;

// The span and the part that the ray is in.
var<private> span: vec2<f32>;
var<private> part: vec2<f32>;

// Begins with a ray, before its first stretch.
fn start_way(ray: Ray, pixel: vec2<u32>, light: ptr<function, Light>) {
    start_descent();
    start_parts(pixel);
    part = next_part();
    span = vec2<f32>(0.0, ray.t_out);
    if (clipped) {
        // Rays on which nothing is seen need not look for the surface.
        if (skipping) { part.x = next_active(ray, 0.0, ray.t_out); }
        if (part.x >= ray.t_out) { return; }
        start_surface(ray);
        span = next_span(ray, light);
    }
}

// Goes on to the next stretch, or stays in the one that the ray is in; whether there is one.
fn find_stretch(ray: Ray, light: ptr<function, Light>) -> bool {
    while (span.x < span.y && part.x < ray.t_out) {
        if (part.x < span.y && span.x < part.y) { return true; }
        leave_stretch(ray, light);
    }
    return false;
}

// What ends first makes room for the next.
fn leave_stretch(ray: Ray, light: ptr<function, Light>) {
    if (part.y < span.y) {
        part = next_part();
    } else if (clipped) {
        if (boundary_faces && last_hit.t <= ray.t_out) { way_out = octree_face(ray, last_hit); }
        span = next_span(ray, light);
    } else {
        span = vec2<f32>(FAR, -FAR);
    }
}

// The next interval inside the surface, cut to the cube; there is none if a face hides it.
fn next_span(ray: Ray, light: ptr<function, Light>) -> vec2<f32> {
    let interval = next_interval();
    let next = vec2<f32>(interval.x, min(interval.y, ray.t_out));
    if (boundary_faces) {
        if (next.x < next.y) {
            enter_mesh(ray, octree_face(ray, first_hit), light);
        } else {
            end_way_out(ray, light);
        }
        if ((*light).transmittance < frame.min_transmittance) { return vec2<f32>(FAR, -FAR); }
    }
    return next;
}
