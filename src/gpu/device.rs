//! Choosing and opening a device.

use std::mem::ManuallyDrop;
use std::sync::atomic::AtomicUsize;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};

use super::info::{DeviceInfo, describe};
use super::instance::{INSTALL, Instance};
use super::recorder::Recorder;
use crate::{Error, Result};

/// How to open a device.
#[derive(Debug, Clone, Copy, Default)]
pub struct OpenOptions<'a> {
    /// Index or case-insensitive part of the name; `None`: the best one.
    pub device: Option<&'a str>,
    /// Load the Khronos validation layer where it is installed.
    pub validate: bool,
}

/// An open device. Clones share it; all that is made from it keeps it alive.
#[derive(Clone)]
pub struct Gpu {
    pub(super) shared: Arc<Shared>,
}

/// What every resource holds on to.
pub(super) struct Shared {
    pub info: DeviceInfo,
    pub device: ash::Device,
    /// Present where `info.caps.traces_structures()`.
    pub accel: Option<khr::acceleration_structure::Device>,
    /// Present where `info.caps.ray_tracing_pipeline`.
    pub pipelines: Option<khr::ray_tracing_pipeline::Device>,
    pub queue: Mutex<vk::Queue>,
    /// Idle recorders, for reuse.
    pub recorders: Mutex<Vec<Recorder>>,
    /// Submissions that nobody waited for yet.
    pub running: AtomicUsize,
    /// Dropped before the device.
    allocator: ManuallyDrop<Mutex<Allocator>>,
    /// Dropped last: fields drop after `Shared::drop`.
    instance: Instance,
}

/// All Vulkan devices, usable or not, in the driver's order.
///
/// Fails with [`Error::NoDevice`] where Vulkan is not installed or sees no device.
pub fn devices() -> Result<Vec<DeviceInfo>> {
    let listed = list(&Instance::new(false)?)?;
    Ok(listed.into_iter().map(|(_, info)| info).collect())
}

impl Gpu {
    /// Opens the asked-for or best usable device.
    ///
    /// Fails with [`Error::NoDevice`] where none is usable, [`Error::Option`] where `--device` names
    /// none, [`Error::Device`] where the named one lacks something or fails.
    pub fn open(options: &OpenOptions) -> Result<Self> {
        let (instance, physical, info) = find(options)?;
        Self::create(instance, physical, info)
    }

    /// The best usable device under the validation layer, said to be another.
    #[cfg(test)]
    pub(crate) fn open_as(edit: impl FnOnce(&mut DeviceInfo)) -> Self {
        let options = OpenOptions {
            device: None,
            validate: true,
        };
        let (instance, physical, mut info) = find(&options).unwrap();
        edit(&mut info);
        Self::create(instance, physical, info).unwrap()
    }

    pub fn info(&self) -> &DeviceInfo {
        &self.shared.info
    }

    /// Warnings and errors of the validation layer so far; empty without the layer.
    pub fn validation_messages(&self) -> Vec<String> {
        lock(&self.shared.instance.messages).clone()
    }

    pub(super) fn create(
        instance: Instance,
        physical: vk::PhysicalDevice,
        info: DeviceInfo,
    ) -> Result<Self> {
        let caps = &info.caps;
        let mut f12 = vk::PhysicalDeviceVulkan12Features::default()
            .buffer_device_address(true)
            .scalar_block_layout(true);
        if caps.descriptor_indexing {
            f12 = f12
                .descriptor_indexing(true)
                .runtime_descriptor_array(true)
                .shader_sampled_image_array_non_uniform_indexing(true)
                .descriptor_binding_sampled_image_update_after_bind(true);
        }
        let mut accel = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default()
            .acceleration_structure(true);
        let mut query = vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(true);
        let mut pipeline =
            vk::PhysicalDeviceRayTracingPipelineFeaturesKHR::default().ray_tracing_pipeline(true);
        let mut subgroups = vk::PhysicalDeviceSubgroupSizeControlFeatures::default()
            .subgroup_size_control(true)
            .compute_full_subgroups(true);
        let mut extensions = Vec::new();
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(caps.queue_family)
            .queue_priorities(&[1.0])];
        let basic = vk::PhysicalDeviceFeatures::default().shader_int64(true);
        let mut create = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_features(&basic)
            .push_next(&mut f12);
        if caps.traces_structures() {
            extensions.push(khr::acceleration_structure::NAME.as_ptr());
            extensions.push(khr::deferred_host_operations::NAME.as_ptr());
            create = create.push_next(&mut accel);
        }
        if caps.ray_query {
            extensions.push(khr::ray_query::NAME.as_ptr());
            create = create.push_next(&mut query);
        }
        if caps.ray_tracing_pipeline {
            extensions.push(khr::ray_tracing_pipeline::NAME.as_ptr());
            create = create.push_next(&mut pipeline);
        }
        if caps.subgroup_control {
            extensions.push(ext::subgroup_size_control::NAME.as_ptr());
            create = create.push_next(&mut subgroups);
        }
        create = create.enabled_extension_names(&extensions);
        // SAFETY: features and extensions were reported by the device; pointers outlive the call.
        let device = unsafe { instance.raw.create_device(physical, &create, None) }
            .map_err(|e| fault(&info.name, "vkCreateDevice", e))?;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: device.clone(),
            physical_device: physical,
            debug_settings: Default::default(),
            buffer_device_address: true,
            allocation_sizes: Default::default(),
        });
        let allocator = match allocator {
            Ok(allocator) => ManuallyDrop::new(Mutex::new(allocator)),
            Err(e) => {
                // SAFETY: nothing was made from the device.
                unsafe { device.destroy_device(None) };
                return Err(Error::Device {
                    device: info.name,
                    fault: format!("memory allocator: {e}"),
                });
            }
        };
        let accel = caps
            .traces_structures()
            .then(|| khr::acceleration_structure::Device::new(&instance.raw, &device));
        let pipelines = caps
            .ray_tracing_pipeline
            .then(|| khr::ray_tracing_pipeline::Device::new(&instance.raw, &device));
        // SAFETY: the one queue asked for above.
        let queue = unsafe { device.get_device_queue(caps.queue_family, 0) };
        Ok(Self {
            shared: Arc::new(Shared {
                info,
                device,
                accel,
                pipelines,
                queue: Mutex::new(queue),
                recorders: Mutex::default(),
                running: AtomicUsize::new(0),
                allocator,
                instance,
            }),
        })
    }
}

