//! Several lights, point lights, specular surfaces (A58 to A62).

use super::super::shared::reflected;
use crate::context::{Context, Setup};
use crate::estimate::{Estimate, Estimator, whole};
use crate::row::{Outcome, Row};
use crate::scenes::{self, at_the_origin, film, quad};
use crate::sheet::{Sheet, number};
use crate::surface::Surface;
use crate::walk::{Direct, Walk};
use irradiant::Error;
use irradiant::math::{Point2, Vec3};
use irradiant_testkit::Rng;

/// A58 to A62.
pub const ROWS: &[Row] = &[
    Row {
        id: "A58",
        name: "Multiple light sources: N x M samples",
        says: "Loop over all N lights, M samples each.",
        check: "M = 1 and 4 on a scene of four lamps and two point lights agree; variance falls with M, shadow rays rise as N M (one for a point light).",
        run: all_lights,
    },
    Row {
        id: "A59",
        name: "Multiple light sources: a single sample",
        says: "Choose light i with p_i; weigh by 1 / (p_i p_L). How to choose well?",
        check: "Uniform, by power and by the light tree all agree with A58; with 1000 lamps the tree has a tenth of uniform's variance and needs under 5 % of A58's shadow rays for its variance.",
        run: one_light,
    },
    Row {
        id: "A60",
        name: "Point lights",
        says: "Zero probability to be met: one sample straight at them.",
        check: "Point, spot and distant lights in closed form, every sample the same.",
        run: point_lights,
    },
    Row {
        id: "A61",
        name: "Ideal specular materials",
        says: "One sample along the reflected or refracted direction.",
        check: "Delta lobes say so, have f = 0 and density 0 everywhere, draw the mirror or refracted direction; a room with a mirror and a glass ball has no sample that is not finite.",
        run: specular,
    },
    Row {
        id: "A62",
        name: "Zero probability of matching a delta",
        says: "Random directions never meet a point light.",
        check: "A24's estimator under a point light is exactly 0, while light samples are right.",
        run: |c| Ok(c.inherit(&["A24", "A60"])),
    },
];

fn six_lights() -> String {
    let mut text = film(8) + "LookAt 0 3 -5  0 0 0.2  0 1 0\nCamera \"perspective\" \"float fov\" 2\nWorldBegin\n";
    for (x, z, r, l) in [(-2.0, 0.0, 0.2, 20.0), (2.0, 1.0, 0.3, 12.0), (0.0, 2.0, 0.4, 6.0), (0.5, -1.5, 0.15, 30.0)] {
        text += &format!(
            "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" \"rgb L\" [ {l} {l} {l} ]\nTranslate {x} 1.5 {z}\nShape \"sphere\" \"float radius\" {r}\nAttributeEnd\n"
        );
    }
    text += "LightSource \"point\" \"rgb I\" [ 2 1 1 ] \"point3 from\" [ -1 2 -1 ]\nLightSource \"point\" \"rgb I\" [ 1 1 3 ] \"point3 from\" [ 1 2 0 ]\n";
    text + "Material \"diffuse\" \"rgb reflectance\" [ .7 .7 .7 ]\n"
        + &quad([[-6.0, 0.0, -6.0], [6.0, 0.0, -6.0], [6.0, 0.0, 6.0], [-6.0, 0.0, 6.0]])
}

fn all_lights(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let spp = c.spp(512);
    let run = |m: u32| -> Result<Estimate, Error> {
        Ok(whole(
            &*c.scene("six-lights", &six_lights(), Setup::square(8, spp))?,
            &Walk { direct: Direct::AllLights(m), ..Walk::PATH }.depth(1),
            spp,
        ))
    };
    let (one, four) = (run(1)?, run(4)?);
    sheet.agree("M = 1 and M = 4", &one, &four, 0.05);
    let one_light = whole(
        &*c.scene("six-lights", &six_lights(), Setup::square(8, 4 * spp))?,
        &*c.production_of_one_light(Some(1)),
        4 * spp,
    );
    sheet.agree("M = 4 and production with one light at a time", &four, &one_light, 0.06);
    let chosen = whole(&*c.scene("six-lights", &six_lights(), Setup::square(8, spp))?, &*c.production(Some(1)), spp);
    sheet.agree("M = 4 and production, which chooses one of six", &four, &chosen, 0.06);
    sheet.at_most("variance of a sample, M = 4 over M = 1", four.sample_variance() / one.sample_variance(), 0.6);
    // Four lamps and two point lights: 4 M + 2, but for lamps under the horizon, of which there are none here.
    let rays = |e: &Estimate| e.stats.shadow_rays as f64 / e.stats.paths as f64;
    sheet.between("shadow rays a path over 4 M + 2, M = 1", rays(&one) / 6.0, [0.85, 1.0]);
    sheet.between("shadow rays a path, M = 4 over M = 1, of 18 / 6", rays(&four) / rays(&one) / 3.0, [0.98, 1.02]);
    sheet.command(c.command(
        "six-lights",
        "--integrator partitioned --estimator emission=specular --estimator lights=all --estimator samples=4",
    ));
    Ok(sheet.finish())
}

