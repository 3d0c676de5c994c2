//! Scenes whose pictures are known in closed form, rendered through the front door (ledger rows A09, A12, A13, A30, A45,
//! B21, B28, B35 and the furnace).
//!
//! Each check states its bound. Random ones run with fixed seeds: they pass or fail, never flicker; bounds are at least 4
//! standard errors, and each says which bias would have been seen.

mod estimate;

use estimate::{How, assert_is, estimate};
use irradiant::{ColorMode, MaxDepth, RenderSettings, load_text, render};

/// Mean RGB of the whole picture.
fn mean(scene: &str, spp: u32, color: ColorMode, max_depth: MaxDepth) -> [f64; 3] {
    let pixels = picture(scene, spp, color, max_depth);
    let n = pixels.len() as f64;
    std::array::from_fn(|c| pixels.iter().map(|p| p[c]).sum::<f64>() / n)
}

fn picture(scene: &str, spp: u32, color: ColorMode, max_depth: MaxDepth) -> Vec<[f64; 3]> {
    let file = load_text("test", scene, ".").unwrap_or_else(|e| panic!("{e}"));
    let settings = RenderSettings {
        samples_per_pixel: Some(spp),
        color,
        max_depth: Some(max_depth),
        threads: 1,
        ..RenderSettings::default()
    };
    let rendering = render(&file, &settings).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(rendering.header.samples_refused, 0);
    let image = rendering.image().to_rgb().expect("R, G, B");
    image.to_f32().chunks(3).map(|p| std::array::from_fn(|c| f64::from(p[c]))).collect()
}

fn assert_close(got: [f64; 3], expected: f64, tolerance: f64, what: &str) {
    for c in 0..3 {
        assert!((got[c] - expected).abs() <= tolerance * expected.max(1e-30), "{what}: {got:?}, expected {expected}");
    }
}

fn film(size: u32) -> String {
    format!(
        "Film \"rgb\" \"integer xresolution\" {size} \"integer yresolution\" {size}\nPixelFilter \"box\"\nSampler \"zsobol\" \"integer pixelsamples\" 16\n"
    )
}

/// A closed sphere that emits and reflects diffusely, seen from inside.
fn furnace(rho: f64) -> String {
    estimate::film(8)
        + &format!(
            "Camera \"perspective\" \"float fov\" 60\nWorldBegin\nReverseOrientation\nMaterial \"diffuse\" \"spectrum reflectance\" [ 300 {rho} 900 {rho} ]\nAreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ]\nShape \"sphere\" \"float radius\" 3\n"
        )
}

#[test]
fn a_furnace_of_albedo_rho_is_brighter_by_the_geometric_series() {
    // Off centre nothing changes; every path sees Le at each vertex, so what noise there is comes from light samples and
    // roulette. The last number is the bias that would be seen.
    for (i, rho) in [0.2, 0.5, 0.8].into_iter().enumerate() {
        let picture = estimate(&furnace(rho), How::new(8192, 1 + i as u64));
        assert_is(&picture, [1.0 / (1.0 - rho); 3], 0.012, &format!("furnace of albedo {rho}"));
    }
    assert_is(&estimate(&furnace(0.5), How::new(8192, 4).spectral()), [2.0; 3], 0.012, "spectral furnace");
}

#[test]
fn a_closed_emitter_at_depth_n_is_the_partial_sum() {
    // Depth n is K^0 to K^n of Le: an off-by-one in the depth limit is an error of rho^n.
    let rho = 0.5f64;
    for depth in 0..5 {
        let expected: f64 = (0..=depth).map(|i| rho.powi(i)).sum();
        let picture = estimate(&furnace(rho), How::new(8192, 10 + depth as u64).depth(depth as u32));
        assert_is(&picture, [expected; 3], 0.008, &format!("depth {depth}"));
    }
}

#[test]
fn an_emitter_has_its_radiance_at_any_distance() {
    for distance in [0.01, 1.0, 1e4] {
        let scene = film(4)
            + &format!(
                "Camera \"perspective\" \"float fov\" 10\nWorldBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 2 3 4 ] \"bool twosided\" true\nTranslate 0 0 {distance}\nShape \"disk\" \"float radius\" {distance}\n"
            );
        for p in picture(&scene, 4, ColorMode::Rgb, MaxDepth::None) {
            for (c, l) in [2.0, 3.0, 4.0].into_iter().enumerate() {
                assert!((p[c] - l).abs() < 2e-6 * l, "{distance}: {p:?}");
            }
        }
        // Spectral: the same within 4 standard errors of the wavelengths' sampling; 1 % would be seen.
        let p = mean(&scene, 1024, ColorMode::Spectral, MaxDepth::None);
        assert!((p[1] - 3.0).abs() < 0.01 * 3.0, "{p:?}");
    }
}

