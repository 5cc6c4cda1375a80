// What every pass of the scene shares: the frame, and one item of it. Concatenated before the other files.
// Eye space: the eye at the origin, x right, y up, looking along -z. Depth is reversed: 1 near, 0 far.

struct Frame {
    projection: mat4x4<f32>,
    // Width, height in pixels, and their inverses.
    viewport: vec4<f32>,
    // Section plane in eye space: what has dot(plane.xyz, p) + plane.w > 0 is removed.
    section: vec4<f32>,
    background_top: vec4<f32>,
    background_bottom: vec4<f32>,
    // x: eye-space size of one pixel per unit of clip w. y: 1 if orthographic. z: pixels per point.
    pixel: vec4<f32>,
    // x: surface mode (MODE_*). y: 1 with zebra. w: 1 with a section plane.
    flags: vec4<u32>,
}

const MODE_SHADED: u32 = 0u;
const MODE_HIDDEN_LINE: u32 = 1u;
const MODE_XRAY: u32 = 2u;

struct Item {
    model_view: mat4x4<f32>,
    // Linear, not premultiplied.
    color: vec4<f32>,
    // Surfaces: colour of the back.
    back: vec4<f32>,
    // x: 1 when the section plane cuts it. Lines: y half width, z and w stroke and gap, all in pixels.
    a: vec4<f32>,
    // Lines: x pixels per unit of arc length, y half distance of a double stroke in pixels, z pull towards the eye
    // in pixels.
    b: vec4<f32>,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(1) @binding(0) var<uniform> item: Item;

fn background(y: f32) -> vec3<f32> {
    // Smoothstep keeps the horizon of the gradient invisible.
    let t = y * frame.viewport.w;
    return mix(frame.background_top.rgb, frame.background_bottom.rgb, t * t * (3.0 - 2.0 * t));
}

// Signed distance to the section plane, positive where removed; negative everywhere without one.
fn section_distance(eye: vec3<f32>) -> f32 {
    if frame.flags.w == 0u || item.a.x == 0.0 {
        return -1.0;
    }
    return dot(frame.section.xyz, eye) + frame.section.w;
}

// Clip-space depth over w of an eye-space point pulled `pixels` pixels' worth towards the eye: what is drawn on a
// surface wins against it, at any zoom and any distance.
fn pulled_depth(eye: vec3<f32>, pixels: f32) -> f32 {
    let step = pixels * frame.pixel.x;
    let toward = select(eye * (1.0 - step), eye + vec3(0.0, 0.0, step), frame.pixel.y > 0.0);
    let clip = frame.projection * vec4(toward, 1.0);
    return clip.z / clip.w;
}
