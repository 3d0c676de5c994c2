//! What the lecture opens with: shadows, caustics, inter-reflection, richness (A01 to A09).

use super::super::shared::{balls_apart, cornell_by_bounce, kind_of_light, strip};
use crate::caustic::caustic;
use crate::context::{Context, Setup};
use crate::estimate::{Estimate, take_apart, whole};
use crate::row::{Outcome, Row};
use crate::scenes::{self, film_of, quad, smooth_film};
use crate::sheet::Sheet;
use crate::walk::{Direct, Directions, Emission, Roulette, Walk};
use irradiant::Error;
use irradiant::image::{FileFormat, Image, write};
use irradiant::math::Point2;

/// A01 to A09.
pub const ROWS: &[Row] = &[
    Row {
        id: "A01",
        name: "Course roadmap",
        says: "Rendering stands on sampling, materials, cameras, textures, geometry and acceleration together.",
        check: "One scene with all of them: three samplers agree; taking away the lens, the texture or the subdivision changes the picture.",
        run: roadmap,
    },
    Row {
        id: "A02",
        name: "Hard shadows",
        says: "Light straight from a point: the shadow's edge is sharp.",
        check: "The edge of a point light's shadow is at most one pixel wide; a rectangular lamp's penumbra has the width that similar triangles predict.",
        run: hard_shadows,
    },
    Row {
        id: "A03",
        name: "+ Caustics",
        says: "Specular things focus light onto others.",
        check: "Direct light and the layer L S+ D S* E from one run add up to what an estimator without light samples finds for both; L S+ D E is what paths from the lamp bring.",
        run: caustics,
    },
    Row {
        id: "A04",
        name: "+ Inter-reflections = global illumination",
        says: "Hard shadows, caustics and inter-reflection add up to global illumination.",
        check: "Three layers of one run add up to its picture, and that agrees with another estimator's.",
        run: three_layers,
    },
    Row {
        id: "A05",
        name: "Visual richness from indirect lighting",
        says: "Indirect light makes pictures rich.",
        check: "The Cornell box's ceiling, which the lamp cannot see, is exactly 0 in the direct picture and bright in the full one.",
        run: indirect,
    },
    Row {
        id: "A06",
        name: "Visual richness from complex lighting",
        says: "The same object under a point light and under an environment.",
        check: "Under a sky with a sun, sampling the environment has at most a tenth of the variance of uniform directions.",
        run: complex_lighting,
    },
    Row {
        id: "A07",
        name: "Visual richness from complex materials",
        says: "A still life lives from many materials.",
        check: "A still life with layered, glass, subsurface and textured materials renders as it stands.",
        run: |_| Ok(Outcome::waits("subsurface scattering is not built yet; the other materials are in A11 to A17")),
    },
    Row {
        id: "A09",
        name: "A ray tracer samples radiance along a ray",
        says: "A pixel is the radiance that arrives along its ray.",
        check: "An emitter of radiance 2, 3, 4 that fills the view has these values at any distance.",
        run: radiance_along_a_ray,
    },
];

