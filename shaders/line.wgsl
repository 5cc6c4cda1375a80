// Lines as screen-space strips. One instance draws the piece from `b` to `c` of a polyline a, b, c, d; joints are
// mitred so that pieces meet without overlap (a translucent stroke stays even), sharp joints and ends are round.

struct Varying {
    @builtin(position) position: vec4<f32>,
    // Ends of the piece in pixels.
    @location(0) @interpolate(flat) ends: vec4<f32>,
    // Arc length at the ends in pixels; 1 where the end is round.
    @location(1) @interpolate(flat) arcs: vec4<f32>,
    // Distance to the section plane over w, and 1 over w.
    @location(2) plane: vec2<f32>,
}

fn to_screen(clip: vec4<f32>) -> vec2<f32> {
    return (clip.xy / clip.w * vec2(0.5, -0.5) + 0.5) * frame.viewport.xy;
}

// The point where b -> a leaves the near plane (clip z = w), or a when it lies in front of it.
fn near_clipped(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    let ca = frame.projection * vec4(a, 1.0);
    let cb = frame.projection * vec4(b, 1.0);
    let da = ca.w - ca.z;
    let db = cb.w - cb.z;
    if da > 0.0 {
        return a;
    }
    // A hair in front, so that w stays positive.
    return mix(a, b, clamp(-da / (db - da) * 1.0001 + 1e-6, 0.0, 1.0));
}

fn in_front(a: vec3<f32>) -> bool {
    let c = frame.projection * vec4(a, 1.0);
    return c.w > c.z;
}

// The unit direction of the joint at `at` between an incoming and an outgoing direction; zero when it is too sharp.
fn joint(incoming: vec2<f32>, outgoing: vec2<f32>) -> vec2<f32> {
    let sum = incoming + outgoing;
    // cos of half the turn is |sum| / 2: mitre up to a turn of 100 degrees.
    if length(sum) < 1.28 {
        return vec2(0.0);
    }
    return normalize(sum);
}

@vertex
fn vs(
    @builtin(vertex_index) index: u32,
    @location(0) a: vec4<f32>,
    @location(1) b: vec4<f32>,
    @location(2) c: vec4<f32>,
    @location(3) d: vec4<f32>,
) -> Varying {
    var out: Varying;
    out.position = vec4(2.0, 2.0, 2.0, 1.0);
    let ea = (item.model_view * vec4(a.xyz, 1.0)).xyz;
    let eb = (item.model_view * vec4(b.xyz, 1.0)).xyz;
    let ec = (item.model_view * vec4(c.xyz, 1.0)).xyz;
    let ed = (item.model_view * vec4(d.xyz, 1.0)).xyz;
    // A negative arc length marks a neighbour that belongs to no piece.
    if b.w < 0.0 || c.w < 0.0 || !(in_front(eb) || in_front(ec)) {
        return out;
    }
    let start = near_clipped(eb, ec);
    let end = near_clipped(ec, eb);
    let clip_start = frame.projection * vec4(start, 1.0);
    let clip_end = frame.projection * vec4(end, 1.0);
    let p = to_screen(clip_start);
    let q = to_screen(clip_end);
    let span = distance(p, q);
    let along = select(vec2(1.0, 0.0), (q - p) / span, span > 1e-4);

    // Joints only where the neighbour and this end lie in front of the near plane.
    var first = vec2(0.0);
    if in_front(ea) && in_front(eb) {
        let r = to_screen(frame.projection * vec4(ea, 1.0));
        if distance(r, p) > 1e-3 {
            first = joint(normalize(p - r), along);
        }
    }
    var last = vec2(0.0);
    if in_front(ed) && in_front(ec) {
        let r = to_screen(frame.projection * vec4(ed, 1.0));
        if distance(r, q) > 1e-3 {
            last = joint(along, normalize(r - q));
        }
    }

    let reach = item.a.y + item.b.y + 1.0;
    let side = select(-1.0, 1.0, (index & 1u) == 1u);
    let at_end = index >= 2u;
    let middle = select(first, last, at_end);
    let base = select(p, q, at_end);
    var corner: vec2<f32>;
    if dot(middle, middle) > 0.0 {
        let across = vec2(-middle.y, middle.x);
        // Not further along the piece than the piece is long: short pieces on tight turns must not fold over.
        let stretch = min(1.0 / max(dot(middle, along), 0.5), 2.0);
        corner = base + across * side * reach * stretch;
    } else {
        let across = vec2(-along.y, along.x);
        corner = base + across * side * reach + along * select(-reach, reach, at_end);
    }

    let eye = select(start, end, at_end);
    let w = select(clip_start.w, clip_end.w, at_end);
    let ndc = (corner * frame.viewport.zw - 0.5) * vec2(2.0, -2.0);
    out.position = vec4(ndc, clamp(pulled_depth(eye, item.b.z), 0.0, 1.0), 1.0);
    out.ends = vec4(p, q);
    let length = max(distance(eb, ec), 1e-30);
    let arc_start = mix(b.w, c.w, distance(eb, start) / length);
    let arc_end = mix(c.w, b.w, distance(ec, end) / length);
    out.arcs = vec4(vec2(arc_start, arc_end) * item.b.x,
        select(0.0, 1.0, dot(first, first) == 0.0), select(0.0, 1.0, dot(last, last) == 0.0));
    out.plane = vec2(section_distance(eye), 1.0) / w;
    return out;
}

@fragment
fn fs(in: Varying) -> @location(0) vec4<f32> {
    if in.plane.x > 0.0 {
        discard;
    }
    let p = in.ends.xy;
    let q = in.ends.zw;
    let span = max(distance(p, q), 1e-4);
    let along = (q - p) / span;
    let rel = in.position.xy - p;
    let x = dot(rel, along);
    // Beyond a round end the distance is to the end itself; beyond a mitred one to the line.
    let over = max(-x * in.arcs.z, (x - span) * in.arcs.w);
    let y = dot(rel, vec2(-along.y, along.x));
    let away = length(vec2(y, max(over, 0.0)));
    let distance = abs(away - item.b.y);
    var coverage = clamp(item.a.y + 0.5 - distance, 0.0, 1.0);
    // Thinner than a pixel: fainter, not broken.
    coverage *= min(item.a.y * 2.0, 1.0);

    let stroke = item.a.z;
    let period = item.a.z + item.a.w;
    if period > 0.0 {
        let arc = mix(in.arcs.x, in.arcs.y, clamp(x / span, 0.0, 1.0));
        // Pixels on screen per pixel of arc: 1 for a line across the view, less for one that recedes.
        let rate = min(span / max(abs(in.arcs.y - in.arcs.x), 1e-6), 1.0);
        let phase = abs(fract(arc / period) - 0.5) * period;
        let edge = (0.5 * stroke - phase) * rate;
        let dashes = clamp(edge + 0.5, 0.0, 1.0);
        // Strokes that have shrunk below a pixel become their mean.
        coverage *= mix(stroke / period, dashes, clamp(period * rate * 0.5 - 0.5, 0.0, 1.0));
    }
    let alpha = item.color.a * coverage;
    if alpha < 0.002 {
        discard;
    }
    return vec4(item.color.rgb * alpha, alpha);
}
