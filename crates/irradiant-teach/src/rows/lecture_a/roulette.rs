//! Russian roulette, try 2, and the path tracer (A46 to A50, A52 to A55).

use super::super::shared::{cornell_by_bounce, reflected, strip};
use crate::context::{Context, Setup};
use crate::estimate::{Estimate, Estimator, Part, Production, take_apart, whole};
use crate::row::{Outcome, Row};
use crate::scenes::{self, furnace, furnace_with};
use crate::sheet::{Sheet, number};
use crate::walk::{Emission, Roulette, Walk, Wrong};
use irradiant::Error;
use irradiant::renderer::simple_path::SimplePathIntegrator;

/// A46 to A50, A52 to A55.
pub const ROWS: &[Row] = &[
    Row {
        id: "A46",
        name: "Russian roulette: E[X_rr] = E[X]",
        says: "Continue with probability p, weigh by 1 / p.",
        check: "With and without roulette (then to depth 60 or 200): furnace, a closed diffuse box, glass in a furnace. No difference; paths get shorter.",
        run: roulette,
    },
    Row {
        id: "A47",
        name: "Choose p for efficiency",
        says: "Terminate if expensive, or if little is to be expected.",
        check: "1 / (variance x rays) of four policies on the Cornell box, all agreeing; playing by throughput is at least as efficient as none.",
        run: policies,
    },
    Row {
        id: "A48",
        name: "A finite number of recursive calls (how many?)",
        says: "-",
        check: "Mean path length in a closed room under constant q after the first event: 1 + (1 - q) / q; production's mean and longest are printed.",
        run: how_many,
    },
    Row {
        id: "A49",
        name: "An unbiased, finite estimator for an infinite-dimensional integral",
        says: "The whole series from finite paths.",
        check: "Furnace of albedo 0.5, no depth limit: Le / (1 - rho) within 0.1 %.",
        run: infinite_sum,
    },
    Row {
        id: "A50",
        name: "Try 2: Russian roulette over paths",
        says: "Unbiased, terminates, still extremely noisy.",
        check: "The slide's code on the Cornell box against the path tracer: same picture; its variance, sample by sample, many times larger.",
        run: try_2,
    },
    Row {
        id: "A52",
        name: "Path tracing overview",
        says: "Roulette, and a partition into direct light by light samples and indirect light by BRDF samples.",
        check: "The program's simple integrator, which does exactly this, the witness written after the slide, and production agree.",
        run: overview,
    },
    Row {
        id: "A53",
        name: "Partitioning the rendering equation",
        says: "0 bounces, 1 bounce, more.",
        check: "Three layers of one run add up to its picture; each is checked alone by A38.",
        run: partition,
    },
    Row {
        id: "A54",
        name: "Pseudo-code: zero bounces, at least one bounce, one bounce",
        says: "Emission at zero bounces, then light samples at each surface.",
        check: "Literally, on diffuse scenes, it agrees with production; in a mirror its lamp is black, and the Bern exception mends it.",
        run: pseudo_code,
    },
    Row {
        id: "A55",
        name: "Direct lighting against path tracing (figure)",
        says: "0 and 1 bounce, and all bounces.",
        check: "The pair from one run.",
        run: |c| Ok(c.inherit(&["A05", "A53"])),
    },
];

