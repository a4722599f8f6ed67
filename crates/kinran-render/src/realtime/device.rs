//! A GPU without a window.

use crate::Error;

/// A device and its queue.
#[derive(Clone, Debug)]
pub struct Gpu {
    /// Makes resources.
    pub device: wgpu::Device,
    /// Takes commands.
    pub queue: wgpu::Queue,
}

/// What is used where the device has it: block-compressed textures, and a clock for passes.
pub fn wanted_features(adapter: &wgpu::Adapter) -> wgpu::Features {
    adapter.features() & (wgpu::Features::TEXTURE_COMPRESSION_BC | wgpu::Features::TIMESTAMP_QUERY)
}

impl Gpu {
    /// The first Vulkan device there is, a real one before a software one.
    ///
    /// # Errors
    /// [`Error::Gpu`] where there is none; Mesa's lavapipe is one that needs no hardware.
    pub fn open() -> Result<Self, Error> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = wgpu::Backends::VULKAN;
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            ..Default::default()
        };
        let adapter = pollster::block_on(wgpu::Instance::new(descriptor).request_adapter(&options)).map_err(|e| {
            Error::Gpu(format!(
                "there is no Vulkan device ({e}); install a driver (in Debian, mesa-vulkan-drivers draws without a \
                 GPU), or use the CPU"
            ))
        })?;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("kinran"),
            required_features: wanted_features(&adapter),
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| {
            Error::Gpu(format!("the Vulkan device {} cannot be used: {e}", adapter.get_info().name))
        })?;
        Ok(Self { device, queue })
    }
}
