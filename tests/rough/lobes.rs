//! Directions that a rough interface scatters light from, seen as facets: a direction stands for the facet that reflects or
//! refracts into it, and facets have the same shape whatever the index and the roughness. In 64 bits, from `vitrum::optics`; what
//! the tests ask of the device's densities, solid angles among it, is worked out here without its equations.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use vitrum::optics::fresnel::refract;
use vitrum::optics::rough::RoughInterface;

/// What becomes of light at a facet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lobe {
    Reflected,
    Transmitted,
}

impl Lobe {
    pub const BOTH: [Self; 2] = [Self::Reflected, Self::Transmitted];
}

/// A facet by the slope of its normal, as a point of the unit square. Where the slope is `r` times alpha the first coordinate is
/// 1 - 1 / sqrt(1 + r^2), along which the density of GGX falls linearly to 0; the second is the angle to the plane of incidence,
/// in turns.
pub type Facet = DVec2;

/// A rough interface and where light is seen from.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pub alpha: f32,
    /// The index below over that above.
    pub eta: f32,
    /// From below.
    pub leaving: bool,
    /// From the normal.
    pub degrees: f64,
    /// About the normal.
    pub turns: f64,
}

impl View {
    /// The direction that light is seen from, as the device is given it.
    pub fn wi(&self) -> [f32; 3] {
        let (sine, cosine) = self.degrees.to_radians().sin_cos();
        let flat = sine * DVec2::from_angle(self.turns * TAU);
        [flat.x as f32, flat.y as f32, if self.leaving { -cosine } else { cosine } as f32]
    }

    pub fn interface(&self) -> RoughInterface {
        let eta = self.eta.into();
        let (eta_i, eta_t) = if self.leaving { (eta, 1.0) } else { (1.0, eta) };
        RoughInterface { alpha: self.alpha.into(), eta_i, eta_t }
    }

    /// The transmitted lobe is a few hundred directions of 32 bits wide, or less.
    pub fn is_narrow(&self) -> bool {
        self.alpha * (self.eta - 1.0).abs() < 1e-5
    }

    /// A direction of the device, with the side that light is seen from above, or back.
    pub fn upright(&self, w: DVec3) -> DVec3 {
        if self.leaving { w.with_z(-w.z) } else { w }
    }

    /// [`View::wi`], upright. Its length is 1 but for rounding.
    pub fn upright_wi(&self) -> DVec3 {
        self.upright(wide(&self.wi()))
    }

    /// The facet that sends light from `wo` to `wi`, both upright. Next to index 1 lengths
    /// matter, as they do to the device.
    pub fn facet(&self, wi: DVec3, wo: DVec3) -> (Lobe, Facet) {
        let RoughInterface { alpha, eta_i, eta_t } = self.interface();
        let lobe = if wo.z > 0.0 { Lobe::Reflected } else { Lobe::Transmitted };
        let normal = if lobe == Lobe::Reflected { wi + wo } else { eta_i * wi + eta_t * wo };
        let slope = normal.truncate() / (normal.z * alpha);
        let turns = (slope.to_angle() - wi.truncate().to_angle()) / TAU;
        (lobe, DVec2::new(1.0 - 1.0 / (1.0 + slope.length_squared()).sqrt(), turns.rem_euclid(1.0)))
    }

    /// The direction that a facet sends light from to `wi`, upright and of unit length; `None` for what a single bounce loses.
    pub fn direction(&self, wi: DVec3, lobe: Lobe, facet: Facet) -> Option<DVec3> {
        let RoughInterface { alpha, eta_i, eta_t } = self.interface();
        let slope = ((1.0 - facet.x).powi(-2) - 1.0).max(0.0).sqrt();
        let angle = DVec2::from_angle(facet.y * TAU).rotate(wi.truncate().normalize_or(DVec2::X));
        let normal = (alpha * slope * angle).extend(1.0).normalize();
        let cosine = wi.dot(normal);
        if cosine <= 0.0 {
            return None;
        }
        match lobe {
            Lobe::Reflected => Some(2.0 * cosine * normal - wi).filter(|wo| wo.z > 0.0),
            Lobe::Transmitted => refract(wi, normal, eta_i, eta_t).filter(|wo| wo.z < 0.0),
        }
    }

    /// The direction of a facet, and the solid angle of directions over the area of facets there, by differences.
    pub fn spread(&self, wi: DVec3, lobe: Lobe, facet: Facet) -> Option<(DVec3, f64)> {
        let wo = self.direction(wi, lobe, facet)?;
        // Short before an edge, such as the critical angle, shorter steps.
        let slope = |step: DVec2| {
            let both = |step| Some((self.direction(wi, lobe, facet + step)?, self.direction(wi, lobe, facet - step)?));
            let difference = |shrink: f64| both(step * shrink).map(|(there, here)| (there - here) / shrink);
            [1.0, 0.1, 0.01].into_iter().find_map(difference).map(|difference| difference / (2.0 * step.length()))
        };
        let (across, around) = (slope(DVec2::new(1e-5, 0.0))?, slope(DVec2::new(0.0, 1e-4))?);
        Some((wo, across.cross(around).length()))
    }
}

/// Directions about the normal, another for each number.
pub fn turns(number: usize) -> f64 {
    (number as f64 * 0.618_033_988_75).fract()
}

/// A vector of the device, in 64 bits.
pub fn wide(w: &[f32]) -> DVec3 {
    DVec3::new(w[0].into(), w[1].into(), w[2].into())
}
