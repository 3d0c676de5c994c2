//! Every material under light of 1 from everywhere shows its albedo by quadrature of its own `f`, through the whole
//! renderer; and one light over one surface has its closed form (ledger rows A11, A13, A32, B28, B30, B33).
//!
//! Bounds and false-alarm rates: see `estimate`. About 120 means.

mod estimate;

use estimate::{How, SIGMAS, assert_agree, assert_is, estimate, film, quad};
use irradiant::core::bxdf::TransportMode;
use irradiant::math::Vec3;
use irradiant::scene::desc::IntegratorKind::SimplePath;
use irradiant::{Job, load_text};
use irradiant_testkit::{Mean, Rng};

/// A large square of a material, seen from 50 degrees off its normal, under light of 1 from everywhere.
fn tilted(material: &str) -> String {
    film(1)
        + "LookAt 0 6.428 -7.660  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 0.01\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n"
        + material
        + &quad([[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]])
}

/// The integral of f |cos| over all directions at the surface that the camera sees, by uniform random directions, by
/// channel. Mixed materials: over their draws too.
fn albedo(scene: &str, draws: u64) -> [Mean; 3] {
    let file = load_text("test", scene, ".").unwrap_or_else(|e| panic!("{e}"));
    let scene = Job::new(&file, &How::new(1, 0).settings()).unwrap_or_else(|e| panic!("{e}")).scene;
    let mut rng = Rng::new(9);
    let mut means = [Mean::new(); 3];
    for i in 0..draws {
        let stream = scene.sampler.stream([0, 0], i as u32);
        let ray = irradiant::renderer::camera_samples::camera_sample(&scene, [0, 0], 0).camera_ray.expect("a ray").ray;
        let hit = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()).expect("the surface");
        let at = scene.geometry.interaction(&ray, &hit);
        let mut lambda = scene.sample_wavelengths(0.5);
        let bsdf = scene
            .materials
            .bsdf(at.material, &scene.textures, &at, &scene.texture_context(&at, None), &mut lambda, stream.mix(0))
            .expect("a surface");
        assert!(!bsdf.flags().is_specular() || bsdf.flags().is_non_specular(), "only what f can say");
        let [x, y, z] = rng.direction();
        let wi = Vec3::new(x, y, z);
        let f = bsdf.f(at.wo, wi, TransportMode::Radiance) * (bsdf.abs_cos(wi) * 4.0 * std::f32::consts::PI);
        (0..3).for_each(|c| means[c].add(f64::from(f[c])));
    }
    means
}

