//! Emitters: what is drawn has the density that is claimed, and covers what rays see.

use super::*;
use crate::interaction::ReferencePoint;
use irradiant_testkit::{Mean, chi2_counts, z_score};

fn at(p: [f32; 3], n: Option<[f32; 3]>) -> ReferencePoint {
    let n = n.map_or(Normal3::ZERO, |n| Vec3::from(n).normalize().as_normal());
    ReferencePoint { p: p.into(), p_error: Vec3::ZERO, n, ns: n }
}

fn emitters() -> Vec<(&'static str, Geometry)> {
    let mut list: Vec<_> = zoo().into_iter().filter(|(name, _)| *name != "cube").collect();
    let tall = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    let uneven = trs(0.1, 0.2, 0.0, 70.0, [1.0, 0.3, 1.0], [1.0, 0.4, 1.0]);
    list.push(("squeezed rectangle", shape(patch(tall), uneven)));
    list.push((
        "trapezoid",
        shape(patch([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [-0.3, 0.9, 0.0], [0.4, 1.0, 0.0]]), uneven),
    ));
    let skew = trs(0.1, 0.3, -0.2, 40.0, [1.0, 0.5, 0.2], [1.0; 3]);
    let corners = [[-1.0, -0.6, 0.0], [1.0, -0.6, 0.0], [1.0, 0.6, 0.0], [-1.0, 0.6, 0.0]];
    list.push(("two triangles", shape(triangles(&corners, &[[0, 1, 2], [2, 3, 0]]), skew)));
    list.into_iter().map(|(name, s)| (name, compile(vec![emissive(s)]))).collect()
}

/// Points of view: outside near and far, at grazing heights, inside of closed ones, with and without a surface.
fn views() -> Vec<ReferencePoint> {
    vec![
        at([1.5, 1.0, 1.2], None),
        at([-0.4, 1.9, -1.1], Some([0.3, -1.0, 0.5])),
        at([0.2, -0.2, 0.35], Some([0.0, 1.0, 0.2])),
        at([9.0, -4.0, 2.0], Some([-1.0, 0.5, -0.6])),
        at([60.0, 20.0, -45.0], Some([-1.0, 0.0, 0.4])),
    ]
}

fn uniform(rng: &mut Rng) -> Point2 {
    Point2::new(rng.next_f32(), rng.next_f32())
}

/// Less is edge-on: there densities per steradian have poles, which no quadrature here resolves.
const EDGE_ON: f32 = 0.1;

/// Every surface that a ray meets, in turn, with its claimed density, but for edge-on ones.
fn density(g: &Geometry, r: &ReferencePoint, w: Vec3) -> f64 {
    let mut total = 0.0;
    let mut t_min = 0.0f32;
    for _ in 0..3 {
        // Start over behind each hit.
        let o = Point3::new(r.p.x + w.x * t_min, r.p.y + w.y * t_min, r.p.z + w.z * t_min);
        let ray = Ray::new(o, w, 0.0);
        let Some(h) = g.intersect(&ray, f32::INFINITY, &NoAlphaTextures) else { break };
        let hit = g.interaction(&ray, &h);
        if hit.n.dot(w).abs() > EDGE_ON {
            total += g.emitters()[0].geometry.pdf(r, w, hit.p, hit.n, hit.uv) as f64;
        }
        t_min = (t_min + h.t) * (1.0 + 3e-6) + 1e-6;
    }
    total
}

/// Areas, as the mean of 1 / pdf over points drawn by area, and by an independent way: the share of random lines through a
/// ball that meet the surface (Cauchy, Crofton: mean number of meetings = area / (2 pi r^2)). 4.5 sigma, 0.6 % would show.
#[test]
fn areas_are_what_random_lines_say() {
    let mut rng = Rng::new(1);
    for (name, g) in emitters() {
        let e = &g.emitters()[0].geometry;
        let drawn = Mean::of(20_000, || e.sample_area(uniform(&mut rng), true).map_or(0.0, |s| 1.0 / s.pdf as f64));
        let error = (drawn.mean() / e.area() as f64 - 1.0).abs();
        assert!(error < 1e-4 + 4.5 * drawn.standard_error() / drawn.mean(), "{name}: {drawn:?} {}", e.area());
        // Uniform lines of a ball of radius 4: a uniform direction, and a uniform point of the disk across it.
        let radius = 4.0f32;
        let meetings = Mean::of(120_000, || {
            let w = Vec3::from(rng.direction());
            let frame = irradiant_math::Frame::from_z(w);
            let p = irradiant_math::warp::uniform_disk_concentric(uniform(&mut rng));
            let from = (frame.x * p.x + frame.y * p.y) * radius - w * (2.0 * radius);
            let mut ray = Ray::new(from.as_point(), w, 0.0);
            let mut n = 0.0;
            while let Some(h) = g.intersect(&ray, f32::INFINITY, &NoAlphaTextures) {
                n += 1.0;
                ray.o = ray.at(h.t + 1e-4);
                if n > 4.0 {
                    break;
                }
            }
            // The mean number of meetings of a line with a surface of area A within a ball is A / (2 pi r^2).
            n * std::f64::consts::TAU * (radius * radius) as f64
        });
        let z = (meetings.mean() - e.area() as f64) / meetings.standard_error();
        assert!(z.abs() < 4.5, "{name}: {meetings:?} {}", e.area());
    }
}

