//! Materials of Wavefront MTL files. In flow the names of the files, out flow [`Material`]s, the paths of their images
//! and remarks.
//!
//! | MTL | becomes |
//! | --- | --- |
//! | `illum` 4, 6, 7 or 9; or `d` below 1 (`Tr` above 0); or a `Ni` other than 1 with neither `illum` nor `d` | a dielectric, else opaque |
//! | `Ni` | index of a dielectric; absent or 0: 1.5 |
//! | `Pr` | roughness of both |
//! | `Tf` | `attenuation_color` of a dielectric at 1 m, MTL having no distance |
//! | `Kd`, `map_Kd`, `Pm`, `Ke` | base colour and its image, metallic, emission of an opaque surface |
//! | `illum` 0 or 1, or black `Ks` | no specular reflection of an opaque surface |
//! | `map_Ke` | image of the emission, multiplied by `Ke` unless that is black |
//! | `norm`; `map_Bump` or `bump` with `-bm` | map of normals; what does not look like one are heights, in texels; its strength |
//! | `map_d` | the surface is not there where it is darker than a half, or its alpha below |
//!
//! A line that cannot be understood is left out with a remark, a value out of range is moved to the nearest end of the
//! range with a remark: an MTL file is a by-product, and many are careless. `tobj` reads a text without such lines,
//! because it gives up on them or panics.

use std::collections::HashSet;
use std::path::Path;

use glam::DVec3;

use super::files::Files;
use super::maps::{Cutout, NormalMap, TextureMap};
use super::material::{Dielectric, Material, Opaque, Surface};
use super::mesh_file::{Image, ImageSource, shorten};
use super::texture::Encoding;

/// Metres over which `Tf` is taken to act.
const FILTER_DISTANCE: f64 = 1.0;

/// The materials of the `libraries` that the `.obj` at `obj` names. Their textures are indices into `images`, where the
/// paths are added. What cannot be read is a remark.
pub fn read_all(
    files: Files,
    obj: &Path,
    libraries: &[String],
    images: &mut Vec<Image>,
    remarks: &mut Vec<String>,
) -> Vec<Material> {
    let folder = obj.parent().unwrap_or(Path::new(""));
    let mut done = HashSet::new();
    let mut materials = Vec::new();
    for library in libraries {
        // A line names one file, perhaps with spaces in its name, or several.
        let whole = folder.join(library);
        let paths = match files.exists(&whole) || !library.contains(char::is_whitespace) {
            true => vec![whole],
            false => library.split_whitespace().map(|name| folder.join(name)).collect(),
        };
        for path in paths {
            if done.insert(files.identity(&path)) {
                let before = remarks.len();
                materials.extend(read(files, &path, images, remarks));
                shorten(remarks, before, "remarks on this file's materials");
            }
        }
    }
    materials
}

fn read(files: Files, path: &Path, images: &mut Vec<Image>, remarks: &mut Vec<String>) -> Vec<Material> {
    let bytes = match files.read(path) {
        Ok(bytes) => bytes,
        Err(error) => {
            remarks.push(format!("{}; its materials are replaced by clear glass", error.in_full()));
            return Vec::new();
        }
    };
    let text = String::from_utf8_lossy(&bytes);
    let mut tidy = String::with_capacity(text.len());
    let mut left_out = Vec::new();
    for (index, line) in text.lines().enumerate() {
        match tidy_line(line) {
            Some(line) => {
                tidy.push_str(&line);
                tidy.push('\n');
            }
            None => left_out.push(index + 1),
        }
    }
    if let Some(first) = left_out.first() {
        let count = left_out.len();
        remarks
            .push(format!("{}: {count} lines not understood and left out, the first is line {first}", path.display()));
    }
    match tobj::load_mtl_buf(&mut tidy.as_bytes()) {
        Ok((materials, _)) => {
            materials.into_iter().map(|m| Converter { files, path, images, remarks, material: &m }.convert()).collect()
        }
        Err(error) => {
            remarks.push(format!("{}: cannot be read as MTL: {error}", path.display()));
            Vec::new()
        }
    }
}

