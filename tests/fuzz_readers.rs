//! Hostile files: whatever the scene, OBJ, MTL, glTF and image readers are given, they answer with a value or an error, in
//! little time and memory, and never panic.
//!
//! Cases are valid seeds, mutated. Short by default; `VITRUM_FUZZ_SECONDS` sets the length of each test. A failure
//! leaves the case in a file and prints its name.

#[allow(dead_code, reason = "each test program uses its share")]
#[path = "common/gltf.rs"]
mod gltf;
#[allow(dead_code, reason = "each test program uses its share")]
#[path = "tree/shapes.rs"]
mod shapes;

use std::fs;
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use vitrum::scene::{Mesh, Overrides, Scene, Texels, Texture};

/// The longest that one case may take.
const SLOWEST: Duration = Duration::from_secs(2);

/// The most memory, in KiB, that all cases together may have held at any time.
const LARGEST_KIB: u64 = 1 << 20;

/// SplitMix64 (Steele et al. 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end.max(1) as u64) as usize
    }

    fn one_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    fn pick<'a, T>(&mut self, from: &'a [T]) -> &'a T {
        &from[self.below(from.len())]
    }

    /// A part of `bytes`, short ones more often.
    fn range(&mut self, bytes: &[u8]) -> std::ops::Range<usize> {
        let longest = if self.one_in(4) { bytes.len() } else { 16 };
        let start = self.below(bytes.len() + 1);
        start..(start + self.below(longest + 1)).min(bytes.len())
    }
}

/// Mutates binary or text bytes, several times.
fn mutated(random: &mut Random, seed: &[u8], others: &[Vec<u8>]) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..1 + random.below(4) {
        let at = random.below(bytes.len());
        match random.below(8) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
            1 if !bytes.is_empty() => bytes[at] = random.next() as u8,
            2 => bytes.truncate(at),
            3 if !others.is_empty() => {
                let other = random.pick(others).clone();
                let (from, to) = (random.range(&other), random.range(&bytes));
                bytes.splice(to, other[from].iter().copied());
            }
            4 => {
                let range = random.range(&bytes);
                let copy = bytes[range].to_vec();
                bytes.splice(at..at, copy);
            }
            5 => {
                let range = random.range(&bytes);
                bytes.drain(range);
            }
            _ => {
                let number =
                    *random.pick(&[0, 1, -1, 2, 255, 16384, 16385, 65536, 100_000, i32::MAX, i32::MIN, 0x7fc0_0000]);
                let word = if random.one_in(2) { number.to_le_bytes() } else { number.to_be_bytes() };
                for (byte, new) in bytes.iter_mut().skip(at).zip(word) {
                    *byte = new;
                }
            }
        }
    }
    bytes
}

const HOSTILE_WORDS: [&str; 30] = [
    "nan",
    "inf",
    "-inf",
    "-1",
    "0",
    "-0",
    "1e39",
    "-1e39",
    "1e-46",
    "1e999",
    "99999999999",
    "-99999999999",
    "9223372036854775807",
    "-9223372036854775808",
    "99999999999999999999999",
    "4294967296",
    "1/2/3/4",
    "//",
    "1//",
    "/1",
    "\"\"",
    "[",
    "]",
    "\\",
    "#",
    "\u{a0}",
    "\u{feff}",
    "f",
    "v",
    "1e9",
];

/// Mutates text by words and lines, or as bytes.
fn mutated_text(random: &mut Random, seed: &[u8], others: &[Vec<u8>]) -> Vec<u8> {
    if random.one_in(3) {
        return mutated(random, seed, others);
    }
    let text = String::from_utf8_lossy(seed);
    let mut lines: Vec<Vec<String>> = text
        .lines()
        .map(|line| line.split_inclusive([' ', ',', '[', ']', '/', '=']).map(str::to_owned).collect())
        .collect();
    for _ in 0..1 + random.below(5) {
        let at = random.below(lines.len());
        match random.below(7) {
            0 => {
                let line = lines[at].clone();
                lines.insert(random.below(lines.len() + 1), line);
            }
            1 if lines.len() > 1 => drop(lines.remove(at)),
            2 => {
                let other = random.below(lines.len());
                lines.swap(at, other);
            }
            3 if !lines[at].is_empty() => {
                let word = random.below(lines[at].len());
                lines[at].truncate(word);
            }
            4 => lines[at].push(format!(" {}", random.pick(&HOSTILE_WORDS))),
            _ if !lines[at].is_empty() => {
                let word = random.below(lines[at].len());
                let end = lines[at][word].chars().last().filter(|c| " ,[]/=".contains(*c));
                lines[at][word] = random.pick(&HOSTILE_WORDS).to_string() + &end.map(String::from).unwrap_or_default();
            }
            _ => {}
        }
    }
    let end = if random.one_in(8) { "\r\n" } else { "\n" };
    lines.into_iter().map(|line| line.concat() + end).collect::<String>().into_bytes()
}

