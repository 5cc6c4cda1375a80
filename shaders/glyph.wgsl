// Points as screen-constant glyphs: signed distance shapes with a thin contrasting rim.

struct Varying {
    @builtin(position) position: vec4<f32>,
    @location(0) at: vec2<f32>,
    @location(1) @interpolate(flat) color: vec4<f32>,
    // x: half size in pixels. y: shape.
    @location(2) @interpolate(flat) form: vec2<f32>,
}

const ROUND: u32 = 0u;
const RING: u32 = 1u;
const CROSS: u32 = 2u;
const DIAMOND: u32 = 3u;
const SQUARE: u32 = 4u;
const TRIANGLE: u32 = 5u;
const ARROW: u32 = 6u;

@vertex
fn vs(
    @builtin(vertex_index) index: u32,
    @location(0) position: vec3<f32>,
    @location(1) size: f32,
    @location(2) direction: vec3<f32>,
    @location(3) shape: u32,
    @location(4) color: vec4<f32>,
) -> Varying {
    var out: Varying;
    out.position = vec4(2.0, 2.0, 2.0, 1.0);
    let eye = (item.model_view * vec4(position, 1.0)).xyz;
    let clip = frame.projection * vec4(eye, 1.0);
    if clip.w <= clip.z || section_distance(eye) > 0.0 {
        return out;
    }
    let half = 0.5 * size * frame.pixel.z;
    let corner = vec2(f32(index & 1u), f32(index >> 1u)) * 2.0 - 1.0;
    let local = corner * (half + 2.5);
    // The glyph's x axis in screen space (y up): upright without a direction.
    var axis = vec2(1.0, 0.0);
    if dot(direction, direction) > 0.0 {
        let turned = (item.model_view * vec4(direction, 0.0)).xyz;
        // Derivative of the projection along the direction.
        let moved = frame.projection * vec4(turned, 0.0);
        let flow = (moved.xy * clip.w - clip.xy * moved.w) * frame.viewport.xy;
        if length(flow) > 1e-9 {
            axis = normalize(flow);
        }
    }
    let offset = axis * local.x + vec2(-axis.y, axis.x) * local.y;
    let ndc = clip.xy / clip.w + offset * 2.0 * frame.viewport.zw;
    out.position = vec4(ndc, clamp(pulled_depth(eye, item.b.z + half), 0.0, 1.0), 1.0);
    out.at = local;
    out.color = color;
    out.form = vec2(half, f32(shape));
    return out;
}

fn box(p: vec2<f32>, h: f32) -> f32 {
    let d = abs(p) - h;
    return length(max(d, vec2(0.0))) + min(max(d.x, d.y), 0.0);
}

// Signed distance in pixels to the outline of a glyph of half size r; negative inside.
fn outline(shape: u32, p: vec2<f32>, r: f32) -> f32 {
    let stroke = max(0.16 * r, 0.75);
    switch shape {
        case RING: { return abs(length(p) - r + stroke) - stroke; }
        case CROSS: {
            let q = abs(vec2(p.x + p.y, p.x - p.y)) * 0.70710678;
            return max(min(q.x, q.y) - stroke, max(q.x, q.y) - r);
        }
        case DIAMOND: { return (abs(p.x) + abs(p.y) - r) * 0.70710678; }
        case SQUARE: { return box(p, r * 0.82); }
        case TRIANGLE: {
            let q = vec2(abs(p.x), p.y + 0.30 * r);
            return max(dot(q, vec2(0.8660254, 0.5)) - 0.60 * r, -q.y - 0.32 * r + 0.0);
        }
        case ARROW: {
            let q = vec2(p.x, abs(p.y));
            let head = dot(q - vec2(r, 0.0), vec2(0.42, 0.907));
            // A notch at the tail.
            let tail = -(q.x + 0.75 * r - 0.45 * (r - q.y) + 0.0) * 0.9;
            return max(head, tail);
        }
        default: { return length(p) - r; }
    }
}

@fragment
fn fs(in: Varying) -> @location(0) vec4<f32> {
    let d = outline(u32(in.form.y), in.at, in.form.x);
    let fill = clamp(0.5 - d, 0.0, 1.0);
    let rim = clamp(1.6 - d, 0.0, 1.0);
    // The rim contrasts with the glyph, so that it is seen on any ground.
    let luma = dot(in.color.rgb, vec3(0.2126, 0.7152, 0.0722));
    let ink = select(vec3(1.0), vec3(0.015), luma > 0.25);
    let opacity = in.color.a * item.color.a;
    let alpha = max(fill, rim * 0.75) * opacity;
    if alpha < 0.002 {
        discard;
    }
    return vec4(mix(ink, in.color.rgb, fill) * alpha, alpha);
}