fn roadmap(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let setup = Setup { size: Some([40, 30]), spp: Some(c.spp(128)), ..Setup::default() };
    let text = scenes::EVERYTHING;
    let production = c.production(None);
    let with = |name: &str, text: &str| -> Result<Estimate, Error> {
        Ok(whole(&*c.scene(name, text, setup)?, &*production, c.spp(128)))
    };
    let base = with("everything", text)?;
    for sampler in ["halton", "zsobol"] {
        // Their error is below that of independent samples, so that the comparison errs on the safe side.
        let other = with(&format!("everything-{sampler}"), &text.replace("independent", sampler))?;
        sheet.agree(&format!("independent and {sampler} samples"), &base, &other, 0.03);
    }
    let without = [
        ("lens", "\"float lensradius\" 0.2", "\"float lensradius\" 0"),
        ("texture", "\"rgb tex2\" [ 0.16 0.2 0.26 ]", "\"rgb tex2\" [ 0.75 0.72 0.68 ]"),
        ("subdivision", "\"integer levels\" 3", "\"integer levels\" 0"),
    ];
    for (part, from, to) in without {
        let other = with(&format!("everything-without-{part}"), &text.replace(from, to))?;
        let z = most_changed(&base, &other);
        sheet.at_least(&format!("most changed pixel without the {part}, standard errors"), z, 5.5);
    }
    let picture = c.render("everything", text, Setup { spp: Some(c.spp(32)), spectral: true, ..Setup::default() })?;
    sheet.picture(
        "A01-everything",
        "Lens, textures, subdivision, instances, metal, glass, paint.",
        &picture.image(),
        0.0,
    );
    sheet.command(c.command("everything", "--spp 64"));
    Ok(sheet.finish())
}

fn most_changed(a: &Estimate, b: &Estimate) -> f64 {
    let pixels = a.mean.iter().zip(&b.mean).zip(a.variance.iter().zip(&b.variance));
    pixels.map(|((a, b), (va, vb))| (a[1] - b[1]).abs() / (va[1] + vb[1]).sqrt()).fold(0.0, f64::max)
}

/// A floor seen from below a half plane x < 0 at height 1, a row of 64 pixels from x = -1 to 1.
fn shadow_row(light: &str, blocker: bool) -> String {
    let plane = quad([[-40.0, 1.0, -40.0], [0.0, 1.0, -40.0], [0.0, 1.0, 40.0], [-40.0, 1.0, 40.0]]);
    film_of(64, 1)
        + "LookAt 0 0.9 0  0 0 0  0 0 1\nCamera \"orthographic\" \"float screenwindow\" [ -1 1 -0.015625 0.015625 ]\nWorldBegin\n"
        + light
        + "Material \"diffuse\" \"rgb reflectance\" [ .5 .5 .5 ]\n"
        + &quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]])
        + if blocker { &plane } else { "" }
}

fn hard_shadows(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let direct = c.production(Some(1));
    let row = |name: &str, light: &str, blocker| -> Result<Estimate, Error> {
        let mut text = shadow_row(light, blocker);
        // The same random numbers with and without blocker: what is not blocked is equal bit by bit.
        text = text.replace("Sampler \"independent\"", "Sampler \"independent\" \"integer seed\" 5");
        let file = c.file(name, &text)?;
        let settings = irradiant::RenderSettings { color: irradiant::ColorMode::Rgb, ..Default::default() };
        Ok(whole(&irradiant::Job::new(&file, &settings)?.scene, &*direct, 256))
    };
    let point = "LightSource \"point\" \"rgb I\" [ 9 9 9 ] \"point3 from\" [ .5 4 0 ]\n";
    let (lit, shaded) = (row("point-lit", point, false)?, row("point-shadow", point, true)?);
    let between =
        (0..64).filter(|&x| shaded.mean[x][1] > 0.0 && shaded.mean[x][1] < 0.999 * lit.mean[x][1]).count() as f64;
    sheet.at_most("pixels between dark and lit, point light", between, 1.0);
    for r in [0.3f32, 0.9] {
        let made = if c.faulty("lamp-half-as-wide") { 0.5 * r } else { r };
        let (a, b) = (0.5 - made, 0.5 + made);
        let lamp = format!(
            "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 9 9 9 ] \"bool twosided\" true\n{}AttributeEnd\n",
            quad([[a, 4.0, -0.5], [b, 4.0, -0.5], [b, 4.0, 0.5], [a, 4.0, 0.5]])
        );
        let (lit, shaded) = (row("lamp-lit", &lamp, false)?, row("lamp-shadow", &lamp, true)?);
        let width = (0..64).filter(|&x| shaded.mean[x][1] > 0.0 && shaded.mean[x] != lit.mean[x]).count() as f64 / 32.0;
        // Similar triangles: a lamp of width 2 r at height 4, an edge at height 1. Two pixels' ends belong to neither.
        let predicted = f64::from(2.0 * r) / 3.0;
        sheet.between(
            &format!("penumbra of a lamp of width {}", 2.0 * r),
            width,
            [predicted - 1.0 / 32.0, predicted + 2.0 / 32.0],
        );
    }
    let scene = hard_and_soft(true);
    let sharp =
        c.render("point-light-ball", &scene, Setup { spp: Some(c.spp(16)), max_depth: Some(1), ..Setup::default() })?;
    let scene = hard_and_soft(false);
    let soft = c.render("lamp-ball", &scene, Setup { spp: Some(c.spp(32)), max_depth: Some(1), ..Setup::default() })?;
    sheet.picture("A02-hard", "A point light: the shadow's edge is a line.", &sharp.image(), 0.0);
    sheet.picture(
        "A02-soft",
        "A lamp of the same power: the edge is as wide as the lamp looks from it.",
        &soft.image(),
        0.0,
    );
    sheet.command(c.command("point-light-ball", "--max-depth 1"));
    Ok(sheet.finish())
}

