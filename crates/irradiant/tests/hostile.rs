//! Scenes whose numbers no author would mean: each gives a report or a finite picture; none panics, hangs or eats memory.
//!
//! Not a statistical test: a fixed list of mutations from a fixed seed. It shows only what it tries; a new kind of
//! failure is to be added to `ODD`.

use irradiant::{Error, IntegratorChoice, Job, RenderSettings, load_text};
use std::time::{Duration, Instant};

/// A mutation takes the numbers of one parameter or transform and puts odd ones in their place.
const SCENES: [&str; 4] = [
    r#"
Scale -1 1 1 LookAt 0 1 5 0 0 0 0 1 0
Camera "perspective" "float fov" [ 45 ] "float lensradius" [ .02 ] "float focaldistance" [ 5 ] "float shutteropen" [ 0 ]
    "float shutterclose" [ 1 ] "float screenwindow" [ -1 1 -1 1 ] "float frameaspectratio" [ 1 ]
Film "rgb" "integer xresolution" [ 12 ] "integer yresolution" [ 10 ] "float cropwindow" [ 0 1 0 1 ] "float iso" [ 100 ]
    "float maxcomponentvalue" [ 1000 ] "float diagonal" [ 35 ]
PixelFilter "gaussian" "float xradius" [ 1.5 ] "float yradius" [ 1.5 ] "float sigma" [ .5 ]
Sampler "zsobol" "integer pixelsamples" [ 4 ] "integer seed" [ 3 ]
Integrator "path" "integer maxdepth" [ 5 ]
WorldBegin
LightSource "infinite" "rgb L" [ .3 .4 .5 ] "float scale" [ 1 ] "float illuminance" [ 2 ]
LightSource "distant" "point3 from" [ 0 5 0 ] "point3 to" [ 0 0 0 ] "blackbody L" [ 5000 ]
AttributeBegin Translate 0 3 0 Rotate 90 1 0 0 AreaLightSource "diffuse" "rgb L" [ 5 5 5 ] "float scale" [ 2 ] "float power" [ 10 ]
Shape "disk" "float radius" [ .5 ] "float height" [ 0 ] "float innerradius" [ .1 ] "float phimax" [ 360 ] AttributeEnd
Material "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" "metal-Au-k" "float uroughness" [ .2 ] "float vroughness" [ .1 ]
Shape "sphere" "float radius" [ .8 ] "float zmin" [ -.8 ] "float zmax" [ .7 ] "float phimax" [ 300 ]
Material "dielectric" "float eta" [ 1.5 ] "float roughness" [ .1 ]
Translate 1 0 0 Rotate 30 0 1 0 Shape "cylinder" "float radius" [ .3 ] "float zmin" [ -1 ] "float zmax" [ 1 ]
Material "coateddiffuse" "rgb reflectance" [ .5 .4 .3 ] "float roughness" [ .1 ] "float thickness" [ .01 ] "float g" [ .2 ]
    "rgb albedo" [ .1 .2 .3 ] "integer maxdepth" [ 10 ] "integer nsamples" [ 2 ]
Translate -2 0 0 Scale 1 1 2 Shape "trianglemesh" "point3 P" [ 0 0 0 1 0 0 0 1 0 1 1 1 ] "integer indices" [ 0 1 2 1 3 2 ]
    "point2 uv" [ 0 0 1 0 0 1 1 1 ] "normal N" [ 0 0 1 0 1 1 1 0 1 0 0 1 ]
"#,
    r#"
LookAt 0 0 4 0 0 0 0 1 0
Camera "orthographic" "float lensradius" [ 0 ] "float screenwindow" [ -2 2 -2 2 ]
Film "gbuffer" "integer xresolution" [ 9 ] "integer yresolution" [ 9 ] "integer pixelbounds" [ 0 9 0 9 ]
Sampler "stratified" "integer xsamples" [ 2 ] "integer ysamples" [ 2 ]
PixelFilter "mitchell" "float B" [ .3 ] "float C" [ .3 ]
Integrator "path" "integer maxdepth" [ 4 ] "bool regularize" true
WorldBegin
LightSource "spot" "point3 from" [ 0 2 3 ] "point3 to" [ 0 0 0 ] "float coneangle" [ 40 ] "float conedeltaangle" [ 5 ] "float power" [ 9 ]
LightSource "point" "point3 from" [ 1 2 3 ] "rgb I" [ 9 9 9 ] "float scale" [ 1 ]
Texture "c" "spectrum" "checkerboard" "float uscale" [ 8 ] "float vscale" [ 8 ] "float udelta" [ 0 ] "rgb tex1" [ .1 .2 .3 ]
Texture "f" "float" "fbm" "integer octaves" [ 8 ] "float roughness" [ .5 ]
Texture "w" "spectrum" "marble" "float scale" [ 2 ] "float variation" [ .3 ] "integer octaves" [ 4 ]
Texture "d" "spectrum" "dots" "float uscale" [ 5 ] "spectrum inside" [ 400 .1 700 .9 ]
Texture "s" "float" "scale" "texture tex" "f" "float scale" [ .3 ]
Material "diffuse" "texture reflectance" "c" "texture displacement" "s"
Shape "curve" "string type" "cylinder" "point3 P" [ -1 0 0 -.5 1 0 .5 -1 0 1 0 0 ] "float width0" [ .3 ] "float width1" [ .1 ] "integer splitdepth" [ 2 ]
Shape "curve" "string type" "ribbon" "point3 P" [ -1 1 0 -.5 1 0 .5 1 0 1 1 0 ] "normal N" [ 0 0 1 0 1 1 ] "float width" [ .2 ]
Material "diffusetransmission" "texture reflectance" "w" "rgb transmittance" [ .2 .2 .2 ] "float scale" [ 1 ]
Shape "bilinearmesh" "point3 P" [ -1 -1 0 0 -1 1 -1 0 1 0 0 0 ] "point2 uv" [ 0 0 1 0 0 1 1 1 ]
MakeNamedMaterial "i" "string type" "interface" MakeNamedMaterial "j" "string type" "diffuse" Material "mix" "string materials" [ "i" "j" ] "float amount" [ .5 ]
Material "conductor" "rgb reflectance" [ .9 .5 .1 ] "texture roughness" "f"
Translate 0 0 -1 Shape "loopsubdiv" "integer levels" [ 2 ] "point3 P" [ 0 0 0 1 0 0 0 1 0 1 1 1 ] "integer indices" [ 0 1 2 1 3 2 ]
Material "thindielectric" "float eta" [ 1.3 ] Scale 2 2 2 Shape "sphere" "float radius" [ .5 ] "float alpha" [ .7 ]
"#,
    r#"
ActiveTransform EndTime Rotate 5 0 1 0 ActiveTransform All TransformTimes 0 1 Translate 0 0 5
Camera "spherical" "float shutterclose" [ 1 ]
Film "spectral" "integer xresolution" [ 12 ] "integer yresolution" [ 6 ] "integer nbuckets" [ 6 ] "float lambdamin" [ 400 ] "float lambdamax" [ 700 ]
Sampler "halton" "integer pixelsamples" [ 3 ]
Integrator "simplepath" "integer maxdepth" [ 3 ]
WorldBegin
LightSource "infinite" "blackbody L" [ 4000 ] "float scale" [ .1 ]
ObjectBegin "o" Material "coatedconductor" "float interface.eta" [ 1.5 ] "float thickness" [ .02 ] "float conductor.roughness" [ .3 ]
Shape "sphere" "float radius" [ 1 ] Translate 2 0 0 Shape "disk" "float radius" [ 1 ] ObjectEnd
ObjectInstance "o" Rotate 40 1 1 0 Scale .5 .5 .5 ObjectInstance "o"
ActiveTransform EndTime Translate 1 0 0 ActiveTransform All
ObjectInstance "o" Transform [ 1 0 0 0 0 1 0 0 0 0 1 0 3 4 5 1 ] Shape "sphere" "float radius" [ .5 ]
Material "dielectric" "spectrum eta" "glass-BK7" ConcatTransform [ 1 0 0 0 0 1 0 0 0 0 1 0 -1 -2 0 1 ] Shape "sphere" "float radius" [ 1 ]
"#,
    r#"
Camera "perspective" "float fov" [ 90 ]
Film "rgb" "integer xresolution" [ 8 ] "integer yresolution" [ 8 ] "string sensor" "canon_eos_100d" "float iso" [ 400 ] "float exposuretime" [ .01 ] "float whitebalance" [ 5000 ]
Sampler "independent" "integer pixelsamples" [ 5 ] "integer seed" [ 7 ]
Integrator "ambientocclusion" "float maxdistance" [ 3 ]
WorldBegin
Material "dielectric" "float roughness" [ 0 ] "float eta" [ 2 ]
Translate 0 0 3 Shape "trianglemesh" "point3 P" [ -1 -1 0 1 -1 0 0 1 0 ]
Scale 3 3 3 Shape "sphere" "float radius" [ 1 ]
"#,
];