/// What a draw says of itself is what a ray that meets that point says: place, normal, parameters, densities.
#[test]
fn draws_and_hits_agree() {
    let mut rng = Rng::new(2);
    for (name, g) in emitters() {
        let e = &g.emitters()[0].geometry;
        let bounds = e.bounds();
        let cone = e.normal_cone();
        for (i, view) in views().iter().enumerate() {
            let (mut met, mut off) = (0, 0);
            for _ in 0..1500 {
                let u = uniform(&mut rng);
                let (Some(s), Some(by_area)) = (e.sample(view, u, true), e.sample_area(u, true)) else { continue };
                let close = |a: f32, b: f32| (a / b - 1.0).abs() < 2e-3;
                assert!(close(e.pdf_area(by_area.p, by_area.n, by_area.uv), by_area.pdf), "{name} {by_area:?}");
                assert!((s.n.length() - 1.0).abs() < 1e-5 && s.n.dot(cone.axis) > cone.cos_angle - 1e-4, "{name}");
                let grown = Bounds3 { min: bounds.min - s.p_error * 2.0, max: bounds.max + s.p_error * 2.0 };
                assert!(grown.contains(s.p), "{name} {s:?} {bounds:?}");
                let w = s.p - view.p;
                let distance = w.length();
                let w = w / distance;
                let ray = Ray::new(view.p, w, 0.0);
                let claimed = e.pdf(view, w, s.p, s.n, s.uv);
                // Grazing directions make areas of solid angles ill-conditioned.
                let cos = s.n.dot(w).abs();
                if cos > 0.02 {
                    assert!(close(claimed, s.pdf), "{name} from {i}: {claimed} {s:?}");
                }
                let Some(h) = g.intersect(&ray, f32::INFINITY, &NoAlphaTextures) else {
                    off += 1;
                    continue;
                };
                if (h.t / distance - 1.0).abs() > 1e-4 || cos < 0.02 {
                    // Hidden by another part of itself.
                    continue;
                }
                met += 1;
                let hit = g.interaction(&ray, &h);
                let seam = (hit.uv.x - s.uv.x).abs() > 0.9;
                assert!((hit.p - s.p).length() < 3e-4 * distance, "{name} from {i}");
                assert!(hit.n.dot_normal(s.n) > 0.999, "{name} from {i}: {:?} {:?}", hit.n, s.n);
                assert!(seam || (hit.uv - s.uv).length() < 0.02, "{name} from {i}: {:?} {:?}", hit.uv, s.uv);
            }
            // Edges are missed now and then.
            assert!(met > 100 && off < 60, "{name} from {i}: {met} {off}");
        }
    }
}

/// A square of directions: the whole sphere, or a window around something far.
enum Chart {
    Sphere,
    Window(irradiant_math::Frame, f32),
}

impl Chart {
    /// The direction at a point of the unit square, and steradians per area of the square there.
    fn direction(&self, a: f32, b: f32) -> (Vec3, f64) {
        match self {
            Self::Sphere => {
                let z = 2.0 * a - 1.0;
                let (s, c) = (std::f32::consts::TAU * b).sin_cos();
                let r = (1.0 - z * z).max(0.0).sqrt();
                (Vec3::new(r * c, r * s, z).normalize(), 4.0 * std::f64::consts::PI)
            }
            Self::Window(frame, half) => {
                let (x, y) = ((2.0 * a - 1.0) * half, (2.0 * b - 1.0) * half);
                let w = frame.x * x + frame.y * y + frame.z;
                (w.normalize(), 4.0 * (half * half) as f64 / (w.length() as f64).powi(3))
            }
        }
    }

