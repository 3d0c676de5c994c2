//! Radiometry, the BRDF, the reflection equation, transport, the rendering equation (A18 to A20, A28 to A31).

use crate::context::{Context, Setup};
use crate::estimate::{Estimator, along};
use crate::row::{Outcome, Row};
use crate::scenes::{self, film};
use crate::sheet::Sheet;
use crate::surface::Surface;
use irradiant::Error;
use irradiant::math::{Point2, Point3, Ray, Vec3, warp};
use irradiant_testkit::{Mean, Rng, integrate_sphere, integrate_square};
use std::f64::consts::PI;

/// A18 to A20, A28 to A31.
pub const ROWS: &[Row] = &[
    Row {
        id: "A18",
        name: "Differential irradiance and radiance at a point",
        says: "dE = L cos dw.",
        check: "Irradiance from a sphere, by quadrature over its solid angle and over its area, and by the renderer's own light samples: pi L (r / d)^2.",
        run: irradiance,
    },
    Row {
        id: "A19",
        name: "BRDF (definition)",
        says: "f = dLr / dEi, per steradian, with both directions pointing away.",
        check: "f(i, o) = f(o, i) for every reflecting material.",
        run: reciprocity,
    },
    Row {
        id: "A20",
        name: "The reflection equation",
        says: "Lr is the integral of f Li cos.",
        check: "Monte Carlo by the materials' own samples against adaptive quadrature of f, for 20 pairs of material and incident light.",
        run: reflection_equation,
    },
    Row {
        id: "A28",
        name: "Challenge: the equation is recursive",
        says: "Incident light at one point is reflected light of another.",
        check: "The residual of the rendering equation, and each bounce by itself.",
        run: |c| Ok(c.inherit(&["A31", "A38"])),
    },
    Row {
        id: "A29",
        name: "Transport function tr(p, w)",
        says: "The first surface along a ray.",
        check: "Random rays in a scene of every kind of shape against the nearest hit of each shape compiled alone; spheres, disks and triangles against f64 formulas.",
        run: first_hits,
    },
    Row {
        id: "A30",
        name: "Radiance invariance along rays",
        says: "What arrives along a ray is what leaves its other end.",
        check: "An emitter has its value at any distance.",
        run: |c| Ok(c.inherit(&["A09"])),
    },
    Row {
        id: "A31",
        name: "The rendering equation",
        says: "Lo = Le + integral of f Lo(tr) cos.",
        check: "At random surface points of a closed box, the estimate of Lo equals Le plus a Monte Carlo integral, by uniform directions, of estimates of Lo at what they meet.",
        run: residual,
    },
];

fn irradiance(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    for (r, d) in [(0.9f64, 1.0f64), (0.5, 2.0), (0.05, 2.0)] {
        let expected = PI * (r / d) * (r / d);
        let edge = (1.0 - (r / d) * (r / d)).sqrt();
        let by_angle = irradiant_testkit::integrate_interval(|z| 2.0 * PI * z, edge, 1.0, 1e-12);
        sheet.close(&format!("r {r}, d {d}: over solid angle"), by_angle, expected, 1e-6);
        // Over the visible cap of the sphere: dw = cos' dA / s^2.
        let by_area = integrate_square(
            |u, _| {
                let cap = r / d;
                let z = cap + (1.0 - cap) * u;
                // The point at polar angle acos z from the direction towards the receiver.
                let (h, x) = (d - r * z, r * (1.0 - z * z).sqrt());
                let s2 = h * h + x * x;
                let cos_emitter = (z * h - (1.0 - z * z).sqrt() * x).max(0.0) / s2.sqrt();
                let cos_receiver = h / s2.sqrt();
                cos_emitter * cos_receiver / s2 * 2.0 * PI * r * r * (1.0 - cap)
            },
            1e-9,
        );
        sheet.close(&format!("r {r}, d {d}: over area"), by_area, expected, 1e-5);
        let light = format!(
            "AttributeBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\nAreaLightSource \"diffuse\" \"rgb L\" [ 1 1 1 ]\nTranslate 0 {d} 0\nShape \"sphere\" \"float radius\" {r}\nAttributeEnd\n"
        );
        let spp = c.spp(4096);
        let text = scenes::at_the_origin(2, 0.05, &light);
        let e = crate::estimate::whole(
            &*c.scene("sphere-light", &text, Setup::square(2, spp))?,
            &*c.production(Some(1)),
            spp,
        );
        sheet.is(&format!("r {r}, d {d}: rendered, times 2 pi"), &e, expected * 0.5 / PI, 0.02);
    }
    let white = integrate_sphere(|d| d[2].max(0.0), 1e-8);
    sheet.close("light of 1 from the hemisphere", white, PI, 1e-5);
    Ok(sheet.finish())
}

