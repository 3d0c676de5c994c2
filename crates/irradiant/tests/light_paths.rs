//! Independent witnesses: path tracing, bidirectional path tracing, light tracing and photon mapping solve the same
//! equation (ledger rows B10, B41, B46, A03; issue 4, "must show" 5).
//!
//! What each comparison would have seen is the number that it passes; see `estimate` for the bounds and false-alarm rates.

mod estimate;

use estimate::{How, INSIDE, SIGMAS, assert_agree, assert_is, cube, diffuse, estimate, film, quad};
use irradiant::{ColorMode, IntegratorChoice, RenderSettings, load_text, render};
use irradiant_testkit::Mean;

fn by(name: &str, options: &[&str]) -> IntegratorChoice {
    let choice = IntegratorChoice::named(name).unwrap_or_else(|e| panic!("{e}"));
    options.iter().fold(choice, |c, o| c.with_words(o).unwrap_or_else(|e| panic!("{e}")))
}

const BDPT: &str = "bdpt";
const LIGHTTRACE: &str = "lighttrace";

/// A closed box from -1 to 1, without lights.
fn walls() -> String {
    cube([[0.7, 0.3, 0.2], [0.2, 0.6, 0.3], [0.7, 0.7, 0.7], [0.5, 0.5, 0.6], [0.6, 0.6, 0.6], [0.7, 0.7, 0.7]])
}

const LAMP: &str = "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 12 9 8 ]\nTranslate 0 0.95 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" 0.35\nAttributeEnd\n";
const GLASS: &str = "AttributeBegin\nMaterial \"dielectric\"\nTranslate 0.3 -0.5 0.2\nShape \"sphere\" \"float radius\" 0.4\nAttributeEnd\n";

fn in_box(size: u32, content: &str) -> String {
    film(size) + INSIDE + "WorldBegin\n" + &walls() + content
}

#[test]
fn path_and_bidirectional_agree_in_the_diffuse_box_event_by_event() {
    // A box on the floor; every number of events by itself has its own strategies.
    let block = diffuse(0.4, 0.5, 0.8) + "Translate 0.3 -0.6 0.3\nShape \"sphere\" \"float radius\" 0.4\n";
    let scene = in_box(8, &(LAMP.to_string() + &block));
    for (depth, spp, power) in [(1, 512, 0.03), (2, 512, 0.04), (6, 512, 0.05)] {
        let path = estimate(&scene, How::new(2 * spp, 1 + u64::from(depth)).depth(depth));
        let both = estimate(&scene, How::new(spp, 101 + u64::from(depth)).depth(depth).by(by(BDPT, &[])));
        assert_agree(&both, &path, power, &format!("depth {depth}"));
    }
    let path = estimate(&scene, How::new(1024, 9));
    let both = estimate(&scene, How::new(256, 109).by(by(BDPT, &["heuristic=balance"])));
    assert_agree(&both, &path, 0.06, "no depth limit, balance heuristic");
}

#[test]
fn path_bidirectional_and_light_tracing_agree_on_the_cornell_box() {
    // The built-in scene, from measured data, below its lamp, whose edge would be all the noise. It is diffuse throughout, so
    // that light tracing lacks nothing.
    let text = include_str!("../../../scenes/cornell-box.pbrt");
    let sizes = |n: u32| format!("\"integer xresolution\" {n} \"integer yresolution\" {n}");
    let scene = text
        .replace(&sizes(512), &(sizes(16) + " \"float cropwindow\" [ 0 1 0.25 1 ]"))
        .replace("PixelFilter \"gaussian\"", "PixelFilter \"box\"")
        .replace("Sampler \"zsobol\"", "Sampler \"independent\"");
    for word in ["cropwindow", "\"box\"", "independent"] {
        assert!(scene.contains(word), "the built-in scene has changed: no {word}");
    }
    let path = estimate(&scene, How::new(1536, 11));
    let both = estimate(&scene, How::new(512, 12).by(by(BDPT, &[])));
    assert_agree(&both, &path, 0.03, "Cornell box, bidirectional");
    let traced = estimate(&scene, How::new(1536, 13).by(by(LIGHTTRACE, &[])));
    assert_agree(&traced, &path, 0.03, "Cornell box, light tracing");
}

