//! Convergence, the good and the bad, notation, references (B10, B39 to B47).

use super::super::hard_paths;
use super::super::shared::{fit, strip};
use crate::context::{Context, Setup};
use crate::estimate::{Estimate, Production, whole};
use crate::row::{Outcome, Row};
use crate::scenes::{self, at_the_origin, disk_light};
use crate::sheet::{Sheet, number};
use irradiant::Error;
use irradiant_testkit::Mean;

/// B10, B39 to B47.
pub const ROWS: &[Row] = &[
    Row {
        id: "B10",
        name: "All rendering algorithms solve the rendering equation",
        says: "Kajiya's equation is the defining model.",
        check: "Path tracing, light tracing, bidirectional path tracing and photon mapping on one scene.",
        run: hard_paths::witnesses,
    },
    Row {
        id: "B39",
        name: "Path tracing example at 4, 8, 16, 32, 64, 128 rays a pixel",
        says: "It converges.",
        check: "A scene after Kajiya's: RMSE at these numbers; slope -0.5 for independent samples, 4 to 128 improves it by root 32; stratified samples do better.",
        run: kajiya,
    },
    Row {
        id: "B40",
        name: "Unbiased",
        says: "The expected value is right for any number of samples.",
        check: "The mean of renders with one sample a pixel, each with a seed of its own, is the closed form, for every sampler.",
        run: unbiased,
    },
    Row {
        id: "B41",
        name: "Consistent",
        says: "Infinitely many rays give the solution.",
        check: "The error keeps falling to the number of samples that we can afford: no plateau; what bias could hide in it.",
        run: consistent,
    },
    Row {
        id: "B42",
        name: "And the bad: 10, 100, 1000 paths a pixel",
        says: "Caustics are noisy even at 1000.",
        check: "A metal ring and a glass ball under a small lamp at 10, 100 and 1000 paths (quick: 128), with plain path tracing and with a caustic-aware mode.",
        run: hard_paths::the_bad,
    },
    Row {
        id: "B43",
        name: "Light transport notation",
        says: "L, D, S, E.",
        check: "Path expressions on the command line: a disjoint cover adds up to the picture.",
        run: path_expressions,
    },
    Row {
        id: "B44",
        name: "Path tracing as a reference",
        says: "Ground truth with thousands of samples.",
        check: "The same bits at any number of threads, resumable, with its own error bar.",
        run: |_| {
            Ok(Outcome::waits(
                "an interrupted render cannot be resumed yet; equal bits for any number of threads and error bars are there",
            ))
        },
    },
    Row {
        id: "B45",
        name: "Impractical because of noise",
        says: "Caustics in particular, even with MIS and low-discrepancy sequences.",
        check: "Stratified over independent samples: a large gain on a smooth scene, hardly any where caustics make the noise.",
        run: low_discrepancy,
    },
    Row {
        id: "B46",
        name: "Next time: photon mapping",
        says: "-",
        check: "Progressive photon mapping: its difference to path tracing falls with its radius.",
        run: hard_paths::photons,
    },
    Row {
        id: "B47",
        name: "Details in the PBRT book",
        says: "www.pbrt.org.",
        check: "Scenes in the book's format, of every shape, material, light, camera, filter and sampler that the manual lists, are read and rendered without complaint.",
        run: pbrt_scenes,
    },
];

