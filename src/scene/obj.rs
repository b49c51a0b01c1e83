//! Wavefront OBJ. In flow the bytes of an `.obj` and of the `.mtl` it names, out flow parts: a mesh and what it wears.
//!
//! A part is what an `o` line opens, cut where the material changes; groups (`g`) cut nothing, because a piece of a
//! closed surface bounds no medium. Polygons are cut as fans. Points, lines and free-form geometry are left out.
//! [`super::obj_text`] tidies the text, then `tobj` reads it.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::doctor::{Mending, mend};
use super::files::Files;
use super::material::Material;
use super::mesh::{Mesh, RawMesh, Refusal};
use super::mtl;
use super::obj_text::{Tidy, bad_number};
use crate::{Error, Result};

/// What an OBJ file holds.
#[derive(Clone, Debug)]
pub struct ObjFile {
    /// Meshes with indices into [`ObjFile::materials`].
    pub parts: Vec<Part>,
    /// The materials of the MTL files that parts wear; their textures are indices into [`ObjFile::images`].
    pub materials: Vec<Material>,
    /// The images that they name, not opened yet.
    pub images: Vec<PathBuf>,
    /// What is wrong with the meshes, one line each.
    pub warnings: Vec<String>,
    /// What is wrong with the materials, which matters only to those who use them.
    pub material_warnings: Vec<String>,
}

/// One mesh of a file.
#[derive(Clone, Debug)]
pub struct Part {
    /// The mesh.
    pub mesh: Mesh,
    /// Index into [`ObjFile::materials`].
    pub material: Option<usize>,
}

/// Reads the `.obj` at `path` and the `.mtl` it names; `repair`s the meshes beyond what [`Mesh::new`] does.
pub fn read(files: Files, path: &Path, repair: bool) -> Result<ObjFile> {
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
    let mut parts = parts(path, &file, &text, models, repair, &mut warnings)?;
    let materials = worn(&mut parts, materials);
    Ok(ObjFile { parts, materials, images, warnings, material_warnings })
}

/// Joins the models that tobj cut a part into, and checks each part.
fn parts(
    path: &Path,
    file: &str,
    text: &str,
    models: Vec<tobj::Model>,
    repair: bool,
    warnings: &mut Vec<String>,
) -> Result<Vec<Part>> {
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
    let mut parts = Vec::new();
    let mut lost = 0;
    for (mut part, material) in raw {
        part.name = if several { format!("{file} ({})", part.name) } else { file.to_owned() };
        let mending = if repair { mend(&mut part) } else { Mending::default() };
        match Mesh::new(part) {
            Ok(mesh) => {
                warnings.extend(mending.told(&mesh));
                parts.push(Part { mesh, material });
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
    Ok(parts)
}

/// The materials that parts wear: a library may hold many more, and their images.
fn worn(parts: &mut [Part], materials: Vec<Material>) -> Vec<Material> {
    let mut numbers = vec![None; materials.len()];
    let mut count = 0;
    for number in parts.iter_mut().filter_map(|part| part.material.as_mut()) {
        *number = *numbers[*number].get_or_insert_with(|| {
            count += 1;
            count - 1
        });
    }
    let mut worn: Vec<_> = numbers.into_iter().zip(materials).filter_map(|(number, m)| Some((number?, m))).collect();
    worn.sort_by_key(|(number, _)| *number);
    worn.into_iter().map(|(_, material)| material).collect()
}

/// Keeps the first of the remarks from `start` on, and says how many more of `what` there are.
pub fn shorten(remarks: &mut Vec<String>, start: usize, what: &str) {
    const MOST: usize = 8;
    let more = remarks.len().saturating_sub(start + MOST);
    if more > 0 {
        remarks.truncate(start + MOST);
        remarks.push(format!("... {more} more {what}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_remarks_become_a_few() {
        let mut remarks: Vec<_> = (0..10).map(|number| format!("fault {number}")).collect();
        shorten(&mut remarks, 2, "faults");
        assert_eq!((remarks.len(), remarks[9].as_str()), (10, "fault 9"));
        remarks.push("fault 10".into());
        shorten(&mut remarks, 2, "faults");
        assert_eq!((remarks.len(), remarks[10].as_str()), (11, "... 1 more faults"));
    }
}
