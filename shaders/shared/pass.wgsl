// What a ray makes of the values on its way. A stage says where a surface is met in a piece (`meet`), which way the field rises where
// values jump (`jump_gradient`), and how near a place on a plane is to an edge of the mesh (`edge_on_plane`).
// #import shared/style.wgsl
// #import shared/phong.wgsl
// #import shared/faces.wgsl

// A stretch of a ray over which the field goes linearly from one value to another.
struct Piece {
    // Where it begins and ends, in t.
    span: vec2<f32>,
    // The values there.
    ends: vec2<f32>,
    // In cube edges.
    length: f32,
    // Where the volume is shaded: normalised values per cube edge.
    gradient: vec3<f32>,
}

// How dark an edge is.
const EDGE_INK: f32 = 0.8;

// Where a ray meets a surface, and the field's gradient there.
struct Meeting {
    t: f32,
    gradient: vec3<f32>,
}

// The pixel that the ray is of.
var<private> ray_pixel: vec2<u32>;
// The largest value, the smallest, or the integral; below 0 before anything was met.
var<private> ray_number: f32;
// The length of what was passed, in cube edges.
var<private> passed_length: f32;
// Where the first surface is; FAR before there is one.
var<private> surface_t: f32;
// The last value, where what comes next continues it.
var<private> last_value: f32;
var<private> has_last: bool;
// Where the ray meets each plane that is drawn, still ahead; FAR for others.
var<private> cut_t: array<f32, MOST_PLANES>;

fn start_passing(ray: Ray, pixel: vec2<u32>) {
    ray_pixel = pixel;
    ray_number = -1.0;
    passed_length = 0.0;
    surface_t = FAR;
    has_last = false;
    way_out.t = FAR;
    if (with_surfaces) {
        for (var i = 0u; i < MOST_PLANES; i += 1u) {
            let plane = frame.cuts[i];
            let along = dot(plane.xyz, ray.direction);
            cut_t[i] = FAR;
            if (i < cut_planes && along != 0.0) { cut_t[i] = (plane.w - dot(plane.xyz, ray.origin)) / along; }
        }
    }
}

// What comes next does not continue what was passed last.
fn forget_last() {
    has_last = false;
}

// Whether values between these add nothing.
fn is_beneath(least: f32, most: f32) -> bool {
    return (mode == MAXIMUM && most <= ray_number) || (mode == MINIMUM && ray_number >= 0.0 && least >= ray_number);
}

fn pass_piece(ray: Ray, piece: Piece, light: ptr<function, Light>) {
    if (mode == MAXIMUM) {
        ray_number = max(ray_number, max(piece.ends.x, piece.ends.y));
    } else if (mode == MINIMUM) {
        let least = min(piece.ends.x, piece.ends.y);
        ray_number = select(min(ray_number, least), least, ray_number < 0.0);
    } else if (mode == MEAN || mode == INTEGRAL) {
        ray_number = max(ray_number, 0.0) + 0.5 * (piece.ends.x + piece.ends.y) * piece.length;
        passed_length += piece.length;
    } else if (with_surfaces) {
        pass_cuts(ray, piece, light);
    } else {
        add_part(ray, piece, light);
    }
}

// Whether a value is passed on the way from one to another.
fn is_between(front: f32, back: f32, value: f32) -> bool {
    return (front < value) != (back < value);
}

// Passes a piece, cut at each plane in it that is drawn, in the order of the ray.
fn pass_cuts(ray: Ray, piece: Piece, light: ptr<function, Light>) {
    var rest = piece;
    loop {
        var next = MOST_PLANES;
        var t = rest.span.y;
        for (var i = 0u; i < cut_planes; i += 1u) {
            if (cut_t[i] >= rest.span.x && cut_t[i] < t) {
                next = i;
                t = cut_t[i];
            }
        }
        if (next == MOST_PLANES) { break; }
        cut_t[next] = FAR;
        let value = rest.ends.x + (rest.ends.y - rest.ends.x) * ((t - rest.span.x) / (rest.span.y - rest.span.x));
        pass_surfaces(ray, piece_part(rest, vec2<f32>(rest.span.x, t), vec2<f32>(rest.ends.x, value)), light);
        add_plane(ray, next, t, value, light);
        if ((*light).transmittance < frame.min_transmittance) { return; }
        rest = piece_part(rest, vec2<f32>(t, rest.span.y), vec2<f32>(value, rest.ends.y));
    }
    pass_surfaces(ray, rest, light);
}

