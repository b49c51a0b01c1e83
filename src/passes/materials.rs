//! What objects are made of, as the device has it. In flow materials and textures of a scene, out flow arrays for
//! `shaders/shared.glsl`, `shaders/compensation.glsl` and `shaders/texture.glsl`.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use half::f16;

use super::view::View;
use crate::effects::{Effect, SMOOTH};
use crate::gpu::MaterialRecord;
use crate::image;
use crate::optics::compensation::AlbedoTable;
use crate::optics::medium::absorption;
use crate::optics::rough::RoughInterface;
use crate::options::Model;
use crate::plan::Plan;
use crate::scene::{Dielectric, Dispersion, Material, Opaque, Scene, Sellmeier, Surface, Texels, Texture};

/// An index so high that an interface reflects everything.
const MIRROR: f64 = 1e12;

/// Tables of what single bounces between facets lose, each interface's once: `shaders/compensation.glsl`.
struct Albedos {
    /// Nothing stands at 0, which says that there is no table.
    values: Vec<f32>,
    tables: Vec<(RoughInterface, u32)>,
}

impl Albedos {
    /// The first node of the table of `interface`.
    fn table(&mut self, interface: RoughInterface) -> u32 {
        if let Some(&(_, first)) = self.tables.iter().find(|(other, _)| *other == interface) {
            return first;
        }
        let first = self.values.len() as u32;
        self.values.extend(AlbedoTable::new(interface).nodes().iter().map(|&albedo| albedo as f32));
        self.tables.push((interface, first));
        first
    }

    /// Where the tables of all pairs are listed that `ior` makes with `others`, from either side.
    fn pairs(&mut self, alpha: f64, ior: f64, others: &[f64]) -> u32 {
        let mut list = Vec::new();
        for &other in others.iter().filter(|&&other| other != ior) {
            for (eta_i, eta_t) in [(other, ior), (ior, other)] {
                let first = self.table(RoughInterface { alpha, eta_i, eta_t });
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
pub(super) fn materials(scene: &Scene, plan: &Plan, view: &View) -> (Vec<MaterialRecord>, Vec<f32>) {
    let mut albedos = Albedos { values: vec![0.0], tables: Vec::new() };
    let others = indices(scene, plan);
    let record = |material: &Material| {
        let glass = match &material.surface {
            Surface::Dielectric(glass) => glass,
            Surface::Opaque(opaque) => return opaque_record(scene, plan, opaque),
        };
        let &Dielectric { ior, roughness, .. } = glass;
        let (mut albedo_table, mut albedo_tables) = (0, 0);
        // In other media than air facets of index 1 lose light too.
        let sees_media = matches!(plan.model, Model::Path | Model::Double);
        let loses = is_rough(material) || sees_media && roughness > SMOOTH;
        if plan.effects.contains(Effect::EnergyCompensation) && loses {
            let alpha = roughness * roughness;
            let is_pane = glass.thin_walled && plan.effects.contains(Effect::ThinWalled);
            match plan.model {
                Model::Path if is_pane => {
                    // Both lobes of a pane are masked as those of a mirror, and lose the same.
                    albedo_table = albedos.table(RoughInterface { alpha, eta_i: 1.0, eta_t: MIRROR });
                }
                Model::Path | Model::Double => albedo_tables = albedos.pairs(alpha, ior, &others),
                _ => albedo_table = albedos.table(RoughInterface { alpha, eta_i: 1.0, eta_t: ior }),
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
            base_color: Vec3::ONE,
            roughness: roughness as f32,
            dispersion: dispersion(glass),
            sellmeier_strengths: formula.strengths.map(|x| x as f32).into(),
            sellmeier_resonances: formula.resonances.map(|x| x as f32).into(),
            kind: if glass.thin_walled { MaterialRecord::PANE } else { MaterialRecord::DIELECTRIC },
            albedo_table,
            albedo_tables,
            ..MaterialRecord::default()
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

fn opaque_record(scene: &Scene, plan: &Plan, opaque: &Opaque) -> MaterialRecord {
    // Of an image its mean, for those who do not look closer.
    let texture = opaque.base_color_texture.filter(|_| plan.effects.contains(Effect::Opaque));
    let base_color = texture.map_or(opaque.base_color, |texture| mean(&scene.textures[texture]));
    MaterialRecord {
        base_color: base_color.as_vec3(),
        roughness: opaque.roughness as f32,
        emission: opaque.emission.as_vec3(),
        metallic: opaque.metallic as f32,
        specular: opaque.specular as f32,
        kind: MaterialRecord::OPAQUE,
        texture: opaque.base_color_texture.map_or(0, |texture| texture as u32 + 1),
        ..MaterialRecord::default()
    }
}

/// All textures in one buffer: where each starts, its width and its height, then the texels of each, linear as half floats, and
/// of its halves.
pub(super) fn texels(textures: &[Arc<Texture>]) -> Vec<u32> {
    let mut words = vec![0; 3 * textures.len()];
    for (number, texture) in textures.iter().enumerate() {
        let (mut width, mut height) = (texture.width, texture.height);
        let header = [words.len() as u32, width, height];
        words[3 * number..][..3].copy_from_slice(&header);
        let mut texels: Vec<[f32; 3]> = match &texture.texels {
            Texels::Srgb(texels) => texels.iter().map(|&[r, g, b, _]| [r, g, b].map(image::decode_srgb)).collect(),
            Texels::Linear(texels) => texels.iter().map(|&[r, g, b, _]| [r, g, b].map(f16::to_f32)).collect(),
        };
        words.extend(texels.iter().copied().flat_map(pack_texel));
        while width.max(height) > 1 {
            (width, height, texels) = image::halved(&texels, width, height, |edge| edge);
            words.extend(texels.iter().copied().flat_map(pack_texel));
        }
    }
    words
}

/// The mean colour of a texture.
fn mean(texture: &Texture) -> DVec3 {
    let wide = |texel: [f32; 3]| DVec3::from_array(texel.map(f64::from));
    let sum: DVec3 = match &texture.texels {
        Texels::Srgb(texels) => texels.iter().map(|&[r, g, b, _]| wide([r, g, b].map(image::decode_srgb))).sum(),
        Texels::Linear(texels) => texels.iter().map(|&[r, g, b, _]| wide([r, g, b].map(f16::to_f32))).sum(),
    };
    sum / f64::from(texture.width) / f64::from(texture.height)
}

fn pack_texel(texel: [f32; 3]) -> [u32; 2] {
    let [r, g, b] = texel.map(|value| u32::from(f16::from_f32(value).to_bits()));
    [r | g << 16, b]
}

/// Whether light is spread by a surface of that material.
pub(super) fn is_rough(material: &Material) -> bool {
    matches!(material.surface, Surface::Dielectric(Dielectric { ior, roughness, .. }) if roughness > SMOOTH && ior != 1.0)
}
