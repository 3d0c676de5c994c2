//! Lights have the densities that they claim: found by chance, sampled, and both weighted by the power heuristic, they give
//! one picture; whichever way one of many is picked (ledger rows B21, B28, B31, B37).
//!
//! What each comparison would have seen is the number that it passes to `assert_agree`; see `estimate` for the bounds and
//! false-alarm rates.

mod estimate;

use estimate::{How, assert_agree, estimate, film, quad};
use irradiant::scene::desc::IntegratorKind::{self, SimplePath};

const LIGHTS_AND_BSDF: IntegratorKind = SimplePath { sample_lights: true, sample_bsdf: true };
const BSDF_ONLY: IntegratorKind = SimplePath { sample_lights: false, sample_bsdf: true };

fn diffuse(r: f32, g: f32, b: f32) -> String {
    format!("Material \"diffuse\" \"rgb reflectance\" [ {r} {g} {b} ]\n")
}

fn twenty_lights(sampler: &str) -> String {
    let mut text = film(8)
        + &format!("Integrator \"path\" \"string lightsampler\" \"{sampler}\"\n")
        + "LookAt 0 4 -6  0 0.5 0  0 1 0\nCamera \"perspective\" \"float fov\" 50\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ .05 .08 .1 ]\nLightSource \"distant\" \"rgb L\" [ .3 .2 .2 ] \"point3 from\" [ 1 4 -1 ]\n";
    for i in 0..6 {
        let (x, z) = (i as f32 - 2.5, (i * i % 5) as f32 - 2.0);
        text += &format!(
            "LightSource \"point\" \"rgb I\" [ {} .4 .5 ] \"point3 from\" [ {x} 1.5 {z} ]\n",
            0.2 + 0.3 * i as f32
        );
        text += &format!(
            "LightSource \"spot\" \"rgb I\" [ 2 {} 3 ] \"point3 from\" [ {z} 3 {x} ] \"point3 to\" [ 0 0 0 ] \"float coneangle\" 25\n",
            1 + i
        );
    }
    for i in 0..6 {
        let (x, z) = ((i % 3) as f32 * 2.0 - 2.0, (i / 3) as f32 * 3.0 - 1.5);
        let shape = ["sphere", "disk", "cylinder"][i % 3];
        text += &format!(
            "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ {} 3 2 ] \"bool twosided\" {}\nTranslate {x} 2.2 {z}\nRotate {} 1 0 1\nScale .3 .3 .3\nShape \"{shape}\"\nAttributeEnd\n",
            1 + i,
            i < 3,
            30 * i
        );
    }
    text + &diffuse(0.6, 0.5, 0.4)
        + &quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]])
        + "Material \"conductor\" \"float roughness\" 0.5\nTranslate 0.5 0.7 0\nShape \"sphere\" \"float radius\" 0.7\n"
}

#[test]
fn light_samplers_agree_on_twenty_lights() {
    // Each light's share is about 5 %: one that a sampler never picks, or whose probability is wrong by 20 %, is seen.
    let tree = estimate(&twenty_lights("bvh"), How::new(16384, 81).depth(2));
    for (seed, name, spp) in [(82, "power", 16384), (83, "uniform", 16384), (84, "exhaustive", 16384)] {
        let other = estimate(&twenty_lights(name), How::new(spp, seed).depth(2));
        assert_agree(&tree, &other, 0.03, name);
    }
}

/// A floor below an emitter.
fn floor_below(emitter: &str) -> String {
    film(8)
        + "LookAt 0 2.5 -4  0 0 -1.5  0 1 0\nCamera \"perspective\" \"float fov\" 25\nWorldBegin\n"
        + &diffuse(0.7, 0.6, 0.5)
        + &quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]])
        + "AreaLightSource \"diffuse\" \"rgb L\" [ 4 5 6 ] \"bool twosided\" true\n"
        + emitter
}

