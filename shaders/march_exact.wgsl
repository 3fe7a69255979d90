// Stage: march, exactly. Through the mesh itself: in by the boundary faces that a ray enters by, from there from tet to tet
// (Garrity 1990; maths 4.2), each segment cut at the knots of the transfer function.
// #import shared/frame.wgsl
// #import shared/ray.wgsl
// #import shared/surface.wgsl
// #import shared/classify.wgsl
// #import shared/segment.wgsl
// #import shared/light.wgsl
// #import shared/interval.wgsl
// #import shared/pass.wgsl
// #import shared/output.wgsl
// #import shared/main.wgsl

// The neighbour of a face that has none.
const NONE: u32 = 0xffffffffu;

// For each tet the tets behind its faces, ascending by the point opposite the face. src/mesh/compact.rs says more.
@group(0) @binding(11) var<storage, read> neighbours: array<vec4<u32>>;
// For each tet its four points' indices, by exclusive or.
@group(0) @binding(12) var<storage, read> tet_points: array<u32>;
// Position and normalised value.
@group(0) @binding(13) var<storage, read> vertices: array<vec4<f32>>;
// A value for each tet, where values live on cells.
@group(0) @binding(14) var<storage, read> cell_values: array<f32>;

// Whether values live on cells.
override on_cells: bool = false;

// A corner of the face that the ray is at, and the value there.
struct Corner {
    seen: Seen,
    value: f32,
}

// A place along a ray and the value there.
struct Place {
    t: f32,
    value: f32,
}

// Points of the tet that the ray is in, and of the face by which it entered.
var<private> tet_corners: vec4<u32>;
var<private> entered_face: vec3<u32>;

// Follows a ray through all chains of linked tets that it enters, nearest first; returns the number of tets met.
fn march(ray: Ray, pixel: vec2<u32>, light: ptr<function, Light>) -> u32 {
    var tets = 0u;
    // Where tets overlap each place counts once: what is passed already is cut off.
    var reached = 0.0;
    start_surface(ray);
    start_interval();
    while (has_hit()) {
        let hit = hit_at(hit_next);
        hit_next += 1u;
        if (is_exit(hit)) { continue; }
        if (!walk(hit.word >> 1u, ray, light, &reached, &tets)) { break; }
    }
    if (boundary_faces) { end_way_out(ray, light); }
    return tets;
}

fn corner(point: u32) -> Corner {
    let vertex = vertices[point];
    return Corner(Seen(see(vertex.xyz), point), vertex.w);
}

// A function of the face alone, so that its two tets meet at one place with one value.
fn place(a: Corner, b: Corner, c: Corner) -> Place {
    let weights = face_weights(a.seen, b.seen, c.seen);
    let t = dot(weights, vec3<f32>(a.seen.at.z, b.seen.at.z, c.seen.at.z)) * sight.inverse;
    return Place(t, clamp(dot(weights, vec3<f32>(a.value, b.value, c.value)), 0.0, 1.0));
}

