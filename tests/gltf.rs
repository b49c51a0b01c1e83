//! Models in glTF: what they hold arrives as it was meant, and what is wrong with them is said.

#[path = "common/mod.rs"]
mod common;
#[allow(dead_code, reason = "each test program uses its share")]
#[path = "tree/shapes.rs"]
mod shapes;

use std::f64::consts::{FRAC_PI_3, PI};
use std::fmt::Write;
use std::fs;
use std::path::Path;

use glam::{DAffine3, DVec2, DVec3};
use serde_json::{Value, json};

use common::Validated;
use common::gltf::{F32, I16, Model, U8, U16};
use shapes::{cuboid, icosphere, prism, rectangle};
use vitrum::options::{Model as Transport, RenderArgs, Size};
use vitrum::passes::{Rendered, render};
use vitrum::plan::Plan;
use vitrum::scene::{
    Coating, Cutout, Dielectric, Dispersion, Environment, Mesh, NormalMap, Opaque, Overrides, Panorama, RawMesh, Scene,
    Surface, Surroundings, Texels, TextureMap, Wrap,
};

fn load(path: &Path) -> Scene {
    Scene::load(Some(path), &Overrides::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn loaded(model: &Model) -> Scene {
    let folder = tempfile::tempdir().expect("a folder");
    load(&model.write_glb(folder.path()))
}

/// What is said of a model that cannot be read.
fn refused(model: &Model) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let error = Scene::load(Some(&model.write_glb(folder.path())), &Overrides::default()).expect_err("a refusal");
    assert_eq!(error.exit_code(), 2);
    error.to_string()
}

fn picture(validated: &Validated, scene: &Scene, model: Transport, samples: u32) -> Rendered {
    let args = RenderArgs {
        model: Some(model.into()),
        size: Some(Size { width: 48, height: 36 }),
        samples: Some(samples),
        ..RenderArgs::default()
    };
    let mut scene = scene.clone();
    scene.frame(4.0 / 3.0);
    let plan = Plan::new(&scene, &args).expect("a plan");
    render(&validated.gpu, &scene, &plan, &mut |_| {}).expect("a picture")
}

/// A mesh as OBJ text, whose numbers read back exactly.
fn obj(mesh: &Mesh) -> String {
    let mut text = String::new();
    for [x, y, z] in &mesh.positions {
        writeln!(text, "v {x} {y} {z}").expect("text");
    }
    for [u, v] in &mesh.uvs {
        writeln!(text, "vt {u} {v}").expect("text");
    }
    for [x, y, z] in &mesh.normals {
        writeln!(text, "vn {x} {y} {z}").expect("text");
    }
    for triangle in &mesh.triangles {
        text.push('f');
        for corner in triangle.map(|vertex| vertex + 1) {
            match (mesh.uvs.is_empty(), mesh.normals.is_empty()) {
                (true, true) => write!(text, " {corner}"),
                (true, false) => write!(text, " {corner}//{corner}"),
                (false, true) => write!(text, " {corner}/{corner}"),
                (false, false) => write!(text, " {corner}/{corner}/{corner}"),
            }
            .expect("text");
        }
        text.push('\n');
    }
    text
}

fn with_uvs(mesh: Mesh) -> Mesh {
    let uvs = mesh.positions.iter().map(|[x, y, _]| [x * 0.25 + 0.5, y * 0.25 + 0.5]).collect();
    Mesh { uvs, ..mesh }
}

/// A transparent material.
fn glass(extensions: Value) -> Value {
    let mut material = json!({ "pbrMetallicRoughness": { "roughnessFactor": 0.0, "metallicFactor": 0.0 }, "extensions": {
        "KHR_materials_transmission": { "transmissionFactor": 1.0 } } });
    for (name, value) in extensions.as_object().expect("an object") {
        material["extensions"][name] = value.clone();
    }
    material
}

fn dielectric(scene: &Scene) -> &Dielectric {
    match &scene.materials[scene.objects[0].material].surface {
        Surface::Dielectric(dielectric) => dielectric,
        other => panic!("{other:?}"),
    }
}

/// The same scene as TOML with OBJ and as glTF in its three forms makes the same picture, bit for bit.
#[test]
fn the_same_scene_makes_the_same_picture() {
    let Some(validated) = Validated::open() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let checker = image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([40 + 50 * x as u8, 200, 30 + 60 * y as u8]));
    checker.save(folder.join("checker.png")).expect("an image");
    let (ball, floor, block) =
        (icosphere(3), with_uvs(rectangle(6.0, 6.0)), cuboid(DVec3::splat(-0.375), DVec3::splat(0.375)));
    for (name, mesh) in [("ball", &ball), ("floor", &floor), ("block", &block)] {
        fs::write(folder.join(format!("{name}.obj")), obj(mesh)).expect("a mesh");
    }
    let fov = f64::from(0.6_f32).to_degrees();
    fs::write(
        folder.join("scene.toml"),
        format!(
            "[camera]\nposition = [0, 0.25, 5]\ntarget = [0, 0.25, 4]\nvertical_fov = {fov}\n\n\
            [[light]]\nkind = \"point\"\nposition = [1, 3, 2]\nintensity = [8, 6, 4]\n\n\
            [[light]]\nkind = \"spot\"\nposition = [-1, 0.5, 3]\nintensity = [20, 20, 20]\n\
            direction = [0, 0, -1]\nouter_cone_angle = {fov}\n\n\
            [[light]]\nkind = \"directional\"\ndirection = [0, 0, -1]\nirradiance = [0.5, 0.25, 0.125]\n\n\
            [material.tea]\nkind = \"dielectric\"\nior = 1.4\nroughness = 0.25\ndispersion = 0.5\n\
            attenuation_color = [0.9, 0.5, 0.25]\nattenuation_distance = 0.75\n\n\
            [material.floor]\nkind = \"opaque\"\nbase_color_texture = \"checker.png\"\nroughness = 0.5\n\n\
            [material.metal]\nkind = \"opaque\"\nbase_color = [0.9, 0.7, 0.3]\nmetallic = 1.0\nroughness = 0.3\n\
            emission = [0.5, 0.25, 0]\n\n\
            [[object]]\nmesh = \"ball.obj\"\nmaterial = \"tea\"\ntranslate = [-1, 0.25, 0]\n\n\
            [[object]]\nmesh = \"ball.obj\"\nmaterial = \"tea\"\ntranslate = [1, 0, -0.5]\nscale = [0.5, 0.75, 0.5]\n\n\
            [[object]]\nmesh = \"floor.obj\"\nmaterial = \"floor\"\ntranslate = [0, 0, -2]\n\n\
            [[object]]\nmesh = \"block.obj\"\nmaterial = \"metal\"\ntranslate = [0, -0.5, 1]\n"
        ),
    )
    .expect("a scene");

    let mut model = Model::new();
    let tea = glass(json!({ "KHR_materials_ior": { "ior": 1.4 }, "KHR_materials_dispersion": { "dispersion": 0.5 },
        "KHR_materials_volume": { "thicknessFactor": 1.0, "attenuationColor": [0.9, 0.5, 0.25], "attenuationDistance": 0.75 } }));
    let tea = model.push("materials", tea);
    model.json["materials"][tea]["pbrMetallicRoughness"]["roughnessFactor"] = json!(0.25);
    let view = model.view(&fs::read(folder.join("checker.png")).expect("an image"));
    let source = model.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
    let texture = model.push("textures", json!({ "source": source }));
    let wood = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": texture }, "roughnessFactor": 0.5,
        "metallicFactor": 0.0 } });
    let wood = model.push("materials", wood);
    let metal = json!({ "emissiveFactor": [0.5, 0.25, 0.0],
        "pbrMetallicRoughness": { "baseColorFactor": [0.9, 0.7, 0.3, 1.0], "roughnessFactor": 0.3 } });
    let metal = model.push("materials", metal);
    let shown = [(&ball, tea), (&floor, wood), (&block, metal)].map(|(mesh, material)| {
        let primitive = model.primitive(mesh, Some(material));
        model.mesh(&[primitive])
    });
    model.push("cameras", json!({ "type": "perspective", "perspective": { "yfov": 0.6_f32, "znear": 0.1 } }));
    model.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "point", "intensity": 8.0, "color": [1.0, 0.75, 0.5] },
        { "type": "spot", "intensity": 20.0, "spot": { "innerConeAngle": 0.0, "outerConeAngle": 0.6_f32 } },
        { "type": "directional", "intensity": 0.5, "color": [1.0, 0.5, 0.25] }] } });
    model.node(json!({ "mesh": shown[0], "translation": [-1, 0.25, 0] }));
    // Nodes within nodes, and a matrix.
    let inner = model.push(
        "nodes",
        json!({ "mesh": shown[0],
        "matrix": [0.5, 0, 0, 0, 0, 0.75, 0, 0, 0, 0, 0.5, 0, 0, 0, -0.5, 1] }),
    );
    model.node(json!({ "children": [inner], "translation": [1, 0, 0] }));
    model.node(json!({ "mesh": shown[1], "translation": [0, 0, -2] }));
    model.node(json!({ "mesh": shown[2], "translation": [0, -0.5, 1] }));
    model.node(json!({ "camera": 0, "translation": [0, 0.25, 5] }));
    model.node(json!({ "translation": [1, 3, 2], "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    // Along -z, without a rotation that 32 bits would round.
    model.node(json!({ "translation": [-1, 0.5, 3], "extensions": { "KHR_lights_punctual": { "light": 1 } } }));
    model.node(json!({ "extensions": { "KHR_lights_punctual": { "light": 2 } } }));

    let wanted = load(&folder.join("scene.toml"));
    fs::write(folder.join("embedded.gltf"), model.embedded()).expect("a model");
    for path in [model.write_glb(folder), model.write_gltf(folder), folder.join("embedded.gltf")] {
        let found = load(&path);
        assert_eq!(found.warnings, Vec::<String>::new());
        assert_eq!((found.camera.position, found.lights.clone()), (wanted.camera.position, wanted.lights.clone()));
        // It turns around what it looks at.
        let middle = found.bounds().expect("objects").center();
        assert_eq!(found.camera.target, DVec3::new(0.0, 0.25, middle.z));
        assert_eq!(found.meshes.len(), 3, "one mesh, wherever it stands");
        for transport in [Transport::Path, Transport::Double] {
            let [a, b] = [&wanted, &found].map(|scene| picture(&validated, scene, transport, 4).radiance);
            assert!(a.iter().flatten().any(|&x| x > 0.0));
            let off = a.iter().zip(&b).filter(|(a, b)| a != b).count();
            assert_eq!(off, 0, "pixels differ: {transport:?} of {}", path.display());
        }
    }
    validated.verdict();
}

/// KHR_materials_volume: what is twice as thick lets the square through, and light is what the distance says.
#[test]
fn thickness_darkens_by_beer_lambert() {
    let Some(validated) = Validated::open() else { return };
    let color = [0.8_f64, 0.4, 0.1];
    for thickness in [0.25, 0.5, 1.0] {
        let slab = cuboid(DVec3::new(-2.0, -2.0, -thickness), DVec3::new(2.0, 2.0, 0.0));
        let material = glass(json!({ "KHR_materials_ior": { "ior": 1.0 },
            "KHR_materials_volume": { "thicknessFactor": 0.1, "attenuationColor": color, "attenuationDistance": 0.5 } }));
        let mut scene = loaded(&Model::of(&slab, Some(material)));
        scene.environment.light = Surroundings::Color(DVec3::ONE);
        scene.framed = false;
        scene.camera.position = DVec3::new(0.0, 0.0, 4.0);
        scene.camera.target = DVec3::ZERO;
        scene.camera.vertical_fov = 1e-3;
        let found = picture(&validated, &scene, Transport::Tree, 1).radiance[48 * 18 + 24];
        for (found, color) in found.into_iter().zip(color) {
            let wanted = color.powf(thickness / 0.5);
            assert!((f64::from(found) / wanted - 1.0).abs() < 1e-4, "{thickness}: {found}, not {wanted}");
        }
    }
    validated.verdict();
}

/// KHR_materials_ior: an index of 1 is invisible.
#[test]
fn an_index_of_1_is_invisible() {
    let Some(validated) = Validated::open() else { return };
    let volume = json!({ "thicknessFactor": 1.0 });
    let material = |ior: f64| glass(json!({ "KHR_materials_ior": { "ior": ior }, "KHR_materials_volume": volume }));
    let pictures = [1.0, 1.2].map(|ior| {
        let mut scene = loaded(&Model::of(&icosphere(4), Some(material(ior))));
        scene.frame(4.0 / 3.0);
        let with = picture(&validated, &scene, Transport::Tree, 1).radiance;
        scene.environment.visible = true;
        scene.framed = false;
        scene.objects[0].transform = DAffine3::from_translation(DVec3::Z * 1e4);
        let without = picture(&validated, &scene, Transport::Tree, 1).radiance;
        let off = with.iter().flatten().zip(without.iter().flatten());
        off.map(|(a, b)| (a - b).abs() / (b.abs() + 0.1)).fold(0.0, f32::max)
    });
    assert!(pictures[0] < 2e-3, "{pictures:?}");
    assert!(pictures[1] > 0.1, "{pictures:?}");
    validated.verdict();
}

/// KHR_materials_dispersion: a prism lays a white line out in the order of the spectrum.
#[test]
fn dispersion_orders_the_colours() {
    let Some(validated) = Validated::open() else { return };
    let centers = [0.0, 1.0].map(|dispersion| {
        let material = glass(json!({ "KHR_materials_ior": { "ior": 1.5 },
            "KHR_materials_volume": { "thicknessFactor": 1.0 },
            "KHR_materials_dispersion": { "dispersion": dispersion } }));
        let mut scene = loaded(&Model::of(&prism(1.0, 2.0), Some(material)));
        // Across its edge, which bends what comes from below: a soft white band.
        scene.framed = false;
        (scene.camera.position, scene.camera.target) = (DVec3::new(4.0, 0.5, 0.0), DVec3::Y * 0.5);
        let band = |row: i32| (-f64::from(row - 86).powi(2) / 100.0).exp() as f32;
        let texels = (0..128).flat_map(|row| vec![[band(row); 3]; 256]).collect();
        let light = Surroundings::Image(Panorama::new(256, 128, texels));
        scene.environment = Environment { light, intensity: 1.0, rotation: 0.0, visible: false };
        let picture = picture(&validated, &scene, Transport::Tree, 64).radiance;
        [0, 1, 2].map(|channel| {
            let weight = |pixel: &[f32; 3]| f64::from(pixel[channel].max(0.0));
            let rows = picture.chunks(48).enumerate();
            let sum: f64 = rows.map(|(row, pixels)| row as f64 * pixels.iter().map(weight).sum::<f64>()).sum();
            sum / picture.iter().map(weight).sum::<f64>()
        })
    });
    let [still, spread] = centers;
    assert!(still.iter().all(|x| (x - still[0]).abs() < 1e-3), "{still:?}");
    let ordered = spread[0] < spread[1] && spread[1] < spread[2] || spread[0] > spread[1] && spread[1] > spread[2];
    assert!(ordered && (spread[0] - spread[2]).abs() > 0.02, "{spread:?}");
    validated.verdict();
}

#[test]
fn materials_are_what_the_extensions_say() {
    let clear = loaded(&Model::of(&icosphere(1), None));
    assert_eq!(dielectric(&clear), &Dielectric::default(), "without a material it is clear glass");
    // A surface without a volume has no inside.
    assert!(dielectric(&loaded(&Model::of(&icosphere(1), Some(glass(json!({})))))).thin_walled);
    let thick = glass(json!({ "KHR_materials_volume": { "thicknessFactor": 0.5 },
        "KHR_materials_dispersion": { "dispersion": 0.25 } }));
    let thick = loaded(&Model::of(&icosphere(1), Some(thick)));
    let wanted = Dielectric { roughness: 0.0, dispersion: Dispersion::Khr(0.25), ..Dielectric::default() };
    assert_eq!(dielectric(&thick), &wanted);

    let opaque = |material: Value| match loaded(&Model::of(&icosphere(1), Some(material))).materials.remove(0).surface {
        Surface::Opaque(opaque) => opaque,
        other => panic!("{other:?}"),
    };
    let plain = Opaque { base_color: DVec3::ONE, metallic: 1.0, ..Opaque::default() };
    assert_eq!(opaque(json!({})), plain);
    let lamp = json!({ "emissiveFactor": [1.0, 0.5, 0.0], "extensions": {
        "KHR_materials_emissive_strength": { "emissiveStrength": 8.0 } } });
    assert_eq!(opaque(lamp).emission, DVec3::new(8.0, 4.0, 0.0));
    let unlit = json!({ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.25, 0.125, 1.0] },
        "extensions": { "KHR_materials_unlit": {} } });
    let wanted =
        Opaque { base_color: DVec3::ZERO, emission: DVec3::new(0.5, 0.25, 0.125), specular: 0.0, ..Opaque::default() };
    assert_eq!(opaque(unlit), wanted);
    // What has no light falling on it has none falling through.
    let both = json!({ "extensions": { "KHR_materials_unlit": {}, "KHR_materials_transmission": { "transmissionFactor": 1 } } });
    assert_eq!(opaque(both).emission, DVec3::ONE);
    let dull = json!({ "extensions": { "KHR_materials_specular": { "specularFactor": 0.5 }, "KHR_materials_ior": { "ior": 1.5 } } });
    assert!((opaque(dull).specular - 0.5).abs() < 1e-6);
}

