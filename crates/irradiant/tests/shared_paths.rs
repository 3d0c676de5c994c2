//! Paths that neighbouring pixels share bring the same light as paths of one's own, with less noise per pixel.
//!
//! Pixels of a block of 4 by 4 have errors in common, so the film's error bars of single pixels do not add up to those of the picture: both
//! are measured by the scatter of [`REPLICATES`] pictures. Means may be 6.5 joint standard errors apart: with 126 degrees of freedom a right
//! program exceeds that with odds of 2e-9, or 1e-5 over all pixels here. Single pixels matter: what is wrong among companions, as a forgotten shadow
//! ray, cancels in a block's mean. Seen to fail: without the shadow rays, without the densities of light samples at metals, without the
//! scaling of a path that lost wavelengths; and, by 1 to 20 % of like pixels, when those pixels took no part whose own paths failed.
//!
//! Those pictures are made one path at a time. Paths in batches have the bits of these: sums of radiance and of its squares, and all counts.
//! Seen to fail: with the density of light at a metal, or of a pair of vertices, times 1.0001.

mod estimate;

use estimate::{How, INSIDE, cube, diffuse, estimate, film, lit_box, quad};
use irradiant::core::film::{FilmTile, PixelBounds};
use irradiant::core::geometry::Level;
use irradiant::renderer::shared_path::SharedPathIntegrator;
use irradiant::renderer::{Integrator, RenderStats, WorkUnit};
use irradiant::{ColorMode, IntegratorChoice, Job, RenderSettings, load_text, render};
use std::sync::{Arc, OnceLock};

/// Pictures by shared paths, each of other random numbers.
const REPLICATES: u64 = 64;

fn choice(words: &str) -> IntegratorChoice {
    let mut words = words.split_whitespace();
    let named = IntegratorChoice::named(words.next().unwrap_or_default());
    words.fold(named, |choice, pair| choice?.with_words(pair)).unwrap_or_else(|why| panic!("{why}"))
}

/// Of each pixel the mean over replicates and the square of its standard error, by channel; last, the same of the whole picture.
fn replicated(scene: &str, how: &How) -> Vec<[(f64, f64); 3]> {
    let pictures: Vec<Vec<[f64; 3]>> = (0..REPLICATES)
        .map(|i| {
            let mut pixels = estimate(scene, How { seed: how.seed + 1000 * (i + 1), ..how.clone() }).mean;
            let n = pixels.len() as f64;
            pixels.push([0, 1, 2].map(|c| pixels.iter().map(|p| p[c]).sum::<f64>() / n));
            pixels
        })
        .collect();
    let n = REPLICATES as f64;
    (0..pictures[0].len())
        .map(|pixel| {
            std::array::from_fn(|c| {
                let mean = pictures.iter().map(|p| p[pixel][c]).sum::<f64>() / n;
                let square = pictures.iter().map(|p| (p[pixel][c] - mean).powi(2)).sum::<f64>();
                (mean, square / (n - 1.0) / n)
            })
        })
        .collect()
}

/// Compares shared paths, `spp` samples in each replicate, with as many paths of their own; a bias of `power` of the whole must be visible.
#[track_caller]
fn assert_shared_is_right(scene: &str, words: &str, how: How, power: f64) {
    let shared = replicated(scene, &how.clone().by(choice(words)));
    let own = replicated(scene, &How { seed: how.seed + 500, ..how });
    let whole = shared.len() - 1;
    for c in 0..3 {
        let mut seen = vec![];
        for (i, (s, o)) in shared.iter().zip(&own).enumerate() {
            let error = (s[c].1 + o[c].1).sqrt();
            let z = (s[c].0 - o[c].0) / error.max(1e-9);
            seen.push(6.9 * error / o[c].0.max(1e-9));
            assert!(z.abs() < 6.5, "pixel {i} channel {c}: {} by shared paths, {} by others: z {z:.2}", s[c].0, o[c].0);
            if i == whole {
                eprintln!("{words}: channel {c}: z {z:.2}; would see a bias of {:.2} %", 100.0 * seen[whole]);
                assert!(seen[whole] <= power, "only a bias of {:.2} % would be seen", 100.0 * seen[whole]);
            }
        }
        seen.sort_by(f64::total_cmp);
        eprintln!("    of half of the pixels: {:.0} %", 100.0 * seen[whole / 2]);
    }
}

