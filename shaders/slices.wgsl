// Stage: slices. Draws slices through a pyramid of bricks from those that are on the device. Positions are index space: voxel j of level l
// has its middle at 2^l (j + 1/2) - 1/2. The bricks lie side by side in one texture; a table says where each is, or that it is not.

const BRICK: u32 = 64u;
const ABSENT: u32 = 0xffffffffu;

struct SliceLevel {
    // Colour that the level is tinted with.
    tint: vec3<f32>,
    // Where its part of the table begins.
    first: u32,
}

struct SliceLook {
    // Voxels of level 0 along x, y, z.
    dims: vec3<u32>,
    level_count: u32,
    // The value at the beginning of the colours, and 1 over their width.
    low: f32,
    inverse_width: f32,
    // 0: the nearest voxel; 1: trilinear.
    is_smooth: u32,
    // Bits of a voxel: 8, 16, or 32 for floats.
    bits: u32,
    // Added to numbers that are kept as unsigned integers.
    bias: f32,
    // Share of the tint.
    tint: f32,
}

struct SliceQuad {
    // From the plane's own (u, v, 0, 1) to clip space.
    clip_from_plane: mat4x4<f32>,
    // Index position of (u, v) = 0.
    origin: vec3<f32>,
    // Added to the level that a pixel asks for before it is rounded down.
    detail: f32,
    // Index steps of u and v.
    along_u: vec3<f32>,
    // Pixels of the line at the volume's faces.
    border_width: f32,
    along_v: vec3<f32>,
    opacity: f32,
    border: vec4<f32>,
}

@group(0) @binding(0) var<uniform> look: SliceLook;
@group(0) @binding(1) var<storage, read> levels: array<SliceLevel>;
@group(0) @binding(2) var<storage, read> pages: array<u32>;
@group(0) @binding(3) var atlas: texture_3d<u32>;
// Below the range, above it, missing; then evenly over the range. Four bytes each.
@group(0) @binding(4) var<storage, read> colors: array<u32>;
@group(1) @binding(0) var<storage, read> quads: array<SliceQuad>;

// What is the same all over a slice goes along with it: reading it at each pixel takes longer.
struct OnSlice {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) @interpolate(flat) origin_detail: vec4<f32>,
    @location(2) @interpolate(flat) u_width: vec4<f32>,
    @location(3) @interpolate(flat) v_opacity: vec4<f32>,
    @location(4) @interpolate(flat) border: vec4<f32>,
}

// What a point of a slice shows: a number unless it is missing, and the level that it is from; level_count where nothing is resident.
struct Found {
    value: f32,
    is_missing: bool,
    level: u32,
}

@vertex
fn place(@location(0) uv: vec2<f32>, @location(1) number: u32) -> OnSlice {
    let quad = quads[number];
    let position = quad.clip_from_plane * vec4<f32>(uv, 0.0, 1.0);
    let u_width = vec4<f32>(quad.along_u, quad.border_width);
    return OnSlice(position, uv, vec4<f32>(quad.origin, quad.detail), u_width, vec4<f32>(quad.along_v, quad.opacity), quad.border);
}

fn level_dims(level: u32) -> vec3<u32> {
    return (look.dims + ((1u << level) - 1u)) >> vec3<u32>(level);
}

// Where the brick of a voxel is: the number of its place along x in the low ten bits, then y, then z.
fn page(first: u32, bricks: vec3<u32>, voxel: vec3<u32>) -> u32 {
    let brick = voxel / BRICK;
    return pages[first + (brick.z * bricks.y + brick.y) * bricks.x + brick.x];
}

// A voxel's bits.
fn raw(slot: u32, at: vec3<u32>) -> u32 {
    let place = (vec3<u32>(slot) >> vec3<u32>(0u, 10u, 20u)) & vec3<u32>(1023u);
    return textureLoad(atlas, place * BRICK + at % BRICK, 0).r;
}

fn is_missing(bits: u32) -> bool {
    return look.bits == 32u && (bits & 0x7fffffffu) > 0x7f800000u;
}

fn any_missing(bits: vec4<u32>) -> bool {
    return look.bits == 32u && any((bits & vec4<u32>(0x7fffffffu)) > vec4<u32>(0x7f800000u));
}

fn number(bits: u32) -> f32 {
    if look.bits == 32u {
        return bitcast<f32>(bits);
    }
    return f32(bits) + look.bias;
}

fn numbers(bits: vec4<u32>) -> vec4<f32> {
    if look.bits == 32u {
        return bitcast<vec4<f32>>(bits);
    }
    return vec4<f32>(bits) + look.bias;
}

