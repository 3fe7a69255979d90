// Phong's reflection: how much of a place's own colour is seen, and how much white is added. src/optics/phong.rs says more.

struct Lit {
    own: f32,
    white: f32,
}

// A place that faces along or against a normal.
fn lit_facing(normal: vec3<f32>, to_eye: vec3<f32>) -> Lit {
    let to_light = select(style.to_light, to_eye, all(style.to_light == vec3<f32>(0.0)));
    let along = dot(normal, to_light);
    let reflected = clamp(dot(2.0 * along * normal - to_light, to_eye), 0.0, 1.0);
    var white = 0.0;
    if (along * dot(normal, to_eye) > 0.0 && reflected > 0.0) { white = style.specular * pow(reflected, style.shininess); }
    return Lit(style.ambient + style.diffuse * abs(along), white);
}

// A place in the volume: facing nothing as far as the gradient is small.
fn lit_gradient(gradient: vec3<f32>, to_eye: vec3<f32>) -> Lit {
    let squared = dot(gradient, gradient);
    if (squared <= 0.0) { return Lit(1.0, 0.0); }
    let lit = lit_facing(gradient / sqrt(squared), to_eye);
    let share = squared / (squared + style.gradient_floor * style.gradient_floor);
    return Lit(1.0 + share * (lit.own - 1.0), share * lit.white);
}

// The light after a stretch that was passed as if it were not shaded.
fn relit(lit: Lit, before: Light, after: Light) -> Light {
    let alpha = before.transmittance - after.transmittance;
    return Light(before.color + lit.own * (after.color - before.color) + lit.white * alpha, after.transmittance);
}