#[test]
fn path_and_bidirectional_agree_on_a_glass_sphere() {
    // Reflections, the caustic on floor and wall, and light that came through the sphere twice. What path finds only by
    // meeting the lamp through glass is most of the noise here.
    let scene = in_box(8, &(LAMP.to_string() + GLASS));
    let path = estimate(&scene, How::new(4096, 21).depth(7));
    let both = estimate(&scene, How::new(768, 22).depth(7).by(by(BDPT, &[])));
    assert_agree(&both, &path, 0.06, "glass");
    // Rough glass in a room of rough metal: everything can be joined, refraction is not symmetric, and what one walk makes of
    // a vertex depends on where it comes from.
    let metal = "Material \"conductor\" \"float roughness\" 0.35";
    let scene = scene
        .replace("\"dielectric\"", "\"dielectric\" \"float roughness\" 0.3")
        .replace("Material \"diffuse\" \"rgb reflectance\" [ 0.7 0.7 0.7 ]", metal);
    assert!(scene.matches("conductor").count() == 2);
    let path = estimate(&scene, How::new(4096, 23).depth(5));
    let both = estimate(&scene, How::new(1024, 24).depth(5).by(by(BDPT, &[])));
    assert_agree(&both, &path, 0.04, "rough glass and metal");
}

/// A floor and a ball of a coarse mesh with interpolated normals, under lights of every kind.
fn open_scene(lights: &str, camera: &str, size: u32) -> String {
    let mut ball = String::from(
        "Shape \"loopsubdiv\" \"integer levels\" 1 \"integer indices\" [ 0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5 ] \"point3 P\" [ ",
    );
    for p in ["1 0 0", "-1 0 0", "0 1 0", "0 -1 0", "0 0 1", "0 0 -1"] {
        ball += p;
        ball.push(' ');
    }
    ball += "]\n";
    film(size)
        + camera
        + "WorldBegin\n"
        + lights
        + &diffuse(0.6, 0.5, 0.4)
        + &quad([[-5.0, -1.0, -5.0], [5.0, -1.0, -5.0], [5.0, -1.0, 5.0], [-5.0, -1.0, 5.0]])
        + "Material \"coateddiffuse\" \"float roughness\" 0.3 \"rgb reflectance\" [ .2 .5 .7 ]\n"
        + &ball
}

const VIEW: &str = "LookAt 0 2 -5  0 -0.3 0  0 1 0\nCamera \"perspective\" \"float fov\" 50\n";

const LIGHTS: [(&str, &str); 8] = [
    ("point", "LightSource \"point\" \"rgb I\" [ 20 15 10 ] \"point3 from\" [ 1.5 3 -1.5 ]\n"),
    (
        "spot",
        "LightSource \"spot\" \"rgb I\" [ 60 60 40 ] \"point3 from\" [ -2 4 -2 ] \"point3 to\" [ 0 0 0 ] \"float coneangle\" 25\n",
    ),
    ("distant", "LightSource \"distant\" \"rgb L\" [ 2 2 1 ] \"point3 from\" [ 1 2 -1 ]\n"),
    ("sky", "LightSource \"infinite\" \"rgb L\" [ .6 .7 1 ]\n"),
    ("portal", "LightSource \"infinite\" \"rgb L\" [ 9 8 7 ] \"point3 portal\" [ -1 4 -1  1 4 -1  1 4 1  -1 4 1 ]\n"),
    (
        "lamp",
        "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 9 8 7 ] \"bool twosided\" true\nTranslate 1 3 -1\nRotate 80 1 0 0\nShape \"disk\" \"float radius\" 0.5\nAttributeEnd\n",
    ),
    (
        "ball",
        "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 9 8 7 ]\nTranslate -1 2.5 -1\nShape \"sphere\" \"float radius\" 0.4 \"float alpha\" 0.7\nAttributeEnd\n",
    ),
    (
        "unseen",
        "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 9 8 7 ]\nTranslate 1 3 -1\nRotate 100 1 0 0\nShape \"disk\" \"float radius\" 0.5 \"float alpha\" 0\nAttributeEnd\n",
    ),
];

#[test]
fn every_light_is_the_same_from_both_ends() {
    // Each light kind by itself: light tracing and bidirectional against path. The ball's normals are interpolated and its
    // coat is rough, so that what is not symmetric counts.
    for (i, (name, light)) in LIGHTS.into_iter().enumerate() {
        let scene = open_scene(light, VIEW, 8);
        let seed = 1000 + 10 * i as u64;
        let path = estimate(&scene, How::new(512, seed).depth(3));
        let both = estimate(&scene, How::new(192, seed + 1).depth(3).by(by(BDPT, &[])));
        assert_agree(&both, &path, 0.08, &format!("{name}, bidirectional"));
        let traced = estimate(&scene, How::new(1536, seed + 2).depth(3).by(by(LIGHTTRACE, &[])));
        assert_agree(&traced, &path, 0.12, &format!("{name}, light tracing"));
    }
}

