//! Floating point: where hits lie, and how rays leave them (A63 to A68).

use crate::context::{Context, Setup};
use crate::row::{Outcome, Row};
use crate::scenes::{film, quad};
use crate::sheet::Sheet;
use crate::walk::Wrong;
use irradiant::Error;
use irradiant::core::interaction::Interaction;
use irradiant::core::scene::Scene;
use irradiant::image::Image;
use irradiant::math::{Point3, Ray, Vec3};
use irradiant::renderer::camera_samples::camera_sample;
use irradiant_testkit::Rng;

/// A63 to A68.
pub const ROWS: &[Row] = &[
    Row {
        id: "A63",
        name: "Numerical precision: a distant circle",
        says: "A ray from (0, 0) to a circle of radius 1 at (1930.420, 1973.505): the computed point is not on it.",
        check: "Hits of our sphere lie within 3e-4 of it in the world's f32, and within 2e-7 in its own frame; the textbook quadratic in f32 misses by far.",
        run: distant_circle,
    },
    Row {
        id: "A64",
        name: "Noisy shadows (figure)",
        says: "Surfaces shadow themselves because hits are rounded.",
        check: "A convex body lit from one side: no lit point is in shadow, at scales 1e-4 to 1e6 and moved by 1e5 of its size; with rays that leave from the rounded hit, many are.",
        run: acne,
    },
    Row {
        id: "A65",
        name: "Remedy 1: double instead of float",
        says: "53 instead of 24 bits, for more memory.",
        check: "Geometry in f64: self-shadows, memory and time against f32.",
        run: double_precision,
    },
    Row {
        id: "A66",
        name: "Remedy 2: ignore the last object hit",
        says: "Works for flat objects only, and not for coincident triangles.",
        check: "Ignoring the triangle that was hit mends a flat floor; with two floors in one place it fails; leaving from beyond the error bounds mends both.",
        run: ignore_last,
    },
    Row {
        id: "A67",
        name: "Remedy 3: offset along the ray",
        says: "Hard to choose: neither too small nor too big.",
        check: "Every fixed offset from 1e-6 to 1 shadows itself or leaks through a thin gap at one of the scales 1e-3, 1, 1e3; error-bound offsets do neither at any.",
        run: fixed_offsets,
    },
    Row {
        id: "A68",
        name: "Remedy 4: project the hit to the surface",
        says: "Move the computed point to the closest point of the surface.",
        check: "Distance of hits from sphere, disk, cylinder and triangle in their own frames, in units of f32 rounding; and that the stated error bound covers it.",
        run: projected,
    },
];

