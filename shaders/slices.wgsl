// Stage: slices. Draws slices through a pyramid of bricks from those that are on the device. Positions are index space: voxel j of level l
// has its middle at 2^l (j + 1/2) - 1/2. The bricks lie side by side in one texture; a table says where each is, or that it is not.

const BRICK: u32 = 64u;
const ABSENT: u32 = 0xffffffffu;

struct SliceLevel {
    // Voxels along x, y, z.
    dims: vec3<u32>,
    // Where its part of the table begins.
    first: u32,
    // Bricks along x, y, z.
    bricks: vec3<u32>,
    // Share of the tint.
    amount: f32,
    // Colour that the level is tinted with.
    tint: vec3<f32>,
}

struct SliceLook {
    // The value at the beginning of the colours, and 1 over their width.
    low: f32,
    inverse_width: f32,
    // 0: the nearest voxel; 1: trilinear.
    is_smooth: u32,
    // Added to numbers that are kept as unsigned integers.
    bias: f32,
    // Bricks along x and y of the texture.
    across: vec2<u32>,
    level_count: u32,
    // Bits of a voxel: 8, 16, or 32 for floats.
    bits: u32,
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
// Below the range, above it, missing; then evenly over the range.
@group(0) @binding(4) var<storage, read> colors: array<vec4<f32>>;
@group(1) @binding(0) var<storage, read> quads: array<SliceQuad>;

struct OnSlice {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
    @location(1) @interpolate(flat) quad: u32,
}

// What a point of a slice shows: a number unless it is missing, and the level that it is from; level_count where nothing is resident.
struct Found {
    value: f32,
    is_missing: bool,
    level: u32,
}

@vertex
fn place(@location(0) uv: vec2<f32>, @location(1) quad: u32) -> OnSlice {
    return OnSlice(quads[quad].clip_from_plane * vec4<f32>(uv, 0.0, 1.0), uv, quad);
}

fn page(level: u32, brick: vec3<u32>) -> u32 {
    let n = levels[level].bricks;
    return pages[levels[level].first + (brick.z * n.y + brick.y) * n.x + brick.x];
}

// A voxel's bits; `slot` is where its brick is.
fn raw(slot: u32, at: vec3<u32>) -> u32 {
    let place = vec3<u32>(slot % look.across.x, slot / look.across.x % look.across.y, slot / (look.across.x * look.across.y));
    return textureLoad(atlas, place * BRICK + at % BRICK, 0).r;
}

fn is_missing(bits: u32) -> bool {
    return look.bits == 32u && (bits & 0x7fffffffu) > 0x7f800000u;
}

fn number(bits: u32) -> f32 {
    if look.bits == 32u {
        return bitcast<f32>(bits);
    }
    return f32(bits) + look.bias;
}

// The value at a point as one level has it. All voxels that it is interpolated from must be resident.
fn at_level(level: u32, point: vec3<f32>) -> Found {
    let absent = Found(0.0, true, look.level_count);
    let last = vec3<f32>(levels[level].dims - 1u);
    let at = clamp((point + 0.5) / f32(1u << level) - 0.5, vec3<f32>(0.0), last);
    if look.is_smooth == 0u {
        let nearest = vec3<u32>(min(floor(at + 0.5), last));
        let slot = page(level, nearest / BRICK);
        if slot == ABSENT {
            return absent;
        }
        let bits = raw(slot, nearest);
        return Found(number(bits), is_missing(bits), level);
    }
    let low_f = floor(at);
    let part = at - low_f;
    let low = vec3<u32>(low_f);
    // A voxel without weight is not looked at: it may be missing.
    let high = low + select(vec3<u32>(0u), vec3<u32>(1u), part > vec3<f32>(0.0));
    let low_brick = low / BRICK;
    let is_within = all(low_brick == high / BRICK);
    let own = page(level, low_brick);
    if own == ABSENT {
        return absent;
    }
    var bits: array<u32, 8>;
    for (var i = 0u; i < 8u; i++) {
        let corner = select(low, high, vec3<bool>((i & 1u) != 0u, (i & 2u) != 0u, (i & 4u) != 0u));
        var slot = own;
        if !is_within {
            slot = page(level, corner / BRICK);
            if slot == ABSENT {
                return absent;
            }
        }
        bits[i] = raw(slot, corner);
    }
    var missing = false;
    for (var i = 0u; i < 8u; i++) {
        missing = missing || is_missing(bits[i]);
    }
    let near = mix(mix(number(bits[0]), number(bits[1]), part.x), mix(number(bits[2]), number(bits[3]), part.x), part.y);
    let far = mix(mix(number(bits[4]), number(bits[5]), part.x), mix(number(bits[6]), number(bits[7]), part.x), part.y);
    return Found(mix(near, far, part.z), missing, level);
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
    let u = quads[point.quad].along_u;
    let v = quads[point.quad].along_v;
    return Place(quads[point.quad].origin + uv[0].x * u + uv[0].y * v, uv[1].x * u + uv[1].y * v, uv[2].x * u + uv[2].y * v);
}

// The level whose voxels have the size of a pixel.
fn level_of_pixel(place: Place, detail: f32) -> u32 {
    let level = 0.5 * log2(max(length(cross(place.x, place.y)), 1e-30)) + detail;
    return u32(clamp(floor(level), 0.0, f32(look.level_count - 1u)));
}

fn color_of(value: f32) -> vec4<f32> {
    let x = (value - look.low) * look.inverse_width;
    if x < 0.0 {
        return colors[0];
    }
    if x > 1.0 {
        return colors[1];
    }
    let last = arrayLength(&colors) - 4u;
    let at = x * f32(last);
    let i = min(u32(at), last - 1u);
    return mix(colors[3u + i], colors[4u + i], at - f32(i));
}

@fragment
fn paint(point: OnSlice) -> @location(0) vec4<f32> {
    let place = index_place(point);
    let found = find(place.at, level_of_pixel(place, quads[point.quad].detail));
    var color = vec4<f32>(0.0);
    if found.level != look.level_count {
        color = colors[2];
        if !found.is_missing {
            color = color_of(found.value);
        }
        let amount = levels[found.level].amount;
        color = vec4<f32>(mix(color.rgb, levels[found.level].tint, amount), color.a);
    }
    // Pixels to the nearest face of the volume that the slice ends at.
    let width = abs(place.x) + abs(place.y);
    let ends = min(place.at + 0.5, vec3<f32>(levels[0].dims) - 0.5 - place.at);
    let is_cut = width > vec3<f32>(1e-6);
    let pixels = select(vec3<f32>(1e30), ends / max(width, vec3<f32>(1e-6)), is_cut);
    if min(pixels.x, min(pixels.y, pixels.z)) < quads[point.quad].border_width {
        color = quads[point.quad].border;
    }
    let alpha = color.a * quads[point.quad].opacity;
    if alpha == 0.0 {
        discard;
    }
    return vec4<f32>(color.rgb * alpha, alpha);
}

// The number, the level it is from (-1: nothing is resident), and whether it is known.
@fragment
fn measure(point: OnSlice) -> @location(0) vec4<f32> {
    let place = index_place(point);
    let found = find(place.at, level_of_pixel(place, quads[point.quad].detail));
    let level = select(f32(found.level), -1.0, found.level == look.level_count);
    return vec4<f32>(select(found.value, 0.0, found.is_missing), level, select(1.0, 0.0, found.is_missing), 1.0);
}
