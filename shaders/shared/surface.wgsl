// Where a ray enters and leaves the mesh through its boundary surface. src/cpu/surface.rs says more.

// Hits are gathered so many at a time, nearest first.
const MAX_HITS: u32 = 16u;
// The deepest hierarchy there is.
const MAX_LEVELS: u32 = 32u;
// Smaller projected coordinates are taken as 0, so that no product of two underflows.
const TINY: f32 = 1.4551915e-11;

// 5 vectors a node: lowest corner, scale and which children are nodes; first node, first face, what the children are; lower and upper
// bounds of the children along x, y, z, a byte each.
@group(0) @binding(8) var<storage, read> surface_nodes: array<vec4<u32>>;
// Three vertices in outward order, and the tet behind.
@group(0) @binding(9) var<storage, read> surface_faces: array<vec4<u32>>;
// Bits of the position, and the point of the mesh.
@group(0) @binding(10) var<storage, read> surface_vertices: array<vec4<u32>>;

// A ray as faces see it.
struct Sight {
    // The ray's origin, turned.
    origin: vec3<f32>,
    // t per unit of depth.
    inverse: f32,
    // What brings a point onto the plane per unit of depth, in 12-bit halves.
    shear_high: vec2<f32>,
    shear_low: vec2<f32>,
    // The axis that the ray moves along most, and whether it moves down it.
    axis: u32,
    down: bool,
}

// A vertex as a ray sees it: x and y across, depth along.
struct Seen {
    at: vec3<f32>,
    id: u32,
}

// Where a ray goes through a face. `word` is twice the face's index, and 1 more if the ray leaves the mesh there.
struct Hit {
    t: f32,
    word: u32,
}

// Which children of a node the line meets: those that are nodes, and the faces of those that are leaves.
struct Met {
    inner: u32,
    faces: u32,
}

var<private> sight: Sight;
// The line as boxes see it.
var<private> surface_origin: vec3<f32>;
var<private> surface_inverse: vec3<f32>;
// The nearest hits after surface_after.
var<private> hit_t: array<f32, MAX_HITS>;
var<private> hit_word: array<u32, MAX_HITS>;
var<private> hit_count: u32;
// The hit that comes next.
var<private> hit_next: u32;
// Whether there are more after these.
var<private> hit_more: bool;
var<private> surface_after: Hit;
// Where the last interval begins and ends.
var<private> first_hit: Hit;
var<private> last_hit: Hit;
// How often the line has entered less how often it has left.
var<private> surface_inside: i32;

fn sight_of(ray: Ray) -> Sight {
    let d = abs(ray.direction);
    var axis = select(0u, 1u, d.y >= d.x);
    if (d.z >= max(d.x, d.y)) { axis = 2u; }
    let inverse = select(select(ray.inverse.z, ray.inverse.y, axis == 1u), ray.inverse.x, axis == 0u);
    let down = inverse < 0.0;
    let shear = -turn(axis, down, ray.direction).xy * inverse;
    let high = bitcast<vec2<f32>>(bitcast<vec2<u32>>(shear) & vec2<u32>(0xfffff000u));
    return Sight(turn(axis, down, ray.origin), inverse, high, shear - high, axis, down);
}

// Coordinates in an order in which z is along the ray's axis, and x, y such that what goes round to the left when seen along the ray goes
// round so on the plane.
fn turn(axis: u32, down: bool, v: vec3<f32>) -> vec3<f32> {
    let turned = select(select(v, v.zxy, axis == 1u), v.yzx, axis == 0u);
    return select(turned, turned.yxz, down);
}

// A point onto the plane, with the same bits wherever this is inlined: products of 12-bit halves are exact.
fn see(position: vec3<f32>) -> vec3<f32> {
    let offset = turn(sight.axis, sight.down, position) - sight.origin;
    let high = bitcast<f32>(bitcast<u32>(offset.z) & 0xfffff000u);
    let low = offset.z - high;
    let at = offset.xy + sight.shear_high * high + sight.shear_high * low + sight.shear_low * high + sight.shear_low * low;
    return vec3<f32>(select(at, vec2<f32>(0.0), abs(at) < vec2<f32>(TINY)), offset.z);
}

