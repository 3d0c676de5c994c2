//! One render, taken apart: layers of kinds of paths add up to the picture exactly, and each is what it says (ledger rows
//! A03, A04, A37-A40, A45, A53, B13, B19, B43 and the furnace term by term).
//!
//! Layers have no variances of their own: where noise is judged, a scene is rendered with many seeds and the spread of the
//! picture's means tells. [`SIGMAS`] is the two-sided 1e-6 of Student's t with 31 degrees of freedom; each check states
//! the bias that it would have seen.

mod estimate;

use estimate::quad;
use irradiant::core::film::exact::ExactSum;
use irradiant::{Aov, ColorMode, MaxDepth, RenderSettings, Rendering, load_text, render};
use irradiant_testkit::Mean;

const SEEDS: u64 = 32;
const SIGMAS: f64 = 6.2;

fn aovs(list: &[&str]) -> Vec<Aov> {
    list.iter().map(|text| text.parse().unwrap_or_else(|why| panic!("{text}: {why}"))).collect()
}

fn picture(scene: &str, settings: RenderSettings) -> Rendering {
    let file = load_text("test", scene, ".").unwrap_or_else(|e| panic!("{e}\n{scene}"));
    let rendering = render(&file, &settings).unwrap_or_else(|e| panic!("{e}\n{scene}"));
    assert_eq!(rendering.header.samples_refused, 0);
    rendering
}

fn unlimited() -> RenderSettings {
    RenderSettings { max_depth: Some(MaxDepth::None), threads: 1, ..RenderSettings::default() }
}

/// Mean of one layer's picture, by name; "picture" is the picture itself.
fn mean(rendering: &Rendering, name: &str) -> [f64; 3] {
    if name == "picture" {
        let b = rendering.film.bounds();
        let mut sum = [0.0; 3];
        for y in b.y0..b.y1 {
            for x in b.x0..b.x1 {
                let mean = rendering.film.pixel(x, y).mean();
                (0..3).for_each(|c| sum[c] += mean[c] / b.area() as f64);
            }
        }
        return sum;
    }
    let layers = rendering.layer_light();
    layers.iter().find(|l| l.name == name).unwrap_or_else(|| panic!("no layer {name}")).mean
}

/// Green means of these layers over many seeds, in RGB.
fn over_seeds(scene: &str, first_seed: u64, spp: u32, list: &[&str], names: &[&str], depth: MaxDepth) -> Vec<Mean> {
    let mut means = vec![Mean::new(); names.len()];
    for seed in first_seed..first_seed + SEEDS {
        let settings = RenderSettings {
            seed: Some(seed),
            samples_per_pixel: Some(spp),
            color: ColorMode::Rgb,
            aovs: aovs(list),
            max_depth: Some(depth),
            ..unlimited()
        };
        let rendering = picture(scene, settings);
        names.iter().zip(&mut means).for_each(|(name, m)| m.add(mean(&rendering, name)[1]));
    }
    means
}

/// Panics unless two means agree and a relative bias of `power` would have been seen.
#[track_caller]
fn assert_agree(a: &Mean, b: &Mean, power: f64, what: &str) {
    let se = a.standard_error().hypot(b.standard_error());
    let visible = (SIGMAS + 2.0) * se / b.mean().abs();
    assert!(visible <= power, "{what}: only a bias of {:.2} % would be seen", 100.0 * visible);
    let z = (a.mean() - b.mean()) / se.max(1e-7 * b.mean().abs());
    assert!(z.abs() <= SIGMAS, "{what}: {} and {} are {z:.1} standard errors apart", a.mean(), b.mean());
}

fn film(size: u32, spp: u32) -> String {
    format!(
        "Film \"rgb\" \"integer xresolution\" {size} \"integer yresolution\" {size}\nPixelFilter \"mitchell\"\nSampler \"zsobol\" \"integer pixelsamples\" {spp}\nIntegrator \"path\" \"integer maxdepth\" 20\n"
    )
}

