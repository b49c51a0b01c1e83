//! What an image file holds of a render: pixels, layers, and what the picture was made with.

use crate::gpu::DeviceInfo;
use crate::image::{FloatImage, Layer};
use crate::options::{Aov, RenderArgs};
use crate::passes::Rendered;
use crate::plan::Plan;
use crate::scene::Scene;

/// The pixels of an EXR: radiance, and the layers that were asked for.
pub fn float_image(rendered: &Rendered, plan: &Plan) -> FloatImage {
    let layers = plan.aovs.iter().filter_map(|&aov| {
        let channels = channels(aov, rendered)?.into_iter().map(|(name, values)| (name.to_owned(), values)).collect();
        Some(Layer { name: aov.name().into(), channels })
    });
    let layers = layers.collect();
    FloatImage { width: plan.size.width, height: plan.size.height, pixels: rendered.radiance.clone(), layers }
}

/// The channels of a layer, if this render has it.
fn channels(aov: Aov, rendered: &Rendered) -> Option<Vec<(&'static str, Vec<f32>)>> {
    let one = |name, values: &Vec<f32>| vec![(name, values.clone())];
    let three = |names: [&'static str; 3], values: &Vec<[f32; 3]>| {
        let channel = |axis: usize| (names[axis], values.iter().map(|value| value[axis]).collect());
        (0..3).map(channel).collect()
    };
    let (surfaces, counts) = (rendered.aovs.as_ref(), rendered.counts.as_ref());
    match aov {
        Aov::Normal => surfaces.map(|aovs| three(["X", "Y", "Z"], &aovs.normal)),
        Aov::Depth => surfaces.map(|aovs| one("Z", &aovs.depth)),
        Aov::Albedo => surfaces.map(|aovs| three(["R", "G", "B"], &aovs.albedo)),
        Aov::Object => surfaces.map(|aovs| one("ID", &aovs.object)),
        Aov::Interfaces => counts.map(|counts| one("N", &counts.interfaces)),
        Aov::Discarded => counts?.discarded.as_ref().map(|discarded| one("Y", discarded)),
        Aov::Stderr => counts?.stderr.as_ref().map(|stderr| three(["R", "G", "B"], stderr)),
    }
}

/// What the image says about its making; nothing that differs from run to run.
pub fn metadata(device: &DeviceInfo, scene: &Scene, plan: &Plan, samples: u32) -> Vec<(String, String)> {
    // As many as there are, also where a time budget decided.
    let options = RenderArgs { samples: Some(samples), time_budget: None, ..plan.options.clone() };
    [
        ("Software", format!("vitrum {}", env!("CARGO_PKG_VERSION"))),
        ("vitrum:device", format!("{}, {}, Vulkan {}", device.name, device.driver, device.api)),
        ("vitrum:scene", scene.name.clone()),
        ("vitrum:options", options.to_string()),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into()
}
