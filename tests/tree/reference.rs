//! The tree of reflections and refractions once more, in 64-bit arithmetic: the referee of the model `tree`. In flow
//! a scene, [`Settings`] and pixels or rays, out flow radiance and what the tree behind it was like ([`Sample`]), or
//! its ends one by one ([`Leaf`]). It shares nothing with the passes but the scene and the equations of `optics`.
//!
//! Conventions. `w` points from a hit to the viewer, `ng` is the face's normal on the side of the viewer, `ns` the
//! interpolated one, turned along with `ng`. A throughput is what an end's radiance, divided by the square of the
//! index of the medium there, counts at the camera, divided likewise: 1 at the camera itself.

use std::thread;

use glam::{DVec2, DVec3};

use vitrum::optics::{fresnel, medium};
use vitrum::options::Size;
use vitrum::scene::{Dielectric, Scene, Surface};

use crate::closest::{Hit, Triangles};
use crate::common::reference::environment_radiance;

/// What directions and interpolated normals keep from the surface, as a cosine.
pub const LEAST_COSINE: f64 = 1e-4;

/// How far from a surface, in diagonals of the scene, a ray starts.
const STEP: f64 = 1e-9;

/// Surfaces in a row that a ray may pass without an event before it counts as stuck.
const MOST_PASSES: u32 = 10_000;

/// How far the tree is followed, and which effects it has.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// A branch whose largest throughput is below this is cut.
    pub cutoff: f64,
    /// Longest chain of events; a surface that is passed straight on, without a change of the medium, is none.
    pub max_depth: u32,
    /// Whether the media are tracked where bodies overlap; if not, there is air on the outside of every surface.
    pub nesting: bool,
    /// Nanometres; none: the indices as they stand in the scene.
    pub wavelength: Option<f64>,
    /// Rays of a lower throughput leave no trace in [`Sample::signature`].
    pub signature_floor: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { cutoff: 1e-9, max_depth: 32, nesting: true, wavelength: None, signature_floor: 0.0 }
    }
}

/// What a ray, or the mean of several, sees.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// As seen from the camera's medium.
    pub radiance: DVec3,
    /// Throughput that was cut off, the largest of its three channels.
    pub discarded: f64,
    /// What the environment in the directions of that would add to the radiance.
    pub stand_in: DVec3,
    /// Rays followed.
    pub rays: u64,
    /// Events of the whole tree but those that end a chain.
    pub events: u64,
    /// Events of the chain with the largest throughput.
    pub interfaces: f64,
    /// Tells trees apart: the triangles that were met and what happened there, in order.
    pub signature: u64,
}

/// Where a chain ends.
#[derive(Clone, Copy, Debug)]
pub struct Leaf {
    pub throughput: DVec3,
    /// Where the last ray came from: the last surface or the camera.
    pub position: DVec3,
    /// Where it went.
    pub direction: DVec3,
    /// Events on the way.
    pub interfaces: u32,
    pub end: End,
}

/// What ends a chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// The ray left the scene.
    Environment,
    /// The opaque object with this index.
    Opaque(usize),
    /// The cut-off, the depth limit or a ray that is stuck.
    Cut,
}

/// An object's material at one wavelength.
#[derive(Clone, Copy, Debug)]
enum Matter {
    Medium(Medium),
    Pane(Medium),
    Opaque { emission: DVec3 },
}

/// Index of refraction and absorption per metre.
#[derive(Clone, Copy, Debug)]
struct Medium {
    index: f64,
    absorption: DVec3,
}

const AIR: Medium = Medium { index: 1.0, absorption: DVec3::ZERO };

/// What an object is made of, and its place in the order that decides where bodies overlap: the higher rank is there.
#[derive(Clone, Copy, Debug)]
struct Body {
    matter: Matter,
    rank: usize,
}

/// The objects that a point is in, by their indices; one that was entered twice stands there twice.
type Inside = Vec<usize>;

