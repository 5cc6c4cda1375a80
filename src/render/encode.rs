//! From a frame to draw calls: culling, uniforms, and the order of passes.
//!
//! Order: backdrop; opaque surfaces; hidden then visible parts of lines; translucent surfaces from far to near; volumes;
//! hidden then visible glyphs; everything on top. Lines and glyphs write no depth, so later items lie over earlier ones.
//! Bodies of volumes are drawn twice, first for their depth alone, so that only the nearest shows, once.

use std::ops::Range;
use std::sync::Arc;

use glam::{DMat4, Mat4, Vec3};

use super::cache::Cache;
use super::color::{Color, ColorScale, MAX_STEPS, mix};
use super::cull::{Bounds, Frustum, Run, Side};
use super::frame::{
    Dash, Display, Emphasis, FrameData, Hidden, LineItem, LineRole, LineStyle, MeshItem, VolumeForm, VolumeItem,
};
use super::renderer::{FrameUniform, ITEM_STRIDE, ItemUniform, Layers, Renderer, SCALE_STRIDE, ScaleUniform};

/// What one frame cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameStats {
    /// Draw calls.
    pub draws: usize,
    /// Triangles sent to the GPU after culling.
    pub triangles: usize,
    /// Triangles of the whole scene.
    pub triangles_total: usize,
    /// Line segments sent to the GPU after culling; visible and hidden pass counted once.
    pub segments: usize,
    /// Bounding volumes sent to the GPU after culling.
    pub volumes: usize,
    /// Bounding volumes of the whole scene.
    pub volumes_total: usize,
    /// Buffers that had to be rebuilt because their revision changed.
    pub rebuilt: usize,
}

/// The part behind surfaces is this opaque.
const HIDDEN_ALPHA: f32 = 0.4;
/// Lines and glyphs are pulled this many pixels' worth towards the eye.
const PULL: f32 = 1.5;

/// One mesh to draw: its place in the frame's list, its uniform, its scale if it shows a field.
struct Surface {
    item: usize,
    uniform: u32,
    scale: Option<u32>,
    runs: Vec<Range<u32>>,
    depth: f32,
}

/// One batch of lines or glyphs.
struct Batch {
    item: usize,
    uniform: u32,
    runs: Vec<Range<u32>>,
}

/// Everything to draw, culled and in order.
#[derive(Default)]
pub(super) struct Plan {
    pub items: Vec<ItemUniform>,
    pub scales: Vec<ScaleUniform>,
    known_scales: Vec<Arc<ColorScale>>,
    opaque: Vec<Surface>,
    translucent: Vec<Surface>,
    lines: [Vec<Batch>; 3],
    glyphs: [Vec<Batch>; 3],
    solids: Vec<Batch>,
    outlines: Vec<Batch>,
    pub stats: FrameStats,
}

const HIDDEN: usize = 0;
const VISIBLE: usize = 1;
const ON_TOP: usize = 2;

impl Plan {
    /// Culls and sorts. All items must be in the cache.
    pub fn new(frame: &FrameData, size: [u32; 2], cache: &Cache) -> Self {
        let mut plan = Self::default();
        let clear = frame.display.xray;
        plan.stats.rebuilt = cache.rebuilt;
        for (at, item) in frame.meshes.iter().enumerate() {
            plan.add_mesh(frame, at, item, clear, cache);
        }
        plan.translucent.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        for (at, item) in frame.lines.iter().enumerate() {
            plan.add_lines(frame, size, at, item, cache);
        }
        for (at, item) in frame.volumes.iter().enumerate() {
            plan.add_volumes(frame, size, at, item, cache);
        }
        for (at, item) in frame.glyphs.iter().enumerate() {
            let Some(gpu) = cache.glyphs(item.key) else { continue };
            let mv = model_view(frame, item.glyphs.origin);
            let clip = frame.projection_f32() * mv;
            if Frustum::new(&clip, margin(size, 64.0)).side(&gpu.bounds) == Side::Outside {
                continue;
            }
            let cut = flag(item.sectioned);
            let push = |plan: &mut Self, layer: usize, alpha: f32| {
                let uniform =
                    plan.item(mv, [1.0, 1.0, 1.0, alpha], [0.0; 4], [cut, 0.0, 0.0, 0.0], [0.0, 0.0, PULL, 0.0]);
                plan.glyphs[layer].push(Batch { item: at, uniform, runs: std::iter::once(0..gpu.count).collect() });
            };
            match item.hidden {
                Hidden::OnTop => push(&mut plan, ON_TOP, 1.0),
                Hidden::Gone => push(&mut plan, VISIBLE, 1.0),
                Hidden::Dashed => {
                    push(&mut plan, HIDDEN, HIDDEN_ALPHA);
                    push(&mut plan, VISIBLE, 1.0);
                }
            }
        }
        plan
    }

