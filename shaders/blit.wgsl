// Brings the finished picture to the screen. The picture is linear when sampled; a screen whose format is not sRGB
// wants it encoded.

@group(0) @binding(0) var picture: texture_2d<f32>;
@group(0) @binding(1) var picture_sampler: sampler;

struct Varying {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
}

@vertex
fn vs(@builtin(vertex_index) index: u32) -> Varying {
    let corner = vec2(f32((index << 1u) & 2u), f32(index & 2u));
    var out: Varying;
    out.position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
    out.uv = vec2(corner.x, 1.0 - corner.y);
    return out;
}

@fragment
fn fs_linear(in: Varying) -> @location(0) vec4<f32> {
    return vec4(textureSample(picture, picture_sampler, in.uv).rgb, 1.0);
}

@fragment
fn fs_encoded(in: Varying) -> @location(0) vec4<f32> {
    let c = textureSample(picture, picture_sampler, in.uv).rgb;
    let low = c * 12.92;
    let high = 1.055 * pow(max(c, vec3(1e-6)), vec3(1.0 / 2.4)) - 0.055;
    return vec4(select(high, low, c <= vec3(0.0031308)), 1.0);
}
