//! OBJ and MTL files.

use std::fs;

use glam::{DVec2, DVec3};
use vitrum::scene::{Dielectric, Opaque, Overrides, Scene, Surface, TextureMap, Wrap};

use super::{Folder, TETRAHEDRON, dielectric, opaque};

#[test]
fn what_is_wrong_with_a_mesh_is_told_with_counts() {
    let folder = Folder::new();
    let load = |text: String| {
        folder.write("mesh.obj", text);
        folder.load("mesh.obj")
    };
    let open = load(TETRAHEDRON.replace("f 2 3 4\n", "f 2 2 3\n")).unwrap();
    let expected = "mesh.obj: 3 open edges, 1 degenerate triangle removed; its holes are 58 % of its area: it bounds no medium and counts as thin_walled, unless [material] or --set says thin_walled = false";
    assert_eq!(open.warnings[0], expected);
    let inverted = load(
        TETRAHEDRON
            .replace("f 1 3 2", "f 1 2 3")
            .replace("f 1 2 4", "f 1 4 2")
            .replace("f 1 4 3", "f 1 3 4")
            .replace("f 2 3 4", "f 2 4 3"),
    );
    assert_eq!(inverted.unwrap().warnings[0], "mesh.obj: 1 shell inside out turned");
    for (text, expected) in [
        (TETRAHEDRON.replace("v 0 1 0", "v 0 nan 0"), "mesh.obj:3: vertex coordinate nan: coordinates must be finite"),
        (TETRAHEDRON.replace("v 0 1 0", "v 0 1e39 inf"), "mesh.obj:3: vertex coordinate 1e39"),
        (TETRAHEDRON.replace("v 0 1 0", "v 0 one 0"), "mesh.obj:3: \"one\" is no number; expected v X Y Z"),
        (
            TETRAHEDRON.replace("f 2 3 4", "f 2 3 5"),
            "mesh.obj:8: a face names vertex 5, which does not exist (the file has 4)",
        ),
        (TETRAHEDRON.replace('f', "#"), "mesh.obj: holds no triangles; export faces, not only points"),
        (String::new(), "mesh.obj: holds no triangles"),
        ("v 0 0 0\nf 1 1 1\n".into(), "mesh.obj: holds no triangles but 1 without an area"),
        ("\0\u{1}\u{2}junk".into(), "mesh.obj: is binary, not Wavefront OBJ text"),
    ] {
        let error = load(text).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    }
}

#[test]
fn a_mesh_is_repaired_where_that_is_asked_for() {
    let folder = Folder::new();
    // A corner that is two, a face that is there twice and one that looks inwards.
    let faulty =
        TETRAHEDRON.replace("f 1 3 2\n", "v 1 0 2e-7\nf 1 3 5\nf 1 5 3\nf 1 3 5\n").replace("f 2 3 4", "f 2 4 3");
    folder.write("body.obj", faulty);
    let object = "[[object]]\nmesh = \"body.obj\"\n";
    folder.write("own.toml", format!("[render]\nrepair = true\n{object}"));
    folder.write("plain.toml", object);
    let load = |name: &str, repair, no_render_table| {
        let overrides = Overrides { repair, no_render_table, ..Overrides::default() };
        Scene::load(Some(&folder.path(name)), &overrides).unwrap()
    };
    let wanted = "body.obj: repaired: 1 vertex welded, 2 duplicate faces removed, 1 triangle turned; closed now";
    for (name, repair) in [("body.obj", Some(true)), ("plain.toml", Some(true)), ("own.toml", None)] {
        let scene = load(name, repair, false);
        assert_eq!(scene.warnings, [wanted], "{name}");
        assert!(scene.meshes[0].faults.is_empty() && scene.meshes[0].triangles.len() == 4, "{name}");
        assert!(scene.diagnose()[0].findings.is_empty(), "{name}");
    }
    for (name, repair, alone) in [("body.obj", None, false), ("own.toml", Some(false), false), ("own.toml", None, true)]
    {
        let scene = load(name, repair, alone);
        assert!(!scene.meshes[0].faults.is_closed() && scene.meshes[0].triangles.len() == 6, "{name}");
    }
}

