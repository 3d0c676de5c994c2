//! Paths in batches have the bits of paths one at a time: sums of radiance and of its squares, and all counts.

use irradiant::core::film::FilmTile;
use irradiant::core::geometry::Level;
use irradiant::renderer::camera_samples::for_each_sample;
use irradiant::renderer::path::{PathIntegrator, Roulette};
use irradiant::renderer::record::NoRecord;
use irradiant::renderer::{Integrator, RenderStats, WorkUnit};
use irradiant::{ColorMode, Job, RenderSettings, load_text};
use std::sync::Arc;

const HEAD: &str = "Film \"rgb\" \"integer xresolution\" 37 \"integer yresolution\" 29\nSampler \"zsobol\" \"integer pixelsamples\" 8\nLookAt 0 1 -3.6  0 1 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\nWorldBegin\n";
/// A room of walls without a front; the first and the last are wound the other way.
const ROOM: &str = "Material \"diffuse\" \"rgb reflectance\" [ .7 .7 .6 ]\nShape \"trianglemesh\" \"integer indices\" [ 0 2 1 0 3 2 4 5 6 4 6 7 8 9 10 8 10 11 ] \"point3 P\" [ -1 0 -1  1 0 -1  1 0 1  -1 0 1   -1 2 -1  1 2 -1  1 2 1  -1 2 1   -1 0 1  1 0 1  1 2 1  -1 2 1 ]\nMaterial \"diffuse\" \"rgb reflectance\" [ .6 .1 .05 ]\nShape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ -1 0 -1  -1 0 1  -1 2 1  -1 2 -1 ]\nReverseOrientation\nMaterial \"diffuse\" \"rgb reflectance\" [ .1 .4 .1 ]\nShape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ 1 0 -1  1 0 1  1 2 1  1 2 -1 ]\nReverseOrientation\n";

/// A rectangular lamp around a place, facing down.
fn lamp(parameters: &str, x: f32, y: f32, z: f32, size: f32) -> String {
    let (a, b, c, d) = (x - size, x + size, z - size, z + size);
    format!(
        "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" {parameters}\nShape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ {a} {y} {c}  {b} {y} {c}  {b} {y} {d}  {a} {y} {d} ]\nAttributeEnd\n"
    )
}

fn ceiling_lamp() -> String {
    lamp("\"rgb L\" [ 17 12 4 ]", 0.0, 1.98, 0.0, 0.3)
}

/// The picture's sums and the counts, by batches or one path at a time.
fn picture(job: &Job, integrator: &PathIntegrator, in_batches: bool) -> (FilmTile, RenderStats) {
    let scene = &job.scene;
    let unit = WorkUnit { bounds: scene.bounds(), samples: 0..scene.samples_per_pixel };
    let mut tile = FilmTile::new(unit.bounds, scene.new_film().channels_per_pixel());
    let mut stats = RenderStats::default();
    if in_batches {
        integrator.render(scene, &unit, &mut tile, &mut stats);
    } else {
        for_each_sample(scene, &unit, &mut tile, &mut stats, |sample, ray, lambda, layers, stats| {
            integrator.radiance(scene, ray, &sample.stream, lambda, layers, stats, &mut NoRecord)
        });
    }
    (tile, stats)
}

fn assert_same_by(integrator: &PathIntegrator, text: &str) {
    for color in [ColorMode::Rgb, ColorMode::Spectral] {
        let file = load_text("scene", text, ".").unwrap_or_else(|e| panic!("{e}"));
        let settings = RenderSettings { color, ..RenderSettings::default() };
        let mut job = Job::new(&file, &settings).unwrap_or_else(|e| panic!("{e}"));
        let alone = picture(&job, integrator, false);
        let deep = integrator.max_depth.is_none_or(|depth| depth > 1);
        assert!(alone.1.shadow_rays > 1000 && (!deep || alone.1.longest_path > 1), "nothing to compare: {:?}", alone.1);
        for level in Level::available() {
            Arc::get_mut(&mut job.scene).expect("one owner").geometry.set_level(level);
            let batches = picture(&job, integrator, true);
            assert_eq!(alone.1, batches.1, "{level:?} {color:?}\n{text}");
            assert!(alone.0 == batches.0, "pixels differ: {level:?} {color:?}\n{text}");
        }
    }
}

fn assert_same(text: &str) {
    assert_same_by(&PathIntegrator::default(), text);
}

#[test]
fn a_room_with_a_lamp() {
    assert_same(&format!("{HEAD}{ROOM}{}", ceiling_lamp()));
}

