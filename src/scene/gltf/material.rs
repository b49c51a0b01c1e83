//! Materials of glTF. In flow their numbers, out flow [`Material`]s, and what is said of what they cannot have here.
//!
//! | glTF | becomes |
//! | --- | --- |
//! | `transmissionFactor` of at least a half, of what is no metal | a dielectric, else opaque |
//! | `thicknessFactor` 0, or none | `thin_walled` |
//! | `ior`; none: 1.5 | index of a dielectric; strength of the specular reflection of an opaque surface |
//! | `dispersion`, `attenuationColor`, `attenuationDistance` | the same of a dielectric |
//! | `roughnessFactor`, `metallicFactor`, `specularFactor` | the same |
//! | `baseColorFactor`, `baseColorTexture` | base colour, and an image that is multiplied by it |
//! | `emissiveFactor`, `emissiveStrength` | their product is the emission: a nit counts as 1 W/(m^2 sr) |
//! | `unlit` | the base colour is sent out |

use std::borrow::Cow;

use glam::{DMat2, DVec2, DVec3};
use gltf::Document;
use gltf::material::{AlphaMode, Material as Source};
use gltf::texture::Info;

use super::Remarks;
use super::container::Resources;
use crate::scene::mesh_file::Image;
use crate::scene::{Dielectric, Dispersion, Material, Opaque, Surface};

/// What KHR_materials_specular scales: the reflectance of an index of 1.5.
const REFLECTANCE: f64 = 0.04;

/// The image of a material's base colour, as its meshes have to know it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coordinates {
    /// The number of the set of texture coordinates.
    pub set: u32,
    /// Scales, rotates and moves them, as KHR_texture_transform has it.
    pub turn: DMat2,
    /// After the turn.
    pub offset: DVec2,
}

impl Default for Coordinates {
    fn default() -> Self {
        Self { set: 0, turn: DMat2::IDENTITY, offset: DVec2::ZERO }
    }
}

/// Converts materials, one after the other.
pub struct Converter<'a> {
    pub document: &'a Document,
    pub resources: &'a Resources<'a>,
    pub buffers: &'a [Cow<'a, [u8]>],
    pub images: Vec<Image>,
    pub remarks: &'a mut Remarks,
}