/// Runs `case` with mutations until the time is up, and says how many there were.
fn fuzz(name: &str, mut make: impl FnMut(&mut Random) -> Vec<u8>, mut case: impl FnMut(&[u8]) -> bool) {
    let setting = std::env::var("VITRUM_FUZZ_SECONDS").ok().and_then(|seconds| seconds.parse().ok());
    let length = Duration::from_secs_f64(setting.unwrap_or(2.0));
    // Short runs repeat each other, long ones differ.
    let seed = if setting.is_some() { std::time::UNIX_EPOCH.elapsed().unwrap().as_nanos() as u64 } else { 0 };
    let mut random = Random(seed);
    let (start, mut cases, mut good, mut slowest) = (Instant::now(), 0_u64, 0_u64, Duration::ZERO);
    while start.elapsed() < length {
        let bytes = make(&mut random);
        let before = Instant::now();
        let outcome = catch_unwind(AssertUnwindSafe(|| case(&bytes)));
        let took = before.elapsed();
        slowest = slowest.max(took);
        if outcome.is_err() || took > SLOWEST {
            let file = std::env::temp_dir().join(format!("vitrum-fuzz-{name}-{cases}"));
            fs::write(&file, &bytes).unwrap();
            panic!("{name}: case {cases} of seed {seed} panicked or took {took:?}; it is in {}", file.display());
        }
        good += u64::from(outcome.unwrap_or(false));
        cases += 1;
    }
    println!(
        "{name}: {cases} cases, {good} of them read, the slowest took {slowest:?}, at most {} KiB held",
        peak_kib()
    );
    assert!(peak_kib() < LARGEST_KIB, "{name}, or a test beside it, held {} KiB", peak_kib());
    assert!(good > 0, "{name}: no mutation was read, so none got far");
}

/// The most memory this process has held; 0 where the system does not say.
fn peak_kib() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    peak.and_then(|rest| rest.trim().trim_end_matches(" kB").parse().ok()).unwrap_or(0)
}

const OBJ: &str = "mtllib fuzz.mtl\no body\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1 1.0\nv 1 1 1 0.5 0.5 0.5\n\
    v -1 1 1\nvt 0 0\nvt 1 0 0\nvn 0 0 -1\nvn 0 0 1\nusemtl glass\ng front\ns 1\nf 1//1 4//1 3//1 2//1\nf -4//2 -3//2 -2//2 -1//2\n\
    usemtl red\nf 1/1 2/2 6/1 5/2\nf 2 3 7 6\no rest\nf 3/1/1 4/2/1 8/1/2 \\\n7/2/2\nf 4 1 5 8\nl 1 2 3\np 1\n# end\n";

const MTL: &str = "newmtl glass\nillum 7\nNi 1.5\nd 0.5\nTr 0.5\nTf 1 0.9 0.8\nPr 0.1\nKd 0 0 0\n\nnewmtl red\nKd 1 0 0\nKs 1 1 1\n\
    Ke 0 0 1\nNs 100\nPm 0.5\nillum 2\nmap_Kd -s 1 1 1 -o 0 0 tex.png\nmap_Bump -bm 0.5 tex.png\n\
    map_d tex.png\nmap_Ke tex.png\nnorm tex.png\nmap_Pr -imfchan g tex.png\nmap_Pm -clamp on -mm 0 1 tex.png\nmap_Ks tex.png\n";

