//! Light that path tracing finds by chance only, and the independent algorithms that find it (A71, B10, B36, B42, B46).

use super::shared::strip;
use crate::context::{Context, Setup};
use crate::estimate::{Estimate, by_integrator};
use crate::row::Outcome;
use crate::scenes;
use crate::sheet::{Sheet, number};
use irradiant::Error;
use irradiant_testkit::Mean;

const MISSING: &str = "light tracing, bidirectional path tracing and photon mapping are not in this build";

/// Several renders by an integrator of the program, each with a seed of its own, and the CPU seconds of one.
struct Runs {
    pictures: Vec<Estimate>,
    seconds: f64,
}

/// What is rendered, and how.
struct Task<'a> {
    scene: &'a str,
    text: &'a str,
    size: [u32; 2],
    depth: Option<u32>,
}

fn runs(
    c: &Context,
    task: &Task,
    name: &str,
    options: &[(&str, &str)],
    spp: u32,
    n: u32,
) -> Result<Option<Runs>, Error> {
    let (mut pictures, mut seconds) = (vec![], 0.0);
    for _ in 0..n {
        let Some(integrator) = c.integrator(name, options, task.depth)? else { return Ok(None) };
        let setup = Setup { size: Some(task.size), spp: Some(spp), ..Setup::default() };
        let scene = c.scene(task.scene, task.text, setup)?;
        let (picture, time) = by_integrator(&scene, &*integrator, spp);
        pictures.push(picture);
        seconds += time / f64::from(n);
    }
    Ok(Some(Runs { pictures, seconds }))
}

impl Runs {
    /// The picture's mean and what it varies from run to run.
    fn grey(&self) -> Mean {
        let mut mean = Mean::new();
        self.pictures.iter().for_each(|p| mean.add(p.grey()));
        mean
    }

    /// The mean picture.
    fn mean(&self) -> Estimate {
        let mut sum = self.pictures[0].clone();
        for p in &self.pictures[1..] {
            sum = sum.plus(1.0, p);
        }
        let n = self.pictures.len() as f64;
        sum.mean.iter_mut().for_each(|p| *p = p.map(|x| x / n));
        sum
    }

    /// Relative squared error of one run: from run to run, over the square of a smoothed reference.
    fn rel_mse(&self, reference: &Estimate) -> f64 {
        let floor = 0.02 * reference.grey();
        let mut sum = Mean::new();
        for i in 0..reference.mean.len() {
            let mut pixel = Mean::new();
            self.pictures.iter().for_each(|p| pixel.add(p.mean[i][1]));
            sum.add(pixel.variance() / (reference.mean[i][1].powi(2) + floor * floor));
        }
        sum.mean()
    }

    /// Relative squared error of the runs against a reference of its own: noise, and what they miss or blur.
    fn rel_error(&self, reference: &Estimate) -> f64 {
        let floor = 0.02 * reference.grey();
        let mut sum = Mean::new();
        for p in &self.pictures {
            let pixels = p.mean.iter().zip(&reference.mean);
            pixels.for_each(|(a, b)| sum.add((a[1] - b[1]).powi(2) / (b[1].powi(2) + floor * floor)));
        }
        sum.mean()
    }

    /// Relative squared error, each pixel's counted 1 at most: a firefly weighs no more than a pixel whose light is missing.
    fn bounded_error(&self, reference: &Estimate) -> f64 {
        let floor = 0.02 * reference.grey();
        let mut sum = Mean::new();
        for p in &self.pictures {
            let pixels = p.mean.iter().zip(&reference.mean);
            pixels.for_each(|(a, b)| sum.add(((a[1] - b[1]).powi(2) / (b[1].powi(2) + floor * floor)).min(1.0)));
        }
        sum.mean()
    }

    /// Largest and median deviation of tiles of 5 by 5 pixels from run to run, relative to the reference there.
    fn fireflies(&self, reference: &Estimate) -> (f64, f64) {
        let w = reference.width;
        let (columns, rows) = (w / 5, reference.mean.len() / w / 5);
        let mut tiles: Vec<f64> = (0..columns * rows)
            .map(|t| {
                let of = |p: &Estimate| -> f64 {
                    (0..25).map(|i| p.mean[(t / columns * 5 + i / 5) * w + t % columns * 5 + i % 5][1]).sum()
                };
                let mut value = Mean::new();
                self.pictures.iter().for_each(|p| value.add(of(p)));
                value.variance().sqrt() / of(reference).max(1e-9)
            })
            .collect();
        tiles.sort_by(f64::total_cmp);
        (tiles[tiles.len() - 1], tiles[tiles.len() / 2].max(1e-12))
    }
}