const MATERIALS: [(&str, &str); 8] = [
    ("diffuse", "Material \"diffuse\" \"rgb reflectance\" [ .8 .5 .2 ]\n"),
    ("rough metal", "Material \"conductor\" \"float roughness\" 0.3\n"),
    ("brushed metal", "Material \"conductor\" \"float uroughness\" 0.2 \"float vroughness\" 0.6\n"),
    (
        "plastic",
        "Material \"coateddiffuse\" \"rgb reflectance\" [ .8 .5 .3 ] \"float roughness\" 0.4 \"integer maxdepth\" 0\n",
    ),
    ("glossy paint", "Material \"glossypaint\" \"rgb reflectance\" [ .7 .4 .2 ] \"float roughness\" 0.3\n"),
    ("thin-film paint", "Material \"thinfilmpaint\" \"float roughness\" 0.3\n"),
    ("retroreflector", "Material \"retroreflective\" \"float roughness\" 0.3\n"),
    ("rough glass", "Material \"dielectric\" \"float roughness\" 0.4\n"),
];

fn upper(rng: &mut Rng) -> Vec3 {
    let [x, y, z] = rng.upper_direction();
    Vec3::new(x, y, z)
}

fn reciprocity(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let lopsided = |wi: Vec3| if c.faulty("not-reciprocal") && wi.x > 0.0 { 1.05 } else { 1.0 };
    for (name, material) in MATERIALS {
        // Coats walk at random where they have a filling or a rough base; this one is in closed form.
        let surface = Surface::new(c, material)?;
        let mut rng = Rng::new(c.seed());
        let mut worst = 0.0f64;
        for _ in 0..c.spp(2000) {
            let (a, b) = (upper(&mut rng), upper(&mut rng));
            let x = f64::from(surface.f(a, b)[1] * lopsided(b));
            let y = f64::from(surface.f(b, a)[1] * lopsided(a));
            worst = worst.max((x - y).abs() / (x + y).max(1e-6));
        }
        sheet.at_most(&format!("{name}: worst |f(i,o) - f(o,i)| / sum"), worst, 1e-5);
    }
    Ok(sheet.finish())
}

fn reflection_equation(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    type Light = fn(Vec3) -> f64;
    let lights: [(&str, Light); 4] = [
        ("white", |_| 1.0),
        ("gradient", |w| 0.5 + 0.5 * f64::from(w.x)),
        ("soft lamp", |w| (6.0 * (f64::from(w.dot(Vec3::new(0.6, 0.0, 0.8))) - 1.0)).exp()),
        ("stripes", |w| 1.0 + (5.0 * f64::from(w.y)).sin()),
    ];
    let wo = Vec3::new(-0.6, 0.2, (1.0f32 - 0.4).sqrt());
    for (name, material) in [MATERIALS[0], MATERIALS[1], MATERIALS[2], MATERIALS[4], MATERIALS[6]] {
        let surface = Surface::new(c, material)?;
        let mut rng = Rng::new(c.seed());
        for (light_name, light) in lights {
            let value = |d: [f64; 3]| {
                if d[2] <= 0.0 {
                    return 0.0;
                }
                let wi = Vec3::new(d[0] as f32, d[1] as f32, d[2] as f32);
                f64::from(surface.f(wo, wi)[1]) * light(wi) * d[2]
            };
            let exact = integrate_sphere(value, 1e-5);
            let sampled = Mean::of(u64::from(c.spp(40_000)), || {
                let draw = surface.sample(wo, rng.next_f32(), Point2::new(rng.next_f32(), rng.next_f32()));
                draw.map_or(0.0, |s| f64::from(s.f[1] * s.wi.z.abs() / s.pdf) * light(s.wi))
            });
            sheet.mean_is(&format!("{name} under {light_name}"), &sampled, exact, 0.08);
        }
    }
    Ok(sheet.finish())
}