    fn item(&mut self, mv: Mat4, color: Color, back: Color, a: [f32; 4], b: [f32; 4]) -> u32 {
        self.items.push(ItemUniform { model_view: mv.to_cols_array(), color, back, a, b });
        (self.items.len() - 1) as u32
    }

    fn add_mesh(&mut self, frame: &FrameData, at: usize, item: &MeshItem, clear: bool, cache: &Cache) {
        let Some(gpu) = cache.mesh(item.key) else { return };
        self.stats.triangles_total += gpu.runs.iter().map(|r| r.range.len() / 3).sum::<usize>();
        if frame.display.wireframe {
            return;
        }
        let mv = model_view(frame, item.mesh.origin);
        let clip = frame.projection_f32() * mv;
        let runs = visible(&Frustum::new(&clip, [0.0; 2]), &gpu.bounds, &gpu.runs);
        if runs.is_empty() {
            return;
        }
        let ground = mix(frame.background.top, frame.background.bottom, 0.5);
        let color = emphasized(item.color, item.emphasis, ground, frame.accent, Kind::Surface);
        let uniform = self.item(mv, color, back_of(color), [flag(item.sectioned), 0.0, 0.0, 0.0], [0.0; 4]);
        let scale = item.field.as_ref().map(|f| self.scale(&f.scale));
        self.stats.triangles += runs.iter().map(|r| r.len() / 3).sum::<usize>();
        let depth = mv.transform_point3(gpu.bounds.center).z;
        let surface = Surface { item: at, uniform, scale, runs, depth };
        if clear || color[3] < 1.0 { self.translucent.push(surface) } else { self.opaque.push(surface) }
    }

    fn add_lines(&mut self, frame: &FrameData, size: [u32; 2], at: usize, item: &LineItem, cache: &Cache) {
        let Display { edges, isolines, wireframe, .. } = frame.display;
        let shown = match item.role {
            LineRole::Edge => edges || wireframe,
            LineRole::Iso => isolines || wireframe,
            LineRole::Curve => true,
        };
        let Some(gpu) = cache.lines(item.key).filter(|_| shown) else { return };
        let mv = model_view(frame, item.lines.origin);
        let projection = frame.projection_f32();
        let scale = frame.pixels_per_point;
        let style = item.style;
        let wider = if item.emphasis == Emphasis::Hovered { 1.0 } else { 0.0 };
        let half = (0.5 * (style.width + wider) * scale).max(0.05);
        let apart = if style.dash == Dash::Double { half + 0.9 * scale } else { 0.0 };
        let frustum = Frustum::new(&(projection * mv), margin(size, 2.0 * (half + apart) + 2.0));
        let runs = visible(&frustum, &gpu.bounds, &gpu.runs);
        if runs.is_empty() {
            return;
        }
        self.stats.segments += runs.iter().map(|r| r.len()).sum::<usize>();
        let ground = mix(frame.background.top, frame.background.bottom, 0.5);
        let color = emphasized(style.color, item.emphasis, ground, frame.accent, Kind::Line);
        let rate = pixels_per_unit(&projection, mv.transform_point3(gpu.bounds.center), size);
        let cut = flag(item.sectioned);
        let push = |plan: &mut Self, layer: usize, style: LineStyle, alpha: f32| {
            let [on, off] = match style.dash {
                Dash::Dashed { on, off } => [on.max(0.0) * scale, off.max(0.0) * scale],
                _ => [0.0, 0.0],
            };
            let [r, g, b, a] = color;
            let uniform = plan.item(mv, [r, g, b, a * alpha], [0.0; 4], [cut, half, on, off], [rate, apart, PULL, 0.0]);
            plan.lines[layer].push(Batch { item: at, uniform, runs: runs.clone() });
        };
        match style.hidden {
            Hidden::OnTop => push(self, ON_TOP, style, 1.0),
            Hidden::Gone => push(self, VISIBLE, style, 1.0),
            Hidden::Dashed => {
                let dash = if matches!(style.dash, Dash::Dashed { .. }) { style.dash } else { Dash::SHORT };
                push(self, HIDDEN, LineStyle { dash, ..style }, HIDDEN_ALPHA);
                push(self, VISIBLE, style, 1.0);
            }
        }
    }