/// A ray to be followed.
#[derive(Clone, Debug)]
struct Branch {
    throughput: DVec3,
    /// On the surface that it leaves; the camera.
    position: DVec3,
    direction: DVec3,
    /// That surface and the unit normal on the side of the ray.
    left: Option<(usize, DVec3)>,
    inside: Inside,
    interfaces: u32,
    /// Surfaces passed since the last event.
    passes: u32,
}

/// What happens at a surface, as signatures tell it.
#[derive(Clone, Copy, Debug)]
enum Event {
    Pass = 1,
    Split,
    TotalReflection,
    Pane,
    Opaque,
    Limit,
    Escape,
}

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    /// Index into [`Triangles::all`].
    pub triangle: usize,
    /// Index into the scene's objects.
    pub object: usize,
    pub position: DVec3,
    /// The ray comes from the outside.
    pub front: bool,
    /// The face's unit normal, on the side of the viewer.
    pub ng: DVec3,
    /// The interpolated unit normal, turned along with [`Meeting::ng`]; without interpolation the same as that.
    pub ns: DVec3,
    /// Normals are interpolated.
    pub smooth: bool,
}

/// A scene that can be looked at.
pub struct Referee<'a> {
    pub triangles: Triangles,
    scene: &'a Scene,
    settings: Settings,
    bodies: Vec<Body>,
    camera_inside: Inside,
    step: f64,
}

/// What the material says at this wavelength: the one place that reads [`Dielectric`].
fn medium_of(glass: &Dielectric, wavelength: Option<f64>) -> Medium {
    let Dielectric { ior, attenuation_color, attenuation_distance, .. } = *glass;
    let absorption = |color| match attenuation_distance {
        f64::INFINITY => 0.0,
        distance => medium::absorption(color, distance),
    };
    Medium {
        index: wavelength.map_or(ior, |wavelength| glass.index_at(wavelength)),
        absorption: DVec3::from_array(attenuation_color.to_array().map(absorption)),
    }
}

impl Medium {
    fn transmittance(&self, distance: f64) -> DVec3 {
        // Where nothing is absorbed, nothing is over an infinite distance.
        let along = |absorption| if absorption == 0.0 { 1.0 } else { medium::transmittance(absorption, distance) };
        DVec3::from_array(self.absorption.to_array().map(along))
    }
}

/// The volume that an object encloses in the world.
fn volume(scene: &Scene, object: usize) -> f64 {
    let placed = &scene.objects[object];
    let mesh = &scene.meshes[placed.mesh];
    let centre = mesh.bounds().center();
    let six_volumes = mesh.triangles.iter().map(|triangle| {
        let [a, b, c] = triangle.map(|i| DVec3::from_array(mesh.positions[i as usize].map(f64::from)) - centre);
        a.dot(b.cross(c))
    });
    (six_volumes.sum::<f64>() / 6.0 * placed.transform.matrix3.determinant()).abs()
}

impl<'a> Referee<'a> {
    pub fn new(scene: &'a Scene, settings: Settings) -> Self {
        let surface = |object: usize| &scene.materials[scene.objects[object].material].surface;
        let key = |object: usize| match surface(object) {
            Surface::Dielectric(glass) => (glass.priority, -volume(scene, object)),
            Surface::Opaque(_) => (i32::MIN, 0.0),
        };
        let keys: Vec<_> = (0..scene.objects.len()).map(key).collect();
        let mut order: Vec<_> = (0..keys.len()).collect();
        // Stable: of equals the later object ranks higher.
        order.sort_by(|&a, &b| keys[a].0.cmp(&keys[b].0).then(keys[a].1.total_cmp(&keys[b].1)));
        let matter = |object: usize| match surface(object) {
            Surface::Dielectric(glass) if glass.thin_walled => Matter::Pane(medium_of(glass, settings.wavelength)),
            Surface::Dielectric(glass) => Matter::Medium(medium_of(glass, settings.wavelength)),
            Surface::Opaque(opaque) => Matter::Opaque { emission: opaque.emission },
        };
        let mut bodies: Vec<_> = (0..keys.len()).map(|object| Body { matter: matter(object), rank: 0 }).collect();
        for (rank, &object) in order.iter().enumerate() {
            bodies[object].rank = rank;
        }
        let step = STEP * scene.bounds().map_or(0.0, |bounds| bounds.extent().length());
        let triangles = Triangles::new(scene);
        let mut referee = Self { triangles, scene, settings, bodies, camera_inside: Inside::new(), step };
        referee.camera_inside = referee.inside(scene.camera.position);
        referee
    }

