//! Materials: what flows in are the numbers of a scene file or an MTL, what flows out is one [`Surface`] a material.

use glam::DVec3;

use super::maps::{Cutout, NormalMap, TextureMap};
use crate::optics::medium::dispersed_index;

/// A surface with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// What scenes and messages call it.
    pub name: String,
    /// What it is.
    pub surface: Surface,
    /// Bends its normals.
    pub normal_map: Option<NormalMap>,
    /// Where it is not there.
    pub cutout: Option<Cutout>,
}

/// What a surface does with light.
#[derive(Clone, Debug, PartialEq)]
pub enum Surface {
    /// Reflects and refracts.
    Dielectric(Dielectric),
    /// Lets nothing through.
    Opaque(Opaque),
}

/// A transparent medium and its interface.
#[derive(Clone, Debug, PartialEq)]
pub struct Dielectric {
    /// Index of refraction at 587.6 nm, above 0.
    pub ior: f64,
    /// Perceptual roughness, 0 to 1; the alpha of GGX is its square.
    pub roughness: f64,
    /// How the index changes with the wavelength.
    pub dispersion: Dispersion,
    /// What white becomes over [`Dielectric::attenuation_distance`], 0 to 1.
    pub attenuation_color: DVec3,
    /// Metres, above 0; infinite: nothing is absorbed.
    pub attenuation_distance: f64,
    /// A pane without an inside.
    pub thin_walled: bool,
    /// Where dielectrics overlap, the higher one is there.
    pub priority: i32,
    /// Green is multiplied with the roughness, blue with the [`Coating::metallic`].
    pub metallic_roughness_texture: Option<TextureMap>,
    /// What its surface does to light that goes through.
    pub coating: Option<Box<Coating>>,
}

/// The surface of a dielectric where it colours light, or holds it back: below the interface it is painted.
#[derive(Clone, Debug, PartialEq)]
pub struct Coating {
    /// What light is multiplied by that goes through, once an interface, and the reflectance of what is painted; 0 to 1.
    pub base_color: DVec3,
    /// Multiplied with [`Coating::base_color`].
    pub base_color_texture: Option<TextureMap>,
    /// The share of the surface that lets light through, 0 to 1; the rest is opaque.
    pub transmission: f64,
    /// Red is multiplied with it.
    pub transmission_texture: Option<TextureMap>,
    /// Metal lets nothing through, 0 to 1.
    pub metallic: f64,
}

impl Default for Dielectric {
    /// Clear glass.
    fn default() -> Self {
        Self {
            ior: 1.5,
            roughness: 0.01,
            dispersion: Dispersion::None,
            attenuation_color: DVec3::ONE,
            attenuation_distance: f64::INFINITY,
            thin_walled: false,
            priority: 0,
            metallic_roughness_texture: None,
            coating: None,
        }
    }
}

impl Default for Coating {
    /// Nothing is painted.
    fn default() -> Self {
        Self {
            base_color: DVec3::ONE,
            base_color_texture: None,
            transmission: 1.0,
            transmission_texture: None,
            metallic: 0.0,
        }
    }
}

impl Dielectric {
    /// The index at `wavelength` in nanometres, for what is visible.
    pub fn index_at(&self, wavelength: f64) -> f64 {
        match self.dispersion {
            Dispersion::None => self.ior,
            Dispersion::Khr(number) => dispersed_index(self.ior, number, wavelength),
            Dispersion::Sellmeier(formula) => formula.index_at(wavelength),
        }
    }

    /// Whether white light has another colour after some way inside.
    pub fn absorbs(&self) -> bool {
        self.attenuation_distance.is_finite() && self.attenuation_color.min_element() < 1.0
    }

    /// Whether the index changes with the wavelength.
    pub fn disperses(&self) -> bool {
        match self.dispersion {
            Dispersion::None => false,
            // The formula scales with what the index has beyond 1.
            Dispersion::Khr(number) => number > 0.0 && self.ior != 1.0,
            Dispersion::Sellmeier(_) => true,
        }
    }

    /// Puts `ior` in the place of the index. What a named glass has of its own, its dispersion, goes with its index.
    pub fn set_ior(&mut self, ior: f64) {
        let own = |glass: &Glass| glass.ior == self.ior && glass.dispersion == self.dispersion;
        if GLASSES.iter().any(own) {
            self.dispersion = Dispersion::None;
        }
        self.ior = ior;
    }
}