/// A line as tobj reads it right: empty for what does not matter here, `None` for what is wrong.
fn tidy_line(line: &str) -> Option<String> {
    let line = line.trim();
    let (keyword, rest) = line.split_once(char::is_whitespace).map_or((line, ""), |(k, rest)| (k, rest.trim()));
    match keyword {
        "newmtl" => (!rest.is_empty()).then(|| format!("newmtl {rest}")),
        "Kd" | "Ks" | "Ke" | "Tf" => {
            let numbers: Option<Vec<f32>> = rest.split_whitespace().take(3).map(|word| word.parse().ok()).collect();
            match numbers?[..] {
                [r, g, b] => Some(format!("{keyword} {r} {g} {b}")),
                [grey] => Some(format!("{keyword} {grey} {grey} {grey}")),
                _ => None,
            }
        }
        "Ni" | "d" | "Tr" | "Pr" | "Pm" => {
            let words: Vec<_> = rest.split_whitespace().filter(|word| *word != "-halo").collect();
            let number: f32 = words.first()?.parse().ok()?;
            Some(format!("{keyword} {number}"))
        }
        "illum" => rest.split_whitespace().next()?.parse().ok().map(|model: u8| format!("illum {model}")),
        "map_Kd" | "map_Ke" | "map_Pr" | "map_Pm" | "map_d" | "norm" => {
            image_name(rest).map(|name| format!("{keyword} {name}"))
        }
        "map_Bump" | "map_bump" | "bump" => image_name(rest).map(|name| {
            let words: Vec<_> = rest.split_whitespace().collect();
            let strength = words.array_windows().find(|[option, _]| *option == "-bm");
            let strength = strength.and_then(|[_, number]| number.parse::<f32>().ok()).filter(|x| x.is_finite());
            let strength = strength.unwrap_or(1.0).clamp(-1e3, 1e3);
            // Under names of our own, which tobj leaves as they are.
            format!("bump_strength {strength}\nbump_image {name}")
        }),
        _ => Some(String::new()),
    }
}

/// The file name of a map, without the options in front of it.
fn image_name(mut rest: &str) -> Option<String> {
    let take_word = |text: &mut &str| {
        let (word, others) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
        let word = word.to_owned();
        *text = others.trim_start();
        word
    };
    while rest.starts_with('-') {
        let values = match take_word(&mut rest).as_str() {
            "-mm" => 2,
            "-o" | "-s" | "-t" => {
                rest.split_whitespace().take(3).take_while(|word| word.parse::<f32>().is_ok()).count()
            }
            _ => 1,
        };
        for _ in 0..values {
            take_word(&mut rest);
        }
    }
    (!rest.is_empty()).then(|| rest.to_owned())
}

struct Converter<'a> {
    files: Files,
    path: &'a Path,
    images: &'a mut Vec<Image>,
    remarks: &'a mut Vec<String>,
    material: &'a tobj::Material,
}

