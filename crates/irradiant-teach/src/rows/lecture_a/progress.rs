//! Samples, speed, hard scenes, and the whole progression (A08, A56, A57, A69 to A73).

use super::super::hard_paths;
use super::super::shared::{cornell_by_bounce, strip};
use crate::context::{Budget, Context, Setup};
use crate::estimate::{Estimate, Estimator, Production, whole};
use crate::radiosity;
use crate::row::{Outcome, Row};
use crate::scenes::{self, film, quad};
use crate::sheet::{Sheet, number};
use crate::walk::Walk;
use cpu_time::ProcessTime;
use irradiant::Error;
use irradiant::math::{Point3, Ray, Vec3};
use irradiant::renderer::camera_samples::camera_sample;
use irradiant::spectrum::Wavelengths;
use irradiant_testkit::{Mean, Rng};

/// A08, A56, A57, A69 to A73.
pub const ROWS: &[Row] = &[
    Row {
        id: "A08",
        name: "Cornell box: photograph against rendering",
        says: "A rendering with global illumination matches a calibrated photograph.",
        check: "Mean radiance of each wall at 450, 550 and 650 nm against a second renderer (radiosity, written from the scene's text alone, with the same measured spectra).",
        run: cornell_walls,
    },
    Row {
        id: "A56",
        name: "One, 32, 1024 samples per pixel",
        says: "Noise falls.",
        check: "RMSE at 1, 32 and 1024 independent samples: ratios 5.66 and 32, within 5 %.",
        run: samples,
    },
    Row {
        id: "A57",
        name: "Summary of intuition on G.I. and P.T.",
        says: "Sum bounces, trace paths, end them by roulette, sample well.",
        check: "The rows that say so.",
        run: |c| Ok(c.inherit(&["A39", "A46", "A23", "B29"])),
    },
    Row {
        id: "A69",
        name: "Good scenes for path tracing: diffuse, sky lighting",
        says: "Path tracing does well there.",
        check: "A sky-lit diffuse scene reaches 1 % relative RMSE within 1024 samples.",
        run: sky_lit,
    },
    Row {
        id: "A70",
        name: "Arnold street scene",
        says: "1536 x 654, 16 paths a pixel, 2 bounces, 250,000 faces: 18 minutes on two Pentium III 800.",
        check: "A street of as many faces with the same settings: CPU seconds over two cores; the goal is 6 s (180 times as fast). A machine that does not meet it is slow; nothing is wrong then.",
        run: street,
    },
    Row {
        id: "A71",
        name: "A challenging scene, 1000 paths a pixel: why?",
        says: "Caustics are nearly unsampleable.",
        check: "A caustic-aware mode against the path tracer, which has at least 1.5 times its CPU seconds and still a larger error, each pixel's counted 1 at most; and the light that no light sample finds.",
        run: hard_paths::challenging,
    },
    Row {
        id: "A72",
        name: "Things to remember",
        says: "Recursion, equations, the series, roulette, partition, importance sampling.",
        check: "The rows that say so.",
        run: |c| Ok(c.inherit(&["A31", "A35", "A46", "A53", "A23"])),
    },
    Row {
        id: "A73",
        name: "Code progression",
        says: "Try 1, try 2, path tracing.",
        check: "The three on one scene with their noise and bias: try 1 lacks what its safety stop cuts, the other two have no bias, and each step is much less noisy.",
        run: progression,
    },
];

