//! Linear operators, K = R o T, the Neumann series and its pictures (A32 to A40).

use super::super::shared::{cornell_by_bounce, strip};
use crate::context::{Context, Setup};
use crate::estimate::{Estimate, Estimator, Part, Production, along, take_apart, whole};
use crate::row::{Outcome, Row};
use crate::scenes::{self, at_the_origin, furnace_room, furnace_with};
use crate::sheet::{Sheet, number};
use crate::walk::{Walk, Wrong};
use irradiant::Error;
use irradiant::core::bxdf::{Sides, TransportMode};
use irradiant::core::film::exact::ExactSum;
use irradiant::core::scene::Scene;
use irradiant::math::Point2;
use irradiant::renderer::camera_samples::camera_sample;
use irradiant::renderer::path::Roulette as PathRoulette;
use irradiant_testkit::{Mean, Rng};

/// A32 to A40.
pub const ROWS: &[Row] = &[
    Row {
        id: "A32",
        name: "Linear operators",
        says: "L(a f + b g) = a L(f) + b L(g).",
        check: "Twice the light is twice the picture, bit by bit; the pictures of two lights add up to the picture of both.",
        run: linear,
    },
    Row {
        id: "A33",
        name: "Operators R and T",
        says: "R(Li) = Lo, T(Lo) = Li.",
        check: "Two parallel planes: T finds the other plane's radiance, R sums it up; against the form factor of a rectangle.",
        run: form_factor,
    },
    Row {
        id: "A34",
        name: "K = R o T",
        says: "One bounce as one operator: L = Le + K(L).",
        check: "K applied once more, by gathering stored values of K(Le) at 4000 points around, against the two-bounce term of a path tracer.",
        run: k_twice,
    },
    Row {
        id: "A35",
        name: "Neumann series, ||K|| < 1",
        says: "I + K + K^2 + ... converges, because energy dissipates.",
        check: "In a furnace K^i(Le) = rho^i Le for i = 0..10, each term within 0.1 % of itself (quick: 2 %), with light samples, weights and roulette; the Cornell box's terms shrink at a steady rate; lossless glass leaves a furnace's light as it is.",
        run: neumann,
    },
    Row {
        id: "A36",
        name: "Formal solution, check",
        says: "(I - K)(I + K + K^2 + ...) = I.",
        check: "The sum of the first terms minus K of it is Le - K^(m+1)(Le), by an independent gather.",
        run: formal_check,
    },
    Row {
        id: "A37",
        name: "L = Le + K(Le) + K^2(Le) + ...",
        says: "Emitted, one bounce, two bounces, ...",
        check: "What each path tells of its bounces adds up to the sample, in the film's own exact sums.",
        run: additivity,
    },
    Row {
        id: "A38",
        name: "Seven pictures K^i(Le)",
        says: "Light after exactly i bounces.",
        check: "Seven pictures of one run, each against the difference of two depth-limited renders.",
        run: k_images,
    },
    Row {
        id: "A39",
        name: "Seven partial sums",
        says: "The sum of the first m terms.",
        check: "Partial sums of one run against renders with a depth limit.",
        run: partial_sums,
    },
    Row {
        id: "A40",
        name: "Direct, one, two, four, eight, sixteen bounces",
        says: "Brighter in the shadows, then saturated.",
        check: "Pictures at these depths from one run; each step brightens less; what is left beyond 16 bounces is bounded by the fitted ratio.",
        run: saturation,
    },
];