#[test]
fn every_material_shows_its_albedo_under_uniform_light() {
    // Coats without depth limit: with one they have pbrt-v4's weights, whose `f` is not the density's.
    let named = "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" \"rgb reflectance\" [ .9 .1 .2 ]\nMakeNamedMaterial \"b\" \"string type\" \"diffusetransmission\" \"rgb reflectance\" [ .1 .2 .3 ] \"rgb transmittance\" [ .2 .3 .1 ]\n";
    let mix = format!("{named}Material \"mix\" \"string materials\" [ \"a\" \"b\" ] \"float amount\" 0.3\n");
    for (i, material) in [
        "Material \"diffuse\" \"rgb reflectance\" [ .8 .5 .2 ]\n",
        "Material \"diffusetransmission\" \"rgb reflectance\" [ .3 .2 .4 ] \"rgb transmittance\" [ .2 .5 .3 ]\n",
        "Material \"conductor\" \"float roughness\" 0.4\n",
        "Material \"conductor\" \"float uroughness\" 0.3 \"float vroughness\" 0.7 \"rgb reflectance\" [ .9 .6 .3 ]\n",
        "Material \"dielectric\" \"float roughness\" 0.5\n",
        "Material \"coateddiffuse\" \"rgb reflectance\" [ .8 .5 .3 ] \"float roughness\" 0.5 \"integer maxdepth\" 0\n",
        "Material \"coateddiffuse\" \"rgb reflectance\" [ .8 .5 .3 ] \"float roughness\" 0.4 \"float thickness\" 0.3 \"float g\" 0.3 \"rgb albedo\" [ .7 .8 .4 ] \"integer maxdepth\" 0\n",
        "Material \"coatedconductor\" \"float interface.roughness\" 0.5 \"float conductor.roughness\" 0.4 \"integer maxdepth\" 0\n",
        "Material \"retroreflective\" \"float roughness\" 0.4\n",
        "Material \"glossypaint\" \"rgb reflectance\" [ .7 .4 .2 ] \"float roughness\" 0.4\n",
        "Material \"thinfilmpaint\" \"float roughness\" 0.4\n",
        mix.as_str(),
    ]
    .into_iter()
    .enumerate()
    {
        let scene = tilted(material);
        let by_light_samples = SimplePath { sample_lights: true, sample_bsdf: false };
        let picture = estimate(&scene, How::new(1 << 18, 600 + i as u64).depth(1));
        let sampled = estimate(&scene, How::new(1 << 18, 700 + i as u64).by(by_light_samples).depth(1));
        for (c, quadrature) in albedo(&scene, 1 << 18).iter().enumerate() {
            for (what, (mean, se)) in [("path", picture.total()[c]), ("light samples", sampled.total()[c])] {
                let joint = se.hypot(quadrature.standard_error());
                let power = if material.contains("\"dielectric\"") { 0.1 } else { 0.06 };
                assert!((SIGMAS + 2.0) * joint < power * mean, "{material}: a bias of {power} must be visible: {joint}");
                let off = (mean - quadrature.mean()).abs();
                assert!(
                    off <= SIGMAS * joint + 1e-4 * mean,
                    "{material}: {what}: channel {c} is {mean} +- {se}, by quadrature {} +- {}",
                    quadrature.mean(),
                    quadrature.standard_error()
                );
            }
        }
    }
}

/// Fresnel reflectance of a smooth dielectric from outside, textbook form.
fn fresnel(cosine: f64, eta: f64) -> f64 {
    let inside = (1.0 - (1.0 - cosine * cosine) / (eta * eta)).sqrt();
    let parallel = (eta * cosine - inside) / (eta * cosine + inside);
    let perpendicular = (cosine - eta * inside) / (cosine + eta * inside);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

#[test]
fn specular_surfaces_have_their_closed_forms() {
    // Light from above only (a disk that fills the upper hemisphere but for 0.01 %): what is seen is what is reflected,
    // exact in expectation; 2 % would be seen.
    let above = |material: &str| {
        film(1)
            + "LookAt 0 6.428 -7.660  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 0.01\nWorldBegin\nAttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ] \"bool twosided\" true\nTranslate 0 50 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" 5000\nAttributeEnd\n"
            + material
            + &quad([[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]])
    };
    let cosine = 6.428 / 6.428f64.hypot(7.660);
    let (r, how) = (fresnel(cosine, 1.5), How::new(1 << 16, 810));
    let glass = estimate(&above("Material \"dielectric\" \"float eta\" 1.5\n"), how.clone());
    assert_is(&glass, [r; 3], 0.12, "glass");
    // A pane reflects between its sides: r + t^2 r / (1 - r^2).
    let pane = estimate(&above("Material \"thindielectric\" \"float eta\" 1.5\n"), how);
    assert_is(&pane, [r + (1.0 - r) * (1.0 - r) * r / (1.0 - r * r); 3], 0.1, "pane");
    // Mirror: Fresnel for eta = 1, k = 2 sqrt(r) / sqrt(1 - r), every sample the same.
    let mirror = estimate(
        &above("Material \"conductor\" \"float roughness\" 0 \"rgb reflectance\" [ .5 .5 .5 ]\n"),
        How::new(64, 811),
    );
    let (eta, k2) = (1.0f64, 4.0 * 0.5 / 0.5f64);
    let c2 = cosine * cosine;
    let t0 = eta * eta - k2 - (1.0 - c2);
    let a2b2 = (t0 * t0 + 4.0 * eta * eta * k2).sqrt();
    let a = (0.5 * (a2b2 + t0)).sqrt();
    let s = (a2b2 + c2 - 2.0 * cosine * a) / (a2b2 + c2 + 2.0 * cosine * a);
    let q = 1.0 - c2;
    let p = s * (c2 * a2b2 + q * q - 2.0 * a * cosine * q) / (c2 * a2b2 + q * q + 2.0 * a * cosine * q);
    assert_is(&mirror, [0.5 * (s + p); 3], 0.001, "mirror");
}

/// A floor of albedo 0.5 seen from its own axis, so that the value is E / (2 pi) at the origin.
fn at_the_origin(light: &str) -> String {
    film(1)
        + "LookAt 0.0001 3 0.0001  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 0.01\nWorldBegin\n"
        + light
        + "Material \"diffuse\" \"spectrum reflectance\" [ 300 0.5 900 0.5 ]\n"
        + &quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]])
}

