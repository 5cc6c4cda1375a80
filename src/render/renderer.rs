//! Shaders and pipelines: made once, never changed.

use std::borrow::Cow;

use bytemuck::{Pod, Zeroable};
use wgpu::{BlendState, CompareFunction, ShaderStages, TextureFormat, VertexFormat};

use super::cache::{GlyphInstance, LINE_POINT};
use super::color::MAX_STEPS;
use super::mesh_data::SurfaceVertex;
use super::target::{COLOR_FORMAT, DEPTH_FORMAT, SAMPLES};
use super::volume::{Template, TemplateVertex, VolumeInstance};

const COMMON: &str = include_str!("../../shaders/common.wgsl");
const BACKGROUND: &str = include_str!("../../shaders/background.wgsl");
const SURFACE: &str = include_str!("../../shaders/surface.wgsl");
const LINE: &str = include_str!("../../shaders/line.wgsl");
const GLYPH: &str = include_str!("../../shaders/glyph.wgsl");
const VOLUME: &str = include_str!("../../shaders/volume.wgsl");
const BLIT: &str = include_str!("../../shaders/blit.wgsl");

/// Every shader module as the GPU gets it: name and WGSL.
pub fn shader_sources() -> Vec<(&'static str, Cow<'static, str>)> {
    let scene = |text: &str| Cow::Owned(format!("{COMMON}\n{text}"));
    vec![
        ("background", scene(BACKGROUND)),
        ("surface", scene(SURFACE)),
        ("line", scene(LINE)),
        ("glyph", scene(GLYPH)),
        ("volume", scene(VOLUME)),
        ("blit", Cow::Borrowed(BLIT)),
    ]
}

/// `Frame` of common.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct FrameUniform {
    pub projection: [f32; 16],
    pub viewport: [f32; 4],
    pub section: [f32; 4],
    pub background_top: [f32; 4],
    pub background_bottom: [f32; 4],
    pub pixel: [f32; 4],
    pub flags: [u32; 4],
}

/// `Item` of common.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct ItemUniform {
    pub model_view: [f32; 16],
    pub color: [f32; 4],
    pub back: [f32; 4],
    pub a: [f32; 4],
    pub b: [f32; 4],
}

/// `Scale` of surface.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub(super) struct ScaleUniform {
    pub range: [f32; 4],
    pub neutral: [f32; 4],
    pub below: [f32; 4],
    pub above: [f32; 4],
    pub no_data: [f32; 4],
    pub steps: [[f32; 4]; MAX_STEPS],
}

/// Distance of two items in their buffer; every device aligns dynamic offsets to at most this.
pub(super) const ITEM_STRIDE: u64 = 256;
/// Distance of two scales in their buffer.
pub(super) const SCALE_STRIDE: u64 = 768;

/// How depth decides in the passes for lines and glyphs.
#[derive(Debug)]
pub(super) struct Layers {
    /// In front of the surfaces.
    pub visible: wgpu::RenderPipeline,
    /// Behind them.
    pub hidden: wgpu::RenderPipeline,
    /// Whatever is in front.
    pub on_top: wgpu::RenderPipeline,
}

/// Opaque and translucent.
#[derive(Debug)]
pub(super) struct Surfaces {
    pub opaque: wgpu::RenderPipeline,
    pub translucent: wgpu::RenderPipeline,
}

/// Bodies and silhouettes of bounding volumes.
#[derive(Debug)]
pub(super) struct Volumes {
    /// The depth of bodies alone.
    pub depth: wgpu::RenderPipeline,
    /// The bodies.
    pub solid: wgpu::RenderPipeline,
    /// Their silhouettes.
    pub outline: wgpu::RenderPipeline,
    /// A round and a coarse template.
    pub templates: [Template; 2],
}

/// All pipelines for one screen format. Immutable; share it in an `Arc` between viewports.
#[derive(Debug)]
pub struct Renderer {
    pub(super) frame_layout: wgpu::BindGroupLayout,
    pub(super) item_layout: wgpu::BindGroupLayout,
    pub(super) scale_layout: wgpu::BindGroupLayout,
    pub(super) blit_layout: wgpu::BindGroupLayout,
    pub(super) sampler: wgpu::Sampler,
    pub(super) background: wgpu::RenderPipeline,
    pub(super) surfaces: Surfaces,
    pub(super) fields: Surfaces,
    pub(super) lines: Layers,
    pub(super) glyphs: Layers,
    pub(super) volumes: Volumes,
    pub(super) blit: wgpu::RenderPipeline,
}

