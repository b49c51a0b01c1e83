//! Checks of what goes wrong: a device that is lost, memory that runs out, features that are missing, windows without an area.

use std::collections::BTreeSet;

use super::pictures::Shot;
use super::session::{Session, Trouble, Verdict, hold};
use crate::gpu::{Commands, Gpu};
use crate::gpu::{Format, GpuError, Handicap, ImageDesc, Instance, OnScreen, Placed, Screen, Surface, Use};
use crate::options::{Model, RenderArgs, Size, Trace};
use crate::passes::{self, Rendered};
use crate::plan::Plan;
use crate::{Error, Result};

/// Places at which something is made to go wrong, in each sweep.
const PLACES: u32 = 8;

fn small(shot: &Shot) -> Result<RenderArgs> {
    Ok(RenderArgs { size: Some(Size { width: 16, height: 12 }), samples: Some(2), ..shot.args()? })
}

fn rendered(gpu: &Gpu, shot: &Shot) -> Result<Rendered> {
    let scene = shot.scene()?;
    let plan = Plan::new(&scene, &small(shot)?)?;
    passes::check(gpu, &plan)?;
    passes::render(gpu, &scene, &plan, &mut |_| {})
}

/// The device is lost with one submission after the other: an error each time, nothing is left, and a new device renders the same.
pub fn lost(session: &mut Session<'_>, shot: &Shot) -> Verdict {
    let gpu = session.open()?;
    shot.is_for(&gpu)?;
    let whole = rendered(&gpu, shot)?;
    let submissions = gpu.submissions();
    drop(gpu);
    let places: BTreeSet<_> = (0..PLACES).map(|place| place * (submissions - 1) / (PLACES - 1)).collect();
    let mut losses = 0;
    for &place in &places {
        let gpu = session.open_with(Handicap { lost_after: Some(place), ..Handicap::default() })?;
        match rendered(&gpu, shot) {
            Err(Error::Gpu(GpuError::Lost)) => losses += 1,
            Err(error) => {
                return Err(Trouble::Failed(format!("lost at submission {place}, it says: {}", error.in_full())));
            }
            // How work is cut depends on how long it takes: this time there were fewer submissions.
            Ok(_) if gpu.submissions() <= place => {}
            Ok(_) => return Err(Trouble::Failed(format!("lost at submission {place}, it goes on"))),
        }
    }
    session.fact(format!("lost at {losses} of {submissions} submissions"));
    let again = rendered(&session.open()?, shot)?;
    hold(again.radiance == whole.radiance, || "a device opened afterwards renders another picture".into())
}

/// Less and less memory: an error that says so, or the same picture, and nothing is left.
pub fn memory(session: &mut Session<'_>, shot: &Shot) -> Verdict {
    let gpu = session.open()?;
    shot.is_for(&gpu)?;
    let whole = rendered(&gpu, shot)?;
    let peak = gpu.peak_bytes();
    drop(gpu);
    let mut refused = 0;
    for place in 0..=PLACES {
        let budget = peak * u64::from(place) / u64::from(PLACES);
        let gpu = session.open_with(Handicap { memory: Some(budget), ..Handicap::default() })?;
        match rendered(&gpu, shot) {
            Ok(picture) => {
                hold(picture.radiance == whole.radiance, || format!("with {budget} bytes it is another picture"))?;
            }
            Err(Error::Gpu(GpuError::OutOfMemory { .. })) => refused += 1,
            Err(error) => {
                return Err(Trouble::Failed(format!("with {budget} bytes it says: {}", error.in_full())));
            }
        }
    }
    session.fact(format!("of {} budgets up to {peak} bytes {refused} were too small", PLACES + 1));
    hold(refused == PLACES, || format!("{refused} of {} budgets were too small, where {PLACES} are", PLACES + 1))
}

