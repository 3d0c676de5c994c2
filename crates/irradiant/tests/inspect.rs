//! Looking into renders: what the inspectors say is what the renders do.

use irradiant::drawing::{DrawingOptions, draw_paths};
use irradiant::math::{Normal3, Point2, Point3};
use irradiant::renderer::inspect::incident::mean_residual;
use irradiant::renderer::inspect::light_claims::{light_density_integral, off_lights};
use irradiant::renderer::inspect::story::LightOutcome;
use irradiant::renderer::inspect::{
    AuditSettings, IncidentSettings, PathStory, audit, dimensions, incident, replay, residuals,
};
use irradiant::renderer::path::PathIntegrator;
use irradiant::renderer::record::PathEnd;
use irradiant::{IntegratorChoice, Job, RenderSettings, load_text};

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
    job_with(text, &RenderSettings::default())
}

fn job_with(text: &str, settings: &RenderSettings) -> (Job, PathIntegrator) {
    let file = load_text("room", text, ".").unwrap_or_else(|e| panic!("{e}"));
    let job = Job::new(&file, settings).unwrap_or_else(|e| panic!("{e}"));
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

/// The same where the first surface samples several lights, of one or of several strata each.
#[test]
fn the_books_hold_where_the_choice_of_a_light_is_split() {
    for words in ["lights=3", "lights=8", "lightsampler=power"] {
        let choice = IntegratorChoice::named("path").and_then(|c| c.with_words("lights=5")?.with_words(words));
        let integrator = Some(choice.expect("options of path"));
        let (job, integrator) = job_with(ROOM, &RenderSettings { integrator, ..RenderSettings::default() });
        let (mut found, mut several) = (0, 0);
        for story in all_stories(&job, &integrator, 2) {
            let sum = story.found.iter().map(|f| f.contribution.radiance[0]).sum::<f32>();
            assert!((sum - story.radiance[0]).abs() <= 1e-5 * sum, "{:?} {sum} {}", story.pixel, story.radiance[0]);
            for f in &story.found {
                assert!(f.account.expect("no interfaces here").difference() < 1e-4, "{words} {:?} {f:?}", story.pixel);
                found += 1;
            }
            several += usize::from(story.vertices.first().is_some_and(|v| v.lights.len() > 1));
        }
        // By power the sky is picked nearly always.
        assert!(found > 800 && several > if words.contains("power") { 5 } else { 200 }, "{words}: {found} {several}");
    }
}

/// The same where the first two surfaces choose one of several candidates: of all lights, and of some that are picked.
#[test]
fn the_books_hold_where_lights_are_chosen_among_candidates() {
    let lamps: String = (0..12)
        .map(|i| {
            let x = 0.15 * i as f32 - 0.9;
            format!("AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [ {i} 4 2 ]\nTranslate {x} 0.4 0.3\nShape \"sphere\" \"float radius\" 0.05\nAttributeEnd\n")
        })
        .collect();
    for (text, candidates) in [(ROOM.to_string(), 2), (ROOM.to_string() + &lamps, 3)] {
        let choice = IntegratorChoice::named("path").and_then(|c| c.with_words(&format!("candidates={candidates}")));
        let settings = RenderSettings { integrator: Some(choice.expect("an option")), ..RenderSettings::default() };
        let (job, integrator) = job_with(&text, &settings);
        let (mut found, mut passed_over, mut lit) = (0, 0, 0);
        for story in all_stories(&job, &integrator, 2) {
            for f in &story.found {
                assert!(
                    f.account.expect("no interfaces here").difference() < 1e-4,
                    "{candidates} {:?} {f:?}",
                    story.pixel
                );
                found += 1;
            }
            for vertex in &story.vertices {
                let count = |outcome| vertex.lights.iter().filter(|l| l.outcome == outcome).count();
                assert!(count(LightOutcome::Lit) + count(LightOutcome::Blocked) <= 1, "{vertex:?}");
                (passed_over, lit) = (passed_over + count(LightOutcome::PassedOver), lit + count(LightOutcome::Lit));
            }
        }
        assert!(found > 800 && passed_over > 300 && lit > 500, "{candidates}: {found} {passed_over} {lit}");
    }
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

/// A closed box of four materials around glass and metal, lit by a lamp, a spot and a point.
const BOX: &str = r#"
Film "rgb" "integer xresolution" 16 "integer yresolution" 16
Sampler "independent" "integer pixelsamples" 4
Integrator "path" "integer maxdepth" 1000
LookAt 0 0 -1.8  0 0 0  0 1 0
Camera "perspective" "float fov" 80
WorldBegin
LightSource "point" "rgb I" [ 2 2 2 ] "point3 from" [ -1 1 -1 ]
LightSource "spot" "rgb I" [ 9 5 3 ] "point3 from" [ 1 1.5 -1 ] "point3 to" [ 0 -2 0 ] "float coneangle" 25
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 9 8 7 ]
  Translate 0 1.9 0
  Rotate 90 1 0 0
  Shape "disk" "float radius" 0.5
AttributeEnd
MakeNamedMaterial "white" "string type" "diffuse" "rgb reflectance" [ .8 .7 .6 ]
MakeNamedMaterial "lacquer" "string type" "coateddiffuse" "rgb reflectance" [ .2 .5 .3 ] "float roughness" 0 "integer maxdepth" 0
MakeNamedMaterial "steel" "string type" "conductor" "float roughness" 0.5
MakeNamedMaterial "glass" "string type" "dielectric" "float eta" 1.5
MakeNamedMaterial "mirror" "string type" "conductor" "rgb reflectance" [ .9 .9 .9 ]
NamedMaterial "white"
Shape "bilinearmesh" "point3 P" [ -2 -2 -2  2 -2 -2  -2 -2 2  2 -2 2 ]
Shape "bilinearmesh" "point3 P" [ -2 2 -2  2 2 -2  -2 2 2  2 2 2 ]
NamedMaterial "lacquer"
Shape "bilinearmesh" "point3 P" [ -2 -2 2  2 -2 2  -2 2 2  2 2 2 ]
Shape "bilinearmesh" "point3 P" [ -2 -2 -2  2 -2 -2  -2 2 -2  2 2 -2 ]
NamedMaterial "steel"
Shape "bilinearmesh" "point3 P" [ -2 -2 -2  -2 -2 2  -2 2 -2  -2 2 2 ]
Shape "bilinearmesh" "point3 P" [ 2 -2 -2  2 -2 2  2 2 -2  2 2 2 ]
AttributeBegin
  NamedMaterial "glass"
  Translate -0.7 -1.1 0
  Shape "sphere" "float radius" 0.8
AttributeEnd
AttributeBegin
  NamedMaterial "mirror"
  Translate 0.9 -1.2 0.4
  Shape "sphere" "float radius" 0.7
AttributeEnd
"#;

/// B08. 30,000 particles: standard errors of 0.3 %, so that 2.5 % of the energy gone astray would be seen. Nothing escapes from a
/// closed box, and glass absorbs nothing.
#[test]
fn what_lamps_emit_is_absorbed_or_escapes() {
    let (job, _) = job(BOX);
    let settings = AuditSettings { paths: 30_000, max_depth: None, seed: 5 };
    let books = audit(&job.scene, &settings).expect("lights");
    let total = books.emitted.watts;
    assert!(books.z().abs() < 4.9, "{books:?}");
    assert!(6.9 * books.missing.error < 0.025 * total, "{books:?} could hide a loss");
    assert_eq!(books.escaped.watts, 0.0, "a closed box leaks");
    assert!(
        (books.emitted.watts - books.emitted_by_formula).abs() < 4.9 * books.emitted.error + 1e-3 * total,
        "{books:?}"
    );
    let of =
        |name: &str| books.by_material.iter().find(|m| job.scene.material_name(m.material) == name).map(|m| m.absorbed);
    let glass = of("glass").expect("light meets the glass");
    assert!(glass.watts.abs() < 4.9 * glass.error + 1e-4 * total, "glass absorbs {glass:?} of {total}");
    assert!(of("white").expect("walls").watts > 0.1 * total, "{books:?}");

    // With a limit, what is still under way is told; the rest balances.
    let books = audit(&job.scene, &AuditSettings { max_depth: Some(2), ..settings }).expect("lights");
    assert!(books.z().abs() < 4.9 && books.cut_off.watts > 0.05 * total, "{books:?}");
    // Under a sky most of what crosses the scene's disk leaves again.
    let (open, _) = self::job(ROOM);
    let books = audit(&open.scene, &settings).expect("lights");
    assert!(books.z().abs() < 4.9 && books.escaped.watts > 0.3 * books.emitted.watts, "{books:?}");
    // The same books for the same seed; others for another.
    let again = audit(&open.scene, &settings).expect("lights");
    let other = audit(&open.scene, &AuditSettings { seed: 6, ..settings }).expect("lights");
    assert_eq!(again.absorbed, books.absorbed);
    assert_ne!(other.absorbed, books.absorbed);
}

/// B08 in a box of narrow lobes: steel of alpha 0.001 on the walls (coffee's floor has a coat like that), rough glass. 30,000 particles; 3 % gone
/// astray would be seen. With a rough coat of pbrt-v4's weights on the floor, brighter when evaluated by 1 to 2 %, the books say where
/// they do not balance, and that they do elsewhere.
#[test]
fn narrow_lobes_raise_no_false_alarm_and_pbrts_weights_are_named() {
    let narrow = BOX
        .replace(
            "\"conductor\" \"float roughness\" 0.5",
            "\"conductor\" \"float roughness\" 0.001 \"bool remaproughness\" false",
        )
        .replace(
            "\"float roughness\" 0 \"integer maxdepth\" 0",
            "\"float roughness\" 0.001 \"bool remaproughness\" false \"integer maxdepth\" 0",
        )
        .replace("\"dielectric\" \"float eta\" 1.5", "\"dielectric\" \"float eta\" 1.5 \"float roughness\" 0.01");
    let settings = AuditSettings { paths: 30_000, max_depth: None, seed: 5 };
    let (job, _) = job(&narrow);
    let books = audit(&job.scene, &settings).expect("lights");
    let total = books.emitted.watts;
    assert!(books.z().abs() < 4.9, "{books:?}");
    assert!(6.9 * books.missing.error < 0.03 * total, "{books:?} could hide a loss");
    assert_eq!(books.missing, books.missing_elsewhere);
    assert!(books.by_material.iter().all(|m| m.missing.z().abs() < 4.9 && !m.evaluated_as_pbrt), "{books:?}");

    let coat = "\"coateddiffuse\" \"rgb reflectance\" [ .9 .9 .9 ] \"float roughness\" 0.3";
    let (job, _) = self::job(&narrow.replace("\"diffuse\" \"rgb reflectance\" [ .8 .7 .6 ]", coat));
    let books = audit(&job.scene, &settings).expect("lights");
    assert!(books.missing.z() > 6.0, "pbrt-v4's weights are not seen: {books:?}");
    assert!(books.z().abs() < 4.9, "{books:?}");
    let named: Vec<_> = books.by_material.iter().filter(|m| m.evaluated_as_pbrt).collect();
    assert!(named.len() == 1 && job.scene.material_name(named[0].material) == "white", "{books:?}");
}

/// B09. A matt ceiling, steel, lacquer and glass: what arrives, integrated, is what the path tracer says leaves. A bias of a third
/// would be seen, in all points but glass together.
#[test]
fn what_arrives_at_a_point_is_what_leaves_it() {
    let (job, integrator) = job(BOX);
    let settings = IncidentSettings { side: 12, samples: 40, seed: 9 };
    let mut materials = Vec::new();
    let (mut difference, mut variance, mut total) = (0.0f64, 0.0f64, 0.0f64);
    for to in [Point2::new(8.0, 1.5), Point2::new(1.0, 8.0), Point2::new(8.5, 3.5), Point2::new(5.5, 11.5)] {
        let ray = job.scene.camera.generate_ray(to, Point2::new(0.5, 0.5), 0.5).expect("a ray").ray;
        let light = incident(&job.scene, &integrator, &ray, &settings).expect("a surface");
        let name = job.scene.material_name(light.at.material).to_string();
        let z = light.scattered.z(&light.path_traced);
        assert!(z.iter().all(|z| z.abs() < 4.9), "{name}: {light:?}");
        // Behind glass all light of the spot is a caustic: too noisy to say much.
        if name != "glass" {
            difference += light.scattered.rgb[1] - light.path_traced.rgb[1];
            variance += light.scattered.error[1].powi(2) + light.path_traced.error[1].powi(2);
            total += light.path_traced.rgb[1];
        }
        // The picture is a disk.
        let pixel = |x: usize, y: usize| light.hemisphere.values[y * 12 + x][1];
        assert!([(0, 0), (11, 0), (0, 11), (11, 11)].iter().all(|&(x, y)| pixel(x, y) == 0.0), "{name}");
        assert!((3..9).any(|i| pixel(i, 6) > 0.0), "{name}");
        materials.push(name);
    }
    for name in ["white", "steel", "lacquer", "glass"] {
        assert!(materials.iter().any(|m| m == name), "{name} was not seen: {materials:?}");
    }
    let error = variance.sqrt();
    assert!(difference.abs() < 4.9 * error && 6.9 * error < 0.35 * total, "{difference} +- {error} of {total}");
}

/// A31, B05. The rendering equation at random points; a bias of 30 % of all light would be seen, and of 5.5 standard errors
/// at each point.
#[test]
fn the_rendering_equation_holds_at_random_points() {
    let (job, integrator) = job(BOX);
    let found = residuals(&job.scene, &integrator, 24, 400, 31);
    assert!(found.len() > 20, "{}", found.len());
    for r in &found {
        assert!(r.left.z(&r.right).iter().all(|z| z.abs() < 5.5), "{r:?}");
    }
    let (mean, error) = mean_residual(&found);
    assert!(mean.abs() < 4.9 * error && 6.9 * error < 0.3, "{mean} +- {error}");
    // With bite: a path tracer that stops after two events does not solve the equation of one that goes on.
    let short = PathIntegrator { max_depth: Some(1), ..integrator };
    let stopped = residuals(&job.scene, &short, 24, 400, 31);
    let (left, full): (f64, f64) =
        (stopped.iter().map(|r| r.left.rgb[1]).sum(), found.iter().map(|r| r.right.rgb[1]).sum());
    assert!((full - left) / full > 6.9 * error, "{left} {full}");
}

/// B16. One block of four numbers for the light and one for scattering at each bounce, none used twice.
#[test]
fn each_bounce_has_numbers_of_its_own() {
    let (job, integrator) = job(BOX);
    let audit = dimensions(&job.scene, &integrator, 300, 1);
    assert!(audit.is_sound(), "{audit:?}");
    let deep = audit.by_bounce.len();
    assert!(deep > 6, "{deep}");
    assert!(audit.by_bounce[..4].iter().all(|b| (b.light, b.scatter) == (1, 1)), "{audit:?}");
    assert_eq!(audit.by_bounce[0].paths, 300);
}

/// B21. Near, far and grazing; one and two sides; a mesh. 60,000 directions: a density wrong by 5 % would be seen, by 21 % at grazing angles.
#[test]
fn densities_of_lights_sum_to_one_over_directions() {
    let cube = {
        let faces = "0 2 3 0 3 1 4 5 7 4 7 6 0 1 5 0 5 4 2 6 7 2 7 3 0 4 6 0 6 2 1 3 7 1 7 5";
        let corners: Vec<String> =
            (0..8).map(|i| [0, 1, 2].map(|b| if i >> b & 1 == 0 { "-1" } else { "1" }).join(" ")).collect();
        format!("Shape \"trianglemesh\" \"integer indices\" [ {faces} ] \"point3 P\" [ {} ]", corners.join(" "))
    };
    let shapes = [
        ("sphere", "Shape \"sphere\" \"float radius\" 1".to_string()),
        ("disk", "Shape \"disk\" \"float radius\" 1".to_string()),
        ("cylinder", "Shape \"cylinder\" \"float radius\" 0.5".to_string()),
        ("triangle", "Shape \"trianglemesh\" \"point3 P\" [ -1 -1 0  1 -1 0  0 1 0 ]".to_string()),
        ("rectangle", "Shape \"bilinearmesh\" \"point3 P\" [ -1 -1 0  1 -1 0  -1 1 0  1 1 0 ]".to_string()),
        ("cube", cube),
    ];
    for (name, shape) in &shapes {
        for two_sided in ["true", "false"] {
            let text = format!(
                "Film \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" 4\nCamera \"perspective\"\nOption \"rendercoordsys\" \"world\"\nWorldBegin\nAreaLightSource \"diffuse\" \"bool twosided\" {two_sided}\n{shape}\n"
            );
            let (job, _) = job(&text);
            for (place, p) in [
                ("near", Point3::new(0.2, 0.1, 1.3)),
                ("far", Point3::new(30.0, 20.0, 45.0)),
                ("grazing", Point3::new(6.0, 1.3, 0.4)),
            ] {
                let sum = light_density_integral(&job.scene, p, Normal3::ZERO, 60_000, 3);
                assert_eq!(sum.refused(), 0);
                let (mean, error) = (sum.mean()[0], sum.error()[0]);
                assert!((mean - 1.0).abs() < 4.9 * error + 1e-3, "{name} {place} {two_sided}: {mean} +- {error}");
                assert!(6.9 * error < 0.21, "{name} {place}: {error} could hide a wrong density");
            }
        }
    }
}

/// B07. Le is exactly 0 off the lights and on their dark sides.
#[test]
fn nothing_shines_but_the_lights() {
    let (job, _) = job(BOX);
    let count = off_lights(&job.scene, 4000, 2);
    assert_eq!(count.shining, 0, "{count:?}");
    assert_eq!(count.dark_lights, 0, "{count:?}");
    assert!(count.asked > 5_000 && count.lights > 20, "{count:?}");
}
