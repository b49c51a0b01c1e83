//! glTF 2.0 and GLB. In flow the bytes of a file and of what it names, out flow meshes in their places, what they wear,
//! the first camera and the lights.
//!
//! A mesh is cut where the material changes and only there, because a piece of a closed surface bounds no medium. Meshes
//! that are made of the same numbers are one, wherever they stand. What is not supported is said once, by name.

mod accessor;
mod container;
mod material;
mod mesh;

use std::collections::{BTreeSet, HashSet};
use std::path::Path;

use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::camera::Projection;
use gltf::json::validation::{Checked, Error as Invalid, Validate};
use gltf::khr_lights_punctual::Kind;
use gltf::mesh::Semantic;
use gltf::scene::Transform;
use gltf::{Document, Node, json};

use super::files::Files;
use super::light::{Cone, LightSource, PointLight, Sun};
use super::mesh::{FARTHEST, Preparation};
use super::mesh_file::{MeshFile, Part, shorten, worn};
use super::table::SCALE;
use super::{Camera, Material};
use crate::{Error, Result};
use accessor::Accessors;
use container::{Container, Resources};
use material::Converter;
use mesh::Meshes;

/// Extensions that are read, or that change nothing here; the others are named.
const KNOWN: [&str; 12] = [
    "KHR_lights_punctual",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
];

/// Extensions that hide the meshes of a file from those who do not know them.
const COMPRESSED: [&str; 3] = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Intensities in candela beyond this are told: lumens that stand for watts are 683 times as many.
const BRIGHT: f32 = 1e4;

/// What is said of a file.
#[derive(Debug, Default)]
pub struct Remarks {
    lines: Vec<String>,
    left_out: BTreeSet<String>,
}

impl Remarks {
    fn say(&mut self, line: String) {
        self.lines.push(line);
    }

    fn leave_out(&mut self, what: impl Into<String>) {
        self.left_out.insert(what.into());
    }

    /// One line each, with the name of the file, not too many.
    fn into_lines(self, file: &str) -> Vec<String> {
        let mut lines: Vec<_> = self.lines.iter().map(|line| format!("{file}: {line}")).collect();
        shorten(&mut lines, 0, "remarks on this file");
        if !self.left_out.is_empty() {
            let all: Vec<_> = self.left_out.into_iter().collect();
            lines.push(format!("{file}: not supported and left out: {}", all.join(", ")));
        }
        lines
    }
}

/// Reads the `.gltf` or `.glb` at `path`; meshes are prepared first.
pub fn read(files: Files, path: &Path, preparation: Preparation) -> Result<MeshFile> {
    let wrong = |message: String| Error::input(path, 0, message);
    let bytes = files.read(path)?;
    if bytes.is_empty() {
        return Err(wrong("is empty; export the model again".into()));
    }
    let Container { json, binary } = Container::new(&bytes).map_err(wrong)?;
    let root: json::Root = json::deserialize::from_slice(json).map_err(|error| {
        let line = if bytes.starts_with(b"glTF") { 0 } else { error.line() };
        Error::input(path, line, format!("cannot be read as glTF: {error}"))
    })?;
    check(&root).map_err(wrong)?;
    let document = Document::from_json_without_validation(root);
    let file = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();

    let mut resources = Resources { files, path, read: Vec::new() };
    let buffers = resources.buffers(&document, binary)?;
    let mut of_materials = Remarks::default();
    let worn_here: HashSet<_> =
        document.meshes().flat_map(|mesh| mesh.primitives()).filter_map(|one| one.material().index()).collect();
    let mut converter = Converter::new(&document, &resources, &buffers, &mut of_materials);
    let convert = |material: gltf::Material<'_>| match material.index().is_some_and(|own| worn_here.contains(&own)) {
        true => converter.convert(&material),
        false => (Material::clear_glass(), 0),
    };
    let (materials, sets): (Vec<_>, Vec<_>) = document.materials().map(convert).unzip();
    let images = converter.images;

    let mut remarks = Remarks::default();
    leave_out(&document, &mut remarks);
    let accessors = Accessors::new(&buffers);
    let mut meshes = Meshes::new(&accessors, &sets, &file, document.meshes().len() > 1, preparation, &mut remarks);
    let mut scene = SceneParts::default();
    for node in roots(&document) {
        scene.add(&node, &mut meshes).map_err(wrong)?;
    }
    let Meshes { all: meshes, lost, .. } = meshes;
    if scene.parts.is_empty() {
        return Err(wrong("shows no triangles; export meshes, and nodes that show them".into()));
    }
    if lost > 0 {
        let what = if lost == 1 { "triangle" } else { "triangles" };
        remarks.say(format!("{lost} degenerate {what} removed, and the parts that held nothing else"));
    }
    let SceneParts { mut parts, camera, lights, remarks: of_scene, flat, .. } = scene;
    if flat > 0 {
        let what = if flat == 1 { "node is" } else { "nodes are" };
        remarks.say(format!("{flat} {what} scaled by less than 1e-9 or more than 1e9; left out"));
    }
    let materials = worn(&mut parts, materials);
    Ok(MeshFile {
        meshes,
        parts,
        materials,
        images,
        camera,
        lights,
        files: resources.read,
        warnings: remarks.into_lines(&file),
        material_warnings: of_materials.into_lines(&file),
        scene_warnings: of_scene.into_lines(&file),
    })
}