    /// The bodies around a point that is on no surface: closed ones that have an inside.
    pub fn inside(&self, point: DVec3) -> Vec<usize> {
        let holds = |&object: &usize| {
            let placed = &self.scene.objects[object];
            let mesh = &self.scene.meshes[placed.mesh];
            matches!(self.bodies[object].matter, Matter::Medium(_))
                && mesh.faults.is_closed()
                && mesh.winding_number(placed.transform.inverse().transform_point3(point)) >= 0.5
        };
        let inside = (0..self.bodies.len()).filter(holds);
        if self.settings.nesting {
            inside.collect()
        } else {
            inside.max_by_key(|&i| self.bodies[i].rank).into_iter().collect()
        }
    }

    /// Unit direction through a point of the image, in pixels from its top left corner.
    pub fn ray(&self, size: Size, point: DVec2) -> DVec3 {
        let camera = &self.scene.camera;
        let forward = (camera.target - camera.position).normalize();
        let right = forward.cross(camera.up).normalize();
        let down = forward.cross(right);
        let from_centre = point - 0.5 * DVec2::new(size.width.into(), size.height.into());
        let pixel = 2.0 * (0.5 * camera.vertical_fov).tan() / f64::from(size.height);
        (forward + pixel * (from_centre.x * right + from_centre.y * down)).normalize()
    }

    /// What the camera sees at a point of the image, in pixels from its top left corner.
    pub fn sample(&self, size: Size, point: DVec2) -> Sample {
        self.look(self.scene.camera.position, self.ray(size, point), &self.camera_inside)
    }

    /// The mean over `offsets` from the pixel's centre, in pixels; rays are summed and signatures joined.
    pub fn pixel(&self, size: Size, x: u32, y: u32, offsets: &[DVec2]) -> Sample {
        let centre = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
        let share = 1.0 / offsets.len() as f64;
        offsets.iter().map(|&offset| self.sample(size, centre + offset)).fold(Sample::default(), |mean, one| Sample {
            radiance: mean.radiance + share * one.radiance,
            discarded: mean.discarded + share * one.discarded,
            stand_in: mean.stand_in + share * one.stand_in,
            rays: mean.rays + one.rays,
            events: mean.events + one.events,
            interfaces: mean.interfaces + share * one.interfaces,
            signature: mix(mean.signature, one.signature),
        })
    }

    /// All pixels, row by row from the top.
    pub fn picture(&self, size: Size, offsets: &[DVec2]) -> Vec<Sample> {
        let mut pixels = vec![Sample::default(); (size.width * size.height) as usize];
        let threads = thread::available_parallelism().map_or(1, usize::from);
        let mut shares: Vec<Vec<_>> = (0..threads).map(|_| Vec::new()).collect();
        for (row, y) in pixels.chunks_mut(size.width as usize).zip(0..) {
            shares[y as usize % threads].push((row, y));
        }
        thread::scope(|scope| {
            for share in shares {
                scope.spawn(move || {
                    for (row, y) in share {
                        (0..).zip(row).for_each(|(x, pixel)| *pixel = self.pixel(size, x, y, offsets));
                    }
                });
            }
        });
        pixels
    }

    /// What is seen from `origin`, which lies in the bodies `inside` (see [`Referee::inside`]), along a unit
    /// direction.
    pub fn look(&self, origin: DVec3, direction: DVec3, inside: &[usize]) -> Sample {
        self.grow(origin, direction, inside, &mut |_| ())
    }

