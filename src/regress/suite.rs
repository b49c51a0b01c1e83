//! The suite file: pictures, and how close each is held to its reference. In flows TOML, out flows a [`Suite`]; what is wrong in it is an
//! error with file, line and what would be right.

use std::path::{Path, PathBuf};

use super::judge::{Limits, Measure};
use crate::options::{ModelChoice, RenderArgs};
use crate::scene::Files;
use crate::scene::render_table::options;
use crate::scene::table::{Document, Entry, Rule, Table, text};
use crate::{Error, Result};

/// The version of suite files and references that is read and written.
pub const SCHEMA: u32 = 1;

/// A file that says which pictures there are.
#[derive(Clone, Debug)]
pub struct Suite {
    /// The file.
    pub path: PathBuf,
    /// Of its content.
    pub hash: String,
    /// The folder of the references.
    pub references: PathBuf,
    /// The pictures, in the order of the file.
    pub pictures: Vec<Picture>,
    /// Drivers that differ, in the order of the file.
    pub drivers: Vec<Driver>,
    limits: ByKind,
}

/// A picture that is rendered and compared.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Its name, which those of its files begin with.
    pub name: String,
    /// The scene as the suite names it; `None`: the built-in one.
    pub scene: Option<PathBuf>,
    /// Options of the render.
    pub options: RenderArgs,
    /// What it is there for.
    pub why: String,
    limits: Option<Limits>,
}

/// Limits of pictures that are computed, and of those that are sampled at random.
#[derive(Clone, Debug, Default)]
struct ByKind {
    exact: Option<Limits>,
    random: Option<Limits>,
}

/// A driver whose pictures differ from those of the references more than others do.
#[derive(Clone, Debug)]
pub struct Driver {
    /// A part of what it or its device is called.
    pub name: String,
    /// Why it differs.
    pub why: String,
    /// Pictures that it is known to get wrong, and why.
    pub faults: Vec<Fault>,
    /// Pictures that may be further off there, the first that fits counts.
    allowances: Vec<Allowance>,
    limits: ByKind,
}

/// How far off some pictures may be on a driver.
#[derive(Clone, Debug)]
struct Allowance {
    /// Parts of their names.
    pictures: Vec<String>,
    limits: Limits,
}

/// A picture that a driver is known to get wrong.
#[derive(Clone, Debug)]
pub struct Fault {
    /// The picture.
    pub picture: String,
    /// What is wrong.
    pub why: String,
}

/// Not negative.
const LIMIT: Rule = Rule { wanted: "a number from 0", holds: |x| (0.0..f64::INFINITY).contains(&x) };

impl Suite {
    /// Reads the suite at `path`.
    pub fn load(path: &Path) -> Result<Self> {
        let bytes = Files::Disk.read(path)?;
        let document = Document { path, text: text(path, &bytes)? };
        let parsed = document.parse()?;
        let root = Table::root(document, &parsed, &["schema", "references", "render", "limits", "driver", "picture"])?;
        let schema = root.require("schema")?;
        if schema.integer()? != SCHEMA as i32 {
            return Err(schema.error(format!("schema: this program reads suites of schema {SCHEMA}")));
        }
        let folder = path.parent().unwrap_or(Path::new(""));
        let references = root.or("references", "references", |entry| entry.text("the name of a folder"))?;
        let common = root.or("render", RenderArgs::default(), |entry| options(entry, "render", Files::Disk, folder))?;
        let limits = root.or("limits", ByKind::default(), by_kind)?;
        let mut pictures: Vec<Picture> = Vec::new();
        for entry in root.require("picture")?.tables()? {
            let picture = Picture::read(entry, folder, &common)?;
            if pictures.iter().any(|before| before.name == picture.name) {
                return Err(entry.error(format!("two pictures have the name {:?}; give each its own", picture.name)));
            }
            pictures.push(picture);
        }
        let driver = |entry| Driver::read(entry, &pictures);
        let drivers = root.or("driver", Vec::new(), |entry| entry.tables()?.into_iter().map(driver).collect())?;
        if pictures.is_empty() {
            return Err(root.error("holds no [[picture]]; add one"));
        }
        let hash = format!("{:032x}", xxhash_rust::xxh3::xxh3_128(&bytes));
        Ok(Self { path: path.into(), hash, references: folder.join(references), pictures, drivers, limits })
    }

    /// The folder that paths in the suite start from.
    pub fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Where the reference of a picture is.
    pub fn reference(&self, picture: &Picture) -> PathBuf {
        self.references.join(format!("{}.exr", picture.name))
    }

    /// The driver that a device of this name and driver is, the first one in the file.
    pub fn driver(&self, device: &str, driver: &str) -> Option<&Driver> {
        self.drivers.iter().find(|known| device.contains(&known.name) || driver.contains(&known.name))
    }

    /// How close `picture` has to be on a driver: what is allowed of it there, else what the picture says, else what the driver says, else
    /// what the suite says.
    pub fn limits(&self, picture: &Picture, driver: Option<&Driver>, is_random: bool) -> Limits {
        let of = |kind: &ByKind| if is_random { kind.random.clone() } else { kind.exact.clone() };
        let fits = |allowance: &&Allowance| allowance.pictures.iter().any(|part| picture.name.contains(part));
        let allowed = driver.and_then(|driver| driver.allowances.iter().find(fits));
        let own = allowed.map(|allowance| allowance.limits.clone()).or_else(|| picture.limits.clone());
        own.or_else(|| driver.and_then(|driver| of(&driver.limits)))
            .or_else(|| of(&self.limits))
            .unwrap_or_else(|| Limits::default_of(is_random))
    }
}