/// The box of other tests, in 4 by 4 blocks.
fn diffuse_box() -> String {
    lit_box().replace("resolution\" 8", "resolution\" 16")
}

/// Metals, glass, a leaf, a coat and diffuse things in a box under a sky, a lamp and a point light; something moves.
fn all_sorts() -> String {
    let walls = [[0.7, 0.3, 0.2], [0.2, 0.6, 0.3], [0.7, 0.7, 0.7], [0.5, 0.5, 0.6], [0.6, 0.6, 0.6], [0.4, 0.4, 0.5]];
    let open = cube(walls);
    // Without the ceiling, which is the fourth wall.
    let parts: Vec<&str> = open.split("Material").collect();
    let open: String =
        parts.iter().enumerate().filter(|(i, _)| *i != 0 && *i != 4).map(|(_, p)| format!("Material{p}")).collect();
    film(16)
        + INSIDE
        + "WorldBegin\nLightSource \"infinite\" \"rgb L\" [ .5 .6 .8 ]\nLightSource \"point\" \"rgb I\" [ .3 .3 .2 ] \"point3 from\" [ -0.7 0.8 -0.6 ]\n"
        + &open
        + "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 3 2 4 ] \"bool twosided\" true\n"
        + &quad([[-0.6, 0.7, 0.5], [0.1, 0.7, 0.5], [0.1, 0.6, 0.8], [-0.6, 0.6, 0.8]])
        + "AttributeEnd\nAttributeBegin\nMaterial \"conductor\" \"float roughness\" 0.3\nTranslate 0.4 -0.6 0.3\nShape \"sphere\" \"float radius\" 0.4\nAttributeEnd\n"
        + "AttributeBegin\nMaterial \"conductor\" \"float roughness\" 0.15 \"rgb reflectance\" [ .9 .6 .4 ]\nTranslate 0 -0.99 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" 0.8\nAttributeEnd\n"
        + "AttributeBegin\nMaterial \"diffusetransmission\" \"rgb reflectance\" [ .3 .2 .1 ] \"rgb transmittance\" [ .2 .5 .2 ]\nTranslate -0.6 -0.2 0.5\nRotate 20 0 1 0\nShape \"disk\" \"float radius\" 0.4\nAttributeEnd\n"
        + "AttributeBegin\nMaterial \"dielectric\"\nTranslate -0.3 -0.7 -0.1\nShape \"sphere\" \"float radius\" 0.2\nAttributeEnd\n"
        + "AttributeBegin\nMaterial \"coateddiffuse\"\nTranslate 0.6 0.2 0.6\nShape \"sphere\" \"float radius\" 0.2\nAttributeEnd\n"
        + "AttributeBegin\n"
        + &diffuse(0.4, 0.5, 0.8)
        + "ActiveTransform EndTime\nTranslate 0.3 0 0\nActiveTransform All\nTranslate -0.2 0.3 0.4\nShape \"sphere\" \"float radius\" 0.15\nAttributeEnd\n"
}

#[test]
fn the_diffuse_box_at_every_depth() {
    let scene = diffuse_box();
    for (depth, power) in [(1, 0.01), (2, 0.01), (3, 0.01)] {
        assert_shared_is_right(&scene, "sharedpath", How::new(32, u64::from(depth)).depth(depth), power);
    }
    assert_shared_is_right(&scene, "sharedpath lights=1", How::new(32, 4), 0.015);
}

#[test]
fn all_sorts_of_surfaces_and_lights() {
    let scene = all_sorts();
    assert_shared_is_right(&scene, "sharedpath", How::new(48, 11), 0.03);
    assert_shared_is_right(&scene, "sharedpath lights=2", How::new(32, 12).depth(3).spectral(), 0.06);
}

/// Stripes of two materials at z = 0.99, two pixels wide for a camera of 8 pixels and 45 degrees at this distance.
fn stripes(a: &str, b: &str, distance: f32) -> String {
    let width = 2.0 * (2.0 * distance * (22.5f32).to_radians().tan() / 8.0);
    let stripe = |i: i32| {
        let x = i as f32 * width;
        let front = quad([[x, -0.9, 0.99], [x + width, -0.9, 0.99], [x + width, 0.9, 0.99], [x, 0.9, 0.99]]);
        if i % 2 == 0 { a } else { b }.to_string() + &front
    };
    (-4..4).map(stripe).collect()
}