/// A floor of 120 by 120 under 1000 round lamps of very different power, close to it.
fn thousand_lamps(selector: &str) -> String {
    let mut rng = Rng::new(77);
    let mut text = film(8)
        + &format!("Integrator \"path\" \"string lightsampler\" \"{selector}\"\n")
        + "LookAt 0 0.35 -4  0 0 -1  0 1 0\nCamera \"perspective\" \"float fov\" 3\nWorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ .5 .5 .5 ]\n"
        + &quad([[-60.0, 0.0, -60.0], [60.0, 0.0, -60.0], [60.0, 0.0, 60.0], [-60.0, 0.0, 60.0]]);
    for _ in 0..1000 {
        let (x, z) = (120.0 * rng.next_f64() - 60.0, 120.0 * rng.next_f64() - 60.0);
        let y = 0.4 + 0.5 * rng.next_f64();
        let l = (4.0 * rng.next_f64()).exp();
        text += &format!(
            "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ {l:.2} {l:.2} {l:.2} ] \"bool twosided\" true\nTranslate {x:.3} {y:.3} {z:.3}\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" 0.3\nAttributeEnd\n"
        );
    }
    text
}

fn one_light(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let run = |name: &str, text: &str, e: &dyn Estimator, spp: u32| -> Result<Estimate, Error> {
        Ok(reflected(&*c.scene(name, text, Setup::square(8, spp))?, e, spp))
    };
    let six = |selector: &str| {
        six_lights()
            .replace("WorldBegin", &format!("Integrator \"path\" \"string lightsampler\" \"{selector}\"\nWorldBegin"))
    };
    let spp = c.spp(2048);
    let all = run("six-lights", &six_lights(), &Walk { direct: Direct::AllLights(1), ..Walk::PATH }.depth(1), spp)?;
    for selector in ["uniform", "power", "bvh"] {
        let e = run(&format!("six-lights-{selector}"), &six(selector), &*c.production_of_one_light(Some(1)), spp)?;
        sheet.agree(&format!("six lights, {selector}, and A58"), &e, &all, 0.1);
    }
    let many = |selector: &str, spp: u32| {
        run(&format!("lamps-{selector}"), &thousand_lamps(selector), &Walk::PATH.depth(1), spp)
    };
    let (uniform, power, tree) = (many("uniform", c.spp(2048))?, many("power", c.spp(2048))?, many("bvh", c.spp(512))?);
    sheet.agree("1000 lamps, tree and power", &tree, &power, 0.6);
    sheet.at_least(
        "1000 lamps: variance of uniform over the tree's, one sample each",
        uniform.sample_variance() / tree.sample_variance(),
        10.0,
    );
    let every = run(
        "lamps-bvh",
        &thousand_lamps("bvh"),
        &Walk { direct: Direct::AllLights(1), ..Walk::PATH }.depth(1),
        c.spp(4),
    )?;
    sheet.agree("1000 lamps, tree and all lights", &tree, &every, 0.6);
    // Shadow rays that reach the variance of one sample of each light, against 1000 (less what is under the horizon).
    let rays = every.stats.shadow_rays as f64 / every.stats.paths as f64;
    let share = |e: &Estimate| {
        let own = e.stats.shadow_rays as f64 / e.stats.paths as f64;
        100.0 * e.sample_variance() / every.sample_variance() * own / rays
    };
    let by_tree = share(&tree);
    sheet.note(format!(
        "One sample of each light: {} shadow rays. For as little variance the tree's samples need {} % of them.",
        number(rays),
        number(by_tree)
    ));
    // The best of several candidates of the tree, with one shadow ray.
    let options = [("emission", "never"), ("lights", "resampled"), ("samples", "16")];
    let best = match c.integrator("partitioned", &options, Some(1))? {
        None => by_tree,
        Some(integrator) => {
            let spp = c.spp(512);
            let scene = c.scene("lamps-bvh", &thousand_lamps("bvh"), Setup::square(8, spp))?;
            let (e, _) = crate::estimate::by_integrator(&scene, &*integrator, spp);
            sheet.agree("1000 lamps, the best of 16 candidates and the tree", &e, &tree, 0.3);
            share(&e)
        }
    };
    sheet.at_most("the best selector's shadow rays for A58's variance, % of A58's", best.min(by_tree), 5.0);
    sheet.command(
        c.command("lamps-bvh", "--integrator partitioned --estimator lights=resampled --estimator samples=16"),
    );
    sheet.note("Selectors that learn from the render, and splitting in the tree (several lights of one walk down it), are not built.");
    sheet.command(c.command("lamps-bvh", "--spp 64"));
    Ok(sheet.finish())
}

