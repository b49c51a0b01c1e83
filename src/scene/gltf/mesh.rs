//! Meshes of glTF. In flow primitives, out flow [`Mesh`]es of one material each.

use std::collections::HashMap;
use std::rc::Rc;

use gltf::mesh::{Mode, Primitive, Semantic};
use gltf::{Accessor, Mesh as Source};

use super::Remarks;
use super::accessor::Accessors;
use crate::scene::mesh::{Mesh, Preparation, RawMesh, Refusal};

/// How many indices are read at most for each byte of the buffers.
const MOST_SHARED: usize = 4;

/// What a primitive is made of: accessors, and how its corners make triangles.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct Recipe {
    positions: usize,
    normals: Option<usize>,
    coordinates: Option<usize>,
    indices: Option<usize>,
    mode: u32,
}

/// The meshes of a file so far.
pub struct Meshes<'a> {
    accessors: &'a Accessors<'a>,
    /// Of each material the number of the set of texture coordinates that its images use.
    sets: &'a [u32],
    file: &'a str,
    several: bool,
    remarks: &'a mut Remarks,
    preparation: Preparation,
    /// Out flows.
    pub all: Vec<Mesh>,
    /// Triangles without an area in parts that held nothing else.
    pub lost: usize,
    known: HashMap<Vec<Recipe>, Option<usize>>,
    parts: HashMap<usize, Vec<(usize, Option<usize>)>>,
    vectors: HashMap<usize, Rc<Vec<[f32; 3]>>>,
    uvs: HashMap<usize, Rc<Vec<[f32; 2]>>>,
    indices_left: usize,
}

impl<'a> Meshes<'a> {
    /// None yet.
    pub fn new(
        accessors: &'a Accessors<'a>,
        sets: &'a [u32],
        file: &'a str,
        several: bool,
        preparation: Preparation,
        remarks: &'a mut Remarks,
    ) -> Self {
        let indices_left = MOST_SHARED * accessors.bytes() + (1 << 20);
        Self {
            accessors,
            sets,
            file,
            several,
            remarks,
            preparation,
            all: Vec::new(),
            lost: 0,
            known: HashMap::new(),
            parts: HashMap::new(),
            vectors: HashMap::new(),
            uvs: HashMap::new(),
            indices_left,
        }
    }