const TOML: &str = "[environment]\ncolor = [1, 1, 1]\nintensity = 1.0\nrotation = 0.0\nvisible = true\n\n[camera]\n\
    position = [0.0, 0.25, 0.9]\ntarget = [0.0, 0.1, 0.0]\nup = [0.0, 1.0, 0.0]\nvertical_fov = 35.0\n\n[render]\n\
    size = [1024, 768]\nsamples = 4\nmodel = \"tree\"\neffects = \"auto,-nesting\"\naov = [\"normal\", \"depth\"]\n\n\
    [[light]]\nkind = \"point\"\nposition = [1.0, 2.0, 1.0]\nintensity = [10, 10, 10]\n\n[[light]]\nkind = \"spot\"\n\
    position = [1, 2, 1]\nintensity = [1, 2, 3]\ndirection = [0, -1, 0.5]\ninner_cone_angle = 10\nouter_cone_angle = 20.5\n\n\
    [[light]]\nkind = \"directional\"\ndirection = [0, -1, 0]\nirradiance = [3, 2, 1]\n\n[material.glass]\n\
    kind = \"dielectric\"\nior = \"bk7\"\nroughness = 0.01\ndispersion = 0.0\nattenuation_color = [1, 1, 1]\n\
    attenuation_distance = inf\nthin_walled = false\npriority = 0\n\n[material.table]\nkind = \"opaque\"\n\
    base_color = [0.8, 0.8, 0.8]\nmetallic = 0.0\nroughness = 1.0\nspecular = 1.0\nemission = [0, 0, 0]\n\n[[object]]\n\
    mesh = \"fuzz.obj\"\nmaterial = \"glass\"\ntranslate = [0, 0, 0]\nrotate = [0, 0, 0]\nscale = [1.0, 2, 3]\nsmooth = true\n";

const SHOW: &str = "[environment]\ncolor = [1, 1, 1]\n[[object]]\nmesh = \"fuzz.obj\"\n";

struct Folder {
    folder: tempfile::TempDir,
    scene: PathBuf,
}

impl Folder {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("scene.toml");
        let files = Self { folder, scene };
        files.write("fuzz.obj", OBJ.as_bytes());
        files.write("fuzz.mtl", MTL.as_bytes());
        files.write("scene.toml", SHOW.as_bytes());
        image::RgbImage::from_pixel(2, 1, image::Rgb([255, 0, 188])).save(files.folder.path().join("tex.png")).unwrap();
        files
    }

    fn write(&self, name: &str, content: &[u8]) {
        fs::write(self.folder.path().join(name), content).unwrap();
    }

    /// Whether the scene can be read; what it holds must be sound.
    fn load(&self) -> bool {
        loads(&self.scene)
    }
}

fn loads(scene: &Path) -> bool {
    match Scene::load(Some(scene), &Overrides::default()) {
        Ok(scene) => {
            check(&scene);
            true
        }
        Err(error) => {
            assert_eq!(error.exit_code(), 2);
            assert!(!error.to_string().contains('\n'), "{error}");
            false
        }
    }
}

/// What a renderer relies on.
fn check(scene: &Scene) {
    for mesh in &scene.meshes {
        assert!(!mesh.triangles.is_empty());
        assert!(mesh.positions.iter().flatten().all(|x| x.is_finite()));
        assert!(mesh.normals.is_empty() || mesh.normals.len() == mesh.positions.len());
        let unit = |[x, y, z]: &[f32; 3]| (x * x + y * y + z * z - 1.0).abs() < 1e-5;
        assert!(mesh.normals.iter().all(unit));
        assert!(mesh.uvs.is_empty() || mesh.uvs.len() == mesh.positions.len());
        assert!(mesh.uvs.iter().flatten().all(|x| x.is_finite()));
        assert!(mesh.triangles.iter().flatten().all(|&vertex| (vertex as usize) < mesh.positions.len()));
    }
    for material in &scene.materials {
        assert!(material.maps().iter().all(|map| map.texture < scene.textures.len()));
    }
    for light in &scene.lights {
        assert!(light.position.is_finite() && light.intensity.is_finite() && light.intensity.min_element() >= 0.0);
    }
    for texture in &scene.textures {
        let Texture { width, height, texels, .. } = texture.as_ref();
        let count = match texels {
            Texels::Srgb(texels) | Texels::Unorm(texels) => texels.len(),
            Texels::Linear(texels) => texels.len(),
        };
        assert_eq!(count, *width as usize * *height as usize);
    }
    for object in &scene.objects {
        assert!(object.mesh < scene.meshes.len() && object.material < scene.materials.len());
        assert!(scene.bounds_of(object).reach() <= 1e9);
    }
    let camera = scene.camera;
    assert!(camera.position.is_finite() && camera.target.is_finite() && camera.up.is_finite());
    assert!(camera.position != camera.target);
}