fn cornell_walls(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let text = scenes::CORNELL_BOX;
    let quads = radiosity::quads(text, [278.0, 274.0, 280.0]);
    if quads.len() != 16 {
        return Ok(Outcome::fails(format!("{} quadrilaterals in the Cornell box, not 16", quads.len())));
    }
    let exchange = radiosity::exchange(&quads, c.spp(200), c.seed());
    let scene = c.scene("cornell-box", &scenes::cornell(), Setup { spectral: true, ..Setup::square(16, 1) })?;
    let to_render = scene.world_from_render().inverse();
    let place = |v: [f64; 3], w: f64| -> [f32; 3] {
        std::array::from_fn(|r| {
            (to_render.m[r][0] * v[0] + to_render.m[r][1] * v[1] + to_render.m[r][2] * v[2] + w * to_render.m[r][3])
                as f32
        })
    };
    let mut lambda = Wavelengths::sample_uniform(0.5, 400.0, 700.0);
    lambda.lambda = [450.0, 550.0, 650.0, 600.0];
    let lamp = scene.lights.get(irradiant::core::interaction::LightId(0));
    // Along the lamp's own normal, whichever way the compiled mesh faces.
    let down = Vec3::new(0.0, -1.0, 0.0);
    let normal = irradiant::math::Normal3::new(0.0, -1.0, 0.0);
    let le = lamp.emitted(normal, irradiant::math::Point2::new(0.5, 0.5), down, &lambda);
    let production = Production::default();
    let names = [
        "lamp",
        "floor",
        "ceiling",
        "back wall",
        "right wall (green)",
        "left wall (red)",
        "short block's top",
        "",
        "",
        "",
        "",
        "tall block's top",
    ];
    let mut rng = Rng::new(c.seed());
    for (i, name) in names.iter().enumerate().skip(1).filter(|(_, n)| !n.is_empty()) {
        let quad = &quads[i];
        let mut means = [Mean::new(); 3];
        for k in 0..c.spp(20_000) {
            let p = radiosity::point_on(quad, &mut rng);
            let o = place(std::array::from_fn(|a| p[a] + 0.4 * quad.n[a]), 1.0);
            let d = place(quad.n.map(|x| -x), 0.0);
            let Some(mut bearer) = camera_sample(&scene, [0, 0], 0).camera_ray else { continue };
            bearer.ray = Ray::new(Point3::new(o[0], o[1], o[2]), Vec3::new(d[0], d[1], d[2]).normalize(), 0.0);
            let stream = scene.sampler.stream([i as i32, 3], k);
            let (mut own, mut stats) = (lambda, Default::default());
            let l = production.sample(&scene, &bearer, &stream, &mut own, &mut stats, &mut |_| {});
            (0..3).for_each(|w| means[w].add(f64::from(l[w])));
        }
        for (w, nm) in [450.0, 550.0, 650.0].into_iter().enumerate() {
            let emission: Vec<f64> =
                quads.iter().map(|q| if q.material == "lamp" { f64::from(le[w]) } else { 0.0 }).collect();
            let reflect: Vec<f64> =
                quads.iter().map(|q| radiosity::reflectance(text, &q.material, nm).unwrap_or(0.78)).collect();
            let expected = exchange.solve(&emission, &reflect)[i];
            let (mean, se) = (means[w].mean(), means[w].standard_error());
            let allowed = 0.02 * expected + 4.9 * se;
            sheet.holds(
                &format!("{name} at {nm} nm, over the lamp's radiance"),
                format!(
                    "{} and {} by radiosity: {:+.2} %",
                    number(mean / f64::from(le[w])),
                    number(expected / f64::from(le[w])),
                    100.0 * (mean / expected - 1.0)
                ),
                "2 % (radiosity's cells and rays) and 4.9 standard errors",
                &format!("{:.1} %", 100.0 * (allowed + 2.0 * se) / expected),
                (mean - expected).abs() <= allowed && se < 0.02 * expected,
            );
        }
    }
    sheet.note("Cornell's calibrated CCD pictures (seven filter bands), the filters' transmission and the camera's response could not be had here: they are on Cornell's site, not in any package registry. The comparison is with a second renderer instead, which shares nothing but the measured geometry and spectra. Per-wall figures for the measured box are, as far as we know, published only as those pictures.");
    Ok(sheet.finish())
}

fn samples(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    // One value for all pixels, known in closed form: E / (2 pi) under a disk lamp.
    let expected = 5.0 / 1.49 * 0.5;
    let text = scenes::at_the_origin(32, 0.4, &scenes::disk_light(1.0, 0.7, 5.0));
    let error = |spp: u32, repeats: u32| -> Result<f64, Error> {
        let mut square = Mean::new();
        for _ in 0..repeats {
            let scene = c.scene("disk-lamp", &text, Setup::square(32, spp))?;
            let e = whole(&scene, &Production::limited(1), spp);
            e.mean.iter().for_each(|p| square.add((p[1] - expected).powi(2)));
        }
        Ok(square.mean().sqrt())
    };
    let errors = [error(1, 8)?, error(32, 4)?, error(1024, 2)?];
    sheet.close("RMSE at 1 over RMSE at 32 samples (root of 32)", errors[0] / errors[1], 32f64.sqrt(), 0.05);
    sheet.close("RMSE at 1 over RMSE at 1024 samples", errors[0] / errors[2], 32.0, 0.05);
    let side = c.side(112);
    let mut images = vec![];
    for spp in [1, 32, c.spp(128).min(1024)] {
        images.push(
            c.render("cornell-box-smooth", scenes::CORNELL_BOX, Setup { spectral: true, ..Setup::square(side, spp) })?
                .image(),
        );
    }
    sheet.picture(
        "A56-samples",
        &format!("1, 32 and {} samples a pixel.", c.spp(128).min(1024)),
        &strip(&images.iter().collect::<Vec<_>>()),
        0.0,
    );
    sheet.command(c.command("cornell-box-smooth", "--spp 1024"));
    Ok(sheet.finish())
}

