// A ray through the root cube and the cells it crosses, in integer coordinates on the grid of the deepest level: no cell is missed or
// visited twice, and each step leaves another face behind. src/cpu/ray.rs says more.

// Direction components smaller than this are taken as 0.
const PARALLEL: f32 = 1e-12;
// Stands for infinity.
const FAR: f32 = 1e30;

// A ray inside the root cube, from t = 0 where it enters the cube, or at the eye, to t_out (0 if it misses).
struct Ray {
    origin: vec3<f32>,
    direction: vec3<f32>,
    length: f32,
    inverse: vec3<f32>,
    t_out: f32,
    // Where the eye is, at most 0.
    t_eye: f32,
}

// Lowest corner and edge on the grid of the deepest level.
struct Cell {
    low: vec3<u32>,
    size: u32,
}

// 1 / x after a step of Newton's method, which makes of an approximate quotient the nearest f32.
fn reciprocal(x: vec3<f32>) -> vec3<f32> {
    let r = 1.0 / x;
    return r + r * mul_add(-x, r, vec3<f32>(1.0));
}

// Cuts a ray to the root cube.
fn enter(ray: CubeRay) -> Ray {
    let parallel = abs(ray.direction) < vec3<f32>(PARALLEL);
    let direction = select(ray.direction, vec3<f32>(0.0), parallel);
    let inverse = reciprocal(select(direction, vec3<f32>(1.0 / FAR), parallel));

    let to_low = -ray.origin * inverse;
    let to_high = (1.0 - ray.origin) * inverse;
    let nears = select(min(to_low, to_high), vec3<f32>(-FAR), parallel);
    let fars = select(max(to_low, to_high), vec3<f32>(FAR), parallel);
    var near = max(max(nears.x, max(nears.y, nears.z)), ray.t_eye);
    var far = min(fars.x, min(fars.y, fars.z));
    for (var i = 0u; i < frame.clip_count; i += 1u) {
        let plane = frame.clips[i];
        let along = dot(plane.xyz, direction);
        let before = plane.w - dot(plane.xyz, ray.origin);
        if (along > 0.0) {
            near = max(near, before / along);
        } else if (along < 0.0) {
            far = min(far, before / along);
        } else if (before > 0.0) {
            far = -FAR;
        }
    }
    let beside = any(parallel & ((ray.origin < vec3<f32>(0.0)) | (ray.origin >= vec3<f32>(1.0))));

    // From here on t counts from the entry: it keeps its precision however far the eye is.
    let origin = mul_add(direction, vec3<f32>(near), ray.origin);
    let side = select(vec3<f32>(0.0), vec3<f32>(1.0), direction >= vec3<f32>(0.0));
    let leaving = (side - origin) * inverse;
    var t_out = max(min(leaving.x, min(leaving.y, leaving.z)), 0.0);
    if (frame.clip_count > 0u) { t_out = min(t_out, max(far - near, 0.0)); }
    return Ray(origin, direction, ray.length, inverse, select(t_out, 0.0, beside || near >= far), ray.t_eye - near);
}

// The unit vector towards the eye.
fn to_eye(ray: Ray) -> vec3<f32> {
    return -ray.direction / ray.length;
}

// 1 / |direction| within 2^-11, the same on every processor: the largest number of 12 bits that is at most the one asked for, of the
// direction's highest 12 bits. All products are exact; an approximate square root would place all samples of a ray differently.
fn inverse_length(ray: Ray) -> f32 {
    const LAST_BIT = 0x1000u;
    let d = high_bits(ray.direction);
    let squared = d.x * d.x + d.y * d.y + d.z * d.z;
    let low = bitcast<u32>(inverseSqrt(squared)) & ~(LAST_BIT - 1u);
    if (is_at_most_inverse_root(low + LAST_BIT, squared)) { return bitcast<f32>(low + LAST_BIT); }
    if (is_at_most_inverse_root(low, squared)) { return bitcast<f32>(low); }
    return bitcast<f32>(low - LAST_BIT);
}

fn is_at_most_inverse_root(bits: u32, squared: f32) -> bool {
    let k = bitcast<f32>(bits);
    return mul_add(vec3<f32>(k * k), vec3<f32>(squared), vec3<f32>(-1.0)).x <= 0.0;
}

// Coordinates of the finest cell at t, clamped to a cell.
fn cell_at(ray: Ray, t: f32, within: Cell, cells: u32) -> vec3<u32> {
    let position = mul_add(ray.direction, vec3<f32>(t), ray.origin) * f32(cells);
    return clamp(vec3<u32>(max(position, vec3<f32>(0.0))), within.low, within.low + (within.size - 1u));
}

// Where in a cell the ray is at t, in cells from its lowest corner.
fn within(ray: Ray, t: f32, cell: Cell, cells: u32) -> vec3<f32> {
    let position = (ray.origin + ray.direction * t) * f32(cells);
    return clamp((position - vec3<f32>(cell.low)) / f32(cell.size), vec3<f32>(0.0), vec3<f32>(1.0));
}

// t of the planes through which the ray enters a cell, the last of them.
fn entry(ray: Ray, cell: Cell) -> f32 {
    let low = vec3<f32>(select(cell.low + cell.size, cell.low, ray.direction >= vec3<f32>(0.0)));
    let t = (low * frame.cell_edge - ray.origin) * ray.inverse;
    let nears = select(t, vec3<f32>(-FAR), ray.direction == vec3<f32>(0.0));
    return max(nears.x, max(nears.y, nears.z));
}

// t of the planes through which the ray leaves a cell, per axis.
fn exits(ray: Ray, cell: Cell) -> vec3<f32> {
    return exits_of(ray, cell.low, cell.low + cell.size);
}

// The same of a box from its lowest cell to, not included, its highest.
fn exits_of(ray: Ray, low: vec3<u32>, high: vec3<u32>) -> vec3<f32> {
    let far = vec3<f32>(select(low, high, ray.direction >= vec3<f32>(0.0)));
    return (far * frame.cell_edge - ray.origin) * ray.inverse;
}

// Coordinates of the finest cell beyond the face through which the ray leaves a cell; at `cells` or wrapped below 0 once outside.
fn step_out(ray: Ray, cell: Cell, leaving: vec3<f32>, t: f32, cells: u32) -> vec3<u32> {
    return step_out_of(ray, cell.low, cell.low + cell.size, leaving, t, cells);
}

fn step_out_of(ray: Ray, low: vec3<u32>, high: vec3<u32>, leaving: vec3<f32>, t: f32, cells: u32) -> vec3<u32> {
    let inside = clamp(cell_at(ray, t, Cell(vec3<u32>(0u), cells), cells), low, high - 1u);
    let beyond = select(low - 1u, high, ray.direction >= vec3<f32>(0.0));
    if (leaving.x <= t) { return vec3<u32>(beyond.x, inside.y, inside.z); }
    if (leaving.y <= t) { return vec3<u32>(inside.x, beyond.y, inside.z); }
    return vec3<u32>(inside.x, inside.y, beyond.z);
}
