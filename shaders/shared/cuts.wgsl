// Where rays are cut into parts, and what is noted of a part.

// The t at which part i of a ray begins, and the one before ends: a ray is halved by a plane, or cut into equal parts.
fn cut(ray: Ray, i: u32) -> f32 {
    if (i == 0u) { return 0.0; }
    if (i >= parts) { return ray.t_out; }
    if (frame.split_axis == 3u) { return ray.t_out * (f32(i) / f32(parts)); }
    let t = (vec3<f32>(frame.split_position) - ray.origin) * ray.inverse;
    let across = select(select(t.z, t.y, frame.split_axis == 1u), t.x, frame.split_axis == 0u);
    return clamp(across, 0.0, ray.t_out);
}

// The words of a part from begin to end, t >= 0; 0 if that is nothing.
fn part_from(begin: f32, end: f32) -> vec2<u32> {
    return select(vec2<u32>(0u), vec2<u32>(~(bitcast<u32>(begin) & 0x7fffffffu), bitcast<u32>(end)), begin < end);
}