/// B10.
pub fn witnesses(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let text = scenes::lit_box(16);
    let task = Task { scene: "lit-box", text: &text, size: [16, 16], depth: None };
    let spp = c.spp(96);
    let Some(path) = runs(c, &task, "path", &[], spp, 12)? else { return Ok(Outcome::waits(MISSING)) };
    for name in ["lighttrace", "bdpt"] {
        let Some(other) = runs(c, &task, name, &[], spp, 12)? else { return Ok(Outcome::waits(MISSING)) };
        sheet.means_agree(&format!("diffuse box, path and {name}"), &path.grey(), &other.grey(), 0.06);
        sheet.command(c.command("lit-box", &format!("--integrator {name}")));
    }
    let Some(photon) = runs(c, &task, "photon", &[("radius", "0.05")], spp, 12)? else {
        return Ok(Outcome::waits(MISSING));
    };
    let (a, b) = (path.grey(), photon.grey());
    let se = a.standard_error().hypot(b.standard_error());
    sheet.holds(
        "diffuse box, path and photon mapping of radius 0.05 (biased by it)",
        format!("{} and {}: {:+.2} %", number(a.mean()), number(b.mean()), 100.0 * (b.mean() / a.mean() - 1.0)),
        "3 % and 4.9 standard errors",
        &format!("{:.1} %", 100.0 * (0.03 + 6.9 * se / a.mean())),
        (a.mean() - b.mean()).abs() <= 0.03 * a.mean() + 4.9 * se && se < 0.02 * a.mean(),
    );
    // A glass ball's caustic, where path and bidirectional tracing find light in different ways.
    let caustic = scenes::RING_AND_GLASS.replace("radius\" 0.05", "radius\" 0.6").replace("3600 3320 2800", "25 23 19");
    let task = Task { scene: "ring-and-glass-large-lamp", text: &caustic, size: [32, 24], depth: Some(8) };
    let Some(path) = runs(c, &task, "path", &[], spp, 12)? else { return Ok(Outcome::waits(MISSING)) };
    let Some(other) = runs(c, &task, "bdpt", &[], spp, 12)? else { return Ok(Outcome::waits(MISSING)) };
    sheet.means_agree("ring and glass under a large lamp, path and bdpt", &path.grey(), &other.grey(), 0.08);
    Ok(sheet.finish())
}

fn ring() -> Task<'static> {
    Task { scene: "ring-and-glass", text: scenes::RING_AND_GLASS, size: [40, 30], depth: Some(8) }
}

/// A71.
pub fn challenging(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let task = ring();
    // Passes enough to blur much less than the renders that are compared with it.
    let Some(reference) = runs(c, &task, "photon", &[], c.spp(512), 2)? else { return Ok(Outcome::waits(MISSING)) };
    let reference = reference.mean();
    let (path_spp, spp) = (c.spp(512), c.spp(64));
    let Some(path) = runs(c, &task, "path", &[], path_spp, 6)? else { return Ok(Outcome::waits(MISSING)) };
    let mut best: Option<(f64, f64, &str)> = None;
    for name in ["bdpt", "photon"] {
        let Some(other) = runs(c, &task, name, &[], spp, 6)? else { return Ok(Outcome::waits(MISSING)) };
        let gain = path.bounded_error(&reference) / other.bounded_error(&reference);
        sheet.note(format!(
            "{name}: {spp} samples in {:.2} CPU seconds, bounded error {}; the path tracer: {path_spp} in {:.2}, bounded error {}. relMSE x CPU seconds, which a few fireflies decide, is {} times below the path tracer's here and not judged.",
            other.seconds,
            number(other.bounded_error(&reference)),
            path.seconds,
            number(path.bounded_error(&reference)),
            number(path.rel_mse(&reference) * path.seconds / (other.rel_mse(&reference) * other.seconds))
        ));
        if best.is_none_or(|(most, ..)| gain > most) {
            best = Some((gain, path.seconds / other.seconds, name));
        }
    }
    let Some((gain, time, name)) = best else { return Ok(Outcome::waits(MISSING)) };
    // The path tracer has eight times the samples and about four times the time: a noisy clock does not decide.
    sheet.at_least(&format!("CPU seconds, path tracer over {name}"), time, 1.5);
    sheet.at_least(
        &format!("bounded error (a pixel's squared relative error, at most 1), path tracer over {name}"),
        gain,
        1.3,
    );
    // Why: no light sample finds what comes by way of the ring or the glass, and chance hardly ever does.
    let setup = Setup { size: Some(task.size), spp: Some(c.spp(96)), ..Setup::default() };
    let scene = c.scene(task.scene, task.text, setup)?;
    let production = crate::estimate::Production::limited(8);
    let classify = |p: &crate::estimate::Part| (!p.by_hit).then_some(0);
    let sampled = crate::estimate::take_apart(&scene, &production, c.spp(96), 1, &classify).swap_remove(0);
    let lost = 1.0 - sampled.grey() / reference.grey();
    sheet.at_least("share of the light that no light sample finds", lost, 0.02);
    sheet.command(c.command("ring-and-glass", "--integrator photon --spp 256"));
    Ok(sheet.finish())
}

