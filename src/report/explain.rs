//! What a scene asks of a renderer, and what each model makes of it: for a person and as JSON.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use serde::Serialize;

use super::objects::{NestingRow, ObjectRow};
use super::plan::PlanRow;
use crate::Result;
use crate::choice::Choice;
use crate::effects::{Caller, Effect};
use crate::options::{Model, RenderArgs, Size};
use crate::plan::Plan;
use crate::scene::{MeshFaults, Object, Scene, Surroundings, Touch};

/// Callers of an effect that are told one by one.
const MOST_CALLERS: usize = 5;

/// Runs of objects, and meshes, that are named one by one.
const MOST_NAMED: usize = 8;

/// Effects on a line.
const MOST_EFFECTS: usize = 7;

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
    pub objects: Vec<ObjectRow>,
    pub nesting: NestingRow,
    pub touching: Vec<TouchRow>,
    pub warnings: Vec<String>,
    pub plan: Option<PlanRow>,
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
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
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

/// Two objects with walls at one place, or one with itself.
#[derive(Clone, Debug, Serialize)]
#[allow(missing_docs, reason = "docs/explain.md describes the members")]
pub struct TouchRow {
    pub objects: [usize; 2],
    pub triangles: usize,
}

impl Explanation {
    /// Of `scene`, rendered with `options`.
    pub fn new(scene: &Scene, options: &RenderArgs) -> Result<Self> {
        let plan = |model: Model| {
            // Options that some models refuse have no part in what is told.
            let options =
                RenderArgs { model: Some(model.into()), effects: options.effects.clone(), ..RenderArgs::default() };
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
                objects: numbers(scene, |_| true).len(),
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
            objects: scene.diagnose().iter().map(|diagnosis| ObjectRow::new(scene, diagnosis)).collect(),
            nesting: NestingRow::new(scene),
            touching: scene.touching().iter().map(|touch| TouchRow::new(touch, scene)).collect(),
            warnings: scene.warnings.clone(),
            plan: None,
        })
    }

    /// The same with what `choice` found for a picture of `size` on a device.
    #[must_use]
    pub fn with_plan(self, device: &str, size: Size, choice: &Choice) -> Self {
        let plan = PlanRow::new(device, size, choice);
        Self { plan: Some(plan), ..self }
    }

    /// One object, readable and ended by a newline.
    pub fn json(&self) -> String {
        // Plain numbers, strings and lists: nothing that could fail.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }
}

impl EffectRow {
    fn new(effect: Effect, scene: &Scene, simulated: bool, plans: &[Plan]) -> Self {
        let mut because = Vec::new();
        for caller in effect.callers(scene) {
            let caller = Because::new(caller, scene);
            // The parts of an object share its number, and repeat each other.
            if !because.contains(&caller) {
                because.push(caller);
            }
            if because.len() > MOST_CALLERS {
                break;
            }
        }
        let more = because.len() > MOST_CALLERS;
        because.truncate(MOST_CALLERS);
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
            more,
            why_not: (!called_for).then(|| effect.absent()),
            needs: effect.needs().map(Effect::name),
            models: plans.iter().map(|plan| (plan.model.name(), treatment(plan))).collect(),
        }
    }

    /// Why it is called for, or why not, a line each.
    fn reasons(&self) -> Vec<String> {
        let more = self.more.then(|| "and more".into());
        self.because.iter().map(Because::to_string).chain(more).chain(self.why_not.map(Into::into)).collect()
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

impl TouchRow {
    fn new(touch: &Touch, scene: &Scene) -> Self {
        Self { objects: touch.objects.map(|object| number(scene, object)), triangles: touch.triangles }
    }
}

impl fmt::Display for TouchRow {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([a, b], triangles) = (self.objects, counted(self.triangles, "triangle"));
        match a == b {
            true => write!(f, "object {a}: {triangles} on others of it; keep them apart"),
            false => write!(
                f,
                "objects {a} and {b}: {triangles} of one on the other; overlap them and set priority, or part them"
            ),
        }
    }
}