fn path_expressions(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let spp = c.spp(96);
    let setup = Setup { size: Some([c.side(80), c.side(60)]), spp: Some(spp), ..Setup::default() };
    let words = ["gi", "lde=LDE", "caustic=LS+DS*E", "classic=L(D|S)*E", "bounces:3"];
    let aovs: Vec<irradiant::Aov> =
        words.iter().map(|w| w.parse().map_err(Error::Settings)).collect::<Result<_, _>>()?;
    let picture = c.render_with("two-balls", scenes::TWO_BALLS, setup, |s| s.aovs = aovs)?.image();
    let layer = |name: &str| {
        let names = ["R", "G", "B"].map(|c| format!("{name}.{c}"));
        picture.select(&names.each_ref().map(String::as_str)).ok_or_else(|| Error::Internal(format!("no layer {name}")))
    };
    // Sums of layers against the picture, in units of the last place of its own values.
    let mut cover = |what: &str, names: &[&str]| -> Result<(), Error> {
        let layers: Vec<_> = names.iter().map(|n| layer(n)).collect::<Result<_, _>>()?;
        let mut worst = 0.0f64;
        for i in 0..picture.width() * picture.height() * 3 {
            let (x, y, ch) = (i / 3 % picture.width(), i / 3 / picture.width(), i % 3);
            let whole = f64::from(picture.get(x, y, ch));
            let sum: f64 = layers.iter().map(|l| f64::from(l.get(x, y, ch))).sum();
            worst = worst.max((sum - whole).abs() / (f64::from(f32::EPSILON) * whole.max(1e-30)));
        }
        sheet.at_most(&format!("{what}: worst pixel, units in the last place"), worst, names.len() as f64);
        Ok(())
    };
    cover("direct, caustics, inter-reflections", &["direct", "caustics", "interreflections"])?;
    cover("L(D|S)*E in a room without glossy things", &["classic"])?;
    cover("K0 to K3 and the rest", &["K0", "K1", "K2", "K3", "Krest"])?;
    // The caustics' layer against the paths' own story, from another run.
    let apart = super::super::shared::balls_apart(c)?;
    let caustic = layer("caustic")?;
    let mean = caustic.average()[1];
    let (expected, se) = apart[1].total()[1];
    let z = (mean - expected).abs() / (2f64.sqrt() * se);
    sheet.holds(
        "LS+DS*E against the caustics of another run",
        format!("{} and {}: {z:.2} standard errors", number(mean), number(expected)),
        "4.9 standard errors",
        &format!("a bias of {:.1} %", 690.0 * 2f64.sqrt() * se / expected),
        z <= 4.9,
    );
    let images = [layer("lde")?, caustic, layer("classic")?];
    sheet.picture(
        "B43-expressions",
        "LDE, LS+DS*E, L(D|S)*E: layers of one render.",
        &strip(&images.iter().collect::<Vec<_>>()),
        0.5,
    );
    sheet.command(
        c.command("two-balls", "--aov lde=LDE --aov \"caustic=LS+DS*E\" --aov \"classic=L(D|S)*E\" -o two-balls.exr"),
    );
    Ok(sheet.finish())
}

fn kajiya(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let setup = |spp| Setup { size: Some([32, 24]), spp: Some(spp), ..Setup::default() };
    let run = |sampler: &str, spp: u32| -> Result<Estimate, Error> {
        let text = scenes::GLASS_ON_GREEN.replace("independent", sampler);
        Ok(whole(&*c.scene(&format!("glass-on-green-{sampler}"), &text, setup(spp))?, &Production::limited(12), spp))
    };
    // Pairs: the squared error of one is half of that of their difference. As many samples at each step, since caustics are
    // rare and bright.
    let mut table = vec![];
    let (mut random, mut smooth) = (vec![], vec![]);
    for power in 2..=7 {
        let spp = 1 << power;
        let error = |sampler: &str| -> Result<f64, Error> {
            let mut sum = 0.0;
            let repeats = c.spp(128) / spp;
            for _ in 0..repeats {
                sum += mean_square(&run(sampler, spp)?, &run(sampler, spp)?) / f64::from(repeats);
            }
            Ok(sum.sqrt())
        };
        let (a, b) = (error("independent")?, error("zsobol")?);
        table.push(format!("{spp}: {} and {}", number(a), number(b)));
        random.push((f64::from(spp).ln(), a.ln()));
        smooth.push((f64::from(spp).ln(), b.ln()));
    }
    sheet.note(format!("RMSE, independent and stratified samples, at {}.", table.join("; ")));
    sheet.between("slope, independent samples", fit(&random).0, [-0.56, -0.44]);
    sheet.between(
        "improvement from 4 to 128 over root 32",
        (random[0].1 - random[5].1).exp() / 32f64.sqrt(),
        [0.8, 1.25],
    );
    sheet.at_most("slope, stratified samples", fit(&smooth).0, fit(&random).0 + 0.03);
    sheet.at_most("RMSE at 128, stratified over independent", (smooth[5].1 - random[5].1).exp(), 1.0);
    let mut images = vec![];
    for spp in [4, 8, 16, 32, 64, 128] {
        let setup =
            Setup { size: Some([c.side(104), c.side(78)]), spp: Some(spp), spectral: true, max_depth: Some(12) };
        images.push(c.render("glass-on-green", scenes::GLASS_ON_GREEN, setup)?.image());
    }
    sheet.picture("B39-kajiya-1", "4, 8, 16 rays a pixel.", &strip(&images[..3].iter().collect::<Vec<_>>()), 0.0);
    sheet.picture("B39-kajiya-2", "32, 64, 128 rays a pixel.", &strip(&images[3..].iter().collect::<Vec<_>>()), 0.0);
    sheet.command(c.command("glass-on-green", "--spp 128"));
    Ok(sheet.finish())
}

