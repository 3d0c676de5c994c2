//! Densities: of lights over solid angle, of directions, combined (B21, B26, B28 to B32).

use super::super::shared::strip;
use crate::context::{Context, Setup};
use crate::estimate::{Estimate, Estimator, whole};
use crate::row::{Outcome, Row};
use crate::scenes::{self, at_the_origin, film, quad};
use crate::sheet::{Sheet, number};
use crate::walk::{Direct, Directions, Emission, Roulette, Walk, Wrong};
use irradiant::Error;
use irradiant::core::interaction::{LightId, ReferencePoint};
use irradiant::core::light::SampleMode;
use irradiant::math::{Normal3, Point2, Point3, Ray, Vec3};
use irradiant::renderer::camera_samples::camera_sample;
use irradiant::spectrum::Wavelengths;
use irradiant_testkit::{Mean, Rng, chi2_sphere};
use std::f64::consts::PI;

/// B21, B26, B28 to B32.
pub const ROWS: &[Row] = &[
    Row {
        id: "B21",
        name: "Density of a path; area to solid angle",
        says: "p_w = p_A d^2 / cos.",
        check: "For triangle, rectangle, disk, sphere, cylinder and mesh lights, near, far and grazing: the density over solid angle integrates to 1 (or the share that faces us), and is p_A d^2 / cos.",
        run: solid_angle_densities,
    },
    Row {
        id: "B26",
        name: "p_w(x) includes the conversion",
        says: "Area samples need the conversion to solid angle.",
        check: "B21.",
        run: |c| Ok(c.inherit(&["B21"])),
    },
    Row {
        id: "B28",
        name: "shade() includes emission, BRDF, cosine",
        says: "Towards the point on the light.",
        check: "One light over one surface in closed form: point, disk, rectangle, sphere.",
        run: closed_forms,
    },
    Row {
        id: "B29",
        name: "Densities for sampling directions",
        says: "Uniform, cosine-weighted, by the BRDF.",
        check: "Each integrates to 1 and passes chi-square; on a glossy surface under a sky the variance falls in this order.",
        run: directions,
    },
    Row {
        id: "B30",
        name: "Implementation: who does what",
        says: "Material.getShadingSample, LightGeometry.sample, the integrator picks the light.",
        check: "A material of a user's own in under 40 lines that works in every integrator.",
        run: |_| {
            Ok(Outcome::waits(
                "the split is there (Bsdf::sample, Light::sample, the integrator picks), but materials are an enum (decision 1): a user's own needs a line in each match, not only a trait of 40 lines",
            ))
        },
    },
    Row {
        id: "B31",
        name: "Density of light samples",
        says: "1 / lights x 1 / area x conversion.",
        check: "With the uniform selector the chance of each of 7 lights is 1/7, and chance times density of a rectangle's sample is (1/7) (1/A) d^2 / cos.",
        run: uniform_selector,
    },
    Row {
        id: "B32",
        name: "Advanced: multiple importance sampling",
        says: "-",
        check: "Four plates and four lamps: in each of the 16 cells the variance of one sample of each technique, weighed, is at most 1.2 times the better technique's alone; all agree.",
        run: veach,
    },
];

fn reference(p: Point3, n: Vec3) -> ReferencePoint {
    let normal = Normal3::new(n.x, n.y, n.z);
    ReferencePoint { p, p_error: Vec3::new(1e-6, 1e-6, 1e-6), n: normal, ns: normal }
}

