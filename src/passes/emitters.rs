//! Surfaces that shine, as lights: a table that chooses triangles by how much light they send out. In flow a scene and its geometry, out
//! flow words for `shaders/emitters.glsl`.

use super::geometry::{Geometry, Layout};
use super::materials::mean_emission;
use crate::optics::spectrum::luminance;
use crate::scene::{Scene, Surface};

/// The table of a scene where nothing shines, or is not looked for.
pub(super) fn none() -> Vec<u32> {
    header(0, 0.0)
}

/// `emitterCount` and `emittedPower`, and the padding behind them.
fn header(count: u32, power: f32) -> Vec<u32> {
    vec![count, power.to_bits(), 0, 0]
}

/// Each triangle that shines, with its share of the light: its luminance times its area.
pub(super) fn table(scene: &Scene, layout: &Layout, geometry: &Geometry) -> Vec<u32> {
    let mut shining = Vec::new();
    let brightness = |surface: &Surface| match surface {
        Surface::Opaque(opaque) => luminance(mean_emission(scene, opaque)),
        Surface::Dielectric(_) => 0.0,
    };
    let brightness: Vec<f64> = scene.materials.iter().map(|material| brightness(&material.surface)).collect();
    for ((number, transform), &object) in (0..).zip(&geometry.transforms).zip(&geometry.objects) {
        let object = &scene.objects[object];
        let brightness = brightness[object.material];
        if brightness <= 0.0 {
            continue;
        }
        for triangle in 0..scene.meshes[object.mesh].triangles.len() as u32 {
            let [a, b, c] = layout.corners_of(object.mesh, triangle).map(|corner| transform.matrix3 * corner);
            shining.push((brightness * 0.5 * (b - a).cross(c - a).length(), number, triangle));
        }
    }
    shining.retain(|&(power, ..)| power > 0.0);
    if shining.is_empty() {
        return none();
    }
    let whole: f64 = shining.iter().map(|&(power, ..)| power).sum();
    let mut table = header(shining.len() as u32, whole as f32);
    let shares = shares(&shining.iter().map(|&(power, ..)| power / whole).collect::<Vec<_>>());
    let mut start = 0;
    for (share, (_, instance, triangle)) in shares.into_iter().zip(shining) {
        let part = |count: u32| (f64::from(count) / f64::from(STEPS)) as f32;
        table.extend([part(start).to_bits(), part(share).to_bits(), instance, triangle]);
        start += share;
    }
    table
}

/// Numbers from 0 to below 1 that a shader chooses by, as fine as they are.
const STEPS: u32 = 1 << 24;

/// Of all [`STEPS`] as many as each one's share is, but at least one: what shines is chosen, and as often as it says. Of more triangles
/// than a quarter of that some are lost.
fn shares(parts: &[f64]) -> Vec<u32> {
    let least = u32::from(parts.len() < STEPS as usize / 4);
    let mut shares: Vec<u32> =
        parts.iter().map(|part| ((part * f64::from(STEPS)).round() as u32).clamp(least, STEPS)).collect();
    // What rounding has put too much or too little is taken from the largest ones.
    let mut order: Vec<usize> = (0..shares.len()).collect();
    order.sort_by_key(|&i| std::cmp::Reverse(shares[i]));
    let mut excess = shares.iter().map(|&share| i64::from(share)).sum::<i64>() - i64::from(STEPS);
    for i in order {
        let taken = excess.clamp(i64::from(shares[i]) - i64::from(STEPS), i64::from(shares[i] / 2));
        shares[i] = (i64::from(shares[i]) - taken) as u32;
        excess -= taken;
    }
    shares
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::options::{Size, Trace};
    use crate::passes::view::View;
    use crate::scene::{Opaque, Overrides};

    #[test]
    fn triangles_have_their_shares_of_the_light() {
        let mut scene = Scene::load(None, &Overrides::default()).expect("the built-in scene");
        let view = View::new(&scene.camera, scene.bounds(), Size { width: 4, height: 3 });
        let shine = |emission| Surface::Opaque(Opaque { emission, ..Opaque::default() });
        let (layout, _) = Layout::new(&scene, Some(Trace::Software));
        let table = |scene: &Scene| table(scene, &layout, &Geometry::new(scene, &view, &layout, 0, /* opaque: */ true));
        assert_eq!(table(&scene), none());
        scene.materials[0].surface = shine(DVec3::ZERO);
        assert_eq!(table(&scene), none());
        scene.materials[0].surface = shine(DVec3::new(0.0, 0.0, 3.0));
        let bright = table(&scene);
        let count = scene.objects.iter().map(|object| scene.meshes[object.mesh].triangles.len()).sum::<usize>();
        assert_eq!(bright[0] as usize, count);
        let mut end = 0.0;
        for words in bright[4..].chunks(4) {
            let (start, share) = (f32::from_bits(words[0]), f32::from_bits(words[1]));
            assert!(start == end && share > 0.0, "{start} {share}");
            end = start + share;
        }
        assert_eq!(end, 1.0);
        // A lamp that is next to nothing beside another one is chosen too.
        assert_eq!(shares(&[1.0 - 1e-12, 1e-12]), [STEPS - 1, 1]);
        assert_eq!(shares(&[1.0]), [STEPS]);
        // Half of the light is not there if half of the brightness is not.
        scene.materials[0].surface = shine(DVec3::new(0.0, 0.0, 1.5));
        let dimmer = table(&scene);
        assert!((f32::from_bits(bright[1]) / f32::from_bits(dimmer[1]) - 2.0).abs() < 1e-6);
    }
}
