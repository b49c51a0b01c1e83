//! What a single bounce between microfacets loses, and how it is given back.
//!
//! A rough surface that lets every facet scatter light once loses what would bounce on: up to half of it at alpha 1. E. Turquin,
//! "Practical multiple scattering compensation for microfacet models" (2019), scales the BSDF by 1 / E, E being the share that
//! leaves the surface after one bounce when light comes at the given angle: surroundings of radiance 1 then show radiance 1.

use super::rough::{RoughInterface, SMOOTH};
use crate::parallel;

/// E by the cosine of incidence, for one interface and side: nodes at cosines (i / (NODES - 1))^3, dense where light grazes the
/// surface and most is lost.
#[derive(Clone, Debug)]
pub struct AlbedoTable {
    nodes: Vec<f64>,
}

/// Nodes of a table.
pub const NODES: usize = 96;

/// A direction along the surface sees nothing; the first node stands for directions next to it.
const LEAST_COSINE: f64 = 1e-5;

/// Visible normals that [`RoughInterface::albedo`] takes a mean over: Fibonacci numbers, see there. Next to the surface E may be
/// as small as 0.003, and 1 % of that is wanted.
const NORMALS: u32 = 2584;
const NORMALS_GRAZING: u32 = 10946;
const GRAZING: f64 = 0.05;

/// Tables of a surface whose roughness an image tells, one for each of so many roughnesses.
pub const LEVELS: usize = 16;

/// The roughness of a level, which need not be whole: dense where a surface is nearly smooth, whose albedo falls steeply where
/// light grazes it.
pub fn roughness_of_level(level: f64) -> f64 {
    SMOOTH + (1.0 - SMOOTH) * (level / (LEVELS - 1) as f64).powf(1.5)
}

/// The cosine of a node.
fn node(i: usize) -> f64 {
    (i as f64 / (NODES - 1) as f64).powi(3)
}

impl AlbedoTable {
    /// The table of `interface`, as light is seen from its `eta_i` side.
    pub fn new(interface: RoughInterface) -> Self {
        let nodes = parallel::map(parallel::threads(), (0..NODES).collect(), |i| {
            let cosine = node(i).max(LEAST_COSINE);
            let normals = if cosine < GRAZING { NORMALS_GRAZING } else { NORMALS };
            let (reflected, transmitted) = interface.albedo(cosine, normals);
            reflected + transmitted
        });
        Self { nodes }
    }

    /// E at the nodes, in the order of the cosines.
    pub fn nodes(&self) -> &[f64] {
        &self.nodes
    }

    /// E at a cosine, linear in it between nodes: close to index 1 E goes to 0 with the cosine. As `shaders/compensation.glsl`.
    pub fn albedo(&self, cos_theta_i: f64) -> f64 {
        let cosine = cos_theta_i.clamp(0.0, 1.0);
        let low = ((cosine.cbrt() * (NODES - 1) as f64) as usize).min(NODES - 2);
        let share = (cosine - node(low)) / (node(low + 1) - node(low));
        self.nodes[low] + share * (self.nodes[low + 1] - self.nodes[low])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shaders_have_the_same_nodes_and_the_same_threshold() {
        let nodes = include_str!("../../shaders/compensation.glsl");
        assert!(nodes.contains(&format!("const uint ALBEDO_NODES = {NODES};")));
        assert!(nodes.contains(&format!("const uint ALBEDO_LEVELS = {LEVELS};")));
        let threshold = include_str!("../../shaders/constants.glsl");
        assert!(threshold.contains(&format!("const float SMOOTH_ROUGHNESS = {SMOOTH};")));
    }

    /// The two tables that the shader looks up for a roughness, by its own arithmetic, are those on both sides of it.
    #[test]
    fn shaders_find_the_levels_of_a_roughness() {
        let smooth = SMOOTH as f32;
        for i in 0..=100_000 {
            let roughness = smooth + (1.0 - smooth) * i as f32 / 100_000.0;
            let share = ((roughness - smooth) / (1.0 - smooth)).clamp(0.0, 1.0);
            let level = share.powf(2.0 / 3.0) * (LEVELS - 1) as f32;
            let low = (level as usize).min(LEVELS - 2);
            let [below, above] = [low, low + 1].map(|level| roughness_of_level(level as f64));
            let roughness = f64::from(roughness);
            assert!(below <= roughness * (1.0 + 1e-5) && roughness <= above * (1.0 + 1e-5), "{roughness}: {low}");
        }
    }

    /// What an image of the roughness takes from the levels on its sides is right within 2 %.
    #[test]
    fn levels_of_roughness_are_close_enough() {
        let mut worst = (0.0, String::new());
        for (eta_i, eta_t) in [(1.0, 1.1), (1.1, 1.0), (1.0, 1.5), (1.5, 1.0), (1.0, 2.42), (2.42, 1.0), (1.0, 1e12)] {
            let table =
                |roughness: f64| AlbedoTable::new(RoughInterface { alpha: roughness * roughness, eta_i, eta_t });
            let mut low = table(roughness_of_level(0.0));
            for i in 1..LEVELS {
                let high = table(roughness_of_level(i as f64));
                let between = table(roughness_of_level(i as f64 - 0.5));
                for degrees in [0.0_f64, 30.0, 45.0, 60.0, 80.0, 88.0, 89.0, 89.8] {
                    let cosine = degrees.to_radians().cos();
                    let found = 0.5 * (low.albedo(cosine) + high.albedo(cosine));
                    let error = (found / between.albedo(cosine) - 1.0).abs();
                    if error > worst.0 {
                        worst = (error, format!("level {i}, {eta_i} to {eta_t}, {degrees} degrees"));
                    }
                }
                low = high;
            }
        }
        println!("worst {:.2e}: {}", worst.0, worst.1);
        assert!(worst.0 < 0.02, "{:.1e}: {}", worst.0, worst.1);
    }

    /// With the table a white furnace is white within 1 %, from normal incidence to 89.9 degrees.
    #[test]
    fn what_is_lost_is_given_back() {
        let mut worst = (0.0, String::new());
        for alpha in [0.001_f64, 0.01, 0.03, 0.1, 0.3, 1.0] {
            let mut here = 0.0_f64;
            for eta in [1.0003, 1.33, 1.5, 2.42_f64] {
                for (eta_i, eta_t) in [(1.0, eta), (eta, 1.0)] {
                    let interface = RoughInterface { alpha, eta_i, eta_t };
                    let table = AlbedoTable::new(interface);
                    for degrees in [0.0_f64, 30.0, 45.0, 60.0, 80.0, 88.0, 89.0, 89.8, 89.9] {
                        let cosine = degrees.to_radians().cos();
                        let (reflected, transmitted) = interface.albedo(cosine, 17711);
                        let error = ((reflected + transmitted) / table.albedo(cosine) - 1.0).abs();
                        here = here.max(error);
                        if error > worst.0 {
                            worst = (error, format!("alpha {alpha}, {eta_i} to {eta_t}, {degrees} degrees"));
                        }
                    }
                }
            }
            println!("alpha {alpha}: {here:.2e}");
        }
        println!("worst {:.2e}: {}", worst.0, worst.1);
        assert!(worst.0 < 0.01, "{:.1e}: {}", worst.0, worst.1);
    }
}