fn roulette(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let lossless = furnace_with(8, 0.5, "Material \"dielectric\" \"float eta\" 1.5\nShape \"sphere\"\n");
    let scenes = [
        ("furnace", furnace(8, 0.5), 1024, 60),
        ("lit-box", scenes::lit_box(8), 1024, 60),
        ("glass-furnace", lossless, 128, 200),
    ];
    for (name, text, spp, depth) in scenes {
        let spp = c.spp(spp);
        let run = |estimator: &dyn Estimator| -> Result<Estimate, Error> {
            Ok(whole(&*c.scene(name, &text, Setup::square(8, spp))?, estimator, spp))
        };
        let with = run(&*c.production(None))?;
        let without = run(&Walk { roulette: Roulette::None, ..Walk::PATH }.depth(depth))?;
        sheet.agree(&format!("{name}: with roulette, and without to depth {depth}"), &with, &without, 0.12);
        let mean = |e: &Estimate| e.stats.scatterings as f64 / e.stats.paths as f64;
        sheet.at_most(&format!("{name}: mean path length, with over without"), mean(&with) / mean(&without), 0.9);
        if c.noticed(&sheet) {
            return Ok(sheet.finish());
        }
    }
    Ok(sheet.finish())
}

fn policies(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let spp = c.spp(48);
    let reference = cornell_by_bounce(c)?;
    let mut lines = vec![];
    let (mut none, mut throughput) = (0.0, 0.0);
    let policies = [
        ("none (to depth 40)", Roulette::None, Some(40)),
        ("constant 0.5 after two", Roulette::Constant { q: 0.5, spared: 2 }, None),
        ("by the BSDF", Roulette::Bsdf, None),
        ("by throughput", Roulette::Throughput, None),
    ];
    for (name, roulette, max_depth) in policies {
        let scene = c.scene("cornell-box", &scenes::cornell(), Setup::square(c.side(64), spp))?;
        let e = whole(&scene, &Walk { roulette, max_depth, ..Walk::PATH }, spp);
        sheet.agree(&format!("{name} and production"), &e, &reference.whole, 0.08);
        let rays = (e.stats.bounce_rays + e.stats.shadow_rays + e.stats.paths) as f64 / e.stats.paths as f64;
        let efficiency = 1.0 / (e.sample_variance() * rays);
        lines.push(format!("{name}: {} rays a path, efficiency {}", number(rays), number(efficiency)));
        match roulette {
            Roulette::None => none = efficiency,
            Roulette::Throughput => throughput = efficiency,
            Roulette::Constant { .. } | Roulette::Bsdf => {}
        }
    }
    sheet.note(lines.join("; "));
    sheet.at_least("efficiency of throughput roulette over none", throughput / none, 1.0);
    sheet.note("Efficiency-aware (adjoint-driven) roulette needs a guess of the solution, which comes with path guiding; it is not built yet.");
    sheet.command(c.command(
        "cornell-box",
        "--integrator partitioned --estimator emission=specular --estimator roulette=throughput --stats stats.json",
    ));
    Ok(sheet.finish())
}

fn how_many(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let spp = c.spp(256);
    for q in [0.5f32, 0.2] {
        let scene = c.scene("lit-box", &scenes::lit_box(8), Setup::square(8, spp))?;
        let walk = Walk { roulette: Roulette::Constant { q, spared: 0 }, ..Walk::PATH };
        let e = whole(&scene, &walk, spp);
        // Every vertex scatters in this closed room; the number of events is geometric.
        let mean = e.stats.scatterings as f64 / e.stats.paths as f64;
        let expected = 1.0 / f64::from(q);
        let se = (1.0 - f64::from(q)).sqrt() / f64::from(q) / (e.stats.paths as f64).sqrt();
        sheet.holds(
            &format!("mean number of events for q = {q}"),
            format!("{} for {}", number(mean), number(expected)),
            "4.9 standard errors",
            &format!("a difference of {} %", number(690.0 * se / expected)),
            (mean - expected).abs() <= 4.9 * se,
        );
    }
    let scene = c.scene("cornell-box", &scenes::cornell(), Setup::square(16, spp))?;
    let e = whole(&scene, &Production::default(), spp);
    let mean = e.stats.scatterings as f64 / e.stats.paths as f64;
    sheet.between("Cornell box: production's mean path length", mean, [2.0, 9.0]);
    sheet.note(format!("Its longest of {} paths has {} events.", e.stats.paths, e.stats.longest_path));
    sheet.command(c.command("cornell-box", "--stats stats.json"));
    Ok(sheet.finish())
}