    fn locate(&self, w: Vec3) -> (f32, f32) {
        match self {
            Self::Sphere => {
                (0.5 * (w.z + 1.0), w.y.atan2(w.x).rem_euclid(std::f32::consts::TAU) / std::f32::consts::TAU)
            }
            Self::Window(frame, half) => {
                let v = frame.to_local(w);
                (0.5 * (v.x / v.z / half + 1.0), 0.5 * (v.y / v.z / half + 1.0))
            }
        }
    }
}

/// Chi-square of directions against the claimed density per steradian, the density found by meeting the surface; and its
/// integral over all directions is one (B21), or the share of draws that are not edge-on. 20 x 20 cells, each integrated
/// with 484 jittered points; the integral must be within 1 % of that share and is then divided out. One draw in ten is
/// uniform, so that cells at edges are not nearly empty. p < 1e-6 fails; 30,000 draws show a density that is off by 7 %
/// over half of them.
#[test]
fn directions_follow_the_claimed_density() {
    const N: usize = 20;
    const SUB: usize = 22;
    let mut rng = Rng::new(3);
    for (name, g) in emitters() {
        let e = &g.emitters()[0].geometry;
        for (i, view) in views().iter().enumerate() {
            let (center, radius) = g.bounds().bounding_sphere();
            let to = center - view.p;
            let chart = if to.length() > 1.5 * radius {
                let half = 1.02 * radius / (to.length_squared() - radius * radius).sqrt();
                Chart::Window(irradiant_math::Frame::from_z(to.normalize()), half)
            } else {
                Chart::Sphere
            };
            let mut cells = vec![0.0f64; N * N];
            for (k, cell) in cells.iter_mut().enumerate() {
                for s in 0..SUB * SUB {
                    let jitter = |cell: usize, sub: usize, rng: &mut Rng| {
                        (cell as f32 + (sub as f32 + rng.next_f32()) / SUB as f32) / N as f32
                    };
                    let (a, b) = (jitter(k / N, s / SUB, &mut rng), jitter(k % N, s % SUB, &mut rng));
                    let (w, steradians) = chart.direction(a, b);
                    *cell += density(&g, view, w) * steradians / (N * N * SUB * SUB) as f64;
                }
            }
            let integral: f64 = cells.iter().sum();
            let probabilities: Vec<f64> = cells.iter().map(|c| 0.9 * c / integral + 0.1 / (N * N) as f64).collect();
            let mut counts = vec![0u64; N * N];
            let mut share = Mean::new();
            let mut n = 0;
            while n < 30_000 {
                let u = uniform(&mut rng);
                let (a, b) = if n % 10 == 0 {
                    (u.x, u.y)
                } else {
                    let w = e.sample(view, u, true).map(|s| ((s.p - view.p).normalize(), s.n));
                    let kept = w.filter(|(w, n)| n.dot(*w).abs() > EDGE_ON);
                    share.add(f64::from(kept.is_some()));
                    let Some((w, _)) = kept else { continue };
                    chart.locate(w)
                };
                n += 1;
                assert!((0.0..=1.0).contains(&a) && (0.0..=1.0).contains(&b), "{name} from {i}: {a} {b}");
                let cell = |x: f32| ((x * N as f32) as usize).min(N - 1);
                counts[cell(a) * N + cell(b)] += 1;
            }
            let p = share.mean();
            assert!((integral - p).abs() < 0.01, "{name} from {i}: {integral} {p}");
            let report = chi2_counts(&counts, &probabilities);
            assert!(report.p_value > 1e-6, "{name} from {i}: {integral} {report:?}");
        }
    }
}

/// The mean of visible / pdf is the solid angle of the shape, as counted by uniform directions. 4.5 sigma.
#[test]
fn draws_cover_the_solid_angle_that_rays_see() {
    let mut rng = Rng::new(4);
    for (name, g) in emitters() {
        let e = &g.emitters()[0].geometry;
        for (i, view) in views().iter().enumerate().take(3) {
            let mut drawn = Mean::new();
            let mut counted = Mean::new();
            for _ in 0..60_000 {
                let x = e.sample(view, uniform(&mut rng), true).map_or(0.0, |s| {
                    let segment = view.spawn_ray_to(s.p, s.p_error, s.n, 0.0);
                    let visible = !g.occluded_between(&segment, &NoAlphaTextures);
                    if visible { 1.0 / s.pdf as f64 } else { 0.0 }
                });
                drawn.add(x);
                let w = Vec3::from(rng.direction());
                let hit = g.occluded(&Ray::new(view.p, w, 0.0), f32::INFINITY, &NoAlphaTextures);
                counted.add(if hit { 4.0 * std::f64::consts::PI } else { 0.0 });
            }
            assert!(z_score(&drawn, &counted).abs() < 4.5, "{name} from {i}: {drawn:?} {counted:?}");
        }
    }
}

