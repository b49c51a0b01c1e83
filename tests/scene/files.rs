//! The TOML file, the built-in scene, and what wins over what.

use std::fs;
use std::path::Path;

use glam::DVec3;
use vitrum::effects::Effect;
use vitrum::options::Model;
use vitrum::scene::{Dielectric, Dispersion, GLASSES, Opaque, Overrides, Scene, Surroundings, TextureMap};

use super::{Folder, TETRAHEDRON, dielectric, opaque};

const SPOT: &str = "[[light]]\nkind = \"spot\"\nposition = [0, 0, 0]\nintensity = [1, 1, 1]\ndirection = [0, -1, 0]\n";

const EVERYTHING: &str = r#"
[environment]
image = "sky.png"
intensity = 2
rotation = 90.0
visible = false

[camera]
position = [0, 0.25, 0.9]
target = [0.0, 0.1, 0.0]
up = [0, 0, -1]
vertical_fov = 50

[render]
model = "path"
size = [320, 200]
samples = 7

[[light]]
kind = "point"
position = [1.0, 2.0, 1.0]
intensity = [10, 10, 5]

[material.glass]
kind = "dielectric"
ior = "BK7"
roughness = 0.25
dispersion = 0.3
attenuation_color = [1, 0.5, 0]
attenuation_distance = 0.2
thin_walled = true
priority = -3

[material."oak table"]
kind = "opaque"
base_color_texture = "sky.png"
metallic = 0.5
roughness = 0.75
specular = 0.125
emission = [0, 0, 12]

[[object]]
mesh = "body.obj"
material = "glass"
translate = [1, 2, 3]
rotate = [90, 0, 90]
scale = [1, 2, -3]
smooth = false

[[object]]
mesh = "./body.obj"
material = "oak table"
"#;