/// Images stand where materials want them, and of one set of coordinates.
#[test]
fn maps_are_where_materials_have_them() {
    let mut model = Model::of(&icosphere(1), Some(json!({ "emissiveFactor": [1, 1, 1] })));
    let mut png = std::io::Cursor::new(Vec::new());
    // Of half of the pixels green is all and blue nothing, of the other half the reverse.
    let halves = image::RgbImage::from_fn(2, 1, |x, _| image::Rgb(if x == 0 { [0, 255, 0] } else { [0, 0, 255] }));
    halves.write_to(&mut png, image::ImageFormat::Png).expect("an image");
    let view = model.view(&png.into_inner());
    // Without the kind of it, which its bytes tell.
    model.push("images", json!({ "bufferView": view }));
    model.push("textures", json!({ "source": 0 }));
    model.json["materials"][0]["emissiveTexture"] = json!({ "index": 0 });
    model.json["materials"][0]["pbrMetallicRoughness"] = json!({ "metallicRoughnessTexture": { "index": 0 } });
    let scene = loaded(&model);
    let Surface::Opaque(opaque) = &scene.materials[0].surface else { panic!("{:?}", scene.materials) };
    // As numbers and as colours, which are two textures.
    assert_eq!(opaque.metallic_roughness_texture, Some(TextureMap::of(0)));
    assert_eq!(opaque.emission_texture, Some(TextureMap::of(1)));
    assert!(
        matches!(scene.textures[0].texels, Texels::Unorm(_)) && matches!(scene.textures[1].texels, Texels::Srgb(_))
    );
    assert_eq!((opaque.metallic, opaque.roughness, opaque.emission), (1.0, 1.0, DVec3::ONE));

    model.push("samplers", json!({ "wrapS": 33071, "wrapT": 33648 }));
    model.push("textures", json!({ "source": 0, "sampler": 0 }));
    model.json["materials"][0]["normalTexture"] = json!({ "index": 1, "scale": 0.5,
        "extensions": { "KHR_texture_transform": { "offset": [0.25, 0.0] } } });
    model.json["materials"][0]["alphaMode"] = json!("MASK");
    model.json["materials"][0]["emissiveTexture"] = json!({ "index": 0, "texCoord": 1 });
    let scene = loaded(&model);
    let material = &scene.materials[0];
    let Surface::Opaque(opaque) = &material.surface else { panic!("{material:?}") };
    let map = TextureMap { wrap: [Wrap::Clamp, Wrap::Mirror], offset: DVec2::new(0.25, 0.0), ..TextureMap::of(0) };
    assert_eq!(material.normal_map, Some(NormalMap { map, scale: 0.5 }));
    // Without alpha there is nothing to leave out, and of the second set of coordinates nothing is read.
    assert_eq!((material.cutout, opaque.emission_texture), (None, None));
    let warnings = scene.warnings.join("\n");
    assert!(warnings.contains("images on a second set of texture coordinates"), "{warnings}");

    // Glass that is painted, and metal in places.
    let mut glass = glass(json!({}));
    glass["extensions"]["KHR_materials_transmission"] =
        json!({ "transmissionFactor": 0.5, "transmissionTexture": { "index": 0 } });
    glass["pbrMetallicRoughness"] =
        json!({ "metallicRoughnessTexture": { "index": 0 }, "baseColorFactor": [1, 0.5, 0.25, 0.5] });
    glass["alphaMode"] = json!("BLEND");
    model.json["materials"][0] = glass;
    let scene = loaded(&model);
    let Surface::Dielectric(Dielectric { roughness, metallic_roughness_texture, coating, .. }) =
        &scene.materials[0].surface
    else {
        panic!("{:?}", scene.materials)
    };
    assert_eq!((*roughness, *metallic_roughness_texture), (1.0, Some(TextureMap::of(0))));
    let wanted = Coating {
        base_color: DVec3::new(1.0, 0.5, 0.25),
        transmission: 0.5,
        transmission_texture: Some(TextureMap::of(0)),
        metallic: 1.0,
        ..Coating::default()
    };
    assert_eq!(coating.as_deref(), Some(&wanted));
    assert_eq!(scene.materials[0].cutout, Some(Cutout { alpha: 0.5, map: None, cutoff: None }));
    // Metal lets nothing through.
    let mut metal = json!({ "extensions": { "KHR_materials_transmission": { "transmissionFactor": 1 } } });
    metal["name"] = json!("tin");
    model.json["materials"][0] = metal;
    let scene = loaded(&model);
    assert!(matches!(scene.materials[0].surface, Surface::Opaque(_)));
    assert!(
        scene.warnings.iter().any(|warning| warning.contains("\"tin\": metallicFactor is 1")),
        "{:?}",
        scene.warnings
    );
}