#[test]
fn normals_are_kept_mended_or_dropped() {
    let folder = Folder::new();
    let load = |faces: &str| {
        folder.write("mesh.obj", format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 5\nvn 0 0 0\nvn nan 0 0\n{faces}\n"));
        folder.load("mesh.obj").unwrap()
    };
    let scene = load("f 1//1 2//2 3");
    assert_eq!(scene.meshes[0].normals, [[0.0, 0.0, 1.0]; 3]);
    assert!(scene.warnings[0].contains("2 normals replaced"), "{:?}", scene.warnings);
    assert_eq!(load("f 1//3 2//1 3//2").meshes[0].normals, [[0.0, 0.0, 1.0]; 3]);
    assert!(load("f 1 2 3").meshes[0].normals.is_empty());
    assert!(load("f 1//2 2//3 3").meshes[0].normals.is_empty());
}

#[test]
fn texture_coordinates_are_read_with_their_vertices() {
    let folder = Folder::new();
    let load = |coordinates: &str, faces: &str| {
        folder.write("mesh.obj", format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n{coordinates}\n{faces}\n"));
        folder.load("mesh.obj")
    };
    // What each corner of each triangle has, and the largest vertex number.
    let corners = |coordinates: &str, faces: &str| {
        let mesh = load(coordinates, faces).unwrap().meshes.remove(0);
        assert!(mesh.uvs.is_empty() || mesh.uvs.len() == mesh.positions.len());
        let corner = |vertex: &u32| (mesh.positions[*vertex as usize], mesh.uvs[*vertex as usize]);
        (mesh.triangles.iter().flatten().map(corner).collect::<Vec<_>>(), mesh.positions.len())
    };
    // v stays as OBJ has it, upwards; a vertex that two triangles share with the same coordinates is one vertex.
    let (a, b, c, d) = ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]);
    let square = "vt 0 0.25\nvt 1 0.25 0.5\nvt 0\nvt -3 8.5";
    let (found, vertices) = corners(square, "f 1/1 2/2 4/4 3/3");
    let [at_a, at_b, at_c, at_d] = [(a, [0.0, 0.25]), (b, [1.0, 0.25]), (c, [0.0, 0.0]), (d, [-3.0, 8.5])];
    assert_eq!((found.as_slice(), vertices), ([at_a, at_b, at_d, at_a, at_d, at_c].as_slice(), 4));
    // A seam splits the vertices along it, with and without normals, and indices may count back.
    let expected = [at_a, at_b, at_d, at_a, (d, [0.0, 0.0]), at_c];
    for (extra, faces) in [
        ("", "f 1/1 2/2 4/4\nf 1/1 4/3 3/3"),
        ("\nvn 0 0 1", "f 1/1/1 2/2/1 4/4/1\nf 1/1/1 4/3/1 3/3/1"),
        ("\nvn 0 0 1", "f -4/-4/-1 -3/-3/-1 -1/-1/-1\nf 1/-4 -1/-2 3/-2"),
    ] {
        let (found, _) = corners(&format!("{square}{extra}"), faces);
        assert_eq!(found, expected, "{faces}");
    }
    assert_eq!(corners(square, "f 1/1 2/2 4/4\nf 1/1 4/3 3/3").1, 5);

    // Corners without any, or with some that are none, have (0, 0), and are counted.
    let (found, _) = corners("vt 0.5 0.75\nvt nan 1\nvt 0 -inf", "f 1/1 2/2 4/3\nf 1/1 4 3");
    assert_eq!(found[0], (a, [0.5, 0.75]));
    assert!(found.iter().all(|(position, uv)| *position == a || *uv == [0.0, 0.0]), "{found:?}");
    let warnings = load("vt 0.5 0.75\nvt nan 1\nvt 0 -inf", "f 1/1 2/2 4/3\nf 1/1 4 3").unwrap().warnings;
    assert!(warnings[0].contains(", 4 texture coordinates replaced by 0"), "{warnings:?}");
    // No usable ones are none, as are those that no face names.
    for (coordinates, faces) in [("", "f 1 2 4"), ("vt 0.5 0.5", "f 1 2 4"), ("vt nan 0\nvt 1 1", "f 1/1 2/1 4")] {
        let scene = load(coordinates, faces).unwrap();
        assert!(scene.meshes[0].uvs.is_empty() && !scene.warnings[0].contains("texture"), "{:?}", scene.warnings);
    }
    for (coordinates, faces, expected) in [
        ("vt 0 0", "f 1/1 2/1 4/2", "mesh.obj:6: a face names texture coordinate 2, which does not exist"),
        ("vt 0 0", "f 1/0 2/1 4/1", "mesh.obj:6: a face names texture coordinate 0, which does not exist"),
        ("vt 0 0", "f 1/-2 2/1 4/1", "mesh.obj:6: a face names texture coordinate -2, which does not exist"),
        ("vt", "f 1/1 2/1 4/1", "mesh.obj:5: \"vt\" lacks a number; expected vt U V"),
        ("vt 0 up", "f 1/1 2/1 4/1", "mesh.obj:5: \"up\" is no number; expected vt U V"),
    ] {
        let error = load(coordinates, faces).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn parts_keep_their_own_texture_coordinates() {
    let folder = Folder::new();
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.25 0.5\no plain\nf 1 2 3\no painted\nf 1/1 2/1 3/1\no mixed\n\
        usemtl a\nf 1/1 2 3\nusemtl b\nf 1 2 3\nusemtl a\nf 3/1 2/1 1/1\n";
    folder.write("mesh.obj", text);
    let scene = folder.load("mesh.obj").unwrap();
    let uvs: Vec<_> = scene.meshes.iter().map(|mesh| (mesh.name.as_str(), mesh.uvs.len())).collect();
    assert_eq!(&uvs[..2], [("mesh.obj (plain)", 0), ("mesh.obj (painted)", 3)]);
    assert!(scene.meshes.iter().all(|mesh| mesh.uvs.is_empty() || mesh.uvs.len() == mesh.positions.len()));
}

#[test]
fn polygons_groups_and_materials_become_triangles_and_parts() {
    let folder = Folder::new();
    let quad = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 2 0\n";
    folder.write("m.mtl", "newmtl red\nKd 1 0 0\nillum 1\nnewmtl clear\nillum 7\nNi 1.3\nTf 0.5 1 1\nPr 0.2\n");
    let objects = "o one\ng a\nusemtl red\nf 1 2 3\ng b\nf 1 3 4\no two\nf 1 2 3 4 5\nusemtl clear\nf 3 4 5\nusemtl red\nf 5 4 1\n";
    folder.write("parts.obj", format!("mtllib m.mtl\n{quad}{objects}usemtl none\nf 1 2 5\n"));
    let scene = folder.scene("[[object]]\nmesh = \"body.obj\"\n[[object]]\nmesh = \"parts.obj\"\n").unwrap();
    let names: Vec<_> = scene.meshes.iter().map(|mesh| (mesh.name.as_str(), mesh.triangles.len())).collect();
    let expected = [
        ("body.obj", 4),
        ("parts.obj (one)", 2),
        ("parts.obj (two)", 4),
        ("parts.obj (two)", 1),
        ("parts.obj (two)", 1),
    ];
    assert_eq!(names, expected);
    assert_eq!(scene.objects.iter().map(|object| object.number).collect::<Vec<_>>(), [0, 1, 1, 1, 1]);
    assert_eq!(opaque(&scene, 1), &Opaque { base_color: DVec3::X, specular: 0.0, ..Opaque::default() });
    let clear = dielectric(&scene, 3);
    assert!((clear.ior - 1.3).abs() < 1e-6 && (clear.roughness - 0.2).abs() < 1e-6);
    assert_eq!((clear.attenuation_color, clear.attenuation_distance), (DVec3::new(0.5, 1.0, 1.0), 1.0));
    assert_eq!(dielectric(&scene, 4), &Dielectric { thin_walled: true, ..Dielectric::default() }, "it is a sheet");
    assert_eq!(scene.materials[scene.objects[0].material].name, "clear glass");
    assert!(
        scene.warnings.iter().any(|w| w.ends_with("material \"none\" is in no MTL file that was read")),
        "{:?}",
        scene.warnings
    );
}

/// What the MTL with these lines makes of a body, and what is said about it.
fn from_mtl(folder: &Folder, lines: &str) -> (Surface, Vec<String>) {
    let scene = with_mtl(folder, lines);
    (scene.materials[scene.objects[0].material].surface.clone(), scene.warnings)
}

fn with_mtl(folder: &Folder, lines: &str) -> Scene {
    folder.write("m.mtl", format!("newmtl m\n{lines}\n"));
    let body = TETRAHEDRON.replace("f 1 ", "f 1/1 ");
    folder.write("mtl.obj", format!("mtllib m.mtl\nusemtl m\nvt 0 0\n{body}"));
    let mut scene = folder.scene("[environment]\ncolor = [1, 1, 1]\n[[object]]\nmesh = \"mtl.obj\"\n").unwrap();
    scene.warnings.retain(|warning| !warning.contains("texture coordinates"));
    scene
}

#[test]
fn mtl_tells_glass_from_opaque_surfaces() {
    let folder = Folder::new();
    let glass = |lines: &str| matches!(from_mtl(&folder, lines).0, Surface::Dielectric(_));
    for lines in
        ["illum 4", "illum 6", "illum 7\nd 1", "illum 9", "d 0.5", "d -halo 0.5", "Tr 0.5", "Ni 1.4", "illum 2\nd 0.1"]
    {
        assert!(glass(lines), "{lines}");
    }
    for lines in [
        "",
        "illum 2",
        "illum 2\nNi 1.45\nd 1.0",
        "Ni 1.45\nd 1",
        "Ni 1",
        "Ni 0",
        "Kd 1 1 1",
        "Tr 0",
        "illum 3\nNi 1.5",
    ] {
        assert!(!glass(lines), "{lines}");
    }
}

#[test]
fn mtl_values_are_converted_or_remarked_on() {
    let folder = Folder::new();
    let ior = |lines: &str| match from_mtl(&folder, &format!("illum 7\n{lines}")) {
        (Surface::Dielectric(glass), warnings) => (glass.ior, warnings.len()),
        other => panic!("{other:?}"),
    };
    assert_eq!(ior(""), (1.5, 0));
    assert_eq!(ior("Ni 0"), (1.5, 0));
    assert_eq!(ior("Ni 1"), (1.0, 0));
    assert_eq!(ior("Ni -2"), (1.5, 1));
    assert_eq!(ior("Ni inf"), (10.0, 1));
    assert_eq!(ior("Ni nan"), (1.5, 1));
    assert_eq!(ior("Tf 0 0 0"), (1.5, 1));

    fs::create_dir(folder.path("tex")).unwrap();
    fs::copy(folder.path("sky.png"), folder.path("tex/my sky.png")).unwrap();
    let scene = with_mtl(&folder, "Kd 0.5\nPm 1\nPr 0.25\nKe 1 2 3\nmap_Kd -s 1 1 1 -clamp on tex\\my sky.png");
    assert_eq!(scene.textures[0].path, folder.path("tex/my sky.png"));
    let expected = Opaque {
        base_color: DVec3::ONE,
        base_color_texture: Some(TextureMap { wrap: [Wrap::Clamp; 2], ..TextureMap::of(0) }),
        metallic: 1.0,
        roughness: 0.25,
        specular: 1.0,
        emission: DVec3::new(1.0, 2.0, 3.0),
        ..Opaque::default()
    };
    assert_eq!((opaque(&scene, 0), scene.warnings.len()), (&expected, 0));

    let (surface, warnings) = from_mtl(&folder, "Kd 0 1 0\nmap_Kd none.png");
    assert!(
        matches!(surface, Surface::Opaque(opaque) if opaque.base_color == DVec3::Y && opaque.base_color_texture.is_none())
    );
    assert!(warnings[0].ends_with("none.png\" does not exist; the colour is used"), "{warnings:?}");

    // Lines that would make tobj panic or give up.
    let (surface, warnings) =
        from_mtl(&folder, "Kd 1 0\nKs\nKd spectral a.rfl\nillum 300\nNi\nd\nmap_Kd\nnewmtl\nKd 0 0 1");
    assert!(matches!(surface, Surface::Opaque(opaque) if opaque.base_color == DVec3::Z));
    assert!(warnings[0].ends_with("m.mtl: 8 lines not understood and left out, the first is line 2"), "{warnings:?}");
    let (surface, warnings) = from_mtl(&folder, "Kd 2 -1 nan");
    assert!(matches!(surface, Surface::Opaque(opaque) if opaque.base_color == DVec3::X));
    assert_eq!(warnings.len(), 3);
}

/// Scale and offset of MTL, whose v points upwards.
#[test]
fn mtl_places_images() {
    let folder = Folder::new();
    let scene = with_mtl(&folder, "map_Kd -s 2 3 1 -o 0.25 -0.5 -blendu on sky.png\nmap_Ke -o -0.125 sky.png");
    assert_eq!(scene.warnings, Vec::<String>::new());
    let opaque = opaque(&scene, 0);
    let at = |map: Option<TextureMap>, u: f64, v: f64| {
        let map = map.expect("a map");
        let place = map.turn * DVec2::new(u, 1.0 - v) + map.offset;
        DVec2::new(place.x, 1.0 - place.y)
    };
    for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.3, 0.7)] {
        let wanted = DVec2::new(2.0 * u + 0.25, 3.0 * v - 0.5);
        assert!(at(opaque.base_color_texture, u, v).abs_diff_eq(wanted, 1e-12), "{u} {v}");
        assert!(at(opaque.emission_texture, u, v).abs_diff_eq(DVec2::new(u - 0.125, v), 1e-12), "{u} {v}");
    }
    let scene = with_mtl(&folder, "map_Kd -mm 0.5 2 sky.png");
    assert!(scene.warnings[0].ends_with("map_Kd: -mm is not read"), "{:?}", scene.warnings);
    let scene = with_mtl(&folder, "map_Ks sky.png");
    assert!(scene.warnings[0].ends_with("map_Ks is not read; the number is used"), "{:?}", scene.warnings);
    let scene = with_mtl(&folder, "map_Bump -bm abc sky.png\nmap_Kd -s nan 2000 sky.png");
    let said = scene.warnings.join("\n");
    for wanted in ["map_Bump: -bm abc is no number; 1 is used", "map_Kd: -s NaN", "-s 2000 is not between"] {
        assert!(said.contains(wanted), "{wanted}: {said}");
    }
}