/// A box with a point light whose front wall is cut into stripes of two materials, two pixels wide, so that each block of pixels sees both.
fn striped(a: &str, b: &str, behind: &str) -> String {
    let walls = [[0.8; 3]; 6];
    let room = cube(walls).replacen("Material \"diffuse\" \"rgb reflectance\" [ 0.8 0.8 0.8 ]", behind, 1);
    let scene = film(8)
        + "LookAt 0 0 0.5  0 0 1  0 1 0\nCamera \"perspective\" \"float fov\" 45\nWorldBegin\nLightSource \"point\" \"rgb I\" [ 1 1 1 ] \"point3 from\" [ 0 0 -0.5 ]\n"
        + &room;
    scene + &stripes(a, b, 0.49)
}

/// Compares the mean of like stripes, which no companions of another kind can hide: each must be right to `power`.
#[track_caller]
fn assert_stripes_are_right(scene: &str, how: How, power: f64) {
    let mean = |how: &How, kind: usize| {
        let pictures: Vec<[f64; 3]> = (0..REPLICATES)
            .map(|i| {
                let pixels = estimate(scene, How { seed: how.seed + 1000 * (i + 1), ..how.clone() }).mean;
                let like: Vec<_> =
                    pixels.iter().enumerate().filter(|(i, _)| i % 8 / 2 % 2 == kind).map(|(_, p)| p).collect();
                [0, 1, 2].map(|c| like.iter().map(|p| p[c]).sum::<f64>() / like.len() as f64)
            })
            .collect();
        let n = REPLICATES as f64;
        [0, 1, 2].map(|c| {
            let mean = pictures.iter().map(|p| p[c]).sum::<f64>() / n;
            (mean, pictures.iter().map(|p| (p[c] - mean).powi(2)).sum::<f64>() / (n - 1.0) / n)
        })
    };
    for kind in 0..2 {
        let shared = mean(&how.clone().by(choice("sharedpath")), kind);
        let own = mean(&How { seed: how.seed + 500, ..how.clone() }, kind);
        let brightest = own.map(|o| o.0).into_iter().fold(0.0, f64::max);
        for (c, (s, o)) in shared.iter().zip(&own).enumerate() {
            let error = (s.1 + o.1).sqrt();
            let z = (s.0 - o.0) / error.max(1e-9);
            eprintln!(
                "stripe {kind} channel {c}: {:.5} and {:.5}, z {z:.2}, would see {:.2} %",
                s.0,
                o.0,
                690.0 * error / brightest
            );
            assert!(z.abs() < 6.5, "stripe {kind} channel {c}: {} by shared paths, {} by others: z {z:.2}", s.0, o.0);
            assert!(6.9 * error <= power * brightest, "only {:.2} % would be seen", 690.0 * error / brightest);
        }
    }
}

/// A light source: an uneven sky of 16 by 16 pixels with a sun in it.
fn sunny() -> String {
    static FILE: OnceLock<String> = OnceLock::new();
    let file = FILE.get_or_init(|| {
        let image = irradiant::image::Image::from_fn(16, 16, ["R", "G", "B"], |x, y| match (x, y) {
            (3, 11) => [90.0, 80.0, 60.0],
            _ => [0, 1, 2].map(|c| ((x * 111 + y * 1776 + c * 37) % 101) as f32 / 100.0),
        });
        let path = std::env::temp_dir().join(format!("irradiant-shared-sky-{}.exr", std::process::id()));
        let bytes = irradiant::image::write(&image, irradiant::image::FileFormat::Exr).expect("writable");
        std::fs::write(&path, bytes).expect("a file");
        path.display().to_string().replace('\\', "/")
    });
    format!("LightSource \"infinite\" \"string filename\" \"{file}\" \"float scale\" 0.5\n")
}