fn infinite_sum(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    // 256 pixels; the variance of a sample is about 1.
    let spp = c.spp(4096);
    let e = whole(&*c.scene("furnace", &furnace(16, 0.5), Setup::square(16, spp))?, &*c.production(None), spp);
    sheet.is("furnace of albedo 0.5: 2", &e, 2.0, 0.01);
    let (mean, se) = e.total()[1];
    sheet.at_most("distance from 2, % of it", 100.0 * (mean / 2.0 - 1.0).abs(), 0.1);
    sheet.at_most("standard error, % of it", 100.0 * se / 2.0, 0.1);
    sheet.command(c.command("furnace", "--max-depth none --spp 4096"));
    Ok(sheet.finish())
}

fn try_2(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let spp = c.spp(384);
    let run = |walk: &dyn Estimator, spp: u32| -> Result<Estimate, Error> {
        Ok(reflected(&*c.scene("cornell-box", &scenes::cornell(), Setup::square(32, spp))?, walk, spp))
    };
    let (two, path) = (run(&Walk::TRY_2, 2 * spp)?, run(&Production::default(), spp / 4)?);
    sheet.agree("try 2 and the path tracer", &two, &path, 0.2);
    let ratio = two.sample_variance() / path.sample_variance();
    sheet.between("variance of a sample, try 2 over path tracer", ratio, [10.0, 1000.0]);
    sheet.command(c.command("cornell-box", "--integrator try2"));
    Ok(sheet.finish())
}

fn overview(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let spp = c.spp(512);
    let run = |estimator: &dyn Estimator| -> Result<Estimate, Error> {
        Ok(whole(&*c.scene("lit-box", &scenes::lit_box(8), Setup::square(8, spp))?, estimator, spp))
    };
    let production = run(&Production::default())?;
    sheet.agree("the witness after the slide", &run(&Walk::PATH)?, &production, 0.05);
    let simple = SimplePathIntegrator { max_depth: None, sample_lights: true, sample_bsdf: true };
    let scene = c.scene("lit-box", &scenes::lit_box(8), Setup::square(8, spp))?;
    let simple = crate::estimate::by_integrator(&scene, &simple, spp).0;
    sheet.agree("the program's simplepath", &simple, &production, 0.05);
    // One light sample at each non-specular vertex, one BSDF sample: as many shadow rays as vertices, at most.
    let per_event = simple.stats.shadow_rays as f64 / (simple.stats.scatterings + simple.stats.paths) as f64;
    sheet.at_most("shadow rays for each vertex", per_event, 1.0);
    sheet.command(c.command("lit-box", "--integrator simplepath --max-depth none"));
    Ok(sheet.finish())
}

fn partition(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let spp = c.spp(48);
    let side = c.side(96);
    let scene = c.scene("cornell-box", &scenes::cornell(), Setup::square(side, spp))?;
    let parts = take_apart(&scene, &Production::default(), spp, 3, &|p: &Part| Some((p.bounces as usize).min(2)));
    let sum = parts[0].plus(1.0, &parts[1]).plus(1.0, &parts[2]);
    let off = (0..sum.mean.len()).map(|i| (sum.mean[i][1] - parts[3].mean[i][1]).abs() / parts[3].mean[i][1].max(1e-9));
    sheet.at_most("0 + 1 + more bounces against the picture, worst pixel (relative)", off.fold(0.0, f64::max), 2e-6);
    let box_ = cornell_by_bounce(c)?;
    let more = box_.terms[2..].iter().fold(box_.beyond.clone(), |a, b| a.plus(1.0, b));
    for (name, got, expected) in [("1 bounce", &parts[1], box_.terms[1].grey()), ("more", &parts[2], more.grey())] {
        let (mean, se) = (got.grey(), got.total()[1].1);
        sheet.close(&format!("{name}: mean, against another run"), mean, expected, (8.0 * se / mean).max(0.01));
    }
    let images = [parts[0].image(), parts[1].image(), parts[2].image(), parts[3].image()];
    sheet.picture(
        "A53-partition",
        "0 bounces, 1 bounce, more, all: one run.",
        &strip(&images.iter().collect::<Vec<_>>()),
        0.0,
    );
    sheet.command(c.command("cornell-box", "--aov \"zero=LE\" --aov bounces:2"));
    Ok(sheet.finish())
}