/// A room with a lamp, a window, a glass ball that parts wavelengths, glossy paint, a mirror, an instance.
fn room() -> String {
    let mut text = film(20, 8)
        + "LookAt 0 0.2 -2.6  0 -0.2 0  0 1 0\nCamera \"perspective\" \"float fov\" 50\nWorldBegin\n"
        + "LightSource \"infinite\" \"rgb L\" [ 0.3 0.4 0.6 ] \"string group\" \"sky\"\n"
        + "LightSource \"point\" \"point3 from\" [ -0.5 0.6 -1 ] \"rgb I\" [ 0.3 0.3 0.2 ]\n"
        + "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 9 8 6 ] \"string group\" \"lamps\" \"bool twosided\" true\n"
        + &quad([[-0.4, 0.9, -0.4], [0.4, 0.9, -0.4], [0.4, 0.9, 0.4], [-0.4, 0.9, 0.4]])
        + "AttributeEnd\n"
        + "MakeNamedMaterial \"floor\" \"string type\" \"diffuse\" \"rgb reflectance\" [ 0.7 0.6 0.5 ]\n"
        + "NamedMaterial \"floor\"\n"
        + &quad([[-2.0, -1.0, -2.0], [2.0, -1.0, -2.0], [2.0, -1.0, 2.0], [-2.0, -1.0, 2.0]])
        + "Material \"conductor\" \"float roughness\" 0\n"
        + &quad([[-1.2, -1.0, 1.0], [1.2, -1.0, 1.0], [1.2, 1.0, 1.2], [-1.2, 1.0, 1.2]]);
    text += "ObjectBegin \"balls\"\n";
    for (x, material) in [
        (-0.7, "\"dielectric\" \"spectrum eta\" \"glass-SF11\""),
        (0.0, "\"coateddiffuse\" \"rgb reflectance\" [ 0.2 0.5 0.7 ] \"float roughness\" 0.01"),
        (0.7, "\"conductor\" \"float roughness\" 0.05"),
    ] {
        text += &format!(
            "AttributeBegin\nMaterial {material}\nTranslate {x} -0.65 0\nShape \"sphere\" \"float radius\" 0.33\nAttributeEnd\n"
        );
    }
    text + "ObjectEnd\nObjectInstance \"balls\"\n"
}

/// Indices of the film's layers with these names.
fn layers_called(rendering: &Rendering, belongs: impl Fn(&str) -> bool) -> Vec<usize> {
    let layers = rendering.film.layers().iter().enumerate();
    let named = layers.filter(|(_, l)| l.channel_names().first().is_some_and(|n| belongs(n.trim_end_matches(".R"))));
    named.map(|(i, _)| i).collect()
}

/// Disjoint layers that leave nothing out.
const COVERS: [(&str, &[&str]); 6] = [
    ("bounces:6", &["K0", "K1", "K2", "K3", "K4", "K5", "K6", "Krest"]),
    ("gi", &["direct", "caustics", "interreflections"]),
    ("techniques", &["hit", "sampled"]),
    ("lights", &["light0", "light1", "light2"]),
    ("groups", &["group.sky", "group.lamps", "group.ungrouped"]),
    ("x=L.*E", &["x"]),
];

#[test]
fn disjoint_layers_add_up_to_the_picture_to_the_last_bit() {
    let mut list: Vec<&str> = COVERS.iter().map(|c| c.0).collect();
    list.extend(["a=L(.*[^S])?E", "b=L.*SE", "floor=L.*D'floor'S*E", "balls=L.*.'balls'E", "glass=L.*<T.>E"]);
    let rendering = picture(&room(), RenderSettings { aovs: aovs(&list), ..unlimited() });
    let mut covers: Vec<Vec<&str>> = COVERS.iter().map(|c| c.1.to_vec()).collect();
    covers.push(vec!["a", "b"]);
    let bounds = rendering.film.bounds();
    for names in &covers {
        let layers = layers_called(&rendering, |n| names.contains(&n));
        assert_eq!(layers.len(), names.len(), "{names:?}");
        for y in bounds.y0..bounds.y1 {
            for x in bounds.x0..bounds.x1 {
                let mut sum = [ExactSum::default(); 3];
                for &layer in &layers {
                    let parts = rendering.film.layer_sums(x, y, layer);
                    (0..3).for_each(|c| sum[c] += parts[c]);
                }
                assert_eq!(sum, rendering.film.pixel(x, y).radiance, "{names:?} at {x}, {y}");
            }
        }
    }
    // Every layer holds light, and none all of it but those that must.
    for layer in rendering.layer_light() {
        assert!(layer.share > 0.0 && (layer.share < 0.9999 || layer.name == "x"), "{layer:?}");
    }
}

