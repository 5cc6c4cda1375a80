//! Pictures without a window.

use std::sync::Arc;

use image::RgbaImage;

use super::FrameStats;
use super::frame::FrameData;
use super::gpu::Gpu;
use super::renderer::Renderer;
use super::target::COLOR_FORMAT;
use super::viewport::Viewport;

/// Why a frame did not become a picture.
#[derive(Debug, thiserror::Error)]
pub enum OffscreenError {
    /// The picture is larger than the device's textures.
    #[error("a picture of {} x {} pixels was asked for, this GPU makes at most {most} x {most}", size[0], size[1])]
    TooLarge {
        /// What was asked for.
        size: [u32; 2],
        /// The longest side there can be.
        most: u32,
    },
    /// The GPU did not hand the pixels over.
    #[error("the GPU did not return the picture: {0}")]
    ReadBack(String),
}

/// Renders frames to images. Buffers stay between frames, so a sequence costs only what changes.
#[derive(Debug)]
pub struct Offscreen {
    gpu: Gpu,
    viewport: Viewport,
}

impl Offscreen {
    /// Compiles the pipelines on this GPU.
    pub fn new(gpu: Gpu) -> Self {
        let renderer = Arc::new(Renderer::new(&gpu.device, COLOR_FORMAT));
        let viewport = Viewport::new(&gpu.device, renderer);
        Self { gpu, viewport }
    }

    /// The GPU that draws.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// What the last frame cost.
    pub fn stats(&self) -> FrameStats {
        self.viewport.stats()
    }

    /// The CPU's share of a frame; the commands are for [`Gpu::queue`]. `None` when the picture is already there.
    pub fn encode(&mut self, frame: &Arc<FrameData>) -> Option<wgpu::CommandBuffer> {
        self.viewport.prepare(&self.gpu.device, &self.gpu.queue, frame)
    }

    /// Renders without reading back: submits the frame and returns at once.
    pub fn submit(&mut self, frame: &Arc<FrameData>) {
        let commands = self.encode(frame);
        self.gpu.queue.submit(commands);
    }

    /// Waits until everything submitted is drawn.
    pub fn wait(&self) {
        if let Err(e) = self.gpu.device.poll(wgpu::PollType::wait_indefinitely()) {
            log::warn!("waiting for the GPU: {e}");
        }
    }

    /// Renders a frame at its own size.
    pub fn render(&mut self, frame: &Arc<FrameData>) -> Result<RgbaImage, OffscreenError> {
        let most = self.gpu.device.limits().max_texture_dimension_2d;
        let size @ [width, height] = frame.size.map(|s| s.max(1));
        if width > most || height > most {
            return Err(OffscreenError::TooLarge { size, most });
        }
        self.submit(frame);
        let picture = self.viewport.picture().ok_or_else(|| OffscreenError::ReadBack("nothing was drawn".into()))?;

        let row = (width * 4).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = self.gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("read back"),
            size: u64::from(row) * u64::from(height),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        encoder.copy_texture_to_buffer(
            picture.as_image_copy(),
            wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
            wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        );
        self.gpu.queue.submit([encoder.finish()]);

        let fail = |e: &dyn std::fmt::Display| OffscreenError::ReadBack(e.to_string());
        let (send, receive) = std::sync::mpsc::channel();
        buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
            // The receiver waits below; if it is gone, nobody wants the answer.
            let _ = send.send(result);
        });
        self.gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| fail(&e))?;
        receive.recv().map_err(|e| fail(&e))?.map_err(|e| fail(&e))?;
        let mapped = buffer.slice(..).get_mapped_range().map_err(|e| fail(&e))?;
        let mut pixels = Vec::with_capacity(width as usize * height as usize * 4);
        for line in mapped.chunks_exact(row as usize) {
            pixels.extend_from_slice(&line[..width as usize * 4]);
        }
        RgbaImage::from_raw(width, height, pixels).ok_or_else(|| fail(&"the picture has the wrong size"))
    }
}