// The value at a point as one level has it. All voxels that it is interpolated from must be resident.
fn at_level(level: u32, point: vec3<f32>) -> Found {
    let absent = Found(0.0, true, look.level_count);
    let first = levels[level].first;
    let dims = level_dims(level);
    let bricks = (dims + (BRICK - 1u)) / BRICK;
    let last = vec3<f32>(dims - 1u);
    let at = clamp((point + 0.5) / f32(1u << level) - 0.5, vec3<f32>(0.0), last);
    if look.is_smooth == 0u {
        let nearest = vec3<u32>(min(floor(at + 0.5), last));
        let slot = page(first, bricks, nearest);
        if slot == ABSENT {
            return absent;
        }
        let bits = raw(slot, nearest);
        return Found(number(bits), is_missing(bits), level);
    }
    let low_f = floor(at);
    let part = at - low_f;
    let a = vec3<u32>(low_f);
    // A voxel without weight is not looked at: it may be missing.
    let b = a + select(vec3<u32>(0u), vec3<u32>(1u), part > vec3<f32>(0.0));
    let baa = vec3<u32>(b.x, a.y, a.z);
    let aba = vec3<u32>(a.x, b.y, a.z);
    let bba = vec3<u32>(b.x, b.y, a.z);
    let aab = vec3<u32>(a.x, a.y, b.z);
    let bab = vec3<u32>(b.x, a.y, b.z);
    let abb = vec3<u32>(a.x, b.y, b.z);
    let own = page(first, bricks, a);
    // Slots of a pair along x, for the four pairs.
    var slot_a = vec4<u32>(own);
    var slot_b = vec4<u32>(own);
    if any(a / BRICK != b / BRICK) {
        slot_a = vec4<u32>(own, page(first, bricks, aba), page(first, bricks, aab), page(first, bricks, abb));
        slot_b = vec4<u32>(page(first, bricks, baa), page(first, bricks, bba), page(first, bricks, bab), page(first, bricks, b));
    }
    if any(slot_a == vec4<u32>(ABSENT)) || any(slot_b == vec4<u32>(ABSENT)) {
        return absent;
    }
    let bits_a = vec4<u32>(raw(slot_a.x, a), raw(slot_a.y, aba), raw(slot_a.z, aab), raw(slot_a.w, abb));
    let bits_b = vec4<u32>(raw(slot_b.x, baa), raw(slot_b.y, bba), raw(slot_b.z, bab), raw(slot_b.w, b));
    let along_x = mix(numbers(bits_a), numbers(bits_b), part.x);
    let along_y = mix(along_x.xz, along_x.yw, part.y);
    return Found(mix(along_y.x, along_y.y, part.z), any_missing(bits_a) || any_missing(bits_b), level);
}

// The value at a point, from the finest resident level that is not finer than a pixel asks for.
fn find(point: vec3<f32>, finest: u32) -> Found {
    for (var level = finest; level < look.level_count; level++) {
        let found = at_level(level, point);
        if found.level != look.level_count {
            return found;
        }
    }
    return Found(0.0, true, look.level_count);
}

// Where a pixel is, index space, and how that changes from a pixel to the next.
struct Place {
    at: vec3<f32>,
    x: vec3<f32>,
    y: vec3<f32>,
}

fn index_place(point: OnSlice) -> Place {
    // Derivatives of what is interpolated, not of what is read: beside a triangle nothing is read.
    let uv = array(point.uv, dpdx(point.uv), dpdy(point.uv));
    let u = point.u_width.xyz;
    let v = point.v_opacity.xyz;
    return Place(point.origin_detail.xyz + uv[0].x * u + uv[0].y * v, uv[1].x * u + uv[1].y * v, uv[2].x * u + uv[2].y * v);
}

// The level whose voxels have the size of a pixel.
fn level_of_pixel(place: Place, detail: f32) -> u32 {
    let level = 0.5 * log2(max(length(cross(place.x, place.y)), 1e-30)) + detail;
    return u32(clamp(floor(level), 0.0, f32(look.level_count - 1u)));
}

fn color_of(found: Found) -> vec4<f32> {
    let x = (found.value - look.low) * look.inverse_width;
    let last = arrayLength(&colors) - 4u;
    var i = 3u + u32(clamp(x, 0.0, 1.0) * f32(last) + 0.5);
    i = select(i, 0u, x < 0.0);
    i = select(i, 1u, x > 1.0);
    i = select(i, 2u, found.is_missing);
    return unpack4x8unorm(colors[i]);
}

@fragment
fn paint(point: OnSlice) -> @location(0) vec4<f32> {
    let place = index_place(point);
    let found = find(place.at, level_of_pixel(place, point.origin_detail.w));
    var color = vec4<f32>(0.0);
    if found.level != look.level_count {
        color = color_of(found);
        if look.tint > 0.0 {
            color = vec4<f32>(mix(color.rgb, levels[found.level].tint, look.tint), color.a);
        }
    }
    // Pixels to the nearest face of the volume that the slice ends at.
    let width = abs(place.x) + abs(place.y);
    let ends = min(place.at + 0.5, vec3<f32>(look.dims) - 0.5 - place.at);
    let is_cut = width > vec3<f32>(1e-6);
    let pixels = select(vec3<f32>(1e30), ends / max(width, vec3<f32>(1e-6)), is_cut);
    if min(pixels.x, min(pixels.y, pixels.z)) < point.u_width.w {
        color = point.border;
    }
    let alpha = color.a * point.v_opacity.w;
    if alpha == 0.0 {
        discard;
    }
    return vec4<f32>(color.rgb * alpha, alpha);
}

// The number, the level it is from (-1: nothing is resident), and whether it is known.
@fragment
fn measure(point: OnSlice) -> @location(0) vec4<f32> {
    let place = index_place(point);
    let found = find(place.at, level_of_pixel(place, point.origin_detail.w));
    let level = select(f32(found.level), -1.0, found.level == look.level_count);
    return vec4<f32>(select(found.value, 0.0, found.is_missing), level, select(1.0, 0.0, found.is_missing), 1.0);
}