    fn add_volumes(&mut self, frame: &FrameData, size: [u32; 2], at: usize, item: &VolumeItem, cache: &Cache) {
        let Some(gpu) = cache.volumes(item.key) else { return };
        self.stats.volumes_total += gpu.count;
        let mv = model_view(frame, item.volumes.origin);
        let frustum = Frustum::new(&(frame.projection_f32() * mv), margin(size, 4.0));
        let runs = visible(&frustum, &gpu.bounds, &gpu.runs);
        if runs.is_empty() {
            return;
        }
        self.stats.volumes += runs.iter().map(|r| r.len()).sum::<usize>();
        let cut = flag(item.sectioned);
        let (width, fill) = match item.form {
            VolumeForm::Outline { width, fill } => (width, fill),
            VolumeForm::Solid => {
                let uniform = self.item(mv, [1.0, 1.0, 1.0, item.opacity], [0.0; 4], [cut, 0.0, 0.0, 0.0], [0.0; 4]);
                self.solids.push(Batch { item: at, uniform, runs: runs.clone() });
                (1.0, 0.0)
            }
        };
        let half = (0.5 * width * frame.pixels_per_point).max(0.25);
        // The silhouettes of bodies are drawn over them a little denser.
        let opacity = if item.form == VolumeForm::Solid { (1.6 * item.opacity).min(1.0) } else { item.opacity };
        let uniform = self.item(mv, [1.0, 1.0, 1.0, opacity], [0.0; 4], [cut, half, fill, 0.0], [0.0; 4]);
        self.outlines.push(Batch { item: at, uniform, runs });
    }

    fn scale(&mut self, scale: &Arc<ColorScale>) -> u32 {
        if let Some(at) = self.known_scales.iter().position(|s| Arc::ptr_eq(s, scale)) {
            return at as u32;
        }
        let mut steps = [scale.no_data; MAX_STEPS];
        let count = scale.steps.len().min(MAX_STEPS);
        steps[..count].copy_from_slice(&scale.steps[..count]);
        self.known_scales.push(scale.clone());
        self.scales.push(ScaleUniform {
            range: [scale.low, scale.high, scale.band, count.max(1) as f32],
            neutral: scale.neutral,
            below: scale.below,
            above: scale.above,
            no_data: scale.no_data,
            steps,
        });
        (self.scales.len() - 1) as u32
    }

    /// Records all draws into a pass whose attachments are the target's.
    pub fn record(
        &mut self,
        pass: &mut wgpu::RenderPass<'_>,
        renderer: &Renderer,
        frame: &FrameData,
        cache: &Cache,
        groups: &Groups<'_>,
    ) {
        pass.set_bind_group(0, groups.frame, &[]);
        pass.set_bind_group(1, groups.items, &[0]);
        pass.set_pipeline(&renderer.background);
        pass.draw(0..3, 0..1);
        let mut draws = 1;
        let mut surfaces = |pass: &mut wgpu::RenderPass<'_>, list: &[Surface], opaque: bool| {
            let mut field = None;
            for s in list {
                let key = frame.meshes[s.item].key;
                let Some(mesh) = cache.mesh(key) else { continue };
                let values = s.scale.and_then(|scale| Some((scale, cache.field(key)?)));
                if field != Some(values.is_some()) {
                    field = Some(values.is_some());
                    let set = if values.is_some() { &renderer.fields } else { &renderer.surfaces };
                    pass.set_pipeline(if opaque { &set.opaque } else { &set.translucent });
                }
                pass.set_bind_group(1, groups.items, &[s.uniform * ITEM_STRIDE as u32]);
                pass.set_vertex_buffer(0, mesh.vertices.slice(..));
                if let Some((scale, values)) = values {
                    pass.set_bind_group(2, groups.scales, &[scale * SCALE_STRIDE as u32]);
                    pass.set_vertex_buffer(1, values.slice(..));
                }
                pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint32);
                for run in &s.runs {
                    pass.draw_indexed(run.clone(), 0, 0..1);
                    draws += 1;
                }
            }
        };
        surfaces(pass, &self.opaque, true);
        for layer in [HIDDEN, VISIBLE] {
            pass.set_pipeline(pipeline(&renderer.lines, layer));
            self.stats.draws += lines(pass, &self.lines[layer], frame, cache, groups);
        }
        surfaces(pass, &self.translucent, false);
        for pipeline in [&renderer.volumes.depth, &renderer.volumes.solid] {
            pass.set_pipeline(pipeline);
            self.stats.draws += volumes(pass, &self.solids, renderer, frame, cache, groups);
        }
        pass.set_pipeline(&renderer.volumes.outline);
        let outlines = |item: usize| Some(&cache.volumes(frame.volumes[item].key)?.instances);
        self.stats.draws += strips(pass, &self.outlines, groups, outlines);
        let glyphs = |item: usize| Some(&cache.glyphs(frame.glyphs[item].key)?.instances);
        for layer in [HIDDEN, VISIBLE] {
            pass.set_pipeline(pipeline(&renderer.glyphs, layer));
            self.stats.draws += strips(pass, &self.glyphs[layer], groups, glyphs);
        }
        pass.set_pipeline(&renderer.lines.on_top);
        self.stats.draws += lines(pass, &self.lines[ON_TOP], frame, cache, groups);
        pass.set_pipeline(&renderer.glyphs.on_top);
        self.stats.draws += strips(pass, &self.glyphs[ON_TOP], groups, glyphs);
        self.stats.draws += draws;
    }
}

