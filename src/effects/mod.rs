//! The effects, as one table: what each is called, what in a scene calls for it and why, and which models honour it.
//!
//! An effect that is off is compiled out: its bit sets a specialization constant of the shaders.

mod calls;
mod selection;

use std::str::FromStr;

pub use selection::Selection;

pub use crate::optics::rough::SMOOTH;
use crate::options::Model;
use crate::scene::{Material, Scene, Surface};
use calls::{
    absorbs, any_dielectric, coated, cut_out, disperses, glass, lights, mapped, materials, opaque, overlaps, rough,
    textured, thin_walled,
};

/// A row of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum Effect {
    /// Light mirrored by a surface
    Reflection,
    /// Light refracted through a surface
    Transmission,
    /// More than one interface on the way of the light
    Interior,
    /// Point lights
    DirectLight,
    /// Surfaces between a point light and what it lights
    Shadows,
    /// Light scattered by a rough dielectric
    Roughness,
    /// Light that a single bounce between microfacets loses
    EnergyCompensation,
    /// Light absorbed on its way through a body
    Absorption,
    /// An index of refraction that changes with the wavelength
    Dispersion,
    /// Dielectrics that overlap or hold one another
    Nesting,
    /// Panes without an inside
    ThinWalled,
    /// Surfaces that are no dielectrics
    Opaque,
    /// Images on surfaces
    Textures,
    /// Images that bend the normals of surfaces
    NormalMaps,
    /// Surfaces that are not there everywhere
    Cutouts,
    /// Glass that is coloured or painted at its surface
    Coatings,
}

struct Row {
    effect: Effect,
    name: &'static str,
    models: &'static [Model],
    /// Without this it changes nothing, and is not simulated.
    needs: Option<Effect>,
    calls: Calls,
    /// Why a scene does without it.
    absent: &'static str,
}

/// What in a scene calls for an effect.
#[derive(Clone, Copy)]
enum Calls {
    /// A surface that an object wears, if this says why.
    Surface(fn(&Surface) -> Option<String>),
    /// The same of a material.
    Material(fn(&Material) -> Option<String>),
    /// A light that shines on something.
    Light,
    /// Bodies that overlap, or the camera in one.
    Overlap,
}

/// THE table. Detection is conservative: an effect that might show is called for.
const TABLE: [Row; 16] = {
    use Calls::{Light, Material, Overlap, Surface};
    use Effect::*;
    use Model::{Double, Path, Single, Tree};
    const TRACED: &[Model] = &[Tree, Path];
    const ALL: &[Model] = &[Single, Double, Tree, Path];
    const ROUGH: &[Model] = &[Single, Double, Path];
    const INSIDE: &[Model] = &[Double, Tree, Path];
    const NO_GLASS: &str = "no object is of glass";
    const NO_LIGHT: &str = "no point light shines on anything";
    const SMOOTH_GLASS: &str = "no glass is rougher than 0.01";
    const fn row(
        effect: Effect,
        name: &'static str,
        models: &'static [Model],
        calls: Calls,
        absent: &'static str,
    ) -> Row {
        let needs = if matches!(effect, EnergyCompensation) { Some(Roughness) } else { None };
        Row { effect, name, models, needs, calls, absent }
    }
    [
        row(Reflection, "reflection", ALL, Surface(glass), NO_GLASS),
        row(Transmission, "transmission", ALL, Surface(glass), NO_GLASS),
        row(Interior, "interior", INSIDE, Surface(glass), NO_GLASS),
        row(DirectLight, "direct-light", ALL, Light, NO_LIGHT),
        row(Shadows, "shadows", TRACED, Light, NO_LIGHT),
        row(Roughness, "roughness", ROUGH, Surface(rough), SMOOTH_GLASS),
        row(EnergyCompensation, "energy-compensation", ROUGH, Surface(rough), SMOOTH_GLASS),
        row(
            Absorption,
            "absorption",
            INSIDE,
            Surface(absorbs),
            "no body of glass has a colour and a finite attenuation distance",
        ),
        row(
            Dispersion,
            "dispersion",
            TRACED,
            Surface(disperses),
            "no body of glass has an index that changes with the wavelength",
        ),
        row(Nesting, "nesting", TRACED, Overlap, "no bodies of glass overlap, and the camera is in none"),
        row(ThinWalled, "thin-walled", INSIDE, Surface(thin_walled), "no glass is thin-walled"),
        row(Opaque, "opaque", TRACED, Surface(opaque), "no object is opaque, not even in part"),
        row(Textures, "textures", TRACED, Material(textured), "no object wears an image"),
        row(NormalMaps, "normal-maps", TRACED, Material(mapped), "no object wears a map of normals"),
        row(Cutouts, "cutouts", TRACED, Material(cut_out), "all surfaces are there everywhere"),
        row(Coatings, "coatings", TRACED, Surface(coated), "no glass is coloured or painted at its surface"),
    ]
};

