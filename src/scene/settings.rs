//! Single values of a scene, set from outside. In flow settings as `--set` takes them, `camera.position=[0,1,4]`, out flows the scene with
//! them; and the other way round, what tells one scene from another.

use std::path::Path;

use glam::DVec3;
use toml::de::DeTable;

use super::file::{DIELECTRIC_KEYS, OPAQUE_KEYS, dispersion_of, index_of};
use super::table::{
    Document, Entry, FIELD, FINITE, LENGTH, LIGHT, NO_NORMALS, POSITIVE_OR_INFINITE, STRENGTH, Table, UNIT,
};
use super::{Camera, Dielectric, Dispersion, Environment, GLASSES, Material, Opaque, Scene, Surface};
use crate::{Error, Result};

/// What is named in front of the first dot.
const ROOTS: [&str; 3] = ["camera", "environment", "material"];
const CAMERA_KEYS: [&str; 4] = ["position", "target", "up", "vertical_fov"];
const ENVIRONMENT_KEYS: [&str; 3] = ["intensity", "rotation", "visible"];

impl Scene {
    /// Puts each setting, a line of a scene file with its table in front, in the place of what the scene says.
    ///
    /// Materials go by their name or, where several have one, by their number. A camera that was framed stays where it is.
    pub fn set(&mut self, settings: &[String]) -> Result<()> {
        for setting in settings {
            self.set_one(setting).map_err(|error| match error {
                Error::Input { message, .. } => Error::Usage(format!("--set {setting}: {message}")),
                other => other,
            })?;
        }
        Ok(())
    }

    fn set_one(&mut self, setting: &str) -> Result<()> {
        let document = Document { path: Path::new("--set"), text: setting };
        const HINT: &str =
            "expected KEY=VALUE as in a scene file, such as camera.target=[0,1,0]; text stands in quotes";
        let parsed = DeTable::parse(setting)
            .map_err(|error| document.error(0..0, format!("{}; {HINT}", error.message().replace('\n', ", "))))?;
        if parsed.get_ref().is_empty() {
            return Err(document.error(0..0, HINT));
        }
        let root = Table::root(document, &parsed, &ROOTS)?;
        if let Some(entry) = root.get("camera") {
            let table = entry.table("camera", &CAMERA_KEYS)?;
            self.camera = camera(&table, self.camera)?;
            self.framed = false;
        }
        if let Some(entry) = root.get("environment") {
            let table = entry.table("environment", &ENVIRONMENT_KEYS)?;
            let light = &mut self.environment;
            light.intensity = table.or("intensity", light.intensity, |entry| entry.number(&LIGHT))?;
            light.rotation = table.or("rotation", light.rotation, |entry| Ok(entry.number(&FINITE)?.to_radians()))?;
            light.visible = table.or("visible", light.visible, |entry| entry.boolean())?;
        }
        if let Some(entry) = root.get("material") {
            for entry in entry.any_table("material.NAME")?.entries() {
                let chosen = chosen(&self.materials, entry)?;
                set_material(&mut self.materials[chosen], entry)?;
            }
        }
        Ok(())
    }

    /// What has to be [set](Self::set) in `before` to make it this scene, as far as settings go.
    pub fn settings_since(&self, before: &Self) -> Vec<String> {
        let mut settings = Vec::new();
        if !self.framed && (before.framed || self.camera != before.camera) {
            let Camera { position, target, up, vertical_fov } = self.camera;
            let [position, target, up] = [position, target, up].map(triple);
            let fov = number(degrees(vertical_fov));
            // All at once: one after the other some might not go together with those before.
            settings.push(format!("camera={{position={position},target={target},up={up},vertical_fov={fov}}}"));
        }
        let (now, then) = (&self.environment, &before.environment);
        let Environment { intensity, rotation, visible, .. } = *now;
        settings.extend((intensity != then.intensity).then(|| format!("environment.intensity={}", number(intensity))));
        settings
            .extend((rotation != then.rotation).then(|| format!("environment.rotation={}", number(degrees(rotation)))));
        settings.extend((visible != then.visible).then(|| format!("environment.visible={visible}")));
        for (i, (now, then)) in self.materials.iter().zip(&before.materials).enumerate() {
            let is_alone = self.materials.iter().filter(|other| other.name == now.name).count() == 1;
            let name = if is_alone { key(&now.name) } else { i.to_string() };
            let changes = match (&now.surface, &then.surface) {
                (Surface::Dielectric(now), Surface::Dielectric(then)) => changes_of_glass(now, then),
                (Surface::Opaque(now), Surface::Opaque(then)) => changes_of_opaque(now, then),
                _ => Vec::new(),
            };
            settings.extend(changes.into_iter().map(|change| format!("material.{name}.{change}")));
        }
        settings
    }
}

