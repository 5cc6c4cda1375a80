// The backdrop: a vertical gradient, dithered by half a step of 8-bit sRGB so that it shows no bands.

@vertex
fn vs(@builtin(vertex_index) index: u32) -> @builtin(position) vec4<f32> {
    let corner = vec2(f32((index << 1u) & 2u), f32(index & 2u));
    return vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}

@fragment
fn fs(@builtin(position) at: vec4<f32>) -> @location(0) vec4<f32> {
    // Interleaved gradient noise (Jimenez 2014).
    let noise = fract(52.9829189 * fract(dot(at.xy, vec2(0.06711056, 0.00583715)))) - 0.5;
    let color = background(at.y);
    // One step of 8-bit sRGB in linear light, near this brightness.
    let step = max(sqrt(color), vec3(0.03)) * 2.0 / 255.0;
    return vec4(color + noise * step, 1.0);
}
