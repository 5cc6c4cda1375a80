// Surfaces: two-sided studio light that travels with the eye, zebra stripes, and fields in colour steps.

struct Scale {
    // Low, high, band, number of steps.
    range: vec4<f32>,
    neutral: vec4<f32>,
    below: vec4<f32>,
    above: vec4<f32>,
    no_data: vec4<f32>,
    steps: array<vec4<f32>, 32>,
}

@group(2) @binding(0) var<uniform> scale: Scale;

struct Varying {
    @builtin(position) position: vec4<f32>,
    @location(0) eye: vec3<f32>,
    @location(1) @interpolate(perspective, centroid) normal: vec3<f32>,
    // Value, validity.
    @location(2) field: vec2<f32>,
}

fn project(position: vec3<f32>, normal: vec3<f32>, field: vec2<f32>) -> Varying {
    let eye = item.model_view * vec4(position, 1.0);
    var out: Varying;
    out.position = frame.projection * eye;
    out.eye = eye.xyz;
    out.normal = (item.model_view * vec4(normal, 0.0)).xyz;
    out.field = field;
    return out;
}

@vertex
fn vs(@location(0) position: vec3<f32>, @location(1) normal: vec4<f32>) -> Varying {
    return project(position, normal.xyz, vec2(0.0));
}

@vertex
fn vs_field(
    @location(0) position: vec3<f32>,
    @location(1) normal: vec4<f32>,
    @location(2) field: vec2<f32>,
) -> Varying {
    return project(position, normal.xyz, field);
}

// Everything about one fragment that needs derivatives, so that they are taken in uniform control flow.
struct Fragment {
    normal: vec3<f32>,
    toward_eye: vec3<f32>,
    front: bool,
    zebra: f32,
}

fn gather(in: Varying, front: bool) -> Fragment {
    var out: Fragment;
    let flat_normal = normalize(cross(dpdx(in.eye), dpdy(in.eye)));
    let toward_eye = select(normalize(-in.eye), vec3(0.0, 0.0, 1.0), frame.pixel.y > 0.0);
    // The triangle's own normal, turned to the eye; then the vertex normal on the side that is seen.
    let facing = flat_normal * select(-1.0, 1.0, dot(flat_normal, toward_eye) >= 0.0);
    let has_normal = dot(in.normal, in.normal) > 1e-6;
    var normal = normalize(select(facing, in.normal, has_normal));
    normal = select(-normal, normal, front || !has_normal);
    // Interpolated normals may point past the silhouette; light such fragments as if they stood exactly on it.
    let d = dot(normal, toward_eye);
    normal = normalize(normal - toward_eye * min(d, 0.0));
    out.normal = normal;
    out.toward_eye = toward_eye;
    out.front = front;

    // A room of straight light tubes: the stripe is a function of the mirrored ray's elevation.
    let mirrored = reflect(-toward_eye, normal);
    let tube = asin(clamp(mirrored.y * 0.94 + mirrored.x * 0.34, -1.0, 1.0)) * 5.5;
    let blur = max(fwidth(tube), 1e-6);
    let wave = abs(fract(tube) - 0.5) * 2.0;
    let sharp = clamp((wave - 0.5) / (2.0 * blur) + 0.5, 0.0, 1.0);
    out.zebra = mix(sharp, 0.5, clamp(blur * 1.5 - 0.5, 0.0, 1.0));
    return out;
}

fn lambert(normal: vec3<f32>, light: vec3<f32>, wrap: f32) -> f32 {
    return max((dot(normal, light) + wrap) / (1.0 + wrap), 0.0);
}

fn blinn(f: Fragment, light: vec3<f32>, power: f32) -> f32 {
    return pow(max(dot(f.normal, normalize(light + f.toward_eye)), 0.0), power);
}