fn camera(table: &Table<'_>, before: Camera) -> Result<Camera> {
    let position = table.or("position", before.position, |entry| entry.triple(&LENGTH))?;
    let target = table.or("target", before.target, |entry| entry.triple(&LENGTH))?;
    let up = table.or("up", before.up, |entry| entry.triple(&FINITE))?;
    let fov = table.or("vertical_fov", before.vertical_fov, |entry| Ok(entry.number(&FIELD)?.to_radians()))?;
    Camera::new(position, target, up, fov).map_err(|message| table.error(message))
}

/// The material that an entry names.
fn chosen(materials: &[Material], entry: Entry<'_>) -> Result<usize> {
    let named: Vec<_> = (0..materials.len()).filter(|&i| materials[i].name == entry.key).collect();
    let numbered = entry.key.parse().ok().filter(|&number: &usize| number < materials.len());
    match (named.as_slice(), numbered) {
        (&[one], _) | (&[], Some(one)) => Ok(one),
        ([], None) => {
            let names: Vec<_> = materials.iter().map(|material| material.name.as_str()).collect();
            Err(entry.error(format!("unknown material {:?}; there are: {}", entry.key, names.join(", "))))
        }
        (several, _) => Err(entry.error(format!(
            "{} materials are called {:?}; name one by its number: {}",
            several.len(),
            entry.key,
            several.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
        ))),
    }
}

fn set_material(material: &mut Material, entry: Entry<'_>) -> Result<()> {
    let table = match &mut material.surface {
        Surface::Dielectric(glass) => {
            let own = ["base_color", "transmission", "normal_scale"];
            let table = entry.table("material.NAME", &[&DIELECTRIC_KEYS[..], &own].concat())?;
            if let Some(entry) = table.get("base_color") {
                let coating = glass.coating.get_or_insert_default();
                (coating.base_color, coating.base_color_texture) = (entry.triple(&UNIT)?, None);
            }
            if let Some(entry) = table.get("transmission") {
                glass.coating.get_or_insert_default().transmission = entry.number(&UNIT)?;
            }
            if let Some(entry) = table.get("ior") {
                match index_of(entry)? {
                    (ior, Dispersion::None) => glass.set_ior(ior),
                    (ior, own) => (glass.ior, glass.dispersion) = (ior, own),
                }
            }
            if let Some(entry) = table.get("roughness") {
                (glass.roughness, glass.metallic_roughness_texture) = (entry.number(&UNIT)?, None);
            }
            glass.dispersion = table.or("dispersion", glass.dispersion, dispersion_of)?;
            glass.attenuation_color =
                table.or("attenuation_color", glass.attenuation_color, |entry| entry.triple(&UNIT))?;
            glass.attenuation_distance = table
                .or("attenuation_distance", glass.attenuation_distance, |entry| entry.number(&POSITIVE_OR_INFINITE))?;
            glass.thin_walled = table.or("thin_walled", glass.thin_walled, |entry| entry.boolean())?;
            glass.priority = table.or("priority", glass.priority, |entry| entry.integer())?;
            table
        }
        Surface::Opaque(opaque) => {
            let table = entry.table("material.NAME", &[&OPAQUE_KEYS[..], &["normal_scale"]].concat())?;
            if let Some(entry) = table.get("base_color") {
                (opaque.base_color, opaque.base_color_texture) = (entry.triple(&UNIT)?, None);
            }
            opaque.metallic = table.or("metallic", opaque.metallic, |entry| entry.number(&UNIT))?;
            opaque.roughness = table.or("roughness", opaque.roughness, |entry| entry.number(&UNIT))?;
            opaque.specular = table.or("specular", opaque.specular, |entry| entry.number(&UNIT))?;
            opaque.emission = table.or("emission", opaque.emission, |entry| entry.triple(&LIGHT))?;
            table
        }
    };
    match (table.get("normal_scale"), &mut material.normal_map) {
        (None, _) => {}
        (Some(entry), Some(normal)) => normal.scale = entry.number(&STRENGTH)?,
        (Some(entry), None) => return Err(entry.error(NO_NORMALS)),
    }
    Ok(())
}