// Whether the edge from p to q passes the ray on its left: the exact sign of p x q. On 0 the ray is taken to pass at (e, e^2) for an
// infinitely small e > 0; coincident points follow their indices, so that no three of them go round the ray.
fn is_left(p: Seen, q: Seen) -> bool {
    let left = p.at.x * q.at.y;
    let right = p.at.y * q.at.x;
    if (left != right) { return left > right; }
    return is_left_on_tie(p, q, left);
}

fn is_left_on_tie(p: Seen, q: Seen, product: f32) -> bool {
    let left = rounded_off(p.at.x, q.at.y, product);
    let right = rounded_off(p.at.y, q.at.x, product);
    if (left != right) { return left > right; }
    if (q.at.y != p.at.y) { return q.at.y < p.at.y; }
    if (q.at.x != p.at.x) { return q.at.x > p.at.x; }
    return p.id < q.id;
}

// a b - product exactly, product being a b rounded (Dekker 1971).
fn rounded_off(a: f32, b: f32, product: f32) -> f32 {
    let high = high_bits(vec3<f32>(a, b, 0.0));
    let low = vec3<f32>(a, b, 0.0) - high;
    return low.x * low.y - (((product - high.x * high.y) - low.x * high.y) - high.x * low.y);
}

// Weights of a hit face's corners where the ray goes through it.
fn face_weights(a: Seen, b: Seen, c: Seen) -> vec3<f32> {
    let areas = abs(vec3<f32>(b.at.x * c.at.y - b.at.y * c.at.x, c.at.x * a.at.y - c.at.y * a.at.x, a.at.x * b.at.y - a.at.y * b.at.x));
    let sum = areas.x + areas.y + areas.z;
    if (sum > 0.0) { return areas / sum; }
    return vec3<f32>(1.0 / 3.0);
}

fn is_exit(hit: Hit) -> bool {
    return (hit.word & 1u) == 1u;
}

fn is_after(hit: Hit, other: Hit) -> bool {
    return hit.t > other.t || (hit.t == other.t && hit.word > other.word);
}

fn hit_at(i: u32) -> Hit {
    return Hit(hit_t[i], hit_word[i]);
}

// Begins with the line of a ray; nothing is gathered yet.
fn start_surface(ray: Ray) {
    sight = sight_of(ray);
    surface_origin = ray.origin;
    surface_inverse = ray.inverse;
    surface_after = Hit(-FAR, 0u);
    surface_inside = 0;
    hit_count = 0u;
    hit_next = 0u;
    hit_more = true;
}

// The next interval of t >= 0 inside the mesh as (t0, t1), t0 < t1; (FAR, -FAR) if there are no more. Parts of the mesh that overlap or
// touch are one interval. The last may reach beyond the cube.
fn next_interval() -> vec2<f32> {
    var start = FAR;
    var end = -FAR;
    while (has_hit()) {
        let hit = hit_at(hit_next);
        // The mesh is left; what is entered at the same place goes on.
        if (surface_inside == 0 && end > max(start, 0.0) && (is_exit(hit) || hit.t > end)) { break; }
        hit_next += 1u;
        let before = surface_inside;
        surface_inside += select(1, -1, is_exit(hit));
        if (before == 0 && surface_inside == 1 && hit.t > end) {
            start = hit.t;
            first_hit = hit;
        }
        if (before == 1 && surface_inside == 0) {
            end = hit.t;
            last_hit = hit;
        }
    }
    start = max(start, 0.0);
    return select(vec2<f32>(FAR, -FAR), vec2<f32>(start, end), end > start);
}

// Whether there is a hit at hit_next, gathered if need be.
fn has_hit() -> bool {
    if (hit_next == hit_count && hit_more) { gather(); }
    return hit_next < hit_count;
}

