//! Paths as JSON.

use irradiant::Job;
use irradiant::drawing::end_in_words;
use irradiant::math::{Point3, Vec3};
use irradiant::renderer::inspect::PathStory;
use irradiant::renderer::inspect::story::{LightEnd, LightOutcome, Vertex};
use irradiant::renderer::record::Technique;
use irradiant::spectrum::SampledSpectrum;
use serde_json::{Value, json};
use std::ops::RangeInclusive;

fn vector(v: Vec3) -> Value {
    json!([v.x, v.y, v.z])
}

fn spectrum(s: SampledSpectrum) -> Value {
    json!([s[0], s[1], s[2], s[3]])
}

/// All that is known of the paths, places in world space.
pub fn stories(job: &Job, scene: &str, stories: &[PathStory], bounces: Option<&RangeInclusive<u32>>) -> Value {
    let largest = stories.iter().map(PathStory::largest_difference).fold(0.0, f64::max);
    json!({
        "scene": scene,
        "seed": job.scene.seed,
        "paths": stories.iter().map(|s| story(job, s, bounces)).collect::<Vec<_>>(),
        "largest_difference": largest,
    })
}

fn story(job: &Job, s: &PathStory, bounces: Option<&RangeInclusive<u32>>) -> Value {
    let world = job.scene.world_from_render();
    let point = |p: Point3| vector(world.point(p).as_vec());
    let end = |to: LightEnd| match to {
        LightEnd::Point(p) => json!({ "point": point(p) }),
        LightEnd::Direction(w) => json!({ "direction": vector(world.vector(w)) }),
    };
    let vertex = |v: &Vertex| {
        let lights = v.lights.iter().map(|l| {
            let outcome = match l.outcome {
                LightOutcome::Lit => "lit",
                LightOutcome::Blocked => "blocked",
                LightOutcome::Black => "black",
                LightOutcome::PassedOver => "passed over",
            };
            json!({ "light": l.light.0, "to": end(l.to), "outcome": outcome })
        });
        let lights: Vec<Value> = lights.collect();
        let step = v.step.map(|step| {
            let s = &step.scattering;
            json!({
                "wi": vector(world.vector(s.wi)),
                "lobe": format!("{:?}", s.lobe),
                "pdf": s.pdf,
                "pdf_evaluated": step.pdf_evaluated,
                "f_cos": spectrum(step.f_cos),
                "throughput": spectrum(s.throughput),
                "survival": s.survival.min(1.0),
            })
        });
        json!({
            "p": point(v.at.p),
            "distance": v.at.t,
            "normal": vector(world.vector(v.at.n.as_vec())),
            "shading_normal": vector(world.vector(v.at.ns.as_vec())),
            "uv": [v.at.uv.x, v.at.uv.y],
            "material": job.scene.material_name(v.at.material),
            "shape": v.at.shape.0,
            "face": v.at.face,
            "emits": v.at.light.is_some(),
            "light_samples": lights,
            "scattering": step,
        })
    };
    let contributions: Vec<Value> = s
        .found
        .iter()
        .filter(|f| bounces.is_none_or(|range| range.contains(&f.contribution.bounces)))
        .map(|f| {
            let c = &f.contribution;
            json!({
                "bounces": c.bounces,
                "technique": match c.technique { Technique::Hit => "hit", Technique::LightSample => "light sample" },
                "light": c.light.0,
                "from_vertex": f.from.checked_sub(1),
                "to": end(f.to),
                "radiance": spectrum(c.radiance),
                "mis_weight": c.mis_weight,
                "pdf_light": c.light_pdf,
                "pdf_bsdf": c.bsdf_pdf,
                "product_of_pdfs": f.account.map(|a| a.density),
                "density_in_weight": f.account.map(|a| a.density_in_weight),
                "chance_among_candidates": f.account.map(|a| a.chance_among_candidates),
            })
        })
        .collect();
    json!({
        "pixel": s.pixel,
        "sample": s.sample,
        "wavelengths": s.lambda.lambda,
        "secondary_wavelengths_ended": s.secondary_ended,
        "camera": { "origin": point(s.camera_ray.o), "direction": vector(world.vector(s.camera_ray.d)) },
        "vertices": s.vertices.iter().map(vertex).collect::<Vec<_>>(),
        "escape": s.escape.map(|w| vector(world.vector(w))),
        "contributions": contributions,
        "end": end_in_words(s.end),
        "radiance": spectrum(s.radiance),
        "film": s.rgb,
        "film_from_radiance": s.film_from_radiance.map(spectrum),
    })
}
