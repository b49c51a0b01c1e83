//! Materials of glTF. In flow their numbers, out flow [`Material`]s, and what is said of what they cannot have here.
//!
//! | glTF | becomes |
//! | --- | --- |
//! | `transmissionFactor` above 0, of what is no metal | a dielectric, else opaque |
//! | `transmissionFactor`, `transmissionTexture`, `metallicFactor`, `baseColorFactor`, `baseColorTexture` of a dielectric | its coating |
//! | `thicknessFactor` 0, or none | `thin_walled` |
//! | `ior`; none: 1.5 | index of both |
//! | `dispersion`, `attenuationColor`, `attenuationDistance` | the same of a dielectric |
//! | `roughnessFactor`, `metallicFactor`, `metallicRoughnessTexture`, `specularFactor` | the same |
//! | `baseColorFactor`, `baseColorTexture` | base colour, and an image that is multiplied by it |
//! | `emissiveFactor`, `emissiveTexture`, `emissiveStrength` | their product is the emission: a nit counts as 1 W/(m^2 sr) |
//! | `unlit` | the base colour is sent out |
//! | `normalTexture` | a map of normals |
//! | `alphaMode`, `alphaCutoff` | where the surface is not there |

use std::collections::HashMap;

use glam::{DMat2, DVec2, DVec3};
use gltf::Document;
use gltf::json::extensions::texture::{
    TextureTransform, TextureTransformOffset, TextureTransformRotation, TextureTransformScale,
};
use gltf::material::{AlphaMode, Material as Source};
use gltf::texture::{Info, Texture, WrappingMode};

use super::Remarks;
use super::container::{Bytes, Resources};
use crate::scene::mesh_file::{Image, ImageSource};
use crate::scene::{
    Coating, Cutout, Dielectric, Dispersion, Encoding, Material, NormalMap, Opaque, Surface, TextureMap, Wrap,
};

/// An index as high as those of KHR_materials_ior's 0, which stands for one without end.
const ENDLESS: f64 = 1e6;

/// Converts materials, one after the other.
pub struct Converter<'a> {
    document: &'a Document,
    resources: &'a Resources<'a>,
    buffers: &'a [Bytes<'a>],
    remarks: &'a mut Remarks,
    /// The images of all that were converted.
    pub images: Vec<Image>,
    /// Where in [`Converter::images`] an image is.
    numbers: HashMap<(usize, Encoding), usize>,
    sources: HashMap<usize, Result<ImageSource, String>>,
    /// The set of texture coordinates that the material's images use so far.
    set: Option<u32>,
}