/// The bind groups of one frame.
pub(super) struct Groups<'a> {
    pub frame: &'a wgpu::BindGroup,
    pub items: &'a wgpu::BindGroup,
    pub scales: &'a wgpu::BindGroup,
}

fn pipeline(layers: &Layers, layer: usize) -> &wgpu::RenderPipeline {
    match layer {
        HIDDEN => &layers.hidden,
        VISIBLE => &layers.visible,
        _ => &layers.on_top,
    }
}

fn lines(
    pass: &mut wgpu::RenderPass<'_>,
    batches: &[Batch],
    frame: &FrameData,
    cache: &Cache,
    groups: &Groups<'_>,
) -> usize {
    let mut draws = 0;
    for batch in batches {
        let Some(gpu) = cache.lines(frame.lines[batch.item].key) else { continue };
        pass.set_bind_group(1, groups.items, &[batch.uniform * ITEM_STRIDE as u32]);
        for slot in 0..4 {
            pass.set_vertex_buffer(slot, gpu.points.slice(u64::from(slot) * super::cache::LINE_POINT..));
        }
        for run in &batch.runs {
            pass.draw(0..4, run.clone());
            draws += 1;
        }
    }
    draws
}

/// Above this many bodies a coarser template is round enough: each is small.
const ROUND: usize = 300;

fn volumes(
    pass: &mut wgpu::RenderPass<'_>,
    batches: &[Batch],
    renderer: &Renderer,
    frame: &FrameData,
    cache: &Cache,
    groups: &Groups<'_>,
) -> usize {
    let mut draws = 0;
    for batch in batches {
        let Some(gpu) = cache.volumes(frame.volumes[batch.item].key) else { continue };
        let template = &renderer.volumes.templates[usize::from(gpu.count > ROUND)];
        pass.set_bind_group(1, groups.items, &[batch.uniform * ITEM_STRIDE as u32]);
        pass.set_vertex_buffer(0, gpu.instances.slice(..));
        pass.set_vertex_buffer(1, template.vertices.slice(..));
        pass.set_index_buffer(template.indices.slice(..), wgpu::IndexFormat::Uint32);
        for run in &batch.runs {
            pass.draw_indexed(0..template.count, 0, run.clone());
            draws += 1;
        }
    }
    draws
}

/// Four corners for every instance: glyphs and silhouettes of volumes.
fn strips<'c>(
    pass: &mut wgpu::RenderPass<'_>,
    batches: &[Batch],
    groups: &Groups<'_>,
    instances: impl Fn(usize) -> Option<&'c wgpu::Buffer>,
) -> usize {
    let mut draws = 0;
    for batch in batches {
        let Some(buffer) = instances(batch.item) else { continue };
        pass.set_bind_group(1, groups.items, &[batch.uniform * ITEM_STRIDE as u32]);
        pass.set_vertex_buffer(0, buffer.slice(..));
        for run in &batch.runs {
            pass.draw(0..4, run.clone());
            draws += 1;
        }
    }
    draws
}

