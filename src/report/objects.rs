//! What is wrong with each object and which dielectric lies inside of which: rows for a person and as JSON.

use std::cmp::Ordering;
use std::fmt;

use glam::DVec3;
use serde::Serialize;

use super::explain::counted;
use crate::scene::{Ailment, Diagnosis, Finding, Nest, Nesting, Scene, Surface};

/// Pairs that are told as text.
const MOST_PAIRS: usize = 8;

/// An object, and what is wrong with it.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/explain.md describes the members")]
pub struct ObjectRow {
    pub object: usize,
    pub mesh: String,
    pub material: String,
    pub shells: usize,
    pub cavities: usize,
    pub findings: Vec<FindingRow>,
    pub unfinished: Vec<Ailment>,
}

/// An ailment of an object.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/explain.md describes the members")]
pub struct FindingRow {
    pub ailment: Ailment,
    pub count: usize,
    pub place: [f64; 3],
    pub triangle: Option<usize>,
    pub size: Option<f64>,
    pub says: String,
}

/// Which dielectric lies inside of which.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/explain.md describes the members")]
pub struct NestingRow {
    pub pairs: Vec<NestRow>,
    pub complete: bool,
}

/// Two dielectrics that have to do with each other.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/explain.md describes the members")]
pub struct NestRow {
    pub nesting: Nesting,
    pub objects: [usize; 2],
    pub there: Option<usize>,
    pub place: [f64; 3],
    pub says: String,
}

impl ObjectRow {
    pub(super) fn new(scene: &Scene, diagnosis: &Diagnosis) -> Self {
        let object = &scene.objects[diagnosis.object];
        Self {
            object: object.number + 1,
            mesh: scene.meshes[object.mesh].name.clone(),
            material: scene.materials[object.material].name.clone(),
            shells: diagnosis.shells,
            cavities: diagnosis.cavities,
            findings: diagnosis.findings.iter().map(FindingRow::new).collect(),
            unfinished: diagnosis.unfinished.clone(),
        }
    }

    /// Whether there is something to tell.
    pub(super) fn is_well(&self) -> bool {
        self.findings.is_empty() && self.unfinished.is_empty()
    }
}

impl FindingRow {
    fn new(finding: &Finding) -> Self {
        let Finding { ailment, count, place, triangle, size } = *finding;
        let says = said(finding);
        Self { ailment, count, place: place.to_array(), triangle: triangle.map(|number| number + 1), size, says }
    }
}

/// What it is, where, and what to do.
fn said(finding: &Finding) -> String {
    let size = figure(finding.size.unwrap_or_default());
    let at = |what: &str, advice: &str| {
        let first = if finding.count == 1 { "" } else { "the first " };
        format!("{}, {first}at {}{advice}", counted(finding.count, what), point(finding.place))
    };
    match finding.ailment {
        Ailment::OpenEdges => at("open edge", "; --repair, or thin_walled = true for a sheet"),
        Ailment::NonManifoldEdges => at("non-manifold edge", ""),
        Ailment::InconsistentEdges => at("inconsistent edge", "; --repair turns triangles to agree"),
        Ailment::InvertedShells => at("inverted shell", "; turned"),
        Ailment::SelfIntersections => at("self-intersection", "; unite what crosses, or part it"),
        Ailment::DuplicateFaces => at("duplicate face", "; --repair removes them"),
        Ailment::NestedShells => at("nested shell", "; a hollow looks inwards, a body wants an object of its own"),
        Ailment::ThinWalls => at(
            "thin wall",
            &format!(", {size} m at the thinnest; rays step over it: thicken it, or thin_walled = true"),
        ),
        Ailment::TooLarge => format!("{size} m large; lengths are metres: from millimetres, set scale = 0.001"),
        Ailment::TooSmall => format!("{size} m large; lengths are metres: from kilometres, set scale = 1000"),
    }
}

impl fmt::Display for ObjectRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = |ailment: &Ailment| match ailment {
            Ailment::SelfIntersections => "self-intersections",
            Ailment::NestedShells => "nested shells",
            Ailment::ThinWalls => "thin walls",
            _ => "faults",
        };
        let told = self.findings.iter().map(|finding| finding.says.clone());
        let rest = self.unfinished.iter().map(|ailment| format!("not all looked at for {}, too many", name(ailment)));
        write!(f, "  object {}, {}", self.object, self.mesh)?;
        told.chain(rest).try_for_each(|line| write!(f, "\n    {line}"))
    }
}

impl NestingRow {
    pub(super) fn new(scene: &Scene) -> Self {
        let (nests, complete) = scene.nests();
        let ranks = scene.ranks();
        Self { pairs: nests.iter().map(|nest| NestRow::new(scene, &ranks, nest)).collect(), complete }
    }
}

