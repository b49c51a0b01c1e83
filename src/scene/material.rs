//! Materials: what flows in are the numbers of a scene file or an MTL, what flows out is one [`Surface`] a material.

use glam::DVec3;

/// A surface with a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// What scenes and messages call it.
    pub name: String,
    /// What it is.
    pub surface: Surface,
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
    /// 20 / Abbe number, as in KHR_materials_dispersion; 0: none.
    pub dispersion: f64,
    /// What white becomes over [`Dielectric::attenuation_distance`], 0 to 1.
    pub attenuation_color: DVec3,
    /// Metres, above 0; infinite: nothing is absorbed.
    pub attenuation_distance: f64,
    /// A pane without an inside.
    pub thin_walled: bool,
    /// Where dielectrics overlap, the higher one is there.
    pub priority: i32,
}

impl Default for Dielectric {
    /// Clear glass.
    fn default() -> Self {
        Self {
            ior: 1.5,
            roughness: 0.01,
            dispersion: 0.0,
            attenuation_color: DVec3::ONE,
            attenuation_distance: f64::INFINITY,
            thin_walled: false,
            priority: 0,
        }
    }
}

/// Metallic-roughness, as glTF.
#[derive(Clone, Debug, PartialEq)]
pub struct Opaque {
    /// Reflectance, 0 to 1.
    pub base_color: DVec3,
    /// An image in the place of [`Opaque::base_color`]: index into [`super::Scene::textures`].
    pub base_color_texture: Option<usize>,
    /// 0: dielectric below, 1: metal.
    pub metallic: f64,
    /// Perceptual roughness, 0 to 1; the alpha of GGX is its square.
    pub roughness: f64,
    /// Strength of the specular reflection, as in KHR_materials_specular; 0: purely Lambertian.
    pub specular: f64,
    /// Radiance that it sends out.
    pub emission: DVec3,
}

impl Default for Opaque {
    fn default() -> Self {
        Self {
            base_color: DVec3::splat(0.8),
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            specular: 1.0,
            emission: DVec3::ZERO,
        }
    }
}

impl Material {
    /// What an object wears that has no material of its own.
    pub fn clear_glass() -> Self {
        Self { name: "clear glass".into(), surface: Surface::Dielectric(Dielectric::default()) }
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
}

/// The media that have names. Indices are relative to air, as catalogues give them; naming a glass sets `ior` alone.
///
/// Sources. Schott's data sheets: N-BK7 (517642), N-SF11 (785257), SF10 (728285), N-BAF10 (670471), N-LAK22 (651559)
/// and, for pyrex, BOROFLOAT 33. Dispersion formulas at the lines d, F and C: Malitson 1965 (fused silica), Malitson
/// 1962 (sapphire, ordinary ray), Malitson 1963 (fluorite), Peter 1923 (diamond), Sultanova et al. 2009 (acrylic).
/// IAPWS R9-97 at 20 C, divided by the index of air (water). Warren & Brandt 2008 (ice).
pub const GLASSES: [Glass; 13] = {
    const fn glass(name: &'static str, ior: f64, abbe: Option<f64>) -> Glass {
        Glass { name, ior, abbe }
    }
    [
        glass("acrylic", 1.49062, Some(53.18)),
        glass("baf10", 1.67003, Some(47.11)),
        glass("bk7", 1.5168, Some(64.17)),
        glass("diamond", 2.41749, Some(55.3)),
        glass("fluorite", 1.43385, Some(95.0)),
        glass("fused-silica", 1.45846, Some(67.82)),
        glass("ice", 1.3098, None),
        glass("lak22", 1.65113, Some(55.89)),
        glass("pyrex", 1.4714, Some(65.41)),
        glass("sapphire", 1.76817, Some(72.31)),
        glass("sf10", 1.72825, Some(28.41)),
        glass("sf11", 1.78472, Some(25.68)),
        glass("water", 1.33299, Some(55.74)),
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

    /// Sellmeier's formula with the coefficients of the data sheets, at the lines d, F and C.
    #[test]
    fn glasses_agree_with_their_dispersion_formulas() {
        let formulas = [
            ("bk7", [1.03961212, 0.231792344, 1.01046945], [0.00600069867, 0.0200179144, 103.560653]),
            ("sf11", [1.73759695, 0.313747346, 1.89878101], [0.013188707, 0.0623068142, 155.23629]),
            ("sf10", [1.61625977, 0.259229334, 1.07762317], [0.0127534559, 0.0581983954, 116.60768]),
            ("baf10", [1.5851495, 0.143559385, 1.08521269], [0.00926681282, 0.0424489805, 105.613573]),
            ("lak22", [1.14229781, 0.535138441, 1.04088385], [0.00585778594, 0.0198546147, 100.834017]),
            ("fused-silica", [0.6961663, 0.4079426, 0.8974794], [0.00467914826, 0.0135120631, 97.9340025]),
            ("sapphire", [1.4313493, 0.65054713, 5.3414021], [0.00527992610, 0.0142382647, 325.017834]),
            ("fluorite", [0.5675888, 0.4710914, 3.8484723], [0.00252643, 0.01007833, 1200.555973]),
            ("diamond", [0.3306, 4.3356, 0.0], [0.030625, 0.011236, 1.0]),
            ("acrylic", [1.1819, 0.0, 0.0], [0.011313, 1.0, 1.0]),
        ];
        for (name, strengths, resonances) in formulas {
            let index = |micrometres: f64| {
                let square = micrometres * micrometres;
                let term = |(b, c): (f64, f64)| b * square / (square - c);
                (1.0 + strengths.into_iter().zip(resonances).map(term).sum::<f64>()).sqrt()
            };
            let glass = Glass::named(name).unwrap();
            let (d, f, c) = (index(0.5875618), index(0.4861327), index(0.6562725));
            assert!((glass.ior - d).abs() < 1e-5, "{name}: {d}");
            assert!((glass.abbe.unwrap() - (d - 1.0) / (f - c)).abs() < 0.01, "{name}: {}", (d - 1.0) / (f - c));
        }
    }
}