/// Stripes of two materials as in [`striped`], outside, behind what hides parts of the sky.
fn striped_outside(a: &str, b: &str) -> String {
    let scene = film(8)
        + "LookAt 0 0 0  0 0 1  0 1 0\nCamera \"perspective\" \"float fov\" 45\nWorldBegin\n"
        + &sunny()
        + &diffuse(0.3, 0.5, 0.6)
        + &quad([[-0.7, 0.5, 0.3], [0.2, 0.5, 0.2], [0.1, 0.6, 0.8], [-0.8, 0.6, 0.8]])
        + &quad([[0.5, -1.0, 0.2], [0.5, 0.1, 0.3], [0.6, 0.2, 0.8], [0.6, -1.0, 0.8]]);
    scene + &stripes(a, b, 0.99)
}

#[test]
fn pixels_share_the_sky() {
    let uniform = "LightSource \"infinite\" \"rgb L\" [ .5 .6 .8 ]\n";
    let lit = all_sorts();
    let scene = lit.replace(uniform, &sunny());
    assert!(scene != lit);
    assert_shared_is_right(&scene, "sharedpath", How::new(48, 41), 0.03);
    assert_shared_is_right(&scene, "sharedpath sky=1 lights=2", How::new(48, 42).depth(2).spectral(), 0.05);
    // Lamps aside, by all ways to pick lights.
    for (words, seed) in [("sharedpath sky=32", 43), ("sharedpath lights=1 lightsampler=power", 44)] {
        assert_shared_is_right(&scene, words, How::new(48, seed).depth(1), 0.03);
    }
}

#[test]
fn unlike_pixels_share_the_sky() {
    let white = "Material \"diffuse\" \"rgb reflectance\" [ .8 .8 .8 ]\n";
    let metal = "Material \"conductor\" \"float uroughness\" 0.2 \"float vroughness\" 1 \"bool remaproughness\" false \"rgb reflectance\" [ .8 .8 .8 ]\n";
    assert_stripes_are_right(&striped_outside(metal, white), How::new(512, 51).depth(1), 0.015);
    let band = "Material \"diffuse\" \"spectrum reflectance\" [ 400 0 598 0 600 0.9 640 0.9 642 0 800 0 ]\n";
    assert_stripes_are_right(&striped_outside(band, white), How::new(512, 52).depth(1).spectral(), 0.03);
    let leaf = "Material \"diffusetransmission\" \"rgb reflectance\" [ .3 .2 .1 ] \"rgb transmittance\" [ .2 .5 .2 ]\n";
    assert_stripes_are_right(&striped_outside(leaf, white), How::new(512, 53).depth(1), 0.015);
}

/// A leaf that lets so little through that its BSDF never draws a direction behind it, and has the density 0 there. Light samples find it; the standard error is 0.8 %. Seen to
/// fail: black, when directions of density 0 were taken for such in which nothing is scattered.
#[test]
fn what_only_light_samples_find_is_shared() {
    let leaf =
        "Material \"diffusetransmission\" \"rgb reflectance\" [ .5 .5 .5 ] \"rgb transmittance\" [ 2e-8 2e-8 2e-8 ]\n";
    let room = cube([[0.0; 3]; 6]);
    // Without the wall behind, the sixth, which is the leaf.
    let walls: String = room.split("Material").take(6).skip(1).map(|wall| format!("Material{wall}")).collect();
    let scene = film(8)
        + "LookAt 0 0 -0.5  0 0 1  0 1 0\nCamera \"perspective\" \"float fov\" 45\nWorldBegin\n"
        + &sunny().replace("\"float scale\" 0.5", "\"float scale\" 5e7")
        + &walls
        + leaf
        + &quad([[-1.0, -1.0, 0.9], [1.0, -1.0, 0.9], [1.0, 1.0, 0.9], [-1.0, 1.0, 0.9]]);
    let mean = |words: &str| {
        let picture = estimate(&scene, How::new(4096, 71).depth(1).by(choice(words)));
        picture.mean.iter().flatten().sum::<f64>()
    };
    let (shared, own) = (mean("sharedpath"), mean("sharedpath sky=0"));
    eprintln!("{shared} with a shared sky, {own} without");
    assert!(own > 1.0 && (shared / own - 1.0).abs() < 0.06, "{shared} with a shared sky, {own} without");
}