/// What calls for an effect, in one scene; numbers are indices into the scene's lists.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Caller {
    /// A material that objects wear.
    Material {
        /// Which one.
        material: usize,
        /// What about it.
        why: String,
    },
    /// A point light.
    Light(usize),
    /// Bodies in one mesh of an object that may overlap each other.
    Parts(usize),
    /// Two objects that may overlap.
    Pair(usize, usize),
    /// An object that the camera may be in.
    Camera(usize),
}

impl Effect {
    /// Every effect, in the order of the table.
    pub fn all() -> impl Iterator<Item = Self> {
        TABLE.iter().map(|row| row.effect)
    }

    fn row(self) -> &'static Row {
        &TABLE[self as usize]
    }

    /// The name on the command line, in stats and reports.
    pub fn name(self) -> &'static str {
        self.row().name
    }

    /// Whether `model` simulates this.
    pub fn honoured_by(self, model: Model) -> bool {
        self.row().models.contains(&model)
    }

    /// Whether `model` simulates this by something simpler: its page in docs says what.
    pub fn approximated_by(self, model: Model, scene: &Scene) -> bool {
        match (model, self) {
            (Model::Tree, Self::Opaque | Self::DirectLight | Self::Shadows) => true,
            // A mirror lies over what is painted, and what blends is there or not.
            (Model::Tree, Self::Coatings | Self::Cutouts) => true,
            (Model::Double, Self::Interior | Self::DirectLight) => true,
            (Model::Double, Self::Roughness) => any_dielectric(scene, |d| d.thin_walled && d.roughness > SMOOTH),
            _ => false,
        }
    }

    /// What in `scene` may show this, found one by one.
    pub fn callers<'s>(self, scene: &'s Scene) -> Box<dyn Iterator<Item = Caller> + 's> {
        match self.row().calls {
            Calls::Surface(why) => Box::new(materials(scene, move |material| why(&material.surface))),
            Calls::Material(why) => Box::new(materials(scene, why)),
            Calls::Light => Box::new(lights(scene)),
            Calls::Overlap => Box::new(overlaps(scene)),
        }
    }

    /// Whether something in `scene` may show this.
    pub fn called_for_by(self, scene: &Scene) -> bool {
        self.callers(scene).next().is_some()
    }

    /// Why a scene that does not call for this does not.
    pub fn absent(self) -> &'static str {
        self.row().absent
    }

    /// The effect without which this changes nothing.
    pub fn needs(self) -> Option<Self> {
        self.row().needs
    }
}

impl FromStr for Effect {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::all().find(|effect| effect.name() == name).ok_or_else(|| {
            let known: Vec<_> = Self::all().map(Self::name).collect();
            format!("unknown effect {name:?}; known: auto, all, {}", known.join(", "))
        })
    }
}

/// A set of effects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Effects(u32);

impl Effects {
    /// Whether `effect` is in the set.
    pub fn contains(self, effect: Effect) -> bool {
        self.0 & (1 << effect as u32) != 0
    }

    /// The effects in the order of the table.
    pub fn iter(self) -> impl Iterator<Item = Effect> {
        Effect::all().filter(move |&effect| self.contains(effect))
    }