#[test]
fn every_camera_that_light_can_reach_shows_the_same_picture() {
    // Lens, parallel rays, shifted window, crop, wide pixel filter with negative lobes, moving camera.
    let lights = LIGHTS[0].1.to_string() + LIGHTS[5].1;
    let perspective =
        |more: &str| format!("LookAt 0 2 -5  0 -0.3 0  0 1 0\nCamera \"perspective\" \"float fov\" 50 {more}\n");
    let moving = "LookAt 0 2 -5  0 -0.3 0  0 1 0\nActiveTransform EndTime\nRotate 8 0 1 0\nActiveTransform All\nCamera \"perspective\" \"float fov\" 50\n";
    let cases = [
        ("lens", perspective("\"float lensradius\" 0.3 \"float focaldistance\" 4"), ""),
        (
            "parallel",
            "LookAt 0 2 -5  0 -0.3 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [ -2 2 -2.5 1.5 ]\n".into(),
            "",
        ),
        ("window", perspective("\"float screenwindow\" [ -0.5 1.5 -0.9 0.6 ]"), ""),
        ("moving", moving.into(), ""),
        ("filter", perspective(""), "PixelFilter \"mitchell\" \"float xradius\" 1.5 \"float yradius\" 2\n"),
        (
            "crop",
            perspective(""),
            "Film \"rgb\" \"integer xresolution\" 16 \"integer yresolution\" 16 \"float cropwindow\" [ .25 .75 .5 1 ]\n",
        ),
    ];
    for (i, (name, camera, settings)) in cases.into_iter().enumerate() {
        let scene = open_scene(&lights, &(camera + settings), 8);
        let seed = 2000 + 10 * i as u64;
        let path = estimate(&scene, How::new(512, seed).depth(2));
        let traced = estimate(&scene, How::new(1536, seed + 1).depth(2).by(by(LIGHTTRACE, &[])));
        assert_agree(&traced, &path, 0.15, &format!("{name}, light tracing"));
        let both = estimate(&scene, How::new(192, seed + 2).depth(2).by(by(BDPT, &[])));
        assert_agree(&both, &path, 0.12, &format!("{name}, bidirectional"));
    }
}

#[test]
fn strategies_alone_find_the_same_light_and_their_parts_add_up() {
    // Light of one event in the lit box: met by chance, by light samples, by paths from the light.
    let scene = in_box(8, LAMP).replace("LookAt 0 0 -0.95  0 -0.1 0", "LookAt 0 0 -0.9  0 -0.7 0.3");
    let one = |s: &str, t: &str, weighted: &str, spp: u32, seed: u64| {
        estimate(&scene, How::new(spp, seed).by(by(BDPT, &[s, t, weighted])).depth(1))
    };
    let sampled = one("s=1", "t=2", "weighted=false", 1024, 31);
    let chance = one("s=0", "t=3", "weighted=false", 4096, 32);
    let traced = one("s=2", "t=1", "weighted=false", 2048, 33);
    assert_agree(&chance, &sampled, 0.1, "chance");
    assert_agree(&traced, &sampled, 0.05, "traced");
    let parts = [
        one("s=0", "t=3", "weighted=true", 1024, 34),
        one("s=1", "t=2", "weighted=true", 1024, 35),
        one("s=2", "t=1", "weighted=true", 1024, 36),
    ];
    let [mut sum, b, c] = parts;
    for part in [b, c] {
        for i in 0..sum.mean.len() {
            for k in 0..3 {
                sum.mean[i][k] += part.mean[i][k];
                sum.variance[i][k] += part.variance[i][k];
            }
        }
    }
    assert_agree(&sum, &sampled, 0.03, "weighted parts together");
}

/// Light of a point through a pane that bends nothing, on a floor: closed form, black to path tracing. It shines alike within
/// 36 degrees of straight down, and not beyond 40, so that few paths are wasted.
fn under_a_pane(size: u32) -> String {
    // The camera looks straight down at a small piece of floor beside the axis of the light, from below the pane.
    film(size)
        + "LookAt 0 0.5 0  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 10\nWorldBegin\nLightSource \"spot\" \"rgb I\" [ 3 3 3 ] \"point3 from\" [ 0 1 0 ] \"point3 to\" [ 0 0 0 ] \"float coneangle\" 40 \"float conedeltaangle\" 4\n"
        + &diffuse(0.5, 0.5, 0.5)
        + &quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]])
        + "Material \"thindielectric\" \"float eta\" 1\n"
        + &quad([[-9.0, 0.7, -9.0], [9.0, 0.7, -9.0], [9.0, 0.7, 9.0], [-9.0, 0.7, 9.0]])
}

/// Mean over the square that the camera sees of E / E(0) = (1 + d^2)^(-3/2), for its half side `a`.
fn mean_irradiance(a: f64) -> f64 {
    let n = 200;
    let at = |i: usize| a * (2.0 * (i as f64 + 0.5) / n as f64 - 1.0);
    let sum: f64 = (0..n * n).map(|i| (1.0 + at(i % n).powi(2) + at(i / n).powi(2)).powf(-1.5)).sum();
    sum / (n * n) as f64
}

