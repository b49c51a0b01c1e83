//! Messages that say nothing against us, each with the reason. Everything else counts.

use crate::gpu::{Message, Watch};

/// What the layer says of itself, or advises against, and why it counts for nothing.
const ALLOWED: [(&str, &str); 2] = [
    ("UNASSIGNED-GPU-Assisted Validation Warning", "the layer says what it cannot look at on this device"),
    (
        "UNASSIGNED-BestPractices-vkCreateInstance-specialuse-extension-debugging",
        "extensions for debugging are there only where the layer is",
    ),
];

/// Why a message counts for nothing, if it does.
pub fn allowed(message: &Message, watch: Watch) -> Option<&'static str> {
    if watch == Watch::Synchronization {
        return None;
    }
    ALLOWED.iter().find(|(rule, _)| message.rule == *rule).map(|(_, why)| *why)
}

/// Why the layer cannot look at what it was asked to look at, if it says so.
pub fn unable(message: &Message) -> Option<String> {
    let unable = message.rule.contains("GPU-Assisted Validation Setup Error");
    unable.then(|| message.text.lines().next().unwrap_or_default().into())
}
