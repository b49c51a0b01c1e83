//! A renderer that is given one scene after the other makes of each what a new one would, bit for bit.

mod common;

use glam::{DAffine3, DVec3};

use common::Validated;
use common::pictures::{BALL, scene};
use vitrum::options::{Model, RenderArgs, Size, Trace};
use vitrum::passes::{Renderer, render};
use vitrum::plan::Plan;
use vitrum::scene::{Opaque, Overrides, Panorama, Scene, Surface, Surroundings};

fn args(model: Model, trace: Trace) -> RenderArgs {
    RenderArgs {
        model: Some(model.into()),
        size: Some(Size { width: 24, height: 18 }),
        samples: Some(2),
        trace: model.traces().then_some(trace),
        ..RenderArgs::default()
    }
}

/// Scenes in the order of a visit: each differs from the one before in something.
fn visit() -> Vec<(&'static str, Scene)> {
    let built_in = Scene::load(None, &Overrides::default()).expect("the built-in scene");
    let mut all = vec![("the built-in scene", built_in.clone())];
    let mut then = |name, change: &dyn Fn(&mut Scene)| {
        let mut scene = all.last().expect("one").1.clone();
        change(&mut scene);
        all.push((name, scene));
    };
    then("the camera moved", &|scene| scene.camera.position += DVec3::new(0.1, 0.05, 0.2));
    then("another index", &|scene| {
        for material in &mut scene.materials {
            if let Surface::Dielectric(glass) = &mut material.surface {
                glass.set_ior(1.3);
            }
        }
    });
    then("a white environment", &|scene| scene.environment.light = Surroundings::Color(DVec3::ONE));
    then("one object less", &|scene| {
        scene.objects.remove(1);
    });
    then("two objects more", &|scene| {
        let mut copy = scene.objects[0].clone();
        copy.transform = DAffine3::from_translation(DVec3::X) * copy.transform;
        scene.objects.extend([copy.clone(), copy]);
    });
    then("a table", &|scene| scene.materials[0].surface = Surface::Opaque(Opaque::default()));
    then("the environment again", &|scene| scene.environment = built_in.environment.clone());
    then("one as large", &|scene| {
        let Surroundings::Image(panorama) = &mut scene.environment.light else { return };
        let texels = panorama.texels.iter().map(|texel| texel.map(|value| 0.5 * value)).collect();
        *panorama = Panorama::new(panorama.width, panorama.height, texels);
    });
    let ball = self::scene(BALL, &Overrides::default());
    all.push(("another scene", ball));
    all.push(("the first again", built_in));
    all
}

#[test]
fn what_changes_is_what_would_be_made_anew() {
    let Some(validated) = Validated::open() else { return };
    let gpu = &validated.gpu;
    let traces: &[_] = if gpu.ray_query() { &[Trace::Software, Trace::Hardware] } else { &[Trace::Software] };
    let mut kept: Option<Renderer> = None;
    for &trace in traces {
        for model in Model::ALL.into_iter().filter(|model| trace == Trace::Software || model.traces()) {
            for (name, scene) in visit() {
                let plan = Plan::new(&scene, &args(model, trace)).expect("a plan");
                let renderer = match &mut kept {
                    Some(renderer) => {
                        renderer.change(&scene, &plan).expect("a change");
                        renderer
                    }
                    none => none.insert(Renderer::new(gpu, &scene, &plan).expect("a renderer")),
                };
                let changed = renderer.render(&plan, &mut |_| {}).expect("a picture");
                let anew = render(gpu, &scene, &plan, &mut |_| {}).expect("a picture");
                assert_eq!(changed.radiance, anew.radiance, "{name}: {} with {}", model.name(), trace.name());
            }
        }
    }
    drop(kept);
    validated.verdict();
}
