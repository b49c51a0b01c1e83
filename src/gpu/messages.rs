//! What the validation layer says, and of what: every message with the names of the objects that it is about.

use std::ffi::{CStr, c_void};
use std::fmt;
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use ash::vk;
use serde::{Deserialize, Serialize};

/// Something that a message is about.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct MessageObject {
    /// What it is, in Vulkan's words: `BUFFER`.
    pub kind: String,
    /// The name that it was given, if it was.
    pub name: Option<String>,
}

/// What the validation layer said once.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Message {
    /// The rule, as `VUID-vkDestroyDevice-device-05137`.
    pub rule: String,
    /// An error; else a warning.
    pub is_error: bool,
    /// All of it.
    pub text: String,
    /// What it is about.
    pub objects: Vec<MessageObject>,
    /// The passes that were being recorded, the innermost first.
    pub passes: Vec<String>,
}

impl Message {
    /// Whether it says the same of the same things, wherever those lie.
    pub fn is_like(&self, other: &Self) -> bool {
        let all = |message: &Self| {
            (message.rule.clone(), message.is_error, message.objects.clone(), without_handles(&message.text))
        };
        all(self) == all(other) && self.passes == other.passes
    }

    /// Whether something of that name is meant.
    pub fn names(&self, name: &str) -> bool {
        self.text.contains(name) || self.objects.iter().any(|object| object.name.as_deref() == Some(name))
    }
}

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// A text without the numbers in it that start with 0x.
fn without_handles(text: &str) -> String {
    let mut parts = text.split("0x");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |all, part| all + "0x" + part.trim_start_matches(|c: char| c.is_ascii_hexdigit()))
}

/// That there are some, and the first of them, in a line.
pub fn complaint(messages: &[Message]) -> Option<String> {
    let first = messages.first()?.text.lines().next().unwrap_or_default();
    Some(format!("the validation layer has {} messages, the first: {first}", messages.len()))
}

/// What the validation layer has said.
#[derive(Debug, Default)]
pub struct Messages {
    all: Mutex<Vec<Message>>,
    /// Calls that an error is said of do not reach the driver.
    stops_calls: AtomicBool,
    /// They go to standard error, too.
    is_echoed: AtomicBool,
}

impl Messages {
    /// Every message so far, oldest first.
    pub fn all(&self) -> Vec<Message> {
        self.all.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.all.lock().unwrap_or_else(PoisonError::into_inner).len()
    }

    /// From now on calls that an error is said of do not reach the driver.
    pub(super) fn stop_calls(&self) {
        self.stops_calls.store(true, Ordering::Relaxed);
    }

    /// From now on messages go to standard error, too: what is said before a driver crashes is not lost with the process.
    pub fn echo(&self) {
        self.is_echoed.store(true, Ordering::Relaxed);
    }

    fn push(&self, message: Message) {
        if self.is_echoed.load(Ordering::Relaxed) {
            // Where that is closed nobody listens.
            let _ = writeln!(std::io::stderr(), "{}", message.text);
        }
        self.all.lock().unwrap_or_else(PoisonError::into_inner).push(message);
    }
}

/// What makes the layer tell `messages`, which has to outlive the messenger.
pub(super) fn messenger_info(messages: &Arc<Messages>) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    use vk::{DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type};
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::VALIDATION | Type::PERFORMANCE)
        .pfn_user_callback(Some(record))
        .user_data(Arc::as_ptr(messages).cast_mut().cast())
}

/// Called by the layer, on whichever thread called Vulkan.
unsafe extern "system" fn record(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    messages: *mut c_void,
) -> vk::Bool32 {
    let text = |text: Option<&CStr>| text.map(|text| text.to_string_lossy().into_owned());
    // SAFETY: the layer passes valid data, and `messages` is the `Messages` that the instance keeps alive. Its texts are C
    // strings, and its lists as long as it says, for the length of this call; any of them may be null.
    let (messages, message) = unsafe {
        let (data, messages) = (&*data, &*messages.cast::<Messages>());
        let objects = listed(data.p_objects, data.object_count).iter().map(|object| MessageObject {
            kind: format!("{:?}", object.object_type),
            name: text(object.object_name_as_c_str()),
        });
        let labels = listed(data.p_cmd_buf_labels, data.cmd_buf_label_count).iter();
        let mut passes: Vec<_> = labels.filter_map(|label| text(label.label_name_as_c_str())).collect();
        // Some layers list each twice.
        passes.dedup();
        let message = Message {
            rule: text(data.message_id_name_as_c_str()).unwrap_or_default(),
            is_error: severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR),
            text: text(data.message_as_c_str()).unwrap_or_default(),
            objects: objects.collect(),
            passes,
        };
        (messages, message)
    };
    let stops = message.is_error && messages.stops_calls.load(Ordering::Relaxed);
    messages.push(message);
    if stops { vk::TRUE } else { vk::FALSE }
}

/// # Safety
///
/// `first` is null or points to as many values, which outlive `'a`.
unsafe fn listed<'a, T>(first: *const T, count: u32) -> &'a [T] {
    if first.is_null() {
        return &[];
    }
    // SAFETY: as the caller promises.
    unsafe { std::slice::from_raw_parts(first, count as usize) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn handles_do_not_tell_messages_apart_and_calls_do() {
        let message = |text: &str| Message {
            rule: "a rule".into(),
            is_error: false,
            text: text.into(),
            objects: Vec::new(),
            passes: Vec::new(),
        };
        let first = message("0x7f01[queue] vkCmdWriteTimestamp2 0xAb");
        assert!(first.is_like(&message("0x9[queue] vkCmdWriteTimestamp2 0x1")));
        assert!(!first.is_like(&message("0x7f01[queue] vkCmdPipelineBarrier2 0xAb")));
    }
}