/// A device without ray queries, or without a clock, renders the same.
pub fn without(session: &mut Session<'_>, handicap: Handicap) -> Verdict {
    for model in Model::ALL {
        let shot = Shot::plain(model, model.traces().then_some(Trace::Software));
        let whole = rendered(&session.open()?, &shot)?;
        let poor = session.open_with(handicap)?;
        let picture = rendered(&poor, &shot)?;
        hold(picture.radiance == whole.radiance, || format!("model {} renders another picture", model.name()))?;
        if handicap.no_timestamps {
            hold(picture.gpu_ms().is_none(), || "a device without a clock tells times".into())?;
        }
        if handicap.no_ray_query && model.traces() {
            let refused = rendered(&poor, &Shot::plain(model, Some(Trace::Hardware)));
            let named = matches!(refused, Err(Error::Gpu(GpuError::NoRayQuery { .. })));
            hold(named, || "ray queries that are missing are not said to be".into())?;
        }
    }
    Ok(())
}

/// Buffers and images as large as every device has render the same; larger ones than there are, are refused by name.
pub fn limits(session: &mut Session<'_>) -> Verdict {
    /// What Vulkan wants of every device.
    const LEAST: Handicap = Handicap {
        no_ray_query: true,
        no_timestamps: true,
        buffer_bytes: Some(1 << 27),
        image_side: Some(4096),
        memory: None,
        lost_after: None,
    };
    without(session, LEAST)?;
    for model in Model::ALL {
        let shot = Shot::rich(model, model.traces().then_some(Trace::Software));
        for handicap in [
            Handicap { buffer_bytes: Some(4096), ..Handicap::default() },
            Handicap { image_side: Some(15), ..Handicap::default() },
        ] {
            let refused = rendered(&session.open_with(handicap)?, &shot);
            let named = matches!(refused, Err(Error::Gpu(GpuError::TooLarge { .. })));
            hold(named, || format!("model {} takes what is too large for {handicap:?}", model.name()))?;
        }
    }
    Ok(())
}

/// A window that changes its size, to none and back, with pictures and a user interface in it.
pub fn window(session: &mut Session<'_>) -> Verdict {
    let none = || {
        Trouble::Skipped("no driver here has VK_EXT_headless_surface: nothing can be shown where nobody sees".into())
    };
    let Some(instance) = Instance::headless(session.watch())? else { return Err(none()) };
    session.listen(&instance);
    let surface = Surface::headless(&instance)?;
    let info = instance.devices()?.into_iter().nth(session.place.device).ok_or(GpuError::NoDevice)?;
    if !surface.takes(&info) {
        return Err(none());
    }
    let gpu = session.open_in(&instance, Handicap::default())?;
    let mut screen = match Screen::new(&gpu, surface) {
        Err(GpuError::CannotShow { .. }) => {
            let why = "VK_EXT_headless_surface has no format in sRGB here: nothing can be shown where nobody sees";
            return Err(Trouble::Skipped(why.into()));
        }
        screen => screen?,
    };
    let mut commands = Commands::new(&gpu)?;
    let context = egui::Context::default();
    let mut shown = 0;
    let sizes = [[64, 48], [65, 47], [1, 1], [0, 48], [0, 0], [300, 200], [300, 200], [8, 600], [64, 48]];
    for [width, height] in sizes {
        let desc = ImageDesc {
            name: "picture",
            width: 32,
            height: 24,
            format: Format::Bgra8Srgb,
            uses: &[Use::CopyTarget, Use::CopySource],
        };
        let image = commands.upload_image(&desc, &[128; 4 * 32 * 24])?;
        commands.run(|cmd| cmd.use_image(&image, Use::CopySource))?;
        let placed =
            Placed { image: image.into(), at: [3, 2], size: [width.max(1), height.max(1)], columns: [0, i32::MAX] };
        let input = egui::RawInput {
            screen_rect: Some(egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(width as f32, height as f32))),
            ..egui::RawInput::default()
        };
        let output = context.run_ui(input, |ui| {
            ui.label("validate");
        });
        screen.set_textures(output.textures_delta)?;
        let primitives = context.tessellate(output.shapes, 1.0);
        let is_shown = screen.draw([width, height], &[placed], 1.0, &primitives)?;
        let area = width > 0 && height > 0;
        hold((is_shown == OnScreen::Yes) == area, || format!("at {width}x{height}: shown: {is_shown:?}"))?;
        shown += u32::from(area);
    }
    session.fact(format!("{shown} of {} sizes were shown, the others have no area", sizes.len()));
    Ok(())
}