#[test]
fn sharing_the_sky_takes_noise_away() {
    let scene = striped_outside(&diffuse(0.8, 0.8, 0.8), &diffuse(0.2, 0.4, 0.5));
    let noise = |words: &str| {
        let picture = estimate(&scene, How::new(64, 61).depth(1).by(choice(words)));
        picture.variance.iter().flatten().sum::<f64>()
    };
    let (shared, own) = (noise("sharedpath"), noise("sharedpath sky=0"));
    eprintln!("variance {:.2} of what it is with a sky of one's own", shared / own);
    assert!(shared < 0.5 * own, "variance {shared} with a shared sky, {own} without");
}

#[test]
fn pixels_whose_paths_fail_take_part_all_the_same() {
    let white = "Material \"diffuse\" \"rgb reflectance\" [ .8 .8 .8 ]\n";
    // Facets that draw directions below the surface three times in ten.
    let metal = "Material \"conductor\" \"float uroughness\" 0.2 \"float vroughness\" 1 \"bool remaproughness\" false \"rgb reflectance\" [ .8 .8 .8 ]\n";
    let plain = "Material \"diffuse\" \"rgb reflectance\" [ 0.8 0.8 0.8 ]";
    assert_stripes_are_right(&striped(metal, white, plain), How::new(128, 31).depth(2), 0.015);
    // Black at most wavelengths.
    let band = "Material \"diffuse\" \"spectrum reflectance\" [ 400 0 598 0 600 0.9 640 0.9 642 0 800 0 ]\n";
    assert_stripes_are_right(&striped(band, white, plain), How::new(128, 32).depth(2).spectral(), 0.03);
    // Of no use to the pixel that finds it.
    let red = "Material \"diffuse\" \"rgb reflectance\" [ .8 0 0 ]\n";
    let cyan =
        "Material \"conductor\" \"float roughness\" 1 \"bool remaproughness\" false \"rgb reflectance\" [ 0 .9 .9 ]";
    assert_stripes_are_right(&striped(red, white, cyan), How::new(128, 33).depth(3), 0.015);
}

/// A dispersive ball that walls and metal see, so that paths lose three of their wavelengths after what they share.
fn dispersive() -> String {
    let walls = [[0.7, 0.3, 0.2], [0.2, 0.6, 0.3], [0.7, 0.7, 0.7], [0.5, 0.5, 0.6], [0.6, 0.6, 0.6], [0.7, 0.7, 0.7]];
    film(16)
        + INSIDE
        + "WorldBegin\n"
        + &cube(walls)
        + "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 3 2 4 ] \"bool twosided\" true\n"
        + &quad([[-0.6, 0.7, -0.5], [0.6, 0.7, -0.5], [0.6, 0.6, 0.6], [-0.6, 0.6, 0.6]])
        + "AttributeEnd\nAttributeBegin\nMaterial \"dielectric\" \"spectrum eta\" [ 400 2.6 700 1.1 ]\nTranslate 0.3 -0.5 0.3\nShape \"sphere\" \"float radius\" 0.45\nAttributeEnd\n"
        + "AttributeBegin\nMaterial \"conductor\" \"float roughness\" 0.3\nTranslate -0.5 -0.6 0.3\nShape \"sphere\" \"float radius\" 0.35\nAttributeEnd\n"
}

#[test]
fn wavelengths_that_part_behind_a_second_vertex() {
    assert_shared_is_right(&dispersive(), "sharedpath", How::new(64, 21).depth(6).spectral(), 0.05);
}

#[test]
fn a_pixel_is_the_same_in_any_crop_and_has_less_noise() {
    let file = load_text("test", &diffuse_box(), ".").expect("a scene");
    let settings = How::new(16, 5).by(choice("sharedpath")).depth(5).settings();
    let whole = render(&file, &settings).expect("a picture");
    let part = Some([3.0, 10.0, 5.0, 14.0].map(|x| x / 16.0));
    let crop = render(&file, &RenderSettings { crop: part, ..settings }).expect("a picture");
    let bounds = crop.film.bounds();
    assert_eq!((bounds.x0, bounds.x1, bounds.y0, bounds.y1), (3, 10, 5, 14));
    for y in bounds.y0..bounds.y1 {
        for x in bounds.x0..bounds.x1 {
            assert_eq!(whole.film.pixel(x, y).mean(), crop.film.pixel(x, y).mean(), "pixel {x}, {y}");
        }
    }
    // All light is indirect where the lamp shines at the ceiling.
    let indirect =
        diffuse_box().replace("\"bool twosided\" true", "").replace("AreaLight", "ReverseOrientation\nAreaLight");
    let noise = |words: &str| {
        let picture = estimate(&indirect, How::new(64, 6).by(choice(words)));
        picture.variance.iter().flatten().sum::<f64>()
    };
    let (shared, own) = (noise("sharedpath"), noise("path"));
    eprintln!("variance {:.2} of path's", shared / own);
    assert!(shared < 0.3 * own, "variance {shared} by shared paths, {own} by others");
}