    /// As [`Referee::look`]; shows every end of the tree to `visit`.
    pub fn grow(&self, origin: DVec3, direction: DVec3, inside: &[usize], visit: &mut dyn FnMut(&Leaf)) -> Sample {
        let mut sample = Sample::default();
        let mut strongest = 0.0;
        let mut end = |branch: &Branch, end: End, radiance: DVec3, sample: &mut Sample| {
            let Branch { throughput, position, direction, interfaces, .. } = *branch;
            if throughput == DVec3::ZERO {
                return;
            }
            let largest = throughput.max_element();
            if largest > strongest {
                (strongest, sample.interfaces) = (largest, interfaces.into());
            }
            sample.radiance += throughput * radiance;
            if end == End::Cut {
                sample.discarded += largest;
                sample.stand_in += throughput * environment_radiance(&self.scene.environment, direction);
            }
            visit(&Leaf { throughput, position, direction, interfaces, end });
        };
        let (throughput, position, inside) = (DVec3::ONE, origin, inside.to_vec());
        let index = self.medium(&inside).index;
        let mut branches =
            vec![Branch { throughput, position, direction, left: None, inside, interfaces: 0, passes: 0 }];
        while let Some(mut branch) = branches.pop() {
            if branch.throughput.max_element() < self.settings.cutoff {
                end(&branch, End::Cut, DVec3::ZERO, &mut sample);
                continue;
            }
            sample.rays += 1;
            let met = self.follow(&mut branch);
            let mut note = |triangle: usize, event: Event| {
                if branch.throughput.max_element() >= self.settings.signature_floor {
                    let event = (event as u64) << 32 | u64::from(branch.interfaces);
                    sample.signature = mix(mix(sample.signature, triangle as u64), event);
                }
            };
            let Some(met) = met else {
                note(0, Event::Escape);
                let seen = branch.interfaces > 0 || self.scene.environment.visible;
                let radiance = environment_radiance(&self.scene.environment, branch.direction);
                end(&branch, End::Environment, if seen { radiance } else { DVec3::ZERO }, &mut sample);
                continue;
            };
            let (event, children) = self.interact(&branch, &met);
            note(met.triangle, event);
            sample.events += u64::from(matches!(event, Event::Split | Event::TotalReflection | Event::Pane));
            match event {
                Event::Opaque => {
                    let radiance = self.opaque_radiance(&met) / self.medium(&branch.inside).index.powi(2);
                    end(&branch, End::Opaque(met.object), radiance, &mut sample);
                }
                Event::Limit => end(&branch, End::Cut, DVec3::ZERO, &mut sample),
                // What is reflected is followed first.
                _ => branches.extend(children.into_iter().rev().filter(|child| child.throughput != DVec3::ZERO)),
            }
        }
        sample.radiance *= index * index;
        sample.stand_in *= index * index;
        sample
    }

    /// Light that an opaque object sends to the viewer, in the medium around it.
    ///
    /// The hook for opaque surfaces: so far they take in all light that falls on them, and are seen by what they
    /// emit.
    fn opaque_radiance(&self, met: &Meeting) -> DVec3 {
        match self.bodies[met.object].matter {
            Matter::Opaque { emission } => emission,
            Matter::Medium(_) | Matter::Pane(_) => DVec3::ZERO,
        }
    }

    /// Where the branch ends; takes away what is absorbed on the way. A body that it turns out to come out of, and
    /// was not known to be in, counts as if it had been.
    fn follow(&self, branch: &mut Branch) -> Option<Meeting> {
        let beside = branch.left.map_or(DVec3::ZERO, |(_, side)| self.step * side);
        let except = branch.left.map(|(triangle, _)| triangle);
        let hit = self.triangles.closest(branch.position + beside, branch.direction, except);
        let met = hit.map(|hit| {
            let (origin, hit) = self.without_step(branch, beside, hit);
            self.meet(hit, origin, branch.direction)
        });
        let has_inside = |met: &Meeting| matches!(self.bodies[met.object].matter, Matter::Medium(_));
        if let Some(met) = met.filter(|met| !met.front && has_inside(met)) {
            if !self.settings.nesting {
                branch.inside = vec![met.object];
            } else if !branch.inside.contains(&met.object) {
                branch.inside.push(met.object);
            }
        }
        let distance = met.map_or(f64::INFINITY, |met| met.position.distance(branch.position));
        branch.throughput *= self.medium(&branch.inside).transmittance(distance);
        met
    }