// Key, fill and rim over a sky and a floor; all in eye space.
fn lit(base: vec3<f32>, f: Fragment, gloss: f32) -> vec3<f32> {
    let key = normalize(vec3(-0.42, 0.62, 0.66));
    let fill = normalize(vec3(0.75, 0.12, 0.65));
    let rim = normalize(vec3(0.25, -0.85, 0.35));
    let sky = mix(vec3(0.155, 0.150, 0.145), vec3(0.27, 0.28, 0.295), f.normal.y * 0.5 + 0.5);
    let diffuse = sky
        + vec3(0.60, 0.59, 0.57) * lambert(f.normal, key, 0.12)
        + vec3(0.170, 0.178, 0.19) * lambert(f.normal, fill, 0.25)
        + vec3(0.055) * lambert(f.normal, rim, 0.0);
    // A soft darkening towards the silhouette gives round things their form without outlines.
    let facing = clamp(dot(f.normal, f.toward_eye), 0.0, 1.0);
    let form = mix(0.74, 1.0, smoothstep(0.0, 0.55, facing));
    let shine = gloss * (0.13 * blinn(f, key, 48.0) + 0.05 * blinn(f, key, 9.0) + 0.035 * blinn(f, fill, 24.0));
    let color = base * diffuse * form + vec3(shine);
    // A soft shoulder: nothing burns out.
    let over = max(color - vec3(0.7), vec3(0.0));
    return min(color, vec3(0.7)) + 0.3 * over / (over + vec3(0.3));
}

fn finish(in: Varying, f: Fragment, base: vec4<f32>, gloss: f32) -> vec4<f32> {
    if section_distance(in.eye) > 0.0 {
        discard;
    }
    let mode = frame.flags.x;
    var color = lit(base.rgb, f, gloss);
    var alpha = base.a;
    if frame.flags.y != 0u {
        let white = lit(vec3(0.86), f, 0.0);
        color = mix(white * 0.035, white, f.zebra);
        // A hint of the base colour keeps neighbours apart.
        color = mix(color, color * base.rgb * 1.6, 0.25);
    }
    if mode == MODE_HIDDEN_LINE {
        color = background(in.position.y);
    }
    if mode == MODE_XRAY {
        // Glass: clear where seen square on, denser towards the silhouette.
        let facing = clamp(dot(f.normal, f.toward_eye), 0.0, 1.0);
        alpha = alpha * mix(0.62, 0.20, pow(facing, 0.7));
    }
    return vec4(color * alpha, alpha);
}

@fragment
fn fs(in: Varying, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let f = gather(in, front);
    let base = select(item.back, item.color, f.front);
    return finish(in, f, base, select(0.35, 1.0, f.front));
}

// The colour of the step a value falls into; edges of steps are softened over one pixel.
fn step_color(value: f32) -> vec3<f32> {
    let count = scale.range.w;
    if value < scale.range.x {
        return scale.below.rgb;
    }
    if value > scale.range.y {
        return scale.above.rgb;
    }
    if abs(value) <= scale.range.z {
        return scale.neutral.rgb;
    }
    let at = (value - scale.range.x) / (scale.range.y - scale.range.x) * count;
    return scale.steps[u32(clamp(floor(at), 0.0, count - 1.0))].rgb;
}

@fragment
fn fs_field(in: Varying, @builtin(front_facing) front: bool) -> @location(0) vec4<f32> {
    let f = gather(in, front);
    let slope = fwidth(in.field.x);
    // Four taps across the pixel: the borders between steps are as smooth as edges.
    var color = vec3(0.0);
    for (var k = 0; k < 4; k++) {
        color += 0.25 * step_color(in.field.x + slope * (f32(k) - 1.5) * 0.25);
    }
    if in.field.y < 0.999 {
        let along = (in.position.x + in.position.y) / (10.0 * frame.pixel.z);
        let hatch = smoothstep(0.20, 0.34, abs(fract(along) - 0.5));
        color = mix(scale.no_data.rgb * 0.45, scale.no_data.rgb, hatch);
    }
    // Fields are read, not admired: flat light, no highlights.
    let light = lit(vec3(1.0), f, 0.0);
    let soft = mix(vec3(1.0), light, 0.42);
    if frame.flags.x == MODE_SHADED && frame.flags.y == 0u {
        if section_distance(in.eye) > 0.0 {
            discard;
        }
        return vec4(color * soft, 1.0);
    }
    return finish(in, f, vec4(color, select(item.back.a, item.color.a, f.front)), 0.0);
}