fn linear(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let scene = |l: f32| {
        scenes::white_sky(8, "Material \"diffuse\" \"rgb reflectance\" [ .7 .2 .4 ]\nShape \"sphere\"\n")
            .replace("[ 1 1 1 ]", &format!("[ {l} {l} {l} ]"))
    };
    let seeded = |text: &str| -> Result<Estimate, Error> {
        let file = c.file("sky-ball", text)?;
        let settings =
            irradiant::RenderSettings { seed: Some(3), color: irradiant::ColorMode::Rgb, ..Default::default() };
        Ok(whole(&irradiant::Job::new(&file, &settings)?.scene, &*c.production(None), 16))
    };
    let (one, two) = (seeded(&scene(1.0))?, seeded(&scene(2.0))?);
    let wrong: Vec<String> =
        (0..64).filter(|&i| one.mean[i].map(|x| 2.0 * x) != two.mean[i]).map(|i| format!("pixel {i}")).collect();
    sheet.none_of("pixels that are not doubled exactly when the light is", 64, &wrong);
    // Two lights, with bounces; the lamp's body is there in each picture.
    let lit = |lights: &str| {
        scenes::film(8)
            + "LookAt 0 2 -4  0 0.3 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\nWorldBegin\n"
            + lights
            + "Material \"diffuse\" \"rgb reflectance\" [ .8 .6 .5 ]\n"
            + &scenes::quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]])
            + "Translate 0 0.6 0\nShape \"sphere\" \"float radius\" 0.6\n"
    };
    let sun = "LightSource \"distant\" \"rgb L\" [ 1 2 3 ] \"point3 from\" [ 1 2 -1 ]\n";
    let body = "AttributeBegin\nTranslate -1 1.5 0\nShape \"sphere\" \"float radius\" 0.4\nAttributeEnd\n";
    let lamp = body.replace("Translate", "AreaLightSource \"diffuse\" \"rgb L\" [ 9 5 2 ]\nTranslate");
    let spp = c.spp(2048);
    let run = |lights: &str| -> Result<Estimate, Error> {
        Ok(whole(&*c.scene("two-lights", &lit(lights), Setup::square(8, spp))?, &*c.production(Some(4)), spp))
    };
    let (a, b, both) = (run(&format!("{sun}{body}"))?, run(&lamp)?, run(&format!("{sun}{lamp}"))?);
    sheet.agree("pictures of a sun and a lamp against the picture of both", &a.plus(1.0, &b), &both, 0.04);
    Ok(sheet.finish())
}

fn form_factor(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    // Rectangle a by b at height h with a corner over the origin (Howell's C-11).
    let (a, b, h) = (0.8f64, 1.3f64, 0.9f64);
    let corner = {
        let (x, y) = (a / h, b / h);
        let (rx, ry) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        (x / rx * (y / rx).atan() + y / ry * (x / ry).atan()) / (2.0 * std::f64::consts::PI)
    };
    let lamp = |x0: f32, z0: f32| {
        let points = [[x0, 0.9, z0], [0.8, 0.9, z0], [0.8, 0.9, 1.3], [x0, 0.9, 1.3]];
        format!(
            "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" \"rgb L\" [ 4 4 4 ] \"bool twosided\" true\n{}AttributeEnd\n",
            scenes::quad(points)
        )
    };
    let spp = c.spp(4096);
    for (name, x0, z0, factor) in [("four corners", -0.8, -1.3, 4.0 * corner), ("one corner", 0.0, 0.0, corner)] {
        let text = at_the_origin(2, 0.5, &lamp(x0, z0));
        for (how, estimator) in [
            ("light samples", &Walk::PATH),
            ("directions (T by rays)", &Walk { roulette: crate::walk::Roulette::None, ..Walk::TRY_1 }),
        ] {
            let spp = if how == "light samples" { spp } else { 4 * spp };
            let e = whole(&*c.scene("rectangle-lamp", &text, Setup::square(2, spp))?, &estimator.depth(1), spp);
            sheet.is(&format!("{name}, {how}: L F rho"), &e, 4.0 * factor * 0.5, 0.1);
        }
    }
    Ok(sheet.finish())
}

/// K of what `estimator` says, at what the camera ray of pixel (0, 0) sees: by bounces, slot i holding K applied to the
/// (i - 1)-bounce part.
fn gather(scene: &Scene, estimator: &dyn Estimator, n: u32, bounces: usize, rng: &mut Rng) -> Vec<Mean> {
    let mut means = vec![Mean::new(); bounces + 1];
    let stream = scene.sampler.stream([0, 0], 0);
    let Some(camera_ray) = camera_sample(scene, [0, 0], 0).camera_ray else { return means };
    let Some(hit) = scene.geometry.intersect(&camera_ray.ray, f32::INFINITY, &scene.alpha()) else { return means };
    let at = scene.geometry.interaction(&camera_ray.ray, &hit);
    let mut lambda = scene.sample_wavelengths(0.5);
    let context = scene.texture_context(&at, None);
    let Some(bsdf) = scene.materials.bsdf(at.material, &scene.textures, &at, &context, &mut lambda, stream.mix(0))
    else {
        return means;
    };
    for i in 0..n {
        let mut slots = vec![0.0; bounces];
        let u = Point2::new(rng.next_f32(), rng.next_f32());
        let mut weight = 0.0;
        if let Some(s) = bsdf.sample(at.wo, rng.next_f32(), u, TransportMode::Radiance, Sides::All) {
            along(scene, estimator, at.spawn_ray(s.wi), i, &mut slots);
            weight = f64::from(s.f[1] * bsdf.abs_cos(s.wi) / s.pdf);
        }
        for (mean, l) in means[1..].iter_mut().zip(&slots) {
            mean.add(weight * l);
        }
    }
    means
}