#[test]
fn in_the_file_each_layer_is_within_one_ulp() {
    let rendering = picture(&room(), RenderSettings { aovs: aovs(&["gi", "bounces:3"]), ..unlimited() });
    let bytes = irradiant::image::write(&rendering.image(), irradiant::image::FileFormat::Exr).unwrap();
    let file = irradiant::image::read(&bytes, "layers.exr", &irradiant::image::ReadOptions::default()).unwrap();
    let ulp = |x: f32| f64::from(x.abs().next_up() - x.abs());
    let channel = |name: &str| file.channel_index(name).unwrap_or_else(|| panic!("no channel {name}"));
    for names in [&["direct", "caustics", "interreflections"][..], &["K0", "K1", "K2", "K3", "Krest"]] {
        for y in 0..20 {
            for x in 0..20 {
                for (c, letter) in ["R", "G", "B"].iter().enumerate() {
                    let whole = file.get(x, y, channel(letter));
                    let (mut sum, mut allowed) = (0.0, ulp(whole));
                    for name in names {
                        let part = file.get(x, y, channel(&format!("{name}.{letter}")));
                        let layer = layers_called(&rendering, |n| n == *name)[0];
                        let pixel = rendering.film.pixel(x as i32, y as i32);
                        let exact =
                            rendering.film.layer_sums(x as i32, y as i32, layer)[c].value() / f64::from(pixel.count);
                        assert!((f64::from(part) - exact).abs() <= ulp(part), "{name} {part} {exact}");
                        sum += f64::from(part);
                        allowed += ulp(part);
                    }
                    assert!((sum - f64::from(whole)).abs() <= allowed, "{names:?} at {x}, {y}: {sum} {whole}");
                }
            }
        }
    }
    let layers = rendering.header.layers.join("; ");
    assert!(layers.contains("direct = L[^S]?S*E; caustics = LS+[^S]S*E"), "{layers}");
    assert_eq!(
        file.metadata.attribute("irradiant/layers"),
        Some(&irradiant::image::Attribute::Text(layers)),
        "the header says what the layers are"
    );
}

#[test]
fn taking_a_picture_apart_does_not_change_it() {
    let limited = "Film \"rgb\" \"float maxcomponentvalue\" 2 ";
    for scene in [room(), room().replacen("Film \"rgb\"", limited, 1)] {
        let whole = picture(&scene, unlimited());
        let parts = picture(&scene, RenderSettings { aovs: aovs(&["gi"]), ..unlimited() });
        for y in 0..20 {
            for x in 0..20 {
                let (a, b) = (whole.film.pixel(x, y), parts.film.pixel(x, y));
                assert_eq!(a.count, b.count);
                for c in 0..3 {
                    let size = (a.variance()[c] + a.mean()[c] * a.mean()[c]).sqrt() + 1e-6;
                    assert!((a.mean()[c] - b.mean()[c]).abs() < 3e-6 * size, "{x} {y}: {:?} {:?}", a.mean(), b.mean());
                    assert!((a.variance()[c] - b.variance()[c]).abs() < 1e-5 * size * size, "{x} {y}");
                }
            }
        }
    }
}

#[test]
fn layers_have_the_same_bits_for_any_number_of_threads() {
    let file = |threads: usize| {
        let settings = RenderSettings { aovs: aovs(&["bounces:4", "gi", "lights"]), threads, ..unlimited() };
        irradiant::image::write(&picture(&room(), settings).image(), irradiant::image::FileFormat::Exr).unwrap()
    };
    let one = file(1);
    assert!(one == file(2), "1 and 2 threads differ");
    assert!(one == file(5), "1 and 5 threads differ");
}

/// Its lower part, without the lamp, whose edge is all noise.
fn cornell(size: u32) -> String {
    let text = include_str!("../../../scenes/cornell-box.pbrt");
    let sizes = |n: u32| format!("\"integer xresolution\" {n} \"integer yresolution\" {n}");
    assert!(text.contains(&sizes(512)) && text.contains("Sampler \"zsobol\""), "the built-in scene has changed");
    text.replace(&sizes(512), &(sizes(size) + " \"float cropwindow\" [ 0 1 0.25 1 ]"))
        .replace("Sampler \"zsobol\"", "Sampler \"independent\"")
}

