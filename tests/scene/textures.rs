//! Images that opaque materials name.

use std::fs;

use half::f16;
use image::{DynamicImage, GrayAlphaImage, ImageBuffer, Luma, LumaA, Rgb, Rgb32FImage, Rgba};
use vitrum::effects::Effect;
use vitrum::image::{FloatImage, encode_exr};
use vitrum::scene::{Scene, Texels, Texture, TextureMap};

use super::{Folder, TETRAHEDRON, opaque};

/// The scene of one object that wears the image with this name; the image's name stands in line 3.
fn wearing(image: &str) -> String {
    let material = format!("[material.m]\nkind = \"opaque\"\nbase_color_texture = {image:?}\n");
    format!("{material}[environment]\ncolor = [1, 1, 1]\n[[object]]\nmesh = \"painted.obj\"\nmaterial = \"m\"\n")
}

fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("painted.obj", format!("vt 0.25 0.75\n{}", TETRAHEDRON.replace("f 1 ", "f 1/1 ")));
    folder
}

/// The first texture of `scene`, which is the one that its first object wears.
fn worn(scene: &Scene) -> &Texture {
    assert_eq!(opaque(scene, 0).base_color_texture, Some(TextureMap::of(0)));
    assert!(Effect::Textures.called_for_by(scene));
    &scene.textures[0]
}

fn halves(texel: [f32; 3]) -> [f16; 4] {
    let [r, g, b] = texel.map(f16::from_f32);
    [r, g, b, f16::ONE]
}

#[test]
fn eight_bits_stay_encoded() {
    let folder = folder();
    let read = |name: &str, image: DynamicImage| {
        image.save(folder.path(name)).unwrap();
        let scene = folder.scene(&wearing(name)).unwrap();
        let texture = worn(&scene);
        assert_eq!((&texture.path, texture.name()), (&folder.path(name), name.to_owned()));
        match &texture.texels {
            Texels::Srgb(texels) => (texture.width, texture.height, texels.clone()),
            _ => panic!("{name}"),
        }
    };
    // Row 0 is the top row.
    let colors = ImageBuffer::from_fn(2, 3, |x, y| Rgba([x as u8, y as u8, 188, 7]));
    let expected = [[0, 0], [1, 0], [0, 1], [1, 1], [0, 2], [1, 2]].map(|[x, y]| [x, y, 188, 7]);
    assert_eq!(read("colors.png", colors.into()), (2, 3, expected.to_vec()));
    let grey = GrayAlphaImage::from_pixel(1, 1, LumaA([99, 0]));
    assert_eq!(read("one.png", grey.into()), (1, 1, vec![[99, 99, 99, 0]]));
    let (width, height, texels) = read("photo.jpg", ImageBuffer::from_pixel(8, 4, Rgb([188_u8; 3])).into());
    assert_eq!((width, height, texels.len()), (8, 4, 32));
    assert!(texels.iter().all(|[r, g, b, a]| [r, g, b].iter().all(|x| x.abs_diff(188) < 3) && *a == 255));
}

#[test]
fn other_images_become_linear_reflectance() {
    let folder = folder();
    let read = |name: &str| {
        let scene = folder.scene(&wearing(name)).unwrap();
        match &worn(&scene).texels {
            Texels::Linear(texels) => (texels.clone(), scene.warnings.clone()),
            _ => panic!("{name}"),
        }
    };
    let sixteen: ImageBuffer<Luma<u16>, _> = ImageBuffer::from_pixel(1, 1, Luma([32768]));
    sixteen.save(folder.path("deep.png")).unwrap();
    let (texels, warnings) = read("deep.png");
    assert!((texels[0][1].to_f32() - 0.214_05).abs() < 1e-4 && texels[0][3] == f16::ONE, "{texels:?}");
    let replaced = |warnings: &[String]| warnings.iter().filter(|w| w.contains("no reflectance")).count();
    assert_eq!(replaced(&warnings), 0);

    Rgb32FImage::from_pixel(9, 1, Rgb([0.5, 0.25, 2.0])).save(folder.path("sun.hdr")).unwrap();
    let (texels, warnings) = read("sun.hdr");
    assert_eq!(texels, [halves([0.5, 0.25, 1.0]); 9]);
    assert!(warnings.contains(&"sun.hdr: 9 texels were no reflectance from 0 to 1, and moved there".into()));

    let (nan, infinite) = (f32::NAN, f32::INFINITY);
    let pixels = vec![[0.0, 0.5, 1.0], [nan, -1.0, infinite], [-infinite, 0.25, 0.125]];
    let image = FloatImage { width: 1, height: 3, pixels, layers: Vec::new() };
    folder.write("paint.exr", encode_exr(&image, &[]).unwrap());
    let (texels, warnings) = read("paint.exr");
    assert_eq!(texels, [[0.0, 0.5, 1.0], [0.0, 0.0, 1.0], [0.0, 0.25, 0.125]].map(halves));
    assert!(warnings.contains(&"paint.exr: 2 texels were no reflectance from 0 to 1, and moved there".into()));
}