fn solid_angle_densities(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let shapes = [
        (
            "triangle",
            "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ -.5 0 -.4  .6 0 -.3  .1 .2 .7 ]\n",
        ),
        (
            "rectangle",
            "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 2 3 0 ] \"point3 P\" [ -.5 0 -.5  .5 0 -.5  .5 0 .5  -.5 0 .5 ]\n",
        ),
        ("disk", "Rotate 90 1 0 0\nShape \"disk\" \"float radius\" .6\n"),
        ("sphere", "Shape \"sphere\" \"float radius\" .5\n"),
        ("cylinder", "Shape \"cylinder\" \"float radius\" .4 \"float zmin\" -.5 \"float zmax\" .5\n"),
        (
            "mesh",
            "Shape \"loopsubdiv\" \"integer levels\" 1 \"integer indices\" [ 0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5 ] \"point3 P\" [ .6 0 0  -.6 0 0  0 0 .6  0 0 -.6  0 .6 0  0 -.6 0 ]\n",
        ),
    ];
    let lambda = Wavelengths::rgb();
    for (name, shape) in shapes {
        // The camera is at the origin of the world: render space is the light's.
        let text = film(1)
            + "Camera \"perspective\"\nWorldBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ] \"bool twosided\" true\n"
            + shape;
        let scene = c.scene("light-shape", &text, Setup::default())?;
        let mut rng = Rng::new(c.seed());
        for (place, p) in [
            ("near", Point3::new(0.1, 0.9, 0.05)),
            ("far", Point3::new(2.0, 5.0, -3.0)),
            ("grazing", Point3::new(3.0, 0.15, 0.2)),
        ] {
            let at = reference(p, Vec3::ZERO);
            let picker = |id: u32| scene.light_sampler.pmf(&at, LightId(id));
            // Directions drawn uniformly over a cone that holds the light.
            let axis = (Point3::ZERO - p).normalize();
            let distance = f64::from((Point3::ZERO - p).length());
            let cone = (1.0 - (1.0 / distance.max(1.0)).powi(2)).max(0.0).sqrt();
            let cone = if distance <= 1.0 { -1.0 } else { cone };
            let frame = irradiant::math::Frame::from_z(axis);
            let (mut integral, mut worst) = (Mean::new(), 0.0f64);
            for _ in 0..c.spp(150_000) {
                let (z, phi) = (cone + (1.0 - cone) * rng.next_f64(), 2.0 * PI * rng.next_f64());
                let s = (1.0 - z * z).max(0.0).sqrt();
                let w = frame.from_local(Vec3::new((s * phi.cos()) as f32, (s * phi.sin()) as f32, z as f32));
                let ray = Ray::new(p, w, 0.0);
                // All surfaces of the light along the ray: closed shapes have one that faces us and one behind.
                let mut density = 0.0;
                if let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) {
                    let met = scene.geometry.interaction(&ray, &hit);
                    if let Some(light) = met.light {
                        let pdf = f64::from(scene.lights.get(light).pdf_hit(&at, w, &(&met).into()));
                        let pdf = if c.faulty("no-area-conversion") {
                            pdf * f64::from(met.n.as_vec().dot(w)).abs()
                        } else {
                            pdf
                        };
                        density = pdf * f64::from(picker(light.0));
                    }
                }
                integral.add(density * 2.0 * PI * (1.0 - cone));
            }
            // What light samples themselves say of the share that is visible from here.
            let mut visible = Mean::new();
            for _ in 0..c.spp(20_000) {
                let mut share = 0.0;
                if let Some(picked) = scene.light_sampler.sample(&at, rng.next_f32())
                    && let Some(s) = scene.lights.get(picked.id).sample(
                        &at,
                        Point2::new(rng.next_f32(), rng.next_f32()),
                        &lambda,
                        SampleMode::Complete,
                    )
                {
                    let ray = Ray::new(p, s.wi, 0.0);
                    let hit = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha());
                    if let (Some(hit), irradiant::core::light::LightTarget::Surface { p: on, .. }) = (hit, s.target) {
                        let met = scene.geometry.interaction(&ray, &hit);
                        if (met.p - on).length() < 1e-4 * (on - p).length() {
                            share = 1.0;
                        }
                        // The sample's density is the hit's; near silhouettes it changes too fast to compare at two roundings.
                        if share > 0.0 && met.light == Some(picked.id) && met.n.as_vec().dot(s.wi).abs() > 0.3 {
                            let again = f64::from(scene.lights.get(picked.id).pdf_hit(&at, s.wi, &(&met).into()));
                            worst = worst.max((again / f64::from(s.pdf) - 1.0).abs());
                        }
                    }
                }
                visible.add(share);
            }
            sheet.means_agree(
                &format!("{name}, {place}: integral of the density over what is visible"),
                &integral,
                &visible,
                0.35,
            );
            sheet.at_most(&format!("{name}, {place}: density of samples against that of hits"), worst, 0.02);
        }
    }
    Ok(sheet.finish())
}