#[test]
fn area_lights_have_the_density_that_they_claim() {
    // Found by chance, sampled, and both weighted by the power heuristic: three estimates of the floor below each kind of
    // emitter. A density wrong by a factor (area for solid angle, two sides for one, one triangle for the mesh) is an
    // error of that factor in the second and a lesser one in the third (B21).
    let emitters = [
        ("sphere", "Translate 0 1 0\nShape \"sphere\" \"float radius\" 0.6\n".to_string()),
        ("part of a sphere", "Translate 0 1 0\nShape \"sphere\" \"float radius\" 0.8 \"float zmin\" -0.3 \"float phimax\" 270\n".into()),
        ("disk", "Translate 0 1 0\nRotate 60 1 0 0\nShape \"disk\" \"float radius\" 0.9 \"float innerradius\" 0.2\n".into()),
        ("cylinder", "Translate 0 1 0\nRotate 30 0 1 0\nShape \"cylinder\" \"float radius\" 0.4 \"float zmin\" -0.7 \"float zmax\" 0.7\n".into()),
        ("triangles", quad([[-0.7, 0.4, -0.5], [0.7, 0.5, -0.5], [0.7, 1.5, 0.9], [-0.6, 1.2, 0.4]])),
        ("small triangles", quad([[-0.2, 1.4, -0.2], [0.2, 1.4, -0.2], [0.2, 1.4, 0.2], [-0.2, 1.4, 0.2]])),
        ("patch", "Shape \"bilinearmesh\" \"point3 P\" [ -0.8 0.6 -0.5  0.8 1 -0.5  -0.8 1.4 0.5  0.8 0.7 0.6 ]\n".into()),
        ("rectangle", "Shape \"bilinearmesh\" \"point3 P\" [ -0.8 1 -0.5  0.8 1 -0.5  -0.8 1 0.5  0.8 1 0.5 ]\n".into()),
    ];
    for (i, (name, emitter)) in emitters.iter().enumerate() {
        let (scene, seed) = (floor_below(emitter), 10 * i as u64);
        // Small ones are seldom found by chance.
        let power = if name.starts_with("small") { 0.15 } else { 0.06 };
        let chance = estimate(&scene, How::new(8192, 201 + seed).by(BSDF_ONLY).depth(1));
        let sampled = estimate(&scene, How::new(4096, 202 + seed).by(LIGHTS_AND_BSDF).depth(1));
        let weighted = estimate(&scene, How::new(4096, 203 + seed).depth(1));
        assert_agree(&sampled, &chance, power, &format!("{name}, sampled"));
        assert_agree(&weighted, &chance, power, &format!("{name}, weighted"));
        assert_agree(&weighted, &sampled, 0.06, &format!("{name}, weighted and sampled"));
    }
}

/// A square image in a folder of its own.
fn write_environment(name: &str) -> String {
    let folder = std::env::temp_dir().join(format!("irradiant-estimators-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a temporary folder");
    let image = irradiant::image::Image::from_fn(32, 32, ["R", "G", "B"], |x, y| {
        // A gentle gradient and a sun.
        let sun = if (20..22).contains(&x) && (17..19).contains(&y) { 60.0 } else { 0.0 };
        [0.2 + 0.02 * x as f32 + sun, 0.4 + sun, 0.1 + 0.02 * y as f32 + sun]
    });
    let path = folder.join(name);
    let bytes = irradiant::image::write(&image, irradiant::image::FileFormat::Exr).expect("writable");
    std::fs::write(&path, bytes).expect("a file");
    path.display().to_string().replace('\\', "/")
}

#[test]
fn environments_have_the_density_that_they_claim() {
    let file = write_environment("sky.exr");
    let scene = |rest: &str| {
        film(8)
            + "LookAt 0 2.5 -3  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\nWorldBegin\n"
            + &format!("LightSource \"infinite\" \"string filename\" \"{file}\"{rest}\n")
            + &diffuse(0.7, 0.6, 0.5)
            + &quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]])
            + "Material \"conductor\" \"float roughness\" 0.3\nTranslate 0 0.6 0\nShape \"sphere\" \"float radius\" 0.6\n"
    };
    // The portal is the whole opening of a wall around the scene's upper half.
    let wall = "\nMaterial \"diffuse\"\nShape \"trianglemesh\" \"integer indices\" [ 0 1 4 4 1 5  1 2 5 5 2 6  2 3 6 6 3 7  3 0 7 7 0 4 ] \"point3 P\" [ -5 0 -5  5 0 -5  5 0 5  -5 0 5  -3 4 -3  3 4 -3  3 4 3  -3 4 3 ]";
    let portal = format!(" \"point3 portal\" [ -3 4 -3  3 4 -3  3 4 3  -3 4 3 ]{wall}");
    for (i, rest) in ["", portal.as_str()].into_iter().enumerate() {
        let (scene, seed) = (scene(rest), 300 + 10 * i as u64);
        let chance = estimate(&scene, How::new(32768, seed).by(BSDF_ONLY).depth(1));
        let sampled = estimate(&scene, How::new(8192, seed + 1).by(LIGHTS_AND_BSDF).depth(1));
        let weighted = estimate(&scene, How::new(8192, seed + 2).depth(1));
        assert_agree(&sampled, &chance, 0.05, "sampled");
        assert_agree(&weighted, &chance, 0.05, "weighted");
        assert_agree(&weighted, &sampled, 0.03, "weighted and sampled");
    }
    let _ = std::fs::remove_dir_all(std::path::Path::new(&file).parent().expect("its folder"));
}