#[test]
fn mixes_that_hold_an_interface_are_refused() {
    let scene = film(4)
        + INSIDE
        + "WorldBegin\nMaterial \"diffuse\"\nMakeNamedMaterial \"a\" \"string type\" \"diffuse\"\nMakeNamedMaterial \"b\" \"string type\" \"interface\"\nMaterial \"mix\" \"string materials\" [ \"a\" \"b\" ] \"float amount\" 0.5\nShape \"sphere\"\nLightSource \"infinite\"\n";
    assert_refused(&scene);
}

#[test]
fn surfaces_forced_to_be_diffuse_are_refused() {
    // Their albedo goes by where they are seen from.
    assert_refused(&("Option \"bool forcediffuse\" true\n".to_string() + &diffuse_box()));
}

#[track_caller]
fn assert_refused(scene: &str) {
    let file = load_text("test", scene, ".").expect("a scene");
    let why = render(&file, &How::new(1, 1).by(choice("sharedpath")).settings()).err().expect("refused").to_string();
    assert!(why.contains("--integrator path"), "{why}");
}

/// Samples per pixel of pictures whose bits are compared.
const SAMPLES: u32 = 8;

/// The picture's sums and the counts; in batches, unless `alone`, and by work units of such widths and numbers of samples.
fn picture(
    job: &Job,
    integrator: &SharedPathIntegrator,
    alone: bool,
    width: i32,
    samples: u32,
) -> (FilmTile, RenderStats) {
    let scene = &job.scene;
    let whole = scene.bounds();
    let mut tile = FilmTile::new(whole, scene.new_film().channels_per_pixel());
    let mut stats = RenderStats::default();
    for x0 in (whole.x0..whole.x1).step_by(width as usize) {
        for first in (0..SAMPLES).step_by(samples as usize) {
            let bounds = PixelBounds { x0, x1: (x0 + width).min(whole.x1), ..whole };
            let unit = WorkUnit { bounds, samples: first..SAMPLES.min(first + samples) };
            if alone {
                integrator.render_alone(scene, &unit, &mut tile, &mut stats);
            } else {
                integrator.render(scene, &unit, &mut tile, &mut stats);
            }
        }
    }
    (tile, stats)
}

/// Compares batches with one path at a time, in RGB and with wavelengths, at every SIMD level.
fn assert_same_bits(text: &str, integrator: SharedPathIntegrator) {
    let text = text.replace("\"independent\"", "\"zsobol\"");
    for color in [ColorMode::Rgb, ColorMode::Spectral] {
        let file = load_text("scene", &text, ".").unwrap_or_else(|e| panic!("{e}"));
        let settings = RenderSettings { color, samples_per_pixel: Some(SAMPLES), ..RenderSettings::default() };
        let mut job = Job::new(&file, &settings).unwrap_or_else(|e| panic!("{e}"));
        let alone = picture(&job, &integrator, true, i32::MAX / 2, SAMPLES);
        assert!(integrator.max_depth == Some(0) || alone.1.shadow_rays > 500, "nothing to compare: {:?}", alone.1);
        for level in Level::available() {
            Arc::get_mut(&mut job.scene).expect("one owner").geometry.set_level(level);
            let batches = picture(&job, &integrator, false, i32::MAX / 2, SAMPLES);
            assert_eq!(alone.1, batches.1, "{level:?} {color:?} {integrator:?}\n{text}");
            assert!(alone.0 == batches.0, "pixels differ: {level:?} {color:?} {integrator:?}\n{text}");
        }
        // Units that cut through blocks, and samples in two parts.
        let parts = picture(&job, &integrator, false, 6, 5);
        assert!(alone.0 == parts.0, "pixels differ by units: {color:?} {integrator:?}\n{text}");
    }
}

