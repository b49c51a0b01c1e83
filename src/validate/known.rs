//! Messages that say nothing against us, each with the reason. Everything else counts.

use crate::gpu::{Message, Watch};

/// The rule of what the layer says where it cannot add instructions to shaders.
const UNABLE: &str = "GPU-Assisted Validation Setup Error";

/// A rule without what some layers put before it and after it, a part of the text, and why such a message counts for nothing.
const ALLOWED: [(&str, &str, &str); 5] = [
    ("GPU-Assisted Validation Warning", "", "the layer says what it cannot look at on this device"),
    (UNABLE, "", "the layer says that it cannot look at this device"),
    (
        "BestPractices-vkCreateInstance-specialuse-extension-debugging",
        "",
        "extensions for debugging are there only where the layer is",
    ),
    (
        "BestPractices-pipeline-stage-flags",
        "vkCmdWriteTimestamp2",
        "the time of a pass starts when all commands before it are done, and ends when all of its own are",
    ),
    (
        "BestPractices-ImageBarrierAccessLayout",
        "VK_ACCESS_2_SHADER_SAMPLED_READ_BIT: accessMask",
        "the access is a part of VK_ACCESS_2_SHADER_READ_BIT, which the layer wants to see",
    ),
];

/// Why a message counts for nothing, if it does. What core and synchronization checks say always counts.
pub fn allowed(message: &Message, watch: Watch) -> Option<&'static str> {
    let is_like = |rule: &str, part: &str| is_rule(message, rule) && message.text.contains(part);
    let found = ALLOWED.iter().find(|(rule, part, _)| is_like(rule, part));
    found.filter(|_| watch != Watch::Synchronization).map(|(_, _, why)| *why)
}

/// Why the layer cannot look at what it was asked to look at, if it says so.
pub fn unable(message: &Message) -> Option<String> {
    is_rule(message, UNABLE).then(|| message.text.lines().next().unwrap_or_default().into())
}

fn is_rule(message: &Message, rule: &str) -> bool {
    message.rule.trim_start_matches("UNASSIGNED-").trim_end_matches('.') == rule
}