#[test]
fn a_point_light_over_a_plane_gives_intensity_cosine_over_distance_squared() {
    let (height, x, rho) = (2.0, 1.5, 0.6);
    let scene = film(1)
        + &format!(
            "LookAt {x} 5 0  {x} 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 0.01\nWorldBegin\nLightSource \"point\" \"rgb I\" [ 7 7 7 ] \"point3 from\" [ 0 {height} 0 ]\nMaterial \"diffuse\" \"rgb reflectance\" [ {rho} {rho} {rho} ]\nShape \"trianglemesh\" \"integer indices\" [ 0 1 2 2 3 0 ] \"point3 P\" [ -9 0 -9  9 0 -9  9 0 9  -9 0 9 ]\n"
        );
    let d2: f64 = height * height + x * x;
    let expected = 7.0 * (height / d2.sqrt()) / d2 * rho / std::f64::consts::PI;
    assert_close(mean(&scene, 16, ColorMode::Rgb, MaxDepth::None), expected, 1e-4, "point light");
}

#[test]
fn a_disk_light_gives_its_form_factor() {
    // E = pi L r^2 / (r^2 + h^2) on the axis below; 0.3 % would be seen. Opacity counts once, however the light is found;
    // rays draw it at random, so 2 % (5 standard errors) would be seen, and a technique that forgets it is off by a third.
    let (r, h) = (1.0, 0.7);
    for (alpha, share, spp, tolerance) in [
        ("", 1.0, 4096, 0.003),
        ("\"float alpha\" 0.5", 0.5, 65536, 0.02),
        ("\"texture alpha\" \"half\"", 0.5, 65536, 0.02),
    ] {
        let scene = film(1)
            + &format!(
                "LookAt 0.0001 0.4 0  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 0.01\nWorldBegin\nTexture \"half\" \"float\" \"scale\" \"float tex\" 1 \"float scale\" 0.5\nAttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 5 5 5 ] \"bool twosided\" true\nTranslate 0 {h} 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" {r} {alpha}\nAttributeEnd\nMaterial \"diffuse\" \"rgb reflectance\" [ .5 .5 .5 ]\nShape \"trianglemesh\" \"integer indices\" [ 0 1 2 2 3 0 ] \"point3 P\" [ -9 0 -9  9 0 -9  9 0 9  -9 0 9 ]\n"
            );
        let expected = share * 5.0 * r * r / (r * r + h * h) * 0.5;
        let got = mean(&scene, spp, ColorMode::Rgb, MaxDepth::Limit(1));
        assert_close(got, expected, tolerance, &format!("disk light {alpha}"));
    }
}

#[test]
fn white_bodies_vanish_in_a_white_furnace() {
    // Under light of 1 from everywhere lossless convex bodies cannot be seen. 0.5 % of loss or gain would be.
    for (name, material) in [
        ("diffuse", "\"diffuse\" \"rgb reflectance\" [ 1 1 1 ]"),
        (
            "mirror",
            "\"conductor\" \"spectrum eta\" [ 300 1e-4 900 1e-4 ] \"spectrum k\" [ 300 1000 900 1000 ] \"float roughness\" 0",
        ),
        ("glass", "\"dielectric\" \"float eta\" 1.5"),
        ("thin pane", "\"thindielectric\" \"float eta\" 1.5"),
    ] {
        let scene = film(16)
            + &format!(
                "LookAt 0 0 -3  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 45\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\nMaterial {material}\nShape \"sphere\"\n"
            );
        assert_close(mean(&scene, 256, ColorMode::Rgb, MaxDepth::None), 1.0, 0.005, name);
    }
}

#[test]
fn a_camera_inside_glass_sees_the_squared_index_times_the_radiance() {
    // Radiance scales with eta^2 (B35): the camera sits inside a glass ball in a white furnace. Where nothing is
    // reflected totally at the centre, every pixel is eta^2.
    let scene = film(8)
        + "Camera \"perspective\" \"float fov\" 60\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\nMaterial \"dielectric\" \"float eta\" 1.5\nShape \"sphere\" \"float radius\" 2\n";
    assert_close(mean(scene.as_str(), 256, ColorMode::Rgb, MaxDepth::None), 2.25, 0.005, "inside glass");
}

#[test]
fn light_adds_up_and_scales() {
    // Twice the light is twice the picture, bit for bit (A32).
    let scene = |l: f32| {
        film(8)
            + &format!(
                "LookAt 0 0 -3  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 45\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ {l} {l} {l} ]\nMaterial \"diffuse\" \"rgb reflectance\" [ .7 .2 .4 ]\nShape \"sphere\"\n"
            )
    };
    let (one, two) = (
        picture(&scene(1.0), 16, ColorMode::Rgb, MaxDepth::None),
        picture(&scene(2.0), 16, ColorMode::Rgb, MaxDepth::None),
    );
    for (a, b) in one.iter().zip(&two) {
        assert_eq!(a.map(|x| 2.0 * x), *b);
    }
}
