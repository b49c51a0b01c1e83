//! How long a large mesh takes to read, and how much memory: `cargo bench --bench load` prints the table of docs/models.md, of 5
//! million triangles in OBJ and in GLB. Beside it stands what the readers need alone that it is built on: `tobj` for OBJ, for GLB the
//! `gltf` crate with arrays copied out. An argument is another number of triangles.
//!
//! Each figure is of a process of its own, the least of three, the file being in the system's cache.

#[allow(dead_code, reason = "the tests use the rest")]
#[path = "../tests/common/gltf.rs"]
mod gltf_files;

use std::error::Error;
use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use vitrum::scene::{Mesh, Overrides, RawMesh, Scene};

type Result<T> = std::result::Result<T, Box<dyn Error>>;

const RUNS: usize = 3;

/// A ball of about `count` triangles.
fn ball(count: usize) -> Result<Mesh> {
    let rings = ((count as f64 / 4.0).sqrt() as u32).max(3);
    let sides = 2 * rings;
    let mut positions = vec![[0.0, 1.0, 0.0], [0.0, -1.0, 0.0_f32]];
    for ring in 1..rings {
        let (radius, height) = (PI * f64::from(ring) / f64::from(rings)).sin_cos();
        positions.extend((0..sides).map(|side| {
            let (sine, cosine) = (TAU * f64::from(side) / f64::from(sides)).sin_cos();
            [radius * cosine, height, -radius * sine].map(|x| x as f32)
        }));
    }
    let at = |ring: u32, side: u32| 2 + (ring - 1) * sides + side % sides;
    let mut triangles = Vec::new();
    for side in 0..sides {
        triangles.extend([[0, at(1, side), at(1, side + 1)], [1, at(rings - 1, side + 1), at(rings - 1, side)]]);
        for ring in 1..rings - 1 {
            let [a, b, c, d] = [at(ring, side), at(ring, side + 1), at(ring + 1, side), at(ring + 1, side + 1)];
            triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    let normals = positions.clone();
    let raw = RawMesh { name: "ball".into(), positions, normals, triangles, ..RawMesh::default() };
    Mesh::new(raw).map_err(|refusal| refusal.to_string().into())
}

fn obj(mesh: &Mesh) -> Result<String> {
    let mut text = String::new();
    for (keyword, vectors) in [("v", &mesh.positions), ("vn", &mesh.normals)] {
        for [x, y, z] in vectors {
            writeln!(text, "{keyword} {x} {y} {z}")?;
        }
    }
    for [a, b, c] in mesh.triangles.iter().map(|triangle| triangle.map(|vertex| vertex + 1)) {
        writeln!(text, "f {a}//{a} {b}//{b} {c}//{c}")?;
    }
    Ok(text)
}

/// Reads `file` and prints how many triangles there are, seconds and MiB.
fn read(reader: &str, file: &Path) -> Result<()> {
    let start = Instant::now();
    let triangles = match reader {
        "tobj" => tobj::load_obj(file, &tobj::GPU_LOAD_OPTIONS)?.0.iter().map(|one| one.mesh.indices.len() / 3).sum(),
        "gltf" => {
            let gltf::Gltf { document, blob } = gltf::Gltf::open(file)?;
            let blob = blob.ok_or("no buffer")?;
            let mesh = document.meshes().next().and_then(|mesh| mesh.primitives().next()).ok_or("no mesh")?;
            let arrays = mesh.reader(|_| Some(&blob));
            let positions: Vec<_> = arrays.read_positions().ok_or("no positions")?.collect();
            let normals: Vec<_> = arrays.read_normals().ok_or("no normals")?.collect();
            let indices: Vec<_> = arrays.read_indices().ok_or("no indices")?.into_u32().collect();
            assert_eq!(positions.len(), normals.len());
            indices.len() / 3
        }
        _ => Scene::load(Some(file), &Overrides::default())?
            .meshes
            .iter()
            .map(|mesh| mesh.triangles.len())
            .sum::<usize>(),
    };
    let seconds = start.elapsed().as_secs_f64();
    let status = fs::read_to_string("/proc/self/status")?;
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).ok_or("no peak")?;
    let kib: f64 = peak.trim().trim_end_matches(" kB").parse()?;
    println!("{triangles} {seconds} {}", kib / 1024.0);
    Ok(())
}

fn main() -> Result<()> {
    let arguments: Vec<_> = std::env::args().skip(1).filter(|argument| !argument.starts_with("--")).collect();
    if let [reader, file] = &arguments[..] {
        return read(reader, Path::new(file));
    }
    let count = arguments.first().map_or(Ok(5_000_000), |count| count.parse())?;
    let folder = tempfile::tempdir()?;
    let mesh = ball(count)?;
    let text = folder.path().join("model.obj");
    fs::write(&text, obj(&mesh)?)?;
    let binary = gltf_files::Model::of(&mesh, None).write_glb(folder.path());
    println!("| file | MiB | reader | triangles | s | peak MiB |\n| --- | --- | --- | --- | --- | --- |");
    for (file, readers) in [(&text, ["tobj", "vitrum"]), (&binary, ["gltf", "vitrum"])] {
        let size = fs::metadata(file)?.len() as f64 / f64::from(1 << 20);
        for reader in readers {
            let mut least = [f64::INFINITY; 3];
            for _ in 0..RUNS {
                let output = Command::new(std::env::current_exe()?).arg(reader).arg(file).output()?;
                let line = String::from_utf8(output.stdout)?;
                let numbers: Vec<f64> = line.split_whitespace().flat_map(str::parse).collect();
                let [triangles, seconds, mib] = numbers[..] else { return Err(format!("{reader}: no figures").into()) };
                least = [triangles, least[1].min(seconds), least[2].min(mib)];
            }
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            println!("| {name} | {size:.0} | {reader} | {} | {:.2} | {:.0} |", least[0], least[1], least[2]);
        }
    }
    Ok(())
}
