//! The camera's side of a frame, in 64-bit arithmetic until the last step.

use glam::{DMat4, DVec2, DVec3, DVec4, Vec2};

use crate::gpu::SamplePush;
use crate::options::Size;
use crate::scene::{Bounds, Camera};

/// A pinhole camera's rays and projection. The device's space has the world's axes, the camera at its origin, and the
/// farthest corner of the scene at distance 1: huge, tiny and far-off scenes look alike to 32-bit arithmetic.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// Units of the device's space in a metre.
    pub(super) units_per_metre: f64,
    pub(super) position: DVec3,
    pub(super) view_projection: DMat4,
    pub(super) ray_corner: DVec3,
    pub(super) ray_right: DVec3,
    pub(super) ray_down: DVec3,
}

impl View {
    pub(super) fn new(camera: &Camera, bounds: Option<Bounds>, size: Size) -> Self {
        let farthest = bounds.map_or(0.0, |bounds| bounds.farthest(camera.position));
        let units_per_metre = if farthest > 0.0 { 1.0 / farthest } else { 1.0 };

        let back = (camera.position - camera.target).normalize();
        let right = camera.up.cross(back).normalize();
        let up = back.cross(right);
        let half_height = (camera.vertical_fov / 2.0).tan();
        let half_width = half_height * f64::from(size.width) / f64::from(size.height);

        // Depth is reversed and has no far plane; the near one lies a millionth of the scene away.
        const NEAR: f64 = 1e-6;
        let row = |v: DVec3, w: f64| DVec4::new(v.x, v.y, v.z, w);
        let view_projection = DMat4::from_cols(
            row(right / half_width, 0.0),
            row(up / half_height, 0.0),
            row(DVec3::ZERO, NEAR),
            row(-back, 0.0),
        )
        .transpose();

        let ray_right = right * (2.0 * half_width / f64::from(size.width));
        let ray_down = -up * (2.0 * half_height / f64::from(size.height));
        let ray_corner = -back - right * half_width + up * half_height;
        Self { units_per_metre, position: camera.position, view_projection, ray_corner, ray_right, ray_down }
    }
}

/// What sample `sample_index`, at `offset` from the pixels' centres, tells the shaders.
pub(super) fn sample_push(size: Size, offset: DVec2, sample_index: u32) -> SamplePush {
    // The scene moves against the offset, and up is up in clip space.
    let clip = DVec2::new(-2.0 * offset.x / f64::from(size.width), 2.0 * offset.y / f64::from(size.height));
    let narrow = |v: DVec2| Vec2::new(v.x as f32, v.y as f32);
    SamplePush { jitter: narrow(offset), clip_offset: narrow(clip), sample_index, ..SamplePush::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rasteriser and the rays have to agree on where a point is seen.
    #[test]
    fn a_point_on_a_ray_projects_to_the_rays_pixel() {
        let camera = Camera {
            position: DVec3::new(1.0, 2.0, 3.0),
            target: DVec3::new(-0.5, 0.3, -1.0),
            up: DVec3::Y,
            vertical_fov: 0.7,
        };
        let size = Size { width: 640, height: 360 };
        let view = View::new(&camera, None, size);
        for pixel in [DVec2::new(0.0, 0.0), DVec2::new(640.0, 360.0), DVec2::new(123.4, 301.9)] {
            let ray = view.ray_corner + pixel.x * view.ray_right + pixel.y * view.ray_down;
            for distance in [0.001, 1.0, 1e6] {
                let clip = view.view_projection * (ray * distance).extend(1.0);
                let ndc = clip / clip.w;
                let seen = DVec2::new((ndc.x + 1.0) / 2.0 * 640.0, (1.0 - ndc.y) / 2.0 * 360.0);
                assert!((seen - pixel).length() < 1e-9, "{pixel} seen at {seen}");
                assert!((0.0..=1.0).contains(&ndc.z));
            }
        }
    }

    #[test]
    fn the_scene_moves_against_the_jitter() {
        let push = sample_push(Size { width: 100, height: 50 }, DVec2::new(0.25, 0.25), 0);
        assert_eq!(push.clip_offset, Vec2::new(-0.005, 0.01));
    }
}