impl<'a> Converter<'a> {
    /// Of materials of `document`.
    pub fn new(
        document: &'a Document,
        resources: &'a Resources<'a>,
        buffers: &'a [Bytes<'a>],
        remarks: &'a mut Remarks,
    ) -> Self {
        let (images, numbers, sources) = (Vec::new(), HashMap::new(), HashMap::new());
        Self { document, resources, buffers, remarks, images, numbers, sources, set: None }
    }

    /// The material, and the set of texture coordinates that its images use.
    pub fn convert(&mut self, source: &Source<'_>) -> (Material, u32) {
        self.set = None;
        let index = source.index().unwrap_or(0);
        let name = source.name().map_or_else(|| format!("material {index}"), str::to_owned);
        let pbr = source.pbr_metallic_roughness();
        let color_map = pbr.base_color_texture().and_then(|info| self.map(&info, Encoding::Color, &name));
        let surface = if source.unlit() {
            Surface::Opaque(self.unlit(source, color_map, &name))
        } else {
            self.left_out(source);
            let metallic = self.within(&name, "metallicFactor", pbr.metallic_factor(), 0.0, 1.0);
            let roughness = self.within(&name, "roughnessFactor", pbr.roughness_factor(), 0.0, 1.0);
            let map = pbr.metallic_roughness_texture();
            let map = map.and_then(|info| self.map(&info, Encoding::Data, &name));
            let transmission = source.transmission().map_or(0.0, |transmission| transmission.transmission_factor());
            let transmission = self.within(&name, "transmissionFactor", transmission, 0.0, 1.0);
            // Where metal is everywhere nothing gets through.
            let lets_through = transmission > 0.0 && (metallic < 1.0 || map.is_some());
            if transmission > 0.0 && !lets_through {
                self.remarks.say(format!(
                    "material {name:?}: metallicFactor is 1, and metal lets nothing through: transmissionFactor {transmission} has no effect"
                ));
            }
            let common = Common { metallic, roughness, map, color_map, transmission };
            match lets_through {
                true => Surface::Dielectric(self.dielectric(source, &name, &common)),
                false => Surface::Opaque(self.opaque(source, &name, &common)),
            }
        };
        let normal_map = source.normal_texture().filter(|_| !source.unlit()).and_then(|normal| {
            let set = normal.tex_coord();
            // The crate leaves this one as JSON.
            let transform = normal.extension_value("KHR_texture_transform").cloned();
            let transform = transform.and_then(|json| serde_json::from_value(json).ok());
            let map = self.place(&normal.texture(), set, transform, Encoding::Data, &name)?;
            Some(NormalMap { map, scale: self.within(&name, "the scale of normalTexture", normal.scale(), -1e3, 1e3) })
        });
        let [.., alpha] = pbr.base_color_factor();
        let alpha = self.within(&name, "the alpha of baseColorFactor", alpha, 0.0, 1.0);
        let cutout = match source.alpha_mode() {
            AlphaMode::Opaque => None,
            AlphaMode::Mask => {
                let cutoff = source.alpha_cutoff().unwrap_or(0.5);
                Some(Cutout {
                    alpha,
                    map: color_map,
                    cutoff: Some(self.within(&name, "alphaCutoff", cutoff, 0.0, 1e9)),
                })
            }
            AlphaMode::Blend => Some(Cutout { alpha, map: color_map, cutoff: None }),
        };
        (Material { name, surface, normal_map, cutout }, self.set.unwrap_or(0))
    }

    fn dielectric(&mut self, source: &Source<'_>, name: &str, common: &Common) -> Dielectric {
        let clear = Dielectric::default();
        let pbr = source.pbr_metallic_roughness();
        let volume = source.volume();
        let thick = volume.as_ref().map_or(0.0, |volume| volume.thickness_factor());
        let [r, g, b, _] = pbr.base_color_factor();
        let transmission_texture = source.transmission().and_then(|transmission| transmission.transmission_texture());
        let coating = Coating {
            base_color: self.color(name, "baseColorFactor", [r, g, b], 1.0),
            base_color_texture: common.color_map,
            transmission: common.transmission,
            transmission_texture: transmission_texture.and_then(|info| self.map(&info, Encoding::Data, name)),
            metallic: common.metallic,
        };
        if source.emissive_factor() != [0.0; 3] {
            self.remarks.leave_out("emission of dielectrics");
        }
        if source.specular().is_some_and(|specular| specular.specular_factor() != 1.0) {
            self.remarks.leave_out("specularFactor of dielectrics (their index tells what they reflect)");
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
            roughness: common.roughness,
            dispersion: if dispersion > 0.0 { Dispersion::Khr(dispersion) } else { Dispersion::None },
            attenuation_color,
            attenuation_distance,
            thin_walled: thick <= 0.0,
            priority: clear.priority,
            metallic_roughness_texture: common.map,
            coating: (coating != Coating::default()).then(|| Box::new(coating)),
        }
    }

    /// What sends its colour out, whatever shines on it.
    fn unlit(&mut self, source: &Source<'_>, color_map: Option<TextureMap>, name: &str) -> Opaque {
        let [r, g, b, _] = source.pbr_metallic_roughness().base_color_factor();
        let emission = self.color(name, "baseColorFactor", [r, g, b], 1.0);
        let nothing = Opaque { base_color: DVec3::ZERO, specular: 0.0, ..Opaque::default() };
        Opaque { emission, emission_texture: color_map, ..nothing }
    }

    fn opaque(&mut self, source: &Source<'_>, name: &str, common: &Common) -> Opaque {
        let pbr = source.pbr_metallic_roughness();
        let [r, g, b, _] = pbr.base_color_factor();
        let base_color = self.color(name, "baseColorFactor", [r, g, b], 1.0);
        let emission_texture = source.emissive_texture();
        let strength = source.emissive_strength().unwrap_or(1.0);
        let emission = source.emissive_factor().map(|channel| channel * strength);
        let specular = source.specular().map_or(1.0, |specular| specular.specular_factor());
        let ior = match source.ior() {
            None => Opaque::default().ior,
            Some(0.0) => ENDLESS,
            Some(ior) => self.within(name, "ior", ior, 1.0, ENDLESS),
        };
        let (emission, emission_texture) = match emission_texture {
            None => (emission, None),
            // Where an image does not say what shines nothing does.
            Some(info) => match self.map(&info, Encoding::Color, name) {
                None => ([0.0; 3], None),
                map => (emission, map),
            },
        };
        Opaque {
            base_color,
            base_color_texture: common.color_map,
            metallic: common.metallic,
            roughness: common.roughness,
            metallic_roughness_texture: common.map,
            ior,
            specular: self.within(name, "specularFactor", specular, 0.0, 1.0),
            emission: self.color(name, "emissiveFactor times emissiveStrength", emission, 1e9),
            emission_texture,
        }
    }

    /// An image as a material wears it.
    fn map(&mut self, info: &Info<'_>, encoding: Encoding, name: &str) -> Option<TextureMap> {
        let transform = info.texture_transform().map(|transform| TextureTransform {
            offset: TextureTransformOffset(transform.offset()),
            rotation: TextureTransformRotation(transform.rotation()),
            scale: TextureTransformScale(transform.scale()),
            tex_coord: transform.tex_coord(),
            ..TextureTransform::default()
        });
        self.place(&info.texture(), info.tex_coord(), transform, encoding, name)
    }

    fn place(
        &mut self,
        texture: &Texture<'_>,
        set: u32,
        transform: Option<TextureTransform>,
        encoding: Encoding,
        name: &str,
    ) -> Option<TextureMap> {
        let set = transform.as_ref().and_then(|transform| transform.tex_coord).unwrap_or(set);
        if *self.set.get_or_insert(set) != set {
            self.remarks.leave_out("images on a second set of texture coordinates");
            return None;
        }
        let (turn, offset) = match transform {
            None => (DMat2::IDENTITY, DVec2::ZERO),
            Some(transform) => {
                let (sine, cosine) = f64::from(transform.rotation.0).sin_cos();
                let [u, v] = transform.scale.0.map(f64::from);
                // Counter-clockwise, v being downwards.
                let turn = DMat2::from_cols_array(&[u * cosine, -u * sine, v * sine, v * cosine]);
                (turn, DVec2::from_array(transform.offset.0.map(f64::from)))
            }
        };
        let is_near = |x: f64| x.abs() <= 1e9;
        if !(turn.to_cols_array().into_iter().all(is_near) && offset.to_array().into_iter().all(is_near)) {
            self.remarks.say(format!("material {name:?}: KHR_texture_transform is beyond 1e9; the image is left out"));
            return None;
        }
        let sampler = texture.sampler();
        let wrap = [sampler.wrap_s(), sampler.wrap_t()].map(|mode| match mode {
            WrappingMode::ClampToEdge => Wrap::Clamp,
            WrappingMode::MirroredRepeat => Wrap::Mirror,
            WrappingMode::Repeat => Wrap::Repeat,
        });
        match self.source(texture) {
            Ok((number, source)) => {
                let images = &mut self.images;
                let texture = *self.numbers.entry((number, encoding)).or_insert_with(|| {
                    images.push(Image { source, encoding, replaces: false });
                    images.len() - 1
                });
                Some(TextureMap { texture, turn, offset, wrap })
            }
            Err(why) => {
                self.remarks.say(format!("material {name:?}: an image cannot be read, and is left out: {why}"));
                None
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

    /// Notes what a material says and does not get.
    fn left_out(&mut self, source: &Source<'_>) {
        let thickness = source.volume().and_then(|volume| volume.thickness_texture());
        let specular = source.specular();
        let specular_maps = specular.as_ref().is_some_and(|specular| {
            specular.specular_texture().is_some() || specular.specular_color_texture().is_some()
        });
        let tints = specular.is_some_and(|specular| specular.specular_color_factor() != [1.0; 3]);
        for (is, what) in [
            (source.occlusion_texture().is_some(), "occlusion textures"),
            (thickness.is_some(), "thickness textures (the mesh has its own thickness)"),
            (specular_maps, "specular textures"),
            (tints, "specular colours"),
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

/// What materials of both kinds have.
struct Common {
    metallic: f64,
    roughness: f64,
    map: Option<TextureMap>,
    color_map: Option<TextureMap>,
    transmission: f64,
}