/// What stands in the place of a number: zero, tiny, huge, the ends of the types, what is no number, what overflows.
const ODD: [&str; 24] = [
    "0",
    "-0",
    "-1",
    "1",
    "1e-30",
    "1e-38",
    "1e-45",
    "1e6",
    "1e10",
    "1e19",
    "1e30",
    "3e38",
    "-1e30",
    "1e400",
    "nan",
    "inf",
    "-inf",
    "65536",
    "2147483647",
    "-2147483648",
    "99999999999",
    ".5",
    "360",
    "0.9999999",
];

struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as usize) % n
    }
}

/// Where numbers stand: byte ranges of words that read as one.
fn numbers(text: &str) -> Vec<std::ops::Range<usize>> {
    let base = text.as_ptr() as usize;
    let word = |w: &str| {
        let start = w.as_ptr() as usize - base;
        start..start + w.len()
    };
    text.split_ascii_whitespace().filter(|w| w.parse::<f64>().is_ok()).map(word).collect()
}

fn mutated(scene: &str, random: &mut Random) -> String {
    let mut text = scene.to_string();
    // Mostly one odd number, since the first mistake is what stops a scene; sometimes several, or one value throughout.
    for _ in 0..[1, 1, 1, 2, 4][random.below(5)] {
        let places = numbers(&text);
        let first = random.below(places.len());
        let run = if random.below(4) == 0 { 4 } else { 1 };
        let odd = ODD[random.below(ODD.len())];
        for place in places[first..(first + run).min(places.len())].iter().rev() {
            text.replace_range(place.clone(), odd);
        }
    }
    text
}