/// Images of roughness and of metal become one, each in the place of its number.
#[test]
fn mtl_images_of_roughness_and_metal_are_one() {
    let folder = Folder::new();
    let grey = |name: &str, width: u32, codes: &[u8]| {
        let image = image::GrayImage::from_raw(width, codes.len() as u32 / width, codes.to_vec()).unwrap();
        image.save(folder.path(name)).unwrap();
    };
    grey("rough.png", 2, &[0, 51]);
    grey("metal.png", 2, &[255, 102, 0, 204]);
    image::RgbImage::from_pixel(1, 1, image::Rgb([255, 51, 102])).save(folder.path("both.png")).unwrap();
    let finish = |lines: &str| {
        let scene = with_mtl(&folder, &format!("Pr 0.5\nPm 0.25\n{lines}"));
        let Opaque { roughness, metallic, metallic_roughness_texture, .. } = *opaque(&scene, 0);
        let texels = metallic_roughness_texture.map(|map| {
            let texels = scene.textures[map.texture].linear();
            texels.map(|[_, g, b, _]| [g, b].map(|x| (x * 255.0).round() as u8)).collect::<Vec<_>>()
        });
        (roughness, metallic, texels.unwrap_or_default())
    };
    assert_eq!(finish("map_Pr rough.png"), (1.0, 0.25, vec![[0, 255], [51, 255]]));
    assert_eq!(finish("map_Pm metal.png").2, [[255, 255], [255, 102], [255, 0], [255, 204]]);
    let files = with_mtl(&folder, "map_Pr rough.png\nmap_Pm metal.png").files;
    assert!(["rough.png", "metal.png"].iter().all(|name| files.contains(&folder.path(name))), "{files:?}");
    assert_eq!(
        finish("map_Pr rough.png\nmap_Pm metal.png"),
        (1.0, 1.0, vec![[0, 255], [51, 102], [0, 0], [51, 204]]),
        "as large as the larger one"
    );
    assert_eq!(finish("map_Pr both.png\nmap_Pm both.png").2, [[51, 102]], "as glTF has it");
    assert_eq!(finish("map_Pr -imfchan b both.png\nmap_Pm -imfchan r both.png").2, [[102, 255]]);
    assert_eq!(finish("map_Pr -imfchan r both.png\nmap_Pm -imfchan r both.png").2, [[255, 255]]);
    let scene = with_mtl(&folder, "map_Pr -s 2 2 both.png\nmap_Pm both.png");
    assert!(scene.warnings[0].ends_with("map_Pm has other options than map_Pr, which count for both"));
    assert_eq!(finish("map_Pr none.png\nmap_Pm rough.png").0, 0.5);
    fs::write(folder.path("bad.png"), "no image").unwrap();
    assert_eq!(finish("map_Pr bad.png\nmap_Pm rough.png"), (0.5, 0.25, vec![]));
    // Glass has it, too.
    let (surface, _) = from_mtl(&folder, "illum 7\nPr 0.5\nmap_Pr rough.png");
    let Surface::Dielectric(glass) = surface else { panic!("{surface:?}") };
    assert_eq!((glass.roughness, glass.metallic_roughness_texture), (1.0, Some(TextureMap::of(0))));
    let (surface, warnings) = from_mtl(&folder, "illum 7\nPr 0.5\nmap_Pm metal.png");
    assert!(matches!(surface, Surface::Dielectric(glass) if glass.roughness == 0.5));
    assert!(warnings[0].ends_with("map_Pm is not read of glass"), "{warnings:?}");
    let (_, warnings) = from_mtl(&folder, "illum 7\nNs 250");
    assert!(warnings[0].contains("Ns 250 is not read"), "{warnings:?}");
    assert!(from_mtl(&folder, "illum 7\nNs 1000").1.is_empty());
}