#[test]
fn limits_and_constant_roulette() {
    let text = format!("{HEAD}{ROOM}{}", ceiling_lamp());
    assert_same_by(&PathIntegrator { max_depth: Some(2), ..PathIntegrator::default() }, &text);
    assert_same_by(&PathIntegrator { roulette: Roulette::Constant(0.3), ..PathIntegrator::default() }, &text);
}

fn lamps_of_all_kinds() -> String {
    let lamps = [
        ceiling_lamp(),
        lamp("\"rgb L\" [ 2 9 3 ] \"bool twosided\" true", 0.5, 1.0, 0.4, 0.1),
        lamp("\"rgb L\" [ 1 2 9 ]", -0.6, 0.02, 0.2, 0.2),
        "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 5 5 5 ]\nTranslate -0.5 1.2 0.3\nShape \"sphere\" \"float radius\" 0.1\nAttributeEnd\n".into(),
        "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 5 1 5 ]\nShape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ -.9 .5 0  -.9 1 0  -.9 1 .5 ]\nAttributeEnd\n".into(),
        "LightSource \"point\" \"rgb I\" [ .3 .2 .2 ] \"point3 from\" [ 0 1 -.5 ]\n".into(),
    ];
    // Surfaces that are asked alone, too.
    format!("{HEAD}{ROOM}{COATS}{}", lamps.concat())
}

/// A coated table, and a ball of rough glass on it. The coat is exact: with one as in pbrt, no surface of the scene chooses among candidates.
const COATS: &str = "AttributeBegin\nMaterial \"coateddiffuse\" \"rgb reflectance\" [ .2 .3 .7 ] \"float roughness\" .1 \"integer maxdepth\" 0\nTranslate .3 .4 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" 0.5\nMaterial \"dielectric\" \"float roughness\" .2\nTranslate .1 0 -.25\nShape \"sphere\" \"float radius\" 0.2\nAttributeEnd\n";

#[test]
fn one_of_many_lamps() {
    assert_same(&lamps_of_all_kinds());
}

#[test]
fn several_light_samples() {
    // Fewer strata than lamps, and one for each.
    for light_splits in [3, 8] {
        assert_same_by(&PathIntegrator { light_splits, ..PathIntegrator::default() }, &lamps_of_all_kinds());
    }
    // One lamp only, at every surface.
    assert_same_by(&PathIntegrator { light_candidates: 1, ..PathIntegrator::default() }, &lamps_of_all_kinds());
    // One lamp has one sample, but its light is weighed as one of all that are sampled.
    let text = format!("{HEAD}{ROOM}{}", ceiling_lamp());
    assert_same_by(&PathIntegrator { light_splits: 8, ..PathIntegrator::default() }, &text);
}

/// A spherical lamp.
fn ball(parameters: &str, center: [f32; 3], radius: f32) -> String {
    let [x, y, z] = center;
    format!(
        "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ .1 .1 .1 ]\nAreaLightSource \"diffuse\" {parameters}\nTranslate {x} {y} {z}\nShape \"sphere\" \"float radius\" {radius}\nAttributeEnd\n"
    )
}

/// A plate of metal on the floor, in which lamps are seen.
fn plate(roughness: f32) -> String {
    format!(
        "Material \"conductor\" \"float roughness\" {roughness}\nShape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ -.9 .1 -.8  .9 .1 -.8  .9 .3 .8  -.9 .3 .8 ]\n"
    )
}

// Small and large ones, two-sided, one that shines inwards around everything, one that walls cut; metals find them by themselves.
#[test]
fn spherical_lamps_over_metal() {
    let lamps = [
        ball("\"rgb L\" [ 900 900 900 ]", [-0.6, 1.2, 0.1], 0.02),
        ball("\"rgb L\" [ 8 4 2 ] \"bool twosided\" true", [0.4, 0.9, 0.3], 0.25),
        ball("\"rgb L\" [ 2 9 3 ]", [0.0, 1.9, 0.2], 0.3),
        format!("ReverseOrientation\n{}ReverseOrientation\n", ball("\"rgb L\" [ .3 .3 .4 ]", [0.0, 1.0, -1.0], 8.0)),
        ball("\"rgb L\" [ 5 1 5 ]", [0.7, 1.5, 0.0], 0.1)
            .replace("\"float radius\"", "\"float alpha\" 0.5 \"float radius\""),
    ];
    for count in [1, 5] {
        assert_same(&format!("{HEAD}{ROOM}{}{}{}", plate(0.02), plate(0.3), lamps[..count].concat()));
    }
}