// Goes from tet to tet, from a boundary face to the boundary or until too little is seen of what lies behind; then false.
fn walk(face: u32, ray: Ray, light: ptr<function, Light>, reached: ptr<function, f32>, tets: ptr<function, u32>) -> bool {
    let entered = surface_faces[face];
    // Turned inwards: each edge of the cycle passes on the left.
    var a = corner(surface_vertices[entered.x].w);
    var b = corner(surface_vertices[entered.z].w);
    var c = corner(surface_vertices[entered.y].w);
    var tet = entered.w;
    var near = place(a, b, c);
    if (with_surfaces && near.t > *reached + SEAM) { forget_last(); }
    var entry: FacePlace;
    if (boundary_faces) { entry = place_on_face(ray, near, tet, a, b, c); }
    // What planes clip off behind is not met.
    let limit = select(FAR, ray.t_out, clip_planes > 0u);
    // Signs are exact, so that no tet of a chain comes twice.
    let most = arrayLength(&tet_points);
    // Whether anything of this chain was not passed before.
    var is_inside = false;
    for (var step = 0u; step < most; step += 1u) {
        let behind = neighbours[tet];
        let apex = corner(tet_points[tet] ^ a.seen.id ^ b.seen.id ^ c.seen.id);
        if (with_surfaces || shade_volume) {
            entered_face = vec3<u32>(a.seen.id, b.seen.id, c.seen.id);
            tet_corners = vec4<u32>(entered_face, apex.seen.id);
        }
        // Out by the face whose edges to the apex pass on either side; the apex replaces the corner opposite it.
        let left_of_a = is_left(a.seen, apex.seen);
        let left_of_b = is_left(b.seen, apex.seen);
        let left_of_c = is_left(c.seen, apex.seen);
        var opposite: u32;
        if (!left_of_a && left_of_b) {
            opposite = c.seen.id;
            c = apex;
        } else if (!left_of_b && left_of_c) {
            opposite = a.seen.id;
            a = apex;
        } else if (left_of_a && !left_of_c) {
            opposite = b.seen.id;
            b = apex;
        } else {
            break; // all on one side: impossible while signs are exact
        }
        *tets += 1u;
        let far = place(a, b, c);
        let t_in = max(near.t, *reached);
        let t_out = min(far.t, limit);
        if (t_out > t_in) {
            *reached = t_out;
            if (boundary_faces && !is_inside) {
                is_inside = true;
                enter_mesh(ray, entry, light);
                if ((*light).transmittance < frame.min_transmittance) { return false; }
            }
            var ends = vec2<f32>(far.value);
            if (on_cells) {
                ends = vec2<f32>(cell_values[tet]);
            } else {
                ends.x = mix(near.value, far.value, (t_in - near.t) / (far.t - near.t));
                if (t_out < far.t) { ends.y = mix(near.value, far.value, (t_out - near.t) / (far.t - near.t)); }
            }
            var gradient = vec3<f32>(0.0);
            if (shade_volume) { gradient = tet_gradient(); }
            pass_piece(ray, Piece(vec2<f32>(t_in, t_out), ends, (t_out - t_in) * ray.length, gradient), light);
            if ((*light).transmittance < frame.min_transmittance) { return false; }
        }
        if (far.t >= limit) { return false; }
        near = far;
        let rank = u32(opposite > a.seen.id) + u32(opposite > b.seen.id) + u32(opposite > c.seen.id);
        let last = tet;
        tet = select(select(behind.x, behind.y, rank == 1u), select(behind.z, behind.w, rank == 3u), rank >= 2u);
        if (tet == NONE) {
            if (boundary_faces && is_inside && near.t >= *reached) { way_out = place_on_face(ray, near, last, a, b, c); }
            break;
        }
    }
    return true;
}

// Where the ray goes through a boundary face of a tet.
fn place_on_face(ray: Ray, at: Place, tet: u32, a: Corner, b: Corner, c: Corner) -> FacePlace {
    var value = at.value;
    if (on_cells) { value = cell_values[tet]; }
    return face_place(ray, at.t, vertices[a.seen.id].xyz, vertices[b.seen.id].xyz, vertices[c.seen.id].xyz, value);
}

// The field's gradient in the tet that the ray is in: normalised values per cube edge.
fn tet_gradient() -> vec3<f32> {
    if (on_cells) { return vec3<f32>(0.0); }
    let a = vertices[tet_corners.x];
    let b = vertices[tet_corners.y] - a;
    let c = vertices[tet_corners.z] - a;
    let d = vertices[tet_corners.w] - a;
    let volume = dot(b.xyz, cross(c.xyz, d.xyz));
    if (volume == 0.0) { return vec3<f32>(0.0); }
    return (b.w * cross(c.xyz, d.xyz) + c.w * cross(d.xyz, b.xyz) + d.w * cross(b.xyz, c.xyz)) / volume;
}

// Values jump where they live on cells: at the face by which the tet was entered.
fn jump_gradient(ray: Ray, t: f32) -> vec3<f32> {
    let a = vertices[entered_face.x].xyz;
    return cross(vertices[entered_face.y].xyz - a, vertices[entered_face.z].xyz - a);
}

// In a tet the field is linear.
fn meet(ray: Ray, piece: Piece, value: f32) -> Meeting {
    let part = (piece.ends.x - value) / (piece.ends.x - piece.ends.y);
    return Meeting(piece.span.x + part * (piece.span.y - piece.span.x), tet_gradient());
}

fn add_light(light: ptr<function, Light>, front: f32, back: f32, piece_length: f32) {
    add_cut(light, front, back, piece_length);
}

// How much of a pixel an edge of the tet covers on a plane: within half a pixel of it all.
fn edge_on_plane(ray: Ray, t: f32, i: u32) -> f32 {
    let normal = frame.cuts[i].xyz;
    let at = ray.origin + ray.direction * t;
    var distance = FAR;
    for (var i = 0u; i < 4u; i += 1u) {
        let a = vertices[tet_corners[(i + 1u) & 3u]].xyz;
        let face = cross(vertices[tet_corners[(i + 2u) & 3u]].xyz - a, vertices[tet_corners[(i + 3u) & 3u]].xyz - a);
        // Along the plane the face is farther than straight.
        let along = face - normal * dot(face, normal);
        let steepness = length(along);
        if (steepness > 0.0) { distance = min(distance, abs(dot(face, at - a)) / steepness); }
    }
    return clamp(1.0 - (distance / pixel_width(ray, t) - 0.5), 0.0, 1.0);
}
