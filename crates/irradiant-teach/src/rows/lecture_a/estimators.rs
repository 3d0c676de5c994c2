//! Solving the reflection equation: what to sample (A21 to A27, A51).

use super::super::shared::{fit, reflected, strip};
use crate::context::{Context, Setup};
use crate::estimate::{Estimate, whole};
use crate::row::{Outcome, Row};
use crate::scenes::{self, at_the_origin, disk_light, film, quad};
use crate::sheet::Sheet;
use crate::walk::{Direct, Directions, Emission, Roulette, Walk};
use irradiant::Error;

/// A21 to A27, A51.
pub const ROWS: &[Row] = &[
    Row {
        id: "A21",
        name: "Solving the reflection equation: choices for p(w)",
        says: "Draw directions uniformly, by the BRDF, or by the lights.",
        check: "The three, at equal depth on one scene, agree with the production estimator.",
        run: three_choices,
    },
    Row {
        id: "A22",
        name: "The estimator 1/N sum f Li cos / p",
        says: "Unbiased for any p that is positive where f Li is.",
        check: "The error of independent samples falls as N^-1/2 over 2^2..2^10 samples; that of stratified ones faster.",
        run: slope,
    },
    Row {
        id: "A23",
        name: "Hemisphere against light sampling",
        says: "With as many samples, sampling the light is far less noisy.",
        check: "Variance ratio of direct light in the Cornell box, one sample each.",
        run: hemisphere_against_light,
    },
    Row {
        id: "A24",
        name: "DirectLightingSampleUniform",
        says: "pdf = 1 / (2 pi).",
        check: "Literally: a disk lamp over a floor has its closed form; under a point light every sample is 0, as it must be.",
        run: sample_uniform,
    },
    Row {
        id: "A25",
        name: "DirectLightingSampleBRDF",
        says: "Directions by the BRDF.",
        check: "Literally: the disk lamp's closed form; and it is exact for a mirror that shows a lamp, where the other two return 0.",
        run: sample_brdf,
    },
    Row {
        id: "A26",
        name: "DirectLightingSampleLights",
        says: "L, wi, pdf from the lights.",
        check: "Literally: closed forms of a disk lamp and of a point light.",
        run: sample_lights,
    },
    Row {
        id: "A27",
        name: "scene.shadowIntersection",
        says: "Returns 0 when blocked.",
        check: "Its two meanings: a small lamp before a large one has its closed form by directions and by light samples; a light's own point is not in its own shadow.",
        run: shadow_intersection,
    },
    Row {
        id: "A51",
        name: "Recall: importance sampling (figure)",
        says: "Solid-angle against light-area sampling.",
        check: "The variance ratio of A23.",
        run: |c| Ok(c.inherit(&["A23"])),
    },
];

/// The slides' direct lighting, each with no more than it says.
const UNIFORM: Walk = Walk {
    direct: Direct::Chance,
    directions: Directions::Uniform,
    roulette: Roulette::None,
    emission: Emission::Everywhere,
    max_depth: Some(1),
    constant_glass: false,
    wrong: crate::walk::Wrong::Nothing,
};
const BRDF: Walk = Walk { directions: Directions::Bsdf, ..UNIFORM };
const LIGHTS: Walk = Walk { direct: Direct::OneLight, emission: Emission::AtTheEye, ..BRDF };

fn three_choices(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let text = film(8)
        + "LookAt 0 2 -4  0 0.3 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\nWorldBegin\n"
        + "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" \"rgb L\" [ 3 2 4 ]\nTranslate 0 3 -.5\nShape \"sphere\" \"float radius\" 1.2\nAttributeEnd\n"
        + "Material \"diffuse\" \"rgb reflectance\" [ .7 .6 .5 ]\n"
        + &quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]])
        + "Material \"conductor\" \"float roughness\" 0.4\nTranslate 0 .6 0\nShape \"sphere\" \"float radius\" .6\n";
    let run = |walk: &dyn crate::estimate::Estimator, spp| -> Result<Estimate, Error> {
        Ok(whole(&*c.scene("three-choices", &text, Setup::square(8, spp))?, walk, spp))
    };
    let production = run(&*c.production(Some(1)), c.spp(1024))?;
    sheet.agree("uniform directions", &run(&UNIFORM, c.spp(8192))?, &production, 0.07);
    sheet.agree("directions by the BRDF", &run(&BRDF, c.spp(4096))?, &production, 0.07);
    sheet.agree("light samples", &run(&LIGHTS, c.spp(4096))?, &production, 0.07);
    for strategy in ["uniform", "bsdf", "lights"] {
        sheet.command(c.command("three-choices", &format!("--integrator direct --estimator technique={strategy}")));
    }
    Ok(sheet.finish())
}