// Adds a plane that is drawn, in the colour of the value on it.
fn add_plane(ray: Ray, i: u32, t: f32, value: f32, light: ptr<function, Light>) {
    let look = frame.cut_looks[i];
    var color = classify(interval_of(value), value).color;
    if (look.y > 0.0) { color *= 1.0 - EDGE_INK * edge_on_plane(ray, t, i); }
    (*light).color += ((*light).transmittance * look.x) * color;
    (*light).transmittance *= 1.0 - look.x;
}

// Passes a piece, cut at each surface in it, in the order of the ray.
fn pass_surfaces(ray: Ray, piece: Piece, light: ptr<function, Light>) {
    let count = isosurfaces;
    let front = piece.ends.x;
    let back = piece.ends.y;
    // Where the value jumps: at faces between leaves of one value each, and by rounding.
    if (has_last) {
        for (var k = 0u; k < count; k += 1u) {
            let i = select(count - 1u - k, k, front > last_value);
            if (is_between(last_value, front, style.surfaces[i].value)) {
                add_surface(ray, i, Meeting(piece.span.x, jump_gradient(ray, piece.span.x)), light);
            }
        }
    }
    last_value = back;
    has_last = true;
    var t = piece.span.x;
    var value = front;
    for (var k = 0u; k < count; k += 1u) {
        let i = select(count - 1u - k, k, back > front);
        let of_surface = style.surfaces[i].value;
        if (is_between(front, back, of_surface)) {
            let met = meet(ray, piece, of_surface);
            let t_hit = clamp(met.t, t, piece.span.y);
            add_part(ray, piece_part(piece, vec2<f32>(t, t_hit), vec2<f32>(value, of_surface)), light);
            add_surface(ray, i, Meeting(t_hit, met.gradient), light);
            if ((*light).transmittance < frame.min_transmittance) { return; }
            t = t_hit;
            value = of_surface;
        }
    }
    if (t > piece.span.x) {
        add_part(ray, piece_part(piece, vec2<f32>(t, piece.span.y), vec2<f32>(value, back)), light);
    } else {
        add_part(ray, Piece(piece.span, vec2<f32>(value, back), piece.length, piece.gradient), light);
    }
}

fn piece_part(piece: Piece, span: vec2<f32>, ends: vec2<f32>) -> Piece {
    let whole = piece.span.y - piece.span.x;
    var share = 0.0;
    if (whole > 0.0) { share = (span.y - span.x) / whole; }
    return Piece(span, ends, piece.length * share, piece.gradient);
}

// Adds the light of a piece.
fn add_part(ray: Ray, piece: Piece, light: ptr<function, Light>) {
    if (mode != COMPOSITE || (with_surfaces && piece.length <= 0.0)) { return; }
    let before = *light;
    add_light(light, piece.ends.x, piece.ends.y, piece.length);
    if (shade_volume) { *light = relit(lit_gradient(piece.gradient, to_eye(ray)), before, *light); }
}

// Adds a surface.
fn add_surface(ray: Ray, i: u32, at: Meeting, light: ptr<function, Light>) {
    let surface = style.surfaces[i];
    var lit = Lit(1.0, 0.0);
    if (shade_surfaces && dot(at.gradient, at.gradient) > 0.0) { lit = lit_facing(normalize(at.gradient), to_eye(ray)); }
    (*light).color += ((*light).transmittance * surface.opacity) * (surface.color * lit.own + lit.white);
    (*light).transmittance *= 1.0 - surface.opacity;
    surface_t = min(surface_t, at.t);
}

// The pixel.
fn finished(ray: Ray, light: Light) -> vec4<f32> {
    let is_sum = mode == MEAN || mode == INTEGRAL;
    var number = ray_number;
    if (is_sum && passed_length > 0.0) { number = ray_number / passed_length; }
    if (as_numbers) {
        let is_hit = surface_t < FAR;
        return vec4<f32>(number, passed_length, select(0.0, (surface_t - ray.t_eye) * ray.length, is_hit), select(0.0, 1.0, is_hit));
    }
    if (mode == COMPOSITE || mode == ISO) { return vec4<f32>(light.color, 1.0 - light.transmittance); }
    if (number < 0.0 || (is_sum && passed_length <= 0.0)) { return vec4<f32>(0.0); }
    let value = clamp(style.scale * number + (style.of_product * number + style.of_length) * passed_length + style.offset, 0.0, 1.0);
    return vec4<f32>(classify(interval_of(value), value).color, 1.0);
}

// The pixel of a ray that misses the cube.
fn missed() -> vec4<f32> {
    if (as_numbers) { return vec4<f32>(-1.0, 0.0, 0.0, 0.0); }
    return vec4<f32>(0.0);
}