/// What is said of a sheet is of what it is in the end.
#[test]
fn open_bodies_are_told_as_what_they_are() {
    let folder = Folder::new();
    folder.write("sheet.obj", TETRAHEDRON.replace("f 2 3 4\n", ""));
    let scene = "[environment]\ncolor = [1, 1, 1]\n[material.m]\nkind = \"dielectric\"\n\
        [[object]]\nmesh = \"sheet.obj\"\nmaterial = \"m\"\n";
    folder.write("sheet.toml", scene);
    let told = |setting: Option<&str>| {
        let settings = setting.into_iter().map(str::to_owned).collect();
        let scene =
            Scene::load(Some(&folder.path("sheet.toml")), &Overrides { settings, ..Overrides::default() }).unwrap();
        (dielectric(&scene, 0).thin_walled, scene.warnings[0].clone())
    };
    let (thin, warning) = told(None);
    assert!(thin && warning.contains("counts as thin_walled, unless"), "{warning}");
    // What panes have no use for.
    let tinted =
        scene.replace("dielectric\"", "dielectric\"\nattenuation_color = [1, 0.5, 0.5]\nattenuation_distance = 1");
    folder.write("sheet.toml", tinted);
    let path = folder.path("sheet.toml");
    let warnings = Scene::load(Some(&path), &Overrides::default()).unwrap().warnings;
    assert!(warnings[1].ends_with("has no inside, so that no attenuation shows"), "{warnings:?}");
    let repaired =
        Overrides { repair: Some(true), settings: vec!["material.m.thin_walled=false".into()], ..Overrides::default() };
    let warnings = Scene::load(Some(&path), &repaired).unwrap().warnings;
    assert!(warnings[0].contains("--repair does not close it"), "{warnings:?}");
    let (thin, warning) = told(Some("material.m.thin_walled=false"));
    assert!(!thin && warning.contains("bounds no medium well"), "{warning}");
}