/// B36.
pub fn refractive_noise(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let glass = scenes::RING_AND_GLASS
        .split("AttributeBegin\n    Material \"conductor\"")
        .next()
        .unwrap_or_default()
        .to_string()
        + "AttributeBegin\nMaterial \"dielectric\" \"float eta\" 1.5\nTranslate 0.2 0.45 0.1\nShape \"sphere\" \"float radius\" 0.45\nAttributeEnd\n";
    // A lamp that chance does meet now and then.
    let glass = glass.replace("radius\" 0.05", "radius\" 0.15").replace("3600 3320 2800", "400 369 311");
    let task = Task { scene: "glass-alone", text: &glass, size: [40, 30], depth: Some(8) };
    // Paths from both sides find this caustic well: the reference.
    let Some(reference) = runs(c, &task, "bdpt", &[], c.spp(512), 2)? else { return Ok(Outcome::waits(MISSING)) };
    let reference = reference.mean();
    let Some(path) = runs(c, &task, "path", &[], c.spp(64), 6)? else { return Ok(Outcome::waits(MISSING)) };
    let Some(photon) = runs(c, &task, "photon", &[], c.spp(64), 6)? else { return Ok(Outcome::waits(MISSING)) };
    let (largest, median) = path.fireflies(&reference);
    sheet.at_least("path tracing: largest over median deviation of tiles", largest / median, 10.0);
    let reduced = path.rel_error(&reference) / photon.rel_error(&reference);
    sheet.at_least("relMSE at as many samples, path tracing over photon mapping", reduced, 10.0);
    sheet.command(c.command("glass-alone", "--integrator photon"));
    Ok(sheet.finish())
}

/// B42.
pub fn the_bad(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let task = ring();
    let Some(reference) = runs(c, &task, "photon", &[], c.spp(256), 2)? else { return Ok(Outcome::waits(MISSING)) };
    let reference = reference.mean();
    let most = c.spp(128).min(1000);
    let Some(path) = runs(c, &task, "path", &[], most, 4)? else { return Ok(Outcome::waits(MISSING)) };
    let Some(photon) = runs(c, &task, "photon", &[], most / 4, 4)? else { return Ok(Outcome::waits(MISSING)) };
    sheet.at_least(
        &format!("relMSE, path tracing at {most} over photon mapping at a quarter of that"),
        path.rel_mse(&reference) / photon.rel_mse(&reference),
        2.0,
    );
    let size = [c.side(104), c.side(78)];
    let wide = Task { size, ..ring() };
    for (row, name) in ["path", "photon"].into_iter().enumerate() {
        let mut images = vec![];
        for spp in [10, 100, most] {
            let Some(run) = runs(c, &wide, name, &[], spp, 1)? else { return Ok(Outcome::waits(MISSING)) };
            images.push(run.pictures[0].image());
        }
        let caption = format!("{}: 10, 100 and {most} samples.", ["Path tracing", "Photon mapping"][row]);
        sheet.picture(&format!("B42-{name}"), &caption, &strip(&images.iter().collect::<Vec<_>>()), 0.0);
        sheet.command(c.command("ring-and-glass", &format!("--integrator {name} --spp 100")));
    }
    Ok(sheet.finish())
}