/// Closed forms: a sphere's cone, a triangle's and a square's solid angle, and no variance where none is due.
#[test]
fn solid_angle_sampling_has_no_variance() {
    let mut rng = Rng::new(5);
    let sphere = compile(vec![emissive(shape(ball(0.5), trs(0.0, 0.0, 2.0, 0.0, [1.0, 0.0, 0.0], [2.0; 3])))]);
    let octant = triangles(&[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], &[[0, 1, 2]]);
    let octant = compile(vec![emissive(shape(octant, Transform::IDENTITY))]);
    let face = patch([[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0], [1.0, 1.0, 1.0]]);
    let face = compile(vec![emissive(shape(face, Transform::IDENTITY))]);
    let pi = std::f32::consts::PI;
    for (g, exact) in [(sphere, 2.0 * pi * (1.0 - 0.75f32.sqrt())), (octant, pi / 2.0), (face, 4.0 * pi / 6.0)] {
        let e = &g.emitters()[0].geometry;
        for _ in 0..1000 {
            let s = e.sample(&at([0.0; 3], None), uniform(&mut rng), true).unwrap();
            assert!((1.0 / s.pdf / exact - 1.0).abs() < 1e-5, "{s:?} {exact}");
        }
    }
}

/// Directions to a sphere are uniform in height within its cone, near and far: each draw is where its number says.
#[test]
fn draws_of_a_sphere_fill_its_cone_evenly() {
    let mut rng = Rng::new(7);
    for distance in [1.01f32, 1.5, 10.0, 80.0] {
        let g = compile(vec![emissive(shape(ball(1.0), Transform::translate(0.0, 0.0, distance as f64)))]);
        let e = &g.emitters()[0].geometry;
        let sin2 = 1.0 / (distance as f64 * distance as f64);
        let height = sin2 / (1.0 + (1.0 - sin2).sqrt());
        for _ in 0..2000 {
            let u = uniform(&mut rng);
            let s = e.sample(&at([0.0; 3], None), u, true).unwrap();
            let [x, y, z] = s.p.to_array().map(f64::from);
            // 1 - cos = sin^2 / (1 + cos), without cancellation.
            let cos = z / (x * x + y * y + z * z).sqrt();
            let drawn = (x * x + y * y) / (x * x + y * y + z * z) / (1.0 + cos);
            assert!((drawn / height - u.x as f64).abs() < 1e-4, "{distance} {u:?} {}", drawn / height);
        }
    }
}

/// From on the surface, in its plane, or where nothing can be drawn, nothing is drawn that is not sound.
#[test]
fn hostile_views_draw_sound_samples_or_none() {
    let mut rng = Rng::new(6);
    for (name, g) in emitters() {
        let e = &g.emitters()[0].geometry;
        for _ in 0..2000 {
            let on = e.sample_area(uniform(&mut rng), true).unwrap();
            for view in [
                ReferencePoint { p: on.p, p_error: on.p_error, n: on.n, ns: on.n },
                ReferencePoint { p: on.p + on.n.as_vec() * 1e-7, p_error: Vec3::ZERO, n: on.n, ns: on.n },
                at([f32::NAN; 3], None),
                at([1e30, 0.0, 0.0], None),
                at([0.0; 3], Some([0.0, 0.0, 1.0])),
            ] {
                let corners = [0.0, irradiant_math::elementary::ONE_MINUS_EPSILON, rng.next_f32()];
                let u = Point2::new(corners[rng.next_u32() as usize % 3], corners[rng.next_u32() as usize % 3]);
                if let Some(s) = e.sample(&view, u, true) {
                    assert!(s.pdf > 0.0 && s.pdf.is_finite() && s.p.is_finite() && s.n.is_finite(), "{name}: {s:?}");
                }
                let w = Vec3::from(rng.direction());
                let pdf = e.pdf(&view, w, on.p, on.n, on.uv);
                assert!(pdf >= 0.0 && pdf.is_finite(), "{name}: {pdf}");
            }
        }
    }
    let g = compile(vec![emissive(curves().remove(0).1)]);
    assert_eq!(g.emitters().len(), 4);
    let e = &g.emitters()[0].geometry;
    assert!(e.sample(&at([0.0; 3], None), Point2::ZERO, true).is_none() && e.sample_area(Point2::ZERO, true).is_none());
    assert!(e.area() > 0.0 && e.pdf(&at([0.0; 3], None), Vec3::X, Point3::ZERO, Normal3::ZERO, Point2::ZERO) == 0.0);
}

