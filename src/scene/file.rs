//! The TOML scene file. In flow its text and the files it names, out flows a [`Scene`]; what is wrong in it is an error
//! with file, line and what would be right.

use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DVec3};

use super::assembly::{Assembly, Placement, Wear};
use super::camera::DEFAULT_FOV;
use super::files::Files;
use super::light::{Cone, LightSource, PointLight, Sun};
use super::material::Glass;
use super::mesh_file::{self, Image, ImageSource};
use super::render_table::options;
use super::table::{
    Document, Entry, FIELD, FINITE, HALF_ANGLE, INDEX, LENGTH, LIGHT, NO_NORMALS, POSITIVE_OR_INFINITE, SCALE,
    STRENGTH, Table, UNIT, text,
};
use super::texture::Encoding;
use super::{
    Camera, Coating, Cutout, Dielectric, Dispersion, Material, NormalMap, Opaque, Overrides, Surface, TextureMap,
    builtin,
};
use crate::Result;
use crate::options::RenderArgs;

/// Where an environment comes from, before images are read.
#[derive(Clone, Debug)]
pub enum Light {
    /// An image file.
    Image(Files, PathBuf),
    /// The same from everywhere.
    Color(DVec3),
}

/// An environment whose image is not read yet: the command line may replace it.
#[derive(Clone, Debug)]
pub struct EnvironmentTable {
    /// Image or colour.
    pub light: Light,
    /// Factor.
    pub intensity: f64,
    /// Radians.
    pub rotation: f64,
    /// Seen by the camera.
    pub visible: bool,
}

impl Default for EnvironmentTable {
    fn default() -> Self {
        let light = Light::Image(Files::BuiltIn, builtin::ENVIRONMENT.into());
        Self { light, intensity: 1.0, rotation: 0.0, visible: true }
    }
}

/// What a scene file says, with its meshes but without the image of its environment.
pub struct SceneFile {
    pub environment: EnvironmentTable,
    pub camera: Option<Camera>,
    pub lights: Vec<PointLight>,
    pub render: RenderArgs,
    pub assembly: Assembly,
}

/// Reads the scene file at `path`; `overrides` tell whether its meshes are repaired.
pub fn read(files: Files, path: &Path, overrides: &Overrides) -> Result<SceneFile> {
    let bytes = files.read(path)?;
    let document = Document { path, text: text(path, &bytes)? };
    let parsed = document.parse()?;
    let root = Table::root(document, &parsed, &["environment", "camera", "render", "light", "material", "object"])?;
    let reader = Reader { files, folder: path.parent().unwrap_or(Path::new("")) };

    let environment = root.or("environment", EnvironmentTable::default(), |entry| reader.environment(entry))?;
    let camera = root.get("camera").map(camera).transpose()?;
    let render = root.or("render", RenderArgs::default(), |entry| options(entry, "render", files, reader.folder))?;
    let lights: Vec<_> = root.or("light", Vec::new(), |entry| entry.tables()?.into_iter().map(light).collect())?;
    let own = if overrides.no_render_table { Overrides::default() } else { Overrides::of(&render) };
    let mut assembly = Assembly::new(overrides.preparation(&own));
    if let Some(materials) = root.get("material") {
        for entry in materials.any_table("material.NAME")?.entries() {
            let material = reader.material(entry, &mut assembly)?;
            assembly.materials.push(material);
        }
    }
    let objects = root.or("object", Vec::new(), |objects| {
        objects
            .tables()?
            .into_iter()
            .enumerate()
            .map(|(i, entry)| reader.object(entry, i, &assembly.materials))
            .collect()
    })?;
    assembly.read_ahead(files, objects.iter().map(|object| object.mesh.as_path()))?;
    for object in &objects {
        object.add_to(files, &mut assembly)?;
    }
    let lights = LightSource::placed(&lights, || assembly.bounds());
    Ok(SceneFile { environment, camera, lights, render, assembly })
}

fn camera(entry: Entry<'_>) -> Result<Camera> {
    let table = entry.table("camera", &["position", "target", "up", "vertical_fov"])?;
    let position = table.require("position")?.triple(&LENGTH)?;
    let target = table.require("target")?.triple(&LENGTH)?;
    let up = table.or("up", DVec3::Y, |up| up.triple(&FINITE))?;
    let vertical_fov = table.or("vertical_fov", DEFAULT_FOV, |fov| fov.number(&FIELD))?.to_radians();
    Camera::new(position, target, up, vertical_fov).map_err(|message| table.error(format!("[camera]: {message}")))
}

/// Lights that a scene file can have.
#[derive(Clone, Copy)]
enum LightKind {
    Point,
    Spot,
    Directional,
}

