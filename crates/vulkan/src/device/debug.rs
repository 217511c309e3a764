//! What the validation layers say.

use crate::error::{During, Result};
use ash::{ext, vk};
use std::ffi::{CStr, c_void};
use std::sync::Mutex;

/// Messages of the validation layers: none is the only good number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Messages {
    /// How many there were.
    pub count: u64,
    /// The first ones.
    pub first: Vec<String>,
}

/// How many are kept.
const KEPT: usize = 20;

static MESSAGES: Mutex<Messages> = Mutex::new(Messages { count: 0, first: Vec::new() });

/// Takes messages while it lives.
pub(super) struct Messenger {
    loader: ext::debug_utils::Instance,
    handle: vk::DebugUtilsMessengerEXT,
}

pub(super) fn create_info() -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    use vk::{DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type};
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::VALIDATION)
        .pfn_user_callback(Some(take))
}

impl Messenger {
    pub fn new(entry: &ash::Entry, instance: &ash::Instance) -> Result<Self> {
        let loader = ext::debug_utils::Instance::new(entry, instance);
        // SAFETY: the instance was made with the extension.
        let handle = unsafe { loader.create_debug_utils_messenger(&create_info(), None) }
            .during("cannot listen to the validation layers")?;
        Ok(Self { loader, handle })
    }

    /// Those of all devices of this process so far.
    pub fn messages(&self) -> Messages {
        MESSAGES.lock().unwrap_or_else(std::sync::PoisonError::into_inner).clone()
    }
}

impl Drop for Messenger {
    fn drop(&mut self) {
        // SAFETY: it was made by this loader, and the instance still lives.
        unsafe { self.loader.destroy_debug_utils_messenger(self.handle, None) };
    }
}

/// # Safety
/// Called by the loader, with data that lives until it returns.
unsafe extern "system" fn take(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    _: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: see above; a message that is not null ends with a zero.
    let text =
        unsafe { data.as_ref().filter(|data| !data.p_message.is_null()).map(|data| CStr::from_ptr(data.p_message)) };
    let text = text.map_or_else(String::new, |text| text.to_string_lossy().into_owned());
    tracing::error!(?severity, "validation: {text}");
    let mut messages = MESSAGES.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    messages.count += 1;
    if messages.first.len() < KEPT {
        messages.first.push(text);
    }
    vk::FALSE
}