    /// The names in the order of the table.
    pub fn names(self) -> Vec<&'static str> {
        self.iter().map(Effect::name).collect()
    }
}

impl FromIterator<Effect> for Effects {
    fn from_iter<I: IntoIterator<Item = Effect>>(effects: I) -> Self {
        Self(effects.into_iter().fold(0, |bits, effect| bits | 1 << effect as u32))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec3;

    use super::*;
    use crate::scene::{Dielectric, Dispersion, Glass, Opaque, Overrides, PointLight, TextureMap};

    fn built_in() -> Scene {
        Scene::load(None, &Overrides::default()).expect("the built-in scene")
    }

    fn selected(text: &str) -> Vec<&'static str> {
        text.parse::<Selection>().expect("a selection").resolve(&built_in()).names()
    }

    #[test]
    fn the_table_is_in_the_order_of_the_effects() {
        assert!(TABLE.iter().enumerate().all(|(i, row)| row.effect as usize == i));
    }

    #[test]
    fn shaders_number_and_name_effects_as_the_table_does() {
        let text = include_str!("../../shaders/effects.glsl");
        let mut found = 0;
        for line in text.lines().filter(|line| line.starts_with("layout(constant_id")) {
            let id: usize = line.split(['=', ')']).nth(1).and_then(|id| id.trim().parse().ok()).expect("an id");
            let name = line.split_whitespace().nth(5).expect("a name");
            assert_eq!(name, TABLE[id].name.to_uppercase().replace('-', "_"), "{line}");
            found += 1;
        }
        assert_eq!(found, TABLE.iter().filter(|row| !row.models.is_empty()).count());
    }

    #[test]
    fn selections_add_and_take_away() {
        let auto = ["reflection", "transmission", "interior", "nesting"];
        assert_eq!(selected("auto"), auto);
        assert_eq!(selected("all").len(), TABLE.len());
        assert_eq!(selected("reflection, shadows"), ["reflection", "shadows"]);
        assert_eq!(selected("auto,-nesting"), auto[..3]);
        assert_eq!(selected("-nesting"), auto[..3]);
        assert_eq!(selected("all,-opaque,opaque").len(), TABLE.len());
        assert_eq!(selected("energy-compensation,reflection"), ["reflection"]);
        assert_eq!(selected("energy-compensation,roughness"), ["roughness", "energy-compensation"]);
        assert!("auto,magic".parse::<Selection>().is_err());
        assert_eq!("all,-nesting".parse::<Selection>().map(|s| s.to_string()), Ok("all,-nesting".into()));
    }

    #[test]
    fn effects_are_called_for_by_what_objects_wear() {
        let mut scene = built_in();
        let calls = |scene: &Scene| Selection::default().resolve(scene).names();
        scene.objects.truncate(1);
        assert_eq!(calls(&scene), ["reflection", "transmission", "interior"]);
        let glass = |change: fn(&mut Dielectric)| {
            let mut glass = Dielectric::default();
            change(&mut glass);
            Surface::Dielectric(glass)
        };
        for (surface, expected) in [
            (glass(|g| g.roughness = 0.02), "roughness"),
            (glass(|g| g.roughness = 0.02), "energy-compensation"),
            (glass(|g| (g.attenuation_distance, g.attenuation_color.x) = (1.0, 0.5)), "absorption"),
            (glass(|g| g.dispersion = Dispersion::Khr(0.1)), "dispersion"),
            (glass(|g| g.dispersion = Glass::named("bk7").expect("a glass").dispersion), "dispersion"),
            (glass(|g| g.thin_walled = true), "thin-walled"),
            (Surface::Opaque(Opaque::default()), "opaque"),
            (Surface::Opaque(Opaque { base_color_texture: Some(TextureMap::of(0)), ..Opaque::default() }), "textures"),
        ] {
            scene.materials[0].surface = surface;
            assert!(calls(&scene).contains(&expected), "{expected}");
        }
        // A pane has no inside, and an index of 1 nothing to disperse with.
        for (surface, unexpected) in [
            (glass(|g| (g.dispersion, g.thin_walled) = (Dispersion::Khr(0.1), true)), "dispersion"),
            (glass(|g| (g.dispersion, g.ior) = (Dispersion::Khr(0.1), 1.0)), "dispersion"),
            (
                glass(|g| (g.attenuation_distance, g.attenuation_color.x, g.thin_walled) = (1.0, 0.5, true)),
                "absorption",
            ),
        ] {
            scene.materials[0].surface = surface;
            assert!(!calls(&scene).contains(&unexpected), "{unexpected}");
        }
        scene.objects.clear();
        assert!(calls(&scene).is_empty());
    }