#[test]
fn light_tracing_finds_the_caustics_of_point_lights() {
    // L = albedo / pi I E(0); the floor is all that is seen, half side 0.5 tan 5 degrees.
    let exact = 0.5 / std::f64::consts::PI * 3.0 * mean_irradiance(0.5 * 5f64.to_radians().tan());
    let scene = under_a_pane(4);
    let black = estimate(&scene, How::new(64, 41).depth(3));
    assert_eq!(black.total()[0].0, 0.0, "path tracing cannot find it");
    // Of all paths one in 200 meets the floor that is seen.
    let traced = estimate(&scene, How::new(50_000, 42).depth(3).by(by(LIGHTTRACE, &[])));
    assert_is(&traced, [exact; 3], 0.14, "light tracing");
    let both = estimate(&scene, How::new(25_000, 43).depth(3).by(by(BDPT, &[])));
    assert_is(&both, [exact; 3], 0.2, "bidirectional");
}

/// Photon mapping's expected picture of the point below the light: the mean of E / E(0) over a disk of radius `r` about the
/// axis is 2 / r^2 (1 - 1 / sqrt(1 + r^2)) = 1 - 3/4 r^2 + ...
fn blurred(r: f64) -> f64 {
    2.0 / (r * r) * (1.0 - 1.0 / (1.0 + r * r).sqrt())
}

/// One pixel that looks at a piece of floor far smaller than any radius here.
fn below_the_light() -> String {
    under_a_pane(1).replace("\"float fov\" 10", "\"float fov\" 0.2")
}

/// Means over passes that are all alike (alpha 1), with the error of their scatter.
fn photon_mean(options: &[&str], passes: u32, seeds: std::ops::Range<u64>) -> Mean {
    let scene = below_the_light();
    let mut mean = Mean::new();
    for seed in seeds {
        mean.add(estimate(&scene, How::new(passes, seed).depth(3).by(by("photon", options))).total()[1].0);
    }
    mean
}

#[test]
fn photon_mappings_bias_shrinks_with_its_radius_as_predicted() {
    // With a fixed radius the bias is known in closed form: about 3/4 r^2, so that half the radius leaves a quarter of it. 24
    // pictures each; errors of 3 % of the picture would be seen, where the bias is 7 % and 22 %.
    let exact = 0.5 / std::f64::consts::PI * 3.0;
    let mut bias = vec![];
    for (i, r) in [0.62f64, 0.31].into_iter().enumerate() {
        let options = [format!("radius={r}"), "alpha=1".into(), "paths=3000".into()];
        let options: Vec<&str> = options.iter().map(String::as_str).collect();
        let seed = 5000 + 100 * i as u64;
        let mean = photon_mean(&options, 10, seed..seed + 24);
        let expected = exact * blurred(r);
        // The t distribution of 24 replicates has its 1e-6 at 6.4.
        assert!(mean.detectable_bias(6.4) < 0.03, "{}", mean.detectable_bias(6.4));
        let z = (mean.mean() - expected) / mean.standard_error();
        assert!(z.abs() < 6.4, "radius {r}: {} +- {}, expected {expected}", mean.mean(), mean.standard_error());
        bias.push(1.0 - mean.mean() / exact);
    }
    let rate = bias[0] / bias[1];
    // In closed form 3.3; a bias in proportion to the radius would be halved.
    assert!((2.6..4.2).contains(&rate), "half the radius divides the bias by {rate}");
}

#[test]
fn photon_mapping_converges_as_its_radius_shrinks_from_pass_to_pass() {
    // The expected picture of N passes is the mean of what each radius blurs; with N it nears the truth. 24 pictures; 3 % would be seen.
    let exact = 0.5 / std::f64::consts::PI * 3.0;
    let (first, alpha) = (0.7f32, 0.5);
    let mut bias = vec![];
    for passes in [4u32, 64] {
        let radii = (0..passes).map(|i| f64::from(irradiant::renderer::photon::radius_of_pass(first, alpha, i)));
        let expected = exact * radii.map(blurred).sum::<f64>() / f64::from(passes);
        let seeds = 6000 + u64::from(passes)..6024 + u64::from(passes);
        let paths = format!("paths={}", 16_000 / passes);
        let mean = photon_mean(&["radius=0.7", "alpha=0.5", &paths], passes, seeds);
        let z = (mean.mean() - expected) / mean.standard_error();
        assert!(mean.detectable_bias(6.4) < 0.03, "{}", mean.detectable_bias(6.4));
        assert!(z.abs() < 6.4, "{passes} passes: {} +- {}, expected {expected}", mean.mean(), mean.standard_error());
        bias.push(1.0 - expected / exact);
    }
    assert!(bias[1] < 0.4 * bias[0], "{bias:?}");
}

