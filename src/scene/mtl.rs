//! Materials of Wavefront MTL files. In flow the names of the files, out flow [`Material`]s, the paths of their images
//! and remarks.
//!
//! | MTL | becomes |
//! | --- | --- |
//! | `illum` 4, 6, 7 or 9; or `d` below 1 (`Tr` above 0); or a `Ni` other than 1 with neither `illum` nor `d` | a dielectric, else opaque |
//! | `Ni` | index of a dielectric; absent or 0: 1.5 |
//! | `Pr`, `map_Pr` | roughness of both; the image stands in the place of the number |
//! | `Tf` | `attenuation_color` of a dielectric at 1 m, MTL having no distance |
//! | `Kd`, `map_Kd`, `Pm`, `map_Pm`, `Ke` | base colour, metallic and their images, emission of an opaque surface |
//! | `illum` 0 or 1, or black `Ks` | no specular reflection of an opaque surface |
//! | `map_Ke` | image of the emission, multiplied by `Ke` unless that is black |
//! | `norm`; `map_Bump` or `bump` with `-bm` | map of normals; what does not look like one are heights, in texels; its strength |
//! | `map_d` | the surface is not there where it is darker than a half, or its alpha below |
//! | `-s`, `-o`, `-clamp on`, `-imfchan` of an image | scale and offset of coordinates, what lies beyond it, the number that counts of roughness and metal |
//!
//! A line that cannot be understood is left out with a remark, a value out of range is moved to the nearest end of the
//! range with a remark: an MTL file is a by-product, and many are careless. `tobj` reads a text without such lines,
//! because it gives up on them or panics.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use glam::{DMat2, DVec2, DVec3};

use super::files::Files;
use super::maps::{Cutout, NormalMap, TextureMap, Wrap};
use super::material::{Dielectric, Material, Opaque, Surface};
use super::mesh_file::{Channel, Image, ImageSource, shorten};
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
        "Ni" | "Ns" | "d" | "Tr" | "Pr" | "Pm" => {
            let words: Vec<_> = rest.split_whitespace().filter(|word| *word != "-halo").collect();
            let number: f32 = words.first()?.parse().ok()?;
            Some(format!("{keyword} {number}"))
        }
        "illum" => rest.split_whitespace().next()?.parse().ok().map(|model: u8| format!("illum {model}")),
        "map_Kd" | "map_Ke" | "map_Pr" | "map_Pm" | "map_d" | "norm" | "map_Bump" | "map_bump" | "bump" => {
            // Under names of our own, which tobj leaves as they are.
            let keyword = if keyword.ends_with("ump") { "bump_image" } else { keyword };
            image_of(rest).map(|(options, name)| format!("{keyword}_options {}\n{keyword} {name}", options.join(" ")))
        }
        "map_Ks" | "map_Ns" | "map_Tr" => Some(format!("not_read {keyword}")),
        _ => Some(String::new()),
    }
}

/// The options of a map and its file name.
fn image_of(rest: &str) -> Option<(Vec<&str>, &str)> {
    let first_word = |text: &str| text.find(char::is_whitespace).unwrap_or(text.len());
    let (mut options, mut name) = (Vec::new(), rest);
    while name.starts_with('-') {
        let option = &name[..first_word(name)];
        let values = match option {
            "-mm" => 2,
            "-o" | "-s" | "-t" => {
                let numbers = name.split_whitespace().skip(1).take(3);
                numbers.take_while(|word| word.parse::<f32>().is_ok()).count()
            }
            _ => 1,
        };
        for _ in 0..=values {
            let end = first_word(name);
            options.extend((end > 0).then_some(&name[..end]));
            name = name[end..].trim_start();
        }
    }
    (!name.is_empty()).then_some((options, name))
}

/// What a line says of an image.
struct MapLine {
    /// The file, which exists.
    path: PathBuf,
    /// How it lies on surfaces; the texture is not known yet.
    map: TextureMap,
    /// Its strength as a bump.
    strength: f64,
    /// The number of a texel that counts; `None`: how bright it is.
    channel: Option<usize>,
}