// Paths part in the tree at once, and come to their lights at different levels.
#[test]
fn hundreds_of_lamps() {
    let lamps: String = (0..300)
        .map(|i| {
            let place = |k: u32| (i as f32 * [0.618_034, 0.754_878, 0.569_84][k as usize]).fract();
            let (x, y, z) = (1.8 * place(0) - 0.9, 0.4 + 1.4 * place(1), 1.8 * place(2) - 0.9);
            match i % 3 {
                0 => lamp("\"rgb L\" [ 5 4 3 ]", x, y, z, 0.02),
                1 => ball("\"rgb L\" [ 3 4 5 ]", [x, y, z], 0.015),
                _ => format!("LightSource \"point\" \"rgb I\" [ .002 .002 .001 ] \"point3 from\" [ {x} {y} {z} ]\n"),
            }
        })
        .collect();
    let text = format!("{HEAD}{ROOM}{COATS}{}{lamps}", plate(0.1));
    for light_candidates in [1, 2, 5] {
        assert_same_by(&PathIntegrator { light_candidates, ..PathIntegrator::default() }, &text);
    }
    // With lights at infinity, which are picked before the tree is asked.
    assert_same(&format!(
        "{HEAD}LightSource \"distant\" \"rgb L\" [ .5 .5 .5 ]\nLightSource \"infinite\" \"rgb L\" [ .1 .2 .3 ]\n{ROOM}{}{lamps}",
        plate(0.1)
    ));
}

/// An uneven sky of 16 by 16 pixels.
fn sky_file() -> String {
    let image = irradiant::image::Image::from_fn(16, 16, ["R", "G", "B"], |x, y| {
        [0, 1, 2].map(|c| ((x * 111 + y * 1776 + c * 37) % 101) as f32 / 50.0)
    });
    let path = std::env::temp_dir().join(format!("irradiant-staged-sky-{}.exr", std::process::id()));
    let bytes = irradiant::image::write(&image, irradiant::image::FileFormat::Exr).expect("writable");
    std::fs::write(&path, bytes).expect("a file");
    path.display().to_string().replace('\\', "/")
}

// Alone, where it needs no picking; turned and squeezed, with a lamp beside it.
#[test]
fn under_an_image_of_the_sky() {
    let file = sky_file();
    let sky = format!("LightSource \"infinite\" \"string filename\" \"{file}\" \"float scale\" 0.5\n");
    let smooth = "Material \"diffuse\" \"rgb reflectance\" [ .4 .5 .6 ]\nShape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ -.5 .3 0  .4 .3 .1  .4 .9 .3  -.5 .9 .2 ] \"normal N\" [ -.4 -.2 -1  .3 0 -1  .2 .3 -1  0 0 -1 ] \"point2 uv\" [ 0 0 1 0 1 1 0 1 ]\nMaterial \"dielectric\"\nTranslate 0.4 0.5 -0.5\nShape \"sphere\" \"float radius\" 0.3\n";
    assert_same(&format!("{HEAD}{sky}{ROOM}{}{smooth}", plate(0.2)));
    assert_same(&format!(
        "{HEAD}AttributeBegin\nRotate 50 1 2 .5\nScale 1 .6 1\n{sky}AttributeEnd\n{ROOM}{}{}{smooth}",
        ceiling_lamp(),
        plate(0.05)
    ));
    // A dozen lamps beside it, of which some are picked.
    let lamps: String = (0..12).map(|i| lamp("\"rgb L\" [ 3 3 2 ]", 0.15 * i as f32 - 0.9, 1.9, 0.2, 0.05)).collect();
    assert_same(&format!("{HEAD}{sky}{ROOM}{}{lamps}{smooth}", plate(0.1)));
    // Where no surface shines, the last rays need not know what they meet.
    for depth in 1..4 {
        let text = format!("{HEAD}{sky}{ROOM}{}{smooth}", plate(0.2));
        let integrator = PathIntegrator { max_depth: Some(depth), ..PathIntegrator::default() };
        assert_same_by(&integrator, &text);
        let prism = "Material \"dielectric\" \"spectrum eta\" [ 400 2.6 700 1.1 ]\nTranslate -0.7 0 0\nShape \"sphere\" \"float radius\" 0.3\n";
        assert_same_by(&integrator, &format!("{text}{prism}"));
        // An opening, and a mix whose other half is none.
        let holes = "MakeNamedMaterial \"wall\" \"string type\" \"diffuse\"\nMakeNamedMaterial \"none\" \"string type\" \"interface\"\nMaterial \"mix\" \"string materials\" [ \"wall\" \"none\" ] \"float amount\" 0.5\nShape \"sphere\" \"float radius\" 0.4 \"float zmax\" 0.2\n";
        assert_same_by(&integrator, &format!("{text}{holes}"));
    }
    // All that the camera sees lies behind a surface that may not be there: what a path knows of the sky is not a former path's.
    let veil = "MakeNamedMaterial \"veil\" \"string type\" \"diffuse\"\nMakeNamedMaterial \"none\" \"string type\" \"interface\"\nAttributeBegin\nMaterial \"mix\" \"string materials\" [ \"veil\" \"none\" ] \"float amount\" 0.5\nTranslate 0 1 0\nShape \"sphere\" \"float radius\" 6\nAttributeEnd\n";
    assert_same(&format!("{HEAD}{sky}{veil}{ROOM}"));
    std::fs::remove_file(&file).expect("removed");
}

