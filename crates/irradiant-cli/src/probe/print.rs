//! Paths as text.

use irradiant::Job;
use irradiant::drawing::end_in_words;
use irradiant::math::Vec3;
use irradiant::renderer::inspect::PathStory;
use irradiant::renderer::inspect::story::{Found, LightOutcome};
use irradiant::renderer::path::{Roulette, SURVIVAL_RULE};
use irradiant::renderer::record::Technique;
use irradiant::spectrum::SampledSpectrum;
use std::ops::RangeInclusive;

/// Books that differ by less are kept: transport is in `f32`.
const BOOKS: f64 = 1e-3;

fn vector(v: Vec3) -> String {
    format!("({:+.6}, {:+.6}, {:+.6})", v.x, v.y, v.z)
}

fn spectrum(s: SampledSpectrum) -> String {
    format!("[{:.5e} {:.5e} {:.5e} {:.5e}]", s[0], s[1], s[2], s[3])
}

/// One path in full, several in a line each.
pub fn stories(job: &Job, stories: &[PathStory], bounces: Option<&RangeInclusive<u32>>) {
    match stories {
        [] => println!("the camera sees nothing here (vignetting)"),
        [story] => one(job, story, bounces),
        _ => many(stories, bounces),
    }
    let largest = stories.iter().map(PathStory::largest_difference).fold(0.0, f64::max);
    let kept = stories.iter().flat_map(|s| &s.found).filter(|f| f.account.is_some()).count();
    if kept > 0 {
        let word = if largest < BOOKS { "equals" } else { "DIFFERS FROM" };
        println!(
            "books        the product of densities {word} the density in the weight, for {kept} contributions; largest difference {largest:.1e}"
        );
    }
}

fn one(job: &Job, story: &PathStory, bounces: Option<&RangeInclusive<u32>>) {
    let wanted = |f: &&Found| bounces.is_none_or(|range| range.contains(&f.contribution.bounces));
    let l = story.lambda.lambda;
    println!("wavelengths  {:.2} {:.2} {:.2} {:.2} nm", l[0], l[1], l[2], l[3]);
    let light_from = |from: u32| story.found.iter().filter(move |f| f.from == from).filter(wanted);
    // Light that a ray met comes before the vertex that it came from goes on.
    let met = |f: &&Found| f.contribution.technique == Technique::Hit;
    for (i, v) in story.vertices.iter().enumerate() {
        let at = &v.at;
        let p = job.scene.world_from_render().point(at.p);
        println!("vertex {i}     at ({:.6}, {:.6}, {:.6}) world, distance {:.6}", p.x, p.y, p.z, at.t);
        println!("             normal {}  shading {}", vector(at.n.as_vec()), vector(at.ns.as_vec()));
        println!(
            "             material {}, shape {}, face {}, uv ({:.5}, {:.5}){}",
            job.scene.material_name(at.material),
            at.shape.0,
            at.face,
            at.uv.x,
            at.uv.y,
            if at.light.is_some() { ", emits" } else { "" }
        );
        light_from(i as u32).filter(met).for_each(light);
        for tried in &v.lights {
            match tried.outcome {
                LightOutcome::Lit => {}
                LightOutcome::Blocked => println!("light        sample of light {}: blocked", tried.light.0),
                LightOutcome::Black => println!("light        sample of light {}: nothing from there", tried.light.0),
                LightOutcome::PassedOver => {
                    println!(
                        "light        sample of light {}: passed over, another candidate was tested",
                        tried.light.0
                    );
                }
            }
        }
        light_from(i as u32 + 1).filter(|f| !met(f)).for_each(light);
        if let Some(step) = v.step {
            let s = &step.scattering;
            let evaluated = step.pdf_evaluated.map_or(String::new(), |pdf| format!(" (evaluated {pdf:.5e})"));
            println!(
                "scatter {i}    {:?} towards {}, pdf {:.5e}{evaluated}, f cos {}, throughput {}, survival {:.4}",
                s.lobe,
                vector(s.wi),
                s.pdf,
                spectrum(step.f_cos),
                spectrum(s.throughput),
                s.survival.min(1.0)
            );
        }
    }
    if let Some(direction) = story.escape {
        println!("escape {}     towards {}", story.vertices.len(), vector(direction));
        light_from(story.vertices.len() as u32).filter(met).for_each(light);
    }
    println!("end          {}", end_in_words(story.end));
    if story.vertices.iter().any(|v| v.step.is_some()) {
        println!("             survival: {}", survival_in_words(job));
    }
    if let Some(range) = bounces.filter(|range| !story.found.iter().any(|f| range.contains(&f.contribution.bounces))) {
        println!("             no light after {} bounces was found", bounces_in_words(range));
    }
    println!("radiance     {}  W m^-2 sr^-1 nm^-1", spectrum(story.radiance));
    if story.secondary_ended {
        println!("             dispersion ended all wavelengths but the first");
    }
    for (channel, of) in ["R", "G", "B"].iter().zip(&story.film_from_radiance) {
        println!("             film {channel} is the sum of radiance x {}", spectrum(*of));
    }
    let rgb = story.rgb;
    println!("film         R {:.6e}  G {:.6e}  B {:.6e}", rgb[0], rgb[1], rgb[2]);
    if !rgb.iter().all(|c| c.is_finite()) {
        println!("             NOT FINITE: this sample is refused by the film");
    }
}

