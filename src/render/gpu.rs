//! A GPU without a window.

use wgpu::{Backends, DeviceType};

/// Why there is no GPU to draw with.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No adapter answered.
    #[error("no Vulkan adapter ({0}); a software one is enough (Debian: mesa-vulkan-drivers)")]
    NoAdapter(String),
    /// The adapter gave no device.
    #[error("adapter {adapter} gives no device: {source}")]
    NoDevice {
        /// The adapter's name.
        adapter: String,
        /// What it says.
        source: wgpu::RequestDeviceError,
    },
}

/// A device and its queue, opened without a window. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// Makes buffers, textures and pipelines.
    pub device: wgpu::Device,
    /// Takes commands.
    pub queue: wgpu::Queue,
    /// The adapter's name and kind, for reports.
    pub name: String,
    /// Whether the adapter is a CPU.
    pub software: bool,
}

impl Gpu {
    /// Opens the best adapter there is (`WGPU_BACKEND` chooses the interface, Vulkan is the default; hardware before
    /// software).
    pub fn headless() -> Result<Self, GpuError> {
        pollster::block_on(Self::open())
    }

    async fn open() -> Result<Self, GpuError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
        descriptor.backends = Backends::from_env().unwrap_or(Backends::VULKAN | Backends::METAL | Backends::DX12);
        let backends = descriptor.backends;
        let instance = wgpu::Instance::new(descriptor);
        let rank = |a: &wgpu::Adapter| match a.get_info().device_type {
            DeviceType::DiscreteGpu => 0,
            DeviceType::IntegratedGpu => 1,
            DeviceType::VirtualGpu => 2,
            DeviceType::Other => 3,
            DeviceType::Cpu => 4,
        };
        let adapter = instance.enumerate_adapters(backends).await.into_iter().min_by_key(rank);
        let adapter = adapter.ok_or_else(|| GpuError::NoAdapter(format!("looked through {backends:?}")))?;
        let info = adapter.get_info();
        let name = format!("{} ({:?})", info.name, info.backend);
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("patchwright"),
            required_limits: wgpu::Limits::downlevel_defaults().using_resolution(adapter.limits()),
            ..Default::default()
        };
        let (device, queue) = adapter
            .request_device(&descriptor)
            .await
            .map_err(|source| GpuError::NoDevice { adapter: name.clone(), source })?;
        Ok(Self { device, queue, name, software: info.device_type == DeviceType::Cpu })
    }
}