impl Shared {
    /// Turns the failure of `operation` into an error that names both and says what to do.
    pub fn fault<'a>(&'a self, operation: &'a str) -> impl FnOnce(vk::Result) -> Error + 'a {
        move |result| fault(&self.info.name, operation, result)
    }

    /// A fault in words.
    pub fn error(&self, fault: impl Into<String>) -> Error {
        Error::Device {
            device: self.info.name.clone(),
            fault: fault.into(),
        }
    }

    /// Where passes run.
    pub fn pass_stages(&self) -> vk::PipelineStageFlags {
        match self.pipelines {
            Some(_) => {
                vk::PipelineStageFlags::COMPUTE_SHADER
                    | vk::PipelineStageFlags::RAY_TRACING_SHADER_KHR
            }
            None => vk::PipelineStageFlags::COMPUTE_SHADER,
        }
    }

    pub fn allocator(&self) -> MutexGuard<'_, Allocator> {
        lock(&self.allocator)
    }
}

impl Drop for Shared {
    fn drop(&mut self) {
        // SAFETY: every resource held an Arc of this, so all are gone; submits are waited for, and
        // the wait covers one that failed halfway. The allocator is not used again.
        unsafe {
            let _ = self.device.device_wait_idle();
            for recorder in lock(&self.recorders).drain(..) {
                recorder.destroy(&self.device);
            }
            ManuallyDrop::drop(&mut self.allocator);
            self.device.destroy_device(None);
        }
    }
}

/// A poisoned lock is used on: what it guards stays valid between statements.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn fault(device: &str, operation: &str, result: vk::Result) -> Error {
    let advice = match result {
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => {
            "out of device memory; use fewer --photons, a smaller --size or another --device"
        }
        vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
            "out of host memory; use fewer --photons or a smaller --size"
        }
        vk::Result::ERROR_DEVICE_LOST => {
            "the device was lost (the driver reset it: a pass took too long, or a fault); use fewer \
             --photons or a smaller --size, update the driver, or use another --device"
        }
        vk::Result::ERROR_TOO_MANY_OBJECTS => "too many objects; the driver is used up",
        _ => "",
    };
    let fault = if advice.is_empty() {
        format!("{operation}: {result}")
    } else {
        format!("{operation}: {advice}")
    };
    Error::Device {
        device: device.to_owned(),
        fault,
    }
}

/// The asked-for or best usable device.
pub(super) fn find(options: &OpenOptions) -> Result<(Instance, vk::PhysicalDevice, DeviceInfo)> {
    let instance = Instance::new(options.validate)?;
    let listed = list(&instance)?;
    let infos: Vec<_> = listed.iter().map(|(_, info)| info.clone()).collect();
    let index = choose(&infos, options.device)?;
    match listed.into_iter().nth(index) {
        Some((physical, info)) => Ok((instance, physical, info)),
        None => Err(Error::NoDevice(INSTALL.to_owned())),
    }
}

fn list(instance: &Instance) -> Result<Vec<(vk::PhysicalDevice, DeviceInfo)>> {
    // SAFETY: no preconditions.
    let physical = unsafe { instance.raw.enumerate_physical_devices() }
        .map_err(|e| Error::NoDevice(format!("vkEnumeratePhysicalDevices: {e}; {INSTALL}")))?;
    if physical.is_empty() {
        return Err(Error::NoDevice(format!("no Vulkan device: {INSTALL}")));
    }
    let described = |(index, physical)| (physical, describe(instance, physical, index));
    Ok(physical.into_iter().enumerate().map(described).collect())
}