#[test]
fn obj_files() {
    let folder = Folder::new();
    let seeds = [OBJ.as_bytes().to_vec(), MTL.as_bytes().to_vec()];
    fuzz(
        "obj",
        |random| mutated_text(random, &seeds[0], &seeds),
        |bytes| {
            folder.write("fuzz.obj", bytes);
            folder.load()
        },
    );
}

/// A model with something of everything that is read.
fn model() -> gltf::Model {
    let mut model = gltf::Model::new();
    let mut png = Cursor::new(Vec::new());
    image::RgbImage::from_pixel(2, 1, image::Rgb([255, 0, 188])).write_to(&mut png, image::ImageFormat::Png).unwrap();
    let view = model.view(&png.into_inner());
    model.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
    model.push("textures", json!({ "source": 0 }));
    let transform = json!({ "offset": [0.5, 0.5], "rotation": 0.5, "scale": [2, 2] });
    model.push(
        "materials",
        json!({ "name": "wood", "emissiveFactor": [1, 1, 1], "emissiveTexture": { "index": 0 }, "alphaMode": "MASK",
        "normalTexture": { "index": 0, "scale": 0.5, "extensions": { "KHR_texture_transform": { "rotation": 1 } } },
        "pbrMetallicRoughness": { "metallicRoughnessTexture": { "index": 0, "texCoord": 1 },
        "baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0, "roughnessFactor": 0.5, "baseColorTexture": {
            "index": 0, "extensions": { "KHR_texture_transform": transform } } } }),
    );
    model.push(
        "materials",
        json!({ "name": "glass", "alphaMode": "BLEND", "pbrMetallicRoughness": { "metallicFactor": 0 }, "extensions": {
        "KHR_materials_transmission": { "transmissionFactor": 1, "transmissionTexture": { "index": 0 } }, "KHR_materials_ior": { "ior": 1.5 },
        "KHR_materials_volume": { "thicknessFactor": 1, "attenuationColor": [1, 0.5, 0.5], "attenuationDistance": 1 },
        "KHR_materials_dispersion": { "dispersion": 0.5 } } }),
    );
    let quad = shapes::rectangle(2.0, 2.0);
    let quad = Mesh { uvs: vec![[0.0, 1.0]; quad.positions.len()], ..quad };
    let primitives = [model.primitive(&quad, Some(0)), model.primitive(&shapes::icosphere(0), Some(1))];
    let mesh = model.mesh(&primitives);
    let places = model.view(&[0, 1]);
    let values = model.view(&[0; 24]);
    let sparse = json!({ "componentType": gltf::F32, "type": "VEC3", "count": 4, "min": [0, 0, 0], "max": [1, 1, 1],
        "sparse": { "count": 2, "indices": { "bufferView": places, "componentType": gltf::U8 },
            "values": { "bufferView": values } } });
    let positions = model.push("accessors", sparse);
    let strip = model.mesh(&[json!({ "attributes": { "POSITION": positions }, "mode": 5 })]);
    model.push("cameras", json!({ "type": "perspective", "perspective": { "yfov": 0.6, "znear": 0.1 } }));
    model.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "point", "intensity": 8 },
        { "type": "spot", "spot": { "innerConeAngle": 0.1, "outerConeAngle": 0.5 } }, { "type": "directional" }] } });
    let inner =
        model.push("nodes", json!({ "mesh": mesh, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1] }));
    model.node(json!({ "children": [inner], "translation": [1, 0, 0], "rotation": [0, 0, 0, 1], "scale": [1, 2, 1] }));
    model.node(json!({ "camera": 0, "translation": [0, 0, 5] }));
    for light in 0..3 {
        model.node(json!({ "mesh": strip, "extensions": { "KHR_lights_punctual": { "light": light } } }));
    }
    model
}

