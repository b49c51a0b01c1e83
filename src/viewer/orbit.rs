//! The camera in one's hands: turning around what is looked at, moving along and across, coming closer.

use glam::{DQuat, DVec2, DVec3};

use crate::scene::{Bounds, Camera};

/// Turns of a drag across the height of the window.
const TURN: f64 = 0.5;

/// How close to straight up or down one can look, as a cosine.
const STEEPEST: f64 = 0.9995;

/// Turns `camera` around its target by a drag, in heights of the window, y down.
pub(super) fn turn(camera: Camera, drag: DVec2) -> Camera {
    let up = camera.up.normalize_or(DVec3::Y);
    let offset = camera.position - camera.target;
    let angle = drag * TURN * std::f64::consts::TAU;
    let sideways = up.cross(offset).normalize_or(DVec3::X);
    let tilted = DQuat::from_axis_angle(sideways, -angle.y) * offset;
    // Not over the pole, where left and right would change places.
    let kept = if (tilted.normalize_or(up).dot(up)).abs() < STEEPEST { tilted } else { offset };
    Camera { position: camera.target + DQuat::from_axis_angle(up, -angle.x) * kept, ..camera }
}

/// Moves camera and target across, so that what is at the target's distance stays under the pointer.
pub(super) fn pan(camera: Camera, drag: DVec2) -> Camera {
    let offset = camera.position - camera.target;
    let back = offset.normalize_or(DVec3::Z);
    let right = camera.up.cross(back).normalize_or(DVec3::X);
    let up = back.cross(right);
    let height = 2.0 * offset.length() * (camera.vertical_fov / 2.0).tan();
    let by = (up * drag.y - right * drag.x) * height;
    Camera { position: camera.position + by, target: camera.target + by, ..camera }
}

/// Comes closer to the target by so many steps, or goes away; never onto it.
pub(super) fn dolly(camera: Camera, steps: f64) -> Camera {
    let offset = (camera.position - camera.target) * 0.9_f64.powf(steps);
    if offset.length() < 1e-6 || !offset.is_finite() {
        return camera;
    }
    Camera { position: camera.target + offset, ..camera }
}

/// Goes on along the view with the target, also into an object.
pub(super) fn fly(camera: Camera, steps: f64) -> Camera {
    let by = (camera.target - camera.position) * 0.05 * steps;
    Camera { position: camera.position + by, target: camera.target + by, ..camera }
}

/// Looks at all of `bounds` from where the camera is turned.
pub(super) fn frame(camera: Camera, bounds: Bounds, aspect: f64) -> Camera {
    let framing = Camera::framing(bounds, aspect);
    let distance = (framing.position - framing.target).length() * (framing.vertical_fov / camera.vertical_fov);
    let back = (camera.position - camera.target).normalize_or(DVec3::Z);
    Camera { position: framing.target + back * distance, target: framing.target, ..camera }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera { position: DVec3::new(0.0, 1.0, 4.0), target: DVec3::Y, up: DVec3::Y, vertical_fov: 0.6 }
    }

    #[test]
    fn turning_keeps_the_distance_and_stops_before_the_pole() {
        let turned = turn(camera(), DVec2::new(0.5, 0.0));
        assert!((turned.position - DVec3::new(-4.0, 1.0, 0.0)).length() < 1e-9, "{turned:?}");
        let mut tilted = camera();
        for _ in 0..100 {
            tilted = turn(tilted, DVec2::new(0.01, 0.03));
            assert!(((tilted.position - tilted.target).length() - 4.0).abs() < 1e-9);
            assert!(Camera::new(tilted.position, tilted.target, tilted.up, tilted.vertical_fov).is_ok());
        }
        assert!((tilted.position - tilted.target).normalize().y > 0.9, "from above");
    }

    #[test]
    fn what_is_panned_stays_under_the_pointer() {
        let moved = pan(camera(), DVec2::new(0.0, 1.0));
        let height = 2.0 * 4.0 * 0.3_f64.tan();
        assert!((moved.target - DVec3::Y * (1.0 + height)).length() < 1e-9, "{moved:?}");
    }

    #[test]
    fn one_never_arrives_at_the_target() {
        let mut near = camera();
        for _ in 0..1000 {
            near = dolly(near, 1.0);
        }
        assert!((near.position - near.target).length() >= 1e-6 && near.position.is_finite());
        assert_eq!(dolly(near, f64::NAN).position, near.position);
        assert!((fly(camera(), 1.0).position.z - 3.8).abs() < 1e-12);
    }
}