fn hard_and_soft(point: bool) -> String {
    smooth_film(160)
        + "LookAt 0 2.2 -4  0 0.5 0.2  0 1 0\nCamera \"perspective\" \"float fov\" 42\nWorldBegin\n"
        + if point {
            "LightSource \"point\" \"rgb I\" [ 16 15 13 ] \"point3 from\" [ -1.6 2.8 -0.6 ]\n"
        } else {
            "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ 32.6 30.6 26.5 ]\nTranslate -1.6 2.8 -0.6\nShape \"sphere\" \"float radius\" 0.3952\nAttributeEnd\n"
        }
        + "Material \"diffuse\" \"rgb reflectance\" [ .6 .6 .58 ]\n"
        + &quad([[-9.0, 0.0, -9.0], [9.0, 0.0, -9.0], [9.0, 0.0, 9.0], [-9.0, 0.0, 9.0]])
        + "Material \"diffuse\" \"rgb reflectance\" [ .7 .35 .15 ]\nTranslate 0 .6 0\nShape \"sphere\" \"float radius\" .6\n"
}

fn caustics(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let parts = balls_apart(c)?;
    let spp = c.spp(384);
    let setup = Setup { size: Some([c.side(80), c.side(60)]), spp: Some(spp), ..Setup::default() };
    let scene = c.scene("two-balls", scenes::TWO_BALLS, setup)?;
    // No light samples at all: light is met by chance, and every path counts where it ends.
    let by_chance = Walk { direct: Direct::Chance, emission: Emission::Everywhere, ..Walk::PATH };
    let both = take_apart(&scene, &by_chance, spp, 1, &|p| (kind_of_light(p) < 2).then_some(0)).swap_remove(0);
    sheet.agree("direct + caustics against both at once", &parts[0].plus(1.0, &parts[1]), &both, 0.05);
    let share = parts[1].grey() / parts[3].grey();
    sheet.at_least("caustics' share of the picture", share, 0.01);
    // The other way round: paths from the lamp.
    let from_the_lamp = caustic(&*c.scene("two-balls", scenes::TWO_BALLS, setup)?, c.spp(128));
    sheet.agree("L S+ D E by paths from the eye and from the lamp", &parts[4].as_one(), &from_the_lamp.as_one(), 0.3);
    let side_by_side = strip(&[&parts[4].image(), &from_the_lamp.image()]);
    sheet.picture(
        "A03-caustics",
        "L S+ D E alone, light gathered by glass and mirror: by paths from the eye, which meet the lamp by chance, and by paths from the lamp.",
        &side_by_side,
        1.0,
    );
    sheet.command(c.command("two-balls", "--aov \"caustic=LS+DS*E\""));
    Ok(sheet.finish())
}