/// The runs that the frustum touches, neighbours joined.
fn visible(frustum: &Frustum, bounds: &Bounds, runs: &[Run]) -> Vec<Range<u32>> {
    let whole = match frustum.side(bounds) {
        Side::Outside => return Vec::new(),
        Side::Inside => true,
        Side::Crossing => runs.len() == 1,
    };
    let mut out: Vec<Range<u32>> = Vec::new();
    for run in runs {
        if whole || frustum.side(&run.bounds) != Side::Outside {
            match out.last_mut() {
                Some(last) if last.end == run.range.start => last.end = run.range.end,
                _ => out.push(run.range.clone()),
            }
        }
    }
    out
}

/// `pixels` pixels as a fraction of half the viewport.
fn margin(size: [u32; 2], pixels: f32) -> [f32; 2] {
    size.map(|s| 2.0 * pixels / s.max(1) as f32)
}

fn flag(on: bool) -> f32 {
    if on { 1.0 } else { 0.0 }
}

/// Local to eye, composed in `f64` so that large coordinates cancel before they are rounded.
fn model_view(frame: &FrameData, origin: glam::DVec3) -> Mat4 {
    (frame.camera.view * DMat4::from_translation(origin)).as_mat4()
}

/// Pixels per model unit at a point in eye space, rounded to a power of two: dashes keep their length on screen within
/// a factor of two and do not crawl while the camera moves.
fn pixels_per_unit(projection: &Mat4, eye: Vec3, size: [u32; 2]) -> f32 {
    let w = projection.row(3).dot(eye.extend(1.0)).abs().max(1e-30);
    let rate = projection.y_axis.y.abs() * 0.5 * size[1].max(1) as f32 / w;
    if rate.is_finite() && rate > 0.0 { rate.log2().round().exp2() } else { 1.0 }
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Surface,
    Line,
}

fn emphasized(color: Color, emphasis: Emphasis, ground: Color, accent: Color, kind: Kind) -> Color {
    let alpha = color[3];
    let luma = 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2];
    let out = match emphasis {
        Emphasis::Normal => color,
        Emphasis::Muted => mix(mix(color, [luma, luma, luma, alpha], 0.7), ground, 0.45),
        Emphasis::Hovered if kind == Kind::Line => mix(color, accent, 0.55),
        Emphasis::Hovered => mix(color, [1.0, 1.0, 1.0, alpha], 0.28),
        Emphasis::Selected if kind == Kind::Line => accent,
        Emphasis::Selected => mix(color, accent, 0.42),
    };
    [out[0], out[1], out[2], alpha]
}

/// The back of a surface: the same hue, duller and a little darker, so that a flipped surface is seen at once.
fn back_of(color: Color) -> Color {
    let luma = 0.2126 * color[0] + 0.7152 * color[1] + 0.0722 * color[2];
    let dull = mix(color, [luma * 1.02, luma * 0.96, luma * 0.86, color[3]], 0.72);
    [dull[0] * 0.62, dull[1] * 0.62, dull[2] * 0.62, color[3]]
}

impl FrameData {
    pub(super) fn projection_f32(&self) -> Mat4 {
        self.camera.projection.as_mat4()
    }

    /// The uniform of the whole frame for a target of this size.
    pub(super) fn uniform(&self, size: [u32; 2]) -> FrameUniform {
        let projection = self.projection_f32();
        let [w, h] = size.map(|s| s as f32);
        let section = self.section.map_or([0.0, 0.0, 0.0, -1.0], |s| {
            let n = self.camera.view.transform_vector3(s.normal);
            let offset = -s.offset - n.dot(self.camera.view.w_axis.truncate());
            n.extend(offset).as_vec4().to_array()
        });
        FrameUniform {
            projection: projection.to_cols_array(),
            viewport: [w, h, 1.0 / w, 1.0 / h],
            section,
            background_top: self.background.top,
            background_bottom: self.background.bottom,
            pixel: [
                2.0 / (projection.y_axis.y.abs().max(1e-30) * h),
                flag(self.camera.is_orthographic()),
                self.pixels_per_point,
                0.0,
            ],
            flags: [mode(&self.display), self.display.zebra as u32, 0, self.section.is_some() as u32],
        }
    }
}

/// `MODE_*` of common.wgsl.
fn mode(display: &Display) -> u32 {
    match display {
        Display { xray: true, .. } => 2,
        Display { shaded: false, zebra: false, .. } => 1,
        _ => 0,
    }
}