fn light(entry: Entry<'_>) -> Result<LightSource> {
    const NAME: &str = "[light]";
    let kinds = [("point", LightKind::Point), ("spot", LightKind::Spot), ("directional", LightKind::Directional)];
    let kind = entry.any_table(NAME)?.require("kind")?.choice(&kinds)?;
    let point = |table: &Table<'_>| -> Result<PointLight> {
        Ok(PointLight::new(table.require("position")?.triple(&LENGTH)?, table.require("intensity")?.triple(&LIGHT)?))
    };
    let direction = |table: &Table<'_>| {
        let entry = table.require("direction")?;
        let direction = entry.triple(&LENGTH)?.try_normalize();
        direction.ok_or_else(|| entry.error("direction: expected three numbers, not all 0"))
    };
    match kind {
        LightKind::Point => {
            let table = entry.table(NAME, &["kind", "position", "intensity"])?;
            Ok(LightSource::Point(point(&table)?))
        }
        LightKind::Spot => {
            let keys = ["kind", "position", "intensity", "direction", "inner_cone_angle", "outer_cone_angle"];
            let table = entry.table(NAME, &keys)?;
            let angle = |key, default| table.or(key, default, |entry| entry.number(&HALF_ANGLE));
            let (inner, outer) = (angle("inner_cone_angle", 0.0)?, angle("outer_cone_angle", 45.0)?);
            let cone = Cone::new(direction(&table)?, inner.to_radians(), outer.to_radians());
            let cone = cone.ok_or_else(|| {
                let wanted = "expected one that is not below inner_cone_angle, and above 0";
                table.error(format!("[[light]]: outer_cone_angle {outer} with inner_cone_angle {inner}: {wanted}"))
            })?;
            Ok(LightSource::Point(PointLight { cone: Some(cone), ..point(&table)? }))
        }
        LightKind::Directional => {
            let table = entry.table(NAME, &["kind", "direction", "irradiance"])?;
            let irradiance = table.require("irradiance")?.triple(&LIGHT)?;
            Ok(LightSource::Sun(Sun { direction: direction(&table)?, irradiance }))
        }
    }
}

/// Reads what refers to other files.
struct Reader<'a> {
    files: Files,
    folder: &'a Path,
}

/// The keys of a dielectric that are numbers.
pub const DIELECTRIC_KEYS: [&str; 7] =
    ["ior", "roughness", "dispersion", "attenuation_color", "attenuation_distance", "thin_walled", "priority"];

/// The keys of an opaque material that are numbers.
pub const OPAQUE_KEYS: [&str; 5] = ["base_color", "metallic", "roughness", "specular", "emission"];

/// Further keys of a dielectric.
const COATING_KEYS: [&str; 3] = ["base_color", "transmission", "transmission_texture"];

/// Further keys of any material.
const MAP_KEYS: [&str; 5] =
    ["base_color_texture", "metallic_roughness_texture", "normal_texture", "normal_scale", "alpha_cutoff"];

#[derive(Clone, Copy)]
enum Kind {
    Dielectric,
    Opaque,
}