#[test]
fn lights_without_extent_have_their_closed_forms() {
    // Every sample is the same: f32 rounding only.
    use std::f64::consts::PI;
    for (light, irradiance) in [
        ("LightSource \"distant\" \"rgb L\" [ 2 2 2 ] \"point3 from\" [ 3 4 0 ] \"point3 to\" [ 0 0 0 ]\n", 2.0 * 0.8),
        ("LightSource \"point\" \"rgb I\" [ 2 2 2 ] \"point3 from\" [ 3 4 0 ]\n", 2.0 * 0.8 / 25.0),
        // The origin is on the axis of the cone: full intensity.
        (
            "LightSource \"spot\" \"rgb I\" [ 2 2 2 ] \"point3 from\" [ 3 4 0 ] \"point3 to\" [ 0 0 0 ]\n",
            2.0 * 0.8 / 25.0,
        ),
        // 20 degrees off the axis of a cone of 15: nothing. (The camera's own light keeps the mean from being 0.)
        (
            "LightSource \"distant\" \"rgb L\" [ 1 1 1 ] \"point3 from\" [ 0 1 0 ] \"point3 to\" [ 0 0 0 ]\nLightSource \"spot\" \"rgb I\" [ 2 2 2 ] \"point3 from\" [ 0 4 0 ] \"point3 to\" [ 1.456 0 0 ] \"float coneangle\" 15\n",
            1.0,
        ),
        // Two lights add up.
        (
            "LightSource \"distant\" \"rgb L\" [ 1 1 1 ] \"point3 from\" [ 0 1 0 ] \"point3 to\" [ 0 0 0 ]\nLightSource \"point\" \"rgb I\" [ 3 3 3 ] \"point3 from\" [ 0 2 0 ]\n",
            1.75,
        ),
        // A scale is a factor.
        (
            "LightSource \"distant\" \"rgb L\" [ 2 2 2 ] \"float scale\" 1.5 \"point3 from\" [ 0 1 0 ] \"point3 to\" [ 0 0 0 ]\n",
            3.0,
        ),
    ] {
        let how = How::new(8192, 820).depth(1);
        // Two lights are chosen at random: not every sample is the same there.
        assert_is(&estimate(&at_the_origin(light), how), [irradiance * 0.5 / PI; 3], 0.08, light);
    }
}

#[test]
fn a_rectangle_light_has_its_form_factor() {
    // A rectangle a by b parallel to the floor at height c with one corner above the origin: Howell's C-11 (the classic
    // corner formula); four of them meet above the origin.
    let (a, b, c) = (0.8f64, 1.3f64, 0.9f64);
    let corner = {
        let (x, y) = (a / c, b / c);
        let (rx, ry) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        (x / rx * (y / rx).atan() + y / ry * (x / ry).atan()) / (2.0 * std::f64::consts::PI)
    };
    let scene = |from: [f32; 2], to: [f32; 2], shape: &str| {
        let ([x0, z0], [x1, z1]) = (from, to);
        let points = [[x0, 0.9, z0], [x1, 0.9, z0], [x1, 0.9, z1], [x0, 0.9, z1]];
        let shape = match shape {
            "triangles" => quad(points),
            _ => {
                format!("Shape \"bilinearmesh\" \"point3 P\" [ {x0} .9 {z0} {x1} .9 {z0} {x0} .9 {z1} {x1} .9 {z1} ]\n")
            }
        };
        // The camera looks from between floor and light.
        at_the_origin(&format!(
            "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 4 4 4 ] \"bool twosided\" true\n{shape}AttributeEnd\n"
        ))
        .replace("LookAt 0.0001 3 0.0001", "LookAt 0.0001 0.5 0.0001")
    };
    for (i, shape) in ["triangles", "patch"].into_iter().enumerate() {
        let how = How::new(1 << 15, 830 + i as u64).depth(1);
        let whole = estimate(&scene([-0.8, -1.3], [0.8, 1.3], shape), how.clone());
        assert_is(&whole, [4.0 * 4.0 * corner * 0.5; 3], 0.01, shape);
        let quarter = estimate(&scene([0.0, 0.0], [0.8, 1.3], shape), how);
        assert_is(&quarter, [4.0 * corner * 0.5; 3], 0.02, shape);
    }
}