    /// A hit and the origin that its distance counts from: the surface itself, so that the step beside it finds the
    /// triangle and leaves no trace in where it is met, unless it is seen so much on edge that the ray from the
    /// surface misses it.
    fn without_step(&self, branch: &Branch, beside: DVec3, hit: Hit) -> (DVec3, Hit) {
        const OUTSIDE: f64 = 1e-6;
        let triangle = &self.triangles.all[hit.triangle];
        let area = triangle.area_vector();
        let distance = hit.distance + area.dot(beside) / area.dot(branch.direction);
        let weights = triangle.weights(branch.position + distance * branch.direction);
        let is_met = distance > 0.0 && weights.iter().all(|&weight| weight > -OUTSIDE);
        if is_met { (branch.position, Hit { distance, ..hit }) } else { (branch.position + beside, hit) }
    }

    /// The surface at a hit of the ray from `origin`.
    pub fn meet(&self, hit: Hit, origin: DVec3, direction: DVec3) -> Meeting {
        let triangle = &self.triangles.all[hit.triangle];
        let object = triangle.object as usize;
        let placed = &self.scene.objects[object];
        let mesh = &self.scene.meshes[placed.mesh];
        let mirrored = placed.transform.matrix3.determinant() < 0.0;
        let outward = triangle.area_vector().normalize() * if mirrored { -1.0 } else { 1.0 };
        let front = outward.dot(direction) < 0.0;
        let turn = if front { 1.0 } else { -1.0 };
        let weights = triangle.weights(origin + hit.distance * direction);
        // On the triangle to the last digits, where the ray's own point strays along the ray.
        let position = weights.into_iter().zip(triangle.corners).map(|(weight, corner)| weight * corner).sum();
        let smooth = placed.smooth && !mesh.normals.is_empty();
        let interpolated = || {
            let to_world = placed.transform.matrix3.inverse().transpose();
            let normal = |vertex: u32| DVec3::from_array(mesh.normals[vertex as usize].map(f64::from));
            let normals = mesh.triangles[triangle.index as usize].map(|vertex| to_world * normal(vertex));
            let sum: DVec3 = weights.into_iter().zip(normals).map(|(weight, normal)| weight * normal).sum();
            sum.normalize_or(outward)
        };
        let ns = if smooth { interpolated() } else { outward };
        Meeting { triangle: hit.triangle, object, position, front, ng: turn * outward, ns: turn * ns, smooth }
    }

    /// What happens where a branch meets a surface, and the branches that go on from there.
    fn interact(&self, branch: &Branch, met: &Meeting) -> (Event, Vec<Branch>) {
        let w = -branch.direction;
        let on = |direction: DVec3, side: DVec3, inside: &[usize]| Branch {
            throughput: branch.throughput,
            position: met.position,
            direction,
            left: Some((met.triangle, side)),
            inside: inside.to_vec(),
            interfaces: branch.interfaces,
            passes: branch.passes + 1,
        };
        let part = |share: f64, branch: Branch| Branch {
            throughput: share * branch.throughput,
            interfaces: branch.interfaces + 1,
            passes: 0,
            ..branch
        };
        let pass = |inside: &[usize]| match branch.passes {
            MOST_PASSES.. => (Event::Limit, Vec::new()),
            _ => (Event::Pass, vec![on(branch.direction, -met.ng, inside)]),
        };
        let inside = &branch.inside;
        match self.bodies[met.object].matter {
            Matter::Opaque { .. } => (Event::Opaque, Vec::new()),
            Matter::Pane(pane) => {
                let around = if self.settings.nesting { self.medium(inside).index } else { AIR.index };
                if around == pane.index {
                    return pass(inside);
                }
                if branch.interfaces == self.settings.max_depth {
                    return (Event::Limit, Vec::new());
                }
                let ns = met.shading_normal(w);
                let once = fresnel::fresnel_dielectric(w.dot(ns).min(1.0), around, pane.index);
                // All orders of reflection between the two faces, summed up.
                let both = 1.0 + once.reflectance;
                let reflected = on(met.reflected(w, ns), met.ng, inside);
                let straight = on(branch.direction, -met.ng, inside);
                let shares = [2.0 * once.reflectance / both, once.transmittance / both];
                (Event::Pane, vec![part(shares[0], reflected), part(shares[1], straight)])
            }
            Matter::Medium(_) => {
                let (before, after) = self.sides(inside, met);
                let (index_i, index_t) = (self.medium(&before).index, self.medium(&after).index);
                if self.highest(&before) == self.highest(&after) || index_i == index_t {
                    return pass(&after);
                }
                if branch.interfaces == self.settings.max_depth {
                    return (Event::Limit, Vec::new());
                }
                let ns = met.shading_normal(w);
                let interface = fresnel::fresnel_dielectric(w.dot(ns).min(1.0), index_i, index_t);
                let reflected = on(met.reflected(w, ns), met.ng, &before);
                match met.refracted(w, ns, index_i, index_t) {
                    Some(direction) if !interface.total => {
                        let refracted = on(direction, -met.ng, &after);
                        let shares = [interface.reflectance, interface.transmittance];
                        (Event::Split, vec![part(shares[0], reflected), part(shares[1], refracted)])
                    }
                    _ => (Event::TotalReflection, vec![part(1.0, reflected)]),
                }
            }
        }
    }

