//! Writes glTF. In flow meshes and JSON, out flow files.

use std::fs;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use vitrum::scene::Mesh;

/// Numbers of the components of accessors, as glTF counts them.
pub const U8: u32 = 5121;
pub const I16: u32 = 5122;
pub const U16: u32 = 5123;
pub const U32: u32 = 5125;
pub const F32: u32 = 5126;

/// A model: its JSON, which tests fill as they like, and its one buffer.
pub struct Model {
    pub json: Value,
    pub buffer: Vec<u8>,
}

impl Model {
    /// Without anything to see.
    pub fn new() -> Self {
        let json = json!({ "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [] }], "nodes": [],
            "meshes": [], "materials": [], "accessors": [], "bufferViews": [], "buffers": [] });
        Self { json, buffer: Vec::new() }
    }

    /// The number of the new member of a list.
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let all = self.json[list].as_array_mut().expect("a list");
        all.push(value);
        all.len() - 1
    }

    /// The number of a new view of `bytes`.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        let offset = self.buffer.len();
        self.buffer.extend(bytes);
        self.push("bufferViews", json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() }))
    }

    /// The number of a new accessor of `count` elements in `bytes`.
    pub fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let view = self.view(bytes);
        let mut accessor = json!({ "bufferView": view, "componentType": component, "type": kind, "count": count });
        if kind == "VEC3" {
            // The format wants them of positions, and nobody here reads them.
            (accessor["min"], accessor["max"]) = (json!([0, 0, 0]), json!([1, 1, 1]));
        }
        self.push("accessors", accessor)
    }

    /// A primitive that shows `mesh`.
    pub fn primitive(&mut self, mesh: &Mesh, material: Option<usize>) -> Value {
        let bytes = |vectors: &[[f32; 3]]| vectors.iter().flatten().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>();
        let count = mesh.positions.len();
        let mut primitive =
            json!({ "attributes": { "POSITION": self.accessor(&bytes(&mesh.positions), F32, "VEC3", count) } });
        if !mesh.normals.is_empty() {
            primitive["attributes"]["NORMAL"] = self.accessor(&bytes(&mesh.normals), F32, "VEC3", count).into();
        }
        if !mesh.uvs.is_empty() {
            let down = mesh.uvs.iter().flat_map(|&[u, v]| [u, 1.0 - v]).flat_map(f32::to_le_bytes);
            let down: Vec<_> = down.collect();
            primitive["attributes"]["TEXCOORD_0"] = self.accessor(&down, F32, "VEC2", count).into();
        }
        let indices: Vec<_> = mesh.triangles.iter().flatten().flat_map(|vertex| vertex.to_le_bytes()).collect();
        primitive["indices"] = self.accessor(&indices, U32, "SCALAR", 3 * mesh.triangles.len()).into();
        if let Some(material) = material {
            primitive["material"] = material.into();
        }
        primitive
    }

    /// The number of a new mesh of these primitives.
    pub fn mesh(&mut self, primitives: &[Value]) -> usize {
        self.push("meshes", json!({ "primitives": primitives }))
    }

    /// The number of a new node at the top of the scene.
    pub fn node(&mut self, node: Value) -> usize {
        let number = self.push("nodes", node);
        self.json["scenes"][0]["nodes"].as_array_mut().expect("a list").push(number.into());
        number
    }

    /// A model that shows one mesh.
    pub fn of(mesh: &Mesh, material: Option<Value>) -> Self {
        let mut model = Self::new();
        let material = material.map(|material| model.push("materials", material));
        let primitive = model.primitive(mesh, material);
        let mesh = model.mesh(&[primitive]);
        model.node(json!({ "mesh": mesh }));
        model
    }

    /// The JSON with a buffer at `uri`, and without empty lists, which the format forbids.
    fn with_buffer(&self, uri: Option<String>) -> String {
        let mut json = self.json.clone();
        let mut buffer = json!({ "byteLength": self.buffer.len() });
        if let Some(uri) = uri {
            buffer["uri"] = uri.into();
        }
        if let Some(all) = json.as_object_mut() {
            all.insert("buffers".into(), json!([buffer]));
            all.retain(|_, value| value.as_array().is_none_or(|list| !list.is_empty()));
        }
        json.to_string()
    }

    /// As a binary file holds it.
    pub fn glb(&self) -> Vec<u8> {
        let mut json = self.with_buffer(None).into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut buffer = self.buffer.clone();
        buffer.resize(buffer.len().next_multiple_of(4), 0);
        let mut all = b"glTF".to_vec();
        for word in [2, 28 + json.len() + buffer.len(), json.len()] {
            all.extend((word as u32).to_le_bytes());
        }
        all.extend(b"JSON");
        all.extend(&json);
        all.extend((buffer.len() as u32).to_le_bytes());
        all.extend(b"BIN\0");
        all.extend(&buffer);
        all
    }

    /// As text with the buffer in it.
    pub fn embedded(&self) -> String {
        self.with_buffer(Some(format!("data:application/octet-stream;base64,{}", STANDARD.encode(&self.buffer))))
    }

    /// As a binary file.
    pub fn write_glb(&self, folder: &Path) -> PathBuf {
        write(folder.join("model.glb"), &self.glb())
    }

    /// As text, with the buffer beside it, in a file with a space in its name.
    pub fn write_gltf(&self, folder: &Path) -> PathBuf {
        write(folder.join("the buffer.bin"), &self.buffer);
        write(folder.join("model.gltf"), self.with_buffer(Some("the%20buffer.bin".into())).as_bytes())
    }
}

fn write(path: PathBuf, bytes: &[u8]) -> PathBuf {
    fs::write(&path, bytes).expect("a file");
    path
}
