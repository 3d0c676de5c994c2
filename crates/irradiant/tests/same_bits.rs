//! The same bits for any number of threads: five scenes with motion, instances and textures, as files.

use irradiant::{ColorMode, IntegratorChoice, RenderSettings, load_text, render};

const HEAD: &str = "Film \"rgb\" \"integer xresolution\" 48 \"integer yresolution\" 40\nSampler \"zsobol\" \"integer pixelsamples\" 8\nIntegrator \"path\" \"integer maxdepth\" 6\n";
const VIEW: &str = "LookAt 0 1 -5  0 0.5 0  0 1 0\nCamera \"perspective\" \"float fov\" 45\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ .5 .6 .7 ]\nAttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 9 8 7 ]\nTranslate 0 4 0\nShape \"sphere\" \"float radius\" 0.5\nAttributeEnd\n";
const FLOOR: &str = "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 2 3 0 ] \"point3 P\" [ -9 -1 -9  9 -1 -9  9 -1 9  -9 -1 9 ] \"point2 uv\" [ 0 0 1 0 1 1 0 1 ]\n";

/// The picture of a scene rendered by so many threads, by the integrator of a name.
fn picture(scene: &str, integrator: &str, threads: usize, color: ColorMode) -> irradiant::image::Image {
    let file = load_text("scene", scene, ".").unwrap_or_else(|e| panic!("{e}"));
    let integrator = Some(IntegratorChoice::named(integrator).unwrap_or_else(|e| panic!("{e}")));
    let settings = RenderSettings { threads, color, integrator, ..RenderSettings::default() };
    render(&file, &settings).unwrap_or_else(|e| panic!("{e}")).image()
}

/// Its EXR file, by its bytes.
fn file_bytes(picture: &irradiant::image::Image) -> Vec<u8> {
    irradiant::image::write(picture, irradiant::image::FileFormat::Exr).expect("writable")
}

fn assert_same(scene: &str) {
    assert_same_by("path", scene);
}

fn assert_same_by(integrator: &str, scene: &str) {
    let one = picture(scene, integrator, 1, ColorMode::Spectral);
    let file = file_bytes(&one);
    assert_eq!(file, file_bytes(&picture(scene, integrator, 2, ColorMode::Spectral)), "1 and 2 threads differ");
    assert_eq!(file, file_bytes(&picture(scene, integrator, 5, ColorMode::Spectral)), "1 and 5 threads differ");
    // Of pixels: headers differ anyway.
    assert!(one.to_f32() != picture(scene, integrator, 1, ColorMode::Rgb).to_f32(), "the comparison has no bite");
}

#[test]
fn textures() {
    assert_same(&format!(
        "{HEAD}{VIEW}Texture \"check\" \"spectrum\" \"checkerboard\" \"float uscale\" 20 \"float vscale\" 20 \"rgb tex1\" [ .8 .7 .1 ] \"rgb tex2\" [ .1 .1 .3 ]\nMaterial \"diffuse\" \"texture reflectance\" \"check\"\n{FLOOR}Texture \"noise\" \"spectrum\" \"marble\"\nMaterial \"coateddiffuse\" \"texture reflectance\" \"noise\" \"float roughness\" 0.1\nShape \"sphere\"\n"
    ));
}

#[test]
fn motion() {
    assert_same(&format!(
        "{HEAD}{VIEW}Material \"diffuse\"\n{FLOOR}AttributeBegin\nActiveTransform EndTime\nTranslate 1 0.3 0\nRotate 40 0 1 1\nActiveTransform All\nMaterial \"conductor\" \"float roughness\" 0.2\nShape \"cylinder\" \"float radius\" 0.6\nAttributeEnd\n"
    ));
}

#[test]
fn instances() {
    let mut scene = format!(
        "{HEAD}{VIEW}Material \"diffuse\"\n{FLOOR}ObjectBegin \"thing\"\nMaterial \"dielectric\"\nShape \"sphere\" \"float radius\" 0.3\nMaterial \"diffuse\" \"rgb reflectance\" [ .8 .2 .1 ]\nTranslate 0 0.5 0\nShape \"disk\" \"float radius\" 0.4\nObjectEnd\n"
    );
    for i in 0..12 {
        scene += &format!(
            "AttributeBegin\nTranslate {} {} {}\nRotate {} 0 1 0\nObjectInstance \"thing\"\nAttributeEnd\n",
            i % 4 - 2,
            i / 4 - 1,
            i % 3,
            30 * i
        );
    }
    assert_same(&scene);
}

#[test]
fn moving_instances_and_depth_of_field() {
    let view = VIEW.replace("\"float fov\" 45", "\"float fov\" 45 \"float lensradius\" 0.1 \"float focaldistance\" 5");
    assert_same(&format!(
        "{HEAD}{view}Material \"diffuse\"\n{FLOOR}ObjectBegin \"thing\"\nMaterial \"coatedconductor\" \"float interface.roughness\" 0.1\nShape \"sphere\" \"float radius\" 0.6\nObjectEnd\nAttributeBegin\nActiveTransform EndTime\nTranslate 0.5 0.5 0\nActiveTransform All\nObjectInstance \"thing\"\nAttributeEnd\n"
    ));
}

#[test]
fn curves_patches_and_mixed_materials() {
    assert_same(&format!(
        "{HEAD}{VIEW}MakeNamedMaterial \"a\" \"string type\" \"diffuse\"\nMakeNamedMaterial \"b\" \"string type\" \"dielectric\" \"float eta\" 1.3\nMaterial \"mix\" \"string materials\" [ \"a\" \"b\" ] \"float amount\" 0.4\n{FLOOR}Shape \"bilinearmesh\" \"point3 P\" [ -1 0 0  1 0 0  -1 1 1  1 2 0 ]\nMaterial \"thinfilmpaint\"\nShape \"curve\" \"string type\" \"cylinder\" \"float width\" 0.3 \"point3 P\" [ -2 0 -1  -1 2 0  1 -1 0  2 1 -1 ]\n"
    ));
}

#[test]
fn shared_paths_of_blocks_that_the_picture_cuts() {
    let head = HEAD
        .replace("xresolution\" 48", "xresolution\" 42")
        .replace("yresolution\" 40", "yresolution\" 39")
        .replace("Film \"rgb\"", "Film \"gbuffer\"");
    let scene = format!(
        "{head}{VIEW}Material \"diffuse\"\n{FLOOR}Material \"conductor\" \"float roughness\" 0.2\nShape \"sphere\" \"float radius\" 0.6\nMaterial \"diffusetransmission\"\nTranslate 1 0.5 0\nShape \"disk\" \"float radius\" 0.5\n"
    );
    assert_same_by("sharedpath", &scene);
}
