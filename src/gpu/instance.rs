//! The Vulkan library and instance, with the validation layer where it is asked for.

use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex, PoisonError};

use ash::{ext, vk};

use crate::{Error, Result};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// What to do where no Vulkan device is found.
pub(super) const INSTALL: &str = "install a Vulkan driver (Debian, Ubuntu: apt install libvulkan1 mesa-vulkan-drivers; \
     without a GPU these bring lavapipe, which runs on the CPU)";

type Messages = Mutex<Vec<String>>;

/// A Vulkan instance; destroyed after everything made from it.
pub(super) struct Instance {
    pub raw: ash::Instance,
    pub messages: Arc<Messages>,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// Keeps the library loaded.
    _entry: ash::Entry,
}

impl Instance {
    /// Loads libvulkan. Fails with [`Error::NoDevice`] where there is none, or one older than 1.2.
    pub fn new(validate: bool) -> Result<Self> {
        // SAFETY: libvulkan is trusted to run its initialisers.
        let entry = unsafe { ash::Entry::load() }
            .map_err(|e| Error::NoDevice(format!("no Vulkan loader ({e}): {INSTALL}")))?;
        // SAFETY: no preconditions.
        let version = unsafe { entry.try_enumerate_instance_version() };
        if version.ok().flatten().unwrap_or(vk::API_VERSION_1_0) < vk::API_VERSION_1_2 {
            return Err(Error::NoDevice(format!(
                "the Vulkan loader is older than 1.2: {INSTALL}"
            )));
        }
        let validate = validate && has_layer(&entry);
        let layers = [VALIDATION_LAYER.as_ptr()];
        let extensions = [ext::debug_utils::NAME.as_ptr()];
        let application = vk::ApplicationInfo::default()
            .application_name(c"lightfall")
            .api_version(vk::API_VERSION_1_2);
        let mut info = vk::InstanceCreateInfo::default().application_info(&application);
        let messages = Arc::new(Messages::default());
        // Chained, so that faults of creation and destruction are seen too.
        let mut reporter = messenger_info(&messages);
        if validate {
            info = info
                .enabled_layer_names(&layers)
                .enabled_extension_names(&extensions)
                .push_next(&mut reporter);
        }
        // SAFETY: all pointers of `info` outlive the call.
        let raw = unsafe { entry.create_instance(&info, None) }
            .map_err(|e| Error::NoDevice(format!("vkCreateInstance: {e}; {INSTALL}")))?;
        let mut instance = Self {
            raw,
            messages,
            messenger: None,
            _entry: entry,
        };
        if validate {
            let utils = ext::debug_utils::Instance::new(&instance._entry, &instance.raw);
            let info = messenger_info(&instance.messages);
            // SAFETY: `messages` lives as long as the messenger (see drop).
            let messenger = unsafe { utils.create_debug_utils_messenger(&info, None) }
                .map_err(|e| Error::NoDevice(format!("vkCreateDebugUtilsMessengerEXT: {e}")))?;
            instance.messenger = Some((utils, messenger));
        }
        Ok(instance)
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: the device, which holds this, destroyed all of its objects before.
        unsafe {
            if let Some((utils, messenger)) = self.messenger.take() {
                utils.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

fn has_layer(entry: &ash::Entry) -> bool {
    // SAFETY: no preconditions.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }.unwrap_or_default();
    layers
        .iter()
        .any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION_LAYER))
}

fn messenger_info(messages: &Arc<Messages>) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    use vk::{
        DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type,
    };
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::VALIDATION)
        .pfn_user_callback(Some(collect))
        .user_data(Arc::as_ptr(messages).cast_mut().cast())
}

unsafe extern "system" fn collect(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: `user` is the Arc's `Messages` (messenger_info), which the instance keeps; the layer
    // gives valid data for the time of the call.
    unsafe {
        if let (Some(data), Some(messages)) = (data.as_ref(), user.cast::<Messages>().as_ref()) {
            let text = data.message_as_c_str().unwrap_or(c"").to_string_lossy();
            let mut messages = messages.lock().unwrap_or_else(PoisonError::into_inner);
            messages.push(text.into_owned());
        }
    }
    vk::FALSE
}