#[test]
fn odd_numbers_give_a_report_or_a_finite_picture() {
    let mut random = Random(20);
    let (mut refused, mut rendered, mut slowest) = (0, 0, Duration::ZERO);
    for i in 0..320 {
        let scene = SCENES[i % SCENES.len()];
        // The scenes themselves come first, as they are.
        let text = if i < SCENES.len() { scene.to_string() } else { mutated(scene, &mut random) };
        let started = Instant::now();
        let settings =
            RenderSettings { threads: 1, time_limit: Some(Duration::from_millis(200)), ..Default::default() };
        let job = load_text("odd.pbrt", &text, ".").and_then(|file| Job::new(&file, &settings));
        match job {
            Err(Error::Scene(report)) => {
                assert!(i >= SCENES.len(), "{report}");
                let located = report.diagnostics.iter().any(|d| report.sources.locate(d.labels[0].0).is_some());
                assert!(located, "nothing says where: {report}\n{text}");
                refused += 1;
            }
            Err(other) => panic!("neither refused nor rendered: {other}\n{text}"),
            Ok(job) => {
                // A picture of many pixels costs memory and time that are meant: only what is small is rendered.
                if job.scene.bounds().area() > 1 << 17 {
                    continue;
                }
                let finished = job.start().wait();
                assert!(!finished.worker_panicked, "{text}");
                let image = job.rendering(finished.film, finished.stats).image();
                let channel = |c: &str| image.channel_index(c).unwrap_or(0);
                for c in ["R", "G", "B"].map(channel) {
                    let n = image.width() * image.height();
                    let sound = (0..n).all(|p| image.get(p % image.width(), p / image.width(), c).is_finite());
                    assert!(sound, "a pixel is not finite\n{text}");
                }
                rendered += 1;
            }
        }
        slowest = slowest.max(started.elapsed());
        assert!(started.elapsed() < Duration::from_secs(10), "{:?}\n{text}", started.elapsed());
    }
    eprintln!("{refused} refused, {rendered} rendered, the slowest in {slowest:?}");
    assert!(refused > 60 && rendered > 60, "{refused} refused, {rendered} rendered");
}