/// B46.
pub fn photons(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let text = scenes::lit_box(24);
    let task = Task { scene: "lit-box", text: &text, size: [24, 24], depth: Some(3) };
    // A kept radius is a kept bias. In a group are two independent renders by photons and two by paths, of light of two bounces or
    // more, which alone is blurred; the mean product of the pairs' differences has no noise in its expectation, only the square of the
    // bias. Groups say how well it is known.
    let direct = Setup { size: Some(task.size), spp: Some(c.spp(8)), ..Setup::default() };
    let mut grey = Mean::new();
    let mut squares = [Mean::new(); 2];
    for _ in 0..8 {
        let (mut references, mut found) = (vec![], [vec![], vec![]]);
        for _ in 0..2 {
            let spp = c.spp(192);
            let scene = c.scene(task.scene, task.text, Setup { spp: Some(spp), ..direct })?;
            let indirect = |p: &crate::estimate::Part| (p.bounces > 1).then_some(0);
            let paths = crate::estimate::Production::limited(3);
            references.push(crate::estimate::take_apart(&scene, &paths, spp, 1, &indirect).swap_remove(0));
            let scene = c.scene(task.scene, task.text, direct)?;
            let by = |radius: &str, paths: &str, depth: u32| -> Result<Option<Estimate>, Error> {
                let options = [("radius", radius), ("alpha", "1"), ("paths", paths)];
                let integrator = c.integrator("photon", &options, Some(depth))?;
                Ok(integrator.map(|integrator| by_integrator(&scene, &*integrator, c.spp(8)).0))
            };
            // The same samples take the same direct light.
            let Some(first) = by("0.1", "1", 1)? else { return Ok(Outcome::waits(MISSING)) };
            for (radius, found) in ["0.4", "0.1"].into_iter().zip(&mut found) {
                found.extend(by(radius, "16000", 3)?.map(|all| all.plus(-1.0, &first)));
            }
        }
        references.iter().for_each(|r| grey.add(r.grey()));
        for (square, found) in squares.iter_mut().zip(&found) {
            let off = |k: usize, i: usize| found[k].mean[i][1] - references[k].mean[i][1];
            let mut product = Mean::new();
            (0..references[0].mean.len()).for_each(|i| product.add(off(0, i) * off(1, i)));
            square.add(product.mean());
        }
    }
    let root = |square: f64| square.max(0.0).sqrt() / grey.mean();
    let known = |square: &Mean| square.mean() / square.standard_error();
    for (radius, square) in ["0.4", "0.1"].into_iter().zip(&squares) {
        sheet.holds(
            &format!("bias of indirect light at radius {radius} (root mean square over pixels, of the mean)"),
            format!(
                "{} %, its square {:.1} standard errors above 0",
                number(100.0 * root(square.mean())),
                known(square)
            ),
            "its square at least 4 standard errors above 0: else these are too few samples",
            &format!("a bias of {} %", number(100.0 * root(6.0 * square.standard_error()))),
            known(square) >= 4.0,
        );
    }
    // Errors of both taken the wrong way, twice.
    let low = squares[0].mean() - 2.0 * squares[0].standard_error();
    let high = squares[1].mean() + 2.0 * squares[1].standard_error();
    sheet.holds(
        "bias at radius 0.4 over that at 0.1 (4 at edges, 16 on smooth light)",
        format!(
            "{}, at least {}",
            number(root(squares[0].mean()) / root(squares[1].mean())),
            number(root(low) / root(high))
        ),
        "at least 2.500 with both biases two standard errors to the wrong side",
        "anything below",
        root(high) > 0.0 && root(low) >= 2.5 * root(high),
    );
    // With a shrinking radius the error goes on falling.
    let Some(path) = runs(c, &task, "path", &[], c.spp(1024), 1)? else { return Ok(Outcome::waits(MISSING)) };
    let reference = path.mean();
    let mut error = vec![];
    for spp in [8, 32, 128] {
        let options = [("radius", "0.3"), ("paths", "2000")];
        let Some(run) = runs(c, &task, "photon", &options, spp, 1)? else { return Ok(Outcome::waits(MISSING)) };
        error.push(run.pictures[0].rmse(&reference));
    }
    sheet.at_least("progressive: RMSE at 8 passes over that at 32", error[0] / error[1], 1.3);
    sheet.at_least("progressive: RMSE at 32 passes over that at 128", error[1] / error[2], 1.3);
    sheet.command(c.command("lit-box", "--integrator photon --estimator radius=0.1"));
    Ok(sheet.finish())
}
