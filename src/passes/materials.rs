//! What objects are made of, as the device has it. In flow materials and textures of a scene, out flow arrays for
//! `shaders/shared.glsl`, `shaders/compensation.glsl` and `shaders/texture.glsl`.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DVec3, DVec4, Vec3};
use half::f16;

use super::view::View;
use crate::effects::{Effect, SMOOTH};
use crate::gpu::MaterialRecord;
use crate::image;
use crate::optics::compensation::{AlbedoTable, LEVELS, roughness_of_level};
use crate::optics::medium::absorption;
use crate::optics::rough::RoughInterface;
use crate::optics::spectrum::luminance;
use crate::options::Model;
use crate::plan::Plan;
use crate::scene::{Dielectric, Dispersion, Material, Opaque, Scene, Sellmeier, Surface, Texture, TextureMap, Wrap};

/// An index so high that an interface reflects everything.
const MIRROR: f64 = 1e12;

/// Tables of what single bounces between facets lose, each once: `shaders/compensation.glsl`.
struct Albedos {
    /// Nothing stands at 0, which says that there is no table.
    values: Vec<f32>,
    tables: Vec<(Interface, u32)>,
    made: Vec<(RoughInterface, Arc<AlbedoTable>)>,
}

/// Where light is scattered, as tables have it.
#[derive(Clone, Copy, PartialEq)]
struct Interface {
    roughness: f64,
    /// The roughness is the highest one of an image.
    is_mapped: bool,
    eta_i: f64,
    eta_t: f64,
}

impl Interface {
    /// The roughness of each table, one after the other.
    fn roughnesses(&self) -> Vec<f64> {
        if !self.is_mapped {
            return vec![self.roughness];
        }
        let levels = (0..LEVELS).map(|level| roughness_of_level(level as f64));
        // Levels above are never looked up, but for the one that the roughest texel lies below, as 32 bits have it.
        let above = levels.clone().position(|level| level > self.roughness * (1.0 + 1e-4));
        levels.take(above.unwrap_or(LEVELS).max(1) + 1).collect()
    }
}

impl Albedos {
    /// The first node of the tables of an interface.
    fn table(&mut self, interface: Interface) -> u32 {
        if let Some(&(_, first)) = self.tables.iter().find(|(other, _)| *other == interface) {
            return first;
        }
        let first = self.values.len() as u32;
        for roughness in interface.roughnesses() {
            let Interface { eta_i, eta_t, .. } = interface;
            let table = self.made(RoughInterface { alpha: roughness * roughness, eta_i, eta_t });
            self.values.extend(table.nodes().iter().map(|&albedo| albedo as f32));
        }
        self.tables.push((interface, first));
        first
    }

    /// Images of several materials share levels.
    fn made(&mut self, interface: RoughInterface) -> Arc<AlbedoTable> {
        if let Some((_, table)) = self.made.iter().find(|(other, _)| *other == interface) {
            return table.clone();
        }
        let table = Arc::new(AlbedoTable::new(interface));
        self.made.push((interface, table.clone()));
        table
    }

    /// Where the tables of all pairs are listed that `ior` makes with `others`, from either side.
    fn pairs(&mut self, surface: Interface, ior: f64, others: &[f64]) -> u32 {
        let mut list = Vec::new();
        for &other in others.iter().filter(|&&other| other != ior) {
            for (eta_i, eta_t) in [(other, ior), (ior, other)] {
                let first = self.table(Interface { eta_i, eta_t, ..surface });
                list.extend([eta_i as f32, eta_t as f32, first as f32]);
            }
        }
        let start = self.values.len() as u32;
        self.values.push((list.len() / 3) as f32);
        self.values.extend(list);
        start
    }
}

/// The indices of all that a ray can be in.
fn indices(scene: &Scene, plan: &Plan) -> Vec<f64> {
    let mut indices = vec![1.0];
    if plan.effects.contains(Effect::Nesting) {
        indices.extend(scene.materials.iter().filter_map(|material| match material.surface {
            Surface::Dielectric(Dielectric { ior, thin_walled: false, .. }) => Some(ior),
            _ => None,
        }));
    }
    indices.sort_by(f64::total_cmp);
    indices.dedup();
    indices
}