#[test]
fn photon_mapping_solves_the_lit_box_but_for_its_blur() {
    // Glass, a lamp, indirect light, by a small radius: 2 % is granted to the blur at edges. 16 pictures.
    let scene = in_box(8, &(LAMP.to_string() + GLASS));
    let path = estimate(&scene, How::new(2048, 61).depth(6)).total();
    let mut mean = Mean::new();
    for seed in 0..16 {
        let photon = by("photon", &["radius=0.12", "alpha=0.8", "paths=2000"]);
        mean.add(estimate(&scene, How::new(16, 6100 + seed).depth(6).by(photon)).total()[1].0);
    }
    let (exact, se) = path[1];
    let error = mean.standard_error().hypot(se);
    assert!(error < 0.012 * exact, "{error} {exact}");
    assert!((mean.mean() - exact).abs() < 0.02 * exact + SIGMAS * error, "{} +- {error}, {exact}", mean.mean());
}

#[test]
fn wavelengths_part_at_glass_in_all_estimators() {
    // Dispersive glass ends all wavelengths but one, on whichever walk it is met; the sphere is beside the view.
    let glass = "AttributeBegin\nMaterial \"dielectric\" \"spectrum eta\" \"glass-SF11\"\nTranslate 0.55 -0.2 -0.2\nShape \"sphere\" \"float radius\" 0.35\nAttributeEnd\n";
    let scene =
        in_box(4, &(LAMP.to_string() + glass)).replace("LookAt 0 0 -0.95  0 -0.1 0", "LookAt 0 0 -0.5  -0.4 -0.5 0.1");
    let path = estimate(&scene, How::new(8192, 71).depth(5).spectral());
    let both = estimate(&scene, How::new(1024, 72).depth(5).spectral().by(by(BDPT, &[])));
    assert_agree(&both, &path, 0.11, "bidirectional");
    let traced = estimate(&scene, How::new(4096, 73).depth(5).spectral().by(by(LIGHTTRACE, &[])));
    assert_agree(&traced, &path, 0.1, "light tracing");
}

#[test]
fn lights_seen_directly_and_the_furnace_are_exact() {
    // A ball of albedo 0.8 in a uniform sky: 1 beside it, 0.8 on it.
    let scene = film(4)
        + "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 10\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n"
        + &diffuse(0.8, 0.8, 0.8)
        + "Shape \"sphere\"\n";
    for (name, spp, power) in [(BDPT, 2048, 0.02), (LIGHTTRACE, 16384, 0.12)] {
        assert_is(&estimate(&scene, How::new(spp, 81).by(by(name, &[]))), [0.8; 3], power, name);
        let beside = scene.replace("0 0 0  0 1 0", "0 3 0  0 1 0");
        assert_is(&estimate(&beside, How::new(4, 82).by(by(name, &[]))), [1.0; 3], 1e-6, name);
    }
}

#[test]
fn motion_instances_and_interfaces_are_the_same_from_both_ends() {
    let things = "ObjectBegin \"thing\"\nMaterial \"diffuse\" \"rgb reflectance\" [ .7 .3 .2 ]\nShape \"sphere\" \"float radius\" 0.25\nObjectEnd\nAttributeBegin\nActiveTransform EndTime\nTranslate 0.5 0.3 0\nActiveTransform All\nTranslate -0.5 -0.3 0.2\nObjectInstance \"thing\"\nAttributeEnd\nAttributeBegin\nMaterial \"interface\"\nTranslate 0.4 -0.6 0.2\nShape \"sphere\" \"float radius\" 0.3\nAttributeEnd\nAttributeBegin\nTranslate 0.4 -0.6 0.2\nMaterial \"diffuse\"\nShape \"sphere\" \"float radius\" 0.2\nAttributeEnd\n";
    let scene = in_box(8, &(LAMP.to_string() + things));
    let path = estimate(&scene, How::new(2048, 91).depth(3));
    let both = estimate(&scene, How::new(512, 92).depth(3).by(by(BDPT, &[])));
    assert_agree(&both, &path, 0.04, "bidirectional");
    let traced = estimate(&scene, How::new(2048, 93).depth(3).by(by(LIGHTTRACE, &[])));
    assert_agree(&traced, &path, 0.04, "light tracing");
}

const MAYBE: &str = "MakeNamedMaterial \"none\" \"string type\" \"interface\"\nMakeNamedMaterial \"dust\" \"string type\" \"diffuse\" \"rgb reflectance\" [ .2 .5 .4 ]\nMakeNamedMaterial \"maybe\" \"string type\" \"mix\" \"string materials\" [ \"dust\" \"none\" ] \"float amount\" 0.6\nNamedMaterial \"maybe\"\n";