/// Names of one's own are no fault, and arrays may serve many primitives.
#[test]
fn what_programs_write_is_read() {
    let ball = icosphere(3);
    let mut model = Model::new();
    let primitive = model.primitive(&with_uvs(ball.clone()), None);
    let mut primitives = Vec::new();
    for number in 0..60 {
        let material = model.push("materials", json!({ "name": format!("m{number}") }));
        let mut own = primitive.clone();
        own["material"] = material.into();
        own["attributes"]["_MINE"] = own["attributes"]["POSITION"].clone();
        own["indices"] = model.accessor(&[0, 1, 2], U8, "SCALAR", 3).into();
        primitives.push(own);
    }
    let mesh = model.mesh(&primitives);
    model.node(json!({ "mesh": mesh }));
    let scene = loaded(&model);
    assert_eq!(scene.objects.len(), 60);
    assert!(scene.meshes.iter().all(|mesh| mesh.positions.len() == 3), "each has what it needs");
}

/// Whatever arrays are made of, the mesh is the same.
#[test]
fn arrays_are_read_in_every_form() {
    let ball = icosphere(1);
    let wanted = loaded(&Model::of(&ball, None)).meshes[0].clone();
    let same = |what: &str, model: &Model| {
        let found = loaded(model).meshes[0].clone();
        assert_eq!((&found.positions, &found.triangles), (&wanted.positions, &wanted.triangles), "{what}");
    };
    let corners = || ball.triangles.iter().flatten().copied();
    let count = corners().count();

    let mut model = Model::of(&ball, None);
    let bytes: Vec<_> = corners().map(|corner| corner as u8).collect();
    model.json["meshes"][0]["primitives"][0]["indices"] = model.accessor(&bytes, U8, "SCALAR", count).into();
    same("bytes", &model);
    let bytes: Vec<_> = corners().flat_map(|corner| (corner as u16).to_le_bytes()).collect();
    model.json["meshes"][0]["primitives"][0]["indices"] = model.accessor(&bytes, U16, "SCALAR", count).into();
    same("words", &model);

    // Positions and normals by turns.
    let mut model = Model::of(&ball, None);
    let turns = ball.positions.iter().zip(&ball.normals).flat_map(|(p, n)| [p, n]).flatten();
    let turns: Vec<_> = turns.flat_map(|x| x.to_le_bytes()).collect();
    let view = model.view(&turns);
    model.json["bufferViews"][view]["byteStride"] = json!(24);
    for (name, offset) in [("POSITION", 0), ("NORMAL", 12)] {
        let accessor = json!({ "bufferView": view, "byteOffset": offset, "componentType": F32, "type": "VEC3",
            "count": ball.positions.len(), "min": [-1, -1, -1], "max": [1, 1, 1] });
        model.json["meshes"][0]["primitives"][0]["attributes"][name] = model.push("accessors", accessor).into();
    }
    same("by turns", &model);

    // Zeros, of which some are replaced: here, all.
    let mut model = Model::of(&ball, None);
    let count = ball.positions.len();
    let places: Vec<_> = (0..count as u16).flat_map(u16::to_le_bytes).collect();
    let values: Vec<_> = ball.positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    let (places, values) = (model.view(&places), model.view(&values));
    let accessor = json!({ "componentType": F32, "type": "VEC3", "count": count, "min": [-1, -1, -1], "max": [1, 1, 1],
        "sparse": { "count": count, "indices": { "bufferView": places, "componentType": U16 },
            "values": { "bufferView": values } } });
    model.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = model.push("accessors", accessor).into();
    same("sparse", &model);

    // KHR_mesh_quantization.
    let mut model = Model::of(&ball, None);
    let short = |x: f32| (x * 32767.0).round() as i16;
    let bytes: Vec<_> = ball.positions.iter().flat_map(|p| [short(p[0]), short(p[1]), short(p[2]), 0]).collect();
    let view = model.view(&bytes.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>());
    model.json["bufferViews"][view]["byteStride"] = json!(8);
    let accessor = json!({ "bufferView": view, "componentType": I16, "normalized": true, "type": "VEC3", "count": count,
        "min": [-1, -1, -1], "max": [1, 1, 1] });
    model.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = model.push("accessors", accessor).into();
    model.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let found = loaded(&model).meshes[0].clone();
    let off = found.positions.iter().flatten().zip(ball.positions.iter().flatten()).map(|(a, b)| (a - b).abs());
    assert!(off.fold(0.0, f32::max) < 1e-4);
}