    /// The meshes that `source` is made of, with the material of each.
    pub fn parts(&mut self, source: &Source<'_>) -> Result<Vec<(usize, Option<usize>)>, String> {
        if let Some(parts) = self.parts.get(&source.index()) {
            return Ok(parts.clone());
        }
        let mut by_material: Vec<(Option<usize>, Vec<Primitive<'_>>)> = Vec::new();
        for primitive in source.primitives() {
            if matches!(primitive.mode(), Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
                self.remarks.leave_out("points and lines");
                continue;
            }
            if primitive.morph_targets().len() > 0 {
                self.remarks.leave_out("morph targets");
            }
            let material = primitive.material().index();
            match by_material.iter_mut().find(|(known, _)| *known == material) {
                Some((_, primitives)) => primitives.push(primitive),
                None => by_material.push((material, vec![primitive])),
            }
        }
        let mut parts = Vec::new();
        let cut = by_material.len() > 1;
        for (material, primitives) in by_material {
            let set = material.map_or(0, |material| self.sets[material]);
            let recipes: Result<Vec<_>, _> = primitives.iter().map(|one| recipe(one, set)).collect();
            let recipes = recipes.map_err(|why| format!("mesh {}: {why}", source.index()))?;
            let mesh = match self.known.get(&recipes) {
                Some(&known) => known,
                None => {
                    let mut name = self.file.to_owned();
                    if self.several || cut {
                        let own = source.name().map_or_else(|| format!("mesh {}", source.index()), str::to_owned);
                        let wears = primitives[0].material().name().filter(|_| cut);
                        let wears = wears.map_or(String::new(), |name| format!(", {name}"));
                        name = format!("{name} ({own}{wears})");
                    }
                    let made = self.mesh(name, &primitives, set);
                    let made = made.map_err(|why| format!("mesh {}: {why}", source.index()))?;
                    self.known.insert(recipes, made);
                    made
                }
            };
            parts.extend(mesh.map(|mesh| (mesh, material)));
        }
        self.parts.insert(source.index(), parts.clone());
        Ok(parts)
    }

    /// One mesh of several primitives, unless nothing of it has an area.
    fn mesh(&mut self, name: String, primitives: &[Primitive<'_>], set: u32) -> Result<Option<usize>, String> {
        let mut raw = RawMesh { name, ..RawMesh::default() };
        let has_normals = primitives.iter().any(|primitive| primitive.get(&Semantic::Normals).is_some());
        let has_uvs = primitives.iter().any(|primitive| primitive.get(&Semantic::TexCoords(set)).is_some());
        for primitive in primitives {
            let positions = match primitive.get(&Semantic::Positions) {
                Some(accessor) => self.vectors(&accessor)?,
                None => return Err("a primitive has no positions".into()),
            };
            let count = positions.len();
            let same = |what: &str, found: usize| match found == count {
                true => Ok(()),
                false => Err(format!("{count} positions have {found} {what}")),
            };
            let corners = match primitive.indices() {
                Some(accessor) => self.accessors.indices(&accessor)?,
                None => (0..count as u32).collect(),
            };
            self.indices_left = self
                .indices_left
                .checked_sub(corners.len())
                .ok_or("the file shows the same indices again and again; export it again")?;
            if let Some(wrong) = corners.iter().find(|&&corner| corner as usize >= count) {
                return Err(format!("an index is {wrong}, and there are {count} vertices; the file is damaged"));
            }
            let triangles = triangles(primitive.mode(), &corners);
            let first = raw.positions.len();
            let used = Used::new(&triangles, count);
            let base = u32::try_from(first).map_err(|_| "there are too many vertices")?;
            raw.triangles.extend(triangles.iter().map(|triangle| triangle.map(|corner| base + used.place(corner))));
            raw.positions.extend(used.of(&positions));
            if has_normals {
                match primitive.get(&Semantic::Normals) {
                    Some(accessor) => {
                        let normals = self.vectors(&accessor)?;
                        same("normals", normals.len())?;
                        raw.normals.extend(used.of(&normals));
                    }
                    None => raw.normals.resize(raw.positions.len(), [0.0; 3]),
                }
            }
            if has_uvs {
                match primitive.get(&Semantic::TexCoords(set)) {
                    Some(accessor) => {
                        let uvs = self.uvs(&accessor)?;
                        same("texture coordinates", uvs.len())?;
                        raw.uvs.extend(used.of(&uvs).map(|[u, v]| [u, 1.0 - v]));
                    }
                    None => raw.uvs.resize(raw.positions.len(), [f32::NAN; 2]),
                }
            }
            if primitive.get(&Semantic::Colors(0)).is_some() {
                self.remarks.leave_out("vertex colours");
            }
        }
        match Mesh::prepared(raw, self.preparation) {
            Ok(mesh) => {
                self.all.push(mesh);
                Ok(Some(self.all.len() - 1))
            }
            Err(Refusal::NoTriangles { degenerate }) => {
                self.lost += degenerate;
                Ok(None)
            }
            Err(refusal) => Err(refusal.to_string()),
        }
    }

    fn uvs(&mut self, accessor: &Accessor<'_>) -> Result<Rc<Vec<[f32; 2]>>, String> {
        if let Some(known) = self.uvs.get(&accessor.index()) {
            return Ok(known.clone());
        }
        let read = Rc::new(self.accessors.vectors::<2>(accessor)?);
        self.uvs.insert(accessor.index(), read.clone());
        Ok(read)
    }

    fn vectors(&mut self, accessor: &Accessor<'_>) -> Result<Rc<Vec<[f32; 3]>>, String> {
        if let Some(known) = self.vectors.get(&accessor.index()) {
            return Ok(known.clone());
        }
        let read = Rc::new(self.accessors.vectors::<3>(accessor)?);
        self.vectors.insert(accessor.index(), read.clone());
        Ok(read)
    }
}

fn recipe(primitive: &Primitive<'_>, set: u32) -> Result<Recipe, String> {
    let of = |semantic: Semantic| primitive.get(&semantic).map(|accessor| accessor.index());
    Ok(Recipe {
        positions: of(Semantic::Positions).ok_or("a primitive has no positions")?,
        normals: of(Semantic::Normals),
        coordinates: of(Semantic::TexCoords(set)),
        indices: primitive.indices().map(|accessor| accessor.index()),
        mode: primitive.mode().as_gl_enum(),
    })
}

/// The triangles that corners make.
fn triangles(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    match mode {
        Mode::TriangleStrip => {
            let turned = |(number, three): (usize, &[u32; 3])| {
                let [a, b, c] = *three;
                if number % 2 == 0 { [a, b, c] } else { [b, a, c] }
            };
            corners.array_windows().enumerate().map(turned).collect()
        }
        Mode::TriangleFan => match corners.split_first() {
            Some((&first, others)) => others.array_windows().map(|&[b, c]| [first, b, c]).collect(),
            None => Vec::new(),
        },
        _ => corners.as_chunks().0.to_vec(),
    }
}

/// The vertices that triangles use, in the order of the file: primitives may share arrays of which each needs a little.
enum Used {
    All(usize),
    Some { vertices: Vec<u32>, places: HashMap<u32, u32> },
}

impl Used {
    fn new(triangles: &[[u32; 3]], count: usize) -> Self {
        if triangles.len() >= count / 8 {
            return Self::All(count);
        }
        let mut vertices: Vec<u32> = triangles.iter().flatten().copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        let places = (0..).zip(&vertices).map(|(place, &vertex)| (vertex, place)).collect();
        Self::Some { vertices, places }
    }

    fn place(&self, vertex: u32) -> u32 {
        match self {
            Self::All(_) => vertex,
            Self::Some { places, .. } => places[&vertex],
        }
    }

    fn of<'a, T: Copy>(&'a self, values: &'a [T]) -> impl Iterator<Item = T> + 'a {
        let count = match self {
            Self::All(count) => *count,
            Self::Some { vertices, .. } => vertices.len(),
        };
        (0..count).map(move |place| match self {
            Self::All(_) => values[place],
            Self::Some { vertices, .. } => values[vertices[place] as usize],
        })
    }
}
