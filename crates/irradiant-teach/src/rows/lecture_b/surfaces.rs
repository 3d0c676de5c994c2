//! Mirrors, glass, emitting surfaces (B33 to B38).

use super::super::hard_paths;
use crate::context::{Context, Setup};
use crate::estimate::{Estimate, Estimator, Production, whole};
use crate::row::{Outcome, Row};
use crate::scenes::{film, furnace_with, quad};
use crate::sheet::{Sheet, number};
use crate::walk::{Emission, Roulette, Walk};
use irradiant::Error;

/// B33 to B38.
pub const ROWS: &[Row] = &[
    Row {
        id: "B33",
        name: "Specular BRDF: F delta / cos",
        says: "The cosine cancels.",
        check: "A mirror's pixel is F times the environment (A12).",
        run: |c| Ok(c.inherit(&["A12"])),
    },
    Row {
        id: "B34",
        name: "Handle specular as a distinct case",
        says: "Probability 1, no cosine, a flag in the sample.",
        check: "A61.",
        run: |c| Ok(c.inherit(&["A61"])),
    },
    Row {
        id: "B35",
        name: "Glass: reflected or refracted at random",
        says: "With constant or Fresnel probability, which belongs to the path's density.",
        check: "Both choices agree, Fresnel with less variance; a glass ball vanishes in a furnace; a camera in glass sees eta^2 Le; a lamp inside glass has T Le / eta^2.",
        run: glass,
    },
    Row {
        id: "B36",
        name: "Refractive objects produce a lot of noise",
        says: "In path tracing.",
        check: "Fireflies of a caustic (largest over median tile deviation), and how much caustic methods reduce them.",
        run: hard_paths::refractive_noise,
    },
    Row {
        id: "B37",
        name: "Emitting surfaces are part of the geometry",
        says: "One description.",
        check: "A lamp made of a mesh: found by rays alone and by light samples alone, it gives the same picture.",
        run: mesh_lights,
    },
    Row {
        id: "B38",
        name: "Emission on accidental hits",
        says: "Not added, except for eye rays and after specular surfaces.",
        check: "A lamp seen straight, in a mirror, through a pane and by diffuse light, each in closed form, by the rule and by weighing; without the rule diffuse light is twice too bright.",
        run: four_ways,
    },
];

fn glass(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let ball = "Material \"dielectric\" \"float eta\" 1.5\nShape \"sphere\"\n";
    let spp = c.spp(1024);
    let run = |name: &str, text: &str, e: &dyn Estimator| -> Result<Estimate, Error> {
        Ok(whole(&*c.scene(name, text, Setup::square(8, spp))?, e, spp))
    };
    let text = furnace_with(8, 0.5, ball);
    let production = c.production(None);
    sheet.is(
        "a glass ball in a furnace of albedo 0.5: Le / (1 - rho)",
        &run("glass-furnace", &text, &*production)?,
        2.0,
        0.03,
    );
    // An uneven sky, so that where a ray goes matters.
    let sky = film(8)
        + "LookAt 0 0 -4  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 26\nWorldBegin\nAttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" \"rgb L\" [ 5 5 5 ] \"bool twosided\" true\nTranslate 1 4 3\nShape \"sphere\" \"float radius\" 2\nAttributeEnd\nLightSource \"infinite\" \"rgb L\" [ .3 .3 .3 ]\n"
        + ball;
    let (fresnel, constant) =
        (run("glass-ball", &sky, &Walk::PATH)?, run("glass-ball", &sky, &Walk { constant_glass: true, ..Walk::PATH })?);
    sheet.agree("glass by Fresnel and by constant probability", &fresnel, &constant, 0.2);
    sheet.at_least("variance, constant over Fresnel", constant.sample_variance() / fresnel.sample_variance(), 1.2);
    sheet.agree("production and the witness", &run("glass-ball", &sky, &*production)?, &fresnel, 0.1);
    let inside = film(8)
        + "Camera \"perspective\" \"float fov\" 60\nWorldBegin\nLightSource \"infinite\" \"rgb L\" [ 1 1 1 ]\nMaterial \"dielectric\" \"float eta\" 1.5\nShape \"sphere\" \"float radius\" 2\n";
    sheet.is("a camera inside glass under light of 1: eta^2", &run("inside-glass", &inside, &*production)?, 2.25, 0.03);
    // A black lamp of radius 1/4 in the middle of glass: along the axis T(0) Le / eta^2, what is reflected is absorbed.
    let lamp = film(8)
        + "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 0.01\nWorldBegin\nAttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" \"rgb L\" [ 9 9 9 ]\nShape \"sphere\" \"float radius\" 0.25\nAttributeEnd\n"
        + ball;
    sheet.is(
        "a lamp inside glass: (1 - F) Le / eta^2",
        &run("lamp-in-glass", &lamp, &*production)?,
        9.0 * 0.96 / 2.25,
        0.03,
    );
    sheet.command(
        c.command("glass-ball", "--integrator partitioned --estimator emission=specular --estimator glass=constant"),
    );
    Ok(sheet.finish())
}