fn changes_of_glass(now: &Dielectric, then: &Dielectric) -> Vec<String> {
    let mut changes = Vec::new();
    let mut change = |key: &str, is_new: bool, value: String| {
        if is_new {
            changes.push(format!("{key}={value}"));
        }
    };
    // What a named glass has of its own goes with its index.
    let mut indexed = then.clone();
    let is_new = (now.ior, now.dispersion) != (then.ior, then.dispersion);
    match GLASSES.iter().find(|glass| is_new && (glass.ior, glass.dispersion) == (now.ior, now.dispersion)) {
        Some(glass) => {
            (indexed.ior, indexed.dispersion) = (glass.ior, glass.dispersion);
            change("ior", true, format!("{:?}", glass.name));
        }
        None => {
            if now.ior != then.ior {
                indexed.set_ior(now.ior);
            }
            change("ior", now.ior != then.ior, number(now.ior));
        }
    }
    change("roughness", now.roughness != then.roughness, number(now.roughness));
    let dispersion = match now.dispersion {
        Dispersion::Khr(value) => value,
        Dispersion::None | Dispersion::Sellmeier(_) => 0.0,
    };
    change("dispersion", now.dispersion != indexed.dispersion, number(dispersion));
    let (color, distance) = (now.attenuation_color, now.attenuation_distance);
    change("attenuation_color", color != then.attenuation_color, triple(color));
    change("attenuation_distance", distance != then.attenuation_distance, number(distance));
    change("thin_walled", now.thin_walled != then.thin_walled, now.thin_walled.to_string());
    change("priority", now.priority != then.priority, now.priority.to_string());
    changes
}

fn changes_of_opaque(now: &Opaque, then: &Opaque) -> Vec<String> {
    let mut changes = Vec::new();
    let mut change = |key: &str, is_new: bool, value: String| {
        if is_new {
            changes.push(format!("{key}={value}"));
        }
    };
    let recolored = now.base_color != then.base_color || now.base_color_texture != then.base_color_texture;
    change("base_color", recolored, triple(now.base_color));
    change("metallic", now.metallic != then.metallic, number(now.metallic));
    change("roughness", now.roughness != then.roughness, number(now.roughness));
    change("specular", now.specular != then.specular, number(now.specular));
    change("emission", now.emission != then.emission, triple(now.emission));
    changes
}

/// A key of TOML, in quotes where it needs some.
fn key(name: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    match !name.is_empty() && name.chars().all(is_bare) {
        true => name.to_owned(),
        // With escapes, on one line.
        false => serde_json::Value::from(name).to_string(),
    }
}

/// A number of TOML that is read back as the same one.
fn number(value: f64) -> String {
    if value.is_infinite() { "inf".into() } else { format!("{value:?}") }
}

fn triple(value: DVec3) -> String {
    let [x, y, z] = value.to_array().map(number);
    format!("[{x},{y},{z}]")
}