fn first_hits(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let shapes = [
        "Translate -1.5 0 0\nShape \"sphere\" \"float radius\" .8\n",
        "Translate 1.5 .3 .2\nRotate 40 1 1 0\nShape \"disk\" \"float radius\" .9\n",
        "Translate 0 1.4 .3\nRotate 70 1 0 0\nShape \"cylinder\" \"float radius\" .5 \"float zmin\" -.8 \"float zmax\" .9\n",
        "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 0 2 3 0 3 1 1 2 3 ] \"point3 P\" [ -.3 -1 -.5  .9 -1.2 0  0 -.9 1  .1 .2 0 ]\n",
        "Translate -.2 -1.9 0\nShape \"bilinearmesh\" \"point3 P\" [ -1 .1 -1 1 -.2 -1 -1 -.3 1 1 .4 1 ]\n",
        "Translate 1.3 -1.2 -.6\nShape \"curve\" \"point3 P\" [ -.5 0 0 0 1 0 .3 -1 .2 .6 .5 0 ] \"float width\" .3\n",
        "Translate -1.2 -1.3 .6\nScale .6 .6 .6\nShape \"loopsubdiv\" \"integer levels\" 2 \"integer indices\" [ 0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5 ] \"point3 P\" [ 1 0 0  -1 0 0  0 0 1  0 0 -1  0 1 0  0 -1 0 ]\n",
    ];
    let head = film(1) + "LookAt 0 0 -6  0 0 0  0 1 0\nCamera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\n";
    let wrap = |s: &str| format!("AttributeBegin\n{s}AttributeEnd\n");
    let all = c.scene("shapes", &(head.clone() + &shapes.map(wrap).concat()), Setup::default())?;
    let alone: Vec<_> = shapes
        .iter()
        .map(|s| c.scene("shape", &(head.clone() + &wrap(s)), Setup::default()))
        .collect::<Result<_, _>>()?;
    let mut rng = Rng::new(c.seed());
    let n = match c.budget() {
        crate::Budget::Quick => 150_000,
        crate::Budget::Full => 1_000_000,
    };
    let (mut wrong, mut hits) = (vec![], 0);
    for _ in 0..n {
        let v = |d: [f32; 3], s: f32| Vec3::new(d[0] * s, d[1] * s, d[2] * s);
        let radius = 3.5 * rng.next_f32().cbrt();
        let o = v(rng.direction(), radius);
        let ray = Ray::new(Point3::new(o.x, o.y, o.z + 6.0), v(rng.direction(), 1.0), 0.0);
        let t = |s: &irradiant::core::scene::Scene| s.geometry.intersect(&ray, f32::INFINITY, &s.alpha()).map(|h| h.t);
        let nearest = alone.iter().filter_map(|s| t(s)).min_by(f32::total_cmp);
        let found = t(&all);
        hits += usize::from(found.is_some());
        if found != nearest {
            wrong.push(format!("{ray:?}: {found:?}, nearest {nearest:?}"));
        }
    }
    sheet.none_of("rays whose first hit is not the nearest of all shapes alone, bit by bit", n, &wrong);
    sheet.between("share of rays that hit", hits as f64 / n as f64, [0.1, 0.9]);
    // The sphere against its quadratic in f64.
    let mut worst = 0.0f64;
    let sphere = c.scene("sphere", &(head + "Shape \"sphere\"\n"), Setup::default())?;
    for _ in 0..20_000 {
        let (from, towards) = (rng.direction(), rng.direction());
        let o: [f64; 3] = std::array::from_fn(|i| 4.0 * f64::from(from[i]));
        let d: [f64; 3] = std::array::from_fn(|i| 0.6 * f64::from(towards[i]) - o[i]);
        let ray = Ray::new(
            Point3::new(o[0] as f32, o[1] as f32, o[2] as f32 + 6.0),
            Vec3::new(d[0] as f32, d[1] as f32, d[2] as f32),
            0.0,
        );
        let o = [f64::from(ray.o.x), f64::from(ray.o.y), f64::from(ray.o.z) - 6.0];
        let d = [f64::from(ray.d.x), f64::from(ray.d.y), f64::from(ray.d.z)];
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let (a, b, q) = (dot(d, d), dot(o, d), dot(o, o) - 1.0);
        let expected = (-b - (b * b - a * q).sqrt()) / a;
        let got = sphere.geometry.intersect(&ray, f32::INFINITY, &sphere.alpha()).map_or(f64::NAN, |h| f64::from(h.t));
        worst = worst.max(((got - expected) / expected).abs());
        if got.is_nan() {
            worst = f64::INFINITY;
        }
    }
    sheet.at_most("sphere: worst t against the quadratic in f64 (relative)", worst, 1e-6);
    Ok(sheet.finish())
}