#[test]
fn mixes_that_hold_an_interface_are_passed_from_both_ends_and_by_joins() {
    // A shell around a ball and one around the lamp, each met where there is dust and passed where there is none; before the
    // lamp also a lamp of that material, which shines in either case.
    let shells = format!(
        "{MAYBE}AttributeBegin\nTranslate 0.3 -0.5 0.2\nShape \"sphere\" \"float radius\" 0.45\nAttributeEnd\nAttributeBegin\nTranslate 0 0.95 0\nShape \"sphere\" \"float radius\" 0.5\nAttributeEnd\nAttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 1 2 3 ] \"bool twosided\" true\nTranslate -0.4 0 0.5\nShape \"disk\" \"float radius\" 0.3\nAttributeEnd\nAttributeBegin\nMaterial \"diffuse\"\nTranslate 0.3 -0.5 0.2\nShape \"sphere\" \"float radius\" 0.3\nAttributeEnd\n"
    );
    let scene = in_box(8, &(LAMP.to_string() + &shells));
    for depth in [1, 3] {
        let path = estimate(&scene, How::new(6144, 95).depth(depth));
        let both = estimate(&scene, How::new(1024, 96).depth(depth).by(by(BDPT, &[])));
        assert_agree(&both, &path, 0.06, "behind interfaces, bidirectional");
        let traced = estimate(&scene, How::new(2048, 97).depth(depth).by(by(LIGHTTRACE, &[])));
        assert_agree(&traced, &path, 0.06, "behind interfaces, light tracing");
    }
}

#[test]
fn each_boundary_of_a_mix_decides_by_itself() {
    // A black shell that lets 60 % pass at each side, in a sky of 1: 36 % of it is seen.
    let scene = film(4)
        + "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 10\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\n"
        + &MAYBE.replace(".2 .5 .4", "0 0 0")
        + "Shape \"sphere\"\n";
    for name in ["path", "simplepath", BDPT, "photon", LIGHTTRACE] {
        let seen = estimate(&scene, How::new(4096, 98).by(by(name, &[])));
        assert_is(&seen, [0.36; 3], 0.05, name);
    }
    // A point light in it, which no ray meets, over a floor that is seen from within: 60 % of it.
    let floor = film(4)
        + "LookAt 0 0.5 0  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 1\nWorldBegin\nLightSource \"point\" \"rgb I\" [ 3 3 3 ] \"point3 from\" [ 0 1 0 ]\n"
        + &diffuse(0.5, 0.5, 0.5)
        + &quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]])
        + &MAYBE.replace(".2 .5 .4", "0 0 0")
        + "Translate 0 1 0\nShape \"sphere\" \"float radius\" 0.2\n";
    let exact = 0.6 * 0.5 / std::f64::consts::PI * 3.0;
    for name in ["path", "simplepath", BDPT, "photon"] {
        let seen = estimate(&floor, How::new(4096, 99).depth(1).by(by(name, &[])));
        assert_is(&seen, [exact; 3], 0.05, name);
    }
}

#[test]
fn paths_from_lights_give_the_same_bits_for_any_number_of_threads() {
    let scene = in_box(40, &(LAMP.to_string() + GLASS)).replace("Sampler \"independent\"", "Sampler \"zsobol\"");
    for (name, options) in [(BDPT, &[][..]), (LIGHTTRACE, &[]), ("photon", &["paths=9000", "radius=0.1"])] {
        let picture = |threads: usize, spp: u32| {
            let file = load_text("test", &scene, ".").unwrap_or_else(|e| panic!("{e}"));
            let settings = RenderSettings {
                threads,
                samples_per_pixel: Some(spp),
                integrator: Some(by(name, options)),
                color: ColorMode::Spectral,
                ..RenderSettings::default()
            };
            let rendering = render(&file, &settings).unwrap_or_else(|e| panic!("{e}"));
            (rendering.film.clone(), rendering.image().to_f32())
        };
        let one = picture(1, 4);
        for threads in [2, 5] {
            assert!(one == picture(threads, 4), "{name}: 1 and {threads} threads differ");
        }
        assert!(one.1 != picture(1, 3).1, "{name}: the comparison has no bite");
    }
}

