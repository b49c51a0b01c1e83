//! Lights without extent: points, spots, and those whose light comes from one direction.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::Bounds;

/// A light without extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    /// Position in metres.
    pub position: DVec3,
    /// Radiant intensity in W/sr, linear Rec. 709; of a spot that along its axis.
    pub intensity: DVec3,
    /// Where a spot shines; `None`: everywhere.
    pub cone: Option<Cone>,
}

impl PointLight {
    /// A light that shines everywhere.
    pub const fn new(position: DVec3, intensity: DVec3) -> Self {
        Self { position, intensity, cone: None }
    }
}

/// Where a spot shines, as KHR_lights_punctual has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    axis: DVec3,
    scale: f64,
    offset: f64,
}

impl Cone {
    /// Light of full strength up to `inner` radians off `direction`, which falls to nothing at `outer`; `None` for a direction
    /// of no length, or angles other than 0 <= inner <= outer <= pi/2 with an outer one above 0.
    pub fn new(direction: DVec3, inner: f64, outer: f64) -> Option<Self> {
        // A hair above, for angles that were degrees or 32-bit numbers.
        let is_cone = 0.0 <= inner && inner <= outer && outer > 0.0 && outer <= FRAC_PI_2 + 1e-6;
        let axis = direction.try_normalize().filter(|_| is_cone)?;
        // A hard edge is as wide as 32 bits tell cosines apart. The 1e-3 of the extension's example would leave a fiftieth of the
        // light of a cone of one degree.
        let scale = 1.0 / (inner.cos() - outer.cos()).max(1e-6);
        Some(Self { axis, scale, offset: -outer.cos() * scale })
    }

    /// Where it points, of unit length.
    pub fn axis(&self) -> DVec3 {
        self.axis
    }

    /// `scale` and `offset`: along a unit vector with cosine c to the axis shines clamp(c scale + offset, 0, 1)^2 of the
    /// intensity.
    pub fn falloff(&self) -> (f64, f64) {
        (self.scale, self.offset)
    }
}

/// A light that shines from one direction everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Where its light goes, of unit length.
    pub direction: DVec3,
    /// Of a surface that faces it, W/m^2.
    pub irradiance: DVec3,
}

impl Sun {
    /// So many times as far away as what it shines on is large: the light of this point is everywhere the same but for a
    /// ten thousandth.
    const FAR: f64 = 1e4;
}

/// A light as a file has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightSource {
    Point(PointLight),
    Sun(Sun),
}

impl LightSource {
    /// Lights in their places, for what lies in `bounds`; without that a sun shines on nothing, and is none.
    pub fn placed(lights: &[Self], bounds: impl FnOnce() -> Bounds) -> Vec<PointLight> {
        let bounds = lights.iter().any(|light| matches!(light, Self::Sun(_))).then(bounds);
        let bounds = bounds.filter(|bounds| !bounds.is_empty());
        let place = |light: &Self| match light {
            Self::Point(light) => Some(*light),
            Self::Sun(sun) => bounds.map(|bounds| {
                let distance = Sun::FAR * bounds.extent().length().max(f64::MIN_POSITIVE);
                PointLight::new(bounds.center() - sun.direction * distance, sun.irradiance * distance * distance)
            }),
        };
        lights.iter().filter_map(place).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cones_shine_in_full_inside_and_not_at_all_outside() {
        let cone = Cone::new(DVec3::NEG_Y * 3.0, 0.2, 0.6).unwrap();
        let (scale, offset) = cone.falloff();
        let share = |angle: f64| (angle.cos() * scale + offset).clamp(0.0, 1.0).powi(2);
        assert_eq!(cone.axis(), DVec3::NEG_Y);
        assert_eq!([share(0.0), share(0.199), share(0.601), share(3.0)], [1.0, 1.0, 0.0, 0.0]);
        assert!((0.0..1.0).contains(&share(0.4)) && share(0.3) > share(0.4));
        // Narrow ones are as bright, and so is one with a hard edge.
        for (inner, outer, full) in [(0.0, 0.0175, 0.0), (0.0175, 0.0175, 0.017), (FRAC_PI_2, FRAC_PI_2, 1.57)] {
            let (scale, offset) = Cone::new(DVec3::X, inner, outer).unwrap().falloff();
            let share = |angle: f64| (angle.cos() * scale + offset).clamp(0.0, 1.0).powi(2);
            assert!((share(full) - 1.0).abs() < 1e-9 && share(outer + 1e-3) == 0.0, "{inner} {outer}");
        }
    }

    #[test]
    fn suns_shine_on_what_is_there() {
        let sun = LightSource::Sun(Sun { direction: DVec3::NEG_Y, irradiance: DVec3::ONE });
        let lights = [sun, LightSource::Point(PointLight::new(DVec3::X, DVec3::ONE))];
        let bounds = Bounds::around([DVec3::ZERO, DVec3::new(3.0, 0.0, 4.0)]);
        let placed = LightSource::placed(&lights, || bounds);
        assert_eq!(placed[0].position, DVec3::new(1.5, 5e4, 2.0));
        assert_eq!(placed[0].intensity, DVec3::splat(25e8));
        assert_eq!(LightSource::placed(&lights, || Bounds::EMPTY).len(), 1);
        assert_eq!(LightSource::placed(&lights[1..], || unreachable!()).len(), 1);
    }

    #[test]
    fn what_is_no_cone_is_none() {
        assert_eq!(Cone::new(DVec3::ZERO, 0.0, 0.5), None);
        for (inner, outer) in [(0.0, 0.0), (0.6, 0.5), (-0.1, 0.5), (0.0, 1.6), (f64::NAN, 0.5), (0.0, f64::NAN)] {
            assert_eq!(Cone::new(DVec3::X, inner, outer), None, "{inner} {outer}");
        }
        assert!(Cone::new(DVec3::X, 0.0, FRAC_PI_2).is_some());
    }
}