/// So many light samples at the first surface.
fn lights(light_splits: u32) -> SharedPathIntegrator {
    SharedPathIntegrator { max_depth: None, light_splits, sky_tests: 4 }
}

/// A rectangle of two flat triangles, whose normals point to where its corners go round against the clock.
fn flat(corners: [[f32; 3]; 4]) -> String {
    let points = corners.concat().iter().map(f32::to_string).collect::<Vec<_>>().join(" ");
    format!("Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 ] \"point3 P\" [ {points} ]\n")
}

/// Flat walls, some of metal, between which stripes hang, under some lamps; what else is there is `things`.
fn flat_room(head: &str, lamps: usize, things: &str) -> String {
    let metal = |alpha: f32| {
        format!(
            "Material \"conductor\" \"float roughness\" {alpha} \"bool remaproughness\" false \"rgb reflectance\" [ .9 .7 .4 ]\n"
        )
    };
    let mut text = film(19)
        + "LookAt 0 1 -3.4  0 1 0  0 1 0\nCamera \"perspective\" \"float fov\" 44\nWorldBegin\n"
        + head
        + &diffuse(0.7, 0.7, 0.6)
        + &flat([[-1., 0., -1.], [-1., 0., 1.], [1., 0., 1.], [1., 0., -1.]])
        + &flat([[-1., 2., -1.], [1., 2., -1.], [1., 2., 1.], [-1., 2., 1.]])
        + &metal(0.3)
        + &flat([[-1., 0., 1.], [-1., 2., 1.], [1., 2., 1.], [1., 0., 1.]])
        + &diffuse(0.6, 0.0, 0.05)
        + &flat([[-1., 0., -1.], [-1., 2., -1.], [-1., 2., 1.], [-1., 0., 1.]])
        + &metal(0.02)
        + &flat([[1., 0., -1.], [1., 0., 1.], [1., 2., 1.], [1., 2., -1.]]);
    for i in 0..7 {
        let (x, z) = (-0.9 + 0.26 * i as f32, 0.5 + 0.05 * i as f32);
        text += &if i % 2 == 0 { metal(0.1) } else { diffuse(0.1, 0.4, 0.6) };
        text += &flat([[x, 0.2, z], [x + 0.2, 0.2, z], [x + 0.2, 1.1, z], [x, 1.1, z]]);
    }
    text += "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\n";
    for i in 0..lamps {
        let (x, y) = (-0.8 + 1.6 * (i as f32 + 0.5) / lamps as f32, 1.98 - 0.07 * i as f32);
        text += &format!("AreaLightSource \"diffuse\" \"rgb L\" [ {} 9 {} ]\n", 4 + 3 * i, 12 - i);
        text += &flat([[x - 0.1, y, -0.2], [x + 0.1, y, -0.2], [x + 0.1, y, 0.2], [x - 0.1, y, 0.2]]);
    }
    text + "AttributeEnd\n" + things
}

#[test]
fn batches_of_flat_walls_and_metals() {
    let room = flat_room("", 1, "");
    assert_same_bits(&room, lights(8));
    for depth in 0..4 {
        assert_same_bits(&room, SharedPathIntegrator { max_depth: Some(depth), ..lights(1) });
    }
}

#[test]
fn batches_under_several_lamps() {
    // One stratum, too few, enough.
    for splits in [1, 4, 8] {
        assert_same_bits(&flat_room("", 6, ""), lights(splits));
    }
    let others = "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 5 5 5 ]\nTranslate -0.5 1.2 0.3\nShape \"sphere\" \"float radius\" 0.1\nAttributeEnd\nLightSource \"point\" \"rgb I\" [ .3 .2 .2 ] \"point3 from\" [ 0 1 -.5 ]\n";
    let sky = "LightSource \"infinite\" \"rgb L\" [ .5 .6 .7 ]\n";
    assert_same_bits(&flat_room(sky, 2, others), lights(8));
    assert_same_bits(&flat_room(sky, 2, others), lights(3));
}