#[test]
fn hostile_scenes_give_finite_pictures() {
    let dark = "LookAt 0 0 -0.95  0 -0.1 0  0 1 0\n";
    let scenes = [
        ("nothing", film(4) + "WorldBegin\n"),
        ("no light", in_box(4, "")),
        ("only a light", film(4) + "WorldBegin\nLightSource \"point\" \"point3 from\" [ 0 0 1 ]\n"),
        ("black", film(4) + INSIDE + "WorldBegin\n" + &diffuse(0.0, 0.0, 0.0) + &walls().replace("0.7", "0") + LAMP),
        (
            "camera in glass",
            in_box(
                4,
                &(LAMP.to_string()
                    + "Material \"dielectric\"\nTranslate 0 0 -0.95\nShape \"sphere\" \"float radius\" 0.04\n"),
            ),
        ),
        (
            "camera in a lamp",
            in_box(4, "AreaLightSource \"diffuse\"\nTranslate 0 0 -0.95\nShape \"sphere\" \"float radius\" 0.04\n"),
        ),
        (
            "lamp of a curve",
            in_box(
                4,
                "AreaLightSource \"diffuse\" \"rgb L\" [ 50 50 50 ] \"bool twosided\" true\nShape \"curve\" \"float width\" 0.2 \"point3 P\" [ -0.5 0 0  0 0.5 0  0.5 0 0  0 -0.5 0 ]\n",
            ),
        ),
        (
            "white and closed",
            film(4)
                + dark
                + "WorldBegin\n"
                + &walls()
                    .replace("0.3", "1")
                    .replace("0.5", "1")
                    .replace("0.6", "1")
                    .replace("0.2", "1")
                    .replace("0.7", "1")
                + LAMP,
        ),
    ];
    for (what, scene) in scenes {
        for name in [BDPT, LIGHTTRACE, "photon"] {
            // Also asserts that no sample was refused.
            let picture = estimate(&scene, How::new(4, 7).by(by(name, &[])));
            assert!(picture.mean.iter().flatten().all(|x| x.is_finite()), "{name}: {what}");
            assert!(picture.longest_path < 700, "{name}: {what}: {}", picture.longest_path);
        }
    }
    // A lamp of curves, which no light sample draws, is as bright to all.
    let hair = in_box(
        4,
        "AreaLightSource \"diffuse\" \"rgb L\" [ 50 50 50 ] \"bool twosided\" true\nShape \"curve\" \"float width\" 0.2 \"point3 P\" [ -0.5 0 0  0 0.5 0  0.5 0 0  0 -0.5 0 ]\n",
    );
    let path = estimate(&hair, How::new(1024, 1).depth(2));
    let both = estimate(&hair, How::new(512, 2).depth(2).by(by(BDPT, &[])));
    assert_agree(&both, &path, 0.2, "hair");
}

/// Light of a point by way of a smooth ball: who finds it says nothing, who does not says so, and only where a scene has both. Names
/// and depths as data; the pictures are of one sample, the labels exact.
#[test]
fn labels_tell_of_the_caustics_of_delta_lights_where_they_are_lost() {
    const POINT: &str = "LightSource \"point\" \"rgb I\" [ 9 9 9 ] \"point3 from\" [ 0 0.8 0 ]\n";
    const LOST: &str = "what delta lights shine on by way of smooth mirrors or glass";
    const TWICE: &str = "what mirrors and glass show of the light that delta lights send by way of mirrors and glass";
    const SEEN: &str = "what the camera sees directly of the light that delta lights send by way of mirrors and glass";
    let label = |scene: &str, name: &str, options: &[&str], depth: Option<u32>| {
        let file = load_text("test", scene, ".").unwrap_or_else(|e| panic!("{e}"));
        let how = How::new(1, 1).by(by(name, options));
        let how = match depth {
            Some(depth) => how.depth(depth),
            None => how,
        };
        render(&file, &how.settings()).unwrap_or_else(|e| panic!("{name}: {e}")).header.estimate
    };
    let both = in_box(2, &(POINT.to_string() + GLASS));
    for name in ["path", "sharedpath", "simplepath", "iterative", "partitioned", "perlength"] {
        let options: &[&str] = match name {
            "iterative" | "partitioned" | "perlength" => &["emission=power"],
            _ => &[],
        };
        assert!(label(&both, name, options, None).contains(LOST), "{name}: {}", label(&both, name, options, None));
        assert_eq!(label(&both, name, options, Some(3)), format!("truncated: maxdepth 3, {LOST}"), "{name}");
        // Such light takes two events: without the second, the depth limit says it all.
        assert_eq!(label(&both, name, options, Some(1)), "truncated: maxdepth 1", "{name}");
    }
    assert_eq!(label(&both, "path", &[], None), format!("truncated: {LOST}"));
    assert!(label(&both, "path", &["regularize=true"], None).starts_with(&format!("truncated: {LOST}; biased: ")));
    assert_eq!(label(&both, "simplepath", &["samplelights=false"], None), "truncated: delta lights");
    assert_eq!(label(&both, BDPT, &[], None), format!("truncated: {TWICE}"));
    assert_eq!(label(&both, BDPT, &[], Some(2)), "truncated: maxdepth 2");
    let all_around = both.replace("\"perspective\" \"float fov\" 70", "\"spherical\"");
    assert_eq!(label(&all_around, BDPT, &[], None), format!("truncated: {TWICE}, {SEEN}"));
    assert!(label(&both, "photon", &[], None).starts_with("biased: photon radius "));

    // One of the two is not enough, nor is a material that no shape has.
    let rough = GLASS.replace("\"dielectric\"", "\"dielectric\" \"float roughness\" 0.3");
    assert!(rough.contains("roughness"));
    let unused = POINT.to_string() + "MakeNamedMaterial \"ice\" \"string type\" \"dielectric\"\n";
    for content in [LAMP.to_string() + GLASS, POINT.to_string() + &rough, unused.clone()] {
        for name in ["path", "sharedpath", BDPT] {
            assert_eq!(label(&in_box(2, &content), name, &[], None), "unbiased", "{name}: {content}");
        }
    }
    // What a mix holds counts, and every kind of light that is a point or a direction.
    let mixed = unused
        + "MakeNamedMaterial \"snow\" \"string type\" \"diffuse\"\nMaterial \"mix\" \"string materials\" [ \"snow\" \"ice\" ]\nShape \"sphere\" \"float radius\" 0.3\n";
    assert_eq!(label(&in_box(2, &mixed), "path", &[], None), format!("truncated: {LOST}"));
    for kind in ["spot", "distant"] {
        let scene = both.replace("LightSource \"point\" \"rgb I\" [ 9 9 9 ]", &format!("LightSource \"{kind}\""));
        assert_eq!(label(&scene, "path", &[], None), format!("truncated: {LOST}"), "{kind}");
    }
}