fn one_point(text: &str) -> String {
    // All pixels see one point: the camera's field is closed to nearly nothing.
    text.replace("\"float fov\" 70", "\"float fov\" 0.001").replace("0 -0.1 0  0 1 0", "0.1 -0.4 0.9  0 1 0")
}

/// The terms at one point by the production estimator.
fn terms(c: &Context, scene: &Scene, n: u32, bounces: usize) -> Vec<Mean> {
    let production = c.production(None);
    let mut means = vec![Mean::new(); bounces];
    let Some(ray) = camera_sample(scene, [0, 0], 0).camera_ray else { return means };
    for i in 0..n {
        let mut slots = vec![0.0; bounces];
        along(scene, &*production, ray.ray, i, &mut slots);
        means.iter_mut().zip(&slots).for_each(|(m, x)| m.add(*x));
    }
    means
}

fn k_twice(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let scene = c.scene("lit-box-point", &one_point(&scenes::lit_box(1)), Setup::square(1, 1))?;
    let mut rng = Rng::new(c.seed());
    let production = c.production(Some(1));
    // Store K(Le) at the points around: 16 light samples each, then gather what is stored.
    let stream = scene.sampler.stream([0, 0], 0);
    let nothing = || Error::Internal("nothing before the camera".into());
    let camera_ray = camera_sample(&scene, [0, 0], 0).camera_ray.ok_or_else(nothing)?;
    let hit = scene.geometry.intersect(&camera_ray.ray, f32::INFINITY, &scene.alpha()).ok_or_else(nothing)?;
    let at = scene.geometry.interaction(&camera_ray.ray, &hit);
    let mut lambda = scene.sample_wavelengths(0.5);
    let context = scene.texture_context(&at, None);
    let bsdf = scene
        .materials
        .bsdf(at.material, &scene.textures, &at, &context, &mut lambda, stream.mix(0))
        .ok_or_else(nothing)?;
    let n = c.spp(4000);
    let mut index = 0;
    let gathered = Mean::of(u64::from(n), || {
        let u = Point2::new(rng.next_f32(), rng.next_f32());
        let Some(s) = bsdf.sample(at.wo, 0.5, u, TransportMode::Radiance, Sides::All) else { return 0.0 };
        let ray = at.spawn_ray(s.wi);
        let mut stored = 0.0;
        for _ in 0..16 {
            let mut slots = [0.0; 2];
            index += 1;
            along(&scene, &*production, ray, index, &mut slots);
            stored += slots[1] / 16.0;
        }
        f64::from(s.f[1] * bsdf.abs_cos(s.wi) / s.pdf) * stored
    });
    let two = &terms(c, &scene, c.spp(60_000), 3)[2];
    sheet.means_agree("K of stored K(Le), and the two-bounce term", &gathered, two, 0.15);
    Ok(sheet.finish())
}

/// Independent pictures of one pixel, whose spread is the error bar.
const REPLICATES: u32 = 32;

