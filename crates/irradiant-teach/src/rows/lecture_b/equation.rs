//! The rendering equation once more (B01 to B17).

use crate::context::{Context, Setup};
use crate::estimate::{Production, along, whole};
use crate::radiosity;
use crate::row::{Outcome, Row};
use crate::scenes;
use crate::sheet::Sheet;
use irradiant::Error;
use irradiant::core::interaction::LightId;
use irradiant::image::Image;
use irradiant::math::{Point3, Ray, Vec3};
use irradiant::renderer::camera_samples::camera_sample;
use irradiant_testkit::{Mean, Rng};
use std::f64::consts::PI;

/// B01 to B11, B13 to B17.
pub const ROWS: &[Row] = &[
    Row {
        id: "B01",
        name: "Reflection equation, incident light given",
        says: "From an environment map or known lights, by Monte Carlo.",
        check: "A20's pairs of material and light; A06's sky.",
        run: |c| Ok(c.inherit(&["A20", "A06"])),
    },
    Row {
        id: "B02",
        name: "Direct illumination from area and point lights",
        says: "Both kinds of light.",
        check: "Four lamps and two point lights in one scene: looping over all and picking one agree (A58, A59).",
        run: |c| Ok(c.inherit(&["A58", "A59"])),
    },
    Row {
        id: "B03",
        name: "Indirect illumination",
        says: "Light at a depends on light reflected at b.",
        check: "The pair of A05.",
        run: |c| Ok(c.inherit(&["A05"])),
    },
    Row {
        id: "B04",
        name: "Direct only, direct and indirect, photograph",
        says: "Indirect light brings the picture to the photograph.",
        check: "As A08, against the second renderer in place of the photograph: the error of the walls falls when indirect light is added; both numbers.",
        run: direct_and_indirect,
    },
    Row {
        id: "B05",
        name: "Equilibrium of incident and reflected radiance",
        says: "Both are unknown.",
        check: "The residual of A31.",
        run: |c| Ok(c.inherit(&["A31"])),
    },
    Row {
        id: "B06",
        name: "Radiance does not change along a ray",
        says: "Incident radiance here is reflected radiance there.",
        check: "A09.",
        run: |c| Ok(c.inherit(&["A09"])),
    },
    Row {
        id: "B07",
        name: "Light sources: Le is known",
        says: "Le is 0 off the lights.",
        check: "Textured lamps show their texture, one-sided ones are black behind, spots are dark outside their cone: exactly; surfaces that are no light have none.",
        run: emitters,
    },
    Row {
        id: "B08",
        name: "Rendering equation, conservation of energy",
        says: "Out is emitted plus reflected.",
        check: "Cornell box at 550 nm: what its lamp emits is absorbed by its surfaces or leaves by the open front, each measured by path tracing at random points.",
        run: energy,
    },
    Row {
        id: "B09",
        name: "The equation holds at each point (figure)",
        says: "Incident and reflected radiance at points.",
        check: "The picture of incident radiance at a point of the Cornell box's floor; its cosine-weighted sum times albedo / pi is the pixel.",
        run: radiance_probe,
    },
    Row {
        id: "B11",
        name: "Geometric optics",
        says: "No wave effects such as polarization and diffraction.",
        check: "The manual says what is and what is not represented; interference in thin films is (A17).",
        run: wave_effects,
    },
    Row {
        id: "B13",
        name: "One integral for each path length",
        says: "Sum over lengths.",
        check: "A38 and A39.",
        run: |c| Ok(c.inherit(&["A38", "A39"])),
    },
    Row {
        id: "B14",
        name: "Fredholm equation, Liouville-Neumann series",
        says: "The mathematics.",
        check: "The series in closed form (A35), its formal check (A36).",
        run: |c| Ok(c.inherit(&["A35", "A36"])),
    },
    Row {
        id: "B15",
        name: "Recursive substitution L0, L1, ...",
        says: "L_i is the sum of the first terms.",
        check: "A39.",
        run: |c| Ok(c.inherit(&["A39"])),
    },
    Row {
        id: "B16",
        name: "T^k is a 2k-dimensional integral",
        says: "Two numbers for each direction.",
        check: "Numbers of different vertices and purposes are different and uncorrelated, for every sampler; each vertex has its own blocks.",
        run: dimensions,
    },
    Row {
        id: "B17",
        name: "Convergence by energy conservation",
        says: "||T^(k+1) E|| <= gamma ||T^k E|| with gamma < 1 (the slide prints an equality of the wrong terms).",
        check: "A35's ratios.",
        run: |c| Ok(c.inherit(&["A35"])),
    },
];