impl Converter<'_> {
    /// The material, and how its image lies on meshes.
    pub fn convert(&mut self, source: &Source<'_>) -> (Material, Option<Coordinates>) {
        let index = source.index().unwrap_or(0);
        let name = source.name().map_or_else(|| format!("material {index}"), str::to_owned);
        self.left_out(source);
        let pbr = source.pbr_metallic_roughness();
        let metallic = self.within(&name, "metallicFactor", pbr.metallic_factor(), 0.0, 1.0);
        let transmission = source.transmission().map_or(0.0, |transmission| transmission.transmission_factor());
        let through = f64::from(transmission) * (1.0 - metallic);
        if through > 0.0 && through < 1.0 {
            let shown = if through < 0.5 { "opaque" } else { "a dielectric" };
            self.remarks
                .say(format!("material {name:?}: lets {through:.2} of the light through and is shown as {shown}"));
        }
        if through >= 0.5 {
            return (Material { surface: Surface::Dielectric(self.dielectric(source, &name)), name }, None);
        }
        let (opaque, coordinates) = self.opaque(source, &name, metallic);
        (Material { surface: Surface::Opaque(opaque), name }, coordinates)
    }

    fn dielectric(&mut self, source: &Source<'_>, name: &str) -> Dielectric {
        let clear = Dielectric::default();
        let pbr = source.pbr_metallic_roughness();
        let volume = source.volume();
        let thick = volume.as_ref().map_or(0.0, |volume| volume.thickness_factor());
        let [r, g, b, _] = pbr.base_color_factor();
        if [r, g, b] != [1.0; 3] || pbr.base_color_texture().is_some() {
            self.remarks.leave_out("the base colour of dielectrics (attenuationColor colours them)");
        }
        let (attenuation_color, attenuation_distance) = match volume {
            Some(volume) => {
                let color = self.color(name, "attenuationColor", volume.attenuation_color(), 1.0);
                let distance = volume.attenuation_distance();
                match distance > 0.0 {
                    true => (color, f64::from(distance)),
                    false => {
                        self.remarks
                            .say(format!("material {name:?}: attenuationDistance {distance} is not above 0; left out"));
                        (clear.attenuation_color, clear.attenuation_distance)
                    }
                }
            }
            None => (clear.attenuation_color, clear.attenuation_distance),
        };
        let ior = match source.ior() {
            None => clear.ior,
            Some(ior) => self.within(name, "ior", ior, 1e-6, 1e6),
        };
        let dispersion = source
            .extension_value("KHR_materials_dispersion")
            .and_then(|extension| extension.get("dispersion"))
            .and_then(|number| number.as_f64())
            .map_or(0.0, |number| self.within(name, "dispersion", number as f32, 0.0, 1e9));
        Dielectric {
            ior,
            roughness: self.within(name, "roughnessFactor", pbr.roughness_factor(), 0.0, 1.0),
            dispersion: if dispersion > 0.0 { Dispersion::Khr(dispersion) } else { Dispersion::None },
            attenuation_color,
            attenuation_distance,
            thin_walled: thick <= 0.0,
            priority: clear.priority,
        }
    }

    fn opaque(&mut self, source: &Source<'_>, name: &str, metallic: f64) -> (Opaque, Option<Coordinates>) {
        let pbr = source.pbr_metallic_roughness();
        let [r, g, b, _] = pbr.base_color_factor();
        let base_color = self.color(name, "baseColorFactor", [r, g, b], 1.0);
        let strength = source.emissive_strength().unwrap_or(1.0);
        let emissive = source.emissive_factor().map(|channel| channel * strength);
        let emission = self.color(name, "emissiveFactor", emissive, 1e9);
        if source.unlit() {
            let unlit = Opaque { base_color: DVec3::ZERO, specular: 0.0, emission: base_color, ..Opaque::default() };
            if pbr.base_color_texture().is_some() {
                self.remarks.leave_out("the base colour textures of unlit materials");
            }
            return (unlit, None);
        }
        let mut specular = source.specular().map_or(1.0, |specular| f64::from(specular.specular_factor()));
        // 0 stands for an index without end, for materials that come from another workflow.
        if let Some(ior) = source.ior().filter(|ior| *ior > 0.0) {
            let ior = f64::from(ior);
            specular *= ((ior - 1.0) / (ior + 1.0)).powi(2) / REFLECTANCE;
        }
        let (texture, coordinates) = pbr.base_color_texture().map(|info| self.texture(&info, base_color, name)).unzip();
        let opaque = Opaque {
            base_color,
            base_color_texture: texture.flatten(),
            metallic,
            roughness: self.within(name, "roughnessFactor", pbr.roughness_factor(), 0.0, 1.0),
            specular: self.within(name, "the strength of the specular reflection", specular as f32, 0.0, 1.0),
            emission,
        };
        (opaque, coordinates)
    }

    /// The number of an image, and how it lies on meshes.
    fn texture(&mut self, info: &Info<'_>, factor: DVec3, name: &str) -> (Option<usize>, Coordinates) {
        let transform = info.texture_transform();
        let set = transform.as_ref().and_then(|transform| transform.tex_coord()).unwrap_or(info.tex_coord());
        let coordinates = match transform {
            None => Coordinates { set, ..Coordinates::default() },
            Some(transform) => {
                let (sine, cosine) = f64::from(transform.rotation()).sin_cos();
                let [u, v] = transform.scale().map(f64::from);
                // Counter-clockwise, v being downwards.
                let turn = DMat2::from_cols_array(&[u * cosine, -u * sine, v * sine, v * cosine]);
                Coordinates { set, turn, offset: DVec2::from_array(transform.offset().map(f64::from)) }
            }
        };
        let image = match info.texture().source() {
            Some(image) => self.resources.image(self.document, image.index(), self.buffers),
            None => Err("it is of a kind that is not read; known: PNG, JPEG".into()),
        };
        match image {
            Ok(source) => {
                let image = Image { source, factor };
                let number = self.images.iter().position(|known| *known == image).unwrap_or_else(|| {
                    self.images.push(image);
                    self.images.len() - 1
                });
                (Some(number), coordinates)
            }
            Err(why) => {
                self.remarks.say(format!("material {name:?}: its image cannot be read, and its colour is used: {why}"));
                (None, coordinates)
            }
        }
    }

    /// Notes what a material says and does not get.
    fn left_out(&mut self, source: &Source<'_>) {
        let pbr = source.pbr_metallic_roughness();
        let has_texture = |is: bool, name: &'static str, remarks: &mut Remarks| {
            if is {
                remarks.leave_out(name);
            }
        };
        has_texture(pbr.metallic_roughness_texture().is_some(), "metallic-roughness textures", self.remarks);
        has_texture(source.normal_texture().is_some(), "normal maps", self.remarks);
        has_texture(source.occlusion_texture().is_some(), "occlusion textures", self.remarks);
        has_texture(source.emissive_texture().is_some(), "emissive textures", self.remarks);
        has_texture(
            source.transmission().is_some_and(|transmission| transmission.transmission_texture().is_some()),
            "transmission textures",
            self.remarks,
        );
        has_texture(
            source.volume().is_some_and(|volume| volume.thickness_texture().is_some()),
            "thickness textures (the mesh has its own thickness)",
            self.remarks,
        );
        if let Some(specular) = source.specular() {
            let textures = specular.specular_texture().is_some() || specular.specular_color_texture().is_some();
            has_texture(textures, "specular textures", self.remarks);
            has_texture(specular.specular_color_factor() != [1.0; 3], "specular colours", self.remarks);
        }
        has_texture(source.alpha_mode() != AlphaMode::Opaque, "alpha (mask and blend)", self.remarks);
        if let Some(info) = pbr.base_color_texture() {
            let sampler = info.texture().sampler();
            let repeat = gltf::texture::WrappingMode::Repeat;
            has_texture(
                sampler.wrap_s() != repeat || sampler.wrap_t() != repeat,
                "wrapping of textures other than REPEAT",
                self.remarks,
            );
        }
    }

    fn color(&mut self, name: &str, key: &str, color: [f32; 3], highest: f64) -> DVec3 {
        DVec3::from_array(color.map(|channel| self.within(name, key, channel, 0.0, highest)))
    }

    fn within(&mut self, name: &str, key: &str, value: f32, low: f64, high: f64) -> f64 {
        // As it was written, not as 32 bits have it.
        let exact = value.to_string().parse().unwrap_or(f64::from(value));
        let used = if exact.is_nan() { low } else { exact.clamp(low, high) };
        if used != exact {
            self.remarks
                .say(format!("material {name:?}: {key} {value} is not between {low} and {high}; {used} is used"));
        }
        used
    }
}