impl Reader<'_> {
    fn environment(&self, entry: Entry<'_>) -> Result<EnvironmentTable> {
        let table = entry.table("environment", &["image", "color", "intensity", "rotation", "visible"])?;
        let light = match (table.get("image"), table.get("color")) {
            (Some(image), None) => Light::Image(self.files, image.file(self.files, self.folder)?),
            (None, Some(color)) => Light::Color(color.triple(&LIGHT)?),
            (Some(_), Some(color)) => {
                return Err(color.error("[environment] has both image and color; keep one of them"));
            }
            (None, None) => return Err(table.error("[environment] has neither image nor color; give one of them")),
        };
        Ok(EnvironmentTable {
            light,
            intensity: table.or("intensity", 1.0, |entry| entry.number(&LIGHT))?,
            rotation: table.or("rotation", 0.0, |entry| entry.number(&FINITE))?.to_radians(),
            visible: table.or("visible", true, |entry| entry.boolean())?,
        })
    }

    fn material(&self, entry: Entry<'_>, assembly: &mut Assembly) -> Result<Material> {
        let name = format!("material.{}", entry.key);
        let table = entry.any_table(&name)?;
        let Some(kind) = table.get("kind") else {
            return Err(table.error(format!("missing key \"kind\" in [{name}]; \"dielectric\" or \"opaque\"")));
        };
        let kind = kind.choice(&[("dielectric", Kind::Dielectric), ("opaque", Kind::Opaque)])?;
        let (own, others): (&[_], &[_]) = match kind {
            Kind::Dielectric => (&DIELECTRIC_KEYS, &COATING_KEYS),
            Kind::Opaque => (&OPAQUE_KEYS, &["emission_texture"]),
        };
        let table = entry.table(&name, &[&["kind"], own, others, &MAP_KEYS].concat())?;
        if table.get("thin_walled").is_some() {
            assembly.decided.insert(assembly.materials.len());
        }
        let base_color_texture = self.texture(&table, "base_color_texture", Encoding::Color, assembly)?;
        let surface = match kind {
            Kind::Dielectric => self.dielectric(&table, base_color_texture, assembly)?,
            Kind::Opaque => self.opaque(&table, base_color_texture, assembly)?,
        };
        let normal = self.texture(&table, "normal_texture", Encoding::Data, assembly)?;
        let scale = table.or("normal_scale", 1.0, |entry| match normal {
            Some(_) => entry.number(&STRENGTH),
            None => Err(entry.error(NO_NORMALS)),
        })?;
        let cutoff =
            table.get("alpha_cutoff").map(|entry| entry.number(&UNIT).map(|cutoff| (entry, cutoff))).transpose()?;
        let cutout = match (cutoff, base_color_texture) {
            (None, _) => None,
            (Some((entry, _)), None) => {
                return Err(entry.error("alpha_cutoff needs a base_color_texture, whose alpha it is about"));
            }
            (Some((entry, _)), Some(map)) if !assembly.textures.all[map.texture].has_alpha() => {
                let image = assembly.textures.all[map.texture].name();
                assembly.warnings.push(format!("material {:?}: {image} has no alpha; nothing is cut out", entry.key));
                None
            }
            (Some((_, cutoff)), map) => Some(Cutout { alpha: 1.0, map, cutoff: Some(cutoff) }),
        };
        let normal_map = normal.map(|map| NormalMap { map, scale });
        Ok(Material { name: entry.key.to_owned(), surface, normal_map, cutout })
    }

    fn dielectric(
        &self,
        table: &Table<'_>,
        base_color_texture: Option<TextureMap>,
        assembly: &mut Assembly,
    ) -> Result<Surface> {
        let (clear, bare) = (Dielectric::default(), Coating::default());
        let (ior, own) = table.or("ior", (clear.ior, clear.dispersion), index_of)?;
        let coating = Coating {
            base_color: table.or("base_color", bare.base_color, |entry| entry.triple(&UNIT))?,
            base_color_texture: self.colored_once(table, base_color_texture)?,
            transmission: table.or("transmission", bare.transmission, |entry| entry.number(&UNIT))?,
            transmission_texture: self.texture(table, "transmission_texture", Encoding::Data, assembly)?,
            metallic: bare.metallic,
        };
        Ok(Surface::Dielectric(Dielectric {
            ior,
            roughness: table.or("roughness", clear.roughness, |entry| entry.number(&UNIT))?,
            dispersion: table.or("dispersion", own, dispersion_of)?,
            attenuation_color: table.or("attenuation_color", clear.attenuation_color, |entry| entry.triple(&UNIT))?,
            attenuation_distance: table
                .or("attenuation_distance", clear.attenuation_distance, |entry| entry.number(&POSITIVE_OR_INFINITE))?,
            thin_walled: table.or("thin_walled", clear.thin_walled, |entry| entry.boolean())?,
            priority: table.or("priority", clear.priority, |entry| entry.integer())?,
            metallic_roughness_texture: self.texture(table, "metallic_roughness_texture", Encoding::Data, assembly)?,
            coating: (coating != bare).then(|| Box::new(coating)),
        }))
    }

    fn opaque(
        &self,
        table: &Table<'_>,
        base_color_texture: Option<TextureMap>,
        assembly: &mut Assembly,
    ) -> Result<Surface> {
        let plain = Opaque::default();
        let base_color = if base_color_texture.is_some() { DVec3::ONE } else { plain.base_color };
        let emission_texture = self.texture(table, "emission_texture", Encoding::Color, assembly)?;
        let emission = if emission_texture.is_some() { DVec3::ONE } else { plain.emission };
        Ok(Surface::Opaque(Opaque {
            base_color_texture: self.colored_once(table, base_color_texture)?,
            base_color: table.or("base_color", base_color, |entry| entry.triple(&UNIT))?,
            metallic: table.or("metallic", plain.metallic, |entry| entry.number(&UNIT))?,
            roughness: table.or("roughness", plain.roughness, |entry| entry.number(&UNIT))?,
            metallic_roughness_texture: self.texture(table, "metallic_roughness_texture", Encoding::Data, assembly)?,
            ior: plain.ior,
            specular: table.or("specular", plain.specular, |entry| entry.number(&UNIT))?,
            emission: table.or("emission", emission, |entry| entry.triple(&LIGHT))?,
            emission_texture,
        }))
    }

    /// The image of the base colour, unless there is a colour too.
    fn colored_once(&self, table: &Table<'_>, texture: Option<TextureMap>) -> Result<Option<TextureMap>> {
        match (table.get("base_color_texture"), table.get("base_color")) {
            (Some(entry), Some(_)) => Err(entry.error("base_color_texture stands beside base_color; keep one of them")),
            _ => Ok(texture),
        }
    }

    fn texture(
        &self,
        table: &Table<'_>,
        key: &'static str,
        encoding: Encoding,
        assembly: &mut Assembly,
    ) -> Result<Option<TextureMap>> {
        let Some(entry) = table.get(key) else { return Ok(None) };
        let image =
            Image { source: ImageSource::File(entry.file(self.files, self.folder)?), encoding, replaces: false };
        let texture = assembly.textures.open(self.files, &image, &mut assembly.warnings);
        let texture = texture.map_err(|error| entry.error(format!("{}: {}", entry.key, error.in_full())))?;
        Ok(Some(TextureMap::of(texture)))
    }

    fn object<'a>(&self, entry: Entry<'a>, number: usize, materials: &[Material]) -> Result<ObjectTable<'a>> {
        let table = entry.table("[object]", &["mesh", "material", "translate", "rotate", "scale", "smooth"])?;
        let mesh = table.require("mesh")?;
        let path = mesh.file(self.files, self.folder)?;
        let name = path.display().to_string();
        mesh_file::check_kind(&path).map_err(|message| mesh.error(format!("mesh {name:?}: {message}")))?;
        let wear = table.or("material", Wear::Own, |entry| material_number(entry, materials).map(Wear::Material))?;
        let translate = table.or("translate", DVec3::ZERO, |entry| entry.triple(&LENGTH))?;
        let degrees = table.or("rotate", DVec3::ZERO, |entry| entry.triple(&FINITE))?;
        let scale = table.or("scale", DVec3::ONE, |entry| entry.number_or_triple(&SCALE))?;
        let smooth = table.or("smooth", true, |entry| entry.boolean())?;
        let place = Placement { number: Some(number), transform: placed(scale, degrees, translate), smooth };
        Ok(ObjectTable { table, mesh: path, wear, place })
    }
}