#[test]
fn textures_that_cannot_be_read_are_errors_with_their_line() {
    let folder = folder();
    folder.write("words.png", "hello\n");
    folder.write("words.txt", "hello\n");
    folder.write("empty.exr", "");
    let whole = fs::read(folder.path("sky.png")).unwrap();
    folder.write("half.png", &whole[..whole.len() / 2]);
    for (image, expected) in [
        ("none.png", "3: base_color_texture: \"none.png\" does not exist"),
        (".", "3: base_color_texture: \".\" is a folder, not a file"),
        ("", "3: base_color_texture: expected a file name, found \"\""),
        ("words.png", "3: base_color_texture: words.png: cannot be read as PNG: "),
        ("half.png", "3: base_color_texture: half.png: cannot be read as PNG: "),
        ("empty.exr", "3: base_color_texture: empty.exr: cannot be read as OpenEXR: "),
        ("words.txt", "3: base_color_texture: words.txt: is no image of a known kind; known: .exr, .hdr, .png"),
    ] {
        let fault = folder.fault(&wearing(image));
        assert!(fault.starts_with(expected), "{fault}");
        // Even if no object wears it.
        let material = wearing(image);
        let unworn = folder.fault(material.split_once("[[object]]").unwrap().0);
        assert_eq!(unworn, fault);
    }
    let both = "[material.m]\nkind = \"opaque\"\nbase_color = [1, 1, 1]\nbase_color_texture = \"sky.png\"\n";
    assert_eq!(folder.fault(both), "4: base_color_texture stands beside base_color; keep one of them");
    let number = "[material.m]\nkind = \"opaque\"\nbase_color_texture = 3\n";
    assert_eq!(folder.fault(number), "3: base_color_texture: expected a file name, found 3");
}

#[test]
fn a_file_is_one_texture_whoever_names_it() {
    let folder = folder();
    fs::create_dir(folder.path("models")).unwrap();
    fs::copy(folder.path("sky.png"), folder.path("models/own.png")).unwrap();
    folder.write(
        "models/m.mtl",
        "newmtl a\nmap_Kd ../sky.png\nnewmtl b\nmap_Kd own.png\nnewmtl unworn\nmap_Kd bad.png\n",
    );
    folder.write("models/bad.png", "no image");
    let quad = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n";
    folder.write("models/quad.obj", format!("{quad}usemtl b\nf 1/1 2/1 3/1\nusemtl a\nf 3/1 2/1 1/1\n"));
    let materials = "[material.x]\nkind = \"opaque\"\nbase_color_texture = \"sky.png\"\n\
        [material.y]\nkind = \"opaque\"\nbase_color_texture = \"models/../sky.png\"\n";
    let own = "[[object]]\nmesh = \"models/quad.obj\"\n";
    let scene = folder.scene(&format!("{materials}{own}{own}{own}material = \"y\"\n")).unwrap();
    let paths: Vec<_> = scene.textures.iter().map(|texture| texture.path.canonicalize().unwrap()).collect();
    assert_eq!(paths, ["sky.png", "models/own.png"].map(|name| folder.path(name).canonicalize().unwrap()));
    let worn: Vec<_> = (0..6).map(|object| opaque(&scene, object).base_color_texture).collect();
    assert_eq!(worn, [1, 0, 1, 0, 0, 0].map(|texture| Some(TextureMap::of(texture))));
    let names: Vec<_> = scene.materials.iter().map(|material| material.name.as_str()).collect();
    assert_eq!(names, ["x", "y", "b", "a"], "what no part wears is not there, and its image not opened");
    assert!(!scene.warnings.iter().any(|warning| warning.contains("png")), "{:?}", scene.warnings);
    // Shown as clear glass, no image is opened.
    assert!(folder.load("models/quad.obj").unwrap().textures.is_empty());
}

#[test]
fn images_of_mtl_files_that_cannot_be_read_are_warnings() {
    let folder = folder();
    folder.write("words.png", "hello\n");
    folder.write("m.mtl", "newmtl m\nKd 0 1 0\nmap_Kd words.png\n");
    folder.write("mtl.obj", format!("mtllib m.mtl\nusemtl m\n{TETRAHEDRON}"));
    let scene = folder.scene("[[object]]\nmesh = \"mtl.obj\"\n").unwrap();
    assert_eq!((opaque(&scene, 0).base_color_texture, scene.textures.len()), (None, 0));
    assert_eq!(opaque(&scene, 0).base_color, glam::DVec3::Y);
    let warning = &scene.warnings[0];
    assert!(warning.contains("words.png: cannot be read as PNG: "), "{warning}");
    assert!(warning.ends_with("; material \"m\" goes without it"), "{warning}");
}

#[test]
fn a_mesh_without_coordinates_is_told_when_it_wears_a_texture() {
    let folder = folder();
    let materials = "[material.m]\nkind = \"opaque\"\nbase_color_texture = \"sky.png\"\n\
        [material.plain]\nkind = \"opaque\"\n";
    let object = |mesh: &str, material: &str| format!("[[object]]\nmesh = \"{mesh}\"\nmaterial = \"{material}\"\n");
    let warnings = |objects: &[String]| {
        let scene = folder.scene(&format!("{materials}{}", objects.concat())).unwrap();
        scene.warnings.into_iter().filter(|warning| warning.contains("no texture coordinates")).collect::<Vec<_>>()
    };
    // Once, however many objects do.
    assert_eq!(
        warnings(&[object("body.obj", "m"), object("body.obj", "m"), object("painted.obj", "m")]),
        ["body.obj: has no texture coordinates; material \"m\" shows the corner of sky.png all over it"]
    );
    assert!(warnings(&[object("body.obj", "plain"), object("painted.obj", "m")]).is_empty());
}