/// Half the mean square of the difference.
fn mean_square(a: &Estimate, b: &Estimate) -> f64 {
    let sum: f64 = a.mean.iter().zip(&b.mean).map(|(a, b)| 0.5 * (a[1] - b[1]).powi(2)).sum();
    sum / a.mean.len() as f64
}

fn unbiased(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let expected = 5.0 / 1.49 * 0.5;
    for sampler in ["independent", "stratified", "halton", "sobol", "paddedsobol", "zsobol", "pmj02bn"] {
        let text = at_the_origin(4, 0.4, &disk_light(1.0, 0.7, 5.0)).replace("independent", sampler);
        let mut mean = Mean::new();
        for _ in 0..c.spp(400).min(1000) {
            let e = whole(&*c.scene("disk-lamp", &text, Setup::square(4, 1))?, &Production::limited(1), 1);
            // One number a render: pixels of one picture are not independent for every sampler.
            mean.add(e.grey());
        }
        sheet.mean_is(&format!("mean of one-sample renders, {sampler}"), &mean, expected, 0.1);
    }
    Ok(sheet.finish())
}

fn consistent(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let expected = 5.0 / 1.49 * 0.5;
    let text = at_the_origin(16, 0.4, &disk_light(1.0, 0.7, 5.0));
    let mut points = vec![];
    for power in [4, 6, 8, 10, 12] {
        let spp = 1u32 << power;
        let e = whole(&*c.scene("disk-lamp", &text, Setup::square(16, spp))?, &Production::limited(1), spp);
        let square: f64 = e.mean.iter().map(|p| (p[1] / expected - 1.0).powi(2)).sum();
        points.push((spp, (square / e.mean.len() as f64).sqrt(), e));
    }
    let steps: Vec<f64> = points.windows(2).map(|w| w[0].1 / w[1].1).collect();
    sheet.at_least(
        "least improvement by four times the samples (2 expected)",
        steps.iter().fold(f64::INFINITY, |a, b| a.min(*b)),
        1.7,
    );
    let (_, _, last) = &points[4];
    sheet.is("at 4096 samples, against the closed form", last, expected, 0.01);
    let (mean, se) = last.total()[1];
    sheet.at_most(
        "bias that may hide, % (distance and two standard errors)",
        100.0 * ((mean / expected - 1.0).abs() + 2.0 * se / expected),
        0.5,
    );
    Ok(sheet.finish())
}

fn low_discrepancy(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let gain = |name: &str, text: &str, spp: u32, size: [u32; 2], depth: u32| -> Result<f64, Error> {
        let run = |sampler: &str| -> Result<Estimate, Error> {
            let setup = Setup { size: Some(size), spp: Some(spp), ..Setup::default() };
            let text = text.replace("\"independent\"", &format!("\"{sampler}\""));
            Ok(whole(&*c.scene(&format!("{name}-{sampler}"), &text, setup)?, &Production::limited(depth), spp))
        };
        let error = |sampler: &str| -> Result<f64, Error> {
            let mut sum = Mean::new();
            for _ in 0..3 {
                let (a, b) = (run(sampler)?, run(sampler)?);
                a.mean.iter().zip(&b.mean).for_each(|(a, b)| sum.add(0.5 * (a[1] - b[1]).powi(2)));
            }
            Ok(sum.mean().sqrt())
        };
        Ok(error("zsobol")? / error("independent")?)
    };
    let smooth = gain("disk-lamp", &at_the_origin(16, 0.4, &disk_light(1.0, 0.7, 5.0)), c.spp(64), [16, 16], 1)?;
    let caustic = gain("ring-and-glass", scenes::RING_AND_GLASS, c.spp(64), [40, 30], 10)?;
    sheet.at_most("RMSE, stratified over independent: smooth light", smooth, 0.5);
    sheet.at_least("the same where caustics make the noise", caustic, 0.6);
    sheet.at_least("gain on smooth light over gain on caustics", caustic / smooth, 2.0);
    sheet.command(c.command("ring-and-glass-zsobol", "--spp 64"));
    Ok(sheet.finish())
}