#[test]
fn a_missing_mtl_is_a_warning_to_those_who_need_it() {
    let folder = Folder::new();
    folder.write("body.obj", format!("mtllib no such.mtl\nmtllib no such.mtl\nusemtl m\n{TETRAHEDRON}"));
    let own = folder.scene("[environment]\ncolor = [1, 1, 1]\n[[object]]\nmesh = \"body.obj\"\n").unwrap();
    assert_eq!(dielectric(&own, 0), &Dielectric::default());
    assert!(own.warnings[0].contains("cannot read") && own.warnings[0].contains("clear glass"), "{:?}", own.warnings);
    let named = folder.material("dielectric", "").unwrap();
    assert!(!named.warnings.iter().any(|warning| warning.contains("mtl")), "{:?}", named.warnings);
}

#[test]
fn several_mtl_files_may_stand_on_a_line_or_have_spaces() {
    let folder = Folder::new();
    folder.write("a.mtl", "newmtl a\nKd 1 0 0\n");
    folder.write("b c.mtl", "newmtl b\nKd 0 1 0\n");
    folder.write("d.mtl", "newmtl d\nKd 0 0 1\n");
    let faces = "usemtl a\nf 1 3 2\nusemtl b\nf 1 2 4\nusemtl d\nf 1 4 3\nf 2 3 4\n";
    let vertices = &TETRAHEDRON[..TETRAHEDRON.find('f').unwrap()];
    folder.write("body.obj", format!("mtllib a.mtl d.mtl\n{vertices}{faces}mtllib b c.mtl\n"));
    let scene = folder.scene("[[object]]\nmesh = \"body.obj\"\n").unwrap();
    let colors: Vec<_> = (0..3).map(|part| opaque(&scene, part).base_color).collect();
    assert_eq!(colors, [DVec3::X, DVec3::Y, DVec3::Z]);
}

