//! The model `double`: bodies one after the other, each drawn as pictures of its nearest fronts and its nearest backs, in which the
//! shader then finds where light leaves it.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::DVec3;

use super::geometry::{Arrays, Draw, Geometry, Layout};
use super::resources::Resources;
use super::view::View;
use super::{RADIANCE, Targets};
use crate::gpu::{
    Area, Bind, BindGroup, ComputePipeline, Depth, Format, Gpu, GraphicsPipeline, GraphicsPipelineDesc, Image,
    ImageDesc, Recorder, Result, SamplePush, Shown, Sides, Specialization, Target, Use, shaders,
};
use crate::options::Size;
use crate::scene::{Bounds, Scene, Surface};

/// Numbers of triangles, from 1.
const LAYER: Format = Format::R32Uint;

/// `Placed` of `shaders/exit.glsl`: an instance in the picture.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct Placed {
    /// The texels that may show it, first and last.
    first: [i32; 2],
    last: [i32; 2],
    /// 1: a closed body, seen from outside.
    closed: u32,
    /// Of the radiance that is seen from inside of it.
    scale: f32,
}

impl Placed {
    /// The instances of `geometry`.
    pub(super) fn all(scene: &Scene, geometry: &Geometry, view: &View, size: Size) -> Vec<Self> {
        let around = scene.bodies_around_camera();
        let placed = geometry.objects.iter().zip(&geometry.draws).map(|(&number, draw)| {
            let object = &scene.objects[number];
            let (first, last) = area(scene.bounds_of(object), view, size);
            let index = match &scene.materials[object.material].surface {
                Surface::Dielectric(glass) if around.contains(&number) => glass.ior,
                _ => 1.0,
            };
            let closed = u32::from(draw.sides.shown == Shown::Fronts);
            Self { first, last, closed, scale: (index * index) as f32 }
        });
        placed.collect()
    }

    fn area(&self) -> Area {
        let corner = self.first.map(|side| side as u32);
        Area { corner, size: std::array::from_fn(|i| (self.last[i] - self.first[i] + 1) as u32) }
    }
}

/// The first and the last texel that may show `bounds`, wherever in its pixel a sample lies; all where it reaches behind the camera.
fn area(bounds: Bounds, view: &View, size: Size) -> ([i32; 2], [i32; 2]) {
    let sides = [f64::from(size.width), f64::from(size.height)];
    let whole = ([0; 2], sides.map(|side| side as i32 - 1));
    let corners = (0..8).map(|i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { bounds.min[axis] } else { bounds.max[axis] };
        let corner = (DVec3::new(pick(0), pick(1), pick(2)) - view.position) * view.units_per_metre;
        view.view_projection * corner.extend(1.0)
    });
    let (mut least, mut most) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for clip in corners {
        if clip.w <= 1e-3 * clip.truncate().length() {
            return whole;
        }
        let place = [(0.5 + 0.5 * clip.x / clip.w) * sides[0], (0.5 - 0.5 * clip.y / clip.w) * sides[1]];
        for axis in 0..2 {
            least[axis] = least[axis].min(place[axis]);
            most[axis] = most[axis].max(place[axis]);
        }
    }
    // Half a pixel for the sample's place, one for rounding.
    let clamp = |place: f64, axis: usize| place.floor().clamp(0.0, sides[axis] - 1.0) as i32;
    (std::array::from_fn(|i| clamp(least[i] - 1.5, i)), std::array::from_fn(|i| clamp(most[i] + 1.5, i)))
}

/// `Facet` of `shaders/exit.glsl`: a triangle as planes, in the space of its mesh.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct Facet {
    outside: [f32; 4],
    second: [f32; 4],
    third: [f32; 4],
}

impl Facet {
    /// All triangles, in their order.
    pub(super) fn all(layout: &Layout, arrays: &Arrays) -> Vec<Self> {
        let mut facets = Vec::with_capacity(arrays.triangles.len() / 3);
        for (first_vertex, triangles) in layout.spans() {
            let corner = |vertex: u32| {
                let at = 3 * (first_vertex + vertex) as usize;
                DVec3::from_array(std::array::from_fn(|axis| f64::from(arrays.positions[at + axis])))
            };
            facets.extend(triangles.clone().map(|triangle| {
                let at = 3 * triangle as usize;
                Self::new(std::array::from_fn(|i| corner(arrays.triangles[at + i])))
            }));
        }
        facets
    }

