//! What a frame is drawn into: 4x multisampled colour and depth, and the resolved picture.

/// Format of the picture: sRGB in memory, linear when blended and sampled.
pub(super) const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
/// Depth is reversed: 1 near, 0 far.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Samples per pixel.
pub(super) const SAMPLES: u32 = 4;

/// The textures of one picture size.
#[derive(Debug)]
pub(super) struct Target {
    pub size: [u32; 2],
    pub multisampled: wgpu::TextureView,
    pub depth: wgpu::TextureView,
    pub picture: wgpu::Texture,
    pub picture_view: wgpu::TextureView,
}

impl Target {
    /// Textures of `size`, at least 1 x 1 and at most what the device can do.
    pub fn new(device: &wgpu::Device, size: [u32; 2]) -> Self {
        let size = Self::clamped(device, size);
        let texture = |label, format, sample_count, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage,
                view_formats: &[],
            })
        };
        let attachment = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let view = |t: &wgpu::Texture| t.create_view(&wgpu::TextureViewDescriptor::default());
        let picture = texture(
            "picture",
            COLOR_FORMAT,
            1,
            attachment | wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC,
        );
        Self {
            size,
            multisampled: view(&texture("multisampled colour", COLOR_FORMAT, SAMPLES, attachment)),
            depth: view(&texture("depth", DEPTH_FORMAT, SAMPLES, attachment)),
            picture_view: view(&picture),
            picture,
        }
    }

    /// The size that a target for `size` has on this device.
    pub fn clamped(device: &wgpu::Device, size: [u32; 2]) -> [u32; 2] {
        let most = device.limits().max_texture_dimension_2d;
        size.map(|s| s.clamp(1, most))
    }
}