#[test]
fn strips_and_fans_turn_the_same_way() {
    let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0_f32]];
    let raw = RawMesh { positions: square.to_vec(), triangles: vec![[0, 1, 2], [1, 3, 2]], ..RawMesh::default() };
    let mesh = Mesh::new(raw).expect("a square");
    for (mode, corners) in [(5, [0_u8, 1, 2, 3]), (6, [0, 1, 3, 2])] {
        let mut model = Model::of(&mesh, None);
        let indices = model.accessor(&corners, U8, "SCALAR", 4);
        model.json["meshes"][0]["primitives"][0]["indices"] = indices.into();
        model.json["meshes"][0]["primitives"][0]["mode"] = mode.into();
        let found = loaded(&model).meshes[0].clone();
        assert_eq!(found.triangles.len(), 2);
        for triangle in &found.triangles {
            let [a, b, c] = triangle.map(|vertex| glam::Vec3::from(found.positions[vertex as usize]));
            assert_eq!((b - a).cross(c - a), glam::Vec3::Z, "mode {mode}");
        }
    }
}

/// What is split by materials is two meshes, what is not is one: a closed surface stays closed.
#[test]
fn primitives_of_one_material_are_one_surface() {
    let ball = icosphere(1);
    let half = ball.triangles.len() / 2;
    for (materials, meshes, closed) in [([0, 0], 1, true), ([0, 1], 2, false)] {
        let mut model = Model::new();
        for _ in 0..2 {
            model.push("materials", glass(json!({ "KHR_materials_volume": { "thicknessFactor": 1.0 } })));
        }
        let primitives: Vec<_> = [&ball.triangles[..half], &ball.triangles[half..]]
            .into_iter()
            .zip(materials)
            .map(|(triangles, material)| {
                let part = Mesh { triangles: triangles.to_vec(), ..ball.clone() };
                model.primitive(&part, Some(material))
            })
            .collect();
        let mesh = model.mesh(&primitives);
        model.node(json!({ "mesh": mesh }));
        let scene = loaded(&model);
        assert_eq!(scene.meshes.len(), meshes);
        assert!(scene.meshes.iter().all(|mesh| mesh.faults.is_closed() == closed));
        assert!(scene.objects.iter().all(|object| object.number == 0));
    }
}