fn three_layers(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let parts = balls_apart(c)?;
    let sum = parts[0].plus(1.0, &parts[1]).plus(1.0, &parts[2]);
    let off = (0..sum.mean.len()).map(|i| (sum.mean[i][1] / parts[3].mean[i][1] - 1.0).abs()).fold(0.0, f64::max);
    sheet.at_most("layers' sum against the picture, worst pixel (relative)", off, 2e-6);
    let spp = c.spp(96);
    let setup = Setup { size: Some([c.side(80), c.side(60)]), spp: Some(spp), ..Setup::default() };
    let other = whole(&*c.scene("two-balls", scenes::TWO_BALLS, setup)?, &Walk::PATH, spp);
    sheet.agree("layers' sum against another estimator", &sum, &other, 0.05);
    let images = [parts[0].image(), parts[0].plus(1.0, &parts[1]).image(), parts[3].image()];
    sheet.picture(
        "A04-triptych",
        "Shadows; and caustics; and inter-reflection: one run, taken apart.",
        &strip(&images.iter().collect::<Vec<_>>()),
        0.5,
    );
    Ok(sheet.finish())
}

fn indirect(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let box_ = cornell_by_bounce(c)?;
    let direct = box_.terms[0].plus(1.0, &box_.terms[1]);
    let (w, side) = (box_.whole.width, c.side(64) as usize);
    // The ceiling in front of the lamp and beside it; the lamp shines downwards.
    let ceiling = |x: usize, y: usize| y > side / 20 && y < side / 12 && x > w * 3 / 10 && x < w * 7 / 10;
    let (dark, bright) = (direct.region(ceiling), box_.whole.region(ceiling));
    sheet.at_most("ceiling in the direct picture", dark.grey(), 0.0);
    let (mean, se) = bright.total()[1];
    sheet.at_least("ceiling in the full picture, standard errors above 0", mean / se, 20.0);
    sheet.picture(
        "A05-pair",
        "The Cornell box by direct light only, and by all light.",
        &strip(&[&direct.image(), &box_.whole.image()]),
        0.0,
    );
    sheet.command(c.command("cornell-box", "--max-depth 1"));
    sheet.command(c.command("cornell-box", "--max-depth none"));
    Ok(sheet.finish())
}

/// A clear sky with a sun, in the square map that environments use: mean about 1, the sun 20000 times as bright.
fn sun_sky(side: usize) -> Image {
    let sun = irradiant::math::Vec3::new(-0.5, -0.6, 0.62).normalize();
    Image::from_fn(side, side, ["R", "G", "B"], |x, y| {
        let at = Point2::new((x as f32 + 0.5) / side as f32, (y as f32 + 0.5) / side as f32);
        let d = irradiant::math::warp::equal_area_square_to_sphere(at);
        if d.dot(sun) > 0.9994 {
            return [9000.0, 7800.0, 6000.0];
        }
        let up = d.z.max(0.0);
        let (sky, ground) = ([0.55 - 0.35 * up, 0.7 - 0.3 * up, 0.95 - 0.2 * up], [0.25, 0.23, 0.2]);
        // The horizon is hazy: a sharp one would show the map's pixels.
        let t = (0.5 + d.z / 0.12).clamp(0.0, 1.0);
        std::array::from_fn(|c| ground[c] + t * t * (3.0 - 2.0 * t) * (sky[c] - ground[c]))
    })
}

const COMPLEX: &str = "Texture \"tiles\" \"spectrum\" \"checkerboard\" \"float uscale\" 12 \"float vscale\" 12 \"rgb tex1\" [ .6 .6 .58 ] \"rgb tex2\" [ .25 .26 .3 ]\nAttributeBegin\nMaterial \"diffuse\" \"texture reflectance\" \"tiles\"\nShape \"bilinearmesh\" \"point3 P\" [ -6 -6 0 6 -6 0 -6 6 0 6 6 0 ]\nAttributeEnd\nMaterial \"glossypaint\" \"rgb reflectance\" [ .6 .07 .05 ] \"float roughness\" .02\nTranslate 0 0 1\nShape \"sphere\"\n";