/// The chance to survive a scattering event, by the integrator's roulette.
fn survival_in_words(job: &Job) -> String {
    match job.path_integrator().map(|path| path.roulette) {
        Some(Roulette::Constant(q)) => format!("{} at each event", 1.0 - q),
        Some(Roulette::Throughput) | None => SURVIVAL_RULE.into(),
    }
}

fn bounces_in_words(range: &RangeInclusive<u32>) -> String {
    if range.start() == range.end() {
        range.start().to_string()
    } else {
        format!("{} to {}", range.start(), range.end())
    }
}

fn light(f: &Found) {
    let c = &f.contribution;
    let how = match c.technique {
        Technique::Hit => "met by chance",
        Technique::LightSample => "light sample",
    };
    println!(
        "light        {} bounces, {how}, light {}: {}  weight {:.5}, pdf light {:.5e}, bsdf {:.5e}",
        c.bounces,
        c.light.0,
        spectrum(c.radiance),
        c.mis_weight,
        c.light_pdf,
        c.bsdf_pdf
    );
    if let Some(a) = f.account.filter(|a| a.chance_among_candidates < 1.0) {
        println!("             chosen among candidates with the chance {:.5}", a.chance_among_candidates);
    }
    match f.account {
        Some(a) => println!(
            "             product of pdfs {:.7e}, density in the weight {:.7e}, differ by {:.1e}",
            a.density,
            a.density_in_weight,
            a.difference()
        ),
        None => println!("             books not kept: behind an interface"),
    }
}

fn many(stories: &[PathStory], bounces: Option<&RangeInclusive<u32>>) {
    let wanted = |f: &&Found| bounces.is_none_or(|range| range.contains(&f.contribution.bounces));
    println!(
        "{:>7} {:>8}  {:<17} {:>12} {:>12} {:>12}  light after bounces",
        "sample", "vertices", "end", "R", "G", "B"
    );
    let mut shown = 0;
    for s in stories {
        let found: Vec<String> = s
            .found
            .iter()
            .filter(wanted)
            .map(|f| format!("{}: {:.3e}", f.contribution.bounces, f.contribution.radiance.average()))
            .collect();
        if bounces.is_some() && found.is_empty() {
            continue;
        }
        shown += 1;
        println!(
            "{:>7} {:>8}  {:<17} {:>12.4e} {:>12.4e} {:>12.4e}  {}",
            s.sample,
            s.vertices.len(),
            end_in_words(s.end),
            s.rgb[0],
            s.rgb[1],
            s.rgb[2],
            found.join("  ")
        );
    }
    if let (0, Some(range)) = (shown, bounces) {
        println!("none of these {} samples found light after {} bounces", stories.len(), bounces_in_words(range));
    }
}