/// KHR_texture_transform: scaled, then turned counter-clockwise as seen on the image, then moved.
#[test]
fn images_are_turned_as_they_should() {
    let mut model = Model::of(&with_uvs(rectangle(2.0, 2.0)), Some(json!({})));
    let png = {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let gray = image::RgbImage::from_pixel(1, 1, image::Rgb([255; 3]));
        gray.write_to(&mut bytes, image::ImageFormat::Png).expect("an image");
        bytes.into_inner()
    };
    let view = model.view(&png);
    model.push("images", json!({ "bufferView": view, "mimeType": "image/png" }));
    model.push("textures", json!({ "source": 0 }));
    let transform = json!({ "offset": [0.25, 0.5], "rotation": std::f64::consts::FRAC_PI_2, "scale": [2.0, 3.0] });
    model.json["materials"][0]["pbrMetallicRoughness"] = json!({ "baseColorFactor": [0.5, 0.25, 1.0, 1.0],
        "baseColorTexture": { "index": 0, "extensions": { "KHR_texture_transform": transform } } });
    let scene = loaded(&model);
    assert_eq!(scene.meshes[0].uvs, with_uvs(rectangle(2.0, 2.0)).uvs);
    let Surface::Opaque(opaque) = &scene.materials[0].surface else { panic!("{:?}", scene.materials) };
    assert_eq!(opaque.base_color, DVec3::new(0.5, 0.25, 1.0));
    let map = opaque.base_color_texture.expect("an image");
    for (u, v) in [(0.0, 0.0), (0.3, 0.9)] {
        // A quarter turn takes what lies to the right to above, where v is less.
        let found = map.turn * DVec2::new(u, v) + map.offset;
        let wanted = DVec2::new(0.25 + 3.0 * v, 0.5 - 2.0 * u);
        assert!((found - wanted).length() < 1e-6, "{u} {v}: {found}");
    }
}