/// Materials, and the tables of what rough ones lose.
pub(super) fn materials(scene: &Scene, plan: &Plan, view: &View, maps: &Maps) -> (Vec<MaterialRecord>, Vec<f32>) {
    let means = Means { scene, looks: plan.effects.contains(Effect::Textures) };
    // Of what nobody sees means are not worth their time: images are large.
    let of_opaque = Means { scene, looks: means.looks || !plan.effects.contains(Effect::Opaque) };
    let of_coatings = Means { scene, looks: means.looks || !plan.effects.contains(Effect::Coatings) };
    let mut albedos = Albedos { values: vec![0.0], tables: Vec::new(), made: Vec::new() };
    let others = indices(scene, plan);
    let record = |material: &Material| {
        let glass = match &material.surface {
            Surface::Dielectric(glass) => glass,
            Surface::Opaque(opaque) => return opaque_record(plan, opaque, &of_opaque, maps, common(material, maps)),
        };
        let finish = means.of(glass.metallic_roughness_texture.as_ref());
        let (ior, roughness) = (glass.ior, glass.roughness * finish.y);
        let coating = glass.coating.as_deref().cloned().unwrap_or_default();
        let (mut albedo_table, mut albedo_tables) = (0, 0);
        // In other media than air facets of index 1 lose light too.
        let sees_media = matches!(plan.model, Model::Path | Model::Double);
        let is_mapped = means.looks && glass.metallic_roughness_texture.is_some();
        let loses = is_rough(material) || sees_media && roughness > SMOOTH;
        if plan.effects.contains(Effect::EnergyCompensation) && loses {
            let surface = Interface { roughness, is_mapped, eta_i: 1.0, eta_t: ior };
            let is_pane = glass.thin_walled && plan.effects.contains(Effect::ThinWalled);
            match plan.model {
                Model::Path if is_pane => {
                    // Both lobes of a pane are masked as those of a mirror, and lose the same.
                    albedo_table = albedos.table(Interface { eta_t: MIRROR, ..surface });
                }
                Model::Path | Model::Double => albedo_tables = albedos.pairs(surface, ior, &others),
                _ => albedo_table = albedos.table(surface),
            }
        }
        // Infinite where a colour is 0: so dark that nothing is left after a millionth of the scene.
        let formula = match glass.dispersion {
            Dispersion::Sellmeier(formula) => formula,
            Dispersion::None | Dispersion::Khr(_) => Sellmeier { strengths: [0.0; 3], resonances: [0.0; 3] },
        };
        let per_unit = |color| (absorption(color, glass.attenuation_distance) / view.units_per_metre).min(1e8) as f32;
        let [r, g, b] = glass.attenuation_color.to_array().map(per_unit);
        MaterialRecord {
            absorption: Vec3::new(r, g, b),
            refraction_index: ior as f32,
            base_color: (coating.base_color * of_coatings.of(coating.base_color_texture.as_ref()).truncate()).as_vec3(),
            roughness: roughness as f32,
            metallic: (coating.metallic * finish.z) as f32,
            transmission: (coating.transmission * of_coatings.of(coating.transmission_texture.as_ref()).x) as f32,
            specular: 1.0,
            head: head(ior),
            color_map: maps.number(coating.base_color_texture.as_ref()),
            finish_map: maps.number(glass.metallic_roughness_texture.as_ref()),
            transmission_map: maps.number(coating.transmission_texture.as_ref()),
            dispersion: dispersion(glass),
            sellmeier_strengths: formula.strengths.map(|x| x as f32).into(),
            sellmeier_resonances: formula.resonances.map(|x| x as f32).into(),
            kind: if glass.thin_walled { MaterialRecord::PANE } else { MaterialRecord::DIELECTRIC },
            albedo_table,
            albedo_tables,
            ..common(material, maps)
        }
    };
    let records = scene.materials.iter().map(record).collect();
    (records, albedos.values)
}

/// As `shaders/shared.glsl` tells the laws apart.
fn dispersion(glass: &Dielectric) -> f32 {
    match glass.dispersion {
        _ if glass.thin_walled || !glass.disperses() => 0.0,
        Dispersion::None => 0.0,
        Dispersion::Khr(number) => number as f32,
        Dispersion::Sellmeier(_) => -1.0,
    }
}

/// Images as materials wear them, each once, as far as a plan looks at them.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Maps {
    pub(super) all: Vec<TextureMap>,
    numbers: HashMap<Key, u32>,
}

/// The bits of a map.
type Key = (usize, [u64; 4], [u64; 2], [Wrap; 2]);

impl Maps {
    pub(super) fn new(scene: &Scene, plan: &Plan) -> Self {
        let mut maps = Self::default();
        if [Effect::Textures, Effect::NormalMaps, Effect::Cutouts].iter().any(|&effect| plan.effects.contains(effect)) {
            for map in scene.materials.iter().flat_map(Material::maps) {
                let next = maps.all.len() as u32 + 1;
                if *maps.numbers.entry(key(&map)).or_insert(next) == next {
                    maps.all.push(map);
                }
            }
        }
        maps
    }

    /// Counted from 1; 0 where there is none, or it is not looked at.
    fn number(&self, map: Option<&TextureMap>) -> u32 {
        map.and_then(|map| self.numbers.get(&key(map))).copied().unwrap_or(0)
    }
}

fn key(map: &TextureMap) -> Key {
    let TextureMap { texture, turn, offset, wrap } = map;
    (*texture, turn.to_cols_array().map(f64::to_bits), offset.to_array().map(f64::to_bits), *wrap)
}

/// What numbers are multiplied by where a plan does not look at images: their means.
struct Means<'a> {
    scene: &'a Scene,
    looks: bool,
}