fn point_lights(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let production = c.production(None);
    let cases = [
        (
            "distant",
            "LightSource \"distant\" \"rgb L\" [ 2 2 2 ] \"point3 from\" [ 3 4 0 ] \"point3 to\" [ 0 0 0 ]\n",
            1.6,
        ),
        ("point", "LightSource \"point\" \"rgb I\" [ 2 2 2 ] \"point3 from\" [ 3 4 0 ]\n", 1.6 / 25.0),
        (
            "spot, on its axis",
            "LightSource \"spot\" \"rgb I\" [ 2 2 2 ] \"point3 from\" [ 3 4 0 ] \"point3 to\" [ 0 0 0 ]\n",
            1.6 / 25.0,
        ),
    ];
    for (name, light, irradiance) in cases {
        let scene = c.scene("delta-light", &at_the_origin(2, 3.0, light), Setup::square(2, 64))?;
        for (how, e) in [
            ("production", whole(&scene, &*production, 64)),
            ("all lights, M = 16", whole(&scene, &Walk { direct: Direct::AllLights(16), ..Walk::PATH }, 64)),
        ] {
            sheet.close(&format!("{name}, {how}: E rho / pi"), e.grey(), irradiance * 0.5 / std::f64::consts::PI, 1e-4);
            sheet.at_most(
                &format!("{name}, {how}: variance of samples over the square of the mean"),
                e.sample_variance() / e.grey().powi(2),
                1e-8,
            );
            sheet.at_most(
                &format!("{name}, {how}: shadow rays a path"),
                e.stats.shadow_rays as f64 / e.stats.paths as f64,
                1.0,
            );
        }
    }
    Ok(sheet.finish())
}

fn specular(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let mut rng = Rng::new(c.seed());
    for (name, material) in [
        ("mirror", "Material \"conductor\" \"float roughness\" 0\n"),
        ("glass", "Material \"dielectric\" \"float eta\" 1.5\n"),
    ] {
        let surface = Surface::new(c, material)?;
        sheet.holds(
            &format!("{name}: flags"),
            format!("{:?}", surface.bsdf().flags()),
            "specular, nothing that light samples reach",
            "either flag wrong",
            surface.bsdf().flags().is_specular() && !surface.bsdf().flags().is_non_specular(),
        );
        let (mut wrong, mut off) = (vec![], 0.0f64);
        let n = 2000;
        for _ in 0..n {
            let v = |d: [f32; 3]| Vec3::new(d[0], d[1], d[2]);
            let (wo, wi) = (v(rng.upper_direction()), v(rng.direction()));
            if !surface.f(wo, wi).is_black() || surface.pdf(wo, wi) != 0.0 {
                wrong.push(format!("{wo:?} {wi:?}"));
            }
            let Some(s) = surface.sample(wo, rng.next_f32(), Point2::new(0.5, 0.5)) else { continue };
            let expected = if s.wi.z > 0.0 {
                Vec3::new(-wo.x, -wo.y, wo.z)
            } else {
                let z2 = 1.0 - (wo.x * wo.x + wo.y * wo.y) / 2.25;
                Vec3::new(-wo.x / 1.5, -wo.y / 1.5, -z2.sqrt())
            };
            off = off.max(f64::from((s.wi - expected).length()));
        }
        sheet.none_of(&format!("{name}: directions with f or density other than 0"), n, &wrong);
        sheet.at_most(&format!("{name}: distance of samples from Snell's and the mirror's directions"), off, 1e-5);
    }
    let spp = c.spp(64);
    let picture = c.render(
        "two-balls",
        scenes::TWO_BALLS,
        Setup { size: Some([64, 48]), spp: Some(spp), spectral: true, ..Setup::default() },
    )?;
    sheet.at_most(
        "samples that are not finite or out of range, room with two balls",
        picture.header.samples_refused as f64,
        0.0,
    );
    Ok(sheet.finish())
}