    /// The bodies around the ray on the viewer's side of a surface, and those beyond.
    fn sides(&self, inside: &[usize], met: &Meeting) -> (Inside, Inside) {
        let entered = vec![met.object];
        match (self.settings.nesting, met.front) {
            (false, true) => (Inside::new(), entered),
            (false, false) => (entered, Inside::new()),
            (true, true) => (inside.to_vec(), [inside, &entered].concat()),
            (true, false) => {
                let mut after = inside.to_vec();
                if let Some(place) = after.iter().position(|&object| object == met.object) {
                    after.swap_remove(place);
                }
                (inside.to_vec(), after)
            }
        }
    }

    /// The body that fills a point in these bodies: the highest one.
    fn highest(&self, inside: &[usize]) -> Option<usize> {
        inside.iter().copied().max_by_key(|&object| self.bodies[object].rank)
    }

    fn medium(&self, inside: &[usize]) -> Medium {
        match self.highest(inside).map(|object| self.bodies[object].matter) {
            Some(Matter::Medium(medium)) => medium,
            _ => AIR,
        }
    }
}

/// The rule for interpolated normals: they face the viewer, and what they reflect or refract stays on its side of the
/// face.
impl Meeting {
    /// The normal that light is reflected and refracted at, seen from `w`.
    pub fn shading_normal(&self, w: DVec3) -> DVec3 {
        self.kept(self.ns, w)
    }

    /// `w` mirrored at `ns`.
    pub fn reflected(&self, w: DVec3, ns: DVec3) -> DVec3 {
        self.kept(2.0 * w.dot(ns) * ns - w, self.ng)
    }

    /// `w` refracted at `ns`; `None`: totally reflected.
    pub fn refracted(&self, w: DVec3, ns: DVec3, index_i: f64, index_t: f64) -> Option<DVec3> {
        fresnel::refract(w, ns, index_i, index_t).map(|direction| self.kept(direction, -self.ng))
    }

    /// `direction`, or where that is not [`LEAST_COSINE`] on the side of `side`, bent there.
    fn kept(&self, direction: DVec3, side: DVec3) -> DVec3 {
        let lack = LEAST_COSINE - direction.dot(side);
        if self.smooth && lack > 0.0 { (direction + lack * side).normalize() } else { direction }
    }
}

/// A hash of both, in this order: SplitMix64's (Steele, Lea & Flood 2014).
fn mix(hash: u64, value: u64) -> u64 {
    let mut bits = hash.rotate_left(23).wrapping_add(0x9e37_79b9_7f4a_7c15) ^ value;
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    bits ^ (bits >> 31)
}
