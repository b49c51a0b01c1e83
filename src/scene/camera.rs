//! The pinhole that a scene is seen through. In flow a scene file's numbers or the bounds of what there is to see.

use glam::DVec3;

use super::Bounds;

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where the pinhole is.
    pub position: DVec3,
    /// What is in the middle of the image.
    pub target: DVec3,
    /// What is up in the image; of any length.
    pub up: DVec3,
    /// The angle between the image's top and bottom edge, in radians.
    pub vertical_fov: f64,
}

/// Degrees, where a scene says nothing.
pub const DEFAULT_FOV: f64 = 35.0;

/// Room around a framed scene, as a factor of its radius.
const MARGIN: f64 = 1.1;

impl Camera {
    /// The same picture, with the target in its middle as far off as `point`, unless that lies behind.
    #[must_use]
    pub fn aimed_at(&self, point: DVec3) -> Self {
        let forward = (self.target - self.position).normalize();
        let distance = (point - self.position).dot(forward);
        let target = self.position + forward * distance;
        // Of next to no distance there is no direction.
        let is_the_same = (target - self.position).normalize_or_zero().dot(forward) > 1.0 - 1e-9;
        Self { target: if is_the_same { target } else { self.target }, ..*self }
    }

    /// A camera that sees something; the error says what would be right.
    pub fn new(position: DVec3, target: DVec3, up: DVec3, vertical_fov: f64) -> Result<Self, String> {
        let forward = (target - position).try_normalize().ok_or("position and target must be different points")?;
        let sideways = up.try_normalize().map(|up| forward.cross(up).length());
        match sideways {
            None => return Err("up must not be zero".into()),
            // Below this the orientation of the image is rounding error in 32 bits.
            Some(sine) if sine < 1e-6 => {
                return Err("up must not be parallel to the direction from position to target".into());
            }
            Some(_) => {}
        }
        if !(vertical_fov > 0.0 && vertical_fov < std::f64::consts::PI) {
            return Err("vertical_fov must be between 0 and 180 degrees".into());
        }
        Ok(Self { position, target, up, vertical_fov })
    }

    /// A camera that shows all of `bounds` from the front and slightly above, in an image `aspect` times as wide as high.
    pub fn framing(bounds: Bounds, aspect: f64) -> Self {
        let vertical_fov = DEFAULT_FOV.to_radians();
        let (target, radius) = match bounds.is_empty() {
            true => (DVec3::ZERO, 1.0),
            false => (bounds.center(), bounds.extent().length() * 0.5),
        };
        // The narrower of the two fields of view has to hold it.
        let half_field = ((vertical_fov * 0.5).tan() * aspect.min(1.0)).atan();
        let distance = radius * MARGIN / half_field.sin();
        let position = target + DVec3::new(0.0, 0.25, 1.0).normalize() * distance;
        Self { position, target, up: DVec3::Y, vertical_fov }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_that_see_nothing_are_refused() {
        let camera = |position, target, up, fov| Camera::new(position, target, up, fov).map(|_| ());
        assert!(camera(DVec3::Z, DVec3::ZERO, DVec3::Y, 0.6).is_ok());
        assert!(camera(DVec3::Z, DVec3::Z, DVec3::Y, 0.6).unwrap_err().contains("different points"));
        assert!(camera(DVec3::Z, DVec3::ZERO, DVec3::ZERO, 0.6).unwrap_err().contains("up must not be zero"));
        assert!(camera(DVec3::Z, DVec3::ZERO, DVec3::Z * -3.0, 0.6).unwrap_err().contains("parallel"));
        for fov in [0.0, -1.0, std::f64::consts::PI, f64::NAN] {
            assert!(camera(DVec3::Z, DVec3::ZERO, DVec3::Y, fov).unwrap_err().contains("180"));
        }
    }

    #[test]
    fn framing_shows_every_corner_with_a_margin() {
        for (min, max) in [
            (DVec3::new(-1.0, 0.0, -1.0), DVec3::ONE),
            (DVec3::new(5.0, -0.001, -80.0), DVec3::new(5.1, 0.0, 90.0)),
            (DVec3::splat(-1e-4), DVec3::new(1e-4, 7e-4, 1e-4)),
        ] {
            for aspect in [0.25, 1.0, 2.0] {
                let camera = Camera::framing(Bounds { min, max }, aspect);
                let forward = (camera.target - camera.position).normalize();
                let right = forward.cross(camera.up).normalize();
                let up = right.cross(forward);
                let edge = (camera.vertical_fov * 0.5).tan();
                for corner in 0..8 {
                    let pick = |bit: usize, axis: usize| if corner >> bit & 1 == 0 { min[axis] } else { max[axis] };
                    let to = DVec3::new(pick(0, 0), pick(1, 1), pick(2, 2)) - camera.position;
                    let depth = to.dot(forward);
                    assert!(depth > 0.0);
                    assert!((to.dot(right) / depth).abs() < edge * aspect * 0.95, "{aspect}");
                    assert!((to.dot(up) / depth).abs() < edge * 0.95, "{aspect}");
                }
                assert!(camera.position.y > camera.target.y);
            }
        }
    }
}
