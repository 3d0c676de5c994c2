//! From rays to pixels: filters, shutters and lenses in closed form.

use irradiant::{ColorMode, MaxDepth, RenderSettings, load_text, render};
use irradiant_testkit::integrate_interval;

fn row(scene: &str, spp: u32) -> Vec<f64> {
    let file = load_text("test", scene, ".").unwrap_or_else(|e| panic!("{e}\n{scene}"));
    let settings = RenderSettings {
        samples_per_pixel: Some(spp),
        color: ColorMode::Rgb,
        max_depth: Some(MaxDepth::Limit(0)),
        threads: 1,
        ..RenderSettings::default()
    };
    let rendering = render(&file, &settings).unwrap_or_else(|e| panic!("{e}"));
    let bounds = rendering.film.bounds();
    (bounds.x0..bounds.x1).map(|x| rendering.film.pixel(x, bounds.y0).mean()[1]).collect()
}

/// A row of 9 pixels, one unit each at z = 1 for an orthographic camera and for a perspective one of 90 degrees alike.
fn film(filter: &str, camera: &str, world: &str) -> String {
    format!(
        "Film \"rgb\" \"integer xresolution\" 9 \"integer yresolution\" 1\nSampler \"zsobol\"\nPixelFilter {filter}\nCamera {camera} \"float screenwindow\" [ -4.5 4.5 -0.5 0.5 ]\nWorldBegin\n{world}"
    )
}

/// A rectangle at depth `z` from `x0` to `x1`, high enough for any row; x counts from the row's left end at z = 1.
fn rectangle(x0: f64, x1: f64, z: f64) -> String {
    let (a, b) = (x0 - 4.5, x1 - 4.5);
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 2 3 0 ] \"point3 P\" [ {a} -90 {z}  {b} -90 {z}  {b} 90 {z}  {a} 90 {z} ]\n"
    )
}

const BRIGHT: &str = "AreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ] \"bool twosided\" true\n";

#[test]
fn an_edge_is_the_integral_of_the_filter() {
    // Pixel i sees the filter's share beyond the edge. Stratified samples: the error is about 1e-3; bounds 8e-3, which the
    // neglect of a negative lobe (mitchell: 4 %), of a weight or a radius off by 5 % passes.
    let sinc = |x: f64| if x == 0.0 { 1.0 } else { (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x) };
    let gauss = |x: f64| (-2.0 * x * x).exp() - (-2.0f64 * 1.5 * 1.5).exp();
    let mitchell = |x: f64| {
        let (x, third) = (x.abs(), 1.0 / 3.0);
        let (b, c) = (third, third);
        if x <= 1.0 {
            (12.0 - 9.0 * b - 6.0 * c) * x.powi(3) + (-18.0 + 12.0 * b + 6.0 * c) * x * x + 6.0 - 2.0 * b
        } else {
            (-b - 6.0 * c) * x.powi(3) + (6.0 * b + 30.0 * c) * x * x - (12.0 * b + 48.0 * c) * x + 8.0 * b + 24.0 * c
        }
    };
    type Shape<'a> = &'a dyn Fn(f64) -> f64;
    let cases: [(&str, f64, Shape); 5] = [
        ("\"box\" \"float xradius\" 0.5", 0.5, &|_| 1.0),
        ("\"triangle\" \"float xradius\" 2", 2.0, &|x| 2.0 - x.abs()),
        ("\"gaussian\" \"float xradius\" 1.5 \"float sigma\" 0.5", 1.5, &gauss),
        ("\"mitchell\" \"float xradius\" 2 \"float B\" 0.333333 \"float C\" 0.333333", 2.0, &mitchell),
        ("\"sinc\" \"float xradius\" 4 \"float tau\" 3", 4.0, &|x| sinc(x) * sinc(x / 3.0)),
    ];
    for (filter, radius, f) in cases {
        for edge in [4.5, 4.2, 5.9] {
            let got = row(&film(filter, "\"orthographic\"", &format!("{BRIGHT}{}", rectangle(edge, 90.0, 1.0))), 16384);
            let whole = integrate_interval(f, -radius, radius, 1e-9);
            for (i, got) in got.into_iter().enumerate() {
                let from = (edge - (i as f64 + 0.5)).clamp(-radius, radius);
                let expected = integrate_interval(f, from, radius, 1e-9) / whole;
                assert!((got - expected).abs() < 8e-3, "{filter}, edge {edge}, pixel {i}: {got}, expected {expected}");
            }
        }
    }
}

#[test]
fn a_moving_edge_is_averaged_over_the_shutter() {
    // A dark screen whose edge moves from x = 2 at shutter opening to x = 6 at closing, uniformly: pixel i is bright for
    // the share of the time when the edge has not passed it. The error of 16384 independent samples would be 4e-3.
    let world = format!(
        "AttributeBegin\n{BRIGHT}{}AttributeEnd\nActiveTransform EndTime\nTranslate 4 0 0\nActiveTransform All\nMaterial \"diffuse\"\n{}",
        rectangle(-90.0, 90.0, 5.0),
        rectangle(-90.0, 2.0, 1.0)
    );
    for (i, got) in row(&film("\"box\"", "\"orthographic\"", &world), 16384).into_iter().enumerate() {
        let covered = |t: f64| (i as f64 + 1.0 - (2.0 + 4.0 * t)).clamp(0.0, 1.0);
        let expected = integrate_interval(covered, 0.0, 1.0, 1e-6);
        assert!((got - expected).abs() < 0.012, "pixel {i}: {got}, expected {expected}");
    }
}

#[test]
fn an_edge_out_of_focus_is_blurred_by_its_circle_of_confusion() {
    // In focus at 1, a bright half plane at 0.5, a lens of radius 1: seen from the middle pixel the edge is blurred by a
    // disk whose radius is one pixel. A pixel is the disk's share beyond the edge, averaged over the pixel.
    let camera = "\"perspective\" \"float fov\" 90 \"float lensradius\" 1 \"float focaldistance\" 1";
    let world = format!("{BRIGHT}{}", rectangle(4.5, 90.0, 0.5));
    let got = row(&film("\"box\"", camera, &world), 16384);
    let chord = |x: f64| if x.abs() < 1.0 { 2.0 * (1.0 - x * x).sqrt() / std::f64::consts::PI } else { 0.0 };
    let share = |from: f64| if from >= 1.0 { 0.0 } else { integrate_interval(chord, from.max(-1.0), 1.0, 1e-6) };
    for (i, got) in got.into_iter().enumerate() {
        let expected = integrate_interval(|x| share(4.5 - x), i as f64, i as f64 + 1.0, 1e-5);
        assert!((got - expected).abs() < 0.012, "pixel {i}: {got}, expected {expected}");
    }
}