/// The index in `infos` of the wanted device, or of the best usable one.
fn choose(infos: &[DeviceInfo], wanted: Option<&str>) -> Result<usize> {
    let Some(wanted) = wanted else {
        let usable = infos.iter().filter(|info| info.usable());
        return match usable.min_by_key(|info| info.kind) {
            Some(best) => Ok(best.index),
            None => Err(Error::NoDevice(format!(
                "no usable Vulkan device ({}): {INSTALL}, or a newer one",
                infos
                    .iter()
                    .map(shortcomings)
                    .collect::<Vec<_>>()
                    .join("; ")
            ))),
        };
    };
    let by_index = wanted.parse().ok().filter(|index| *index < infos.len());
    let lower = wanted.to_lowercase();
    let by_name = || {
        infos
            .iter()
            .position(|info| !lower.is_empty() && info.name.to_lowercase().contains(&lower))
    };
    let index = by_index.or_else(by_name).ok_or_else(|| Error::Option {
        option: "--device",
        fault: format!("no device is called {wanted:?}; there are {}", names(infos)),
    })?;
    match infos.get(index) {
        Some(info) if info.usable() => Ok(index),
        Some(info) => Err(Error::Device {
            device: info.name.clone(),
            fault: format!(
                "lacks {}; update its driver or use another --device",
                info.caps.missing.join(", ")
            ),
        }),
        None => Err(Error::NoDevice(INSTALL.to_owned())),
    }
}

fn shortcomings(info: &DeviceInfo) -> String {
    format!("{} lacks {}", info.name, info.caps.missing.join(", "))
}

fn names(infos: &[DeviceInfo]) -> String {
    let names: Vec<_> = infos
        .iter()
        .map(|info| format!("{} ({})", info.index, info.name))
        .collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::super::{DeviceKind, TextureData};
    use super::*;
    use crate::{scene::Wrap, shaders};

    /// The validation layer reports, when the device goes, what is still there.
    #[test]
    fn nothing_outlives_the_device() {
        let options = OpenOptions {
            device: None,
            validate: true,
        };
        let (instance, physical, info) = find(&options).unwrap();
        let messages = instance.messages.clone();
        let gpu = Gpu::create(instance, physical, info).unwrap();
        let caps = gpu.info().caps.clone();
        let buffer = gpu.upload("words", &[0u32; 100]).unwrap();
        let spirv = shaders::spirv("doctor.addresses").unwrap();
        let texture = TextureData {
            width: 1,
            height: 1,
            rgba8: &[0; 4],
            srgb: true,
            wrap: [Wrap::Mirror; 2],
            nearest: false,
        };
        let textures = caps
            .descriptor_indexing
            .then(|| gpu.texture_array(&[texture; 3]).unwrap());
        let pass = gpu.pass("pass", spirv, &[], textures.as_ref()).unwrap();
        let structures = caps.ray_query.then(|| {
            let blas = gpu.triangle_blas("triangles", &[]).unwrap();
            (blas, gpu.box_blas("boxes", 5), gpu.tlas("tlas", 5))
        });
        let mut commands = gpu.commands().unwrap();
        commands.fill(&buffer, 1);
        let mut never_submitted = gpu.commands().unwrap();
        never_submitted.fill(&buffer, 2);
        commands.submit().unwrap();
        let device = Arc::downgrade(&gpu.shared);
        drop((gpu, textures, pass, structures, never_submitted));
        assert!(device.upgrade().is_some(), "the buffer keeps the device");
        drop(buffer);
        assert!(device.upgrade().is_none());
        assert_eq!(*lock(&messages), Vec::<String>::new());
    }

    fn info(index: usize, name: &str, kind: DeviceKind, missing: Vec<&'static str>) -> DeviceInfo {
        DeviceInfo {
            index,
            name: name.to_owned(),
            driver: String::new(),
            kind,
            api_version: (1, 3, 0),
            caps: crate::gpu::Caps {
                missing,
                ..Default::default()
            },
        }
    }

    #[test]
    fn the_best_usable_device_is_chosen() {
        use DeviceKind::{Cpu, Discrete, Integrated};
        let infos = [
            info(0, "llvmpipe", Cpu, vec![]),
            info(1, "Old 9800", Discrete, vec!["scalarBlockLayout"]),
            info(2, "Arc 770", Discrete, vec![]),
            info(3, "Iris 2", Integrated, vec![]),
        ];
        assert_eq!(choose(&infos, None).unwrap(), 2);
        assert_eq!(choose(&infos[..2], None).unwrap(), 0);
        assert_eq!(choose(&infos, Some("iris")).unwrap(), 3);
        // An index wins over a name; a number that is no index is part of a name.
        assert_eq!(choose(&infos, Some("0")).unwrap(), 0);
        assert_eq!(choose(&infos, Some("770")).unwrap(), 2);
        let lacking = choose(&infos, Some("9800")).unwrap_err().to_string();
        assert!(choose(&infos, Some("")).is_err());
        assert!(lacking.contains("Old 9800") && lacking.contains("scalarBlockLayout"));
        let none = choose(&infos[1..2], None).unwrap_err();
        assert!(matches!(&none, Error::NoDevice(text) if text.contains("mesa-vulkan-drivers")));
    }
}
