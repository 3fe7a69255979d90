// The entry point of every march. A stage says how a ray is marched: `march` gives the samples taken.

// Lane i of a workgroup marches pixel (i mod tile, i / tile) of a square tile.
override tile: u32 = 8u;

@compute @workgroup_size(tile, tile)
fn main(@builtin(global_invocation_id) pixel: vec3<u32>, @builtin(local_invocation_index) lane: u32) {
    var light = dark();
    var samples = 0u;
    let ray = enter(pixel_ray(pixel.xy));
    var color = missed();
    if (ray.t_out > 0.0 && in_image(pixel.xy)) {
        start_passing(ray, pixel.xy);
        samples = march(ray, pixel.xy, &light);
        color = finished(ray, light);
    }
    write_pixel(pixel.xy, color);
    count_samples(samples, lane);
}