    /// All 0 of a triangle without an area: nothing meets its plane.
    fn new([a, b, c]: [DVec3; 3]) -> Self {
        let twice = (b - a).cross(c - a);
        let normal = twice.normalize_or_zero();
        let weight = |edge: DVec3| {
            let slope = normal.cross(edge) / twice.length().max(f64::MIN_POSITIVE);
            slope.extend(-slope.dot(a)).as_vec4().to_array()
        };
        Self { outside: normal.extend(normal.dot(a)).as_vec4().to_array(), second: weight(a - c), third: weight(b - a) }
    }
}

/// What the model reads and writes beside radiance and mean.
pub(super) struct DoubleTargets {
    /// The scene, planes and places of its triangles, and the pictures of an instance.
    group: BindGroup,
    fronts: Arc<Image>,
    backs: Arc<Image>,
    depth: Image,
    accumulation: BindGroup,
    /// Sums of squared differences between samples.
    pub(super) spread: Arc<Image>,
}

impl DoubleTargets {
    pub(super) fn new(gpu: &Gpu, resources: &Resources, radiance: &Arc<Image>, mean: &Arc<Image>) -> Result<Self> {
        let (width, height) = (mean.width(), mean.height());
        let image = |name, format, uses: &[Use]| Image::new(gpu, &ImageDesc { name, width, height, format, uses });
        let layer = |name| image(name, LAYER, &[Use::ColorTarget, Use::Sampled]).map(Arc::new);
        let (fronts, backs) = (layer("fronts")?, layer("backs")?);
        let spread = Arc::new(image("spread", RADIANCE, &[Use::Storage, Use::CopySource])?);
        let mut bindings = resources.layered.clone();
        bindings.extend([&fronts, &backs].map(|image| Bind::Sampled(image.clone())));
        let sums = vec![Bind::Sampled(radiance.clone()), Bind::Storage(mean.clone()), Bind::Storage(spread.clone())];
        Ok(Self {
            group: BindGroup::new(gpu, "double", bindings)?,
            fronts,
            backs,
            depth: image("depth of a layer", Format::Depth32, &[Use::DepthTarget])?,
            accumulation: BindGroup::new(gpu, "accumulation with spread", sums)?,
            spread,
        })
    }
}

pub(super) struct Double {
    layer: GraphicsPipeline,
    shade: GraphicsPipeline,
    accumulate: ComputePipeline,
}

impl Double {
    pub(super) fn new(gpu: &Gpu, resources: &Resources, targets: &DoubleTargets) -> Result<Self> {
        let layer = GraphicsPipelineDesc {
            name: "layer",
            vertex: &shaders::FORWARD_VERT,
            fragment: &shaders::LAYER_FRAG,
            group: &resources.group,
            push_bytes: size_of::<SamplePush>() as u32,
            colors: &[LAYER],
            depth: Depth::Nearest,
            specialization: &resources.specialization,
        };
        let shade = GraphicsPipelineDesc {
            name: "double",
            vertex: &shaders::FULLSCREEN_VERT,
            fragment: &shaders::DOUBLE_FRAG,
            group: &targets.group,
            colors: &[RADIANCE],
            ..layer
        };
        let sum = &shaders::ACCUMULATE_SPREAD_COMP;
        Ok(Self {
            layer: GraphicsPipeline::new(gpu, &layer)?,
            shade: GraphicsPipeline::new(gpu, &shade)?,
            accumulate: ComputePipeline::new(gpu, sum, &targets.accumulation, 4, &Specialization::default())?,
        })
    }