fn mesh_lights(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let text = film(8)
        + "LookAt 0 2 -4  0 0.3 0  0 1 0\nCamera \"perspective\" \"float fov\" 40\nWorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ .7 .6 .5 ]\n"
        + &quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]])
        + "Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" \"rgb L\" [ 3 2 4 ]\nTranslate 0 2.2 -.5\nShape \"loopsubdiv\" \"integer levels\" 2 \"integer indices\" [ 0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5 ] \"point3 P\" [ 1.2 0 0  -1.2 0 0  0 0 1.2  0 0 -1.2  0 1.2 0  0 -1.2 0 ]\n";
    let run = |e: &dyn Estimator, spp: u32| -> Result<Estimate, Error> {
        let spp = c.spp(spp);
        Ok(whole(&*c.scene("mesh-lamp", &text, Setup::square(8, spp))?, e, spp))
    };
    let samples = run(&Walk { emission: Emission::AtTheEye, ..Walk::PATH }.depth(1), 2048)?;
    let rays = run(&Walk { roulette: Roulette::None, ..Walk::TRY_1 }.depth(1), 8192)?;
    sheet.agree("found by rays and by light samples", &rays, &samples, 0.12);
    sheet.agree("production and light samples", &run(&Production::limited(1), 2048)?, &samples, 0.12);
    let lights = c.scene("mesh-lamp", &text, Setup::default())?.lights.len();
    sheet.between("lights of one mesh (its triangles, or pairs of them)", lights as f64, [32.0, 128.0]);
    Ok(sheet.finish())
}

fn four_ways(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let lamp = "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" \"rgb L\" [ 4 4 4 ] \"bool twosided\" true\nTranslate 0 1.5 0\nRotate 90 1 0 0\nShape \"disk\" \"float radius\" 1\nAttributeEnd\n";
    // All look down or up along the axis of a disk lamp at height 1.5.
    let view = |from: f64, to: f64| {
        film(2)
            + &format!(
                "LookAt 0.0001 {from} 0.0001  0 {to} 0  0 0 1\nCamera \"perspective\" \"float fov\" 0.01\nWorldBegin\n{lamp}"
            )
    };
    let floor = quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]]);
    let pane = quad([[-2.0, 1.0, -2.0], [2.0, 1.0, -2.0], [2.0, 1.0, 2.0], [-2.0, 1.0, 2.0]]);
    // Two interfaces of reflectance r, all orders summed.
    let r = 0.04f64;
    let reflected = r + (1.0 - r) * (1.0 - r) * r / (1.0 - r * r);
    let form = 1.0 / (1.0 + 2.25);
    let cases = [
        ("straight", view(0.5, 1.5), 4.0),
        (
            "in a mirror",
            view(0.5, 0.0) + "Material \"conductor\" \"rgb reflectance\" [ .8 .8 .8 ] \"float roughness\" 0\n" + &floor,
            3.2,
        ),
        (
            "through a pane",
            view(0.5, 1.5) + "Material \"thindielectric\" \"float eta\" 1.5\n" + &pane,
            4.0 * (1.0 - reflected),
        ),
        (
            "by diffuse light",
            view(0.5, 0.0) + "Material \"diffuse\" \"rgb reflectance\" [ .5 .5 .5 ]\n" + &floor,
            4.0 * form * 0.5,
        ),
    ];
    let spp = c.spp(4096);
    let mut diffuse = vec![];
    let estimators: [(&str, Box<dyn Estimator>); 2] = [
        ("the rule", Box::new(Walk::PATH.depth(2).wrong(c.wrong()))),
        ("weighed (production)", Box::new(Production::limited(2))),
    ];
    for (how, estimator) in &estimators {
        for (name, text, expected) in &cases {
            let e = whole(&*c.scene("four-ways", text, Setup::square(2, spp))?, &**estimator, spp);
            sheet.is(&format!("{name}, by {how}"), &e, *expected, 0.05);
            if *name == "by diffuse light" {
                diffuse.push(e.grey());
            }
        }
    }
    let both = Walk { emission: Emission::Everywhere, ..Walk::PATH }.depth(2);
    let e = whole(&*c.scene("four-ways-diffuse", &cases[3].1, Setup::square(2, spp))?, &both, spp);
    sheet.close("without the rule, diffuse light over what it should be", e.grey() / cases[3].2, 2.0, 0.05);
    sheet.note(format!("Pane: its two interfaces reflect {} in all.", number(reflected)));
    sheet.command(c.command("four-ways-diffuse", "--integrator partitioned --estimator emission=always"));
    Ok(sheet.finish())
}
