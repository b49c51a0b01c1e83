//! Wavefront OBJ. In flow the bytes of an `.obj` and of the `.mtl` it names, out flow parts: a mesh and what it wears.
//!
//! A part is what an `o` line opens, cut where the material changes; groups (`g`) cut nothing, because a piece of a
//! closed surface bounds no medium. Polygons are cut as fans. Points, lines and free-form geometry are left out.
//! [`super::obj_text`] tidies the text, then `tobj` reads it.

use std::collections::HashMap;
use std::path::Path;

use glam::DAffine3;

use super::files::Files;
use super::mesh::{Mesh, Preparation, RawMesh, Refusal};
use super::mesh_file::{MeshFile, Part, shorten, worn};
use super::mtl;
use super::obj_text::{Tidy, bad_number};
use super::smoothing::average;
use crate::{Error, Result};

/// Reads the `.obj` at `path` and the `.mtl` it names; meshes are prepared first.
pub fn read(files: Files, path: &Path, preparation: Preparation) -> Result<MeshFile> {
    let bytes = files.read(path)?;
    if bytes.contains(&0) {
        return Err(Error::input(path, 0, "is binary, not Wavefront OBJ text; export as .obj"));
    }
    let text = String::from_utf8_lossy(&bytes);
    let tidy = Tidy::new(&text).map_err(|(line, message)| Error::input(path, line, message))?;

    let mut material_warnings = Vec::new();
    let mut images = Vec::new();
    let materials = mtl::read_all(files, path, &tidy.libraries, &mut images, &mut material_warnings);
    // As in an MTL file, the last one of a name counts.
    let numbers: HashMap<&str, usize> = materials.iter().enumerate().map(|(i, m)| (m.name.as_str(), i)).collect();
    let before = material_warnings.len();
    for unknown in tidy.materials.iter().filter(|name| !numbers.contains_key(name.as_str())) {
        material_warnings.push(format!("{}: material {unknown:?} is in no MTL file that was read", path.display()));
    }
    shorten(&mut material_warnings, before, "materials are in none");

    let names_only = |_: &Path| {
        let numbers = numbers.iter().map(|(name, number)| (name.to_string(), *number)).collect();
        Ok((vec![tobj::Material::default(); materials.len()], numbers))
    };
    let loaded = tobj::load_obj_buf(&mut tidy.text.as_bytes(), &tobj::GPU_LOAD_OPTIONS, names_only);
    let (models, _) = loaded.map_err(|error| match bad_number(&text) {
        Some((line, message)) => Error::input(path, line, message),
        None => Error::input(path, 0, format!("cannot be read as OBJ: {error}")),
    })?;
    let file = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    let mut warnings: Vec<_> = tidy.remarks.iter().map(|remark| format!("{file}: {remark}")).collect();
    let (meshes, mut parts) = parts(path, &file, &text, models, tidy.grouped, preparation, &mut warnings)?;
    let materials = worn(&mut parts, materials);
    Ok(MeshFile { meshes, parts, materials, images, warnings, material_warnings, ..MeshFile::default() })
}

/// Joins the models that tobj cut a part into, and checks each part.
fn parts(
    path: &Path,
    file: &str,
    text: &str,
    models: Vec<tobj::Model>,
    grouped: bool,
    preparation: Preparation,
    warnings: &mut Vec<String>,
) -> Result<(Vec<Mesh>, Vec<Part>)> {
    let mut raw: Vec<(RawMesh, Option<usize>)> = Vec::new();
    let mut numbers = HashMap::new();
    for tobj::Model { mesh, name } in models {
        let number = *numbers.entry((name.clone(), mesh.material_id)).or_insert_with(|| {
            raw.push((RawMesh { name, ..RawMesh::default() }, mesh.material_id));
            raw.len() - 1
        });
        let (part, _) = &mut raw[number];
        let offset = part.positions.len() as u32;
        part.positions.extend(mesh.positions.as_chunks().0);
        part.normals.extend(mesh.normals.as_chunks().0);
        part.uvs.extend(mesh.texcoords.as_chunks().0);
        let triangles = mesh.indices.as_chunks().0.iter();
        part.triangles.extend(triangles.map(|triangle| triangle.map(|vertex| vertex + offset)));
    }
    let several = raw.len() > 1;
    let (mut meshes, mut parts) = (Vec::new(), Vec::new());
    let mut lost = 0;
    for (mut part, material) in raw {
        if grouped {
            match preparation.smooth_angle {
                None => average(&mut part),
                Some(_) => part.normals.clear(),
            }
        }
        part.name = if several { format!("{file} ({})", part.name) } else { file.to_owned() };
        match Mesh::prepared(part, preparation) {
            Ok(mesh) => {
                parts.push(Part { mesh: meshes.len(), material, transform: DAffine3::IDENTITY, object: 0 });
                meshes.push(mesh);
            }
            Err(Refusal::NoTriangles { degenerate }) => lost += degenerate,
            Err(refusal) => {
                let (line, message) = bad_number(text).unwrap_or_else(|| (0, refusal.to_string()));
                return Err(Error::input(path, line, message));
            }
        }
    }
    if parts.is_empty() {
        return Err(Error::input(path, 0, Refusal::NoTriangles { degenerate: lost }.to_string()));
    }
    if lost > 0 {
        warnings.push(format!("{file}: {lost} degenerate triangles removed, and the parts that held nothing else"));
    }
    Ok((meshes, parts))
}