/// What an `[[object]]` says.
struct ObjectTable<'a> {
    table: Table<'a>,
    mesh: PathBuf,
    wear: Wear,
    place: Placement,
}

impl ObjectTable<'_> {
    fn add_to(&self, files: Files, assembly: &mut Assembly) -> Result<()> {
        let first = assembly.objects.len();
        assembly.add(files, &self.mesh, self.wear, &self.place)?;
        assembly.check_reach(first).map_err(|message| self.table.error(message))
    }
}

/// An index, and the dispersion that a named glass brings along.
pub fn index_of(entry: Entry<'_>) -> Result<(f64, Dispersion)> {
    match entry.as_text() {
        Some(name) => match Glass::named(name) {
            Ok(glass) => Ok((glass.ior, glass.dispersion)),
            Err(message) => Err(entry.error(message)),
        },
        None => Ok((entry.number(&INDEX)?, Dispersion::None)),
    }
}

/// 20 / Abbe number.
pub fn dispersion_of(entry: Entry<'_>) -> Result<Dispersion> {
    match entry.number(&LIGHT)? {
        0.0 => Ok(Dispersion::None),
        number => Ok(Dispersion::Khr(number)),
    }
}

fn material_number(entry: Entry<'_>, materials: &[Material]) -> Result<usize> {
    let name = entry.text("the name of a material")?;
    materials.iter().position(|material| material.name == name).ok_or_else(|| {
        let names: Vec<_> = materials.iter().map(|material| material.name.as_str()).collect();
        let defined = if names.is_empty() { "none; add [material.NAME]".into() } else { names.join(", ") };
        entry.error(format!("unknown material {name:?}; defined: {defined}"))
    })
}

/// Scales, then rotates about x, y and z, then translates.
fn placed(scale: DVec3, degrees: DVec3, translate: DVec3) -> DAffine3 {
    let radians = degrees.map(f64::to_radians);
    let rotation =
        DMat3::from_rotation_z(radians.z) * DMat3::from_rotation_y(radians.y) * DMat3::from_rotation_x(radians.x);
    DAffine3 { matrix3: rotation * DMat3::from_diagonal(scale), translation: translate }
}