    pub(super) fn record<'r>(
        &'r self,
        cmd: &mut Recorder<'_, 'r>,
        resources: &'r Resources,
        targets: &'r Targets,
        double: &'r DoubleTargets,
        draws: &[Draw],
        push: SamplePush,
    ) {
        let clear = Some([0.0; 4]);
        let (radiance, depth) = (&targets.radiance, &targets.depth);
        cmd.render(&[Target { image: radiance, clear }], Some(Target { image: depth, clear }), |_| {});
        for (instance_index, (draw, placed)) in (0..).zip(draws.iter().zip(&resources.placed)) {
            let push = SamplePush { instance_index, ..push };
            let area = placed.area();
            for (image, shown) in [(&double.fronts, Shown::Fronts), (&double.backs, Shown::Backs)] {
                let depth = Target { image: &double.depth, clear };
                cmd.render_area(&[Target { image, clear }], Some(depth), area, |pass| {
                    pass.bind(&self.layer, &resources.group);
                    pass.draw(&push, draw.vertices, Sides { shown, ..draw.sides });
                });
            }
            cmd.use_image(&double.fronts, Use::Sampled);
            cmd.use_image(&double.backs, Use::Sampled);
            let (color, depth) = (Target { image: radiance, clear: None }, Target { image: depth, clear: None });
            cmd.render_area(&[color], Some(depth), area, |pass| {
                pass.bind(&self.shade, &double.group);
                pass.draw(&push, 3, Sides::default());
            });
        }
    }

    /// The mean of all samples, and how far they are apart.
    pub(super) fn accumulate<'r>(
        &'r self,
        cmd: &mut Recorder<'_, 'r>,
        targets: &'r Targets,
        double: &'r DoubleTargets,
        index: u32,
    ) {
        cmd.use_image(&targets.radiance, Use::Sampled);
        cmd.use_image(&targets.mean, Use::Storage);
        cmd.use_image(&double.spread, Use::Storage);
        let groups = [targets.mean.width().div_ceil(8), targets.mean.height().div_ceil(8), 1];
        cmd.dispatch(&self.accumulate, &double.accumulation, &index, groups);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;

    #[test]
    fn a_facet_knows_its_outside_and_the_weights_of_its_corners() {
        let corners = [DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.9, 0.1, 0.2), DVec3::new(0.2, 0.8, 0.5)];
        let facet = Facet::new(corners);
        let at = |plane: [f32; 4], x: DVec3| {
            DVec3::new(plane[0].into(), plane[1].into(), plane[2].into()).dot(x) + f64::from(plane[3])
        };
        for (corner, expected) in corners.into_iter().zip([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]) {
            let found = [at(facet.second, corner), at(facet.third, corner)];
            assert!((0..2).all(|i| (found[i] - expected[i]).abs() < 1e-6), "{found:?}");
            let [x, y, z, w] = facet.outside;
            assert!(at([x, y, z, -w], corner).abs() < 1e-6);
        }
        // Counter-clockwise as seen from there.
        let outward = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let [x, y, z, w] = facet.outside;
        assert!(at([x, y, z, -w], corners[0] + outward) > 0.0);
        assert_eq!(Facet::new([corners[0]; 3]), Facet { outside: [0.0; 4], second: [0.0; 4], third: [0.0; 4] });
    }

    #[test]
    fn an_area_holds_what_it_should_and_no_more() {
        let camera = Camera { position: DVec3::Z * 4.0, target: DVec3::ZERO, up: DVec3::Y, vertical_fov: 0.6 };
        let size = Size { width: 200, height: 100 };
        let at = |min: DVec3, max: DVec3| {
            let bounds = Bounds { min, max };
            area(bounds, &View::new(&camera, Some(bounds), size), size)
        };
        // Half a metre at a distance of 3.75 and 4.25 metres: 100 / (2 tan 0.3) pixels in a metre at a distance of one.
        let (first, last) = at(DVec3::splat(-0.25), DVec3::splat(0.25));
        let half = 0.25 / 3.75 * 50.0 / 0.3_f64.tan();
        for (axis, middle) in [(0, 100.0), (1, 50.0)] {
            let (low, high) = (middle - half, middle + half);
            assert!(f64::from(first[axis]) <= low - 1.0 && f64::from(first[axis]) > low - 3.0, "{first:?}");
            assert!(f64::from(last[axis]) >= high && f64::from(last[axis]) < high + 2.0, "{last:?}");
        }
        let whole = ([0, 0], [199, 99]);
        assert_eq!(at(DVec3::new(-0.1, -0.1, 3.0), DVec3::new(0.1, 0.1, 5.0)), whole, "around the camera");
        assert_eq!(at(DVec3::splat(-9.0), DVec3::splat(3.5)), whole, "larger than the picture");
    }
}