/// Puts hostile values in the place of some, and leaves it well formed.
fn mutate_json(random: &mut Random, value: &mut Value) {
    let count = match value {
        Value::Object(members) => members.len(),
        Value::Array(list) => list.len(),
        _ => 0,
    };
    let place = random.below(count);
    let inner = match value {
        Value::Object(members) => members.values_mut().nth(place),
        Value::Array(list) => list.get_mut(place),
        _ => None,
    };
    match inner {
        Some(inner) if !random.one_in(12) => mutate_json(random, inner),
        _ => match (random.below(4), &mut *value) {
            (0, Value::Array(list)) if !list.is_empty() => list.push(list[place].clone()),
            (1, Value::Array(list)) => drop(list.pop()),
            (2, Value::Object(members)) => {
                let key = members.keys().nth(place).cloned();
                drop(key.and_then(|key| members.remove(&key)));
            }
            _ => {
                let hostile = [
                    json!(0),
                    json!(1),
                    json!(2),
                    json!(3),
                    json!(5),
                    json!(-1),
                    json!(0.5),
                    json!(1e-40),
                    json!(1e39),
                    json!(-1e30),
                    json!(u32::MAX),
                    json!(u64::MAX),
                    json!(5121),
                    json!(5123),
                    json!(""),
                    json!("VEC2"),
                    json!("data:,"),
                    json!([]),
                    json!({}),
                    json!(null),
                ];
                *value = random.pick(&hostile).clone();
            }
        },
    }
}

#[test]
fn gltf_files() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("fuzz.gltf");
    // One value a line, for what swaps lines and words.
    let text: serde_json::Value = serde_json::from_str(&model().embedded()).unwrap();
    let text = serde_json::to_string_pretty(&text).unwrap().replace(": ", " : ").into_bytes();
    let binary = model().glb();
    let seeds = [text, binary];
    let make = |random: &mut Random| match random.below(4) {
        0 => mutated_text(random, &seeds[0], &seeds[..1]),
        1 => mutated(random, &seeds[1], &seeds),
        _ => {
            let mut changed = model();
            for _ in 0..1 + random.below(3) {
                mutate_json(random, &mut changed.json);
            }
            if random.one_in(4) {
                changed.buffer = mutated(random, &changed.buffer, &[]);
            }
            changed.glb()
        }
    };
    fuzz("gltf", make, |bytes| {
        fs::write(&scene, bytes).unwrap();
        loads(&scene)
    });
}

#[test]
fn mtl_files() {
    let folder = Folder::new();
    let seeds = [MTL.as_bytes().to_vec(), OBJ.as_bytes().to_vec()];
    fuzz(
        "mtl",
        |random| mutated_text(random, &seeds[0], &seeds),
        |bytes| {
            folder.write("fuzz.mtl", bytes);
            folder.load()
        },
    );
}

#[test]
fn scene_files() {
    let folder = Folder::new();
    let seeds = [TOML.as_bytes().to_vec(), SHOW.as_bytes().to_vec()];
    let make = |random: &mut Random| match random.one_in(2) {
        true => mutated_text(random, &seeds[0], &seeds),
        false => generated_scene(random).into_bytes(),
    };
    fuzz("toml", make, |bytes| {
        folder.write("scene.toml", bytes);
        folder.load()
    });
}

