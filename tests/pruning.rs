//! A shader of which everything is compiled out that the scene does not call for makes the picture of the full one, bit for
//! bit: on the scenes that come with the program and on generated ones.

#[path = "common/mod.rs"]
mod common;
#[allow(dead_code, reason = "each test program uses its share")]
#[path = "tree/shapes.rs"]
mod shapes;

use std::collections::HashSet;
use std::path::Path;

use glam::{DAffine3, DVec3};

use common::Validated;
use shapes::{Part, cuboid, hollow_ball, icosphere, prism, rectangle, scene};
use vitrum::effects::{Effect, Selection};
use vitrum::options::{Model, RenderArgs, Size};
use vitrum::passes::{Rendered, render};
use vitrum::plan::Plan;
use vitrum::scene::{
    Coating, Cone, Cutout, Dielectric, Dispersion, Environment, NormalMap, Opaque, Overrides, Panorama, PointLight,
    Scene, Surface, Surroundings, Texels, Texture, TextureMap,
};

/// What a generated scene has beside clear glass: each has it, for every set of effects makes shaders of its own, and those that
/// trace take seconds to compile.
#[derive(Clone, Copy, Debug)]
struct Kind {
    rough: bool,
    absorbing: bool,
    dispersing: bool,
    thin_walled: bool,
    opaque: bool,
    textured: bool,
    /// Normals, and what is cut out and painted.
    dressed: bool,
    lit: bool,
    nested: bool,
    /// The surroundings are of one colour.
    constant: bool,
}

const PLAIN: Kind = Kind {
    rough: false,
    absorbing: false,
    dispersing: false,
    thin_walled: false,
    opaque: false,
    textured: false,
    dressed: false,
    lit: false,
    nested: false,
    constant: false,
};

const KINDS: [Kind; 12] = [
    PLAIN,
    Kind { rough: true, ..PLAIN },
    Kind { absorbing: true, constant: true, ..PLAIN },
    Kind { dispersing: true, ..PLAIN },
    Kind { nested: true, ..PLAIN },
    Kind { thin_walled: true, nested: true, ..PLAIN },
    Kind { opaque: true, lit: true, ..PLAIN },
    Kind { opaque: true, textured: true, rough: true, ..PLAIN },
    Kind { rough: true, absorbing: true, thin_walled: true, lit: true, ..PLAIN },
    Kind { absorbing: true, dispersing: true, nested: true, opaque: true, ..PLAIN },
    Kind { dressed: true, ..PLAIN },
    Kind { dressed: true, textured: true, rough: true, opaque: true, lit: true, ..PLAIN },
];

/// Scenes of each kind.
const SCENES: u64 = 20;

struct Random(fastrand::Rng);

impl Random {
    fn number(&mut self, from: f64, to: f64) -> f64 {
        from + (to - from) * self.0.f64()
    }