/// K^0 to K^10 of a furnace in closed form, each within a share of itself: 0.1 % in full.
fn furnace_terms(c: &Context, sheet: &mut Sheet, rho: f64) -> Result<(), Error> {
    // Of two-sided 1e-6, Student's t with 31 degrees of freedom.
    const SIGMAS: f64 = 6.1;
    let full = c.budget() == crate::Budget::Full;
    let (spp, bound) = if full { (1 << 18, 0.001) } else { (1 << 11, 0.02) };
    let made = if c.faulty("albedo-off") { 1.01 * rho } else { rho };
    let production =
        Production { max_depth: Some(12), roulette: PathRoulette::Constant(0.05), ..Production::default() };
    let mut terms = vec![Mean::new(); 11];
    for _ in 0..REPLICATES {
        let scene = c.scene("furnace-room", &furnace_room(made), Setup::square(1, spp))?;
        let parts =
            take_apart(&scene, &production, spp, 11, &|p: &Part| (p.bounces < 11).then_some(p.bounces as usize));
        terms.iter_mut().zip(&parts).for_each(|(term, part)| term.add(part.mean[0][1]));
    }
    let (mut worst, mut z_of_worst, mut largest_z, mut error) = (0.0f64, 0.0, 0.0f64, 0.0f64);
    let mut lines = vec![];
    for (i, term) in terms.iter().enumerate() {
        let exact = rho.powi(i as i32);
        let (off, se) = (term.mean() / exact - 1.0, term.standard_error() / exact);
        // f32 transport rounds by some 1e-6 an event.
        let z = (off.abs() - 2e-5).max(0.0) / se.max(1e-9);
        lines.push(format!("K^{i}: {:+.3} % ({:.3} %)", 100.0 * off, 100.0 * se));
        if off.abs() > worst {
            (worst, z_of_worst) = (off.abs(), z);
        }
        (largest_z, error) = (largest_z.max(z), error.max(se));
    }
    let percent = |x: f64| format!("{} %", number(100.0 * x));
    sheet.note(format!(
        "Albedo {rho}, {} paths: off by (standard error), of each term: {}.",
        REPLICATES * spp,
        lines.join("; ")
    ));
    sheet.holds(
        &format!("furnace of albedo {rho}: worst of K^0..K^10 against rho^i, of the term itself"),
        format!("{}, {z_of_worst:.2} standard errors (largest of any: {largest_z:.2})", percent(worst)),
        &format!("{}, and {SIGMAS} standard errors", percent(bound)),
        &format!("a bias of {} in the least certain term", percent((SIGMAS + 2.0) * error)),
        worst <= bound && largest_z <= SIGMAS && 3.0 * error <= bound,
    );
    Ok(())
}

fn neumann(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    for rho in [0.2f64, 0.5, 0.8, 0.95] {
        furnace_terms(c, &mut sheet, rho)?;
        if c.noticed(&sheet) {
            return Ok(sheet.finish());
        }
    }
    sheet.note("The furnace is a cube of emitting walls with an emitting ball in it: in a sphere light samples and cosine samples have the same density and no noise, and would prove little. Each vertex takes both, weighed, and roulette is played at each event, with a constant chance of 0.05: by throughput next to none of the paths would reach K^10(Le) of dark walls, which is 1e-7 of the picture at rho = 0.2.");
    sheet.command(c.command(
        "furnace-room",
        "--integrator path --estimator roulette=constant --estimator q=0.05 --max-depth 12 --aov bounces:10",
    ));
    let box_ = cornell_by_bounce(c)?;
    let means: Vec<f64> = box_.terms.iter().map(|t| t.grey()).collect();
    let ratios: Vec<f64> = (2..9).map(|i| means[i + 1] / means[i]).collect();
    sheet.at_most(
        "Cornell box: largest ratio of successive terms, i = 2..8",
        ratios.iter().fold(0.0f64, |a, b| a.max(*b)),
        0.999,
    );
    let spread = ratios[3..].iter().fold(0.0f64, |a, b| a.max((b - ratios[6]).abs()));
    sheet.at_most("it tends to a constant: spread of the last ratios", spread, 0.06);
    for (name, things) in [
        ("glass ball", "Material \"dielectric\" \"float eta\" 1.5\nShape \"sphere\"\n"),
        ("pane", "Material \"thindielectric\" \"float eta\" 1.8\nShape \"disk\" \"float radius\" 2\n"),
    ] {
        let spp = c.spp(1024);
        let e = whole(
            &*c.scene("glass-furnace", &furnace_with(8, 0.6, things), Setup::square(8, spp))?,
            &*c.production(None),
            spp,
        );
        if !c.faulty("albedo-off") {
            sheet.is(&format!("furnace of albedo 0.6 with a {name}: Le / (1 - rho)"), &e, 2.5, 0.03);
        }
    }
    Ok(sheet.finish())
}