fn complex_lighting(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let folder = c.scenes_folder();
    let path = folder.join("sun-sky.exr");
    let output = |why| Error::Output { path: path.clone(), why };
    let bytes = write(&sun_sky(256), FileFormat::Exr).map_err(output)?;
    irradiant::image::atomic_write(&path, &bytes).map_err(output)?;
    let view = "LookAt 0 -4.6 2  0 0 0.9  0 0 1\nCamera \"perspective\" \"float fov\" 38\nWorldBegin\n";
    let sky = |film: String| film + view + "LightSource \"infinite\" \"string filename\" \"sun-sky.exr\"\n" + COMPLEX;
    let text = sky(scenes::film(24))
        .replace("\"glossypaint\" \"rgb reflectance\" [ .6 .07 .05 ] \"float roughness\" .02", "\"diffuse\"");
    let spp = c.spp(256);
    let scene = c.scene("sky-diffuse", &text, Setup::square(24, spp))?;
    let lights = whole(&scene, &*c.production(Some(1)), spp);
    let uniform =
        Walk { direct: Direct::Chance, directions: Directions::Uniform, roulette: Roulette::None, ..Walk::TRY_1 };
    let chance = whole(&scene, &uniform.depth(1), spp);
    sheet.at_least(
        "variance of uniform directions over that of environment samples",
        chance.sample_variance() / lights.sample_variance(),
        10.0,
    );
    // The same light, found in two ways.
    let weighed = whole(&*c.scene("sky-diffuse", &text, Setup::square(24, spp))?, &Walk::PATH.depth(1), spp);
    sheet.agree("production against light samples alone", &lights, &weighed, 0.05);
    let point = smooth_film(160)
        + view
        + "LightSource \"point\" \"rgb I\" [ 60 58 52 ] \"point3 from\" [ -3 -3.6 3.7 ]\n"
        + COMPLEX;
    let setup = Setup { spp: Some(c.spp(32)), spectral: true, ..Setup::default() };
    sheet.picture("A06-point", "A point light.", &c.render("ball-point", &point, setup)?.image(), 0.0);
    sheet.picture(
        "A06-sky",
        "The same ball under a sky with a sun.",
        &c.render("ball-sky", &sky(smooth_film(160)), setup)?.image(),
        -2.0,
    );
    sheet.command(c.command("ball-sky", "--spp 64"));
    Ok(sheet.finish())
}

fn radiance_along_a_ray(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    for distance in [0.01, 1.0, 1e4] {
        let text = scenes::film(4)
            + &format!(
                "Camera \"perspective\" \"float fov\" 10\nWorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" \"rgb L\" [ 2 3 4 ] \"bool twosided\" true\nTranslate 0 0 {distance}\nShape \"disk\" \"float radius\" {distance}\n"
            );
        let e = whole(&*c.scene("emitter", &text, Setup::square(4, 4))?, &*c.production(None), 4);
        let worst = e.mean.iter().flat_map(|p| [p[0] / 2.0, p[1] / 3.0, p[2] / 4.0]).map(|r| (r - 1.0).abs());
        sheet.at_most(&format!("worst pixel at distance {distance} (relative)"), worst.fold(0.0, f64::max), 2e-6);
        let spectral = Setup { spectral: true, ..Setup::square(4, 1024) };
        let e = whole(&*c.scene("emitter", &text, spectral)?, &*c.production(None), 1024);
        let (mean, se) = e.total()[1];
        sheet.at_most(
            &format!("with wavelengths, at {distance}: standard errors from 3"),
            (mean - 3.0).abs() / se,
            3.0,
        );
    }
    sheet.command(c.command("emitter", "--color rgb"));
    Ok(sheet.finish())
}