impl Picture {
    fn read(entry: Entry<'_>, folder: &Path, common: &RenderArgs) -> Result<Self> {
        let table = entry.table("[picture]", &["name", "scene", "model", "options", "set", "limits", "why"])?;
        let name = table.require("name")?;
        let text = name.text("a name")?;
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
        if !text.chars().all(is_plain) || text.starts_with('.') {
            return Err(name.error(format!("name: {text:?} names files; use letters, digits, -, _ and .")));
        }
        let scene = table.get("scene").map(|entry| entry.file(Files::Disk, folder)).transpose()?;
        let model = table.get("model").map(|entry| {
            let option = RenderArgs::one("model", entry.text("the name of a model")?.as_ref());
            option.map_err(|message| entry.error(format!("model: {message}")))
        });
        let model = model.transpose()?.unwrap_or_default();
        let own = table.or("options", RenderArgs::default(), |entry| options(entry, "options", Files::Disk, folder))?;
        let set = table.get("set").map(|entry| entry.texts("settings, as in [\"material.glass.ior=1.7\"]"));
        let set = set.transpose()?.map(|settings| settings.into_iter().map(str::to_owned).collect());
        let options = RenderArgs { set, ..model.or(own).or(common.clone()) };
        let refused = [
            (options.model == Some(ModelChoice::Auto), "model auto, which chooses by the speed of the device"),
            (options.time_budget.is_some(), "a time budget, which depends on the speed of the device"),
            (options.checkpoint.is_some(), "a checkpoint, which goes on from another run"),
            (options.device.is_some(), "a device; --device is an option of regress"),
            (options.validation.is_some(), "validation; --validation is an option of regress"),
            (options.stats.is_some(), "a file of stats; regress writes its own"),
        ];
        if let Some((_, what)) = refused.iter().find(|(is, _)| *is) {
            return Err(table.error(format!("picture {text:?}: its options hold {what}; leave that out")));
        }
        let limits = table.get("limits").map(limits_of).transpose()?;
        let why = table.require("why")?.text("what the picture is there for")?;
        Ok(Self { name: text.into(), scene, options, why: why.into(), limits })
    }
}

impl Driver {
    fn read(entry: Entry<'_>, pictures: &[Picture]) -> Result<Self> {
        let table = entry.table("[driver]", &["name", "why", "limits", "allowance", "fault"])?;
        let name = table.require("name")?.text("a part of the name of a driver or device")?;
        let why = table.require("why")?.text("why it differs")?;
        let limits = table.or("limits", ByKind::default(), by_kind)?;
        let fault = |entry: Entry<'_>| -> Result<Fault> {
            let table = entry.table("[driver.fault]", &["picture", "why"])?;
            let picture = table.require("picture")?;
            let name = picture.text("the name of a picture")?;
            if !pictures.iter().any(|picture| picture.name == name) {
                return Err(picture.error(format!("picture: no picture has the name {name:?}")));
            }
            let why = table.require("why")?.text("what is wrong")?;
            Ok(Fault { picture: name.into(), why: why.into() })
        };
        let faults = table.or("fault", Vec::new(), |entry| entry.tables()?.into_iter().map(fault).collect())?;
        let allowance = |entry: Entry<'_>| -> Result<Allowance> {
            let table = entry.table("[driver.allowance]", &["pictures", "limits", "why"])?;
            let parts = table.require("pictures")?;
            let names = parts.texts("parts of the names of pictures, as in [\"double\"]")?;
            if let Some(part) = names.iter().find(|part| !pictures.iter().any(|picture| picture.name.contains(**part)))
            {
                return Err(parts.error(format!("pictures: no picture has {part:?} in its name")));
            }
            table.require("why")?.text("why they differ")?;
            let limits = limits_of(table.require("limits")?)?;
            Ok(Allowance { pictures: names.into_iter().map(str::to_owned).collect(), limits })
        };
        let allowances =
            table.or("allowance", Vec::new(), |entry| entry.tables()?.into_iter().map(allowance).collect())?;
        Ok(Self { name: name.into(), why: why.into(), faults, allowances, limits })
    }
}

fn by_kind(entry: Entry<'_>) -> Result<ByKind> {
    let table = entry.table("limits", &["exact", "random"])?;
    let of = |key| table.get(key).map(limits_of).transpose();
    Ok(ByKind { exact: of("exact")?, random: of("random")? })
}

fn limits_of(entry: Entry<'_>) -> Result<Limits> {
    let names: Vec<_> = Measure::limited().map(Measure::name).collect();
    let entries = entry.table("limits", &names)?.entries();
    if entries.is_empty() {
        return Err(entry.error(format!("{}: holds no limit; known: {}", entry.key, names.join(", "))));
    }
    let limit = |entry: Entry<'_>| Ok((Measure::named(entry.key), entry.number(&LIMIT)?));
    let pairs: Result<Vec<_>> = entries.into_iter().map(limit).collect();
    Ok(Limits::new(pairs?.into_iter().filter_map(|(measure, most)| Some((measure?, most))).collect()))
}

/// The suite that is meant where none is named.
pub fn default_suite() -> Result<PathBuf> {
    const PLACES: [&str; 2] = ["regress.toml", "tests/regress/suite.toml"];
    let found = PLACES.into_iter().map(PathBuf::from).find(|place| place.is_file());
    found.ok_or_else(|| {
        let places = PLACES.join(" nor ");
        Error::Usage(format!("regress: there is neither {places} here; name a suite, as in vitrum regress SUITE.toml"))
    })
}