fn sky_lit(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let mut text = film(24)
        + "LookAt 0 4 -7  0 0.4 0  0 1 0\nCamera \"perspective\" \"float fov\" 35\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ .6 .75 1 ]\nMaterial \"diffuse\" \"rgb reflectance\" [ .6 .58 .55 ]\n"
        + &quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]]);
    for (x, z, r) in [(-1.6, 0.0, 0.8), (0.2, 0.9, 0.9), (1.7, -0.6, 0.6), (0.0, -1.4, 0.4)] {
        text +=
            &format!("AttributeBegin\nTranslate {x} {r} {z}\nShape \"sphere\" \"float radius\" {r}\nAttributeEnd\n");
    }
    let run = |sampler: &str, spp: u32| -> Result<f64, Error> {
        let text = text.replace("\"independent\"", sampler);
        let run = || -> Result<Estimate, Error> {
            Ok(whole(&*c.scene("sky-lit", &text, Setup::square(24, spp))?, &Production::limited(5), spp))
        };
        Ok(run()?.rmse(&run()?) / 2f64.sqrt())
    };
    let (random, smooth) = (run("\"independent\"", 1024)?, run("\"zsobol\"", 1024)?);
    sheet.at_most("relative RMSE at 1024 stratified samples, %", 100.0 * smooth, 1.0);
    sheet.at_most("stratified over independent samples", smooth / random, 0.9);
    sheet.note(format!("Independent samples need {} for 1 %.", (1024.0 * (random / 0.01).powi(2)).round()));
    let picture = c.render(
        "sky-lit-smooth",
        &text.replace("\"independent\"", "\"zsobol\""),
        Setup { spectral: true, ..Setup::square(c.side(128), 64) },
    )?;
    sheet.picture("A69-sky", "Diffuse things under a sky: 64 samples.", &picture.image(), 0.0);
    sheet.command(c.command("sky-lit-smooth", "--spp 64"));
    Ok(sheet.finish())
}

/// A street of boxes: 250,000 faces in one mesh, under a sky.
fn street_scene() -> String {
    let mut rng = Rng::new(11);
    let (mut points, mut indices) = (String::new(), String::new());
    let mut boxes = 0;
    let mut add = |x0: f64, y0: f64, z0: f64, x1: f64, y1: f64, z1: f64| {
        for i in 0..8 {
            let pick = |bit: usize, a: f64, b: f64| if i >> bit & 1 == 1 { b } else { a };
            points += &format!("{:.3} {:.3} {:.3} ", pick(0, x0, x1), pick(1, y0, y1), pick(2, z0, z1));
        }
        let base = 8 * boxes;
        for q in [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]] {
            let q = q.map(|i| i + base);
            indices += &format!("{} {} {} {} {} {} ", q[0], q[1], q[2], q[2], q[3], q[0]);
        }
        boxes += 1;
    };
    // Two rows of houses whose fronts are made of stones, sills and railings.
    for side in [-1.0, 1.0f64] {
        for house in 0..24 {
            let z0 = 6.0 * f64::from(house);
            let height = 9.0 + 6.0 * rng.next_f64();
            let (a, b) = (side * 5.0, side * 11.0);
            add(a.min(b), 0.0, z0, a.max(b), height, z0 + 5.6);
            for _ in 0..433 {
                let (y, z) = (height * rng.next_f64(), z0 + 5.6 * rng.next_f64());
                let (w, h, out) =
                    (0.1 + 0.5 * rng.next_f64(), 0.05 + 0.3 * rng.next_f64(), 0.03 + 0.3 * rng.next_f64());
                let (p, q) = (side * 5.0, side * (5.0 - out));
                add(p.min(q), y, z, p.max(q), y + h, z + w);
            }
        }
    }
    format!(
        "Film \"rgb\" \"integer xresolution\" 1536 \"integer yresolution\" 654\nPixelFilter \"box\"\nSampler \"zsobol\" \"integer pixelsamples\" 16\nIntegrator \"path\" \"integer maxdepth\" 2\nLookAt 0.5 1.7 -4  0 3.2 30  0 1 0\nCamera \"perspective\" \"float fov\" 42\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ .6 .75 1 ]\nMaterial \"diffuse\" \"rgb reflectance\" [ .62 .58 .52 ]\nShape \"trianglemesh\" \"integer indices\" [ {indices}] \"point3 P\" [ {points}]\nMaterial \"diffuse\" \"rgb reflectance\" [ .35 .35 .36 ]\n{}",
        quad([[-60.0, 0.0, -20.0], [60.0, 0.0, -20.0], [60.0, 0.0, 180.0], [-60.0, 0.0, 180.0]])
    )
}