fn formal_check(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let scene = c.scene("lit-box-point", &one_point(&scenes::lit_box(1)), Setup::square(1, 1))?;
    let mut rng = Rng::new(c.seed());
    let m = 4;
    let direct = terms(c, &scene, c.spp(30_000), m + 2);
    let gathered = gather(&scene, &*c.production(None), c.spp(60_000), m + 1, &mut rng);
    // Term by term, K of K^i is K^(i+1); the sums telescope.
    for i in 1..=m + 1 {
        sheet.means_agree(&format!("K(K^{} Le) and K^{i} Le", i - 1), &gathered[i], &direct[i], 0.25);
    }
    let sum = |means: &[Mean]| {
        let mean: f64 = means.iter().map(Mean::mean).sum();
        (mean, means.iter().map(|m| m.standard_error().powi(2)).sum::<f64>().sqrt())
    };
    let (s, se) = sum(&direct[..=m]);
    let (k, ke) = sum(&gathered[1..=m + 1]);
    let right = direct[0].mean() - direct[m + 1].mean();
    let z = (s - k - right).abs() / se.hypot(ke);
    sheet.holds(
        "S_m - K S_m and Le - K^(m+1) Le, m = 4",
        format!("{} and {}: {z:.2} standard errors", number(s - k), number(right)),
        "4.9 standard errors",
        &format!("an error of {} of S_m", number(6.9 * se.hypot(ke) / s)),
        z <= 4.9,
    );
    Ok(sheet.finish())
}

fn additivity(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let spp = c.spp(64);
    let scene =
        c.scene("two-balls", scenes::TWO_BALLS, Setup { size: Some([40, 30]), spp: Some(spp), ..Setup::default() })?;
    let production = c.production(None);
    // Each contribution is rounded once to the film's unit; integers add exactly, whatever the order.
    let (mut by_term, mut at_once) = (vec![ExactSum::default(); 24], ExactSum::default());
    let (mut worst, mut samples) = (0.0f64, 0u64);
    for pixel in 0..40 * 30 {
        for index in 0..spp {
            let sample = camera_sample(&scene, [pixel % 40, pixel / 40], index);
            let Some(ray) = sample.camera_ray else { continue };
            let mut lambda = sample.lambda;
            let mut stats = Default::default();
            let mut told = 0.0f64;
            let mut parts: Vec<(usize, f32)> = vec![];
            let all = production.sample(&scene, &ray, &sample.stream, &mut lambda, &mut stats, &mut |p| {
                parts.push(((p.bounces as usize).min(23), p.radiance[1]));
                told += f64::from(p.radiance[1]);
            });
            for (term, value) in parts.iter().rev() {
                let _ = by_term[*term].add(*value);
            }
            for (_, value) in &parts {
                let _ = at_once.add(*value);
            }
            if all[1] > 0.0 {
                worst = worst.max((told / f64::from(all[1]) - 1.0).abs());
            }
            samples += 1;
        }
    }
    let mut sum = ExactSum::default();
    by_term.iter().for_each(|t| sum += *t);
    sheet.holds(
        "sum of the per-bounce exact sums, and the exact sum of all contributions",
        if sum == at_once { "equal".into() } else { format!("{} and {}", sum.value(), at_once.value()) },
        "equal as integers",
        "2^-64",
        sum == at_once,
    );
    sheet.at_most(
        &format!("worst of {samples} samples: what was told against the sample (relative, f32)"),
        worst,
        2e-6,
    );
    sheet.command(c.command("two-balls", "--aov bounces:6"));
    Ok(sheet.finish())
}

fn depth_limited(c: &Context, depth: u32, spp: u32) -> Result<Estimate, Error> {
    let setup = Setup::square(c.side(64), spp);
    let scene = c.scene("cornell-box", &scenes::cornell(), setup)?;
    match c.wrong() {
        Wrong::Nothing => Ok(whole(&scene, &*c.production(Some(depth)), spp)),
        wrong => Ok(whole(&scene, &Walk::WEIGHED.depth(depth).wrong(wrong), spp)),
    }
}