fn closed_forms(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let d2 = if c.faulty("inverse-square-missing") { 1.0 } else { 25.0 };
    let text = at_the_origin(2, 3.0, "LightSource \"point\" \"rgb I\" [ 2 2 2 ] \"point3 from\" [ 3 4 0 ]\n");
    let e = whole(&*c.scene("point-light", &text, Setup::square(2, 64))?, &*c.production(None), 64);
    sheet.close("point light: I cos / d^2 rho / pi", e.grey(), 2.0 * 0.8 / d2 * 0.5 / PI, 1e-4);
    let spp = c.spp(4096);
    for (r, h) in [(1.0, 0.7), (0.2, 2.0)] {
        let e = whole(
            &*c.scene("disk-lamp", &at_the_origin(4, 0.4, &scenes::disk_light(r, h, 5.0)), Setup::square(4, spp))?,
            &*c.production(Some(1)),
            spp,
        );
        sheet.is(&format!("disk of radius {r} at {h}"), &e, 5.0 * r * r / (r * r + h * h) * 0.5, 0.02);
    }
    let mut outcome = sheet.finish();
    let others = c.inherit(&["A33", "A18"]);
    if outcome.verdict == crate::row::Verdict::Passes {
        outcome.verdict = others.verdict;
    }
    outcome.measures.extend(others.measures);
    Ok(outcome)
}

fn directions(c: &Context) -> Result<Outcome, Error> {
    use irradiant::math::warp;
    let mut sheet = Sheet::new();
    let mut rng = Rng::new(c.seed());
    let n = u64::from(c.spp(60_000));
    let surface = crate::surface::Surface::new(c, "Material \"conductor\" \"float roughness\" 0.3\n")?;
    let wo = Vec3::new(0.5, 0.0, 0.75f32.sqrt());
    let v = |d: [f64; 3]| Vec3::new(d[0] as f32, d[1] as f32, d[2] as f32);
    let mut u = || Point2::new(rng.next_f32(), rng.next_f32());
    let uniform = chi2_sphere(
        |d| if d[2] > 0.0 { 0.5 / PI } else { 0.0 },
        || {
            let w = warp::uniform_hemisphere(u());
            Some([w.x, w.y, w.z])
        },
        n,
    );
    let cosine = chi2_sphere(
        |d| d[2].max(0.0) / PI,
        || {
            let w = warp::cosine_hemisphere(u());
            Some([w.x, w.y, w.z])
        },
        n,
    );
    let bsdf = chi2_sphere(
        |d| f64::from(surface.pdf(wo, v(d))),
        || surface.sample(wo, 0.5, u()).map(|s| [s.wi.x, s.wi.y, s.wi.z]),
        n,
    );
    for (name, report, whole) in [("uniform", uniform, true), ("cosine", cosine, true), ("BRDF", bsdf, false)] {
        sheet.holds(
            &format!("{name}: chi-square"),
            format!("p = {:.3}", report.p_value),
            "p above 1e-6",
            &format!("a density off by {:.1} % over half of the samples", 100.0 * report.detectable_ratio(1e-6)),
            report.p_value > 1e-6,
        );
        // Samples that a rough mirror sends below the surface are lost, and counted.
        let missed = report.missed as f64 / report.samples as f64;
        sheet.between(
            &format!("{name}: integral of the density (and lost samples)"),
            report.integral + if whole { 0.0 } else { missed },
            [0.99, 1.01],
        );
    }
    let text = film(8)
        + "LookAt 0 6 -3  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 20\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\nMaterial \"conductor\" \"rgb reflectance\" [ .8 .8 .8 ] \"float roughness\" 0.15\n"
        + &quad([[-5.0, 0.0, -5.0], [5.0, 0.0, -5.0], [5.0, 0.0, 5.0], [-5.0, 0.0, 5.0]]);
    let spp = c.spp(2048);
    let run = |directions| -> Result<Estimate, Error> {
        let walk = Walk { directions, roulette: Roulette::None, ..Walk::TRY_1 }.depth(1);
        Ok(whole(&*c.scene("glossy-floor", &text, Setup::square(8, spp))?, &walk, spp))
    };
    let (a, b, d) = (run(Directions::Uniform)?, run(Directions::Cosine)?, run(Directions::Bsdf)?);
    sheet.agree("uniform and BRDF directions", &a, &d, 0.1);
    sheet.agree("cosine and BRDF directions", &b, &d, 0.1);
    let [va, vb, vd] = [&a, &b, &d].map(Estimate::sample_variance);
    sheet.note(format!("Variance of a sample: uniform {}, cosine {}, BRDF {}.", number(va), number(vb), number(vd)));
    sheet.at_least("variance, uniform over cosine", va / vb, 1.1);
    sheet.at_least("variance, cosine over BRDF", vb / vd, 2.0);
    for strategy in ["uniform", "cosine", "bsdf"] {
        sheet.command(c.command("glossy-floor", &format!("--integrator try1 --estimator directions={strategy}")));
    }
    Ok(sheet.finish())
}