/// Degrees that are read back as these radians, if there are any.
fn degrees(radians: f64) -> f64 {
    let near = radians.to_degrees();
    let all = [near, near.next_up(), near.next_down()];
    // The roundest that do, as they stood in a file.
    let rounded = (near * 1e9).round() / 1e9;
    [rounded].into_iter().chain(all).find(|degrees| degrees.to_radians() == radians).unwrap_or(near)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Glass, NormalMap, Overrides, TextureMap};

    fn built_in() -> Scene {
        Scene::load(None, &Overrides::default()).expect("the built-in scene")
    }

    fn glass(scene: &mut Scene, material: usize) -> &mut Dielectric {
        match &mut scene.materials[material].surface {
            Surface::Dielectric(glass) => glass,
            Surface::Opaque(_) => panic!("glass"),
        }
    }

    #[test]
    fn what_was_changed_comes_back_bit_for_bit() {
        let mut before = built_in();
        before.materials.push(Material::new("a \"board\"".into(), Surface::Opaque(Opaque::default())));
        let bk7 = Glass::named("bk7").expect("a glass");
        let named = Dielectric { ior: bk7.ior, dispersion: bk7.dispersion, ..Dielectric::default() };
        before.materials.push(Material::new("named".into(), Surface::Dielectric(named)));
        let mut random = fastrand::Rng::with_seed(3);
        for _ in 0..200 {
            let mut now = before.clone();
            let mut triple = || DVec3::new(random.f64(), random.f64(), random.f64());
            now.camera = Camera { position: triple(), target: triple() + DVec3::X, up: DVec3::Y, vertical_fov: 0.4 };
            now.framed = false;
            now.camera.vertical_fov = (1.0 + 100.0 * random.f64()).to_radians();
            now.environment.rotation = (360.0 * random.f64()).to_radians();
            now.environment.intensity = random.f64();
            now.environment.visible = random.bool();
            let color = DVec3::new(random.f64(), random.f64(), 1.0);
            let changed = glass(&mut now, 0);
            changed.set_ior(1.0 + random.f64());
            changed.attenuation_color = color;
            changed.attenuation_distance = random.f64() * 1e-3;
            changed.dispersion = Dispersion::Khr(random.f64());
            changed.priority = random.i32(-9..9);
            changed.thin_walled = random.bool();
            let last = now.materials.len() - 1;
            if random.bool() {
                glass(&mut now, last).set_ior(1.0 + random.f64());
            } else {
                glass(&mut now, last).roughness = random.f64();
            }
            if let Surface::Opaque(opaque) = &mut now.materials[last - 1].surface {
                opaque.base_color = color;
                opaque.emission = DVec3::splat(random.f64());
            }
            let settings = now.settings_since(&before);
            let mut again = before.clone();
            again.set(&settings).expect("settings");
            assert_eq!(again.camera, now.camera, "{settings:?}");
            assert_eq!(again.materials, now.materials, "{settings:?}");
            assert_eq!(again.environment.rotation.to_bits(), now.environment.rotation.to_bits(), "{settings:?}");
            assert!(now.settings_since(&again).is_empty(), "{settings:?}");
        }
        assert!(before.settings_since(&before).is_empty());
    }

    #[test]
    fn what_lies_on_glass_is_set() {
        let mut scene = built_in();
        let name = scene.materials[0].name.clone();
        let settings = ["base_color=[1,0.5,0.25]", "transmission=0.5"];
        scene.set(&settings.map(|setting| format!("material.{name}.{setting}"))).expect("settings");
        let coating = glass(&mut scene, 0).coating.as_deref().cloned().expect("a coating");
        assert_eq!((coating.base_color, coating.transmission), (DVec3::new(1.0, 0.5, 0.25), 0.5));
        let strength = [format!("material.{name}.normal_scale=0.25")];
        let error = scene.set(&strength).expect_err("no image").to_string();
        assert!(error.contains("normal_scale needs a normal_texture"), "{error}");
        scene.materials[0].normal_map = Some(NormalMap { map: TextureMap::of(0), scale: 1.0 });
        scene.set(&strength).expect("a setting");
        assert_eq!(scene.materials[0].normal_map.map(|normal| normal.scale), Some(0.25));
    }

    #[test]
    fn every_named_glass_comes_back_and_materials_whose_names_are_numbers() {
        let mut before = built_in();
        let plain = Material::new("2".into(), Surface::Dielectric(Dielectric::default()));
        before.materials = vec![Material { name: "1".into(), ..plain.clone() }, plain.clone(), plain.clone()];
        before.materials[2].name = "a\nb".into();
        for from in &GLASSES {
            for to in &GLASSES {
                for material in 0..3 {
                    let (mut then, mut now) = (before.clone(), before.clone());
                    let put = |scene: &mut Scene, of: &Glass| {
                        let glass = glass(scene, material);
                        (glass.ior, glass.dispersion) = (of.ior, of.dispersion);
                    };
                    put(&mut then, from);
                    put(&mut now, to);
                    let settings = now.settings_since(&then);
                    then.set(&settings).expect("settings");
                    assert_eq!(then.materials, now.materials, "{settings:?}");
                }
            }
        }
    }

    #[test]
    fn what_is_wrong_is_told_with_what_would_be_right() {
        let mut scene = built_in();
        let mut set = |setting: &str| scene.set(&[setting.to_owned()]).expect_err(setting).to_string();
        for (setting, wanted) in [
            ("camera.position=[0,0]", "three numbers"),
            ("camera.positoin=[0,0,0]", "allowed here: position"),
            ("camera.target=camera", "text stands in quotes"),
            ("material.glas.ior=1.5", "unknown material \"glas\"; there are: "),
            ("material.0.kind=\"opaque\"", "allowed here: ior"),
            ("material.0.ior=-1", "a number above 0"),
            ("object.mesh=\"a.obj\"", "allowed here: camera, environment, material"),
            ("environment.rotation=nan", "a finite number"),
            ("", "expected KEY=VALUE"),
        ] {
            let message = set(setting);
            assert!(message.starts_with(&format!("--set {setting}: ")) && message.contains(wanted), "{message}");
        }
    }
}