/// Pairs of triangles become one emitter exactly when they are a rectangle and agree about the outside; hits of both
/// report it.
#[test]
fn two_triangles_of_a_rectangle_are_one_emitter() {
    let square = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 1.0, 1.0], [0.0, 1.0, 1.0]];
    let kite = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.1, 1.0, 1.0], [0.0, 1.0, 1.0]];
    let rhombus = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.5, 1.0, 1.0], [0.5, 1.0, 1.0]];
    let bent = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 1.0, 1.001], [0.0, 1.0, 1.0]];
    let apart = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 1.0, 1.0], [5.0, 1.0, 1.0]];
    let pair = [[0, 1, 2], [0, 2, 3]];
    let cases = [
        (square, pair, 1),
        (square, [[2, 0, 1], [3, 0, 2]], 1),
        (square, [[0, 1, 2], [0, 3, 2]], 2),
        (square, [[0, 1, 2], [0, 1, 2]], 2),
        (kite, pair, 2),
        (rhombus, pair, 2),
        (bent, pair, 2),
        (apart, pair, 2),
    ];
    for (corners, faces, n) in cases {
        let g = compile(vec![emissive(shape(triangles(&corners, &faces), Transform::IDENTITY))]);
        assert_eq!(g.emitters().len(), n, "{corners:?} {faces:?}");
        assert!(g.emitters().iter().all(|e| e.faces as usize * n == 2));
        for (x, y, face) in [(1.9, 0.1, 0), (0.1, 0.9, 1)] {
            let ray = Ray::new(Point3::new(x, y, 0.0), Vec3::Z, 0.0);
            let Some(hit) = g.intersect(&ray, f32::INFINITY, &NoAlphaTextures) else { continue };
            let light = g.interaction(&ray, &hit).light.unwrap().0;
            assert!(n == 1 && light == 0 || n == 2 && light <= face, "{corners:?} {faces:?}");
        }
    }
}

/// A flat emitter does not light itself: what is drawn from its own points, known with an error and shaded by either side
/// of its plane, carries nothing, whatever its slant. (Slanted rectangles once looked 2 % too bright in a box.)
#[test]
fn flat_emitters_do_not_light_themselves() {
    let mut rng = Rng::new(8);
    let pose = trs(0.1, 0.3, -0.2, 40.0, [1.0, 0.5, 0.2], [1.0; 3]);
    let corners = [[-1.0, -0.6, 0.0], [1.0, -0.6, 0.0], [1.0, 0.6, 0.0], [-1.0, 0.6, 0.0]];
    let skew = [[-1.0, -0.6, 0.0], [1.0, -0.6, 0.0], [1.3, 0.6, 0.0], [-1.0, 0.6, 0.0]];
    let rectangle = [[-1.0, -0.6, 0.0], [1.0, -0.6, 0.0], [-1.0, 0.6, 0.0], [1.0, 0.6, 0.0]];
    for (name, s) in [
        ("two triangles", shape(triangles(&corners, &[[0, 1, 2], [2, 3, 0]]), pose)),
        ("skew triangles", shape(triangles(&skew, &[[0, 1, 2], [2, 3, 0]]), pose)),
        ("patch", shape(patch(rectangle), pose)),
    ] {
        let g = compile(vec![emissive(s)]);
        let (mut hits, mut carried) = (0, 0.0f64);
        for _ in 0..40_000 {
            let w = Vec3::from(rng.direction());
            let to = Point3::new(0.1, 0.3, -0.2) + Vec3::from(rng.direction()) * 0.4;
            let Some(h) = g.intersect(&Ray::new(to - w * 2.0, w, 0.0), f32::INFINITY, &NoAlphaTextures) else {
                continue;
            };
            let hit = g.interaction(&Ray::new(to - w * 2.0, w, 0.0), &h);
            hits += 1;
            let r = hit.reference();
            for e in g.emitters() {
                if let Some(s) = e.geometry.sample(&r, uniform(&mut rng), true) {
                    let cos = r.ns.dot((s.p - r.p).normalize()).abs();
                    let segment = r.spawn_ray_to(s.p, s.p_error, s.n, 0.0);
                    if !g.occluded_between(&segment, &NoAlphaTextures) {
                        carried += (cos / s.pdf) as f64 / std::f64::consts::PI;
                    }
                }
            }
        }
        assert!(hits > 1000 && carried < 1e-3 * f64::from(hits), "{name}: {carried} of {hits}");
    }
}