fn uniform_selector(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let mut text =
        film(1) + "Integrator \"path\" \"string lightsampler\" \"uniform\"\nCamera \"perspective\"\nWorldBegin\n";
    for i in 0..7 {
        let (l, x) = (1 << i, f64::from(i) * 1.5 - 4.5);
        text += &format!(
            "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ {l} {l} {l} ] \"bool twosided\" true\nTranslate {x} 3 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" .5\nAttributeEnd\n"
        );
    }
    let scene = c.scene("seven-lights", &text, Setup::default())?;
    let at = reference(Point3::new(0.3, 0.0, 0.2), Vec3::new(0.0, 1.0, 0.0));
    let lambda = Wavelengths::rgb();
    let mut rng = Rng::new(c.seed());
    let mut counts = [0u64; 7];
    let (mut worst_pmf, mut worst_pdf) = (0.0f64, 0.0f64);
    for _ in 0..c.spp(20_000) {
        let Some(picked) = scene.light_sampler.sample(&at, rng.next_f32()) else { continue };
        counts[picked.id.0 as usize] += 1;
        worst_pmf = worst_pmf.max((7.0 * f64::from(picked.pmf) - 1.0).abs());
        let Some(s) = scene.lights.get(picked.id).sample(
            &at,
            Point2::new(rng.next_f32(), rng.next_f32()),
            &lambda,
            SampleMode::Complete,
        ) else {
            continue;
        };
        if let irradiant::core::light::LightTarget::Surface { p, n, .. } = s.target {
            let d = p - at.p;
            let cosine = f64::from(n.as_vec().dot(s.wi)).abs();
            let expected = 1.0 / 7.0 / (PI * 0.25) * f64::from(d.length_squared()) / cosine;
            worst_pdf = worst_pdf.max((f64::from(picked.pmf * s.pdf) / expected - 1.0).abs());
        }
    }
    sheet.at_most("chance of a light against 1/7 (relative)", worst_pmf, 1e-6);
    sheet.at_most("chance x density against 1/7 1/A d^2 / cos (relative)", worst_pdf, 1e-4);
    let report = irradiant_testkit::chi2_counts(&counts, &[1.0 / 7.0; 7]);
    sheet.holds(
        "how often each was picked (chi-square)",
        format!("{counts:?}, p = {:.3}", report.p_value),
        "p above 1e-6",
        &format!("{:.1} %", 100.0 * report.detectable_ratio(1e-6)),
        report.p_value > 1e-6,
    );
    Ok(sheet.finish())
}

/// A plate under one lamp, by one technique: mean and variance of a sample, each with its own error.
struct Cell {
    mean: f64,
    error: f64,
    variance: f64,
    noise: f64,
}

/// Which plate each pixel sees: shapes in the order of the file are four lamps, back and floor, four plates.
fn plates(scene: &irradiant::core::scene::Scene, w: u32, h: u32) -> Vec<Option<u32>> {
    let at = |i: i32| {
        let ray = camera_sample(scene, [i % w as i32, i / w as i32], 0).camera_ray?;
        let hit = scene.geometry.intersect(&ray.ray, f32::INFINITY, &scene.alpha())?;
        scene.geometry.interaction(&ray.ray, &hit).shape.0.checked_sub(5)
    };
    (0..(w * h) as i32).map(at).collect()
}