impl Renderer {
    /// Compiles everything. `screen` is the format of the pass into which [`super::Viewport::paint`] will draw
    /// (one sample, no depth buffer).
    pub fn new(device: &wgpu::Device, screen: TextureFormat) -> Self {
        let uniform = |label: &str, size: usize, dynamic: bool| {
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
                label: Some(label),
                entries: &[wgpu::BindGroupLayoutEntry {
                    binding: 0,
                    visibility: ShaderStages::VERTEX_FRAGMENT,
                    ty: wgpu::BindingType::Buffer {
                        ty: wgpu::BufferBindingType::Uniform,
                        has_dynamic_offset: dynamic,
                        min_binding_size: wgpu::BufferSize::new(size as u64),
                    },
                    count: None,
                }],
            })
        };
        let frame_layout = uniform("frame", size_of::<FrameUniform>(), false);
        let item_layout = uniform("item", size_of::<ItemUniform>(), true);
        let scale_layout = uniform("scale", size_of::<ScaleUniform>(), true);
        let layout = |label: &str, groups: &[Option<&wgpu::BindGroupLayout>]| {
            device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(label),
                bind_group_layouts: groups,
                immediate_size: 0,
            })
        };
        let plain = layout("plain", &[Some(&frame_layout), Some(&item_layout)]);
        let scaled = layout("scaled", &[Some(&frame_layout), Some(&item_layout), Some(&scale_layout)]);
        let module = |label: &str, text: String| {
            device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(text.into()),
            })
        };
        let scene = |label: &str, text: &str| module(label, format!("{COMMON}\n{text}"));
        let make = Make { device };

        let background = scene("background", BACKGROUND);
        let surface = scene("surface", SURFACE);
        let line = scene("line", LINE);
        let glyph = scene("glyph", GLYPH);

        let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Snorm16x4];
        let vertices = vertex_layout::<SurfaceVertex>(&attributes);
        let field_attributes = wgpu::vertex_attr_array![2 => Float32x2];
        let field_values = vertex_layout::<[f32; 2]>(&field_attributes);
        let surfaces = |label, layout, vs, fs, buffers: &[_]| Surfaces {
            opaque: make.pipeline(label, layout, &surface, [vs, fs], buffers, Pass::OPAQUE),
            translucent: make.pipeline(label, layout, &surface, [vs, fs], buffers, Pass::TRANSLUCENT),
        };

        let corner =
            |location| wgpu::VertexAttribute { format: VertexFormat::Float32x4, offset: 0, shader_location: location };
        let corners: [[wgpu::VertexAttribute; 1]; 4] = std::array::from_fn(|k| [corner(k as u32)]);
        let line_buffers: [_; 4] = std::array::from_fn(|k| {
            Some(wgpu::VertexBufferLayout {
                array_stride: LINE_POINT,
                step_mode: wgpu::VertexStepMode::Instance,
                attributes: &corners[k],
            })
        });
        let glyph_attributes =
            wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32, 2 => Float32x3, 3 => Uint32, 4 => Float32x4];
        let glyph_buffers = [Some(wgpu::VertexBufferLayout {
            array_stride: size_of::<GlyphInstance>() as u64,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &glyph_attributes,
        })];
        let layers = |label, module, buffers: &[_]| Layers {
            visible: make.pipeline(
                label,
                &plain,
                module,
                ["vs", "fs"],
                buffers,
                Pass::strips(CompareFunction::GreaterEqual),
            ),
            hidden: make.pipeline(label, &plain, module, ["vs", "fs"], buffers, Pass::strips(CompareFunction::Less)),
            on_top: make.pipeline(label, &plain, module, ["vs", "fs"], buffers, Pass::strips(CompareFunction::Always)),
        };

        let volume = scene("volume", VOLUME);
        let instance_attributes = wgpu::vertex_attr_array![
            0 => Float32x4, 1 => Float32x4, 2 => Float32x4, 3 => Float32, 4 => Unorm8x4
        ];
        let instances = wgpu::VertexBufferLayout {
            array_stride: size_of::<VolumeInstance>() as u64,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &instance_attributes,
        };
        let template_attributes = wgpu::vertex_attr_array![5 => Float32x3, 6 => Float32x3];
        let body = [Some(instances.clone()), Some(vertex_layout::<TemplateVertex>(&template_attributes))];
        let volumes = Volumes {
            depth: make.pipeline("volume depth", &plain, &volume, ["vs", "fs_depth"], &body, Pass::DEPTH),
            solid: make.pipeline("volume", &plain, &volume, ["vs", "fs"], &body, Pass::BODY),
            outline: make.pipeline(
                "volume outline",
                &plain,
                &volume,
                ["vs_outline", "fs_outline"],
                &[Some(instances)],
                Pass::strips(CompareFunction::GreaterEqual),
            ),
            templates: [6, 2].map(|arcs| Template::new(device, arcs)),
        };

        let (blit_layout, sampler, blit) = blit(device, screen, layout, module);
        Self {
            background: make.pipeline("background", &plain, &background, ["vs", "fs"], &[], Pass::BACKGROUND),
            surfaces: surfaces("surface", &plain, "vs", "fs", &[Some(vertices.clone())]),
            fields: surfaces("field", &scaled, "vs_field", "fs_field", &[Some(vertices.clone()), Some(field_values)]),
            lines: layers("line", &line, &line_buffers),
            glyphs: layers("glyph", &glyph, &glyph_buffers),
            volumes,
            frame_layout,
            item_layout,
            scale_layout,
            blit_layout,
            sampler,
            blit,
        }
    }
}

