//! Axis-aligned boxes: in flow points, out flows what encloses them.

use glam::{DAffine3, DVec3};

/// An axis-aligned box with its faces; empty where `min` is above `max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The corner with the smallest coordinates.
    pub min: DVec3,
    /// The corner with the largest coordinates.
    pub max: DVec3,
}

impl Bounds {
    /// The box around nothing.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The box around `points`.
    pub fn around(points: impl IntoIterator<Item = DVec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |all, point| Self { min: all.min.min(point), max: all.max.max(point) })
    }

    /// The box around mesh `positions` in the place where `transform` puts them.
    pub fn around_positions(positions: &[[f32; 3]], transform: &DAffine3) -> Self {
        Self::around(
            positions.iter().map(|&[x, y, z]| transform.transform_point3(DVec3::new(x.into(), y.into(), z.into()))),
        )
    }

    /// The box around both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether nothing is inside, not even one point.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Whether `point` is inside or on a face.
    pub fn contains(&self, point: DVec3) -> bool {
        self.min.cmple(point).all() && point.cmple(self.max).all()
    }

    /// Whether all of it is inside of `other` or on its faces.
    pub fn is_within(&self, other: &Self) -> bool {
        other.contains(self.min) && other.contains(self.max)
    }

    /// Whether the boxes share a point.
    pub fn intersects(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// The middle.
    pub fn center(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    /// Lengths of the edges.
    pub fn extent(&self) -> DVec3 {
        self.max - self.min
    }

    /// The distance from `point` to the corner farthest from it.
    pub fn farthest(&self, point: DVec3) -> f64 {
        (self.min - point).abs().max((self.max - point).abs()).length()
    }

    /// The largest absolute coordinate.
    pub fn reach(&self) -> f64 {
        self.min.abs().max(self.max.abs()).max_element()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: Bounds = Bounds { min: DVec3::ZERO, max: DVec3::ONE };

    #[test]
    fn faces_belong_to_the_box() {
        assert!(UNIT.contains(DVec3::ONE) && UNIT.contains(DVec3::ZERO));
        assert!(!UNIT.contains(DVec3::new(0.5, 1.0 + 1e-12, 0.5)));
        assert!(UNIT.is_within(&UNIT) && !UNIT.is_within(&Bounds { max: DVec3::new(1.0, 1.0, 0.9), ..UNIT }));
        assert!(UNIT.intersects(&Bounds { min: DVec3::ONE, max: DVec3::splat(2.0) }));
        assert!(!UNIT.intersects(&Bounds { min: DVec3::new(0.0, 0.0, 1.1), max: DVec3::splat(2.0) }));
    }

    #[test]
    fn the_empty_box_holds_and_meets_nothing() {
        assert!(Bounds::EMPTY.is_empty() && !UNIT.is_empty());
        assert!(!Bounds::EMPTY.contains(DVec3::ZERO) && !Bounds::EMPTY.intersects(&UNIT));
        assert_eq!(Bounds::EMPTY.union(UNIT), UNIT);
    }

    #[test]
    fn positions_are_transformed_one_by_one() {
        let quarter = DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_4);
        let bounds = Bounds::around_positions(&[[1.0, 0.0, 0.0], [0.0, 0.0, 2.0]], &quarter);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        assert!((bounds.max - DVec3::new(half, half, 2.0)).length() < 1e-12);
    }
}