#[test]
fn everything_is_read() {
    let folder = Folder::new();
    let scene = folder.scene(EVERYTHING).unwrap();
    assert_eq!(scene.name, folder.path("scene.toml").display().to_string());
    let Surroundings::Image(panorama) = &scene.environment.light else { panic!() };
    assert_eq!((panorama.width, panorama.height), (4, 2));
    assert!((panorama.texels[0][2] - 0.502_886_5).abs() < 1e-6);
    assert_eq!((scene.environment.intensity, scene.environment.visible), (2.0, false));
    assert!((scene.environment.rotation - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    assert_eq!(scene.camera.position, DVec3::new(0.0, 0.25, 0.9));
    assert_eq!((scene.camera.target, scene.camera.up), (DVec3::new(0.0, 0.1, 0.0), DVec3::NEG_Z));
    assert!((scene.camera.vertical_fov - 50.0_f64.to_radians()).abs() < 1e-15);
    assert_eq!((scene.render.model, scene.render.samples), (Some(Model::Path.into()), Some(7)));
    assert_eq!(scene.lights.len(), 1);
    assert_eq!(scene.lights[0].intensity, DVec3::new(10.0, 10.0, 5.0));

    assert_eq!(
        dielectric(&scene, 0),
        &Dielectric {
            ior: 1.5168,
            roughness: 0.25,
            dispersion: Dispersion::Khr(0.3),
            attenuation_color: DVec3::new(1.0, 0.5, 0.0),
            attenuation_distance: 0.2,
            thin_walled: true,
            priority: -3,
            ..Dielectric::default()
        }
    );
    assert_eq!(
        opaque(&scene, 1),
        &Opaque {
            base_color: DVec3::ONE,
            base_color_texture: Some(TextureMap::of(0)),
            metallic: 0.5,
            roughness: 0.75,
            specular: 0.125,
            emission: DVec3::new(0.0, 0.0, 12.0),
            ..Opaque::default()
        }
    );
    assert_eq!((scene.textures.len(), &scene.textures[0].path), (1, &folder.path("sky.png")));
    assert_eq!(scene.meshes.len(), 1, "one file is read once");
    assert_eq!((scene.objects[0].number, scene.objects[1].number), (0, 1));
    assert_eq!((scene.objects[0].smooth, scene.objects[1].smooth), (false, true));
    // Scaled, then about x, then about z: +y becomes +z, which stays; +x becomes +y; -z becomes +y becomes -x.
    let transform = scene.objects[0].transform;
    let close = |point: DVec3, expected: [f64; 3]| {
        let found = transform.transform_point3(point);
        assert!((found - DVec3::from(expected)).length() < 1e-12, "{found}");
    };
    close(DVec3::ZERO, [1.0, 2.0, 3.0]);
    close(DVec3::X, [1.0, 3.0, 3.0]);
    close(DVec3::Y, [1.0, 2.0, 5.0]);
    close(DVec3::Z, [-2.0, 2.0, 3.0]);
    assert!(transform.matrix3.determinant() < 0.0);
    let bounds = scene.bounds().unwrap();
    assert!((bounds.min - DVec3::new(-2.0, 0.0, 0.0)).length() < 1e-12, "{bounds:?}");
    assert!((bounds.max - DVec3::new(1.0, 3.0, 5.0)).length() < 1e-12, "{bounds:?}");
    let wanted = [
        "no texture coordinates",
        "material \"glass\": is thin-walled and has no inside, so that no attenuation and dispersion show",
    ];
    assert_eq!(scene.warnings.len(), 2, "{:?}", scene.warnings);
    assert!(scene.warnings.iter().zip(wanted).all(|(found, wanted)| found.contains(wanted)), "{:?}", scene.warnings);
}

#[test]
fn a_scene_that_says_little_gets_the_defaults() {
    let folder = Folder::new();
    let scene = folder.scene("[[object]]\nmesh = \"body.obj\"\n").unwrap();
    assert_eq!(dielectric(&scene, 0), &Dielectric::default());
    assert!(matches!(&scene.environment.light, Surroundings::Image(panorama) if panorama.width == 512));
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    assert_eq!(scene.camera, vitrum::scene::Camera::framing(scene.bounds().unwrap(), 1.0));
    let empty = folder.scene("").unwrap();
    assert!(empty.objects.is_empty() && empty.bounds().is_none());
    let color = folder.scene("[environment]\ncolor = [1, 0.5, 0]").unwrap();
    assert!(matches!(color.environment.light, Surroundings::Color(c) if c == DVec3::new(1.0, 0.5, 0.0)));
    let dark = folder.scene("[environment]\ncolor = [0, 0, 0]\nintensity = 0").unwrap();
    assert_eq!(dark.environment.intensity, 0.0);
    let infinite = folder.material("dielectric", "attenuation_distance = inf\nattenuation_color = [0, 0, 0]").unwrap();
    assert!(dielectric(&infinite, 0).attenuation_distance.is_infinite());
    assert_eq!(opaque(&folder.material("opaque", "").unwrap(), 0), &Opaque::default());
}

#[test]
fn unknown_keys_list_the_allowed_ones() {
    let folder = Folder::new();
    let cases = [
        ("\nfog = 1", "2: unknown key \"fog\"; allowed here: environment, camera, render, light, material, object"),
        (
            "[environment]\ncolor = [1, 1, 1]\nimagge = 1",
            "3: unknown key \"imagge\" in [environment]; allowed here: image, color, intensity, rotation, visible",
        ),
        (
            "[camera]\nposition = [0, 0, 1]\nfov = 3",
            "3: unknown key \"fov\" in [camera]; allowed here: position, target, up, vertical_fov",
        ),
        (
            "[[light]]\nkind = \"point\"\ncolor = 1",
            "3: unknown key \"color\" in [[light]]; allowed here: kind, position, intensity",
        ),
        (
            "[[object]]\nmesh = \"body.obj\"\n\nrotation = 1",
            "4: unknown key \"rotation\" in [[object]]; allowed here: mesh, material, translate, rotate, scale, smooth",
        ),
        (
            "[material.m]\nkind = \"dielectric\"\nroughnes = 1",
            "3: unknown key \"roughnes\" in [material.m]; allowed here: kind, ior, roughness, dispersion, attenuation_color, attenuation_distance, thin_walled, priority, base_color, transmission, transmission_texture, base_color_texture, metallic_roughness_texture, normal_texture, normal_scale, alpha_cutoff",
        ),
        (
            "[material.m]\nkind = \"opaque\"\nior = 1",
            "3: unknown key \"ior\" in [material.m]; allowed here: kind, base_color, metallic, roughness, specular, emission, emission_texture, base_color_texture, metallic_roughness_texture, normal_texture, normal_scale, alpha_cutoff",
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(folder.fault(text), expected);
    }
    let render = folder.fault("[render]\nsamples = 4\nmodle = \"path\"");
    assert!(
        render.starts_with("3: unknown key \"modle\" in [render]; allowed here: model, size, samples, max_depth, "),
        "{render}"
    );
}

#[test]
fn values_of_the_wrong_type_or_range_say_what_is_expected() {
    let folder = Folder::new();
    let head = "[material.m]\nkind = \"dielectric\"\n";
    let matt = "[material.m]\nkind = \"opaque\"\n";
    let object = "[[object]]\nmesh = \"body.obj\"\n";
    let cases = [
        (
            format!("{head}ior = 0"),
            "3: ior: expected a number above 0, from 1e-6 to 1e6, or the name of a glass, found 0",
        ),
        (
            format!("{head}ior = -1.5"),
            "3: ior: expected a number above 0, from 1e-6 to 1e6, or the name of a glass, found -1.5",
        ),
        (
            format!("{head}ior = nan"),
            "3: ior: expected a number above 0, from 1e-6 to 1e6, or the name of a glass, found nan",
        ),
        (
            format!("{head}ior = inf"),
            "3: ior: expected a number above 0, from 1e-6 to 1e6, or the name of a glass, found inf",
        ),
        (
            format!("{head}ior = 1e99"),
            "3: ior: expected a number above 0, from 1e-6 to 1e6, or the name of a glass, found 1e99",
        ),
        (
            format!("{head}ior = [1.5]"),
            "3: ior: expected a number above 0, from 1e-6 to 1e6, or the name of a glass, found an array of 1",
        ),
        (format!("{head}roughness = 1.01"), "3: roughness: expected a number from 0 to 1, found 1.01"),
        (format!("{head}roughness = true"), "3: roughness: expected a number from 0 to 1, found true"),
        (format!("{head}roughness = \"low\""), "3: roughness: expected a number from 0 to 1, found \"low\""),
        (format!("{head}dispersion = -0.1"), "3: dispersion: expected a number from 0 to 1e9, found -0.1"),
        (
            format!("{head}attenuation_color = [1, 2, 1]"),
            "3: attenuation_color: expected a number from 0 to 1, found 2",
        ),
        (
            format!("{head}attenuation_color = [1, 1]"),
            "3: attenuation_color: expected three numbers, found an array of 2",
        ),
        (
            format!("{head}attenuation_distance = 0"),
            "3: attenuation_distance: expected a number above 0, or inf, found 0",
        ),
        (
            format!("{head}attenuation_distance = -inf"),
            "3: attenuation_distance: expected a number above 0, or inf, found -inf",
        ),
        (format!("{head}thin_walled = 1"), "3: thin_walled: expected true or false, found 1"),
        (
            format!("{head}priority = 1.5"),
            "3: priority: expected a whole number from -2147483648 to 2147483647, found 1.5",
        ),
        (
            format!("{head}priority = 3000000000"),
            "3: priority: expected a whole number from -2147483648 to 2147483647, found 3000000000",
        ),
        (format!("{matt}base_color = [1, 1, 1.5]"), "3: base_color: expected a number from 0 to 1, found 1.5"),
        (format!("{matt}emission = [0, nan, 0]"), "3: emission: expected a number from 0 to 1e9, found nan"),
        (format!("{matt}metallic = 2"), "3: metallic: expected a number from 0 to 1, found 2"),
        ("[material.m]\nkind = \"glass\"".into(), "2: kind: expected \"dielectric\" or \"opaque\", found \"glass\""),
        ("[material.m]\nior = 1".into(), "1: missing key \"kind\" in [material.m]; \"dielectric\" or \"opaque\""),
        ("material = 3".into(), "1: material: expected a table, [material.NAME], found 3"),
        ("[material]\nm = 3".into(), "2: m: expected a table, [material.m], found 3"),
        (format!("{object}scale = 0"), "3: scale: expected a number other than 0 from -1e9 to 1e9, found 0"),
        (format!("{object}scale = [1, 0, 1]"), "3: scale: expected a number other than 0 from -1e9 to 1e9, found 0"),
        (format!("{object}scale = inf"), "3: scale: expected a number other than 0 from -1e9 to 1e9, found inf"),
        (format!("{object}rotate = 90"), "3: rotate: expected three numbers, each a finite number, found 90"),
        (
            format!("{object}translate = [0, 1e30, 0]"),
            "3: translate: expected a number of metres from -1e9 to 1e9, found 1e30",
        ),
        (format!("{object}smooth = \"no\""), "3: smooth: expected true or false, found \"no\""),
        (format!("{object}material = \"\""), "3: material: expected the name of a material, found \"\""),
        ("[[object]]\nmesh = 3".into(), "2: mesh: expected a file name, found 3"),
        ("[[object]]\nscale = 3".into(), "1: missing key \"mesh\" in [[object]]"),
        ("[object]\nmesh = \"body.obj\"".into(), "1: object: expected tables, each headed [[object]], found a table"),
        ("object = [1]".into(), "1: object: expected a table, [[object]], found 1"),
        ("environment = 1".into(), "1: environment: expected a table, [environment], found 1"),
        ("[environment]\ncolor = [1, -1, 1]".into(), "2: color: expected a number from 0 to 1e9, found -1"),
        (
            "[environment]\ncolor = [1, 1, 1]\nintensity = nan".into(),
            "3: intensity: expected a number from 0 to 1e9, found nan",
        ),
        ("[environment]\ncolor = [1, 1, 1]\nrotation = inf".into(), "3: rotation: expected a finite number, found inf"),
        ("[environment]\ncolor = [1, 1, 1]\nvisible = 0".into(), "3: visible: expected true or false, found 0"),
        ("[[light]]\nposition = [0, 0, 0]".into(), "1: missing key \"kind\" in [[light]]"),
        (
            "[[light]]\nkind = \"sun\"".into(),
            "2: kind: expected \"point\" or \"spot\" or \"directional\", found \"sun\"",
        ),
        (
            "[[light]]\nkind = \"directional\"\ndirection = [0, 0, 0]\nirradiance = [1, 1, 1]".into(),
            "3: direction: expected three numbers, not all 0",
        ),
        (
            format!("{SPOT}inner_cone_angle = 30\nouter_cone_angle = 20"),
            "1: [[light]]: outer_cone_angle 20 with inner_cone_angle 30: expected one that is not below inner_cone_angle, and above 0",
        ),
        (
            format!("{SPOT}outer_cone_angle = 91"),
            "6: outer_cone_angle: expected an angle from 0 to 90 degrees, found 91",
        ),
        (
            format!("{SPOT}irradiance = [1, 1, 1]"),
            "6: unknown key \"irradiance\" in [[light]]; allowed here: kind, position, intensity, direction, inner_cone_angle, outer_cone_angle",
        ),
        (
            "[[light]]\nkind = \"point\"\nposition = [0, 0, 0]\nintensity = [1, 1, -1]".into(),
            "4: intensity: expected a number from 0 to 1e9, found -1",
        ),
    ];
    for (text, expected) in cases {
        assert_eq!(folder.fault(&text), expected, "in {text}");
    }
}

#[test]
fn glasses_are_named() {
    let folder = Folder::new();
    assert_eq!(dielectric(&folder.material("dielectric", "ior = \"water\"").unwrap(), 0).ior, 1.33299);
    let fault = folder.fault("[material.m]\nkind = \"dielectric\"\n\nior = \"bk9\"\n");
    assert!(fault.starts_with("4: unknown glass \"bk9\"; known: acrylic, baf10, bk7, crown, diamond"), "{fault}");
}

#[test]
fn glasses_disperse_unless_told_otherwise() {
    let folder = Folder::new();
    let calls = |scene: &Scene| Effect::Dispersion.called_for_by(scene);
    for glass in GLASSES {
        let scene = folder.material("dielectric", &format!("ior = {:?}", glass.name)).unwrap();
        assert_eq!((dielectric(&scene, 0).ior, dielectric(&scene, 0).dispersion), (glass.ior, glass.dispersion));
        assert_eq!(calls(&scene), glass.name != "ice", "{}", glass.name);
        for zero in ["0", "0.0", "-0.0"] {
            let scene = folder.material("dielectric", &format!("ior = {:?}\ndispersion = {zero}", glass.name)).unwrap();
            assert_eq!((dielectric(&scene, 0).ior, dielectric(&scene, 0).dispersion), (glass.ior, Dispersion::None));
            assert!(!calls(&scene));
        }
        let scene = folder.material("dielectric", &format!("dispersion = 0.4\nior = {:?}", glass.name)).unwrap();
        assert_eq!((dielectric(&scene, 0).ior, dielectric(&scene, 0).dispersion), (glass.ior, Dispersion::Khr(0.4)));
        assert!(calls(&scene));
    }
    let law = |lines: &str| dielectric(&folder.material("dielectric", lines).unwrap(), 0).dispersion;
    assert_eq!((law(""), law("ior = 1.5168")), (Dispersion::None, Dispersion::None));
    assert_eq!(
        (law("dispersion = 0.4"), law("ior = 1.7\ndispersion = 1")),
        (Dispersion::Khr(0.4), Dispersion::Khr(1.0))
    );
    let pane = folder.material("dielectric", "ior = \"sf11\"\nthin_walled = true").unwrap();
    assert!(dielectric(&pane, 0).disperses() && !calls(&pane));
}

#[test]
fn an_index_in_the_place_of_a_glass_takes_its_dispersion() {
    let folder = Folder::new();
    let overrides = Overrides { ior: Some(1.6), ..Overrides::default() };
    for (lines, expected) in [
        ("ior = \"sf11\"", Dispersion::None),
        ("ior = \"water\"", Dispersion::None),
        ("ior = \"sf11\"\ndispersion = 0", Dispersion::None),
        ("ior = \"sf11\"\ndispersion = 0.4", Dispersion::Khr(0.4)),
        ("ior = 1.3\ndispersion = 0.4", Dispersion::Khr(0.4)),
    ] {
        folder.material("dielectric", lines).unwrap();
        let named = Scene::load(Some(&folder.path("scene.toml")), &overrides).unwrap();
        // The scene's own option does as the command line's.
        let optional = folder.material("dielectric", &format!("{lines}\n[render]\nior = 1.6")).unwrap();
        for scene in [named, optional] {
            let glass = dielectric(&scene, 0);
            assert_eq!((glass.ior, glass.dispersion), (1.6, expected), "{lines}");
            assert_eq!(Effect::Dispersion.called_for_by(&scene), expected != Dispersion::None, "{lines}");
        }
    }
}

#[test]
fn environments_have_one_source() {
    let folder = Folder::new();
    let cases = [
        (
            "[environment]\nimage = \"sky.png\"\ncolor = [1, 1, 1]",
            "3: [environment] has both image and color; keep one of them",
        ),
        ("\n[environment]\nintensity = 1", "2: [environment] has neither image nor color; give one of them"),
        ("[environment]\nimage = \"none.exr\"", "2: image: \"none.exr\" does not exist"),
        ("[environment]\nimage = \".\"", "2: image: \".\" is a folder, not a file"),
        (
            "[environment]\nimage = \"body.obj\"",
            "body.obj: is no image of a known kind; known: .exr, .hdr, .png, .jpg, .jpeg",
        ),
        ("[environment]\nimage = \"\"", "2: image: expected a file name, found \"\""),
    ];
    for (text, expected) in cases {
        assert_eq!(folder.fault(text), expected);
    }
}

#[test]
fn cameras_must_see_something() {
    let folder = Folder::new();
    let camera = |lines: &str| folder.fault(&format!("\n[camera]\n{lines}"));
    assert_eq!(camera("target = [0, 0, 0]"), "2: missing key \"position\" in [camera]");
    assert_eq!(camera("position = [0, 0, 0]"), "2: missing key \"target\" in [camera]");
    let front = "position = [0, 0, 1]\ntarget = [0, 0, 0]\n";
    assert_eq!(
        camera("position = [0, 0, 1]\ntarget = [0, 0, 1]"),
        "2: [camera]: position and target must be different points"
    );
    assert!(camera(&format!("{front}up = [0, 0, 5]")).contains("up must not be parallel"));
    for fov in ["0", "180", "-10", "nan"] {
        let expected = format!("5: vertical_fov: expected an angle above 0 and below 180 degrees, found {fov}");
        assert_eq!(camera(&format!("{front}vertical_fov = {fov}")), expected);
    }
}

#[test]
fn materials_of_objects_must_exist() {
    let folder = Folder::new();
    let object = "[[object]]\nmesh = \"body.obj\"\nmaterial = \"gold\"\n";
    assert_eq!(folder.fault(object), "3: unknown material \"gold\"; defined: none; add [material.NAME]");
    let materials = "[material.a]\nkind = \"opaque\"\n[material.b]\nkind = \"dielectric\"\n";
    assert_eq!(folder.fault(&format!("{object}{materials}")), "3: unknown material \"gold\"; defined: a, b");
}

#[test]
fn render_options_are_checked_and_named() {
    let folder = Folder::new();
    for (option, wanted) in [
        ("samples = 0", "--samples <N>': expected 1 to 16777216 samples"),
        ("samples = \"9\"", "samples: expected a whole number, found \"9\""),
        ("model = \"fast\"", "possible values: single"),
        ("model = 1", "model: expected a name, found 1"),
        ("size = [0, 4]", "at least 1"),
        ("size = [9, 4, 2]", "size: expected width and height, as in [1024, 768], found an array of 3"),
        ("exposure = true", "exposure: expected a finite number, found true"),
        ("aov = [1]", "aov: expected names"),
        ("repair = \"yes\"", "repair: expected true or false, found \"yes\""),
        ("flipped_ratio = 1", "flipped_ratio: expected true or false, found 1"),
        ("speed = 1", "unknown key \"speed\" in [render]; allowed here: model, size, samples"),
    ] {
        let fault = folder.fault(&format!("[render]\n{option}"));
        assert!(fault.starts_with("2: ") && fault.contains(wanted), "{option}: {fault}");
    }
    let good = "size = [9, 4]\nexposure = 1\naov = [\"depth\", \"normal\"]\neffects = [\"auto\", \"-nesting\"]\ndevice = 0\n\
        seed = 7\nvalidation = true\nstats = \"a.json\"\ntime_budget = 2\n";
    let render = folder.scene(&format!("[render]\n{good}")).unwrap().render;
    assert_eq!(render.stats, Some(folder.path("a.json")));
    let options = "--size=9x4 --time-budget=2 --seed=7 --effects=auto,-nesting --exposure=1 --aov=depth,normal";
    assert_eq!((render.to_string().as_str(), render.validation), (options, Some(true)));
    assert!(folder.fault("render = 4").contains("expected a table, [render], found 4"));
    assert!(folder.fault("[render]\neffects = \"fog\"").contains("unknown effect \"fog\""));
    assert_eq!(folder.fault("[render]\nenv = \"none.exr\""), "2: env: \"none.exr\" does not exist");
}

#[test]
fn the_command_line_wins_over_render_and_render_over_the_scene() {
    let folder = Folder::new();
    image::RgbImage::from_pixel(8, 2, image::Rgb([9, 9, 9])).save(folder.path("other.png")).unwrap();
    let text = "[environment]\ncolor = [1, 1, 1]\nintensity = 3\n[render]\nior = 1.2\nroughness = 0.5\nenv = \"sky.png\"\n\
        [material.glass]\nkind = \"dielectric\"\nior = \"diamond\"\n[material.matt]\nkind = \"opaque\"\nroughness = 0.7\n\
        [[object]]\nmesh = \"body.obj\"\nmaterial = \"glass\"\n[[object]]\nmesh = \"body.obj\"\nmaterial = \"matt\"\n\
        [[object]]\nmesh = \"body.obj\"\n";
    let width = |scene: &Scene| match &scene.environment.light {
        Surroundings::Image(panorama) => panorama.width,
        Surroundings::Color(_) => 0,
    };
    let scene = folder.scene(text).unwrap();
    for glass in [0, 2] {
        assert_eq!((dielectric(&scene, glass).ior, dielectric(&scene, glass).roughness), (1.2, 0.5));
    }
    assert_eq!(opaque(&scene, 1).roughness, 0.7);
    assert_eq!((width(&scene), scene.environment.intensity), (4, 3.0));
    assert_eq!(scene.render.env, Some(folder.path("sky.png")));

    let overrides = Overrides {
        ior: Some(1.9),
        roughness: Some(0.0),
        environment: Some(folder.path("other.png")),
        ..Overrides::default()
    };
    let scene = Scene::load(Some(&folder.path("scene.toml")), &overrides).unwrap();
    assert_eq!((dielectric(&scene, 0).ior, dielectric(&scene, 0).roughness), (1.9, 0.0));
    assert_eq!((width(&scene), scene.environment.intensity), (8, 3.0));

    for (ior, roughness) in [(Some(0.0), None), (Some(f64::NAN), None), (None, Some(1.5)), (None, Some(f64::NAN))] {
        let overrides = Overrides { ior, roughness, ..Overrides::default() };
        assert_eq!(Scene::load(None, &overrides).unwrap_err().exit_code(), 2);
    }
    let missing = Overrides { environment: Some("none.exr".into()), ..Overrides::default() };
    assert_eq!(Scene::load(None, &missing).unwrap_err().to_string(), "none.exr: cannot read");
}

#[test]
fn files_that_are_no_scene_are_refused() {
    let folder = Folder::new();
    folder.write("scene.txt", "");
    folder.write("latin.toml", b"# caf\n# \xe9\n");
    folder.write("model.glb", "glTF");
    folder.write("model.fbx", "");
    folder.write("broken.toml", "[camera]\nposition = [0, 0\n\n[render]\n");
    fs::create_dir(folder.path("folder.toml")).unwrap();
    for (name, expected) in [
        ("scene.txt", "scene.txt: is no scene of a known kind; known: .toml (scene), .glb, .gltf, .obj (mesh)"),
        ("latin.toml", "latin.toml:2: is not UTF-8 text; save it as UTF-8"),
        ("model.glb", "model.glb: ends in the middle of a chunk; it was cut off"),
        ("model.gltf", "model.gltf: cannot read"),
        ("model.fbx", "model.fbx: is no scene of a known kind"),
        ("none.toml", "none.toml: cannot read"),
        ("folder.toml", "folder.toml: is a folder; name a file"),
        ("broken.toml", "broken.toml:4: "),
    ] {
        let error = folder.load(name).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
        assert_eq!(error.exit_code(), 2);
    }
    assert!(
        folder
            .fault("[[object]]\nmesh = \"model.fbx\"")
            .contains("is no mesh of a known kind; known: .obj, .glb, .gltf")
    );
    assert_eq!(folder.fault("a = 1\na = 2").split(':').next(), Some("2"));
}

#[test]
fn a_bare_mesh_is_clear_glass_in_view() {
    let folder = Folder::new();
    folder.write("red.mtl", "newmtl red\nKd 1 0 0\n");
    folder.write("red.obj", format!("mtllib red.mtl\nusemtl red\n{TETRAHEDRON}"));
    let scene = folder.load("red.obj").unwrap();
    assert_eq!(dielectric(&scene, 0), &Dielectric::default());
    assert!(scene.warnings.iter().any(|warning| warning.ends_with("shown as clear glass, not with its 1 materials")));
    assert!(scene.camera.position.z > 1.0 && scene.camera.position.y > scene.camera.target.y);
}

#[test]
fn objects_that_reach_too_far_are_refused() {
    let folder = Folder::new();
    let fault = folder.fault("\n[[object]]\nmesh = \"body.obj\"\nscale = 1e9\ntranslate = [1e9, 0, 0]\n");
    assert_eq!(fault, "2: the object reaches 2.0e9 m; at most 1e9 m can be rendered, scale it down");
    folder.write("far.obj", TETRAHEDRON.replace("v 1 0 0", "v 1e30 0 0"));
    let fault = folder.fault("[[object]]\nmesh = \"far.obj\"");
    assert_eq!(fault, "far.obj:2: vertex coordinate 1e30: coordinates must be finite and not beyond 1e9");
}

#[test]
fn the_built_in_scene_is_the_one_in_assets() {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    let built_in = Scene::load(None, &Overrides::default()).unwrap();
    let file = Scene::load(Some(&assets.join("scenes/teapot.toml")), &Overrides::default()).unwrap();
    assert_eq!(built_in.name, "built-in");
    assert_eq!((built_in.objects.len(), built_in.meshes.len()), (4, 4));
    assert_eq!(built_in.bounds(), file.bounds());
    assert_eq!((built_in.camera, &built_in.materials), (file.camera, &file.materials));
    for (a, b) in built_in.meshes.iter().zip(&file.meshes) {
        assert_eq!((&a.positions, &a.normals, &a.triangles), (&b.positions, &b.normals, &b.triangles));
        assert!(a.faults.is_empty(), "{}: {}", a.name, a.faults);
        assert!(!a.normals.is_empty());
    }
    let (Surroundings::Image(a), Surroundings::Image(b)) = (&built_in.environment.light, &file.environment.light)
    else {
        panic!()
    };
    assert_eq!(a.texels, b.texels);
    // The report's unit is 10 cm, ours metres.
    assert!((built_in.bounds().unwrap().extent().x - 0.3158).abs() < 1e-3);
}

#[test]
fn every_scene_in_assets_is_sound() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
    let mut count = 0;
    for entry in fs::read_dir(scenes).unwrap() {
        let scene = Scene::load(Some(&entry.unwrap().path()), &Overrides::default()).unwrap();
        assert!(scene.meshes.iter().all(|mesh| mesh.faults.is_empty()), "{}", scene.name);
        count += 1;
    }
    assert!(count >= 5);
}