/// Metallic-roughness, as glTF.
#[derive(Clone, Debug, PartialEq)]
pub struct Opaque {
    /// Reflectance, 0 to 1.
    pub base_color: DVec3,
    /// Multiplied with [`Opaque::base_color`].
    pub base_color_texture: Option<TextureMap>,
    /// 0: dielectric below, 1: metal.
    pub metallic: f64,
    /// Perceptual roughness, 0 to 1; the alpha of GGX is its square.
    pub roughness: f64,
    /// Green is multiplied with the roughness, blue with [`Opaque::metallic`].
    pub metallic_roughness_texture: Option<TextureMap>,
    /// Index of refraction, as far as its specular reflection tells: where it is no metal that is ((n - 1) / (n + 1))^2 head on.
    pub ior: f64,
    /// Strength of the specular reflection, as in KHR_materials_specular; 0: purely Lambertian.
    pub specular: f64,
    /// Radiance that it sends out.
    pub emission: DVec3,
    /// Multiplied with [`Opaque::emission`].
    pub emission_texture: Option<TextureMap>,
}

impl Default for Opaque {
    fn default() -> Self {
        Self {
            base_color: DVec3::splat(0.8),
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            ior: 1.5,
            specular: 1.0,
            emission: DVec3::ZERO,
            emission_texture: None,
        }
    }
}

impl Surface {
    /// The glass, if it is some that has an inside.
    pub fn body(&self) -> Option<&Dielectric> {
        match self {
            Self::Dielectric(glass) if !glass.thin_walled => Some(glass),
            _ => None,
        }
    }
}

impl Material {
    /// What an object wears that has no material of its own.
    pub fn clear_glass() -> Self {
        Self::new("clear glass".into(), Surface::Dielectric(Dielectric::default()))
    }

    /// What has this surface everywhere.
    pub fn new(name: String, surface: Surface) -> Self {
        Self { name, surface, normal_map: None, cutout: None }
    }

    /// The images that it wears.
    pub fn maps(&self) -> Vec<TextureMap> {
        let mut maps = Vec::new();
        self.clone().retain_maps(|map| {
            maps.push(*map);
            true
        });
        maps
    }

    /// Takes the images off that `keep` says no to.
    pub fn retain_maps(&mut self, mut keep: impl FnMut(&mut TextureMap) -> bool) {
        let mut check = |map: &mut Option<TextureMap>| {
            if map.as_mut().is_some_and(|map| !keep(map)) {
                *map = None;
            }
        };
        match &mut self.surface {
            Surface::Dielectric(glass) => {
                if let Some(coating) = &mut glass.coating {
                    check(&mut coating.base_color_texture);
                    check(&mut coating.transmission_texture);
                }
                check(&mut glass.metallic_roughness_texture);
            }
            Surface::Opaque(opaque) => {
                check(&mut opaque.base_color_texture);
                check(&mut opaque.metallic_roughness_texture);
                check(&mut opaque.emission_texture);
            }
        }
        if let Some(cutout) = &mut self.cutout {
            check(&mut cutout.map);
        }
        if self.normal_map.as_mut().is_some_and(|normal| !keep(&mut normal.map)) {
            self.normal_map = None;
        }
    }
}

/// How an index changes with the wavelength.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Dispersion {
    /// Not at all.
    #[default]
    None,
    /// By this number, 20 / Abbe number and above 0, as in KHR_materials_dispersion; see
    /// [`crate::optics::medium::dispersed_index`].
    Khr(f64),
    /// By the formula of a named glass, which agrees with its [`Dielectric::ior`].
    Sellmeier(Sellmeier),
}

/// A dispersion formula after Sellmeier 1872: n^2 = 1 + sum of b l^2 / (l^2 - c), l being the wavelength in
/// micrometres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sellmeier {
    /// The numbers b; 0 where a glass has fewer terms.
    pub strengths: [f64; 3],
    /// The numbers c in micrometres squared, all outside of the visible.
    pub resonances: [f64; 3],
}

impl Sellmeier {
    /// The index at `wavelength` in nanometres, for what is visible.
    pub fn index_at(&self, wavelength: f64) -> f64 {
        let square = (wavelength * 1e-3).powi(2);
        let terms = self.strengths.iter().zip(self.resonances);
        (1.0 + terms.map(|(strength, resonance)| strength * square / (square - resonance)).sum::<f64>()).sqrt()
    }
}