fn slope(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    // One value for all pixels, known in closed form: E / (2 pi).
    let expected = 5.0 / (1.0 + 0.49) * 0.5;
    let text = at_the_origin(32, 0.4, &disk_light(1.0, 0.7, 5.0));
    let points = |sampler: &str, period: u32| -> Result<f64, Error> {
        let mut found = vec![];
        for power in [2, 4, 6, 8, 10] {
            let spp = 1 << power;
            let text = text.replace("independent", sampler);
            let scene = c.scene("disk-lamp", &text, Setup::square(32, spp))?;
            // The mean of samples that repeat after a period is the mean of the period.
            let e = whole(&scene, &LIGHTS, spp.min(period));
            let square: f64 = e.mean.iter().map(|p| (p[1] / expected - 1.0).powi(2)).sum();
            found.push((f64::from(spp).ln(), 0.5 * (square / e.mean.len() as f64).ln()));
        }
        Ok(fit(&found).0)
    };
    let period = if c.faulty("samples-run-out") { 64 } else { u32::MAX };
    sheet.between("slope of log RMSE over log N, independent samples", points("independent", period)?, [-0.53, -0.47]);
    if c.noticed(&sheet) {
        return Ok(sheet.finish());
    }
    sheet.at_most("slope, stratified samples (zsobol)", points("zsobol", u32::MAX)?, -0.55);
    Ok(sheet.finish())
}

fn hemisphere_against_light(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let spp = c.spp(64);
    let size = c.side(48);
    let run = |walk: &Walk, spp: u32| -> Result<Estimate, Error> {
        Ok(reflected(&*c.scene("cornell-box", &scenes::cornell(), Setup::square(size, spp))?, walk, spp))
    };
    let (uniform, lights) = (run(&UNIFORM, 4 * spp)?, run(&LIGHTS, spp)?);
    // What the eye sees of the lamp itself has no variance in either.
    sheet.at_least(
        "variance of uniform directions over that of light samples",
        uniform.sample_variance() / lights.sample_variance(),
        10.0,
    );
    sheet.agree("they estimate the same", &uniform, &lights, 0.25);
    let side = c.side(128);
    let picture = |walk: &Walk| -> Result<_, Error> {
        Ok(whole(&*c.scene("cornell-box", &scenes::cornell(), Setup::square(side, 4))?, walk, 4).image())
    };
    sheet.picture(
        "A23-pair",
        "Four samples of the hemisphere, four samples of the lamp.",
        &strip(&[&picture(&UNIFORM)?, &picture(&LIGHTS)?]),
        0.0,
    );
    sheet.command(c.command("cornell-box", "--spp 4 --integrator direct --estimator technique=uniform"));
    Ok(sheet.finish())
}

fn closed_form(c: &Context, sheet: &mut Sheet, walk: &Walk, spp: u32, power: f64) -> Result<(), Error> {
    let text = at_the_origin(4, 0.4, &disk_light(1.0, 0.7, 5.0));
    let e = whole(&*c.scene("disk-lamp", &text, Setup::square(4, spp))?, walk, spp);
    sheet.is("disk lamp over a floor: L r^2 / (r^2 + h^2) rho", &e, 5.0 / 1.49 * 0.5, power);
    Ok(())
}

fn point_light(c: &Context, walk: &Walk) -> Result<Estimate, Error> {
    let text = at_the_origin(4, 3.0, "LightSource \"point\" \"rgb I\" [ 2 2 2 ] \"point3 from\" [ 3 4 0 ]\n");
    Ok(whole(&*c.scene("point-light", &text, Setup::square(4, 256))?, walk, 256))
}

fn sample_uniform(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    closed_form(c, &mut sheet, &UNIFORM, c.spp(4096), 0.05)?;
    let dark = point_light(c, &UNIFORM)?;
    sheet.at_most("under a point light: greatest pixel", dark.mean.iter().map(|p| p[1]).fold(0.0, f64::max), 0.0);
    sheet.command(c.command("disk-lamp", "--integrator direct --estimator technique=uniform"));
    Ok(sheet.finish())
}