/// "object 1", "objects 1, 2, 4 to 40", "objects 1, 3, 5, 7, 9, 11, 13, 15 and 12 more".
fn objects(numbers: &[usize]) -> String {
    let runs: Vec<_> = numbers.chunk_by(|a, b| a + 1 == *b).collect();
    let named = runs.iter().take(MOST_NAMED).map(|run| match run {
        [first, _, .., last] => format!("{first} to {last}"),
        few => few.iter().map(usize::to_string).collect::<Vec<_>>().join(", "),
    });
    let named = named.collect::<Vec<_>>().join(", ");
    let more = match runs.iter().skip(MOST_NAMED).map(|run| run.len()).sum() {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    format!("object{} {named}{more}", if numbers.len() == 1 { "" } else { "s" })
}

impl fmt::Display for Because {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Material { name, objects: numbers, why } => {
                write!(f, "material {name:?} of {}: {why}", objects(numbers))
            }
            Self::Light { number } => write!(f, "point light {number}"),
            Self::Parts { object } => write!(f, "object {object}: bodies in its mesh may overlap"),
            Self::Pair { objects: [a, b] } if a == b => write!(f, "object {a}: parts of it may overlap"),
            Self::Pair { objects: [a, b] } => write!(f, "objects {a} and {b} may overlap"),
            Self::Camera { object } => write!(f, "the camera may be in object {object}"),
        }
    }
}

/// Names in lines that start where the first one does, or that there are none.
fn listed(names: &[&str]) -> String {
    let lines: Vec<_> = names.chunks(MOST_EFFECTS).map(|names| names.join(", ")).collect();
    if lines.is_empty() { "nothing".into() } else { lines.join(&format!(",\n{:24}", "")) }
}

pub(super) fn counted(count: usize, one: &str) -> String {
    match count {
        0 => format!("no {one}s"),
        1 => format!("1 {one}"),
        _ => format!("{count} {one}s"),
    }
}