#[test]
fn a_film_beyond_memory_is_refused_before_it_is_made() {
    let text = "Film \"rgb\" \"integer xresolution\" 65536 \"integer yresolution\" 65536 WorldBegin";
    let file = load_text("huge.pbrt", text, ".").unwrap_or_else(|e| panic!("{e}"));
    let Err(Error::Scene(report)) = Job::new(&file, &RenderSettings::default()) else { panic!("it was made") };
    let shown = report.to_string();
    assert!(shown.contains("E0907") && shown.contains("448.0 GiB") && shown.contains("--crop"), "{shown}");
    // What paths from lights bring has sums of its own, as large again.
    let text = "Film \"rgb\" \"integer xresolution\" 5000 \"integer yresolution\" 5000 WorldBegin";
    let middling = load_text("large.pbrt", text, ".").unwrap_or_else(|e| panic!("{e}"));
    let by = |name: &str| {
        let settings = RenderSettings {
            integrator: Some(IntegratorChoice::named(name).unwrap_or_else(|e| panic!("{e}"))),
            ..RenderSettings::default()
        };
        Job::new(&middling, &settings)
    };
    assert!(by("path").is_ok());
    for name in ["bdpt", "lighttrace"] {
        let Err(Error::Scene(report)) = by(name) else { panic!("{name} was given too much memory") };
        assert!(report.to_string().contains("E0907"), "{report}");
    }
    // A part of it is fine.
    let part = RenderSettings { crop: Some([0.0, 0.01, 0.0, 0.01]), ..RenderSettings::default() };
    assert!(Job::new(&file, &part).is_ok());
    // And so is all of it for whoever has the memory; nothing is reserved before the start.
    let allowed = |bytes| RenderSettings { max_film_bytes: Some(bytes), ..RenderSettings::default() };
    assert!(Job::new(&file, &allowed(448 << 30)).is_ok());
    assert!(Job::new(&file, &allowed((448 << 30) - 1)).is_err());
}

#[test]
fn the_memory_of_a_film_is_known_before_it_is_made() {
    for (kind, more, channels) in [("rgb", "", 0), ("gbuffer", "", 17), ("spectral", "\"integer nbuckets\" 5", 5)] {
        let text = format!("Film \"{kind}\" {more} WorldBegin");
        let file = load_text("film.pbrt", &text, ".").unwrap_or_else(|e| panic!("{e}"));
        let job = Job::new(&file, &RenderSettings { resolution: Some([2, 2]), ..Default::default() });
        let film = job.unwrap_or_else(|e| panic!("{e}")).scene.new_film();
        assert_eq!(film.channels_per_pixel() as u64, channels);
        assert_eq!(irradiant::core::scene::LayerPlan::channels_of(&file.desc.film), channels);
    }
}