/// A mirror that shows a lamp of radiance 2, 2, 2 over the whole view; Fresnel reflectance 0.8 along the normal.
fn mirror_and_lamp() -> String {
    film(4)
        + "LookAt 0 3 0  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" 0.5\nWorldBegin\n"
        + "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" \"rgb L\" [ 2 2 2 ] \"bool twosided\" true\nTranslate 0 5 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" 4\nAttributeEnd\n"
        + "Material \"conductor\" \"rgb reflectance\" [ .8 .8 .8 ] \"float roughness\" 0\n"
        + &quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]])
}

fn sample_brdf(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    closed_form(c, &mut sheet, &BRDF, c.spp(4096), 0.05)?;
    let run = |walk: &Walk| -> Result<Estimate, Error> {
        Ok(whole(&*c.scene("mirror-lamp", &mirror_and_lamp(), Setup::square(4, 16))?, walk, 16))
    };
    let by_brdf = run(&BRDF)?;
    let worst = by_brdf.mean.iter().map(|p| (p[1] / 1.6 - 1.0).abs()).fold(0.0, f64::max);
    sheet.at_most("a lamp in a mirror: worst pixel against F L (relative)", worst, 1e-4);
    sheet.at_most("the same by light samples alone (0: the expected failure)", run(&LIGHTS)?.grey(), 0.0);
    sheet.command(c.command("mirror-lamp", "--integrator direct --estimator technique=bsdf"));
    Ok(sheet.finish())
}

fn sample_lights(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    closed_form(c, &mut sheet, &LIGHTS, c.spp(4096), 0.05)?;
    let e = point_light(c, &LIGHTS)?;
    sheet.close("point light: I cos / d^2 rho / pi", e.grey(), 2.0 * 0.8 / 25.0 * 0.5 / std::f64::consts::PI, 1e-5);
    sheet.command(c.command("point-light", "--integrator direct --estimator technique=lights"));
    Ok(sheet.finish())
}

fn shadow_intersection(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    // On the axis below both disks: the front one covers sin^2 of its angle, the back one what is left of its own.
    let (front, back) = ((0.3f64, 0.6f64, 8.0), (1.2f64, 1.0f64, 1.0));
    let sin2 = |(r, h, _): (f64, f64, f64)| r * r / (r * r + h * h);
    let expected = 0.5 * (front.2 * sin2(front) + back.2 * (sin2(back) - sin2(front)));
    let text = at_the_origin(4, 0.4, &(disk_light(front.0, front.1, front.2) + &disk_light(back.0, back.1, back.2)));
    let wrong = c.wrong();
    for (name, walk, spp) in [
        ("directions uniformly", UNIFORM, 8192),
        ("directions by the BRDF", BRDF, 8192),
        ("light samples", LIGHTS, 8192),
    ] {
        let spp = c.spp(spp);
        let e = whole(&*c.scene("lamp-behind-lamp", &text, Setup::square(4, spp))?, &walk.wrong(wrong), spp);
        sheet.is(&format!("a lamp before a lamp: {name}"), &e, expected, 0.06);
    }
    let e = whole(
        &*c.scene("lamp-behind-lamp", &text, Setup::square(4, c.spp(2048)))?,
        &*c.production(Some(1)),
        c.spp(2048),
    );
    sheet.is("a lamp before a lamp: production", &e, expected, 0.06);
    // A light's own point ends the shadow ray: nothing of the lamp is in the way of itself, at any size.
    for scale in [1e-3, 1.0, 1e4] {
        let text = at_the_origin(4, 0.4, &disk_light(1.0, 0.7, 5.0))
            .replace("WorldBegin\n", &format!("WorldBegin\nScale {scale} {scale} {scale}\n"));
        let text = text
            .replace("LookAt 0.0001 0.4 0.0001", &format!("LookAt {} {} {}", 1e-4 * scale, 0.4 * scale, 1e-4 * scale));
        let spp = c.spp(1024);
        let e = whole(&*c.scene("disk-lamp-scaled", &text, Setup::square(4, spp))?, &LIGHTS, spp);
        sheet.is(&format!("light samples reach their lamp at scale {scale}"), &e, 5.0 / 1.49 * 0.5, 0.05);
    }
    Ok(sheet.finish())
}