/// Refuses what cannot be shown right, or is no glTF.
fn check(root: &json::Root) -> Result<(), String> {
    if let Some(name) = root.extensions_required.iter().find(|name| COMPRESSED.contains(&name.as_str())) {
        return Err(format!(
            "is compressed with {name}, which is not read; open it in a program that does, as Blender, and export it without compression"
        ));
    }
    if !root.asset.version.starts_with("2.") {
        return Err(format!("is glTF of version {:?}; only 2 is read, convert it", root.asset.version));
    }
    let unknown = |name: &&String| !KNOWN.contains(&name.as_str());
    if let Some(name) = root.extensions_required.iter().find(unknown) {
        return Err(format!("requires {name}, which is not supported; export it without"));
    }
    // Before it is validated, for the crate counts on it.
    let positions = Checked::Valid(Semantic::Positions);
    for primitive in root.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        if primitive.attributes.get(&positions).is_some_and(|accessor| accessor.value() >= root.accessors.len()) {
            return Err("positions are in an accessor that does not exist; the file is damaged, export it again".into());
        }
    }
    for (number, camera) in root.cameras.iter().enumerate() {
        let has_lens = match camera.type_ {
            Checked::Valid(json::camera::Type::Perspective) => camera.perspective.is_some(),
            Checked::Valid(json::camera::Type::Orthographic) => camera.orthographic.is_some(),
            Checked::Invalid => true,
        };
        if !has_lens {
            return Err(format!("camera {number} lacks what its type says that it has; export it again"));
        }
    }
    let mut first = None;
    root.validate(root, json::Path::new, &mut |place, error| {
        // The crate knows fewer extensions than we do.
        if error != Invalid::Unsupported && first.is_none() {
            first = Some(format!("{}: {error}; the file is damaged, export it again", place()));
        }
    });
    first.map_or(Ok(()), Err)
}

/// Names what a file has and a scene here has not.
fn leave_out(document: &Document, remarks: &mut Remarks) {
    for name in document.extensions_used().filter(|name| !KNOWN.contains(name)) {
        remarks.leave_out(name);
    }
    for (is, what) in [
        (document.animations().len() > 0, "animations (the first pose is shown)"),
        (document.skins().len() > 0, "skins (meshes are shown as they were before they were bound)"),
    ] {
        if is {
            remarks.leave_out(what);
        }
    }
}

/// The nodes at the top of the scene that is to be shown.
fn roots(document: &Document) -> Vec<Node<'_>> {
    match document.default_scene().or_else(|| document.scenes().next()) {
        Some(scene) => scene.nodes().collect(),
        None => {
            let children: BTreeSet<_> = document
                .nodes()
                .flat_map(|node| node.children().map(|child| child.index()).collect::<Vec<_>>())
                .collect();
            document.nodes().filter(|node| !children.contains(&node.index())).collect()
        }
    }
}

/// What the nodes of a scene hold.
#[derive(Default)]
struct SceneParts {
    parts: Vec<Part>,
    camera: Option<Camera>,
    lights: Vec<LightSource>,
    remarks: Remarks,
    /// Nodes that are scaled to nothing.
    flat: usize,
    objects: usize,
    seen: HashSet<usize>,
}

impl SceneParts {
    /// A node and all below; the error says what is wrong with them.
    fn add(&mut self, root: &Node<'_>, meshes: &mut Meshes<'_>) -> Result<(), String> {
        let mut open = vec![(root.clone(), DAffine3::IDENTITY)];
        while let Some((node, parent)) = open.pop() {
            if !self.seen.insert(node.index()) {
                return Err(format!("node {} is below two others, or below itself; export it again", node.index()));
            }
            let transform = parent * transform(&node);
            // The last one in is the first one out.
            open.extend(node.children().map(|child| (child, transform)).collect::<Vec<_>>().into_iter().rev());
            self.camera(&node, &transform);
            self.light(&node, &transform);
            let Some(mesh) = node.mesh() else { continue };
            let scales = [transform.matrix3.x_axis, transform.matrix3.y_axis, transform.matrix3.z_axis];
            let is_solid =
                transform.matrix3.determinant() != 0.0 && scales.iter().all(|axis| (SCALE.holds)(axis.length()));
            if !is_solid || !transform.is_finite() {
                self.flat += 1;
                continue;
            }
            let found = meshes.parts(&mesh)?;
            let object = self.objects;
            self.parts.extend(found.iter().map(|&(mesh, material)| Part { mesh, material, transform, object }));
            self.objects += usize::from(!found.is_empty());
        }
        Ok(())
    }

