// The mesh's boundary faces as they are drawn: where rays enter and leave the mesh. src/cpu/faces.rs says more.

// Whether they are drawn.
override boundary_faces: bool = false;

// Parts of the mesh this near to each other along a ray touch.
const SEAM: f32 = 1e-6;

// Where a ray goes through a face.
struct FacePlace {
    t: f32,
    // Of any length.
    normal: vec3<f32>,
    value: f32,
    // How much of the pixel an edge covers.
    edge: f32,
}

// Where the ray has left the mesh, unless it goes on there; t is FAR if it has not.
var<private> way_out: FacePlace;

// Where a ray goes through the face with these corners, and the value there.
fn face_place(ray: Ray, t: f32, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, value: f32) -> FacePlace {
    var edge = 0.0;
    if (style.face_edges > 0.0) {
        let distance = min(distance_to_line(ray, a, b), min(distance_to_line(ray, b, c), distance_to_line(ray, c, a)));
        edge = clamp(1.0 - (distance / pixel_width(ray, t) - 0.5), 0.0, 1.0);
    }
    return FacePlace(t, cross(b - a, c - a), value, edge);
}

// How far the ray passes by a line.
fn distance_to_line(ray: Ray, a: vec3<f32>, b: vec3<f32>) -> f32 {
    let across = cross(ray.direction, b - a);
    let size = length(across);
    if (size <= 0.0) { return FAR; }
    return abs(dot(a - ray.origin, across)) / size;
}

// The width of a pixel at t.
fn pixel_width(ray: Ray, t: f32) -> f32 {
    return length(frame.right_origin + frame.right * (t - ray.t_eye - frame.eye_distance)) * frame.pixel_size.x;
}

fn enter_mesh(ray: Ray, place: FacePlace, light: ptr<function, Light>) {
    if (way_out.t < FAR && place.t <= way_out.t + SEAM) {
        way_out.t = FAR;
        return;
    }
    end_way_out(ray, light);
    // What lies before the ray's beginning is not seen.
    if (place.t > 0.0) { add_face(ray, place, light); }
}

// Adds the face by which the ray has left the mesh.
fn end_way_out(ray: Ray, light: ptr<function, Light>) {
    if (way_out.t < FAR) { add_face(ray, way_out, light); }
    way_out.t = FAR;
}

fn add_face(ray: Ray, place: FacePlace, light: ptr<function, Light>) {
    var color = style.face_color;
    let value = clamp(place.value, 0.0, 1.0);
    if (style.face_values > 0.0) { color = classify(interval_of(value), value).color; }
    var lit = Lit(1.0, 0.0);
    if (shade_surfaces && dot(place.normal, place.normal) > 0.0) { lit = lit_facing(normalize(place.normal), to_eye(ray)); }
    let ink = (1.0 - EDGE_INK * place.edge) * style.face_opacity * (*light).transmittance;
    (*light).color += ink * (color * lit.own + lit.white);
    (*light).transmittance *= 1.0 - style.face_opacity;
}