#[test]
fn what_is_not_supported_is_named_once() {
    let mut model = Model::of(
        &icosphere(1),
        Some(json!({ "occlusionTexture": { "index": 0 },
        "extensions": { "KHR_materials_clearcoat": { "clearcoatFactor": 1.0 } } })),
    );
    model.push("textures", json!({}));
    model.json["extensionsUsed"] = json!(["KHR_materials_clearcoat", "KHR_materials_ior"]);
    model.json["extensions"] =
        json!({ "KHR_lights_punctual": { "lights": [{ "type": "spot", "spot": {}, "range": 4.0 }] } });
    for _ in 0..2 {
        model.node(json!({ "mesh": 0, "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    }
    let warnings = loaded(&model).warnings.join("\n");
    for wanted in ["left out: KHR_materials_clearcoat\n", "left out: occlusion textures", "left out: ranges of lights"]
    {
        assert_eq!(format!("{warnings}\n").matches(wanted).count(), 1, "{wanted}: {warnings}");
    }
}

/// A cone with a hard edge is one, as programs write it that know no soft one; angles that are none are told.
#[test]
fn cones_of_spots_are_taken_or_told() {
    let with = |spot: Value, scale: f64| {
        let mut model = Model::of(&icosphere(1), None);
        model.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [{ "type": "spot", "spot": spot }] } });
        model.node(json!({ "scale": [scale, scale, scale], "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
        let scene = loaded(&model);
        (scene.lights.len(), scene.warnings.join("\n"))
    };
    let hard = json!({ "innerConeAngle": FRAC_PI_3, "outerConeAngle": FRAC_PI_3 });
    assert_eq!(with(hard, 1.0), (1, String::new()));
    assert_eq!(with(json!({}), 1.0), (1, String::new()));
    let (count, said) = with(json!({ "innerConeAngle": 0.9 }), 1.0);
    assert!(count == 0 && said.contains("light 0: its angles 0.9 and 0.7853982 are not"), "{said}");
    let (count, said) = with(json!({}), 0.0);
    assert!(count == 0 && said.contains("light 0: its node is scaled to nothing"), "{said}");
}

#[test]
fn faults_are_told_with_their_place() {
    let ball = || Model::of(&icosphere(1), None);
    type Change<'a> = &'a dyn Fn(&mut Model);
    let with = |change: Change<'_>| {
        let mut model = ball();
        change(&mut model);
        refused(&model)
    };
    let cases: [(&str, Change<'_>); 12] = [
        ("is compressed with KHR_draco_mesh_compression", &|model| {
            model.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
        }),
        ("requires EXT_unheard_of, which is not supported", &|model| {
            model.json["extensionsRequired"] = json!(["EXT_unheard_of"]);
        }),
        ("node 0 is below two others, or below itself", &|model| model.json["nodes"][0]["children"] = json!([0])),
        ("buffer view 0 reaches beyond its buffer", &|model| {
            model.json["bufferViews"][0]["byteLength"] = json!(1_000_000);
        }),
        ("accessor 0 reaches beyond its buffer view", &|model| model.json["accessors"][0]["count"] = json!(1000)),
        ("accessor 0 has 4000000000 elements: more than the buffers hold", &|model| {
            model.json["accessors"][0]["count"] = json!(4_000_000_000_u64);
        }),
        ("an index is ", &|model| model.json["accessors"][0]["count"] = json!(3)),
        ("camera 0 lacks what its type says", &|model| {
            model.push(
                "cameras",
                json!({ "type": "perspective", "orthographic": { "xmag": 1, "ymag": 1, "zfar": 2, "znear": 1 } }),
            );
        }),
        ("buffer view 0 reaches beyond its buffer", &|model| {
            model.json["bufferViews"][0]["byteOffset"] = json!(u64::MAX);
        }),
        ("shows no triangles", &|model| model.json["scenes"][0]["nodes"] = json!([])),
        ("meshes[0].primitives[0].indices", &|model| {
            model.json["meshes"][0]["primitives"][0]["indices"] = json!(99);
        }),
        ("cannot be read as glTF", &|model| model.json["nodes"] = json!(7)),
    ];
    for (wanted, change) in cases {
        let found = with(change);
        assert!(found.contains("model.glb") && found.contains(wanted), "{wanted}: {found}");
    }
    // A buffer in a file that is not there.
    let folder = tempfile::tempdir().expect("a folder");
    let path = ball().write_gltf(folder.path());
    fs::remove_file(folder.path().join("the buffer.bin")).expect("it is gone");
    let error = Scene::load(Some(&path), &Overrides::default()).expect_err("a refusal").in_full();
    assert!(error.contains("the buffer.bin: cannot read"), "{error}");
    fs::write(&path, "{\n  \"asset\": 1\n}").expect("a file");
    let error = Scene::load(Some(&path), &Overrides::default()).expect_err("a refusal").to_string();
    assert!(error.contains("model.gltf:2: cannot be read as glTF"), "{error}");
}

/// As an object of a scene file a model brings its own materials, not its camera and lights, and wears another's.
#[test]
fn models_are_objects_of_scenes() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut model = Model::of(&icosphere(1), Some(json!({ "name": "coat" })));
    model.push("cameras", json!({ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }));
    model.node(json!({ "camera": 0 }));
    model.node(json!({ "mesh": 0, "translation": [3, 0, 0] }));
    model.write_glb(folder.path());
    let scene = |material: &str| {
        let text = format!(
            "[[object]]\nmesh = \"model.glb\"\n{material}translate = [0, 2, 0]\n[material.own]\nkind = \"opaque\"\n"
        );
        fs::write(folder.path().join("scene.toml"), text).expect("a scene");
        load(&folder.path().join("scene.toml"))
    };
    let own = scene("");
    assert!(own.framed && own.objects.len() == 2 && own.meshes.len() == 1);
    assert_eq!(own.objects.iter().map(|object| object.number).collect::<Vec<_>>(), [0, 0]);
    assert_eq!(own.objects[1].transform.translation, DVec3::new(3.0, 2.0, 0.0));
    assert_eq!(own.materials[own.objects[0].material].name, "coat");
    let other = scene("material = \"own\"\n");
    assert_eq!(other.materials[other.objects[0].material].name, "own");
}

/// A sun lights a white board by its irradiance and the cosine, everywhere the same.
#[test]
fn directional_lights_shine_everywhere_alike() {
    let Some(validated) = Validated::open() else { return };
    let white = json!({ "pbrMetallicRoughness": { "metallicFactor": 0.0 }, "extensions": {
        "KHR_materials_specular": { "specularFactor": 0.0 } } });
    let mut model = Model::of(&rectangle(4.0, 4.0), Some(white));
    model.json["extensions"] = json!({ "KHR_lights_punctual": { "lights": [
        { "type": "directional", "intensity": 3.0, "color": [1.0, 0.5, 0.25] }] } });
    // Sixty degrees off.
    let (sine, cosine) = 30.0_f64.to_radians().sin_cos();
    model.node(json!({ "rotation": [sine, 0, 0, cosine], "extensions": { "KHR_lights_punctual": { "light": 0 } } }));
    let mut scene = loaded(&model);
    assert_eq!((scene.warnings.len(), scene.lights.len()), (0, 1), "{:?}", scene.warnings);
    scene.environment.light = Surroundings::Color(DVec3::ZERO);
    scene.framed = false;
    scene.camera.position = DVec3::new(0.0, 0.0, 2.0);
    scene.camera.target = DVec3::ZERO;
    scene.camera.vertical_fov = 0.5;
    let wanted = DVec3::new(3.0, 1.5, 0.75) * 0.5 / PI;
    for transport in [Transport::Path, Transport::Tree] {
        for pixel in &picture(&validated, &scene, transport, 4).radiance {
            let found = DVec3::from_array(pixel.map(f64::from));
            assert!(((found - wanted) / wanted).abs().max_element() < 2e-3, "{found}, not {wanted}");
        }
    }
    validated.verdict();
}