impl Converter<'_> {
    fn convert(mut self) -> Material {
        let surface =
            if self.is_dielectric() { Surface::Dielectric(self.dielectric()) } else { Surface::Opaque(self.opaque()) };
        if let Some(key) = ["map_Pr", "map_Pm", "map_Ks", "map_Ns", "map_Tr"]
            .into_iter()
            .find(|key| self.material.unknown_param.contains_key(*key))
        {
            self.remark(&format!("{key} is not read; the number is used"));
        }
        let mut material = Material::new(self.material.name.clone(), surface);
        material.normal_map = self.normal_map();
        material.cutout = self.cutout();
        material
    }

    fn is_dielectric(&self) -> bool {
        let dissolve = self.material.dissolve.or_else(|| self.number("Tr").map(|transparency| 1.0 - transparency));
        let refracts = self.material.optical_density.is_some_and(|ior| ior != 1.0 && ior != 0.0);
        match self.material.illumination_model {
            Some(4 | 6 | 7 | 9) => true,
            Some(_) => dissolve.is_some_and(|d| d < 1.0),
            None => dissolve.map_or(refracts, |d| d < 1.0),
        }
    }

    fn dielectric(&mut self) -> Dielectric {
        let clear = Dielectric::default();
        let ior = match self.material.optical_density {
            None | Some(0.0) => clear.ior,
            // No index at all: what is meant cannot be guessed from it.
            Some(ior) if ior < 0.0 || ior.is_nan() => {
                self.remark(&format!("Ni {ior} is no index of refraction; {} is used", clear.ior));
                clear.ior
            }
            Some(ior) => self.within("Ni", ior.into(), 0.001, 10.0, clear.ior),
        };
        let roughness =
            self.number("Pr").map_or(clear.roughness, |r| self.within("Pr", r.into(), 0.0, 1.0, clear.roughness));
        let filter =
            self.triple("Tf").map(|filter| self.color("Tf", filter, 1.0)).filter(|&filter| filter != DVec3::ONE);
        let (attenuation_color, attenuation_distance) = match filter {
            None => (clear.attenuation_color, clear.attenuation_distance),
            Some(DVec3::ZERO) => {
                self.remark("Tf 0 0 0 lets nothing through; left out");
                (clear.attenuation_color, clear.attenuation_distance)
            }
            Some(filter) => (filter, FILTER_DISTANCE),
        };
        Dielectric { ior, roughness, attenuation_color, attenuation_distance, ..clear }
    }

    fn opaque(&mut self) -> Opaque {
        let plain = Opaque::default();
        let base_color = self.material.diffuse.map_or(plain.base_color, |color| self.color("Kd", color, 1.0));
        let emission = self.material.emissive.map_or(plain.emission, |color| self.color("Ke", color, 1e9));
        let roughness =
            self.number("Pr").map_or(plain.roughness, |r| self.within("Pr", r.into(), 0.0, 1.0, plain.roughness));
        let metallic =
            self.number("Pm").map_or(plain.metallic, |m| self.within("Pm", m.into(), 0.0, 1.0, plain.metallic));
        let matt = matches!(self.material.illumination_model, Some(0 | 1)) || self.material.specular == Some([0.0; 3]);
        let specular = if matt { 0.0 } else { plain.specular };
        let base_color_texture = self.map("map_Kd", Encoding::Color);
        let emission_texture = self.map("map_Ke", Encoding::Color);
        let emission = if emission_texture.is_some() && emission == DVec3::ZERO { DVec3::ONE } else { emission };
        Opaque {
            base_color,
            base_color_texture,
            metallic,
            roughness,
            metallic_roughness_texture: None,
            ior: plain.ior,
            specular,
            emission,
            emission_texture,
        }
    }

    fn normal_map(&mut self) -> Option<NormalMap> {
        if let Some(map) = self.map("norm", Encoding::Data) {
            return Some(NormalMap { map, scale: 1.0 });
        }
        let map = self.map("bump_image", Encoding::Bump)?;
        Some(NormalMap { map, scale: self.number("bump_strength").map_or(1.0, f64::from) })
    }

    /// Where an image of `d` is black the surface is not there.
    fn cutout(&mut self) -> Option<Cutout> {
        self.map("map_d", Encoding::Opacity).map(|map| Cutout { alpha: 1.0, map: Some(map), cutoff: Some(0.5) })
    }

    fn map(&mut self, key: &str, encoding: Encoding) -> Option<TextureMap> {
        let material = self.material;
        let name = match key {
            "map_Kd" => material.diffuse_texture.as_ref(),
            "map_d" => material.dissolve_texture.as_ref(),
            _ => material.unknown_param.get(key),
        };
        // Exporters for Windows write its separator.
        let path = self.path.parent().unwrap_or(Path::new("")).join(name?.replace('\\', "/"));
        if self.files.exists(&path) {
            // Exporters write anything for the colour beside an image.
            let replaces_color = key == "map_Kd";
            self.images.push(Image { source: ImageSource::File(path), encoding, replaces_color });
            return Some(TextureMap::of(self.images.len() - 1));
        }
        let (key, instead) = match key {
            "map_Kd" => (key, "; the colour is used"),
            "bump_image" => ("map_Bump", "; left out"),
            _ => (key, "; left out"),
        };
        self.remark(&format!("{key} {:?} does not exist{instead}", path.display().to_string()));
        None
    }

    fn number(&self, key: &str) -> Option<f32> {
        self.material.unknown_param.get(key)?.parse().ok()
    }

    fn triple(&self, key: &str) -> Option<[f32; 3]> {
        let numbers: Vec<f32> = self.material.unknown_param.get(key)?.split_whitespace().flat_map(str::parse).collect();
        numbers.try_into().ok()
    }

    fn color(&mut self, key: &str, color: [f32; 3], highest: f64) -> DVec3 {
        DVec3::from_array(color.map(|channel| self.within(key, channel.into(), 0.0, highest, 0.0)))
    }

    fn within(&mut self, key: &str, value: f64, low: f64, high: f64, in_place_of_nan: f64) -> f64 {
        let used = if value.is_nan() { in_place_of_nan } else { value.clamp(low, high) };
        if used != value {
            self.remark(&format!("{key} {value} is not between {low} and {high}; {used} is used"));
        }
        used
    }

    fn remark(&mut self, what: &str) {
        self.remarks.push(format!("{}: material {:?}: {what}", self.path.display(), self.material.name));
    }
}