fn pbrt_scenes(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let mut wrong = vec![];
    let mut count = 0;
    let mut try_scene = |what: &str, text: &str| {
        count += 1;
        match c.render(
            "pbrt-words",
            text,
            Setup { size: Some([4, 4]), spp: Some(1), max_depth: Some(3), spectral: true },
        ) {
            Ok(picture) if !picture.header.not_honoured.is_empty() => {
                wrong.push(format!("{what}: not honoured: {}", picture.header.not_honoured.join(", ")))
            }
            Ok(_) => {}
            Err(error) => wrong.push(format!("{what}: {error}")),
        }
    };
    let wrap = |before: &str, inside: &str| {
        format!(
            "{before}\nLookAt 0 1 -4  0 0 0  0 1 0\nCamera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\n{inside}\n"
        )
    };
    for text in [
        scenes::CORNELL_BOX,
        scenes::TWO_BALLS,
        scenes::EVERYTHING,
        scenes::MATERIALS,
        scenes::VEACH_PLATES,
        scenes::GLASS_ON_GREEN,
        scenes::RING_AND_GLASS,
    ] {
        try_scene(text.lines().next().unwrap_or("a scene"), text);
    }
    for shape in [
        "sphere",
        "disk",
        "cylinder",
        "trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"integer indices\" [ 0 1 2 ] \"string alpha",
        "bilinearmesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ] \"string x",
        "curve\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ] \"string type\" \"ribbon\" \"normal N\" [ 0 0 1 0 0 1 ] \"string x",
        "loopsubdiv\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 0 0 1 ] \"integer indices\" [ 0 2 1 0 1 3 1 2 3 2 0 3 ] \"string scheme",
    ] {
        // The last word of a mesh would take a value; cut it.
        let words = shape.rsplit_once(" \"string ").map_or(format!("{shape}\""), |(head, _)| head.to_string());
        try_scene(shape.split('"').next().unwrap_or(shape), &wrap("", &format!("Shape \"{words}")));
    }
    for material in [
        "diffuse",
        "diffusetransmission",
        "conductor",
        "dielectric",
        "thindielectric",
        "coateddiffuse",
        "coatedconductor",
        "interface",
        "retroreflective",
        "glossypaint",
        "thinfilmpaint",
    ] {
        try_scene(material, &wrap("", &format!("Material \"{material}\"\nShape \"sphere\"")));
    }
    for light in ["point", "distant", "spot", "infinite"] {
        try_scene(light, &wrap("", &format!("LightSource \"{light}\"\nShape \"sphere\"")));
    }
    for camera in ["perspective", "orthographic", "spherical"] {
        try_scene(camera, &wrap("", "Shape \"sphere\"").replace("\"perspective\"", &format!("\"{camera}\"")));
    }
    for filter in ["box", "gaussian", "mitchell", "sinc", "triangle"] {
        try_scene(filter, &wrap(&format!("PixelFilter \"{filter}\""), "Shape \"sphere\""));
    }
    for sampler in ["independent", "stratified", "halton", "sobol", "paddedsobol", "zsobol", "pmj02bn"] {
        try_scene(sampler, &wrap(&format!("Sampler \"{sampler}\""), "Shape \"sphere\""));
    }
    for texture in ["constant", "scale", "mix", "bilerp", "checkerboard", "dots", "fbm", "wrinkled", "windy", "marble"]
    {
        let kind = if texture == "marble" { "spectrum" } else { "float" };
        let parameter = if kind == "float" {
            "Material \"conductor\" \"texture roughness\" \"t\""
        } else {
            "Material \"diffuse\" \"texture reflectance\" \"t\""
        };
        try_scene(
            texture,
            &wrap("", &format!("Texture \"t\" \"{kind}\" \"{texture}\"\n{parameter}\nShape \"sphere\"")),
        );
    }
    sheet.none_of("scenes or words of the format that are refused or replaced", count, &wrong);
    c.file("everything", scenes::EVERYTHING)?;
    sheet.command(c.command("everything", "").replace("irradiant render", "irradiant check").trim_end());
    Ok(sheet.finish())
}