fn street(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let text = street_scene();
    let spp = match c.budget() {
        Budget::Quick => 2,
        Budget::Full => 16,
    };
    let setup = Setup { spp: Some(spp), spectral: true, max_depth: Some(2), ..Setup::default() };
    let scene = c.scene("street", &text, setup)?;
    let faces = scene.geometry.n_primitives().0;
    sheet.between("triangles", faces as f64, [245_000.0, 255_000.0]);
    drop(scene);
    // All threads; the clock of the whole process, since nothing else runs in it now.
    let file = c.file("street", &text)?;
    let settings = irradiant::RenderSettings {
        samples_per_pixel: Some(spp),
        max_depth: Some(irradiant::MaxDepth::Limit(2)),
        ..Default::default()
    };
    let job = irradiant::Job::new(&file, &settings)?;
    let start = ProcessTime::now();
    let done = job.start().wait();
    let cpu = start.elapsed().as_secs_f64();
    let picture = job.rendering(done.film, done.stats);
    let paths = picture.stats.paths as f64;
    let seconds = cpu / 2.0 * 16_074_240.0 / paths;
    sheet.seconds_at_most("seconds on two cores (CPU seconds over two) for 16 paths a pixel", seconds, 6.0);
    sheet.note(format!(
        "{} paths in {:.2} CPU seconds: {:.0} thousand paths and {:.0} thousand rays a second and core. The lecture's figure is 14.9 thousand paths a second on two cores of 0.8 GHz.",
        picture.stats.paths,
        cpu,
        paths / cpu / 1e3,
        (picture.stats.camera_rays + picture.stats.bounce_rays + picture.stats.shadow_rays) as f64 / cpu / 1e3
    ));
    let small = picture.image().resized_for_show();
    sheet.picture(
        "A70-street",
        &format!("250,000 faces under a sky, {spp} paths a pixel, 2 bounces (shown at a third of its size)."),
        &small,
        0.0,
    );
    sheet.command(c.command("street", "--stats stats.json"));
    Ok(sheet.finish())
}

/// A third of a picture's size, by averages of 3 by 3 pixels.
trait ForShow {
    fn resized_for_show(&self) -> irradiant::image::Image;
}

impl ForShow for irradiant::image::Image {
    fn resized_for_show(&self) -> irradiant::image::Image {
        Self::from_fn(self.width() / 3, self.height() / 3, ["R", "G", "B"], |x, y| {
            std::array::from_fn(|c| (0..9).map(|i| self.get(3 * x + i % 3, 3 * y + i / 3, c)).sum::<f32>() / 9.0)
        })
    }
}

fn progression(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let reference = &cornell_by_bounce(c)?.whole;
    let spp = c.spp(256);
    let side = c.side(64);
    let run = |e: &dyn Estimator, spp: u32| -> Result<Estimate, Error> {
        Ok(whole(&*c.scene("cornell-box", &scenes::cornell(), Setup::square(side, spp))?, e, spp))
    };
    let stop = 4;
    let one = run(&Walk::TRY_1.depth(stop), spp)?;
    let two = run(&Walk::TRY_2, spp)?;
    let path = run(&Walk::PATH, spp / 4)?;
    let box_ = cornell_by_bounce(c)?;
    let cut = box_.terms[stop as usize + 1..].iter().fold(box_.beyond.clone(), |a, b| a.plus(1.0, b));
    sheet.agree(
        "try 1 to its safety stop at 4, and the picture less what that cuts",
        &one.plus(1.0, &cut),
        reference,
        0.1,
    );
    sheet.agree("try 2 and the reference", &two, reference, 0.1);
    sheet.agree("path tracing and the reference", &path, reference, 0.1);
    sheet.at_least(
        "variance of a sample: try 2 over path tracing",
        two.sample_variance() / path.sample_variance(),
        3.0,
    );
    let picture = |e: &dyn Estimator| -> Result<_, Error> {
        let side = c.side(112);
        Ok(whole(&*c.scene("cornell-box", &scenes::cornell(), Setup::square(side, 32))?, e, 32).image())
    };
    let images = [picture(&Walk::TRY_1.depth(stop))?, picture(&Walk::TRY_2)?, picture(&Walk::PATH)?];
    let noise = |e: &Estimate| number(e.sample_variance().sqrt() / e.grey());
    let caption = format!(
        "32 samples each. Try 1: noise (standard deviation of a sample over the mean) {}, bias {:+.1} % from its safety stop. Try 2: noise {}, no bias. Path tracing: noise {}, no bias.",
        noise(&one),
        -100.0 * cut.grey() / reference.grey(),
        noise(&two),
        noise(&path)
    );
    sheet.picture("A73-progression", &caption, &strip(&images.iter().collect::<Vec<_>>()), 0.0);
    for name in ["try1", "try2", "partitioned"] {
        sheet.command(c.command("cornell-box", &format!("--integrator {name} --spp 32")));
    }
    Ok(sheet.finish())
}