fn vertex_layout<T>(attributes: &[wgpu::VertexAttribute]) -> wgpu::VertexBufferLayout<'_> {
    wgpu::VertexBufferLayout {
        array_stride: size_of::<T>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes,
    }
}

/// What distinguishes the pipelines of the scene.
#[derive(Clone, Copy)]
struct Pass {
    topology: wgpu::PrimitiveTopology,
    blend: Option<BlendState>,
    compare: CompareFunction,
    write: bool,
    bias: wgpu::DepthBiasState,
    color: wgpu::ColorWrites,
    cull: Option<wgpu::Face>,
}

/// Surfaces step back a little, so that what is drawn on them wins; more where they are seen at a grazing angle.
const STEP_BACK: wgpu::DepthBiasState = wgpu::DepthBiasState { constant: -4, slope_scale: -0.75, clamp: 0.0 };
const NO_BIAS: wgpu::DepthBiasState = wgpu::DepthBiasState { constant: 0, slope_scale: 0.0, clamp: 0.0 };

impl Pass {
    const BACKGROUND: Self = Self {
        topology: wgpu::PrimitiveTopology::TriangleList,
        blend: None,
        compare: CompareFunction::Always,
        write: false,
        bias: NO_BIAS,
        color: wgpu::ColorWrites::ALL,
        cull: None,
    };
    /// Closed bodies, seen from outside: depth first, then what has just that depth.
    const DEPTH: Self = Self {
        compare: CompareFunction::GreaterEqual,
        write: true,
        color: wgpu::ColorWrites::empty(),
        cull: Some(wgpu::Face::Back),
        ..Self::BACKGROUND
    };
    const BODY: Self = Self {
        compare: CompareFunction::Equal,
        write: false,
        color: wgpu::ColorWrites::ALL,
        blend: Some(BlendState::PREMULTIPLIED_ALPHA_BLENDING),
        ..Self::DEPTH
    };
    const OPAQUE: Self =
        Self { compare: CompareFunction::GreaterEqual, write: true, bias: STEP_BACK, ..Self::BACKGROUND };
    const TRANSLUCENT: Self =
        Self { blend: Some(BlendState::PREMULTIPLIED_ALPHA_BLENDING), write: false, ..Self::OPAQUE };

    const fn strips(compare: CompareFunction) -> Self {
        Self {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            blend: Some(BlendState::PREMULTIPLIED_ALPHA_BLENDING),
            compare,
            ..Self::BACKGROUND
        }
    }
}

struct Make<'a> {
    device: &'a wgpu::Device,
}

impl Make<'_> {
    fn pipeline(
        &self,
        label: &str,
        layout: &wgpu::PipelineLayout,
        module: &wgpu::ShaderModule,
        [vs, fs]: [&str; 2],
        buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
        pass: Pass,
    ) -> wgpu::RenderPipeline {
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(label),
            layout: Some(layout),
            vertex: wgpu::VertexState {
                module,
                entry_point: Some(vs),
                compilation_options: Default::default(),
                buffers,
            },
            primitive: wgpu::PrimitiveState { topology: pass.topology, cull_mode: pass.cull, ..Default::default() },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(pass.write),
                depth_compare: Some(pass.compare),
                stencil: Default::default(),
                bias: pass.bias,
            }),
            multisample: wgpu::MultisampleState { count: SAMPLES, ..Default::default() },
            fragment: Some(wgpu::FragmentState {
                module,
                entry_point: Some(fs),
                compilation_options: Default::default(),
                targets: &[Some(wgpu::ColorTargetState {
                    format: COLOR_FORMAT,
                    blend: pass.blend,
                    write_mask: pass.color,
                })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

fn blit(
    device: &wgpu::Device,
    screen: TextureFormat,
    layout: impl Fn(&str, &[Option<&wgpu::BindGroupLayout>]) -> wgpu::PipelineLayout,
    module: impl Fn(&str, String) -> wgpu::ShaderModule,
) -> (wgpu::BindGroupLayout, wgpu::Sampler, wgpu::RenderPipeline) {
    let entry =
        |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility: ShaderStages::FRAGMENT, ty, count: None };
    let texture = wgpu::BindingType::Texture {
        sample_type: wgpu::TextureSampleType::Float { filterable: true },
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let group = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("blit"),
        entries: &[entry(0, texture), entry(1, sampler)],
    });
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some("blit"),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..Default::default()
    });
    let module = module("blit", BLIT.to_owned());
    let pipeline_layout = layout("blit", &[Some(&group)]);
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("blit"),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vs"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(if screen.is_srgb() { "fs_linear" } else { "fs_encoded" }),
            compilation_options: Default::default(),
            targets: &[Some(screen.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    (group, sampler, pipeline)
}
