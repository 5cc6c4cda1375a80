// Boxes swept by spheres, instanced: solid (a template sphere pulled apart into eight corners) and as silhouettes
// (the outline of the projection moved out by the radius, drawn in screen space, two triangles each).

struct Varying {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) eye: vec3<f32>,
    @location(1) normal: vec3<f32>,
    @location(2) @interpolate(flat) color: vec4<f32>,
}

fn linear(c: vec3<f32>) -> vec3<f32> {
    return select(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, c <= vec3(0.04045));
}

@vertex
fn vs(
    @location(0) center: vec4<f32>,
    @location(1) u: vec4<f32>,
    @location(2) v: vec4<f32>,
    @location(3) half: f32,
    @location(4) color: vec4<f32>,
    @location(5) normal: vec3<f32>,
    @location(6) corner: vec3<f32>,
) -> Varying {
    let w = cross(u.xyz, v.xyz);
    let at = corner * vec3(u.w, v.w, half) + normal * center.w;
    let place = center.xyz + u.xyz * at.x + v.xyz * at.y + w * at.z;
    let eye = item.model_view * vec4(place, 1.0);
    var out: Varying;
    out.position = frame.projection * eye;
    out.eye = eye.xyz;
    out.normal = (item.model_view * vec4(u.xyz * normal.x + v.xyz * normal.y + w * normal.z, 0.0)).xyz;
    out.color = vec4(linear(color.rgb), color.a);
    return out;
}

@fragment
fn fs_depth(in: Varying) -> @location(0) vec4<f32> {
    if section_distance(in.eye) > 0.0 {
        discard;
    }
    return vec4(0.0);
}

@fragment
fn fs(in: Varying) -> @location(0) vec4<f32> {
    if section_distance(in.eye) > 0.0 {
        discard;
    }
    let toward_eye = select(normalize(-in.eye), vec3(0.0, 0.0, 1.0), frame.pixel.y > 0.0);
    let normal = normalize(in.normal);
    let facing = abs(dot(normal, toward_eye));
    let light = 0.62 + 0.38 * max(dot(normal, normalize(vec3(-0.42, 0.62, 0.66))), 0.0);
    // Glass: clear where seen square on, dense towards the rim.
    let alpha = in.color.a * item.color.a * mix(1.0, 0.5, pow(facing, 0.8));
    return vec4(in.color.rgb * light * alpha, alpha);
}

struct Outline {
    @builtin(position) position: vec4<f32>,
    // Pixels from the middle.
    @location(0) at: vec2<f32>,
    @location(1) @interpolate(flat) sides: vec4<f32>,
    // The third side, the radius.
    @location(2) @interpolate(flat) rest: vec3<f32>,
    @location(3) @interpolate(flat) color: vec4<f32>,
}

// How far a small step in eye space goes in the picture, in pixels, from a point with this clip position.
fn pixels(clip: vec4<f32>, step: vec3<f32>) -> vec2<f32> {
    let moved = frame.projection * vec4(step, 0.0);
    return (moved.xy - clip.xy / clip.w * moved.w) / clip.w * 0.5 * frame.viewport.xy;
}

@vertex
fn vs_outline(
    @builtin(vertex_index) index: u32,
    @location(0) center: vec4<f32>,
    @location(1) u: vec4<f32>,
    @location(2) v: vec4<f32>,
    @location(3) half: f32,
    @location(4) color: vec4<f32>,
) -> Outline {
    var out: Outline;
    out.position = vec4(2.0, 2.0, 2.0, 1.0);
    let eye = (item.model_view * vec4(center.xyz, 1.0)).xyz;
    let clip = frame.projection * vec4(eye, 1.0);
    let ju = (item.model_view * vec4(u.xyz * u.w, 0.0)).xyz;
    let jv = (item.model_view * vec4(v.xyz * v.w, 0.0)).xyz;
    let jw = (item.model_view * vec4(cross(u.xyz, v.xyz) * half, 0.0)).xyz;
    // Nearest point to the eye, so that the outline lies in front of what it encloses.
    let reach = abs(ju.z) + abs(jv.z) + abs(jw.z) + center.w;
    let front = frame.projection * vec4(eye + vec3(0.0, 0.0, reach), 1.0);
    if front.w <= front.z || clip.w <= clip.z || section_distance(eye) > 0.0 {
        return out;
    }
    // Pixels per model unit at the middle; y upwards.
    let rate = frame.projection[1][1] * 0.5 * frame.viewport.y / clip.w;
    let a = pixels(clip, ju);
    let b = pixels(clip, jv);
    let c = pixels(clip, jw);
    let radius = center.w * rate;
    let size = abs(a) + abs(b) + abs(c) + radius + 1.5;
    let corner = vec2(f32(index & 1u), f32(index >> 1u)) * 2.0 - 1.0;
    let local = corner * size;
    let ndc = clip.xy / clip.w + local * 2.0 * frame.viewport.zw;
    out.position = vec4(ndc, clamp(front.z / front.w, 0.0, 1.0), 1.0);
    out.at = local;
    out.sides = vec4(a, b);
    out.rest = vec3(c, radius);
    out.color = vec4(linear(color.rgb), color.a);
    return out;
}

fn segment(p: vec2<f32>, a: vec2<f32>, b: vec2<f32>) -> f32 {
    let d = b - a;
    let t = clamp(dot(p - a, d) / max(dot(d, d), 1e-12), 0.0, 1.0);
    return length(p - a - d * t);
}

// Distance beyond the two sides of the zonogon that are parallel to `side`.
fn beyond(p: vec2<f32>, side: vec2<f32>, a: vec2<f32>, b: vec2<f32>, c: vec2<f32>) -> f32 {
    let size = length(side);
    if size < 1e-6 {
        return -1e9;
    }
    let n = vec2(-side.y, side.x) / size;
    return abs(dot(p, n)) - abs(dot(a, n)) - abs(dot(b, n)) - abs(dot(c, n));
}

// Signed distance in pixels to the projection of the box.
fn projected(p: vec2<f32>, a: vec2<f32>, b: vec2<f32>, c: vec2<f32>) -> f32 {
    if dot(c, c) < 1e-6 {
        // A parallelogram, a segment or a point: exact outside too, so that its corners are round.
        let rim = min(min(segment(p, a + b, a - b), segment(p, a - b, -a - b)),
            min(segment(p, -a - b, b - a), segment(p, b - a, a + b)));
        let inside = max(beyond(p, a, a, b, c), beyond(p, b, a, b, c));
        let flat = abs(a.x * b.y - a.y * b.x) < 1e-3;
        return select(rim, inside, inside < 0.0 && !flat);
    }
    return max(max(beyond(p, a, a, b, c), beyond(p, b, a, b, c)), beyond(p, c, a, b, c));
}

@fragment
fn fs_outline(in: Outline) -> @location(0) vec4<f32> {
    let d = projected(in.at, in.sides.xy, in.sides.zw, in.rest.xy) - in.rest.z;
    let half = item.a.y;
    let line = clamp(half + 0.5 - abs(d + half), 0.0, 1.0);
    let fill = clamp(0.5 - d, 0.0, 1.0) * item.a.z;
    let alpha = max(line, fill) * in.color.a * item.color.a;
    if alpha < 0.004 {
        discard;
    }
    return vec4(in.color.rgb * alpha, alpha);
}
