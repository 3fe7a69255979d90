// What rays make of values.

// What a pixel shows.
const COMPOSITE: u32 = 0u;
const ISO: u32 = 1u;
const MAXIMUM: u32 = 2u;
const MINIMUM: u32 = 3u;
const MEAN: u32 = 4u;
const INTEGRAL: u32 = 5u;
override mode: u32 = 0u;

// Whether there are surfaces: isosurfaces, so many of them, or planes that are drawn; and whether the volume and they are shaded.
override with_surfaces: bool = false;
override isosurfaces: u32 = 0u;
override shade_volume: bool = false;
override shade_surfaces: bool = false;
// Whether pixels are what of rays is no colour.
override as_numbers: bool = false;

const MOST_SURFACES: u32 = 8u;

// A surface on which the field has one value.
struct Surface {
    color: vec3<f32>,
    opacity: f32,
    value: f32,
}

struct Style {
    surfaces: array<Surface, MOST_SURFACES>,
    // 0 if light comes from the eye.
    to_light: vec3<f32>,
    surface_count: u32,
    ambient: f32,
    diffuse: f32,
    specular: f32,
    shininess: f32,
    // From a ray's number to the value whose colour it has.
    scale: f32,
    of_product: f32,
    of_length: f32,
    offset: f32,
    gradient_floor: f32,
    // Of boundary faces: whether edges are drawn (1 or 0), whether they have the colours of the values on them, else their own, and opacity.
    face_edges: f32,
    face_values: f32,
    face_color: vec3<f32>,
    face_opacity: f32,
}

@group(0) @binding(23) var<uniform> style: Style;