fn distant_circle(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let (cx, cy) = (1930.420f32, 1973.505f32);
    let ball = format!("Translate {cx} {cy} 0\nShape \"sphere\"\n");
    let scene = |look: &str| {
        c.scene(
            "distant-circle",
            &(film(1) + look + "Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\n" + &ball),
            Setup::default(),
        )
    };
    // Once in world coordinates; once with the camera at the centre, where render space is the sphere's own frame.
    let world = scene("")?;
    let own = scene(&format!("LookAt {cx} {cy} 0  {cx} {cy} 1  0 1 0\n"))?;
    let naive = |d: Vec3| {
        // The textbook: a t^2 + 2 b t + c = 0 with c = |C|^2 - r^2, all in f32.
        let (b, q) = (d.x * cx + d.y * cy, cx * cx + cy * cy - 1.0);
        let t = b - (b * b - q).max(0.0).sqrt();
        Point3::new(t * d.x, t * d.y, t * d.z)
    };
    let off = |p: Point3, x: f64, y: f64| {
        let d = [f64::from(p.x) - x, f64::from(p.y) - y, f64::from(p.z)];
        (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt() - 1.0
    };
    let (mut ours, mut inner, mut textbook, mut hits) = (0.0f64, 0.0f64, 0.0f64, 0);
    let mut rng = Rng::new(c.seed());
    for _ in 0..c.spp(2000) {
        // Towards points about the slide's, spread over the visible cap.
        let (a, b) = (1.6 * rng.next_f32() - 0.8, 1.6 * rng.next_f32() - 0.8);
        let d = Vec3::new(cx + a * 0.715, cy - a * 0.699, b).normalize();
        if c.faulty("naive-quadratic") {
            ours = ours.max(off(naive(d), f64::from(cx), f64::from(cy)).abs());
        }
        let from = |s: &Scene, o: Point3| {
            let ray = Ray::new(o, d, 0.0);
            let hit = s.geometry.intersect(&ray, f32::INFINITY, &s.alpha())?;
            Some(s.geometry.interaction(&ray, &hit).p)
        };
        let Some(p) = from(&world, Point3::ZERO) else { continue };
        ours = ours.max(off(p, f64::from(cx), f64::from(cy)).abs());
        textbook = textbook.max(off(naive(d), f64::from(cx), f64::from(cy)).abs());
        hits += 1;
        if let Some(p) = from(&own, Point3::new(-cx, -cy, 0.0)) {
            inner = inner.max(off(p, 0.0, 0.0).abs());
        }
    }
    sheet.at_least("hits", f64::from(hits), 500.0);
    sheet.at_most("worst | |hit - C| - 1 |, world coordinates in f32", ours, 3e-4);
    sheet.at_most("the same in the sphere's frame", inner, 2e-7);
    sheet.at_least("the textbook quadratic in f32: worst", textbook, 0.05);
    sheet.note("The slide's digits contradict each other: its \"true\" point is 1.00062 from C, its \"computed\" point is C to 0.0006. For the ray that they describe f64 gives (1929.7207, 1972.7901).");
    Ok(sheet.finish())
}

/// A ball (or an octahedron, subdivided) at a place and scale, and its camera with it.
fn body(scale: f64, shift: f64, shape: &str, size: u32) -> String {
    let at = |x: f64, y: f64, z: f64| format!("{} {} {}", scale * (x + shift), scale * y, scale * z);
    film(size)
        + &format!(
            "LookAt {}  {}  0 1 0\nCamera \"perspective\" \"float fov\" 40\nWorldBegin\n",
            at(0.0, 0.0, -3.0),
            at(0.0, 0.0, 0.0)
        )
        + &format!(
            "LightSource \"distant\" \"rgb L\" [ 3 3 3 ] \"point3 from\" [ 2 1.5 -1 ] \"point3 to\" [ 0 0 0 ]\nMaterial \"diffuse\" \"rgb reflectance\" [ .7 .65 .6 ]\nTranslate {} 0 0\nScale {scale} {scale} {scale}\n",
            scale * shift
        )
        + shape
}

const BALL: &str = "Shape \"sphere\"\n";
const MESH: &str = "Shape \"loopsubdiv\" \"integer levels\" 4 \"integer indices\" [ 0 2 4  2 1 4  1 3 4  3 0 4  2 0 5  1 2 5  3 1 5  0 3 5 ] \"point3 P\" [ 1.4 0 0  -1.4 0 0  0 0 1.4  0 0 -1.4  0 1.4 0  0 -1.4 0 ]\n";

/// Lit points of the picture, and how many of them are in shadow when rays leave them in the given way.
fn shadows(
    scene: &Scene,
    light: Vec3,
    leave: &dyn Fn(&Interaction) -> Ray,
    image: &mut Option<&mut Image>,
) -> (u32, u32) {
    let (mut lit, mut shadowed) = (0, 0);
    let bounds = scene.bounds();
    for y in bounds.y0..bounds.y1 {
        for x in bounds.x0..bounds.x1 {
            let Some(ray) = camera_sample(scene, [x, y], 0).camera_ray else { continue };
            let Some(hit) = scene.geometry.intersect(&ray.ray, f32::INFINITY, &scene.alpha()) else { continue };
            let at = scene.geometry.interaction(&ray.ray, &hit);
            // Shading normals and facets disagree at the rim: lit is what both the true side and the facet say.
            let cosine = at.n.as_vec().dot(light);
            if cosine < 0.05 {
                continue;
            }
            lit += 1;
            let blocked = scene.geometry.occluded(&leave(&at), f32::INFINITY, &scene.alpha());
            shadowed += u32::from(blocked);
            if let Some(image) = image {
                let value = if blocked { 0.02 } else { 0.8 * cosine };
                (0..3).for_each(|c| image.set(x as usize, y as usize, c, value));
            }
        }
    }
    (lit, shadowed)
}

fn sun() -> Vec3 {
    Vec3::new(2.0, 1.5, -1.0).normalize()
}

fn acne(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let robust = |at: &Interaction| at.spawn_ray(sun());
    let rounded = |at: &Interaction| Ray::new(at.p, sun(), at.time);
    let ours: &dyn Fn(&Interaction) -> Ray = if c.wrong() == Wrong::NoOffset { &rounded } else { &robust };
    let size = c.side(96);
    let (mut lit_all, mut wrong) = (0, vec![]);
    for (name, shape) in [("ball", BALL), ("mesh", MESH)] {
        for (scale, shift) in
            [(1e-4, 0.0), (1e-2, 0.0), (1.0, 0.0), (1e3, 0.0), (1e6, 0.0), (1.0, 1e3), (1.0, 1e5), (1e-3, 1e5)]
        {
            let scene = c.scene("body", &body(scale, shift, shape, size), Setup::square(size, 1))?;
            let (lit, shadowed) = shadows(&scene, sun(), ours, &mut None);
            lit_all += lit as usize;
            if shadowed > 0 || lit < size * size / 8 {
                wrong.push(format!("{name} at scale {scale}, moved {shift}: {shadowed} of {lit}"));
            }
        }
    }
    sheet.none_of("bodies with lit points in their own shadow", 16, &wrong);
    sheet.at_least("lit points looked at", lit_all as f64, 10_000.0);
    let side = c.side(160);
    let scene = c.scene("body", &body(1.0, 0.0, BALL, side), Setup::square(side, 1))?;
    let blank = || Image::from_fn(side as usize, side as usize, ["R", "G", "B"], |_, _| [0.06, 0.07, 0.09]);
    let (mut noisy, mut clean) = (blank(), blank());
    let (lit, shadowed) = shadows(&scene, sun(), &rounded, &mut Some(&mut noisy));
    shadows(&scene, sun(), &robust, &mut Some(&mut clean));
    sheet.at_least(
        "from the rounded hit: % of lit points in shadow",
        100.0 * f64::from(shadowed) / f64::from(lit),
        1.0,
    );
    sheet.picture(
        "A64-acne",
        "Shadow rays from the rounded hit, and from beyond its error bounds.",
        &super::super::shared::strip(&[&noisy, &clean]),
        0.0,
    );
    Ok(sheet.finish())
}

fn double_precision(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let spp = c.spp(16);
    let text = body(1.0, 0.0, BALL, 48);
    let run = |leaving: &str| -> Result<Option<(crate::estimate::Estimate, f64)>, Error> {
        let Some(integrator) = c.integrator("selfintersection", &[("leaving", leaving)], Some(1))? else {
            return Ok(None);
        };
        let scene = c.scene("body", &text, Setup::square(48, spp))?;
        Ok(Some(crate::estimate::by_integrator(&scene, &*integrator, spp)))
    };
    let (Some((naive, _)), Some((single, robust_time)), Some((double, time))) =
        (run("none")?, run("robust")?, run("fp64")?)
    else {
        return Ok(Outcome::waits("geometry in f64 is not a mode of this build"));
    };
    sheet.at_most(
        "f32 without remedy: brightness over that by error bounds (self-shadows)",
        naive.grey() / single.grey(),
        0.97,
    );
    sheet.agree("f64, and f32 with error bounds", &double, &single, 0.05);
    sheet.note(format!(
        "The f64 mode took {:.1} times the CPU seconds of the robust one here; its points take 24 bytes instead of 12.",
        time / robust_time
    ));
    sheet.command(c.command("body", "--integrator selfintersection --estimator leaving=fp64"));
    Ok(sheet.finish())
}

fn ignore_last(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    // Slanted floors, far from the origin of the world, so that hits are rounded; one, and two in one place.
    let floor = quad([[-1.3, -0.7, -0.9], [1.1, -0.5, -1.1], [1.3, 0.9, 1.2], [-1.0, 0.4, 0.7]]);
    let text = |n: usize| {
        film(48)
            + "LookAt 0.3 3 -2  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 20\nWorldBegin\nLightSource \"distant\" \"rgb L\" [ 1 1 1 ] \"point3 from\" [ .3 1 -.2 ] \"point3 to\" [ 0 0 0 ]\nMaterial \"diffuse\"\n"
            + &floor.repeat(n)
    };
    let spp = c.spp(8);
    let run = |n: usize, leaving: &str| -> Result<Option<f64>, Error> {
        let Some(integrator) = c.integrator("selfintersection", &[("leaving", leaving)], Some(1))? else {
            return Ok(None);
        };
        let name = if n == 1 { "floor" } else { "two-floors" };
        let scene = c.scene(name, &text(n), Setup::square(48, spp))?;
        Ok(Some(crate::estimate::by_integrator(&scene, &*integrator, spp).0.grey()))
    };
    let Some(whole) = run(1, "robust")? else {
        return Ok(Outcome::waits("the remedies are not modes of this build"));
    };
    let share = |n, leaving| -> Result<f64, Error> { Ok(run(n, leaving)?.unwrap_or(0.0) / whole) };
    sheet.at_most("one floor, no remedy: light that is left", share(1, "none")?, 0.97);
    sheet.between("one floor, the last triangle ignored", share(1, "skip-id")?, [0.995, 1.005]);
    sheet.at_most("two floors in one place, the last triangle ignored", share(2, "skip-id")?, 0.97);
    sheet.between("two floors in one place, error bounds (production)", share(2, "robust")?, [0.995, 1.005]);
    sheet.command(c.command("two-floors", "--integrator selfintersection --estimator leaving=skip-id"));
    Ok(sheet.finish())
}

fn fixed_offsets(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let scales = [1e-3, 1.0, 1e3];
    // The same body far from the origin of its camera, and a lid at 1/500 of its size over the lit side.
    let size = c.side(64);
    let lid = "Shape \"sphere\"\nShape \"sphere\" \"float radius\" 1.002\n";
    let trial = |leave: &dyn Fn(&Interaction) -> Ray| -> Result<(u32, u32), Error> {
        let (mut acne, mut leaks) = (0, 0);
        for scale in scales {
            let plain = c.scene("body", &body(scale, 0.0, BALL, size), Setup::square(size, 1))?;
            acne += shadows(&plain, sun(), leave, &mut None).1;
            // Under the lid everything is in shadow: start from the inner sphere.
            let covered = c.scene("body-lid", &body(scale, 0.0, lid, size), Setup::square(size, 1))?;
            let inner = c.scene("body", &body(scale, 0.0, BALL, size), Setup::square(size, 1))?;
            for pixel in 0..(size * size) as i32 {
                let at = [pixel % size as i32, pixel / size as i32];
                let Some(ray) = camera_sample(&inner, at, 0).camera_ray else { continue };
                let Some(hit) = inner.geometry.intersect(&ray.ray, f32::INFINITY, &inner.alpha()) else { continue };
                let at = inner.geometry.interaction(&ray.ray, &hit);
                if at.n.as_vec().dot(sun()) > 0.05
                    && !covered.geometry.occluded(&leave(&at), f32::INFINITY, &covered.alpha())
                {
                    leaks += 1;
                }
            }
        }
        Ok((acne, leaks))
    };
    for power in -6..=0 {
        let offset = 10f32.powi(power);
        let fixed = |at: &Interaction| Ray::new(at.p + sun() * offset, sun(), at.time);
        let (acne, leaks) = trial(&fixed)?;
        sheet.at_least(
            &format!("offset 1e{power}: self-shadows ({acne}) and leaks ({leaks}) at three scales"),
            f64::from(acne + leaks),
            1.0,
        );
    }
    let (acne, leaks) = trial(&|at: &Interaction| at.spawn_ray(sun()))?;
    sheet.at_most("offsets by error bounds: self-shadows and leaks", f64::from(acne + leaks), 0.0);
    Ok(sheet.finish())
}

fn projected(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    type Off = fn([f64; 3]) -> f64;
    let shapes: [(&str, &str, Off); 4] = [
        ("sphere", "Shape \"sphere\" \"float radius\" 1.3\n", |p| {
            (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt() - 1.299_999_952_316_284_2
        }),
        ("disk", "Shape \"disk\" \"float height\" 0.3 \"float radius\" 2\n", |p| p[2] - 0.300_000_011_920_928_96),
        ("cylinder", "Shape \"cylinder\" \"float radius\" 1.1 \"float zmin\" -2 \"float zmax\" 2\n", |p| {
            p[0].hypot(p[1]) - 1.100_000_023_841_857_9
        }),
        (
            "triangle",
            "Shape \"trianglemesh\" \"integer indices\" [ 0 1 2 ] \"point3 P\" [ 2 0 0  0 1 0  0 0 4 ]\n",
            |p| (p[0] * 0.5 + p[1] + p[2] * 0.25 - 1.0) / (0.25f64 + 1.0 + 0.0625).sqrt(),
        ),
    ];
    for (name, shape, off) in shapes {
        // The camera is at the origin: render space is the shape's own.
        let scene = c.scene(
            "shape",
            &(film(1) + "Camera \"perspective\"\nWorldBegin\nLightSource \"infinite\"\n" + shape),
            Setup::default(),
        )?;
        let mut rng = Rng::new(c.seed());
        let (mut worst, mut beyond, mut hits) = (0.0f64, vec![], 0);
        for _ in 0..c.spp(5000) {
            let (a, b) = (rng.direction(), rng.direction());
            // From up to 3000 away.
            let far = 10f32.powf(1.0 + 2.5 * rng.next_f32());
            let o = Point3::new(a[0] * far, a[1] * far, a[2] * far);
            let target = Vec3::new(b[0], b[1], b[2]);
            let d = (target - (o - Point3::ZERO)).normalize();
            let ray = Ray::new(o, d, 0.0);
            let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else { continue };
            let at = scene.geometry.interaction(&ray, &hit);
            hits += 1;
            let p = [f64::from(at.p.x), f64::from(at.p.y), f64::from(at.p.z)];
            let distance = off(p).abs();
            worst = worst.max(distance / f64::from(f32::EPSILON));
            let bound = f64::from(at.p_error.x + at.p_error.y + at.p_error.z);
            if distance > bound {
                beyond.push(format!("{p:?}: {distance:e} beyond {bound:e}"));
            }
        }
        sheet.at_most(&format!("{name}: worst distance of {hits} hits from the surface, in f32 epsilons"), worst, 4.0);
        sheet.none_of(&format!("{name}: hits farther off than their stated bound"), hits, &beyond);
    }
    Ok(sheet.finish())
}