/// Radiance that leaves points of a Cornell quad along its normal at 450, 550 and 650 nm.
struct Box_ {
    quads: Vec<radiosity::Quad>,
    scene: std::sync::Arc<irradiant::core::scene::Scene>,
    lambda: irradiant::spectrum::Wavelengths,
}

fn cornell(c: &Context) -> Result<Box_, Error> {
    let quads = radiosity::quads(scenes::CORNELL_BOX, [278.0, 274.0, 280.0]);
    let scene = c.scene("cornell-box", &scenes::cornell(), Setup { spectral: true, ..Setup::square(16, 1) })?;
    let mut lambda = irradiant::spectrum::Wavelengths::sample_uniform(0.5, 400.0, 700.0);
    lambda.lambda = [450.0, 550.0, 650.0, 600.0];
    Ok(Box_ { quads, scene, lambda })
}

impl Box_ {
    fn place(&self, v: [f64; 3], w: f64) -> [f32; 3] {
        let m = self.scene.world_from_render().inverse().m;
        std::array::from_fn(|r| (m[r][0] * v[0] + m[r][1] * v[1] + m[r][2] * v[2] + w * m[r][3]) as f32)
    }

    fn seen(&self, o: [f64; 3], d: [f64; 3], max_depth: Option<u32>, pixel: i32, index: u32) -> f64 {
        use crate::estimate::Estimator;
        let (o, d) = (self.place(o, 1.0), self.place(d, 0.0));
        let Some(mut bearer) = camera_sample(&self.scene, [0, 0], 0).camera_ray else { return 0.0 };
        bearer.ray = Ray::new(Point3::new(o[0], o[1], o[2]), Vec3::new(d[0], d[1], d[2]).normalize(), 0.0);
        let stream = self.scene.sampler.stream([pixel, 5], index);
        let (mut own, mut stats) = (self.lambda, Default::default());
        let l = Production { max_depth, ..Production::default() }.sample(
            &self.scene,
            &bearer,
            &stream,
            &mut own,
            &mut stats,
            &mut |_| {},
        );
        f64::from(l[1])
    }

    /// Along the normal of quad `i`.
    fn leaving(&self, i: usize, max_depth: Option<u32>, n: u32, rng: &mut Rng) -> Mean {
        let quad = &self.quads[i];
        let mut index = 0;
        Mean::of(u64::from(n), || {
            let p = radiosity::point_on(quad, rng);
            index += 1;
            self.seen(std::array::from_fn(|a| p[a] + 0.3 * quad.n[a]), quad.n.map(|x| -x), max_depth, i as i32, index)
        })
    }

    fn lamp(&self) -> f64 {
        let (n, w) = (irradiant::math::Normal3::new(0.0, -1.0, 0.0), Vec3::new(0.0, -1.0, 0.0));
        let uv = irradiant::math::Point2::new(0.5, 0.5);
        f64::from(self.scene.lights.get(LightId(0)).emitted(n, uv, w, &self.lambda)[1])
    }

    fn albedo(&self, i: usize) -> f64 {
        radiosity::reflectance(scenes::CORNELL_BOX, &self.quads[i].material, 550.0).unwrap_or(0.78)
    }
}