#[test]
fn a_sphere_light_has_its_form_factor_near_and_far() {
    // E = pi L (r / d)^2 straight below (all of the sphere above the horizon).
    for (i, (r, d)) in [(0.9, 1.0), (0.5, 2.0), (0.01, 2.0)].into_iter().enumerate() {
        let scene = at_the_origin(&format!(
            "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 3 3 3 ]\nTranslate 0 {d} 0\nShape \"sphere\" \"float radius\" {r}\nAttributeEnd\n"
        ))
        .replace("LookAt 0.0001 3 0.0001", "LookAt 0.0001 0.05 0.0001");
        let expected = 3.0 * (r / d) * (r / d) * 0.5;
        let picture = estimate(&scene, How::new(1 << 14, 840 + i as u64).depth(1));
        assert_is(&picture, [expected; 3], 0.02, &format!("radius {r} at {d}"));
    }
}

#[test]
fn one_sided_lights_shine_to_one_side() {
    let scene = |reverse: &str, two_sided: bool| {
        at_the_origin(&format!(
            "AttributeBegin\n{reverse}AreaLightSource \"diffuse\" \"rgb L\" [ 4 4 4 ] \"bool twosided\" {two_sided}\nTranslate 0 1 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" 0.7\nAttributeEnd\n"
        ))
        .replace("LookAt 0.0001 3 0.0001", "LookAt 0.0001 0.5 0.0001")
    };
    let [plain, reversed, both] = [("", false), ("ReverseOrientation\n", false), ("", true)]
        .map(|(reverse, two_sided)| estimate(&scene(reverse, two_sided), How::new(1 << 14, 850).depth(1)).total()[0].0);
    assert!((plain == 0.0) != (reversed == 0.0), "one side shines: {plain}, {reversed}");
    let expected = 4.0 * 0.49 / 1.49 * 0.5;
    assert!((plain + reversed - expected).abs() < 0.01 * expected && (both - expected).abs() < 0.01 * expected);
}

#[test]
fn two_lights_pictures_add_up() {
    // Linearity (A32), with bounces. The lamp's body is there in each picture: it scatters too.
    let scene = |lights: &[&str]| {
        film(8)
            + "LookAt 0 2 -4  0 0.3 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\nWorldBegin\n"
            + &lights.concat()
            + "Material \"diffuse\" \"rgb reflectance\" [ .8 .6 .5 ]\n"
            + &quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]])
            + "Translate 0 0.6 0\nShape \"sphere\" \"float radius\" 0.6\n"
    };
    let sun = "LightSource \"distant\" \"rgb L\" [ 1 2 3 ] \"point3 from\" [ 1 2 -1 ]\n";
    let body = "AttributeBegin\nTranslate -1 1.5 0\nShape \"sphere\" \"float radius\" 0.4\nAttributeEnd\n";
    let lamp = body.replace("Translate", "AreaLightSource \"diffuse\" \"rgb L\" [ 9 5 2 ]\nTranslate");
    let lamp = lamp.as_str();
    let [a, b, both] = [(&[sun, body][..], 861), (&[lamp], 862), (&[sun, lamp], 863)]
        .map(|(lights, seed)| estimate(&scene(lights), How::new(8192, seed).depth(4)));
    let mut sum = a;
    for i in 0..sum.mean.len() {
        for c in 0..3 {
            sum.mean[i][c] += b.mean[i][c];
            sum.variance[i][c] += b.variance[i][c];
        }
    }
    assert_agree(&both, &sum, 0.015, "sum of two lights");
}