#[test]
fn batches_under_a_shared_sky() {
    let uniform = "LightSource \"infinite\" \"rgb L\" [ .5 .6 .8 ]\n";
    for splits in [1, 3, 8] {
        assert_same_bits(&flat_room(&sunny(), 2, ""), lights(splits));
        assert_same_bits(&all_sorts().replace(uniform, &sunny()), lights(splits));
    }
    let white = "Material \"diffuse\" \"rgb reflectance\" [ .8 .8 .8 ]\n";
    let leaf = "Material \"diffusetransmission\" \"rgb reflectance\" [ .3 .2 .1 ] \"rgb transmittance\" [ .2 .5 .2 ]\n";
    let band = "Material \"diffuse\" \"spectrum reflectance\" [ 400 0 598 0 600 0.9 640 0.9 642 0 800 0 ]\n";
    for sky_tests in [0, 1, 5, 32] {
        let integrator = SharedPathIntegrator { sky_tests, max_depth: Some(2), ..lights(8) };
        assert_same_bits(&striped_outside(leaf, white), integrator);
        assert_same_bits(&striped_outside(band, white), integrator);
        assert_same_bits(&(flat_room(&sunny(), 0, "")), integrator);
    }
}

#[test]
fn batches_of_all_sorts() {
    assert_same_bits(&all_sorts(), lights(8));
    assert_same_bits(&diffuse_box(), lights(8));
    assert_same_bits(&dispersive(), SharedPathIntegrator { max_depth: Some(6), ..lights(8) });
    let white = "Material \"diffuse\" \"rgb reflectance\" [ .8 .8 .8 ]\n";
    let band = "Material \"diffuse\" \"spectrum reflectance\" [ 400 0 598 0 600 0.9 640 0.9 642 0 800 0 ]\n";
    let metal = "Material \"conductor\" \"float uroughness\" 0.2 \"float vroughness\" 1 \"bool remaproughness\" false \"rgb reflectance\" [ .8 0 .8 ]";
    assert_same_bits(&striped(band, white, metal), lights(8));
}

#[test]
fn batches_of_textures_mixes_and_things_that_move() {
    let things = "Texture \"check\" \"spectrum\" \"checkerboard\" \"float uscale\" 8 \"float vscale\" 8 \"rgb tex1\" [ .8 .7 .1 ] \"rgb tex2\" [ .1 .1 .3 ]\nTexture \"rough\" \"float\" \"checkerboard\" \"float uscale\" 5 \"float tex1\" 0.1 \"float tex2\" 0.5\nMakeNamedMaterial \"a\" \"string type\" \"diffuse\" \"texture reflectance\" \"check\"\nMakeNamedMaterial \"b\" \"string type\" \"conductor\" \"texture roughness\" \"rough\" \"spectrum eta\" \"metal-Cu-eta\" \"spectrum k\" \"metal-Cu-k\"\nMaterial \"mix\" \"string materials\" [ \"a\" \"b\" ] \"float amount\" 0.4\nAttributeBegin\nTranslate -0.4 0.5 -0.2\nShape \"sphere\" \"float radius\" 0.4\nAttributeEnd\nNamedMaterial \"a\"\nShape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ -.8 .1 .4  .2 .1 .3  -.4 1.9 .4 ] \"point2 uv\" [ 0 0 1 0 0 1 ]\nObjectBegin \"thing\"\nMaterial \"diffusetransmission\" \"rgb reflectance\" [ .3 .2 .1 ] \"rgb transmittance\" [ .2 .5 .2 ]\nShape \"trianglemesh\" \"float alpha\" 0.7 \"integer indices\" [ 0 1 2 ] \"point3 P\" [ -.3 0 0  .3 0 0  0 .9 .2 ]\nObjectEnd\nAttributeBegin\nTranslate 0.4 0.3 -0.3\nActiveTransform EndTime\nTranslate 0.3 0.3 0\nActiveTransform All\nObjectInstance \"thing\"\nAttributeEnd\nAttributeBegin\nMaterial \"dielectric\"\nTranslate 0.5 0.4 -0.4\nShape \"sphere\" \"float radius\" 0.3\nAttributeEnd\n";
    assert_same_bits(&flat_room("", 2, things), lights(8));
}
