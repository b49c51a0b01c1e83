//! What a scene asks of a renderer, and what each model makes of it: for a person and as JSON.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::Serialize;

use crate::Result;
use crate::effects::{Caller, Effect};
use crate::options::{Model, RenderArgs};
use crate::plan::Plan;
use crate::scene::{MeshFaults, Object, Scene, Surroundings};

/// Callers of an effect that are told one by one.
const MOST_CALLERS: usize = 5;

/// Objects that are named one by one.
const MOST_OBJECTS: usize = 8;

/// The whole of it. docs/explain.md describes the members.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/explain.md describes the members")]
pub struct Explanation {
    pub schema: u32,
    pub vitrum: &'static str,
    pub scene: SceneSummary,
    pub effects: Vec<EffectRow>,
    pub models: Vec<ModelRow>,
    pub meshes: Vec<MeshRow>,
    pub warnings: Vec<String>,
}

/// How much there is of what.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/explain.md describes the members")]
pub struct SceneSummary {
    pub name: String,
    pub objects: usize,
    pub triangles: usize,
    pub materials: usize,
    pub lights: usize,
    pub environment: &'static str,
}

/// An effect, and what calls for it.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/explain.md describes the members")]
pub struct EffectRow {
    pub name: &'static str,
    pub called_for: bool,
    pub wanted: bool,
    pub because: Vec<Because>,
    pub more: bool,
    pub why_not: Option<&'static str>,
    pub needs: Option<&'static str>,
    pub models: BTreeMap<&'static str, Treatment>,
}

/// Something that calls for an effect: numbers count from 1, in the order of the scene file.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[allow(missing_docs, reason = "docs/explain.md describes the members")]
pub enum Because {
    Material { name: String, objects: Vec<usize>, why: String },
    Light { number: usize },
    Parts { object: usize },
    Pair { objects: [usize; 2] },
    Camera { object: usize },
}

/// What a model makes of an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs, reason = "the words say it")]
pub enum Treatment {
    Simulates,
    Approximates,
    LeavesOut,
}

/// A model, and what it makes of the effects that are wanted.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/explain.md describes the members")]
pub struct ModelRow {
    pub name: &'static str,
    pub simulates: Vec<&'static str>,
    pub approximates: Vec<&'static str>,
    pub leaves_out: Vec<&'static str>,
    pub unseen: Vec<&'static str>,
}

/// A mesh, and what is wrong with it.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/explain.md describes the members")]
pub struct MeshRow {
    pub name: String,
    pub triangles: usize,
    pub objects: Vec<usize>,
    pub closed: bool,
    pub faults: MeshFaults,
}

impl Explanation {
    /// Of `scene`, rendered with `options`.
    pub fn new(scene: &Scene, options: &RenderArgs) -> Result<Self> {
        let plan = |model| {
            // Options that some models refuse have no part in what is told.
            let options = RenderArgs { model: Some(model), effects: options.effects.clone(), ..RenderArgs::default() };
            Plan::new(scene, &options)
        };
        let plans = Model::ALL.into_iter().map(plan).collect::<Result<Vec<_>>>()?;
        let wanted = options.effects.clone().unwrap_or_default().resolve(scene);
        let row = |effect| EffectRow::new(effect, scene, wanted.contains(effect), &plans);
        Ok(Self {
            schema: 1,
            vitrum: env!("CARGO_PKG_VERSION"),
            scene: SceneSummary {
                name: scene.name.clone(),
                objects: scene.objects.len(),
                triangles: scene.objects.iter().map(|object| scene.meshes[object.mesh].triangles.len()).sum(),
                materials: scene.materials.len(),
                lights: scene.lights.len(),
                environment: match scene.environment.light {
                    Surroundings::Image(_) => "image",
                    Surroundings::Color(_) => "color",
                },
            },
            effects: Effect::all().map(row).collect(),
            models: plans.iter().map(ModelRow::new).collect(),
            meshes: (0..scene.meshes.len()).map(|mesh| MeshRow::new(scene, mesh)).collect(),
            warnings: scene.warnings.clone(),
        })
    }