impl Means<'_> {
    fn of(&self, map: Option<&TextureMap>) -> DVec4 {
        match map.filter(|_| !self.looks) {
            Some(map) => self.scene.textures[map.texture].mean(),
            None => DVec4::ONE,
        }
    }
}

/// The mean of what a surface sends out.
pub(super) fn mean_emission(scene: &Scene, opaque: &Opaque) -> DVec3 {
    let mean = opaque.emission_texture.map_or(DVec4::ONE, |map| scene.textures[map.texture].mean());
    opaque.emission * mean.truncate()
}

/// What an interface of that index reflects head on.
fn head(ior: f64) -> f32 {
    ((ior - 1.0) / (ior + 1.0)).powi(2) as f32
}

/// What both kinds of materials have.
fn common(material: &Material, maps: &Maps) -> MaterialRecord {
    let normal = material.normal_map.as_ref();
    let cutout = material.cutout.as_ref();
    let (alpha, cutoff) = cutout.map_or((1.0, 0.0), |cutout| (cutout.alpha, cutout.cutoff.unwrap_or(-1.0)));
    MaterialRecord {
        normal_map: maps.number(normal.map(|normal| &normal.map)),
        normal_scale: normal.map_or(0.0, |normal| normal.scale as f32),
        alpha_map: maps.number(cutout.and_then(|cutout| cutout.map.as_ref())),
        alpha: alpha as f32,
        alpha_cutoff: cutoff as f32,
        transmission: 1.0,
        ..MaterialRecord::default()
    }
}

fn opaque_record(plan: &Plan, opaque: &Opaque, means: &Means<'_>, maps: &Maps, base: MaterialRecord) -> MaterialRecord {
    let finish = means.of(opaque.metallic_roughness_texture.as_ref());
    let base_color = opaque.base_color * means.of(opaque.base_color_texture.as_ref()).truncate();
    let emission = opaque.emission * means.of(opaque.emission_texture.as_ref()).truncate();
    MaterialRecord {
        base_color: base_color.as_vec3(),
        roughness: (opaque.roughness * finish.y) as f32,
        emission: emission.as_vec3(),
        metallic: (opaque.metallic * finish.z) as f32,
        specular: opaque.specular as f32,
        head: head(opaque.ior),
        // Others look for no lights by how bright they are.
        shines: if plan.model == Model::Path { luminance(mean_emission(means.scene, opaque)) as f32 } else { 0.0 },
        kind: MaterialRecord::OPAQUE,
        color_map: maps.number(opaque.base_color_texture.as_ref()),
        finish_map: maps.number(opaque.metallic_roughness_texture.as_ref()),
        emission_map: maps.number(opaque.emission_texture.as_ref()),
        ..base
    }
}

/// All textures in one buffer, for `shaders/texture.glsl`: how each map places one of them, then the texels of each, linear as half
/// floats, and of its halves.
pub(super) fn texels(textures: &[Arc<Texture>], maps: &Maps) -> Vec<u32> {
    let mut words = vec![0; MAP_WORDS * maps.all.len()];
    let mut starts = vec![None; textures.len()];
    for (number, map) in maps.all.iter().enumerate() {
        let texture = &textures[map.texture];
        let start = *starts[map.texture].get_or_insert_with(|| append(&mut words, texture));
        let [horizontally, vertically] = map.wrap.map(|wrap| match wrap {
            Wrap::Repeat => 0,
            Wrap::Mirror => 1,
            Wrap::Clamp => 2,
        });
        let header = &mut words[MAP_WORDS * number..][..MAP_WORDS];
        header[..4].copy_from_slice(&[start, texture.width, texture.height, horizontally | vertically << 2]);
        let numbers = map.turn.to_cols_array().into_iter().chain(map.offset.to_array());
        for (word, number) in header[4..].iter_mut().zip(numbers) {
            *word = (number as f32).to_bits();
        }
    }
    words
}

/// Words of a map, as in `shaders/texture.glsl`.
const MAP_WORDS: usize = 10;

/// Puts a texture and its halves behind what there is; out flows where it begins.
fn append(words: &mut Vec<u32>, texture: &Texture) -> u32 {
    let start = words.len() as u32;
    let (mut width, mut height) = (texture.width, texture.height);
    let mut texels: Vec<[f32; 4]> = texture.linear().collect();
    words.extend(texels.iter().copied().flat_map(pack_texel));
    while width.max(height) > 1 {
        (width, height, texels) = image::halved(&texels, width, height, |edge| edge);
        words.extend(texels.iter().copied().flat_map(pack_texel));
    }
    start
}

fn pack_texel(texel: [f32; 4]) -> [u32; 2] {
    let [r, g, b, a] = texel.map(|value| u32::from(f16::from_f32(value).to_bits()));
    [r | g << 16, b | a << 16]
}

/// Whether light is spread by a surface of that material.
pub(super) fn is_rough(material: &Material) -> bool {
    matches!(material.surface, Surface::Dielectric(Dielectric { ior, roughness, .. }) if roughness > SMOOTH && ior != 1.0)
}
