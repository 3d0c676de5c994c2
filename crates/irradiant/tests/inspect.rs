//! Looking into renders: what the inspectors say is what the renders do.

use irradiant::drawing::{DrawingOptions, draw_paths};
use irradiant::renderer::inspect::{PathStory, replay};
use irradiant::renderer::path::PathIntegrator;
use irradiant::renderer::record::PathEnd;
use irradiant::{Job, RenderSettings, load_text};

/// A room with a lamp, a mirror, glass, rough metal, a coat and a sky that comes in at one side.
const ROOM: &str = r#"
Film "rgb" "integer xresolution" 24 "integer yresolution" 16
Sampler "independent" "integer pixelsamples" 64
Integrator "path" "integer maxdepth" 40
LookAt 0 0 -4.5  0 0 0  0 1 0
Camera "perspective" "float fov" 60
WorldBegin
LightSource "infinite" "rgb L" [ .3 .4 .6 ]
LightSource "point" "rgb I" [ 3 2 1 ] "point3 from" [ 1 1.5 -1 ]
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 9 8 7 ]
  Translate 0 1.9 0
  Rotate 90 1 0 0
  Shape "disk" "float radius" 0.5
AttributeEnd
Material "diffuse" "rgb reflectance" [ .8 .7 .6 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 -5  2 -2 -5  -2 -2 2  2 -2 2 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 2  2 -2 2  -2 2 2  2 2 2 ]
Material "coateddiffuse" "rgb reflectance" [ .2 .5 .3 ] "float roughness" 0
Shape "bilinearmesh" "point3 P" [ -2 -2 -5  -2 -2 2  -2 2 -5  -2 2 2 ]
Material "conductor" "float roughness" 0.3
Shape "bilinearmesh" "point3 P" [ 2 -2 -5  2 -2 2  2 2 -5  2 2 2 ]
AttributeBegin
  Material "dielectric" "float eta" 1.5
  Translate -0.7 -1.2 0
  Shape "sphere" "float radius" 0.8
AttributeEnd
AttributeBegin
  Material "conductor" "float roughness" 0
  Translate 0.9 -1.3 0.4
  Shape "sphere" "float radius" 0.7
AttributeEnd
"#;

fn job(text: &str) -> (Job, PathIntegrator) {
    let file = load_text("room", text, ".").unwrap_or_else(|e| panic!("{e}"));
    let job = Job::new(&file, &RenderSettings::default()).unwrap_or_else(|e| panic!("{e}"));
    let integrator = job.path_integrator().expect("the path integrator");
    (job, integrator)
}

fn all_stories(job: &Job, integrator: &PathIntegrator, samples: u32) -> Vec<PathStory> {
    let b = job.scene.bounds();
    let pixels = (b.y0..b.y1).flat_map(|y| (b.x0..b.x1).map(move |x| [x, y]));
    pixels.flat_map(|p| (0..samples).filter_map(move |i| replay(&job.scene, integrator, p, i))).collect()
}

/// B18. Every contribution of 1536 paths; a density that is wrong by one part in ten thousand anywhere would be seen.
#[test]
fn the_product_of_densities_is_the_density_in_the_weight() {
    let (job, integrator) = job(ROOM);
    let stories = all_stories(&job, &integrator, 4);
    let (mut found, mut roulette, mut deep, mut evaluated) = (0, 0, 0, 0);
    for story in &stories {
        let sum = story.found.iter().map(|f| f.contribution.radiance[0]).sum::<f32>();
        assert!((sum - story.radiance[0]).abs() <= 1e-5 * sum, "{:?} {sum} {}", story.pixel, story.radiance[0]);
        for f in &story.found {
            let account = f.account.expect("no interfaces here");
            assert!(account.difference() < 1e-4, "{:?} {} {f:?}", story.pixel, story.sample);
            found += 1;
            deep += usize::from(f.contribution.bounces > 3);
        }
        for step in story.vertices.iter().filter_map(|v| v.step) {
            if let Some(pdf) = step.pdf_evaluated {
                assert!((pdf / step.scattering.pdf - 1.0).abs() < 2e-3, "{step:?}");
                evaluated += 1;
            }
        }
        roulette += usize::from(story.end == PathEnd::Roulette);
    }
    assert!(found > 1500 && roulette > 100 && deep > 150 && evaluated > 1000, "{found} {roulette} {deep} {evaluated}");
}

/// The books have bite: without the chance of survival they do not balance.
#[test]
fn books_without_survival_do_not_balance() {
    let (job, integrator) = job(ROOM);
    let survivors = all_stories(&job, &integrator, 1).into_iter().filter_map(|story| {
        let survival: f64 =
            story.vertices.iter().filter_map(|v| v.step).map(|s| f64::from(s.scattering.survival.min(1.0))).product();
        let last = story.found.last()?.account?;
        (survival < 0.9 && story.end == PathEnd::Escaped).then_some((last.density / survival) / last.density_in_weight)
    });
    let ratios: Vec<f64> = survivors.collect();
    assert!(ratios.len() > 5 && ratios.iter().all(|r| *r > 1.1), "{ratios:?}");
}

#[test]
fn a_drawing_carries_its_pictures_and_shows_what_was_asked_for() {
    let (job, integrator) = job(ROOM);
    let stories: Vec<PathStory> = (0..3).filter_map(|i| replay(&job.scene, &integrator, [12, 9], i)).collect();
    let options = DrawingOptions { title: "a < b".into(), bounces: None, backdrop_samples: 1 };
    let all = draw_paths(&job, &integrator, &stories, &options).expect("drawable");
    assert_eq!(all.matches("data:image/png;base64,").count(), 3);
    assert!(all.contains("a &lt; b") && all.ends_with("</svg>\n"));
    assert_eq!(all.matches("<g ").count(), all.matches("</g>").count());
    // Fewer lines when filtered, and none for light that there is none of.
    let lines = |bounces| {
        let options = DrawingOptions { bounces, ..options.clone() };
        draw_paths(&job, &integrator, &stories, &options).expect("drawable").matches("<polyline").count()
    };
    let (every, direct) = (all.matches("<polyline").count(), lines(Some(1..=1)));
    assert!(every > direct && direct > 0, "{every} {direct}");
    // One path comes with its numbers.
    let one = draw_paths(&job, &integrator, &stories[..1], &options).expect("drawable");
    assert!(one.contains("product of pdfs"), "no table");
}