    fn one_of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.0.usize(..choices.len())]
    }

    fn color(&mut self) -> DVec3 {
        DVec3::from_array([0; 3].map(|_| self.number(0.05, 1.0)))
    }

    /// Inside of [-size, size] on each axis.
    fn point(&mut self, size: f64) -> DVec3 {
        DVec3::from_array([0; 3].map(|_| self.number(-size, size)))
    }

    /// The first body has what its kind says, and the second one is the pane; others may be and have it.
    fn glass(&mut self, kind: Kind, number: u32) -> Dielectric {
        let mut glass = Dielectric {
            ior: self.one_of(&[1.001, 1.33, 1.5, 1.5, 2.4, 0.8]),
            // Values next to where an effect begins, too.
            roughness: self.one_of(&[0.0, 0.005, 0.01]),
            attenuation_color: self.color(),
            thin_walled: kind.thin_walled && (number == 1 || number > 1 && self.0.bool()),
            priority: self.0.i32(-1..2),
            ..Dielectric::default()
        };
        if kind.rough && (number == 0 || self.0.bool()) {
            glass.roughness = self.one_of(&[0.010_01, 0.2, 1.0]);
        }
        if kind.absorbing && (number == 0 || self.0.bool()) {
            glass.attenuation_distance = self.one_of(&[0.1, 2.0]);
        }
        if kind.dispersing && (number == 0 || self.0.bool()) {
            glass.dispersion = Dispersion::Khr(self.one_of(&[0.01, 2.0]));
        }
        if number > 0 && self.0.u32(..4) == 0 {
            glass.ior = 1.0;
        }
        glass
    }

    fn body(&mut self, kind: Kind, number: u32) -> Part {
        let glass = self.glass(kind, number);
        let mesh = match self.0.u32(..5) {
            0 => hollow_ball(1, 0.2),
            1 => cuboid(DVec3::splat(-0.6), DVec3::splat(0.6)),
            2 => prism(1.0, 1.5),
            3 if glass.thin_walled => rectangle(1.5, 1.5),
            _ => icosphere(2),
        };
        Part::of(mesh, Surface::Dielectric(glass))
    }

    fn panorama(&mut self) -> Panorama {
        let texel = |_| [0; 3].map(|_| self.0.f32() * self.0.f32().mul_add(3.0, 0.1));
        Panorama::new(16, 8, (0..128).map(texel).collect())
    }

    fn scene(&mut self, kind: Kind) -> Scene {
        let least = if kind.nested || kind.thin_walled { 2 } else { 1 };
        let mut parts = Vec::new();
        for number in 0..self.0.u32(least..4) {
            // Bodies stand apart, or in each other.
            let apart = DVec3::new(3.0 * f64::from(number) - 3.0, 0.0, -1.0);
            let place = if kind.nested { self.point(0.2) } else { apart };
            let turn =
                DAffine3::from_rotation_y(self.number(0.0, 6.0)) * DAffine3::from_rotation_x(self.number(0.0, 6.0));
            let size = DVec3::splat(self.number(0.4, 1.0));
            let placed = DAffine3::from_translation(place) * turn * DAffine3::from_scale(size);
            parts.push(self.body(kind, number).placed(placed));
        }
        if kind.opaque {
            let surface = Opaque {
                base_color: self.color(),
                base_color_texture: kind.textured.then(|| TextureMap::of(0)),
                metallic: self.one_of(&[0.0, 1.0]),
                roughness: self.one_of(&[0.0, 0.3, 1.0]),
                emission: if self.0.bool() { self.color() } else { DVec3::ZERO },
                ..Opaque::default()
            };
            let floor = DAffine3::from_translation(DVec3::new(0.0, -1.2, 0.0)) * DAffine3::from_rotation_x(-1.5);
            let mut part = Part::of(rectangle(6.0, 6.0), Surface::Opaque(surface)).placed(floor);
            part.mesh.uvs = part.mesh.positions.iter().map(|&[x, y, _]| [x, y]).collect();
            parts.push(part);
        }
        let texel = |i: u32| if (i + i / 4).is_multiple_of(2) { [200, 30, 190, 255] } else { [20, 190, 240, 100] };
        let texture = Texture {
            path: "checker.png".into(),
            width: 4,
            height: 4,
            texels: Texels::Srgb((0..16).map(texel).collect()),
        };
        let light = match kind.constant {
            true => Surroundings::Color(self.color()),
            false => Surroundings::Image(self.panorama()),
        };
        if kind.dressed {
            for (number, part) in parts.iter_mut().enumerate() {
                part.mesh.uvs = part.mesh.positions.iter().map(|&[x, y, z]| [x + 0.3 * z, y - 0.2 * z]).collect();
                let Surface::Dielectric(glass) = &mut part.surface else { continue };
                if number == 0 || self.0.bool() {
                    let transmission = if number == 0 { 0.5 } else { self.one_of(&[0.0, 0.5, 1.0]) };
                    glass.coating = Some(Box::new(Coating {
                        base_color: self.color(),
                        transmission,
                        transmission_texture: (kind.textured && self.0.bool()).then(|| TextureMap::of(0)),
                        ..Coating::default()
                    }));
                }
            }
        }
        let mut made = scene(parts);
        if kind.dressed {
            // The first one has all there is, so that all scenes call for the same effects.
            for (number, material) in made.materials.iter_mut().enumerate() {
                let mut has = || number == 0 || self.0.bool();
                let (is_bent, is_cut, is_blended, is_mapped) = (has(), has(), has(), has());
                let scale = self.number(0.1, 1.0);
                material.normal_map = is_bent.then(|| NormalMap { map: TextureMap::of(0), scale });
                let map = is_mapped.then(|| TextureMap::of(0));
                let cutoff = (!is_blended).then_some(0.5);
                material.cutout = is_cut.then_some(Cutout { alpha: 0.75, map, cutoff });
            }
        }
        made.environment = Environment {
            light,
            intensity: self.number(0.5, 2.0),
            rotation: self.number(0.0, 6.0),
            visible: self.0.bool(),
        };
        made.textures.push(texture.into());
        if kind.nested && self.0.u32(..4) == 0 {
            made.camera.position = self.point(0.3);
            made.camera.target = DVec3::new(0.1, 0.2, -3.0);
        }
        if kind.lit {
            for _ in 0..self.0.u32(1..3) {
                let is_off = !made.lights.is_empty() && self.0.bool();
                let intensity = if is_off { DVec3::ZERO } else { 10.0 * self.color() };
                let cone =
                    self.0.bool().then(|| Cone::new(self.point(1.0), self.number(0.0, 0.5), self.number(0.6, 1.5)));
                let light = PointLight::new(self.point(3.0), intensity);
                made.lights.push(PointLight { cone: cone.flatten(), ..light });
            }
        }
        made
    }
}