/// What the label says, measured: a glass ball hangs between a point light and the floor. Direct light (one event) is the same to `path`
/// and `bdpt`, within 2 %; with light through the ball (three events) `bdpt` has more, in its shadow by half at least.
#[test]
fn path_does_not_find_a_points_light_through_glass_and_bidirectional_does() {
    const POINT: &str = "LightSource \"point\" \"rgb I\" [ 9 9 9 ] \"point3 from\" [ 0.2 0.85 0.3 ]\n";
    let ball =
        GLASS.replace("Translate 0.3 -0.5 0.2", "Translate 0.2 0.3 0.3").replace("radius\" 0.4", "radius\" 0.25");
    let scene = in_box(8, &(POINT.to_string() + &ball));
    let pixels = |name: &str, depth: u32, seed: u64| -> Vec<f64> {
        let picture = estimate(&scene, How::new(256, seed).depth(depth).by(by(name, &[])));
        picture.mean.iter().map(|p| p.iter().sum::<f64>() / 3.0).collect()
    };
    let sum = |pixels: &[f64]| pixels.iter().sum::<f64>();
    let (path, both) = (pixels("path", 1, 1), pixels(BDPT, 1, 2));
    assert!((sum(&both) / sum(&path) - 1.0).abs() < 0.02, "direct light: {path:?} {both:?}");
    let (path, both) = (pixels("path", 3, 3), pixels(BDPT, 3, 4));
    let most = both.iter().zip(&path).map(|(b, p)| b / p).fold(0.0, f64::max);
    assert!(most > 1.5 && sum(&both) > 1.01 * sum(&path), "{most} {} {}", sum(&both), sum(&path));
}

#[test]
fn pictures_say_what_they_lack_and_scenes_that_cannot_be_traced_are_refused() {
    let label = |scene: &str, name: &str| {
        let file = load_text("test", scene, ".").unwrap_or_else(|e| panic!("{e}"));
        let settings = How::new(1, 1).by(by(name, &[])).settings();
        render(&file, &settings).map(|r| r.header.estimate).map_err(|e| e.to_string())
    };
    let scene = in_box(4, LAMP);
    assert_eq!(label(&scene, BDPT), Ok("unbiased".into()));
    assert_eq!(label(&scene, LIGHTTRACE), Ok("unbiased".into()));
    let glass = format!("{scene}Material \"dielectric\"\nShape \"sphere\" \"float radius\" 0.3\n");
    assert!(label(&glass, LIGHTTRACE).is_ok_and(|l| l.starts_with("truncated: what the camera sees by way of")));
    assert!(label(&scene, "photon").is_ok_and(|l| l.starts_with("biased: photon radius ") && l.contains("alpha")));
    // The camera all around cannot be reached; bidirectional does without.
    let all_around = in_box(4, "LightSource \"point\" \"point3 from\" [ 0.2 0.5 0.2 ]\n")
        .replace("\"perspective\" \"float fov\" 70", "\"spherical\"");
    assert!(label(&all_around, LIGHTTRACE).is_err_and(|e| e.contains("orthographic") && e.contains("bdpt")));
    let path = estimate(&all_around, How::new(512, 1).depth(2));
    let both = estimate(&all_around, How::new(256, 2).depth(2).by(by(BDPT, &[])));
    assert_agree(&both, &path, 0.12, "spherical camera");
}