impl NestRow {
    fn new(scene: &Scene, ranks: &[u32], nest: &Nest) -> Self {
        let [a, b] = nest.objects;
        let winner = if ranks[a] > ranks[b] { a } else { b };
        let [first, second] = nest.objects.map(|object| label(scene, object));
        let because = match priority(scene, a).cmp(&priority(scene, b)) {
            Ordering::Equal => "of one priority, the smaller body",
            _ => "the higher priority",
        };
        let says = match nest.nesting {
            Nesting::Hollow => format!("{first} lies in a hollow of {second}"),
            Nesting::Inside if winner == a => {
                format!("{first} lies inside of {second} and is what is there: {because}")
            }
            Nesting::Inside => format!("{first} lies inside of {second}, which hides it: {because}"),
            Nesting::Overlaps => {
                format!("{first} overlaps {second} and is what is in both: {because}, at {}", point(nest.place))
            }
        };
        let number = |object: usize| scene.objects[object].number + 1;
        Self {
            nesting: nest.nesting,
            objects: nest.objects.map(number),
            there: (nest.nesting != Nesting::Hollow).then(|| number(winner)),
            place: nest.place.to_array(),
            says,
        }
    }
}

impl fmt::Display for NestingRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.pairs.is_empty() || !self.complete {
            f.write_str("\nWhat lies in what\n")?;
        }
        self.pairs.iter().take(MOST_PAIRS).try_for_each(|pair| writeln!(f, "  {}", pair.says))?;
        if self.pairs.len() > MOST_PAIRS {
            writeln!(f, "  and {} more", self.pairs.len() - MOST_PAIRS)?;
        }
        if self.complete { Ok(()) } else { f.write_str("  not all looked at, too many\n") }
    }
}

fn priority(scene: &Scene, object: usize) -> i32 {
    match &scene.materials[scene.objects[object].material].surface {
        Surface::Dielectric(glass) => glass.priority,
        Surface::Opaque(_) => 0,
    }
}

/// "water (object 2)"; of a file of several parts with the part's name.
fn label(scene: &Scene, object: usize) -> String {
    let own = &scene.objects[object];
    let (material, number) = (&scene.materials[own.material].name, own.number + 1);
    match scene.objects.iter().filter(|other| other.number == own.number).nth(1) {
        Some(_) => format!("{material} (object {number}, {})", scene.meshes[own.mesh].name),
        None => format!("{material} (object {number})"),
    }
}

/// Four digits of each coordinate.
fn point(place: DVec3) -> String {
    let [x, y, z] = place.to_array().map(figure);
    format!("({x}, {y}, {z})")
}

fn figure(x: f64) -> String {
    let rounded = format!("{x:.3e}");
    match rounded.parse::<f64>() {
        Ok(0.0) => "0".into(),
        Ok(x) if (1e-4..1e6).contains(&x.abs()) => x.to_string(),
        Ok(x) => format!("{x:e}"),
        Err(_) => rounded,
    }
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;
    use crate::scene::{Dielectric, Object, Overrides};

    #[test]
    fn figures_have_four_digits() {
        let told = [0.0, -0.0, 1.0, 0.123_456, -12_345.6, 1e-5, 2.5e7].map(figure);
        assert_eq!(told, ["0", "0", "1", "0.1235", "-12350", "1e-5", "2.5e7"]);
    }

    #[test]
    fn findings_say_how_often_where_and_what_to_do() {
        let place = DVec3::new(0.1, 0.0, -2.0);
        let says = |ailment, count, size| said(&Finding { ailment, count, place, triangle: None, size });
        assert_eq!(
            says(Ailment::OpenEdges, 12, None),
            "12 open edges, the first at (0.1, 0, -2); --repair, or thin_walled = true for a sheet"
        );
        assert_eq!(says(Ailment::InvertedShells, 1, None), "1 inverted shell, at (0.1, 0, -2); turned");
        let thin = "2 thin walls, the first at (0.1, 0, -2), 1.5e-6 m at the thinnest; rays step over it";
        assert!(says(Ailment::ThinWalls, 2, Some(1.5e-6)).starts_with(thin));
        assert!(says(Ailment::TooLarge, 1, Some(150.0)).starts_with("150 m large; lengths are metres"));
    }

    #[test]
    fn what_lies_in_what_names_materials_and_who_wins() {
        let mut scene = Scene::load(None, &Overrides::default()).expect("the built-in scene");
        let cup = scene.objects[2].clone();
        let mut water = scene.materials[0].clone();
        water.name = "water".into();
        scene.materials.push(water);
        let aside = DAffine3::from_translation(DVec3::new(0.002, 0.0, 0.0)) * cup.transform;
        let water = Object { number: 1, material: 1, transform: aside, ..cup.clone() };
        scene.objects = vec![Object { number: 0, ..cup }, water];
        let says = |scene: &Scene| NestingRow::new(scene).to_string();
        let told = says(&scene);
        assert!(told.starts_with("\nWhat lies in what\n  water (object 2) overlaps glass (object 1)"), "{told}");
        assert!(told.contains("what is in both: of one priority, the smaller body, at ("), "{told}");
        if let Surface::Dielectric(Dielectric { priority, .. }) = &mut scene.materials[0].surface {
            *priority = 1;
        }
        let told = says(&scene);
        assert!(
            told.contains("  glass (object 1) overlaps water (object 2) and is what is in both: the higher"),
            "{told}"
        );
        scene.objects[1].number = 0;
        let told = says(&scene);
        assert!(
            told.contains("  glass (object 1, cup_tumbler.obj) overlaps water (object 1, cup_tumbler.obj)"),
            "{told}"
        );
    }
}