fn veach(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let text = scenes::VEACH_PLATES;
    let (w, h, spp) = (48, 36, c.spp(320));
    let only = |lamp: usize| -> String {
        // All lamps but one are put out: their bodies stay.
        let mut kept = String::new();
        for (i, part) in text.split("AreaLightSource").enumerate() {
            match i {
                0 => kept += part,
                i if i - 1 == lamp => kept += &format!("AreaLightSource{part}"),
                _ => kept += part.split_once('\n').map_or(part, |p| p.1),
            }
        }
        kept
    };
    let lights = Walk { emission: Emission::AtTheEye, ..Walk::PATH }.depth(1);
    let brdf = Walk { direct: Direct::Chance, emission: Emission::Everywhere, roulette: Roulette::None, ..Walk::PATH }
        .depth(1);
    let mut wrong = vec![];
    let (mut cells, mut worst, mut table) = (0, 0.0f64, vec![]);
    for lamp in 0..4 {
        // Two halves, so that the noise of the variances is known: from how a pixel's two variances differ.
        let run = |e: &dyn Estimator| -> Result<([Estimate; 2], Vec<Option<u32>>), Error> {
            let mut plate = vec![];
            let mut half = || -> Result<Estimate, Error> {
                let setup = Setup { size: Some([w, h]), spp: Some(spp / 2), ..Setup::default() };
                let scene = c.scene(&format!("veach-lamp-{lamp}"), &only(lamp), setup)?;
                plate = plates(&scene, w, h);
                Ok(whole(&scene, e, spp / 2))
            };
            Ok(([half()?, half()?], plate))
        };
        let ((l, plate), (b, _), (both, _)) = (run(&lights)?, run(&brdf)?, run(&*c.production(Some(1)))?);
        for p in 0..4u32 {
            let cell = |halves: &[Estimate; 2]| {
                let [a, b] = halves.each_ref().map(|e| e.region(|x, y| plate[y * w as usize + x] == Some(p)));
                let n = a.mean.len() as f64;
                let square: f64 = a.variance.iter().zip(&b.variance).map(|(a, b)| (a[1] - b[1]).powi(2)).sum();
                let noise = f64::from(spp / 2) * square.sqrt() / (2.0 * n);
                let ((ma, sa), (mb, sb)) = (a.total()[1], b.total()[1]);
                let variance = 0.5 * (a.sample_variance() + b.sample_variance());
                Cell { mean: 0.5 * (ma + mb), error: 0.5 * sa.hypot(sb), variance, noise }
            };
            let (pl, pb, pm) = (cell(&l), cell(&b), cell(&both));
            // A technique that met next to nothing in so many samples does not know its variance.
            let says = |e: &Cell| e.variance > 0.0 && e.error < 0.1 * e.mean;
            let candidates = [&pl, &pb].into_iter().filter(|e| says(e));
            let Some(best) = candidates.min_by(|a, b| a.variance.total_cmp(&b.variance)) else { continue };
            cells += 1;
            let ratio = pm.variance / best.variance;
            let known = ratio * (pm.noise / pm.variance).hypot(best.noise / best.variance);
            worst = worst.max(ratio - 3.0 * known);
            table.push(format!("plate {p}, lamp {lamp}: {ratio:.2} +- {known:.2}"));
            if ratio - 3.0 * known > 1.2 {
                wrong.push(format!("plate {p}, lamp {lamp}: {ratio:.2} +- {known:.2}"));
            }
            // The better technique's mean is the reference.
            let z = (pm.mean - best.mean).abs() / pm.error.hypot(best.error);
            if !(z <= 4.9) {
                let means = [pm.mean, best.mean].map(number);
                wrong.push(format!(
                    "plate {p}, lamp {lamp}: means {} and {}, {z:.1} standard errors",
                    means[0], means[1]
                ));
            }
        }
        if c.wrong() != Wrong::Nothing && !wrong.is_empty() {
            break;
        }
    }
    sheet.none_of(
        "cells where weighing is worse than 1.2 times the better technique, or another mean",
        2 * cells,
        &wrong,
    );
    if c.noticed(&sheet) {
        return Ok(sheet.finish());
    }
    sheet.between("cells in which a technique alone knows its variance", f64::from(cells as u32), [12.0, 16.0]);
    sheet.at_most("worst variance ratio, less three standard errors", worst, 1.2);
    sheet.note(table.join("; "));
    let (pw, ph) = (c.side(144), c.side(108));
    let picture = |e: &dyn Estimator| -> Result<_, Error> {
        let setup = Setup { size: Some([pw, ph]), spp: Some(16), ..Setup::default() };
        Ok(whole(&*c.scene("veach-plates", text, setup)?, e, 16).image())
    };
    let images = [picture(&brdf)?, picture(&lights)?, picture(&*c.production(Some(1)))?];
    sheet.picture(
        "B32-plates",
        "16 samples: by the BSDF; by the lights; both, weighed by the power heuristic.",
        &strip(&images.iter().collect::<Vec<_>>()),
        1.0,
    );
    sheet.command(c.command("veach-plates", "--spp 16"));
    Ok(sheet.finish())
}
