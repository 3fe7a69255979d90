// Pixels, and the number of samples of the whole image.

// Samples of all workgroups, 64 bits: low half, high half.
struct Counter {
    low: atomic<u32>,
    high: atomic<u32>,
}

@group(0) @binding(5) var image: texture_storage_2d<rgba32float, write>;
@group(0) @binding(6) var<storage, read_write> counter: Counter;

var<workgroup> group_samples: atomic<u32>;

// Premultiplied linear RGBA, or what of the ray is no colour.
fn write_pixel(pixel: vec2<u32>, color: vec4<f32>) {
    if (in_image(pixel)) { textureStore(image, pixel, color); }
}

// Adds every lane's samples to the image's; all lanes of a workgroup call it.
fn count_samples(samples: u32, lane: u32) {
    atomicAdd(&group_samples, samples);
    workgroupBarrier();
    if (lane == 0u) {
        let added = atomicLoad(&group_samples);
        let before = atomicAdd(&counter.low, added);
        if (before + added < before) { atomicAdd(&counter.high, 1u); }
    }
}
