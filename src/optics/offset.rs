//! Where a ray starts that leaves a surface. As `shaders/offset.glsl`.

use glam::DVec3;

/// How far `origin` must at least lie from `position` along `n`, on the side of `w`, to be beyond the box `position` +- `error`:
/// Pharr, Jakob & Humphreys, Physically Based Rendering (4th ed.), 6.8.
pub fn offset_distance(error: DVec3, n: DVec3) -> f64 {
    n.abs().dot(error)
}

/// The point at that distance.
pub fn offset_ray_origin(position: DVec3, error: DVec3, n: DVec3, w: DVec3) -> DVec3 {
    let distance = offset_distance(error, n);
    position + if w.dot(n) < 0.0 { -distance } else { distance } * n
}