#[test]
fn partial_sums_are_depth_limited_renders() {
    // With the same random numbers a limit cuts paths off and changes nothing before: equal up to rounding.
    let scene = cornell(16);
    let settings = |depth| RenderSettings { samples_per_pixel: Some(16), max_depth: Some(depth), ..unlimited() };
    let apart = RenderSettings { aovs: aovs(&["partial:6", "bounces:6"]), ..settings(MaxDepth::None) };
    let rendering = picture(&scene, apart);
    let mut sum = [0.0; 3];
    for depth in 0..=6 {
        let limited = picture(&scene, settings(MaxDepth::Limit(depth)));
        let wanted = mean(&limited, "picture");
        let partial = mean(&rendering, &format!("sum{depth}"));
        let single = mean(&rendering, &format!("K{depth}"));
        for c in 0..3 {
            sum[c] += single[c];
            assert!((partial[c] - wanted[c]).abs() <= 1e-6 * wanted[c], "depth {depth}: {partial:?} {wanted:?}");
            assert!((sum[c] - wanted[c]).abs() <= 1e-6 * wanted[c], "depth {depth}: {sum:?} {wanted:?}");
        }
    }
    // With other random numbers they agree within noise.
    let names = ["sum1", "sum2", "sum4"];
    let apart = over_seeds(&scene, 100, 16, &["partial:6"], &names, MaxDepth::None);
    for (i, depth) in [1, 2, 4].into_iter().enumerate() {
        let limited = over_seeds(&scene, 1000 * u64::from(depth), 16, &[], &["picture"], MaxDepth::Limit(depth));
        assert_agree(&apart[i], &limited[0], 0.05, &format!("Cornell box, depth {depth}"));
    }
}