#[test]
fn a_latin_1_comment_is_no_reason_to_refuse_a_mesh() {
    let folder = Folder::new();
    folder.write("body.obj", [b"# caf\xe9\n", TETRAHEDRON.as_bytes()].concat());
    assert_eq!(folder.load("body.obj").unwrap().meshes[0].triangles.len(), 4);
}

/// A sheet is a pane, whatever it is drawn as, unless the scene file says otherwise; a crack makes no sheet of a body.
#[test]
fn open_bodies_are_panes() {
    let folder = Folder::new();
    folder.write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
    let pane = |scene: &Scene, index| dielectric(scene, index).thin_walled;
    let scene = folder.load("sheet.obj").unwrap();
    assert!(pane(&scene, 0));
    let expected = "sheet.obj: 4 open edges; its holes are 100 % of its area: it bounds no medium and counts as thin_walled, unless [material] or --set says thin_walled = false";
    assert!(scene.warnings.contains(&expected.into()), "{:?}", scene.warnings);
    // A box without two sides that meet: over both a sheet would bend.
    folder.write(
        "box.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
        f 1 4 3 2\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\n",
    );
    let scene = folder.load("box.obj").unwrap();
    assert!(pane(&scene, 0) && scene.warnings[0].contains("its holes are 35 % of its area"), "{:?}", scene.warnings);

    // A body that is cut where another material begins is none less.
    folder.write("two.mtl", "newmtl glass\nillum 7\nnewmtl label\nKd 1 0 0\n");
    folder.write(
        "cut.obj",
        format!("mtllib two.mtl\nusemtl glass\n{}", TETRAHEDRON.replace("f 2 3 4", "usemtl label\nf 2 3 4")),
    );
    let scene = folder.scene("[[object]]\nmesh = \"cut.obj\"\n").unwrap();
    assert!(!pane(&scene, 0) && scene.objects.len() == 2, "{:?}", scene.warnings);

    // One material, worn by a closed body and by a sheet.
    let both = |material: &str| {
        let objects =
            "[[object]]\nmesh = \"body.obj\"\nmaterial = \"m\"\n[[object]]\nmesh = \"sheet.obj\"\nmaterial = \"m\"\n";
        folder.scene(&format!("[material.m]\nkind = \"dielectric\"\nior = 1.4\n{material}{objects}")).unwrap()
    };
    let scene = both("");
    assert_eq!([pane(&scene, 0), pane(&scene, 1)], [false, true]);
    assert_eq!((dielectric(&scene, 1).ior, scene.materials.len()), (1.4, 2));
    assert_eq!(scene.materials[1].name, "m, thin-walled");
    let scene = both("thin_walled = false\n");
    assert_eq!([pane(&scene, 0), pane(&scene, 1), scene.materials.len() == 1], [false, false, true]);
    assert!(scene.warnings[0].contains("it wants thin_walled = true"), "{:?}", scene.warnings);
}