    #[test]
    fn callers_are_what_an_effect_is_called_for_by() {
        let check = |scene: &Scene, effect: Effect, expected: &[Caller]| {
            assert_eq!(effect.callers(scene).collect::<Vec<_>>(), expected, "{effect:?}");
            for effect in Effect::all() {
                assert_eq!(effect.called_for_by(scene), effect.callers(scene).next().is_some(), "{effect:?}");
                assert!(!effect.absent().is_empty(), "{effect:?}");
            }
        };
        let mut scene = built_in();
        let glass = Caller::Material { material: 0, why: "glass of index 1.5".into() };
        check(&scene, Effect::Reflection, &[glass]);
        check(&scene, Effect::Nesting, &[Caller::Pair(0, 2)]);
        // Shines, does not shine.
        scene.lights = [1.0, 0.0].map(|x| PointLight::new(DVec3::Y, DVec3::splat(x))).into();
        check(&scene, Effect::DirectLight, &[Caller::Light(0)]);
        check(&scene, Effect::Shadows, &[Caller::Light(0)]);
        scene.objects.remove(2);
        check(&scene, Effect::Nesting, &[]);
        Arc::make_mut(&mut scene.meshes[1]).overlaps = true;
        check(&scene, Effect::Nesting, &[Caller::Parts(1)]);
        scene.camera.position = scene.bounds_of(&scene.objects[0]).center();
        check(&scene, Effect::Nesting, &[Caller::Camera(0), Caller::Parts(1)]);

        let mut worn = scene.materials[0].clone();
        worn.surface = Surface::Opaque(Opaque::default());
        scene.materials.push(worn);
        check(&scene, Effect::Opaque, &[]);
        scene.objects[1].material = 1;
        check(&scene, Effect::Opaque, &[Caller::Material { material: 1, why: "lets nothing through".into() }]);
        check(&scene, Effect::Nesting, &[Caller::Camera(0)]);
        scene.objects.clear();
        assert!(Effect::all().all(|effect| effect.callers(&scene).next().is_none()));
    }

    #[test]
    fn the_scene_of_every_effect_calls_for_every_effect() {
        let scene = Scene::of_every_effect().expect("a scene");
        for effect in Effect::all() {
            assert!(effect.called_for_by(&scene), "{effect:?}");
        }
    }

    /// Meshes' files hold 32 bits: 1.45 comes as 1.4500000476837158.
    #[test]
    fn callers_tell_short_numbers() {
        let mut scene = built_in();
        let [ior, roughness, distance] = [1.45_f32, 0.3, 0.2].map(f64::from);
        scene.materials[0].surface = Surface::Dielectric(Dielectric {
            ior,
            roughness,
            attenuation_color: DVec3::new(1.0, 0.9_f32.into(), 0.7_f32.into()),
            attenuation_distance: distance,
            ..Dielectric::default()
        });
        for (effect, expected) in [
            (Effect::Interior, "glass of index 1.45"),
            (Effect::Roughness, "roughness 0.3"),
            (Effect::Absorption, "white becomes 1, 0.9, 0.7 over 0.2 m"),
        ] {
            let expected = Caller::Material { material: 0, why: expected.into() };
            assert_eq!(effect.callers(&scene).collect::<Vec<_>>(), [expected]);
        }
    }
}