/// A medium that scene files can name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glass {
    /// What scene files call it.
    pub name: &'static str,
    /// Index of refraction at 587.6 nm (the helium d line).
    pub ior: f64,
    /// Abbe number, (n_d - 1) / (n_F - n_C), where the source has one.
    pub abbe: Option<f64>,
    /// The source's formula, else what the Abbe number says, else none.
    pub dispersion: Dispersion,
}

/// The media that have names. Indices are relative to air, as catalogues give them.
///
/// Sources. Schott's data sheets, with the coefficients of their dispersion formulas: N-BK7 (517642), N-SF11 (785257),
/// SF10 (728285), N-BAF10 (670471), N-LAK22 (651559), for crown N-K5 (522595), for flint F2 (620364) and, for pyrex,
/// BOROFLOAT 33, which has an Abbe number alone.
/// Dispersion formulas, which the other indices and Abbe numbers come from: Malitson 1965 (fused silica), Malitson 1962
/// (sapphire, ordinary ray), Malitson 1963 (fluorite), Peter 1923 (diamond), Sultanova et al. 2009 (acrylic,
/// polycarbonate, polystyrene). IAPWS R9-97 at 20 C, divided by the index of air (water), which is no formula of
/// Sellmeier's and counts as an Abbe number. Warren & Brandt 2008 (ice), without dispersion.
pub const GLASSES: [Glass; 17] = {
    const fn still(name: &'static str, ior: f64) -> Glass {
        Glass { name, ior, abbe: None, dispersion: Dispersion::None }
    }
    const fn by_abbe(name: &'static str, ior: f64, abbe: f64) -> Glass {
        Glass { name, ior, abbe: Some(abbe), dispersion: Dispersion::Khr(20.0 / abbe) }
    }
    const fn glass(name: &'static str, ior: f64, abbe: f64, strengths: [f64; 3], resonances: [f64; 3]) -> Glass {
        Glass { name, ior, abbe: Some(abbe), dispersion: Dispersion::Sellmeier(Sellmeier { strengths, resonances }) }
    }
    [
        glass("acrylic", 1.49062, 53.18, [1.1819, 0.0, 0.0], [0.011313, 0.0, 0.0]),
        glass("baf10", 1.67003, 47.11, [1.5851495, 0.143559385, 1.08521269], [0.00926681282, 0.0424489805, 105.613573]),
        glass("bk7", 1.5168, 64.17, [1.03961212, 0.231792344, 1.01046945], [0.00600069867, 0.0200179144, 103.560653]),
        glass(
            "crown",
            1.52249,
            59.48,
            [1.08511833, 0.199562005, 0.930511663],
            [0.00661099503, 0.024110866, 111.982777],
        ),
        glass("diamond", 2.41749, 55.3, [0.3306, 4.3356, 0.0], [0.030625, 0.011236, 0.0]),
        glass(
            "flint",
            1.62004,
            36.37,
            [1.34533359, 0.209073176, 0.937357162],
            [0.00997743871, 0.0470450767, 111.886764],
        ),
        glass("fluorite", 1.43385, 95.0, [0.5675888, 0.4710914, 3.8484723], [0.00252643, 0.01007833, 1200.555973]),
        glass(
            "fused-silica",
            1.45846,
            67.82,
            [0.6961663, 0.4079426, 0.8974794],
            [0.00467914826, 0.0135120631, 97.9340025],
        ),
        still("ice", 1.3098),
        glass(
            "lak22",
            1.65113,
            55.89,
            [1.14229781, 0.535138441, 1.04088385],
            [0.00585778594, 0.0198546147, 100.834017],
        ),
        glass("polycarbonate", 1.58476, 27.86, [1.4182, 0.0, 0.0], [0.021304, 0.0, 0.0]),
        glass("polystyrene", 1.59163, 29.53, [1.4435, 0.0, 0.0], [0.020216, 0.0, 0.0]),
        by_abbe("pyrex", 1.4714, 65.41),
        glass("sapphire", 1.76817, 72.31, [1.4313493, 0.65054713, 5.3414021], [0.0052799261, 0.0142382647, 325.017834]),
        glass("sf10", 1.72825, 28.41, [1.61625977, 0.259229334, 1.07762317], [0.0127534559, 0.0581983954, 116.60768]),
        glass("sf11", 1.78472, 25.68, [1.73759695, 0.313747346, 1.89878101], [0.013188707, 0.0623068142, 155.23629]),
        by_abbe("water", 1.33299, 55.74),
    ]
};