// No ray meets these lights: their samples are asked for what lets them pass.
#[test]
fn lights_that_no_ray_meets_through_surfaces_that_may_not_be_there() {
    let veil = "MakeNamedMaterial \"veil\" \"string type\" \"diffuse\"\nMakeNamedMaterial \"none\" \"string type\" \"interface\"\nAttributeBegin\nMaterial \"mix\" \"string materials\" [ \"veil\" \"none\" ] \"float amount\" 0.5\nTranslate 0 1 0\nShape \"sphere\" \"float radius\" 0.7\nAttributeEnd\n";
    let lights = "LightSource \"point\" \"rgb I\" [ 3 2 2 ] \"point3 from\" [ 0.1 1 -.2 ]\nLightSource \"distant\" \"rgb L\" [ 1 1 2 ] \"point3 from\" [ .1 .2 -1 ] \"point3 to\" [ 0 0 0 ]\nLightSource \"spot\" \"rgb I\" [ 5 9 2 ] \"point3 from\" [ 0 1.2 .1 ] \"point3 to\" [ .3 0 -.3 ]\n";
    let text = format!("{HEAD}{lights}{ROOM}{}{veil}{}", plate(0.2), ceiling_lamp());
    for (light_splits, light_candidates) in [(1, 1), (1, 2), (3, 2), (8, 1)] {
        assert_same_by(&PathIntegrator { light_splits, light_candidates, ..PathIntegrator::default() }, &text);
    }
    // So many that some are picked, where strata may pick nothing.
    let many: String = (0..12)
        .map(|i| {
            format!(
                "LightSource \"spot\" \"rgb I\" [ 5 {i} 2 ] \"point3 from\" [ 0 1.2 .1 ] \"point3 to\" [ .3 0 -.{i} ]\n"
            )
        })
        .collect();
    for light_candidates in [2, 3] {
        let text = text.replace("WorldBegin\n", &format!("WorldBegin\n{many}"));
        assert_same_by(&PathIntegrator { light_candidates, ..PathIntegrator::default() }, &text);
    }
}

#[test]
fn a_sky_and_nothing_else() {
    let file =
        load_text("scene", &format!("{HEAD}LightSource \"infinite\" \"rgb L\" [ .5 .6 .7 ]\n"), ".").expect("a scene");
    let job = Job::new(&file, &RenderSettings::default()).expect("a job");
    let integrator = PathIntegrator::default();
    let (alone, batches) = (picture(&job, &integrator, false), picture(&job, &integrator, true));
    assert!(alone == batches && alone.1.camera_rays > 1000);
}

#[test]
fn mixed_materials_textures_and_relief() {
    assert_same(&format!(
        "{HEAD}{ROOM}{}Texture \"check\" \"spectrum\" \"checkerboard\" \"float uscale\" 8 \"float vscale\" 8 \"rgb tex1\" [ .8 .7 .1 ] \"rgb tex2\" [ .1 .1 .3 ]\nMaterial \"diffuse\" \"texture reflectance\" \"check\"\nShape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ -.8 .1 .5  .2 .1 .6  -.4 .9 .7 ] \"point2 uv\" [ 0 0 1 0 0 1 ]\nTranslate 0.3 0.4 0\nMaterial \"conductor\" \"float roughness\" 0.1\nShape \"sphere\" \"float radius\" 0.4\nTranslate -0.6 0.2 -0.3\nMaterial \"coateddiffuse\" \"rgb reflectance\" [ .2 .3 .7 ]\nShape \"disk\" \"float radius\" 0.3\nMaterial \"diffuse\"\nShape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ 0 0 0  .5 0 .1  .2 .6 0 ] \"normal N\" [ 0 0 -1  .3 0 -1  0 .3 -1 ]\n",
        ceiling_lamp()
    ));
}