/// A cube of walls that all emit 1 and reflect `rho`, with a ball of the same in it: wherever one looks, K^i(Le) = rho^i. Unlike
/// in a sphere, light samples are not cosine samples and may be in shadow, so that light samples and weights have noise.
fn furnace(rho: f64) -> String {
    let mut text = film(1, 64).replace("mitchell", "box")
        + "LookAt -0.5 0.3 -0.8  0.4 -0.2 0.5  0 1 0\nCamera \"perspective\" \"float fov\" 60\nWorldBegin\n"
        + &format!("Material \"diffuse\" \"spectrum reflectance\" [ 300 {rho} 900 {rho} ]\n")
        + "AreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ] \"bool twosided\" true\n";
    for (axis, side) in [(0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0), (2, -1.0), (2, 1.0)] {
        let corner = |u: f32, v: f32| {
            let mut p = [side; 3];
            (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (u, v);
            p
        };
        text += &quad([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
    }
    text + "Translate 0.3 -0.5 0.2\nShape \"sphere\" \"float radius\" 0.4\n"
}

#[test]
fn furnace_terms_are_the_powers_of_the_albedo() {
    // Each vertex takes light samples and BSDF samples, weighed; roulette is played at each event. By throughput it would
    // leave next to nothing of the last terms of dark walls, so its chance is constant here; what roulette by throughput
    // reaches is compared too. `irradiant teach` does the same to 0.1 % of each term.
    for (i, rho) in [0.2f64, 0.5, 0.8, 0.95].into_iter().enumerate() {
        let names: Vec<String> = (0..=10).map(|k| format!("K{k}")).collect();
        for (roulette, spp) in [(&["roulette=constant", "q=0.05"][..], 2048), (&["roulette=throughput"], 512)] {
            let mut terms = vec![Mean::new(); names.len()];
            for seed in 0..SEEDS {
                let settings = RenderSettings {
                    seed: Some(1 + seed + 50 * i as u64),
                    samples_per_pixel: Some(spp),
                    color: ColorMode::Rgb,
                    aovs: aovs(&["bounces:10"]),
                    integrator: Some(irradiant::IntegratorChoice::named("path").unwrap()),
                    estimator: roulette.iter().map(|word| word.to_string()).collect(),
                    max_depth: Some(MaxDepth::Limit(12)),
                    ..unlimited()
                };
                let rendering = picture(&furnace(rho), settings);
                names.iter().zip(&mut terms).for_each(|(name, m)| m.add(mean(&rendering, name)[1]));
            }
            for (k, term) in terms.iter().enumerate() {
                let exact = rho.powi(k as i32);
                let (se, off) = (term.standard_error(), term.mean() - exact);
                let visible = (SIGMAS + 2.0) * se / exact;
                eprintln!(
                    "rho {rho}, {roulette:?}, K^{k}: off by {:.3} %, standard error {:.3} %, would see {:.2} %",
                    100.0 * off / exact,
                    100.0 * se / exact,
                    100.0 * visible
                );
                // What hardly a path reaches by throughput has no error bar there.
                let reached = roulette.len() == 2 || exact > 0.1;
                let right = off.abs() <= SIGMAS * se + 2e-5 * exact;
                assert!(right || !reached, "rho {rho}, {roulette:?}, K^{k}: {term:?} for {exact}");
                let power = if roulette.len() == 2 { 0.04 } else { 0.12 };
                assert!(!reached || visible < power, "rho {rho}, K^{k}: only {:.2} % would be seen", 100.0 * visible);
            }
        }
    }
}

#[test]
fn groups_of_lights_are_renders_with_these_lights_alone() {
    let light = |group: &str, from: &str, color: &str| {
        format!(
            "LightSource \"spot\" \"point3 from\" [ {from} ] \"point3 to\" [ 0 -1 0 ] \"rgb I\" [ {color} ] \"string group\" \"{group}\"\n"
        )
    };
    let (key, rim) = (light("key", "-1 1 -1", "3 2 1"), light("rim", "1 1 0.5", "1 2 3"));
    let scene = |lights: &str| {
        film(8, 4).replace("zsobol", "independent")
            + "LookAt 0 0 -2.5  0 -0.4 0  0 1 0\nCamera \"perspective\" \"float fov\" 45\nWorldBegin\n"
            + lights
            + "Material \"diffuse\" \"rgb reflectance\" [ 0.8 0.8 0.8 ]\n"
            + &quad([[-2.0, -1.0, -2.0], [2.0, -1.0, -2.0], [2.0, -1.0, 2.0], [-2.0, -1.0, 2.0]])
            + "Translate 0 -0.5 0\nShape \"sphere\" \"float radius\" 0.5\n"
    };
    let both = over_seeds(
        &scene(&format!("{key}{rim}")),
        7,
        256,
        &["groups"],
        &["group.key", "group.rim"],
        MaxDepth::Limit(3),
    );
    for (i, alone) in [&key, &rim].into_iter().enumerate() {
        let single = over_seeds(&scene(alone), 500 + 40 * i as u64, 256, &[], &["picture"], MaxDepth::Limit(3));
        assert_agree(&both[i], &single[0], 0.05, ["key", "rim"][i]);
    }
}

#[test]
fn what_counts_as_glossy_does_not_depend_on_how_light_was_found() {
    // Light samples do not pass interfaces (a mix hides that it is one, or it would be left out): within a shell of them all
    // light is met by chance, outside both techniques share. The split of paint into highlight and body must be the same.
    let scene = |shell: &str| {
        film(8, 4).replace("zsobol", "independent")
            + "LookAt 0 0 -3  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\nWorldBegin\n"
            + "AttributeBegin\nAreaLightSource \"diffuse\" \"bool twosided\" true\nTranslate 0 3.4 -5\nShape \"sphere\" \"float radius\" 3\nAttributeEnd\n"
            + "MakeNamedMaterial \"none\" \"string type\" \"interface\"\nMakeNamedMaterial \"shell\" \"string type\" \"mix\" \"string materials\" [ \"none\" \"none\" ]\n"
            + shell
            + "Material \"glossypaint\" \"rgb reflectance\" [ 0.1 0.1 0.1 ] \"float roughness\" 0.04\nShape \"sphere\"\n"
    };
    let list = ["glossy=LGE", "diffuse=LDE", "sampled=L.E@sampled"];
    let names = ["glossy", "diffuse", "sampled"];
    let open = over_seeds(&scene(""), 1, 128, &list, &names, MaxDepth::Limit(1));
    let shell = "AttributeBegin\nNamedMaterial \"shell\"\nShape \"sphere\" \"float radius\" 1.2\nAttributeEnd\n";
    let closed = over_seeds(&scene(shell), 300, 128, &list, &names, MaxDepth::Limit(1));
    assert!(closed[2].mean() == 0.0 && open[2].mean() > 0.2 * open[1].mean(), "the shell hides nothing");
    assert_agree(&open[0], &closed[0], 0.15, "highlight");
    assert_agree(&open[1], &closed[1], 0.15, "body");
    assert!(open[0].mean() > 0.2 * open[1].mean() && open[0].mean() < 5.0 * open[1].mean(), "both are there");
}

#[test]
fn a_mirror_lights_the_floor_as_the_lamps_image_would() {
    // LS+DE of a floor beside a mirror of reflectance 1 (within a closed form, the lamp's image behind it).
    let lamp = |x: f32| {
        format!(
            "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 5 5 5 ] \"bool twosided\" true\nTranslate {x} 0.5 0\nShape \"sphere\" \"float radius\" 0.25\nAttributeEnd\n"
        )
    };
    let scene = |lamp: &str, mirror: &str| {
        film(8, 4).replace("zsobol", "independent")
            + "LookAt -1 3 0  -1 -1 0  0 0 1\nCamera \"perspective\" \"float fov\" 25\nWorldBegin\n"
            + lamp
            + "Material \"diffuse\" \"rgb reflectance\" [ 0.5 0.5 0.5 ]\n"
            + &quad([[-3.0, -1.0, -3.0], [0.9, -1.0, -3.0], [0.9, -1.0, 3.0], [-3.0, -1.0, 3.0]])
            + mirror
    };
    // At x = 1; wide and high enough for all of the lamp's light to the floor that is seen.
    let mirror = format!(
        "Material \"conductor\" \"rgb reflectance\" [ 0.8 0.8 0.8 ] \"float roughness\" 0\n{}",
        quad([[1.0, -1.0, -5.0], [1.0, -1.0, 5.0], [1.0, 6.0, 5.0], [1.0, 6.0, -5.0]])
    );
    let caustic =
        over_seeds(&scene(&lamp(0.0), &mirror), 11, 512, &["caustics=LSDE"], &["caustics"], MaxDepth::Limit(2));
    let image = over_seeds(&scene(&lamp(2.0), ""), 400, 64, &["direct=LDE"], &["direct"], MaxDepth::Limit(1));
    let mut dimmed = Mean::new();
    // The metal's reflectance is 0.8 at normal incidence and a little more aslant: between the two.
    dimmed.add(caustic[0].mean() / image[0].mean());
    assert!((0.79..0.9).contains(&dimmed.mean()), "{}", dimmed.mean());
}

#[test]
fn what_a_depth_limit_leaves_out_is_estimated() {
    let scene = cornell(16);
    let settings = |depth| RenderSettings {
        samples_per_pixel: Some(256),
        max_depth: Some(depth),
        aovs: aovs(&["bounces:8"]),
        ..unlimited()
    };
    let whole = picture(&scene, settings(MaxDepth::None));
    let file = load_text("test", &scene, ".").unwrap();
    assert_eq!(irradiant::Job::new(&file, &settings(MaxDepth::None)).unwrap().missing_light(), None);
    for depth in [3, 5] {
        let limited = picture(&scene, settings(MaxDepth::Limit(depth)));
        let truth = mean(&whole, "picture")[1] / mean(&limited, "picture")[1] - 1.0;
        // From a few paths without limit, with an error bar.
        let file = load_text("test", &scene, ".").unwrap();
        let job = irradiant::Job::new(&file, &settings(MaxDepth::Limit(depth))).unwrap();
        let missing = job.missing_light().expect("there is a limit");
        assert!((missing.share - truth).abs() < 5.0 * missing.standard_error + 0.02 * truth, "{missing:?} {truth}");
        assert!(missing.standard_error < 0.2 * truth, "depth {depth}: {missing:?} says nothing");
        assert!(missing.found > 100 && missing.paths >= missing.found, "{missing:?}");
    }
}

#[test]
fn impossible_layers_are_refused_with_what_to_try() {
    let refuse = |list: &[&str], settings: RenderSettings| {
        let file = load_text("test", &room(), ".").unwrap();
        match render(&file, &RenderSettings { aovs: aovs(list), ..settings }) {
            Err(why) => why.to_string(),
            Ok(_) => panic!("{list:?} rendered"),
        }
    };
    let plain = RenderSettings::default;
    assert!(refuse(&["a=LDE", "a=LSE"], plain()).contains("rename one"));
    assert!(refuse(&["a=LD'flor'E"], plain()).contains("did you mean 'floor'?"));
    let huge = refuse(&["bounces:60", "partial:60"], RenderSettings { resolution: Some([4096, 2048]), ..plain() });
    assert!(huge.contains("fewer layers") && huge.contains("GiB"), "{huge}");
    assert!(huge.contains("--max-film-memory"), "{huge}");
    // A limit that the user sets counts.
    let small = refuse(&["bounces:58"], RenderSettings { max_film_bytes: Some(300_000), ..plain() });
    assert!(small.contains("fewer layers"), "{small}");
    let walk = irradiant::IntegratorChoice::named("randomwalk").unwrap();
    assert!(refuse(&["gi"], RenderSettings { integrator: Some(walk), ..plain() }).contains("--integrator path"));
    for (text, help) in [
        ("bounces", "bounces:6"),
        ("bounces:1000", "0 to 64"),
        ("lights:3", "takes no number"),
        ("boounces:3", "did you mean \"bounces\""),
        ("LDE", "NAME=EXPRESSION"),
        ("a b=LDE", "no name for a layer"),
        ("=LDE", "no name for a layer"),
        ("a=LXE", "events are D, G, S, V"),
    ] {
        let why = text.parse::<Aov>().expect_err(text);
        assert!(why.contains(help), "{text}: {why}");
    }
    let file = load_text(
        "test",
        &film(4, 1)
            .replacen("Film", "Camera \"perspective\"\nFilm", 1)
            .replace("Integrator", "WorldBegin\nLightSource \"infinite\"\nShape \"sphere\"\n#"),
        ".",
    );
    let file = file.unwrap_or_else(|e| panic!("{e}"));
    let why = match render(&file, &RenderSettings { aovs: aovs(&["groups"]), ..plain() }) {
        Err(why) => why.to_string(),
        Ok(_) => panic!("groups without groups"),
    };
    assert!(why.contains("string group"), "{why}");
}

#[test]
fn contact_sheets_hold_every_tile() {
    let rendering = picture(&room(), RenderSettings { aovs: aovs(&["gi", "bounces:3"]), ..unlimited() });
    let folder = std::env::temp_dir().join(format!("irradiant-sheet-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("sheet.png");
    rendering.save_contact_sheet(&path, 1.0).unwrap();
    let sheet = irradiant::image::read_file(&path, &irradiant::image::ReadOptions::default()).unwrap();
    let _ = std::fs::remove_dir_all(&folder);
    // 9 tiles of 20 x 20 with 19 lines of label, as far apart as the longest label is wide (letters of 5 + 1): columns times rows of them, and
    // gutters of 6.
    let letters = |l: &irradiant::LayerLight| format!("{} {:.2} %", l.name, 100.0 * l.share).len();
    let label = rendering.layer_light().iter().map(letters).max().unwrap_or(0) * 6 - 1;
    assert!(label > 100, "{label}");
    let (columns, rows) = ((sheet.width() - 6) / (label + 6), (sheet.height() - 6) / 39);
    assert_eq!((sheet.width(), sheet.height()), (6 + columns * (label + 6), 6 + rows * 39));
    assert!(columns * rows >= 9 && columns * (rows - 1) < 9);
    // The first tile is the picture, as a display shows it.
    let shown = irradiant::image::to_srgb8(
        &rendering.image(),
        &irradiant::image::ToneOptions { exposure: 1.0, ..Default::default() },
    )
    .unwrap();
    for (x, y) in [(0, 0), (10, 10), (19, 19), (5, 12)] {
        for c in 0..3 {
            assert_eq!(sheet.get(6 + x, 6 + y, c), shown.get(x, y, c), "{x} {y}");
        }
    }
}
