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

use std::collections::HashMap;

use glam::{DMat2, DVec2, DVec3};
use gltf::Document;
use gltf::material::{AlphaMode, Material as Source};
use gltf::texture::{Info, Texture, WrappingMode};

use super::Remarks;
use super::container::{Bytes, Resources};
use crate::scene::mesh_file::{Image, ImageSource};
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
    document: &'a Document,
    resources: &'a Resources<'a>,
    buffers: &'a [Bytes<'a>],
    remarks: &'a mut Remarks,
    /// The images of all that were converted.
    pub images: Vec<Image>,
    /// Where in [`Converter::images`] an image is, multiplied by the factor of these bits.
    numbers: HashMap<(usize, [u64; 3]), usize>,
    sources: HashMap<usize, Result<ImageSource, String>>,
    /// Of images the means of their channels, by what 8 bits stand for.
    means: HashMap<(usize, bool), Result<DVec3, String>>,
}

impl<'a> Converter<'a> {
    /// Of materials of `document`.
    pub fn new(
        document: &'a Document,
        resources: &'a Resources<'a>,
        buffers: &'a [Bytes<'a>],
        remarks: &'a mut Remarks,
    ) -> Self {
        let (images, numbers, sources, means) = (Vec::new(), HashMap::new(), HashMap::new(), HashMap::new());
        Self { document, resources, buffers, remarks, images, numbers, sources, means }
    }

    /// The material, and how its image lies on meshes.
    pub fn convert(&mut self, source: &Source<'_>) -> (Material, Option<Coordinates>) {
        let index = source.index().unwrap_or(0);
        let name = source.name().map_or_else(|| format!("material {index}"), str::to_owned);
        let pbr = source.pbr_metallic_roughness();
        if source.unlit() {
            return (Material { surface: Surface::Opaque(self.unlit(source, &name)), name }, None);
        }
        self.left_out(source);
        // Green is roughness, blue is metal.
        let map = pbr.metallic_roughness_texture();
        let map =
            map.map_or(DVec3::ONE, |info| self.mean(&info.texture(), false, "metallic-roughness textures", &name));
        let metallic = map.z * self.within(&name, "metallicFactor", pbr.metallic_factor(), 0.0, 1.0);
        let roughness = map.y * self.within(&name, "roughnessFactor", pbr.roughness_factor(), 0.0, 1.0);
        let transmission = source.transmission().map_or(0.0, |transmission| {
            let map = transmission.transmission_texture();
            let map = map.map_or(DVec3::ONE, |info| self.mean(&info.texture(), false, "transmission textures", &name));
            map.x * f64::from(transmission.transmission_factor())
        });
        let through = transmission * (1.0 - metallic);
        if through > 0.0 && through < 1.0 {
            let shown = if through < 0.5 { "opaque" } else { "a dielectric" };
            self.remarks
                .say(format!("material {name:?}: lets {through:.2} of the light through and is shown as {shown}"));
        }
        if through >= 0.5 {
            return (Material { surface: Surface::Dielectric(self.dielectric(source, &name, roughness)), name }, None);
        }
        let (opaque, coordinates) = self.opaque(source, &name, metallic, roughness);
        (Material { surface: Surface::Opaque(opaque), name }, coordinates)
    }

    fn dielectric(&mut self, source: &Source<'_>, name: &str, roughness: f64) -> Dielectric {
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
            roughness,
            dispersion: if dispersion > 0.0 { Dispersion::Khr(dispersion) } else { Dispersion::None },
            attenuation_color,
            attenuation_distance,
            thin_walled: thick <= 0.0,
            priority: clear.priority,
        }
    }

    /// What sends its colour out, whatever shines on it.
    fn unlit(&mut self, source: &Source<'_>, name: &str) -> Opaque {
        let pbr = source.pbr_metallic_roughness();
        let [r, g, b, _] = pbr.base_color_factor();
        let map = pbr.base_color_texture();
        let what = "base colour textures of unlit materials";
        let map = map.map_or(DVec3::ONE, |info| self.mean(&info.texture(), true, what, name));
        let emission = map * self.color(name, "baseColorFactor", [r, g, b], 1.0);
        Opaque { base_color: DVec3::ZERO, specular: 0.0, emission, ..Opaque::default() }
    }

    fn opaque(
        &mut self,
        source: &Source<'_>,
        name: &str,
        metallic: f64,
        roughness: f64,
    ) -> (Opaque, Option<Coordinates>) {
        let pbr = source.pbr_metallic_roughness();
        let [r, g, b, _] = pbr.base_color_factor();
        let base_color = self.color(name, "baseColorFactor", [r, g, b], 1.0);
        let map = source.emissive_texture();
        let map = map.map_or(DVec3::ONE, |info| self.mean(&info.texture(), true, "emissive textures", name));
        let strength = source.emissive_strength().unwrap_or(1.0);
        let emissive = source.emissive_factor().map(|channel| channel * strength);
        let emission = map * self.color(name, "emissiveFactor", emissive, 1e9);
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
            roughness,
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
        match self.source(&info.texture()) {
            Ok((number, source)) => {
                let images = &mut self.images;
                let number = *self.numbers.entry((number, factor.to_array().map(f64::to_bits))).or_insert_with(|| {
                    images.push(Image { source, factor });
                    images.len() - 1
                });
                (Some(number), coordinates)
            }
            Err(why) => {
                self.remarks.say(format!("material {name:?}: its image cannot be read, and its colour is used: {why}"));
                (None, coordinates)
            }
        }
    }

    /// The number of an image in the file, and where its bytes are.
    fn source(&mut self, texture: &Texture<'_>) -> Result<(usize, ImageSource), String> {
        let image = texture.source().ok_or("it is of a kind that is not read; known: PNG, JPEG")?;
        let number = image.index();
        let find = || self.resources.image(self.document, number, self.buffers);
        self.sources.entry(number).or_insert_with(find).clone().map(|source| (number, source))
    }

    /// The mean of an image that is not looked at more closely, of 8 bits a channel as sRGB or linear.
    fn mean(&mut self, texture: &Texture<'_>, is_srgb: bool, what: &str, name: &str) -> DVec3 {
        self.remarks.leave_out(format!("{what} (their mean is used)"));
        let (resources, source) = (self.resources, self.source(texture));
        let mean = source.and_then(|(number, source)| {
            let find = || resources.mean(&source, is_srgb);
            self.means.entry((number, is_srgb)).or_insert_with(find).clone()
        });
        mean.unwrap_or_else(|why| {
            self.remarks.say(format!("material {name:?}: an image cannot be read, and counts as white: {why}"));
            DVec3::ONE
        })
    }

    /// Notes what a material says and does not get.
    fn left_out(&mut self, source: &Source<'_>) {
        let thickness = source.volume().and_then(|volume| volume.thickness_texture());
        let specular = source.specular();
        let specular_maps = specular.as_ref().is_some_and(|specular| {
            specular.specular_texture().is_some() || specular.specular_color_texture().is_some()
        });
        let tints = specular.is_some_and(|specular| specular.specular_color_factor() != [1.0; 3]);
        let wraps = source.pbr_metallic_roughness().base_color_texture().is_some_and(|info| {
            let sampler = info.texture().sampler();
            [sampler.wrap_s(), sampler.wrap_t()] != [WrappingMode::Repeat; 2]
        });
        for (is, what) in [
            (source.normal_texture().is_some(), "normal maps"),
            (source.occlusion_texture().is_some(), "occlusion textures"),
            (thickness.is_some(), "thickness textures (the mesh has its own thickness)"),
            (specular_maps, "specular textures"),
            (tints, "specular colours"),
            (source.alpha_mode() != AlphaMode::Opaque, "alpha (mask and blend)"),
            (wraps, "wrapping of textures other than REPEAT"),
        ] {
            if is {
                self.remarks.leave_out(what);
            }
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