fn direct_and_indirect(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let b = cornell(c)?;
    let lamp = b.lamp();
    let emission: Vec<f64> = b.quads.iter().map(|q| if q.material == "lamp" { lamp } else { 0.0 }).collect();
    let albedo: Vec<f64> = (0..b.quads.len()).map(|i| b.albedo(i)).collect();
    let reference = radiosity::exchange(&b.quads, c.spp(200), c.seed()).solve(&emission, &albedo);
    let mut rng = Rng::new(c.seed());
    let mut error = |max_depth| {
        let walls = [1usize, 2, 3, 4, 5, 6, 11];
        let off = walls.map(|i| (b.leaving(i, max_depth, c.spp(12_000), &mut rng).mean() / reference[i] - 1.0).abs());
        off.iter().sum::<f64>() / off.len() as f64
    };
    let (direct, all) = (error(Some(1)), error(None));
    sheet.at_most("mean error of the walls with all light, %", 100.0 * all, 2.5);
    sheet.at_least("mean error with direct light only, %", 100.0 * direct, 20.0);
    sheet.note("Cornell's photograph could not be had (A08); the second renderer stands in its place.");
    Ok(sheet.finish())
}

fn emitters(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let folder = c.scenes_folder();
    let path = folder.join("stripes.exr");
    let output = |why| Error::Output { path: path.clone(), why };
    std::fs::create_dir_all(&folder)
        .map_err(|error| output(irradiant::image::ImageError::Io { path: path.clone(), error }))?;
    // Four stripes of 16 pixels each.
    let stripes = Image::from_fn(64, 1, ["R", "G", "B"], |x, _| [[0.0; 3], [1.0; 3], [0.0; 3], [3.0; 3]][x / 16]);
    let bytes = irradiant::image::write(&stripes, irradiant::image::FileFormat::Exr).map_err(output)?;
    irradiant::image::atomic_write(&path, &bytes).map_err(output)?;
    // Sixteen pixels across, four to a stripe; the inner two see no other stripe.
    let text = scenes::film_of(16, 1)
        + "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"orthographic\" \"float screenwindow\" [ -1 1 -0.1 0.1 ]\nWorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" \"string filename\" \"stripes.exr\" \"bool twosided\" true\nShape \"bilinearmesh\" \"point3 P\" [ -1 -1 0  1 -1 0  -1 1 0  1 1 0 ] \"point2 uv\" [ 0 0 1 0 0 1 1 1 ]\n";
    let scene = c.scene("striped-lamp", &text, Setup { spp: Some(64), ..Setup::default() })?;
    let e = whole(&scene, &*c.production(None), 64);
    let inner: Vec<f64> = (0..16).filter(|x| [1, 2].contains(&(x % 4))).map(|x| e.mean[x][1]).collect();
    let mut seen: Vec<f64> = inner.chunks(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect();
    seen.sort_by(f64::total_cmp);
    sheet.at_most("dark stripes of a textured lamp", seen[1], 0.0);
    sheet.close("bright stripes: ratio", seen[3] / seen[2], 3.0, 1e-3);
    for (side, name, expected) in [(5.0, "front", true), (-5.0, "back", false)] {
        let text = scenes::film(1)
            + &format!(
                "LookAt 0 0 {side}  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 1\nWorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" \"rgb L\" [ 2 2 2 ]\nShape \"disk\"\n"
            );
        let e = whole(&*c.scene("one-sided", &text, Setup::square(1, 4))?, &*c.production(None), 4);
        let value = e.grey();
        sheet.holds(
            &format!("one-sided lamp from the {name}"),
            format!("{value}"),
            if expected { "2" } else { "0" },
            "any other value",
            (value - if expected { 2.0 } else { 0.0 }).abs() < 1e-5,
        );
    }
    let spot = "LightSource \"spot\" \"rgb I\" [ 2 2 2 ] \"point3 from\" [ 0 4 0 ] \"point3 to\" [ 1.456 0 0 ] \"float coneangle\" 15\n";
    let e =
        whole(&*c.scene("spot", &scenes::at_the_origin(2, 3.0, spot), Setup::square(2, 16))?, &*c.production(None), 16);
    sheet.at_most("20 degrees off the axis of a spot of 15", e.grey(), 0.0);
    // What is no light says so: every point that camera rays of the lit box meet, but the lamp.
    let scene = c.scene("lit-box", &scenes::lit_box(32), Setup::square(32, 1))?;
    let (mut lamps, mut others) = (0, 0);
    for pixel in 0..32 * 32 {
        let Some(ray) = camera_sample(&scene, [pixel % 32, pixel / 32], 0).camera_ray else { continue };
        let Some(hit) = scene.geometry.intersect(&ray.ray, f32::INFINITY, &scene.alpha()) else { continue };
        match scene.geometry.interaction(&ray.ray, &hit).light {
            Some(_) => lamps += 1,
            None => others += 1,
        }
    }
    sheet.between("pixels of the lit box that see its lamp", f64::from(lamps), [10.0, 0.5 * f64::from(others)]);
    Ok(sheet.finish())
}

fn area(q: &radiosity::Quad) -> f64 {
    let sub = |a: [f64; 3], b: [f64; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
    let half = |a, b, c| {
        let (u, v) = (sub(b, a), sub(c, a));
        let x = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        0.5 * (x[0] * x[0] + x[1] * x[1] + x[2] * x[2]).sqrt()
    };
    half(q.p[0], q.p[1], q.p[2]) + half(q.p[2], q.p[3], q.p[0])
}

fn energy(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let b = cornell(c)?;
    let mut rng = Rng::new(c.seed());
    let lamp = b.lamp();
    let emitted = PI * lamp * area(&b.quads[0]);
    let (mut absorbed, mut variance) = (0.0, 0.0);
    for i in 0..b.quads.len() {
        let l = b.leaving(i, None, c.spp(16_000), &mut rng);
        let rho = b.albedo(i);
        // E = pi L / rho, of which 1 - rho stays.
        let per = PI * area(&b.quads[i]) * (1.0 - rho) / rho;
        absorbed += per * (l.mean() - if i == 0 { lamp } else { 0.0 });
        variance += (per * l.standard_error()).powi(2);
    }
    // The open front, z = 0: cosine-distributed directions into the box see what comes out along them.
    let front = radiosity::Quad {
        p: [[552.8, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 548.8, 0.0], [556.0, 548.8, 0.0]],
        material: String::new(),
        n: [0.0, 0.0, -1.0],
    };
    let mut index = 0;
    let out = Mean::of(u64::from(c.spp(160_000)), || {
        let p = radiosity::point_on(&front, &mut rng);
        let (r, phi) = (rng.next_f64().sqrt(), 2.0 * PI * rng.next_f64());
        index += 1;
        b.seen(p, [r * phi.cos(), r * phi.sin(), (1.0 - r * r).sqrt()], None, 99, index)
    });
    let escaped = PI * area(&front) * out.mean();
    variance += (PI * area(&front) * out.standard_error()).powi(2);
    let (sum, se) = ((absorbed + escaped) / emitted, variance.sqrt() / emitted);
    sheet.note(format!(
        "Of what the lamp emits at 550 nm {:.1} % is absorbed and {:.1} % leaves by the front.",
        100.0 * absorbed / emitted,
        100.0 * escaped / emitted
    ));
    sheet.holds(
        "(absorbed + escaped) / emitted",
        format!("{sum:.4} +- {se:.4}"),
        "1 within 4.9 standard errors and 0.3 % (the gap behind the lamp)",
        &format!("{:.1} % of the energy", 100.0 * (6.9 * se + 0.003)),
        (sum - 1.0).abs() <= 4.9 * se + 0.003 && se < 0.01,
    );
    sheet.command(c.command("cornell-box", "--stats stats.json"));
    Ok(sheet.finish())
}

fn radiance_probe(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    // The camera looks at one point of the floor, as green (550 nm) as the middle lane of RGB.
    let text = scenes::cornell()
        .replace("LookAt 278 273 -800  278 273 -799  0 1 0", "LookAt 278 273 -800  370 0 120  0 1 0")
        .replace("\"float fov\" 39.3077", "\"float fov\" 0.001");
    let scene = c.scene("cornell-point", &text, Setup::square(1, 1))?;
    let nothing = || Error::Internal("nothing before the camera".into());
    let camera_ray = camera_sample(&scene, [0, 0], 0).camera_ray.ok_or_else(nothing)?;
    let hit = scene.geometry.intersect(&camera_ray.ray, f32::INFINITY, &scene.alpha()).ok_or_else(nothing)?;
    let at = scene.geometry.interaction(&camera_ray.ray, &hit);
    let mut lambda = scene.sample_wavelengths(0.5);
    let stream = scene.sampler.stream([0, 0], 0);
    let bsdf = scene
        .materials
        .bsdf(at.material, &scene.textures, &at, &scene.texture_context(&at, None), &mut lambda, stream.mix(0))
        .ok_or_else(nothing)?;
    let rho = f64::from(bsdf.f(at.wo, at.wo, irradiant::core::bxdf::TransportMode::Radiance)[1]) * PI;
    let up = if at.wo.dot(bsdf.frame.z) > 0.0 { 1.0f32 } else { -1.0 };
    let production = Production::default();
    let (side, per) = (64usize, c.spp(24));
    let mut index = 0;
    let mut integral = Mean::new();
    let mut image = Image::new(side, side, &["R", "G", "B"]);
    for y in 0..side {
        for x in 0..side {
            // The hemisphere seen from above, equal areas for equal solid angles.
            let (u, v) = ((x as f64 + 0.5) / side as f64 * 2.0 - 1.0, (y as f64 + 0.5) / side as f64 * 2.0 - 1.0);
            let r2 = u * u + v * v;
            if r2 >= 1.0 {
                continue;
            }
            let (z, s) = (1.0 - r2, (2.0 - r2).sqrt());
            let wi = bsdf.frame.from_local(Vec3::new((u * s) as f32, (v * s) as f32, up * z as f32));
            let mut pixel = 0.0;
            for _ in 0..per {
                index += 1;
                pixel += along(&scene, &production, at.spawn_ray(wi), index, &mut []) / f64::from(per);
            }
            (0..3).for_each(|ch| image.set(x, y, ch, pixel as f32));
        }
    }
    // The integral by random directions, so that its error bar is known.
    let mut rng = Rng::new(c.seed());
    for _ in 0..c.spp(80_000) {
        let (z, phi) = (rng.next_f64(), 2.0 * PI * rng.next_f64());
        let s = (1.0 - z * z).sqrt();
        let wi = bsdf.frame.from_local(Vec3::new((s * phi.cos()) as f32, (s * phi.sin()) as f32, up * z as f32));
        index += 1;
        integral.add(along(&scene, &production, at.spawn_ray(wi), index, &mut []) * z * 2.0 * rho);
    }
    let pixel = Mean::of(u64::from(c.spp(20_000)), || {
        index += 1;
        along(&scene, &production, camera_ray.ray, index, &mut [])
    });
    sheet.means_agree("albedo / pi times the integral of the probe, and the pixel", &integral, &pixel, 0.35);
    let sum: f64 = (0..side * side)
        .filter_map(|i| {
            let (u, v) = ((i % side) as f64 + 0.5, (i / side) as f64 + 0.5);
            let r2 = (u / side as f64 * 2.0 - 1.0).powi(2) + (v / side as f64 * 2.0 - 1.0).powi(2);
            (r2 < 1.0).then(|| f64::from(image.get(i % side, i / side, 1)) * (1.0 - r2))
        })
        .sum::<f64>()
        * 2.0
        * 4.0
        / (side * side) as f64;
    sheet.close("the same from the picture's pixels", sum * rho / PI, pixel.mean(), 0.12);
    sheet.picture(
        "B09-probe",
        "What a point of the floor sees: the hemisphere from above (green channel). The bright spot is the lamp.",
        &image,
        8.0,
    );
    Ok(sheet.finish())
}

fn wave_effects(c: &Context) -> Result<Outcome, Error> {
    let mut outcome = c.inherit(&["A17"]);
    let manual = include_str!("../../../../../docs/guide/teach.md").to_lowercase();
    let manual = manual.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut sheet = Sheet::new();
    for word in ["polarization", "diffraction", "thin-film interference"] {
        let said = manual.contains(word);
        sheet.holds(
            &format!("docs/guide/teach.md speaks of {word}"),
            if said { "yes" } else { "no" },
            "yes",
            "its absence",
            said,
        );
    }
    let said = sheet.finish();
    if outcome.verdict == crate::row::Verdict::Passes {
        outcome.verdict = said.verdict;
    }
    outcome.measures.extend(said.measures);
    Ok(outcome)
}

fn dimensions(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    for sampler in ["independent", "stratified", "halton", "sobol", "paddedsobol", "zsobol", "pmj02bn"] {
        let text = scenes::at_the_origin(1, 3.0, "LightSource \"infinite\"\n").replace("independent", sampler);
        let scene = c.scene("one-pixel", &text, Setup::square(1, 1024))?;
        let n = 1024u32;
        // Columns: the camera's numbers, then light and scatter blocks of five vertices.
        let column = |i: u32| -> Vec<Vec<f64>> {
            let stream = scene.sampler.stream([0, 0], i);
            let mut rows: Vec<Vec<f64>> = vec![];
            let camera = stream.camera();
            rows.push(vec![f64::from(camera.film.x), f64::from(camera.film.y), f64::from(camera.wavelength)]);
            for depth in 0..5 {
                let (l, s) = (stream.light(depth), stream.scatter(depth));
                rows.push(vec![f64::from(l.uv.x), f64::from(l.uv.y), f64::from(l.pick)]);
                rows.push(vec![f64::from(s.uv.x), f64::from(s.uv.y), f64::from(s.lobe), f64::from(s.roulette)]);
            }
            rows
        };
        let samples: Vec<Vec<f64>> = (0..n).map(|i| column(i).concat()).collect();
        let dims = samples[0].len();
        let (mut worst, mut equal, mut moments) = (0.0f64, 0, 0.0f64);
        for a in 0..dims {
            let mean = samples.iter().map(|s| s[a]).sum::<f64>() / f64::from(n);
            moments = moments.max((mean - 0.5).abs() * (12.0 * f64::from(n)).sqrt());
            for b in 0..a {
                let cov = samples.iter().map(|s| (s[a] - 0.5) * (s[b] - 0.5)).sum::<f64>() / f64::from(n) * 12.0;
                worst = worst.max(cov.abs() * f64::from(n).sqrt());
                equal += samples.iter().filter(|s| s[a] == s[b]).count();
            }
        }
        sheet.at_most(
            &format!("{sampler}: strongest correlation of two of {dims} dimensions, standard errors"),
            worst,
            5.5,
        );
        sheet.at_most(&format!("{sampler}: means off 1/2, standard errors"), moments, 5.0);
        let pairs = f64::from(n) * (dims * (dims - 1) / 2) as f64;
        sheet.at_most(
            &format!("{sampler}: share of pairs of different dimensions with equal numbers"),
            equal as f64 / pairs,
            1e-4,
        );
    }
    Ok(sheet.finish())
}
