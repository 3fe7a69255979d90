// Stage: march, exactly. Through the mesh itself: in by the boundary faces that a ray enters by, from there from tet to tet
// (Garrity 1990; maths 4.2), each segment cut at the knots of the transfer function.
// #import shared/frame.wgsl
// #import shared/ray.wgsl
// #import shared/surface.wgsl
// #import shared/classify.wgsl
// #import shared/segment.wgsl
// #import shared/light.wgsl
// #import shared/interval.wgsl
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
        if (!walk(hit.word >> 1u, ray.length, light, &reached, &tets)) { break; }
    }
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
fn walk(face: u32, unit: f32, light: ptr<function, Light>, reached: ptr<function, f32>, tets: ptr<function, u32>) -> bool {
    let entered = surface_faces[face];
    // Turned inwards: each edge of the cycle passes on the left.
    var a = corner(surface_vertices[entered.x].w);
    var b = corner(surface_vertices[entered.z].w);
    var c = corner(surface_vertices[entered.y].w);
    var tet = entered.w;
    var near = place(a, b, c);
    // Signs are exact, so that no tet of a chain comes twice.
    let most = arrayLength(&tet_points);
    for (var step = 0u; step < most; step += 1u) {
        let behind = neighbours[tet];
        let apex = corner(tet_points[tet] ^ a.seen.id ^ b.seen.id ^ c.seen.id);
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
        if (far.t > t_in) {
            *reached = far.t;
            if (on_cells) {
                let value = cell_values[tet];
                add_cut(light, value, value, (far.t - t_in) * unit);
            } else {
                let value = mix(near.value, far.value, (t_in - near.t) / (far.t - near.t));
                add_cut(light, value, far.value, (far.t - t_in) * unit);
            }
            if ((*light).transmittance < frame.min_transmittance) { return false; }
        }
        near = far;
        let rank = u32(opposite > a.seen.id) + u32(opposite > b.seen.id) + u32(opposite > c.seen.id);
        tet = select(select(behind.x, behind.y, rank == 1u), select(behind.z, behind.w, rank == 3u), rank >= 2u);
        if (tet == NONE) { break; }
    }
    return true;
}