/// A random point of what a random ray from inside the box meets, seen from where it came.
fn seen(scene: &irradiant::core::scene::Scene, rng: &mut Rng) -> Ray {
    let world = scene.world_from_render().inverse();
    let p: [f64; 3] = std::array::from_fn(|_| rng.next_f64() - 0.5);
    let q: [f64; 3] =
        std::array::from_fn(|r| world.m[r][0] * p[0] + world.m[r][1] * p[1] + world.m[r][2] * p[2] + world.m[r][3]);
    let [x, y, z] = rng.direction();
    Ray::new(Point3::new(q[0] as f32, q[1] as f32, q[2] as f32), Vec3::new(x, y, z), 0.0)
}

fn residual(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let n = c.spp(6000);
    let scene = c.scene("lit-box", &scenes::lit_box(1), Setup::square(1, 1))?;
    let production = c.production(None);
    let estimator: &dyn Estimator = &*production;
    let mut rng = Rng::new(c.seed());
    let lambda = irradiant::spectrum::Wavelengths::rgb();
    let mut index = 0;
    let (mut worst, mut points) = (Mean::new(), 0);
    let mut all = (Mean::new(), Mean::new());
    for _ in 0..8 {
        let ray = seen(&scene, &mut rng);
        let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else { continue };
        let at = scene.geometry.interaction(&ray, &hit);
        points += 1;
        let mut l = || {
            index += 1;
            index
        };
        let left = Mean::of(u64::from(n), || along(&scene, estimator, ray, l(), &mut []));
        let le = at.light.map_or(0.0, |id| f64::from(scene.lights.get(id).emitted(at.n, at.uv, at.wo, &lambda)[1]));
        let mut own = lambda;
        let context = scene.texture_context(&at, None);
        let stream = scene.sampler.stream([0, 0], 0);
        let bsdf = scene.materials.bsdf(at.material, &scene.textures, &at, &context, &mut own, stream.mix(0));
        let Some(bsdf) = bsdf else { continue };
        let up = if at.wo.dot(bsdf.frame.z) > 0.0 { 1.0 } else { -1.0 };
        let right = Mean::of(u64::from(4 * n), || {
            let w = warp::uniform_hemisphere(Point2::new(rng.next_f32(), rng.next_f32()));
            let wi = bsdf.frame.from_local(Vec3::new(w.x, w.y, up * w.z));
            let f = bsdf.f(at.wo, wi, irradiant::core::bxdf::TransportMode::Radiance)[1];
            let next = at.spawn_ray(wi);
            let mut arriving = along(&scene, estimator, next, l(), &mut []);
            if c.faulty("emission-left-out")
                && let Some(hit) = scene.geometry.intersect(&next, f32::INFINITY, &scene.alpha())
            {
                let met = scene.geometry.interaction(&next, &hit);
                arriving -= met
                    .light
                    .map_or(0.0, |id| f64::from(scene.lights.get(id).emitted(met.n, met.uv, met.wo, &lambda)[1]));
            }
            le + f64::from(f * w.z) * arriving * 2.0 * PI
        });
        let z = irradiant_testkit::z_score(&left, &right).abs();
        worst.add(z);
        all = (all.0.merge(&left), all.1.merge(&right));
        sheet.means_agree(&format!("point {points}: Lo and Le + K Lo"), &left, &right, 0.25);
    }
    sheet.means_agree("all points together", &all.0, &all.1, 0.08);
    Ok(sheet.finish())
}