/// TOML that is well formed and mostly makes sense.
fn generated_scene(random: &mut Random) -> String {
    const KEYS: [&[&str]; 6] = [
        &["color", "intensity", "rotation", "visible", "image"],
        &["position", "target", "up", "vertical_fov"],
        &["kind", "position", "intensity"],
        &[
            "kind",
            "ior",
            "roughness",
            "dispersion",
            "attenuation_color",
            "attenuation_distance",
            "thin_walled",
            "priority",
            "transmission",
            "transmission_texture",
            "normal_texture",
            "normal_scale",
        ],
        &[
            "kind",
            "base_color",
            "metallic",
            "roughness",
            "specular",
            "emission",
            "base_color_texture",
            "metallic_roughness_texture",
            "emission_texture",
            "alpha_cutoff",
        ],
        &["mesh", "material", "translate", "rotate", "scale", "smooth"],
    ];
    const HEADERS: [&str; 6] = ["[environment]", "[camera]", "[[light]]", "[material.a]", "[material.b]", "[[object]]"];
    const RENDER: [&str; 8] = ["model", "size", "samples", "tolerance", "ior", "env", "aov", "effects"];
    let mut text = String::new();
    for (header, keys) in HEADERS.iter().zip(KEYS) {
        let repeat = if header.starts_with("[[") { random.below(3) } else { usize::from(!random.one_in(3)) };
        for _ in 0..repeat {
            text += &format!("{header}\n");
            for key in keys {
                // What is required is rarely left out; a file that does not exist is rarely named, nor a texture, which
                // must not stand beside a colour.
                let required = ["kind", "mesh", "position", "target", "color"].contains(key);
                let rare = ["image", "base_color_texture"].contains(key);
                if random.one_in(if required { 40 } else { 3 }) || rare && !random.one_in(40) {
                    continue;
                }
                text += &format!(
                    "{key} = {}\n",
                    if random.one_in(60) { value(random) } else { fitting(random, key, header) }
                );
            }
        }
    }
    if random.one_in(3) {
        let key = *random.pick(&RENDER);
        text += &format!("[render]\n{key} = {}\n", value(random));
    }
    text
}

fn fitting(random: &mut Random, key: &str, header: &str) -> String {
    let number =
        |random: &mut Random| (*random.pick(&["0", "1", "0.5", "0.25", "1e-3", "1e-9", "1.0", "0x1"])).to_owned();
    match key {
        "kind" => (*random.pick(match header {
            "[[light]]" => &["\"point\""],
            "[material.a]" => &["\"dielectric\""],
            _ => &["\"opaque\""],
        }))
        .to_owned(),
        "visible" | "smooth" | "thin_walled" => (*random.pick(&["true", "false"])).to_owned(),
        "mesh" => "\"fuzz.obj\"".into(),
        "material" => (*random.pick(&["\"a\"", "\"b\""])).to_owned(),
        "ior" if random.one_in(2) => "\"water\"".into(),
        "attenuation_distance" => (*random.pick(&["inf", "+inf", "0.1"])).to_owned(),
        "vertical_fov" => "35".into(),
        "position" if header == "[camera]" => "[0, 3, 5]".into(),
        "intensity" if header == "[[light]]" => "[1, 2, 3]".into(),
        "scale" if random.one_in(2) => "-2".into(),
        "position" | "target" | "up" | "color" | "base_color" | "emission" | "attenuation_color" | "translate"
        | "rotate" | "scale" => format!("[{}, {}, {}]", number(random), number(random), number(random)),
        "image" => "\"none.png\"".into(),
        "transmission" | "alpha_cutoff" => "0.5".into(),
        "normal_scale" => "2".into(),
        texture if texture.ends_with("_texture") => "\"tex.png\"".into(),
        _ => number(random),
    }
}

/// Any value of any type.
fn value(random: &mut Random) -> String {
    match random.below(10) {
        0 => format!("{}", random.next() as i64),
        1 => format!("{:e}", f64::from_bits(random.next())).replace("NaN", "nan"),
        2 => (*random.pick(&["nan", "inf", "-inf", "-0.0", "1e308", "1e39", "0o17", "0b1", "99999999999", "-1"]))
            .to_owned(),
        3 => "\"\\u0000\\n\"".into(),
        4 => format!("\"{}\"", random.pick(&["fuzz.obj", "..", "/", "/dev/zero", "", "a", "fuzz.mtl", "scene.toml"])),
        5 => "1979-05-27T07:32:00Z".into(),
        6 => "{ a = 1, b = { c = [] } }".into(),
        7 => format!("[{}]", (0..random.below(5)).map(|_| value(random)).collect::<Vec<_>>().join(", ")),
        8 => (*random.pick(&["true", "false"])).to_owned(),
        _ => format!("[{}{}]", "[".repeat(random.below(200)), "]".repeat(random.below(200))),
    }
}