    fn camera(&mut self, node: &Node<'_>, transform: &DAffine3) {
        let Some(camera) = node.camera() else { return };
        match camera.projection() {
            Projection::Orthographic(_) => self.remarks.leave_out("orthographic cameras"),
            Projection::Perspective(_) if self.camera.is_some() => {
                self.remarks.leave_out("cameras behind the first");
            }
            Projection::Perspective(lens) => {
                let position = transform.translation;
                if !is_near(position) {
                    self.remarks.say(format!("camera {}: is not within 1e9 m; left out", camera.index()));
                    return;
                }
                let target = position + transform.transform_vector3(DVec3::NEG_Z).normalize_or_zero();
                match Camera::new(position, target, transform.transform_vector3(DVec3::Y), lens.yfov().into()) {
                    Ok(camera) => self.camera = Some(camera),
                    Err(why) => self.remarks.say(format!("camera {}: {why}; left out", camera.index())),
                }
            }
        }
    }

    fn light(&mut self, node: &Node<'_>, transform: &DAffine3) {
        let Some(light) = node.light() else { return };
        let (number, intensity) = (light.index(), light.intensity());
        let color = DVec3::from_array(light.color().map(f64::from)) * f64::from(intensity);
        let place = transform.translation;
        let direction = transform.transform_vector3(DVec3::NEG_Z).try_normalize();
        let is_sun = matches!(light.kind(), Kind::Directional);
        if !color.is_finite() || color.min_element() < 0.0 || color.max_element() > 1e9 {
            self.remarks.say(format!("light {number}: intensity {intensity} is not from 0 to 1e9; left out"));
            return;
        }
        if !is_sun && !is_near(place) {
            self.remarks.say(format!("light {number}: is not within 1e9 m; left out"));
            return;
        }
        let point = PointLight::new(place, color);
        let source = match (light.kind(), direction) {
            (Kind::Point, _) => LightSource::Point(point),
            (Kind::Directional, Some(direction)) => LightSource::Sun(Sun { direction, irradiance: color }),
            (Kind::Directional | Kind::Spot { .. }, None) => {
                self.remarks.say(format!(
                    "light {number}: its node is scaled to nothing, so that it has no direction; left out"
                ));
                return;
            }
            (Kind::Spot { inner_cone_angle, outer_cone_angle }, Some(direction)) => {
                let (inner, outer) = (f64::from(inner_cone_angle), f64::from(outer_cone_angle));
                match Cone::new(direction, inner, outer) {
                    cone @ Some(_) => LightSource::Point(PointLight { cone, ..point }),
                    None => {
                        self.remarks.say(format!(
                            "light {number}: its angles {inner_cone_angle} and {outer_cone_angle} are \
                             not 0 <= inner <= outer <= pi/2, the outer one above 0; left out"
                        ));
                        return;
                    }
                }
            }
        };
        if !is_sun && light.range().is_some() {
            self.remarks.leave_out("ranges of lights");
        }
        if !is_sun && intensity > BRIGHT {
            self.remarks.say(format!(
                "light {number}: {intensity} candela, which count as W/sr: if it is too bright, export it without units"
            ));
        }
        self.lights.push(source);
    }
}

/// Whether a point is where scenes may have one.
fn is_near(point: DVec3) -> bool {
    point.is_finite() && point.abs().max_element() <= FARTHEST
}

fn transform(node: &Node<'_>) -> DAffine3 {
    let wide = |vector: [f32; 3]| DVec3::from_array(vector.map(f64::from));
    match node.transform() {
        Transform::Matrix { matrix } => {
            let columns = matrix.map(|column| column.map(f64::from));
            DAffine3::from_mat4(DMat4::from_cols_array_2d(&columns))
        }
        Transform::Decomposed { translation, rotation, scale } => {
            let rotation = DQuat::from_array(rotation.map(f64::from));
            let rotation = if rotation.length() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
            DAffine3::from_scale_rotation_translation(wide(scale), rotation, wide(translation))
        }
    }
}