/// Scenes that are the same in every run, with names.
fn generated() -> impl Iterator<Item = (String, Scene)> {
    KINDS.into_iter().enumerate().flat_map(|(i, kind)| {
        (0..SCENES).map(move |number| {
            let mut random = Random(fastrand::Rng::with_seed(SCENES * i as u64 + number));
            (format!("kind {i}, scene {number}"), random.scene(kind))
        })
    })
}

fn shipped() -> impl Iterator<Item = (String, Scene)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
    let files = std::fs::read_dir(folder).expect("the scenes").map(|entry| entry.expect("a scene").path());
    files.map(|path| {
        let scene = Scene::load(Some(&path), &Overrides::default()).expect("a scene");
        (scene.name.clone(), scene)
    })
}

fn picture(validated: &Validated, scene: &Scene, model: Model, effects: &str) -> Rendered {
    let args = RenderArgs {
        model: Some(model.into()),
        size: Some(Size { width: 24, height: 18 }),
        samples: Some(2),
        max_depth: Some(8),
        effects: Some(effects.parse::<Selection>().expect("a selection")),
        ..RenderArgs::default()
    };
    render(&validated.gpu, scene, &Plan::new(scene, &args).expect("a plan"), &mut |_| {}).expect("a picture")
}

/// Numbers of a picture that differ in a bit, but for the sign of zero.
fn differing(one: &Rendered, other: &Rendered) -> usize {
    let numbers = |rendered: &Rendered| -> Vec<u32> {
        let interfaces = rendered.counts.iter().flat_map(|counts| &counts.interfaces);
        rendered.radiance.iter().flatten().chain(interfaces).map(|number| (number + 0.0).to_bits()).collect()
    };
    numbers(one).into_iter().zip(numbers(other)).filter(|(a, b)| a != b).count()
}

/// Of every scene, in one of the models: they take turns.
fn agree(models: [Model; 2]) {
    let Some(validated) = Validated::open() else { return };
    let shipped = shipped().flat_map(|named| models.map(|model| (named.clone(), model)));
    let mut sets = HashSet::new();
    let mut count = 0;
    for ((name, scene), model) in shipped.chain(generated().zip(models.into_iter().cycle())) {
        let [pruned, full] = ["auto", "all"].map(|effects| picture(&validated, &scene, model, effects));
        let differing = differing(&pruned, &full);
        let effects = Selection::default().resolve(&scene).names();
        assert_eq!(differing, 0, "{name}, {}: {effects:?}", model.name());
        sets.insert(effects);
        count += 1;
    }
    println!("{count} pictures of {} and {}, {} sets of effects", models[0].name(), models[1].name(), sets.len());
    assert!(count > 200);
    validated.verdict();
}

#[test]
fn pruned_rasterised_pictures_are_those_of_the_full_shaders() {
    agree([Model::Single, Model::Double]);
}

#[test]
fn pruned_traced_pictures_are_those_of_the_full_shaders() {
    agree([Model::Tree, Model::Path]);
}

/// A detector that misses an effect is caught: each effect shows in a generated scene that calls for it, in the simplest model
/// that simulates it.
#[test]
fn an_effect_that_a_detector_misses_shows() {
    let Some(validated) = Validated::open() else { return };
    for effect in Effect::all() {
        let model = Model::ALL.into_iter().find(|&model| effect.honoured_by(model)).expect("a model");
        let missed = format!("auto,-{}", effect.name());
        let shows = |(name, scene): &(String, Scene)| {
            let [pruned, full] = [&missed, "all"].map(|effects| picture(&validated, scene, model, effects));
            let differing = differing(&pruned, &full);
            println!("{}, {}: {name}, {differing} numbers differ", effect.name(), model.name());
            differing > 0
        };
        let calls = |(_, scene): &(String, Scene)| effect.called_for_by(scene);
        assert!(generated().filter(calls).take(12).any(|named| shows(&named)), "{}", effect.name());
    }
    validated.verdict();
}
