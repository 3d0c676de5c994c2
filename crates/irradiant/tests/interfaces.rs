//! A shape of material "interface" bounds a medium and is no surface: without media it is nothing at all.

use irradiant::{RenderSettings, load_text, render};

/// Pixels of a floor with a shiny ball under a lamp, a point light and a sky, with or without interfaces around things.
fn pixels(around_light: &str, around_all: &str) -> Vec<u32> {
    let text = format!(
        "LookAt 0 2 6 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" 40\n\
         Film \"rgb\" \"integer xresolution\" 24 \"integer yresolution\" 24\n\
         Sampler \"independent\" \"integer pixelsamples\" 4 Integrator \"volpath\"\nWorldBegin\n\
         LightSource \"infinite\" \"rgb L\" [.1 .2 .3]\nLightSource \"point\" \"point3 from\" [1 2 1]\n\
         Material \"interface\"\n{around_light}\n{around_all}\n\
         Material \"conductor\" \"float roughness\" .2 Shape \"sphere\" \"float radius\" .7\n\
         Material \"diffuse\" AttributeBegin Translate 0 -1 0 Rotate 90 1 0 0 Shape \"disk\" \"float radius\" 3 AttributeEnd\n\
         Translate -1 2 0 Rotate 90 1 0 0 AreaLightSource \"diffuse\" \"bool twosided\" true Shape \"disk\" \"float radius\" .4\n"
    );
    let file = load_text("interfaces.pbrt", &text, ".").unwrap_or_else(|e| panic!("{e}"));
    let picture = render(&file, &RenderSettings::default()).unwrap_or_else(|e| panic!("{e}"));
    picture.image().to_f32().iter().map(|v| v.to_bits()).collect()
}

#[test]
fn without_media_an_interface_is_nothing() {
    let bare = pixels("", "");
    assert!(bare.iter().any(|b| f32::from_bits(*b) > 0.01));
    // Around a point light (which must not go dark), around everything, moving, and in an object.
    let ball = "AttributeBegin Translate 1 2 1 Shape \"sphere\" \"float radius\" .2 AttributeEnd";
    assert_eq!(pixels(ball, ""), bare);
    assert_eq!(pixels("", "Shape \"sphere\" \"float radius\" 5"), bare);
    assert_eq!(pixels(ball, "Shape \"trianglemesh\" \"point3 P\" [-9 0 2 9 0 2 0 9 2]"), bare);
    let object =
        "ObjectBegin \"o\" Shape \"sphere\" ObjectEnd AttributeBegin Scale 2 2 2 ObjectInstance \"o\" AttributeEnd";
    assert_eq!(pixels(ball, object), bare);
}