#[test]
fn under_a_sky_with_glass_and_depth_of_field() {
    let head =
        HEAD.replace("\"float fov\" 40", "\"float fov\" 40 \"float lensradius\" 0.05 \"float focaldistance\" 3.6");
    assert_same(&format!(
        "{head}LightSource \"infinite\" \"rgb L\" [ .5 .6 .7 ]\n{ROOM}{}Translate 0.2 0.5 -0.4\nMaterial \"dielectric\" \"spectrum eta\" \"glass-F11\"\nShape \"sphere\" \"float radius\" 0.5\nMaterial \"interface\"\nShape \"sphere\" \"float radius\" 0.6\n",
        ceiling_lamp()
    ));
}

#[test]
fn instances_motion_and_openings() {
    assert_same(&format!(
        "{HEAD}{ROOM}{}ObjectBegin \"thing\"\nMaterial \"diffuse\" \"rgb reflectance\" [ .8 .2 .1 ]\nShape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ -.3 0 0  .3 0 0  0 .5 .2 ]\nObjectEnd\nObjectInstance \"thing\"\nShape \"trianglemesh\" \"float alpha\" 0.5 \"integer indices\" [ 0 1 2 ] \"point3 P\" [ -.8 .2 -.5  .3 .2 -.5  0 .9 -.4 ]\nAttributeBegin\nActiveTransform EndTime\nTranslate 0.3 0.3 0\nActiveTransform All\nObjectInstance \"thing\"\nAttributeEnd\n",
        ceiling_lamp()
    ));
}

/// A double Gauss lens (US patent 2,673,491), its focal length 50 mm.
fn lens_file() -> String {
    let path = std::env::temp_dir().join(format!("irradiant-lens-{}.dat", std::process::id()));
    let lens = "29.475 3.76 1.67 25.2\n84.83 .12 1 25.2\n19.275 4.025 1.67 23\n40.77 3.275 1.699 23\n12.75 5.705 1 18\n0 4.5 0 17.1\n-14.495 1.18 1.603 17\n40.77 6.065 1.658 20\n-20.385 .19 1 20\n437.065 3.22 1.717 20\n-39.73 5 1 20\n";
    std::fs::write(&path, lens).expect("a file in the temporary directory");
    path.display().to_string()
}

// Screens at rest are computed in lanes, the rest one by one; real glass is blind at the corners of a large film. Filters with and without
// tables, one with negative weights, and a limit of what a sample may bring.
#[test]
fn cameras_and_filters_of_all_kinds() {
    let lens = lens_file();
    let glass =
        format!("\"realistic\" \"string lensfile\" \"{lens}\" \"float focusdistance\" 3 \"float aperturediameter\" 10");
    let still = "LookAt 0 1 -3.6  0 1 0  0 1 0\n";
    let moving = "ActiveTransform EndTime\nTranslate .3 .1 0\nActiveTransform All\nLookAt 0 1 -3.6  0 1 0  0 1 0\n";
    for (camera, filter, place) in [
        (glass.as_str(), "\"sinc\"", still),
        ("\"perspective\" \"float fov\" 40 \"float lensradius\" .1 \"float focaldistance\" 3", "\"triangle\"", still),
        ("\"perspective\" \"float fov\" 40", "\"mitchell\"", moving),
        ("\"orthographic\"", "\"gaussian\"", still),
        ("\"spherical\"", "\"box\"", "LookAt 0 1 -.5  0 1 0  0 1 0\n"),
    ] {
        let head = HEAD
            .replace("\"perspective\" \"float fov\" 40\n", &format!("{camera}\nPixelFilter {filter}\n"))
            .replace(still, place)
            .replace("Film \"rgb\"", "Film \"rgb\" \"float maxcomponentvalue\" 9 \"float diagonal\" 90");
        assert_ne!(head, HEAD);
        let text = format!("{head}{ROOM}{}", ceiling_lamp());
        assert_same(&text);
        let job = Job::new(&load_text("scene", &text, ".").unwrap(), &RenderSettings::default()).unwrap();
        let (_, stats) = picture(&job, &PathIntegrator::default(), true);
        assert_eq!(stats.camera_rays < stats.paths, camera == glass, "{camera}: {stats:?}");
    }
    std::fs::remove_file(lens).expect("the file is still there");
}