/// Small images of every kind that is read.
fn images() -> Vec<Vec<u8>> {
    use exr::prelude::*;
    use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, LumaA, Rgb, Rgba};
    let mut images = Vec::new();
    let compressions = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
        Compression::PXR24,
        Compression::B44,
        Compression::B44A,
        Compression::DWAA(None),
        Compression::DWAB(Some(200.0)),
    ];
    for (number, compression) in compressions.into_iter().enumerate() {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(8, 4))] {
            let size = 20 * 9;
            let channel = |name| {
                let value = |i: usize| (i as f32 * 0.37).sin() - 0.2;
                let samples = match number % 2 {
                    0 => FlatSamples::F32((0..size).map(value).collect()),
                    _ => FlatSamples::F16((0..size).map(value).map(f16::from_f32).collect()),
                };
                AnyChannel::new(name, samples)
            };
            let names: &[&str] = if number == 3 { &["Y"] } else { &["R", "G", "B", "A"] };
            let channels = AnyChannels::sort(names.iter().copied().map(channel).collect());
            let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
            let layer = Layer::new((20, 9), LayerAttributes::default(), encoding, channels);
            let mut bytes = Cursor::new(Vec::new());
            Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
            images.push(bytes.into_inner());
        }
    }
    let mut add = |image: DynamicImage, format| {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        images.push(bytes.into_inner());
    };
    let shade = |x: u32, y: u32| (x * 13 + y * 29) as u8;
    add(ImageBuffer::from_fn(20, 9, |x, y| Rgb([shade(x, y), 7, 200])).into(), ImageFormat::Png);
    add(ImageBuffer::from_fn(20, 9, |x, y| Rgba([shade(x, y) as u16 * 257, 7, 200, 9])).into(), ImageFormat::Png);
    add(ImageBuffer::from_fn(20, 9, |x, y| LumaA([shade(x, y), 9])).into(), ImageFormat::Png);
    add(ImageBuffer::from_fn(20, 9, |x, y| Luma([shade(x, y) as u16])).into(), ImageFormat::Png);
    add(ImageBuffer::from_fn(20, 9, |x, y| Rgb([shade(x, y), 7, 200])).into(), ImageFormat::Jpeg);
    add(ImageBuffer::from_fn(20, 9, |x, y| Luma([shade(x, y)])).into(), ImageFormat::Jpeg);
    add(ImageBuffer::from_fn(20, 9, |x, y| Rgb([shade(x, y) as f32, 0.1, 9.0])).into(), ImageFormat::Hdr);
    images
}

/// Gives the chunks of a mutated PNG their checksums back, so that it is not refused for those.
fn with_checksums(mut png: Vec<u8>) -> Vec<u8> {
    let mut at = 8;
    while let Some(header) = png.get(at..at + 8) {
        let length = u32::from_be_bytes([header[0], header[1], header[2], header[3]]) as usize;
        let Some(content) = png.get(at + 4..(at + 8).saturating_add(length)) else { break };
        let checksum = !content.iter().fold(u32::MAX, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
        });
        let end = at + 8 + length;
        let Some(stored) = png.get_mut(end..end + 4) else { break };
        stored.copy_from_slice(&checksum.to_be_bytes());
        at = end + 4;
    }
    png
}

#[test]
fn image_files() {
    let seeds = images();
    let make = |random: &mut Random| {
        let seed = random.pick(&seeds).clone();
        // The head holds the sizes; most of the rest is pixels.
        let bytes = match random.one_in(2) {
            true => mutated(random, &seed, &seeds),
            false => {
                let head = seed.len().min(400);
                let mut bytes = mutated(random, &seed[..head], &seeds);
                bytes.extend(&seed[head..]);
                bytes
            }
        };
        if random.one_in(4) || !seed.starts_with(b"\x89PNG") { bytes } else { with_checksums(bytes) }
    };
    fuzz("images", make, |bytes| match vitrum::image::decode(Path::new("fuzz.hdr"), bytes) {
        Ok(image) => {
            assert_eq!(image.pixels.len(), image.width as usize * image.height as usize);
            true
        }
        Err(error) => {
            assert!(!error.to_string().contains('\n'), "{error}");
            false
        }
    });
}