/// A roof of two slopes that meet at a right angle.
const ROOF: &str = "v -1 0 0\nv 0 1 0\nv 0 1 1\nv -1 0 1\nv 1 0 0\nv 1 0 1\n";

#[test]
fn smoothing_groups_make_normals() {
    let folder = Folder::new();
    let mesh = |faces: &str| {
        folder.write("roof.obj", format!("{ROOF}{faces}"));
        let scene = folder.load("roof.obj").unwrap();
        (scene.meshes[0].clone(), scene.warnings.clone())
    };
    let ridge = |faces: &str| {
        let (mesh, _) = mesh(faces);
        let all = mesh.positions.iter().zip(&mesh.normals).filter(|(position, _)| position[0] == 0.0);
        let mut normals: Vec<_> = all.map(|(_, normal)| normal.map(|x| (x * 1000.0).round() as i32)).collect();
        normals.sort_unstable();
        normals.dedup();
        normals
    };
    let slopes = ["f 4 3 2 1", "f 3 6 5 2"];
    let [one, other] = slopes;
    assert!(mesh(&format!("{one}\n{other}\n")).0.normals.is_empty(), "without groups it is flat");
    assert!(mesh(&format!("s off\n{one}\n{other}\n")).0.normals.is_empty());
    assert_eq!(ridge(&format!("s 1\n{one}\n{other}\n")), [[0, 1000, 0]]);
    let sharp = [[-707, 707, 0], [707, 707, 0]];
    // A seam of texture coordinates is none of the surface.
    let seam = "vt 0 0\nvt 1 0\ns 1\nf 4/1 3/1 2/1 1/1\nf 3/2 6/2 5/2 2/2\n";
    assert_eq!(ridge(seam), [[0, 1000, 0]]);
    assert_eq!(ridge(&format!("s 1\n{one}\ns 2\n{other}\n")), sharp);
    assert_eq!(ridge(&format!("s 1\n{one}\ns 0\n{other}\n")), sharp);
    assert_eq!(ridge(&format!("{other}\ns 1\n{one}\n")), sharp);
    // What has normals keeps them, and nothing is said of lines that are understood.
    let (mesh, warnings) =
        mesh(&format!("vn 0 0 1\ns 1\n{}\n", one.replace(' ', "//1 ").replacen("//1", "", 1) + "//1"));
    assert!(mesh.normals.iter().all(|normal| *normal == [0.0, 0.0, 1.0]), "{:?}", mesh.normals);
    assert!(!warnings.iter().any(|warning| warning.contains("not understood")), "{warnings:?}");
}

#[test]
fn normals_are_made_up_to_an_angle_where_that_is_asked_for() {
    let folder = Folder::new();
    folder.write("roof.obj", format!("{ROOF}f 4 3 2 1\nf 3 6 5 2\n"));
    folder.write("own.toml", "[render]\nsmooth_angle = 100\n[[object]]\nmesh = \"roof.obj\"\n");
    let load = |name: &str, smooth_angle| {
        let overrides = Overrides { smooth_angle, ..Overrides::default() };
        Scene::load(Some(&folder.path(name)), &overrides).unwrap().meshes[0].normals.len()
    };
    // Six vertices, or eight of which the two of the ridge are there twice.
    for (name, angle, expected) in [
        ("roof.obj", None, 0),
        ("roof.obj", Some(91.0), 6),
        ("roof.obj", Some(89.0), 8),
        ("own.toml", None, 6),
        ("own.toml", Some(30.0), 8),
        ("own.toml", Some(0.0), 0),
    ] {
        assert_eq!(load(name, angle), expected, "{name} {angle:?}");
    }
}