    /// One object, readable and ended by a newline.
    pub fn json(&self) -> String {
        // Plain numbers, strings and lists: nothing that could fail.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

impl EffectRow {
    fn new(effect: Effect, scene: &Scene, simulated: bool, plans: &[Plan]) -> Self {
        let mut callers = effect.callers(scene);
        let because: Vec<_> = callers.by_ref().take(MOST_CALLERS).map(|caller| Because::new(caller, scene)).collect();
        let called_for = !because.is_empty();
        let treatment = |plan: &Plan| {
            let approximates = match simulated {
                true => plan.approximate.contains(effect),
                false => effect.approximated_by(plan.model, scene),
            };
            match effect.honoured_by(plan.model) {
                _ if approximates => Treatment::Approximates,
                true => Treatment::Simulates,
                false => Treatment::LeavesOut,
            }
        };
        Self {
            name: effect.name(),
            called_for,
            wanted: simulated,
            because,
            more: callers.next().is_some(),
            why_not: (!called_for).then(|| effect.absent()),
            needs: effect.needs().map(Effect::name),
            models: plans.iter().map(|plan| (plan.model.name(), treatment(plan))).collect(),
        }
    }
}

/// The number of an object as scene files count them.
fn number(scene: &Scene, object: usize) -> usize {
    scene.objects[object].number + 1
}

/// The numbers of the objects that this is true of, each once.
fn numbers(scene: &Scene, test: impl Fn(&Object) -> bool) -> Vec<usize> {
    let numbers: BTreeSet<_> = scene.objects.iter().filter(|o| test(o)).map(|object| object.number + 1).collect();
    numbers.into_iter().collect()
}

impl Because {
    fn new(caller: Caller, scene: &Scene) -> Self {
        match caller {
            Caller::Material { material, why } => Self::Material {
                name: scene.materials[material].name.clone(),
                objects: numbers(scene, |object| object.material == material),
                why,
            },
            Caller::Light(light) => Self::Light { number: light + 1 },
            Caller::Parts(object) => Self::Parts { object: number(scene, object) },
            Caller::Pair(a, b) => Self::Pair { objects: [number(scene, a), number(scene, b)] },
            Caller::Camera(object) => Self::Camera { object: number(scene, object) },
        }
    }
}

impl ModelRow {
    fn new(plan: &Plan) -> Self {
        let exact = |effect: &Effect| !plan.approximate.contains(*effect);
        Self {
            name: plan.model.name(),
            simulates: plan.effects.iter().filter(exact).map(Effect::name).collect(),
            approximates: plan.approximate.names(),
            leaves_out: plan.unsupported.names(),
            unseen: plan.unseen.clone(),
        }
    }
}

impl MeshRow {
    fn new(scene: &Scene, number: usize) -> Self {
        let mesh = &scene.meshes[number];
        Self {
            name: mesh.name.clone(),
            triangles: mesh.triangles.len(),
            objects: numbers(scene, |object| object.mesh == number),
            closed: mesh.faults.is_closed(),
            faults: mesh.faults,
        }
    }
}

/// "object 1", "objects 1, 2, 3", "objects 1, 2, ... 40 in all".
fn objects(numbers: &[usize]) -> String {
    let named: Vec<_> = numbers.iter().take(MOST_OBJECTS).map(usize::to_string).collect();
    let named = named.join(", ");
    match numbers.len() {
        1 => format!("object {named}"),
        count if count > MOST_OBJECTS => format!("objects {named}, ... {count} in all"),
        _ => format!("objects {named}"),
    }
}

impl fmt::Display for Because {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Material { name, objects: numbers, why } => write!(f, "{name:?} of {}: {why}", objects(numbers)),
            Self::Light { number } => write!(f, "light {number}"),
            Self::Parts { object } => write!(f, "object {object}: bodies in its mesh may overlap"),
            Self::Pair { objects: [a, b] } if a == b => write!(f, "object {a}: parts of it may overlap"),
            Self::Pair { objects: [a, b] } => write!(f, "objects {a} and {b} may overlap"),
            Self::Camera { object } => write!(f, "the camera may be in object {object}"),
        }
    }
}

/// Names, or a dash where there are none.
fn listed(names: &[&str]) -> String {
    if names.is_empty() { "-".into() } else { names.join(", ") }
}

fn counted(count: usize, one: &str) -> String {
    if count == 1 { format!("1 {one}") } else { format!("{count} {one}s") }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scene = &self.scene;
        let [objects, triangles, lights] =
            [(scene.objects, "object"), (scene.triangles, "triangle"), (scene.lights, "point light")]
                .map(|(count, one)| counted(count, one));
        let surroundings = match scene.environment {
            "image" => "an image around it",
            _ => "a constant environment",
        };
        writeln!(f, "{}: {objects}, {triangles}, {lights}, {surroundings}", scene.name)?;

        writeln!(f, "\nCalled for")?;
        for row in self.effects.iter().filter(|row| row.called_for) {
            let off = if row.wanted { "" } else { " (taken away)" };
            let mut name = format!("{}{off}", row.name);
            for because in &row.because {
                writeln!(f, "  {name:<21} {because}")?;
                name.clear();
            }
            if row.more {
                writeln!(f, "  {:<21} and more", "")?;
            }
        }
        writeln!(f, "\nNot called for")?;
        for row in self.effects.iter() {
            if let Some(why) = row.why_not {
                let on = if row.wanted { "; simulated all the same" } else { "" };
                writeln!(f, "  {:<21} {why}{on}", row.name)?;
            }
        }
        writeln!(f, "\nModels")?;
        for model in &self.models {
            writeln!(f, "  {:<8} simulates    {}", model.name, listed(&model.simulates))?;
            for (what, names) in [("approximates", &model.approximates), ("leaves out", &model.leaves_out)] {
                if !names.is_empty() {
                    writeln!(f, "  {:<8} {what:<12} {}", "", listed(names))?;
                }
            }
            for unseen in &model.unseen {
                writeln!(f, "  {:<8} cannot see   {unseen}", "")?;
            }
        }
        writeln!(f, "\nMeshes")?;
        for mesh in &self.meshes {
            writeln!(f, "  {}: {}; {}", mesh.name, counted(mesh.triangles, "triangle"), mesh.faults)?;
        }
        for (i, warning) in self.warnings.iter().enumerate() {
            let title = if i == 0 { "\nWarnings\n" } else { "" };
            writeln!(f, "{title}  {warning}")?;
        }
        Ok(())
    }
}