impl Glass {
    /// The glass that is called `name`, in any case.
    pub fn named(name: &str) -> Result<Self, String> {
        GLASSES.into_iter().find(|glass| glass.name.eq_ignore_ascii_case(name)).ok_or_else(|| {
            let known: Vec<_> = GLASSES.iter().map(|glass| glass.name).collect();
            format!("unknown glass {name:?}; known: {}", known.join(", "))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glasses_are_found_in_any_case_and_listed_otherwise() {
        assert_eq!(Glass::named("BK7").unwrap().ior, 1.5168);
        let error = Glass::named("bk9").unwrap_err();
        assert!(error.starts_with("unknown glass \"bk9\"; known: acrylic, ") && error.ends_with(", water"), "{error}");
    }

    #[test]
    fn glasses_agree_with_their_dispersion_formulas() {
        let mut formulas = 0;
        for glass in GLASSES {
            let Dispersion::Sellmeier(sellmeier) = glass.dispersion else { continue };
            let [d, f, c] = [LINE_D, LINE_F, LINE_C].map(|line| sellmeier.index_at(line));
            let abbe = (d - 1.0) / (f - c);
            assert!((glass.ior - d).abs() < 1e-5, "{}: {d}", glass.name);
            assert!((glass.abbe.unwrap() - abbe).abs() < 0.01, "{}: {abbe}", glass.name);
            formulas += 1;
        }
        assert_eq!(formulas, 14);
    }

    /// The helium d, hydrogen F and hydrogen C lines in nanometres.
    const LINE_D: f64 = 587.5618;
    const LINE_F: f64 = 486.1327;
    const LINE_C: f64 = 656.2725;

    fn named(name: &str) -> Dielectric {
        let Glass { ior, dispersion, .. } = Glass::named(name).unwrap();
        Dielectric { ior, dispersion, ..Dielectric::default() }
    }

    #[test]
    fn every_glass_has_its_index_and_its_abbe_number() {
        for Glass { name, ior, abbe, .. } in GLASSES {
            let glass = named(name);
            assert!((glass.index_at(LINE_D) - ior).abs() < 1e-5, "{name}: {}", glass.index_at(LINE_D));
            assert_eq!(glass.disperses(), abbe.is_some(), "{name}");
            // Blue is bent more than red, all through the visible.
            let indices: Vec<_> = (38..=78).map(|tens| glass.index_at(f64::from(tens) * 10.0)).collect();
            assert!(indices.is_sorted_by(|blue, red| if abbe.is_some() { blue > red } else { blue == red }), "{name}");
            let Some(abbe) = abbe else { continue };
            // The formula of KHR_materials_dispersion rounds its constants.
            let found = (glass.index_at(LINE_D) - 1.0) / (glass.index_at(LINE_F) - glass.index_at(LINE_C));
            assert!((found / abbe - 1.0).abs() < 1e-3, "{name}: {found}, not {abbe}");
        }
        // Schott's data sheet of N-BK7 at the mercury lines h and g and the helium-neon laser.
        for (wavelength, index) in [(404.6561, 1.53024), (435.8343, 1.52668), (632.8, 1.51509)] {
            assert!((named("bk7").index_at(wavelength) - index).abs() < 1e-5, "{wavelength}");
        }
    }

    #[test]
    fn indices_change_as_their_law_says() {
        let glass = |ior: f64, dispersion: Dispersion| Dielectric { ior, dispersion, ..Dielectric::default() };
        assert_eq!(glass(1.5, Dispersion::None).index_at(400.0), 1.5);
        assert_eq!(glass(1.5, Dispersion::Khr(0.3)).index_at(400.0), dispersed_index(1.5, 0.3, 400.0));
        assert!(glass(1.5, Dispersion::Khr(0.3)).disperses());
        // Air has nothing to disperse with.
        for still in [glass(1.5, Dispersion::None), glass(1.5, Dispersion::Khr(0.0)), glass(1.0, Dispersion::Khr(0.3))]
        {
            assert!(!still.disperses() && still.index_at(400.0) == still.index_at(700.0), "{still:?}");
        }
    }

    #[test]
    fn a_new_index_takes_a_glass_its_own_dispersion_but_no_other() {
        for glass in GLASSES {
            let mut other = named(glass.name);
            other.set_ior(1.4);
            assert_eq!((other.ior, other.dispersion), (1.4, Dispersion::None), "{}", glass.name);
        }
        let mut strong = Dielectric { dispersion: Dispersion::Khr(0.7), ..named("water") };
        strong.set_ior(1.4);
        assert_eq!((strong.ior, strong.dispersion), (1.4, Dispersion::Khr(0.7)));
    }
}
