//! One picture on screen: targets, buffers, and the two halves of drawing: `prepare` renders the scene off screen,
//! `paint` copies it into the window's own pass.

use std::sync::Arc;
use std::time::Instant;

use super::cache::{Cache, Device};
use super::encode::{FrameStats, Groups, Plan};
use super::frame::FrameData;
use super::renderer::{FrameUniform, ITEM_STRIDE, ItemUniform, Renderer, SCALE_STRIDE, ScaleUniform};
use super::target::Target;

/// A growing uniform buffer with its bind group.
#[derive(Debug)]
struct Uniforms {
    buffer: wgpu::Buffer,
    group: wgpu::BindGroup,
    capacity: u64,
}

impl Uniforms {
    fn new(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, binding: usize, capacity: u64) -> Self {
        let buffer = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("uniforms"),
            size: capacity,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let resource = wgpu::BindingResource::Buffer(wgpu::BufferBinding {
            buffer: &buffer,
            offset: 0,
            size: wgpu::BufferSize::new(binding as u64),
        });
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("uniforms"),
            layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource }],
        });
        Self { buffer, group, capacity }
    }

    /// Makes room for `bytes`; the contents are lost when it grows.
    fn reserve(&mut self, device: &wgpu::Device, layout: &wgpu::BindGroupLayout, binding: usize, bytes: u64) {
        if bytes > self.capacity {
            *self = Self::new(device, layout, binding, bytes.next_power_of_two());
        }
    }
}

/// The state of one viewport on one device.
#[derive(Debug)]
pub struct Viewport {
    renderer: Arc<Renderer>,
    cache: Cache,
    target: Option<Target>,
    frame: Uniforms,
    items: Uniforms,
    scales: Uniforms,
    blit: Option<wgpu::BindGroup>,
    shown: Option<Arc<FrameData>>,
    staging: Vec<u8>,
    stats: FrameStats,
}

impl Viewport {
    /// An empty viewport.
    pub fn new(device: &wgpu::Device, renderer: Arc<Renderer>) -> Self {
        let item = size_of::<ItemUniform>();
        let scale = size_of::<ScaleUniform>();
        Self {
            cache: Cache::default(),
            target: None,
            frame: Uniforms::new(device, &renderer.frame_layout, size_of::<FrameUniform>(), 256),
            items: Uniforms::new(device, &renderer.item_layout, item, 64 * ITEM_STRIDE),
            scales: Uniforms::new(device, &renderer.scale_layout, scale, 4 * SCALE_STRIDE),
            blit: None,
            shown: None,
            staging: Vec::new(),
            stats: FrameStats::default(),
            renderer,
        }
    }

    /// Renders the scene into the viewport's own picture and returns the commands to submit. `None` when the picture
    /// already shows this very frame (the same `Arc`), which makes a frame in which only panels change free.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: &Arc<FrameData>,
    ) -> Option<wgpu::CommandBuffer> {
        if self.shown.as_ref().is_some_and(|shown| Arc::ptr_eq(shown, frame)) {
            return None;
        }
        self.shown = Some(frame.clone());
        let start = Instant::now();
        self.cache.begin();
        for item in &frame.meshes {
            self.cache.update_mesh(Device { device, queue }, item);
        }
        for item in &frame.lines {
            self.cache.update_lines(device, item);
        }
        for item in &frame.glyphs {
            self.cache.update_glyphs(device, item);
        }
        for item in &frame.volumes {
            self.cache.update_volumes(device, item);
        }
        if self.cache.rebuilt > 0 {
            log::debug!("{} buffers made in {:.1?}", self.cache.rebuilt, start.elapsed());
        }
        let size = self.resize(device, frame.size);
        let mut plan = Plan::new(frame, size, &self.cache);
        self.upload(device, queue, frame, size, &plan);

        let target = self.target.as_ref()?;
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("scene") });
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("scene"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target.multisampled,
                depth_slice: None,
                resolve_target: Some(&target.picture_view),
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Discard },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &target.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
                stencil_ops: None,
            }),
            ..Default::default()
        });
        let groups = Groups { frame: &self.frame.group, items: &self.items.group, scales: &self.scales.group };
        plan.record(&mut pass, &self.renderer, frame, &self.cache, &groups);
        drop(pass);
        self.stats = plan.stats;
        Some(encoder.finish())
    }

    fn resize(&mut self, device: &wgpu::Device, size: [u32; 2]) -> [u32; 2] {
        let size = Target::clamped(device, size);
        if self.target.as_ref().is_none_or(|t| t.size != size) {
            let target = Target::new(device, size);
            self.blit = Some(device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("blit"),
                layout: &self.renderer.blit_layout,
                entries: &[
                    wgpu::BindGroupEntry {
                        binding: 0,
                        resource: wgpu::BindingResource::TextureView(&target.picture_view),
                    },
                    wgpu::BindGroupEntry {
                        binding: 1,
                        resource: wgpu::BindingResource::Sampler(&self.renderer.sampler),
                    },
                ],
            }));
            self.target = Some(target);
        }
        size
    }

    fn upload(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, frame: &FrameData, size: [u32; 2], plan: &Plan) {
        queue.write_buffer(&self.frame.buffer, 0, bytemuck::bytes_of(&frame.uniform(size)));
        let bytes = strided(&mut self.staging, &plan.items, ITEM_STRIDE);
        let layout = &self.renderer.item_layout;
        self.items.reserve(device, layout, size_of::<ItemUniform>(), bytes.len() as u64);
        queue.write_buffer(&self.items.buffer, 0, bytes);
        let bytes = strided(&mut self.staging, &plan.scales, SCALE_STRIDE);
        let layout = &self.renderer.scale_layout;
        self.scales.reserve(device, layout, size_of::<ScaleUniform>(), bytes.len() as u64);
        queue.write_buffer(&self.scales.buffer, 0, bytes);
    }

    /// Copies the picture into a pass of the window, over the whole of the pass' current viewport.
    pub fn paint(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(group) = &self.blit {
            pass.set_pipeline(&self.renderer.blit);
            pass.set_bind_group(0, group, &[]);
            pass.draw(0..3, 0..1);
        }
    }

    /// The picture that `prepare` drew last: sRGB, 8 bits a channel.
    pub fn picture(&self) -> Option<&wgpu::Texture> {
        self.target.as_ref().map(|t| &t.picture)
    }

    /// What the last rendered frame cost.
    pub fn stats(&self) -> FrameStats {
        self.stats
    }
}

/// The values at their stride, in a buffer that is reused from frame to frame.
fn strided<'a, T: bytemuck::Pod>(staging: &'a mut Vec<u8>, values: &[T], stride: u64) -> &'a [u8] {
    let stride = stride as usize;
    staging.clear();
    staging.resize(values.len() * stride, 0);
    for (slot, value) in staging.chunks_exact_mut(stride).zip(values) {
        slot[..size_of::<T>()].copy_from_slice(bytemuck::bytes_of(value));
    }
    staging
}
