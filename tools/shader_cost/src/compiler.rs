//! Mesa's compiler for AMD hardware that is not there.
//!
//! With `RADV_FORCE_FAMILY` set, RADV opens a device of that family without hardware and compiles for it;
//! `VK_KHR_pipeline_executable_properties` tells what became of a pipeline. All `unsafe` of this program is here.

use std::collections::BTreeMap;
use std::ffi::{CStr, c_char};
use std::ptr::null_mut;

use ash::vk;

use crate::Error;

/// A device that compiles and never runs.
pub(crate) struct Compiler {
    device: ash::Device,
    executables: ash::khr::pipeline_executable_properties::Device,
    layout: vk::PipelineLayout,
    /// The driver's own words, such as `Mesa 22.3.6`.
    pub(crate) driver: String,
    // Dropped last: it holds the library that all others call into.
    _entry: ash::Entry,
}

/// What became of a shader.
pub(crate) struct Compiled {
    /// The compiler's numbers, by its names.
    pub(crate) statistics: BTreeMap<String, u64>,
    /// The compiler's last representation, one instruction a line.
    pub(crate) code: String,
    /// Lanes of a wave.
    pub(crate) wave: u32,
}

/// Buffers of group 0 that a shader may use: storage, and one uniform after them.
const STORAGE_BUFFERS: u32 = 2;

impl Compiler {
    /// Opens the device that the environment asks for.
    pub(crate) fn open() -> Result<Self, Error> {
        // SAFETY: the Vulkan loader is a sound library; every handle below is used on the device it came from, every
        // structure outlives the call it is passed to, and the unchained feature structures hold no dangling pointers.
        unsafe {
            let entry =
                ash::Entry::load().map_err(|e| format!("there is no Vulkan loader (libvulkan1): {e}"))?;
            let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
            let instance = entry
                .create_instance(&vk::InstanceCreateInfo::default().application_info(&application), None)?;
            let physical =
                *instance.enumerate_physical_devices()?.first().ok_or("the driver knows no such family")?;

            let mut driver_properties = vk::PhysicalDeviceDriverProperties::default();
            let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver_properties);
            instance.get_physical_device_properties2(physical, &mut properties);
            let driver = text(&driver_properties.driver_info);

            let mut wanted = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default()
                .pipeline_executable_info(true);
            let priorities = [1.0];
            let queues = [vk::DeviceQueueCreateInfo::default().queue_priorities(&priorities)];
            let extensions = [ash::khr::pipeline_executable_properties::NAME.as_ptr()];
            let device = instance.create_device(
                physical,
                &vk::DeviceCreateInfo::default()
                    .queue_create_infos(&queues)
                    .enabled_extension_names(&extensions)
                    .push_next(&mut wanted),
                None,
            )?;
            let executables = ash::khr::pipeline_executable_properties::Device::new(&instance, &device);

            let binding = |i: u32| {
                // After the buffers a texture and its sampler.
                let kind = match i.checked_sub(STORAGE_BUFFERS) {
                    None => vk::DescriptorType::STORAGE_BUFFER,
                    Some(0) => vk::DescriptorType::UNIFORM_BUFFER,
                    Some(1) => vk::DescriptorType::SAMPLED_IMAGE,
                    Some(_) => vk::DescriptorType::SAMPLER,
                };
                vk::DescriptorSetLayoutBinding::default()
                    .binding(i)
                    .descriptor_count(1)
                    .descriptor_type(kind)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            };
            let bindings: Vec<_> = (0..=STORAGE_BUFFERS + 2).map(binding).collect();
            let set = device.create_descriptor_set_layout(
                &vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings),
                None,
            )?;
            let layout = device
                .create_pipeline_layout(&vk::PipelineLayoutCreateInfo::default().set_layouts(&[set]), None)?;
            Ok(Self { device, executables, layout, driver, _entry: entry })
        }
    }

    /// Compiles the entry point `main` of a compute shader.
    pub(crate) fn compile(&self, spirv: &[u32]) -> Result<Compiled, Error> {
        // SAFETY: `spirv` was validated by naga, uses no binding but those of the layout, and handles are this
        // device's own; the union of a statistic is read as its format says.
        unsafe {
            let module =
                self.device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(spirv), None)?;
            let stage = vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::COMPUTE)
                .module(module)
                .name(c"main");
            let info = vk::ComputePipelineCreateInfo::default()
                .flags(
                    vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR
                        | vk::PipelineCreateFlags::CAPTURE_INTERNAL_REPRESENTATIONS_KHR,
                )
                .layout(self.layout)
                .stage(stage);
            let pipelines = self.device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None);
            let pipeline = pipelines.map_err(|(_, e)| e)?[0];

            let properties = vk::PipelineInfoKHR::default().pipeline(pipeline);
            let properties = self.executables.get_pipeline_executable_properties(&properties)?;
            let wave = properties.first().ok_or("the driver compiled nothing")?.subgroup_size;
            let executable = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline);
            let mut statistics = BTreeMap::new();
            for statistic in self.executables.get_pipeline_executable_statistics(&executable)? {
                let value = match statistic.format {
                    vk::PipelineExecutableStatisticFormatKHR::UINT64 => statistic.value.u64,
                    _ => continue,
                };
                statistics.insert(text(&statistic.name), value);
            }
            let code = self.code(&executable)?;
            self.device.destroy_pipeline(pipeline, None);
            self.device.destroy_shader_module(module, None);
            Ok(Compiled { statistics, code, wave })
        }
    }

    /// The representation whose name says ACO, which is the compiler's.
    fn code(&self, executable: &vk::PipelineExecutableInfoKHR<'_>) -> Result<String, Error> {
        let get = self.executables.fp().get_pipeline_executable_internal_representations_khr;
        let device = self.executables.device();
        // SAFETY: first the number, then the sizes, then the texts, each into memory of the size just told.
        unsafe {
            let mut count = 0;
            get(device, executable, &mut count, null_mut()).result()?;
            let mut found = vec![vk::PipelineExecutableInternalRepresentationKHR::default(); count as usize];
            get(device, executable, &mut count, found.as_mut_ptr()).result()?;
            let mut texts: Vec<Vec<u8>> = found.iter().map(|r| vec![0; r.data_size]).collect();
            for (representation, text) in found.iter_mut().zip(&mut texts) {
                representation.p_data = text.as_mut_ptr().cast();
            }
            get(device, executable, &mut count, found.as_mut_ptr()).result()?;
            let aco = found.iter().zip(&texts).find(|(r, _)| text(&r.name).contains("ACO"));
            let (_, code) = aco.ok_or("the driver shows no ACO code")?;
            Ok(String::from_utf8_lossy(code).trim_end_matches('\0').to_owned())
        }
    }
}

fn text(characters: &[c_char]) -> String {
    // SAFETY: Vulkan ends its fixed arrays of characters with a zero.
    unsafe { CStr::from_ptr(characters.as_ptr()) }.to_string_lossy().into_owned()
}
