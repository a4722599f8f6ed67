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

/// What is used where the device has it: block-compressed textures, and a clock for passes. A software device decodes blocks
/// texel by texel, each time it reads one, and is better off with decoded textures.
pub fn wanted_features(adapter: &wgpu::Adapter) -> wgpu::Features {
    let blocks = match adapter.get_info().device_type {
        wgpu::DeviceType::Cpu => wgpu::Features::empty(),
        _ => wgpu::Features::TEXTURE_COMPRESSION_BC,
    };
    adapter.features() & (blocks | wgpu::Features::TIMESTAMP_QUERY)
}

impl Gpu {
    /// The first Vulkan device there is, a real one before a software one.
    ///
    /// # Errors
    /// [`Error::Gpu`] where there is none; Mesa's lavapipe is one that needs no hardware.
    pub fn open() -> Result<Self, Error> {
        Self::open_with(wanted_features)
    }

    /// The same with other features than [`wanted_features`].
    ///
    /// # Errors
    /// As [`Self::open`], and [`Error::Gpu`] where the device lacks one of them.
    pub fn open_with(features: impl Fn(&wgpu::Adapter) -> wgpu::Features) -> Result<Self, Error> {
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
            required_features: features(&adapter),
            required_limits: adapter.limits(),
            ..Default::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| {
            Error::Gpu(format!("the Vulkan device {} cannot be used: {e}", adapter.get_info().name))
        })?;
        Ok(Self { device, queue })
    }
}

/// The bytes of a buffer that the device was told to fill, once it has.
pub(super) fn read_back(gpu: &Gpu, buffer: &wgpu::Buffer) -> Result<Vec<u8>, Error> {
    let failed =
        |e: &dyn std::fmt::Display| Error::Gpu(format!("the device does not give back its results: {e}"));
    let (sender, receiver) = std::sync::mpsc::channel();
    buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
        // The receiver waits below.
        let _ = sender.send(result);
    });
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).map_err(|e| failed(&e))?;
    receiver.recv().map_err(|e| failed(&e))?.map_err(|e| failed(&e))?;
    Ok(buffer.slice(..).get_mapped_range().map_err(|e| failed(&e))?.to_vec())
}