fn k_images(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let box_ = cornell_by_bounce(c)?;
    let spp = c.spp(24);
    for i in 0..=6u32 {
        // Only light of exactly i bounces: the estimator is told to tell it apart, on a render that ends there.
        let scene = c.scene("cornell-box", &scenes::cornell(), Setup::square(c.side(64), spp))?;
        let wrong = c.wrong();
        let limited = c.production(Some(i));
        let only = |p: &Part| {
            // The last bounce that the limit lets through; a limit that is off by one shifts it.
            (p.bounces == i + u32::from(wrong == Wrong::DepthOffByOne)).then_some(0)
        };
        let alone = take_apart(&scene, &*limited, spp, 1, &only).swap_remove(0);
        sheet.agree(
            &format!("K^{i}(Le) of one run against a render to depth {i}"),
            &box_.terms[i as usize],
            &alone,
            [0.15, 0.08, 0.12, 0.25, 0.4, 0.6, 0.9][i as usize]
                / if c.budget() == crate::Budget::Full { 2.5 } else { 1.0 },
        );
        if c.noticed(&sheet) {
            return Ok(sheet.finish());
        }
    }
    let energies: Vec<String> = box_.terms[..7].iter().map(|t| number(t.grey())).collect();
    sheet.note(format!("Mean of K^i(Le), i = 0..6: {}.", energies.join(", ")));
    let images: Vec<_> = box_.terms[..7].iter().map(Estimate::image).collect();
    sheet.picture(
        "A38-terms",
        "Le, K(Le), K^2(Le), ... K^6(Le): light after exactly so many bounces (two stops brighter than A39).",
        &strip(&images.iter().collect::<Vec<_>>()),
        2.0,
    );
    sheet.command(c.command("cornell-box", "--aov bounces:6"));
    Ok(sheet.finish())
}

fn partial_sums(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let box_ = cornell_by_bounce(c)?;
    let mut sum = box_.terms[0].clone();
    let mut images = vec![sum.image()];
    for m in 1..=6u32 {
        sum = sum.plus(1.0, &box_.terms[m as usize]);
        images.push(sum.image());
        if [1, 2, 4, 6].contains(&m) {
            sheet.agree(
                &format!("first {} terms against a render to depth {m}", m + 1),
                &sum,
                &depth_limited(c, m, c.spp(32))?,
                0.1,
            );
        }
    }
    sheet.picture("A39-sums", "Sums of the first 1 to 7 terms.", &strip(&images.iter().collect::<Vec<_>>()), 0.0);
    sheet.command(c.command("cornell-box", "--max-depth 2"));
    Ok(sheet.finish())
}

fn saturation(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let box_ = cornell_by_bounce(c)?;
    let upto = |m: usize| box_.terms[1..=m].iter().fold(box_.terms[0].clone(), |a, b| a.plus(1.0, b));
    // Direct light is one bounce; "one-bounce global illumination" is two, and so on.
    let depths = [1usize, 2, 3, 5, 9, 16];
    let sums: Vec<Estimate> = depths.iter().map(|&d| upto(d)).collect();
    let means: Vec<f64> = sums.iter().map(Estimate::grey).collect();
    sheet.at_least(
        "each depth is brighter: least step",
        means.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min),
        0.0,
    );
    let gains: Vec<f64> = means.windows(2).map(|w| w[1] / w[0] - 1.0).collect();
    sheet.at_least("one bounce more than direct brightens by", gains[0], 0.1);
    sheet.at_most("nine to sixteen bounces brighten by", gains[4], 0.02);
    let ratio = (box_.terms[10].grey() / box_.terms[4].grey()).powf(1.0 / 6.0);
    let bound = box_.terms[16].grey() * ratio / (1.0 - ratio) / box_.whole.grey();
    let left = box_.beyond.grey() / box_.whole.grey();
    sheet.note(format!(
        "Fitted ratio of successive terms: {ratio:.3}; predicted rest beyond 16 bounces: {}.",
        number(bound)
    ));
    sheet.at_most("share of light beyond 16 bounces", left, (3.0 * bound).max(2e-4));
    let images: Vec<_> = sums.iter().map(Estimate::image).collect();
    sheet.picture(
        "A40-depths",
        "Direct; 1, 2, 4, 8 and 15 more bounces.",
        &strip(&images.iter().collect::<Vec<_>>()),
        0.0,
    );
    Ok(sheet.finish())
}
