//! The gbuffer film's channels, by pbrt-v4's definitions (`film.cpp`, `GBufferFilm::AddSample` and `GetImage`).

use irradiant::{ColorMode, RenderSettings, load_text, render};

/// One pixel, its left half covered by a square of reflectance 0.4 at depth 4, seen by a camera of four times the usual
/// sensitivity whose samples are cut off at 0.01.
const SCENE: &str = r#"
Film "gbuffer" "integer xresolution" 1 "integer yresolution" 1 "float iso" 400 "float maxcomponentvalue" 0.01
PixelFilter "box" "float xradius" 0.5 "float yradius" 0.5
Sampler "zsobol" "integer pixelsamples" 1024
Translate 7 0 0
Camera "orthographic" "float screenwindow" [ -1 1 -1 1 ]
WorldBegin
LightSource "infinite"
Material "diffuse" "spectrum reflectance" [ 300 0.4 900 0.4 ]
Translate -7 0 0
Shape "bilinearmesh" "point3 P" [ -1 -1 4  0 -1 4  -1 1 4  0 1 4 ]
"#;

/// A film that let its sensor scale reflectance, cut it off, or counted samples that hit nothing as positions and normals of
/// zero would be off by a factor of 2 or more; tolerances are 1 % (wavelength noise of 1024 stratified samples is a tenth).
#[test]
fn geometry_is_that_of_what_is_hit_and_reflectance_is_not_exposed() {
    let file = load_text("test", SCENE, ".").unwrap_or_else(|e| panic!("{e}"));
    for color in [ColorMode::Spectral, ColorMode::Rgb] {
        let settings = RenderSettings { color, threads: 1, ..RenderSettings::default() };
        let image = render(&file, &settings).unwrap_or_else(|e| panic!("{e}")).image();
        let at = |name: &str| {
            let channel = image.channels().iter().position(|c| c == name);
            image.get(0, 0, channel.unwrap_or_else(|| panic!("no channel {name}")))
        };
        let expected = [
            ("Albedo.R", 0.2),
            ("Albedo.G", 0.2),
            ("Albedo.B", 0.2),
            ("P.X", -0.5),
            ("P.Y", 0.0),
            ("P.Z", 4.0),
            ("u", 0.5),
            ("v", 0.5),
            ("dzdx", 0.0),
            ("dzdy", 0.0),
            ("N.X", 0.0),
            ("N.Y", 0.0),
        ];
        for (name, value) in expected {
            let got = at(name);
            assert!((got - value).abs() < 0.01 * value.abs().max(0.5), "{color:?} {name}: {got}, expected {value}");
        }
        assert!((at("N.Z").abs() - 1.0).abs() < 1e-6 && at("N.Z") == at("Ns.Z"), "{color:?}: {}", at("N.Z"));
        assert!(at("R") < 0.0101, "{color:?}: {}", at("R"));
    }
}