impl fmt::Display for Explanation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scene = &self.scene;
        let [objects, triangles, lights] =
            [(scene.objects, "object"), (scene.triangles, "triangle"), (scene.lights, "point light")]
                .map(|(count, one)| counted(count, one));
        let surroundings = match scene.environment {
            "image" => "an image as environment",
            _ => "a constant environment",
        };
        writeln!(f, "{}: {objects}, {triangles}, {lights}, {surroundings}", scene.name)?;

        for (title, called_for, wanted) in [
            ("Called for", true, true),
            ("Called for, but taken away", true, false),
            ("Not called for", false, false),
            ("Not called for, but wanted all the same", false, true),
        ] {
            let rows = || self.effects.iter().filter(|row| (row.called_for, row.wanted) == (called_for, wanted));
            if rows().next().is_some() {
                writeln!(f, "\n{title}")?;
            }
            let mut last = ("", Vec::new());
            for row in rows() {
                let mut reasons = row.reasons();
                if called_for && reasons == last.1 {
                    reasons = vec![format!("as for {}", last.0)];
                } else {
                    last = (row.name, reasons.clone());
                }
                for (i, reason) in reasons.iter().enumerate() {
                    writeln!(f, "  {:<21} {reason}", if i == 0 { row.name } else { "" })?;
                }
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
        let mut meshes: Vec<_> = self.meshes.iter().collect();
        meshes.sort_by_key(|mesh| mesh.faults.is_empty());
        for (i, mesh) in meshes.iter().take(MOST_NAMED).enumerate() {
            let title = if i == 0 { "\nMeshes\n" } else { "" };
            writeln!(f, "{title}  {}: {}; {}", mesh.name, counted(mesh.triangles, "triangle"), mesh.faults)?;
        }
        if meshes.len() > MOST_NAMED {
            writeln!(f, "  and {} more", meshes.len() - MOST_NAMED)?;
        }
        let ailing: Vec<_> = self.objects.iter().filter(|object| !object.is_well()).collect();
        for (i, object) in ailing.iter().take(MOST_NAMED).enumerate() {
            let title = if i == 0 { "\nWhat ails objects\n" } else { "" };
            writeln!(f, "{title}{object}")?;
        }
        if ailing.len() > MOST_NAMED {
            writeln!(f, "  and {} more", ailing.len() - MOST_NAMED)?;
        }
        write!(f, "{}", self.nesting)?;
        for (i, touch) in self.touching.iter().enumerate() {
            let title = if i == 0 { "\nWalls at one place\n" } else { "" };
            writeln!(f, "{title}  {touch}")?;
        }
        for (i, warning) in self.warnings.iter().enumerate() {
            let title = if i == 0 { "\nWarnings\n" } else { "" };
            writeln!(f, "{title}  {warning}")?;
        }
        self.plan.iter().try_for_each(|plan| plan.fmt(f))
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;
    use std::time::Duration;

    use glam::{DAffine3, DVec3};
    use serde_json::Value;

    use super::*;
    use crate::choice::{Candidate, Goal};
    use crate::scene::{Overrides, PointLight};

    /// Four bodies of one glass; the first and the third may overlap.
    fn built_in() -> Scene {
        Scene::load(None, &Overrides::default()).expect("the built-in scene")
    }

    fn lit(lights: usize) -> Scene {
        Scene { lights: vec![PointLight::new(DVec3::Y, DVec3::ONE); lights], ..built_in() }
    }

    fn explained(scene: &Scene, effects: &str) -> Explanation {
        let effects = Some(effects.parse().expect("a selection"));
        Explanation::new(scene, &RenderArgs { effects, ..RenderArgs::default() }).expect("an explanation")
    }

    fn row<'e>(explanation: &'e Explanation, effect: &str) -> &'e EffectRow {
        explanation.effects.iter().find(|row| row.name == effect).expect("a row")
    }

    fn model<'e>(explanation: &'e Explanation, model: &str) -> &'e ModelRow {
        explanation.models.iter().find(|row| row.name == model).expect("a row")
    }

    #[test]
    fn an_effect_that_is_taken_away_is_told_with_its_callers() {
        let explanation = explained(&built_in(), "auto,-nesting");
        let nesting = row(&explanation, "nesting");
        assert!(nesting.called_for && !nesting.wanted && nesting.why_not.is_none());
        assert_eq!(nesting.models["single"], Treatment::LeavesOut);
        assert_eq!(nesting.models["tree"], Treatment::Simulates);
        assert_eq!(model(&explanation, "single").leaves_out, ["interior"]);
        let wanted = "\nCalled for, but taken away\n  nesting               objects 1 and 3 may overlap\n\n";
        assert!(explanation.to_string().contains(wanted), "{explanation}");
    }

    #[test]
    fn an_effect_that_is_added_is_wanted_though_nothing_calls_for_it() {
        let explanation = explained(&built_in(), "auto,shadows");
        let shadows = row(&explanation, "shadows");
        assert!(!shadows.called_for && shadows.wanted && shadows.because.is_empty());
        assert!(model(&explanation, "path").simulates.contains(&"shadows"));
        let wanted = "\nNot called for, but wanted all the same\n  shadows               no point light shines";
        assert!(explanation.to_string().contains(wanted), "{explanation}");
    }

    #[test]
    fn models_tell_what_they_leave_out_approximate_and_cannot_see() {
        let explanation = explained(&lit(1), "auto");
        let single = model(&explanation, "single");
        assert_eq!(single.simulates, ["reflection", "transmission", "direct-light"]);
        assert_eq!(single.leaves_out, ["interior", "shadows", "nesting"]);
        assert_eq!(model(&explanation, "double").approximates, ["interior", "direct-light"]);
        assert_eq!(row(&explanation, "interior").models["double"], Treatment::Approximates);
        assert_eq!(row(&explanation, "interior").models["single"], Treatment::LeavesOut);
        assert_eq!(model(&explanation, "path").unseen.len(), 1);
        assert!(model(&explanation, "tree").unseen.is_empty());
        let text = explanation.to_string();
        for line in ["leaves out   interior, shadows, nesting\n", "cannot see   light of point lights through smooth"] {
            assert!(text.contains(line), "{text}");
        }
        assert!(!explained(&built_in(), "auto").to_string().contains("cannot see"));
    }

    #[test]
    fn more_than_five_callers_are_cut_and_equal_ones_told_once() {
        for (lights, more) in [(5, false), (6, true)] {
            let explanation = explained(&lit(lights), "auto");
            let direct = row(&explanation, "direct-light");
            assert_eq!((direct.because.len(), direct.more), (5, more));
            let text = explanation.to_string();
            assert_eq!(text.contains("point light 5\n                        and more\n"), more, "{text}");
            assert!(text.contains("  shadows               as for direct-light\n"), "{text}");
        }
        let mut scene = built_in();
        scene.objects = vec![scene.objects[0].clone(); 9];
        let explanation = explained(&scene, "auto");
        assert_eq!(row(&explanation, "nesting").because, [Because::Pair { objects: [1, 1] }]);
        assert_eq!(explanation.scene.objects, 1, "parts of one");
        assert!(explanation.to_string().contains("  nesting               object 1: parts of it may overlap\n"));
    }

    #[test]
    fn objects_and_counts_read_well() {
        assert_eq!(objects(&[3]), "object 3");
        assert_eq!(objects(&[1, 2]), "objects 1, 2");
        assert_eq!(objects(&[1, 2, 4, 5, 6, 9]), "objects 1, 2, 4 to 6, 9");
        let odd: Vec<_> = (1..40).step_by(2).collect();
        assert_eq!(objects(&odd), "objects 1, 3, 5, 7, 9, 11, 13, 15 and 12 more");
        assert_eq!([0, 1, 2].map(|count| counted(count, "object")), ["no objects", "1 object", "2 objects"]);
        let empty = explained(&Scene { objects: Vec::new(), meshes: Vec::new(), ..built_in() }, "auto").to_string();
        assert!(empty.starts_with("built-in: no objects, no triangles, no point lights, "), "{empty}");
        assert!(!empty.contains("\nCalled for") && !empty.contains("Meshes"), "{empty}");
        let all = explained(&built_in(), "all").to_string();
        assert!(all.lines().all(|line| line.len() <= 120), "{all}");
    }

    #[test]
    fn faulty_meshes_come_first_and_many_are_cut() {
        let mut scene = built_in();
        scene.meshes = vec![scene.meshes[0].clone(); 10];
        Arc::make_mut(&mut scene.meshes[9]).faults.open_edges = 2;
        let text = explained(&scene, "auto").to_string();
        assert!(text.contains("\nMeshes\n  teapot_body.obj: 25582 triangles; 2 open edges\n"), "{text}");
        assert!(text.contains("no faults\n  and 2 more\n"), "{text}");
    }

    /// Where `value` has members: `scene.name`, `effects[].name`.
    fn members(value: &Value, at: &str, found: &mut BTreeSet<String>) {
        match value {
            Value::Object(object) => {
                for (name, value) in object {
                    let at = if at.is_empty() { name.clone() } else { format!("{at}.{name}") };
                    members(value, &at, found);
                    found.insert(at);
                }
            }
            Value::Array(items) => items.iter().for_each(|item| members(item, &format!("{at}[]"), found)),
            _ => {}
        }
    }

    #[test]
    fn the_json_has_the_members_that_the_docs_name() {
        let mut scene = lit(1);
        Arc::make_mut(&mut scene.meshes[0]).overlaps = true;
        scene.camera.position = scene.bounds_of(&scene.objects[0]).center();
        // A body once more at its own place, and once more through its own walls, with a face that is there twice.
        scene.objects.push(scene.objects[2].clone());
        let aside = DAffine3::from_translation(DVec3::new(0.002, 0.0, 0.0)) * scene.objects[2].transform;
        scene.objects.push(Object { transform: aside, ..scene.objects[2].clone() });
        let twice = scene.meshes[2].triangles[0];
        Arc::make_mut(&mut scene.meshes[2]).triangles.push(twice);
        let args = RenderArgs::default();
        let best = Candidate { args, model: Model::Tree, samples: 4, ms: 10.0, error: 0.04, lacks: 0 };
        let goal = Goal { tolerance: Some(0.05), seconds: Some(1.0) };
        let others = vec![Candidate { samples: 9, ..best.clone() }];
        let choice = Choice { goal, best, others, is_expected: true, unmeasured: None, taken: Duration::ZERO };
        let explanation = explained(&scene, "auto").with_plan("a device", Size { width: 4, height: 3 }, &choice);
        let json: Value = serde_json::from_str(&explanation.json()).expect("JSON");
        assert_eq!(
            (&json["schema"], &json["scene"]["objects"]),
            (&1.into(), &4.into()),
            "an object counts by its number"
        );
        assert_eq!(json["effects"][0]["models"]["single"], "simulates");
        assert_eq!(json["effects"][2]["models"]["single"], "leaves-out");
        let mut found = BTreeSet::new();
        members(&json, "", &mut found);
        found.retain(|name| !name.starts_with("effects[].models.") && !name.starts_with("meshes[].faults."));
        let named = |section: &str| -> BTreeSet<String> {
            let rows = section.lines().filter_map(|line| line.strip_prefix("| `")?.split('|').next());
            rows.flat_map(|names| names.split('`').step_by(2)).map(Into::into).collect()
        };
        let (effects, json) = include_str!("../../docs/explain.md").split_once("## JSON").expect("sections");
        assert_eq!(found, named(json));
        assert_eq!(named(effects), Effect::all().map(|effect| effect.name().into()).collect());
    }
}