/// A lamp seen straight, a diffuse floor, and a mirror behind that shows the lamp.
pub fn lamp_in_a_mirror(size: u32) -> String {
    scenes::film(size)
        + "LookAt 0 1.2 -4  0 0.9 0  0 1 0\nCamera \"perspective\" \"float fov\" 50\nWorldBegin\n"
        + "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" \"rgb L\" [ 6 5 4 ]\nTranslate -.2 1.9 .2\nShape \"sphere\" \"float radius\" .4\nAttributeEnd\n"
        + "Material \"diffuse\" \"rgb reflectance\" [ .6 .55 .5 ]\n"
        + &scenes::quad([[-4.0, 0.0, -4.0], [4.0, 0.0, -4.0], [4.0, 0.0, 3.0], [-4.0, 0.0, 3.0]])
        + "Material \"conductor\" \"rgb reflectance\" [ .9 .9 .9 ] \"float roughness\" 0\n"
        + &scenes::quad([[-3.0, 0.0, 2.0], [3.0, 0.0, 2.0], [3.0, 2.6, 2.6], [-3.0, 2.6, 2.6]])
}

fn pseudo_code(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let literal = Walk { emission: Emission::AtTheEye, roulette: Roulette::Bsdf, wrong: Wrong::Nothing, ..Walk::PATH };
    let spp = c.spp(512);
    let scene = c.scene("lit-box", &scenes::lit_box(8), Setup::square(8, spp))?;
    let other = c.scene("lit-box", &scenes::lit_box(8), Setup::square(8, spp))?;
    sheet.agree(
        "diffuse box: the slide's code and production",
        &whole(&scene, &literal, spp),
        &whole(&other, &Production::default(), spp),
        0.06,
    );
    let spp = c.spp(64);
    let text = lamp_in_a_mirror(c.side(96));
    let run = |e: &dyn Estimator| -> Result<Estimate, Error> {
        Ok(whole(&*c.scene("lamp-in-a-mirror", &text, Setup { spp: Some(spp), ..Setup::default() })?, e, spp))
    };
    let (slide, mended, production) = (run(&literal)?, run(&Walk::PATH)?, run(&Production::default())?);
    sheet.agree("with the exception for specular surfaces, and production", &mended, &production, 0.1);
    let with_exception = mended.image();
    // The lamp in the mirror: as bright as F L there, and dark in the slide's picture.
    let lost = (0..production.mean.len()).filter(|&i| production.mean[i][1] > 4.2 && slide.mean[i][1] < 0.3);
    let lost: Vec<usize> = lost.collect();
    sheet.at_least("pixels of the lamp in the mirror that are dark by the slide's code", lost.len() as f64, 20.0);
    let mended = lost.iter().map(|&i| mended.mean[i][1]).fold(f64::INFINITY, f64::min);
    sheet.at_least("the darkest of them with the exception", mended, 3.5);
    sheet.picture(
        "A54-mirror",
        "The slide's code, in whose mirror the lamp is black; and with the exception (B38).",
        &strip(&[&slide.image(), &with_exception]),
        0.0,
    );
    sheet.note("Three gaps of the pseudo-code: no test for a miss, the next ray is traced before the roulette, and light by way of mirrors is lost. The witness has the first two mended, or it would not run.");
    sheet.command(c.command("lamp-in-a-mirror", "--integrator partitioned"));
    Ok(sheet.finish())
}