impl MapLine {
    /// Of the options that stand before the file's name; what is wrong with them goes to `remark`.
    fn new(path: PathBuf, words: &[&str], mut remark: impl FnMut(String)) -> Self {
        let mut line = Self { path, map: TextureMap::of(0), strength: 1.0, channel: None };
        let (mut scale, mut offset) = (DVec2::ONE, DVec2::ZERO);
        // A number begins with a sign, too.
        let is_option = |word: &&&str| word.starts_with('-') && word.parse::<f64>().is_err();
        let mut rest = words.iter().peekable();
        while let Some(&option) = rest.next() {
            let mut values = Vec::new();
            while let Some(&value) = rest.next_if(|word| !is_option(word)) {
                values.push(value);
            }
            let mut number = |i: usize, default: f64| {
                let Some(word) = values.get(i) else { return default };
                let Ok(value) = word.parse::<f64>() else {
                    remark(format!("{option} {word} is no number; {default} is used"));
                    return default;
                };
                let used = if value.is_nan() { default } else { value.clamp(-1e3, 1e3) };
                if used != value {
                    remark(format!("{option} {value} is not between -1000 and 1000; {used} is used"));
                }
                used
            };
            match option {
                "-s" => scale = DVec2::new(number(0, 1.0), number(1, 1.0)),
                "-o" => offset = DVec2::new(number(0, 0.0), number(1, 0.0)),
                "-bm" => line.strength = number(0, 1.0),
                "-clamp" if values == ["on"] => line.map.wrap = [Wrap::Clamp; 2],
                "-imfchan" => line.channel = ["r", "g", "b", "m"].iter().position(|name| values == [*name]),
                // They say how an image is filtered, or what it is for.
                "-clamp" | "-blendu" | "-blendv" | "-boost" | "-texres" | "-type" | "-cc" => {}
                other => remark(format!("{other} is not read")),
            }
        }
        line.map.turn = DMat2::from_diagonal(scale);
        // MTL's v points upwards.
        line.map.offset = DVec2::new(offset.x, 1.0 - scale.y - offset.y);
        line
    }
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
        if matches!(surface, Surface::Dielectric(_)) && self.material.unknown_param.contains_key("map_Pm") {
            self.remark("map_Pm is not read of glass");
        }
        if let Some(key) = self.material.unknown_param.get("not_read") {
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
        let metallic_roughness_texture = self.finish(/* with_metal: */ false);
        // Programs without PBR write a shininess alone, and 1000 for what is clear.
        let shininess = self.material.shininess.filter(|&shininess| shininess < 900.0 && self.number("Pr").is_none());
        if let Some(shininess) = shininess.filter(|_| metallic_roughness_texture.is_none()) {
            self.remark(&format!(
                "Ns {shininess} is not read; a roughness of {roughness} is used, which Pr would tell"
            ));
        }
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
        Dielectric { ior, roughness, metallic_roughness_texture, attenuation_color, attenuation_distance, ..clear }
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
            metallic_roughness_texture: self.finish(/* with_metal: */ true),
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
        let MapLine { path, map, strength: scale, .. } = self.line("bump_image")?;
        let image = Image { source: ImageSource::File(path), encoding: Encoding::Bump, replaces: false };
        Some(NormalMap { map: self.worn(map, image), scale })
    }

    /// Where an image of `d` is black the surface is not there.
    fn cutout(&mut self) -> Option<Cutout> {
        self.map("map_d", Encoding::Opacity).map(|map| Cutout { alpha: 1.0, map: Some(map), cutoff: Some(0.5) })
    }

    fn map(&mut self, key: &str, encoding: Encoding) -> Option<TextureMap> {
        let MapLine { path, map, .. } = self.line(key)?;
        // Exporters write anything for the colour beside an image.
        Some(self.worn(map, Image { source: ImageSource::File(path), encoding, replaces: key == "map_Kd" }))
    }

    /// The images of roughness and metal, as far as there are, as one.
    fn finish(&mut self, with_metal: bool) -> Option<TextureMap> {
        let rough = self.line("map_Pr");
        let metal = if with_metal { self.line("map_Pm") } else { None };
        let map = rough.as_ref().or(metal.as_ref())?.map;
        if metal.as_ref().is_some_and(|metal| metal.map != map) {
            self.remark("map_Pm has other options than map_Pr, which count for both");
        }
        let channel = |line: MapLine| Channel { path: line.path, number: line.channel };
        let mut channels = [rough.map(channel), metal.map(channel)];
        // One image for both that does not say more is one as glTF has it.
        if let [Some(rough), Some(metal)] = &mut channels
            && rough == metal
            && rough.number.is_none()
        {
            (rough.number, metal.number) = (Some(1), Some(2));
        }
        let source = ImageSource::Finish(channels);
        Some(self.worn(map, Image { source, encoding: Encoding::Data, replaces: true }))
    }

    /// `image`, on surfaces as `map` says.
    fn worn(&mut self, map: TextureMap, image: Image) -> TextureMap {
        self.images.push(image);
        TextureMap { texture: self.images.len() - 1, ..map }
    }

    /// What the line of `key` says, if there is one and its file exists.
    fn line(&mut self, key: &str) -> Option<MapLine> {
        let material = self.material;
        let name = match key {
            "map_Kd" => material.diffuse_texture.as_ref(),
            "map_d" => material.dissolve_texture.as_ref(),
            _ => material.unknown_param.get(key),
        };
        // Exporters for Windows write its separator.
        let path = self.path.parent().unwrap_or(Path::new("")).join(name?.replace('\\', "/"));
        let spoken = if key == "bump_image" { "map_Bump" } else { key };
        if !self.files.exists(&path) {
            let instead = match key {
                "map_Kd" => "; the colour is used",
                "map_Pr" | "map_Pm" => "; the number is used",
                _ => "; left out",
            };
            self.remark(&format!("{spoken} {:?} does not exist{instead}", path.display().to_string()));
            return None;
        }
        let options = material.unknown_param.get(&format!("{key}_options"));
        let words: Vec<_> = options.map_or("", String::as_str).split_whitespace().collect();
        Some(MapLine::new(path, &words, |what| self.remark(&format!("{spoken}: {what}"))))
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