// Finds the nearest hits after those gathered before, as many as there is room for.
fn gather() {
    if (hit_count > 0u) { surface_after = hit_at(hit_count - 1u); }
    hit_count = 0u;
    hit_next = 0u;
    hit_more = false;
    // A group of nodes: the first of its family, then which are children to visit and which are nodes at all, 8 bits each.
    var groups: array<vec2<u32>, MAX_LEVELS>;
    var level = 0u;
    var group = vec2<u32>(0u, 1u);
    loop {
        if ((group.y & 255u) == 0u) {
            if (level == 0u) { return; }
            level -= 1u;
            group = groups[level];
        }
        let child = firstTrailingBit(group.y);
        let before = (group.y >> 8u) & ((1u << child) - 1u);
        let node = 5u * (group.x + countOneBits(before));
        group.y &= ~(1u << child);
        if ((group.y & 255u) != 0u) {
            groups[level] = group;
            level += 1u;
        }
        let head = surface_nodes[node];
        let family = surface_nodes[node + 1u];
        let met = visit_node(node, head, family.zw);
        var faces = met.faces;
        while (faces != 0u) {
            test_face(family.y + firstTrailingBit(faces));
            faces &= faces - 1u;
        }
        group = vec2<u32>(family.x, met.inner | ((head.w >> 24u) << 8u));
    }
}

// Which children of a node have boxes that the line meets where hits count.
fn visit_node(node: u32, head: vec4<u32>, children: vec2<u32>) -> Met {
    let exponents = (vec3<u32>(head.w) >> vec3<u32>(0u, 8u, 16u)) & vec3<u32>(255u);
    let scale = bitcast<vec3<f32>>(exponents << vec3<u32>(23u)) * surface_inverse;
    let low = (bitcast<vec3<f32>>(head.xyz) - surface_origin) * surface_inverse;
    let x = surface_nodes[node + 2u];
    let y = surface_nodes[node + 3u];
    let z = surface_nodes[node + 4u];
    var limit = FAR;
    if (hit_count == MAX_HITS) { limit = hit_t[MAX_HITS - 1u]; }
    var met = Met(0u, 0u);
    for (var child = 0u; child < 8u; child += 1u) {
        let second = child >= 4u;
        let shift = vec3<u32>(8u * (child & 3u));
        let lower = (select(vec3<u32>(x.x, y.x, z.x), vec3<u32>(x.y, y.y, z.y), second) >> shift) & vec3<u32>(255u);
        let upper = (select(vec3<u32>(x.z, y.z, z.z), vec3<u32>(x.w, y.w, z.w), second) >> shift) & vec3<u32>(255u);
        let kind = (select(children.x, children.y, second) >> shift.x) & 255u;
        let a = vec3<f32>(lower) * scale + low;
        let b = vec3<f32>(upper) * scale + low;
        let nears = min(a, b);
        let fars = max(a, b);
        let near = max(nears.x, max(nears.y, nears.z));
        let far = min(fars.x, min(fars.y, fars.z));
        if (kind == 0u || near > far || far < surface_after.t) { continue; }
        if (near > limit) {
            hit_more = true;
            continue;
        }
        if (((head.w >> (24u + child)) & 1u) == 1u) {
            met.inner |= 1u << child;
        } else {
            met.faces |= (kind >> 5u) << (kind & 31u);
        }
    }
    return met;
}

fn seen_vertex(id: u32) -> Seen {
    return Seen(see(bitcast<vec3<f32>>(surface_vertices[id].xyz)), id);
}

// Takes the hit of a face, if there is one.
fn test_face(face: u32) {
    let vertices = surface_faces[face].xyz;
    let a = seen_vertex(vertices.x);
    let b = seen_vertex(vertices.y);
    let c = seen_vertex(vertices.z);
    // The order is the outward normal's: where the ray leaves the mesh, every edge of it passes on the left.
    let leaving = is_left(a, b);
    if (is_left(b, c) == leaving && is_left(c, a) == leaving) {
        let t = dot(face_weights(a, b, c), vec3<f32>(a.at.z, b.at.z, c.at.z)) * sight.inverse;
        take_hit(Hit(t, 2u * face + select(0u, 1u, leaving)));
    }
}

// Sorts a hit in; the farthest gives way if there is no room.
fn take_hit(hit: Hit) {
    if (!is_after(hit, surface_after)) { return; }
    var place = hit_count;
    if (place == MAX_HITS) {
        hit_more = true;
        place -= 1u;
        if (is_after(hit, hit_at(place))) { return; }
    } else {
        hit_count += 1u;
    }
    while (place > 0u && is_after(hit_at(place - 1u), hit)) {
        hit_t[place] = hit_t[place - 1u];
        hit_word[place] = hit_word[place - 1u];
        place -= 1u;
    }
    hit_t[place] = hit.t;
    hit_word[place] = hit.word;
}
