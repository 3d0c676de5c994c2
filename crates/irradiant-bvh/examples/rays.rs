//! Ray rates at every level: a closed room with 122 bumpy tori, 999,436 triangles, and four sets of rays.
//!
//! `cargo run --release -p irradiant-bvh --example rays [passes] [width]` prints build time, memory and Mray/s of one
//! thread (time on the processor where Linux tells it, else wall time). Primary rays come in tiles of 4 x 4 pixels;
//! bounces are cosine-distributed about the normal; shadow rays go to a square under the ceiling
//! where they face it.

use std::time::Instant;

use irradiant_bvh::{BuildInput, BuildSettings, Bvh, Closest, Level, Mesh, Ray, TrianglesOnly};

type V = [f32; 3];

fn add(a: V, b: V) -> V {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
fn scale(a: V, s: f32) -> V {
    a.map(|x| x * s)
}
fn sub(a: V, b: V) -> V {
    add(a, scale(b, -1.0))
}
fn dot(a: V, b: V) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
fn cross(a: V, b: V) -> V {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
fn unit(a: V) -> V {
    scale(a, 1.0 / dot(a, a).sqrt())
}

/// A number in [0, 1) for a pair of integers (the finaliser of MurmurHash3).
fn random(i: usize, dimension: u64) -> f32 {
    let mut x = (i as u64).wrapping_mul(64) + dimension + 1;
    x = (x ^ (x >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
    x = (x ^ (x >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    ((x ^ (x >> 33)) >> 40) as f32 / (1 << 24) as f32
}

/// The room [-10, 10] x [0, 10] x [-10, 10] and what is in it.
fn room() -> (Vec<V>, Vec<[u32; 3]>) {
    const N: usize = 64;
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for torus in 0..122 {
        let r = |d| random(torus, d);
        let centre = [-8.5 + 17.0 * r(0), 0.8 + 7.5 * r(1), -8.5 + 17.0 * r(2)];
        let (major, minor) = (0.5 + 0.9 * r(3), 0.15 + 0.25 * r(4));
        let z = unit([r(5) - 0.5, r(6) - 0.5, r(7) - 0.5]);
        let x = unit(cross(z, if z[0].abs() > 0.5 { [0.0, 1.0, 0.0] } else { [1.0, 0.0, 0.0] }));
        let y = cross(z, x);
        let first = points.len() as u32;
        for i in 0..N {
            for j in 0..N {
                let (a, b) = (i as f32 / N as f32 * std::f32::consts::TAU, j as f32 / N as f32 * std::f32::consts::TAU);
                let bump = 1.0 + 0.15 * (7.0 * a).sin() * (5.0 * b).cos();
                let out = add(scale(x, a.cos()), scale(y, a.sin()));
                let p = add(scale(out, major + minor * bump * b.cos()), scale(z, minor * bump * b.sin()));
                points.push(add(centre, p));
                let at = |i: usize, j: usize| first + ((i % N) * N + j % N) as u32;
                triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
            }
        }
    }
    let first = points.len() as u32;
    for corner in 0..8 {
        let pick = |bit: u32, lo: f32, hi: f32| if corner >> bit & 1 == 0 { lo } else { hi };
        points.push([pick(0, -10.0, 10.0), pick(1, 0.0, 10.0), pick(2, -10.0, 10.0)]);
    }
    for [a, b, c, d] in [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]] {
        triangles.push([first + a, first + b, first + c]);
        triangles.push([first + a, first + c, first + d]);
    }
    (points, triangles)
}

fn primary(width: usize) -> Vec<Ray> {
    let mut rays = Vec::new();
    for tile in 0..(width / 4) * (width / 4) {
        for k in 0..16 {
            let px = (tile % (width / 4)) * 4 + k % 4;
            let py = (tile / (width / 4)) * 4 + k / 4;
            let s = |p: usize| (2.0 * (p as f32 + 0.5) / width as f32 - 1.0) * 0.7;
            rays.push(Ray {
                o: [-9.0, 6.0, -9.0],
                t_max: f32::INFINITY,
                d: unit([1.0 + s(px), -0.2 - s(py), 1.0 - s(px)]),
                time: 0.0,
            });
        }
    }
    rays
}

/// Points just off what `rays` meet, with normals facing back.
fn landings(bvh: &Bvh, points: &[V], triangles: &[[u32; 3]], rays: &[Ray]) -> Vec<(V, V)> {
    let mut out = Vec::new();
    for ray in rays {
        let Some(Closest::Triangle(hit)) = bvh.intersect(Level::detect(), ray, &TrianglesOnly) else { continue };
        let [a, b, c] = triangles[hit.primitive as usize].map(|i| points[i as usize]);
        let normal = unit(cross(sub(b, a), sub(c, a)));
        let normal = if dot(normal, ray.d) > 0.0 { scale(normal, -1.0) } else { normal };
        out.push((add(add(ray.o, scale(ray.d, hit.t)), scale(normal, 1e-4)), normal));
    }
    out
}

fn bounce(landings: &[(V, V)], salt: u64) -> Vec<Ray> {
    let one = |(i, &(o, n)): (usize, &(V, V))| {
        let (u, phi) = (random(i, salt), random(i, salt + 1) * std::f32::consts::TAU);
        let x = unit(cross(n, if n[0].abs() > 0.5 { [0.0, 1.0, 0.0] } else { [1.0, 0.0, 0.0] }));
        let r = u.sqrt();
        let d = add(add(scale(x, r * phi.cos()), scale(cross(n, x), r * phi.sin())), scale(n, (1.0 - u).sqrt()));
        Ray { o, t_max: f32::INFINITY, d: unit(d), time: 0.0 }
    };
    landings.iter().enumerate().map(one).collect()
}

fn shadow(landings: &[(V, V)]) -> Vec<Ray> {
    let one = |(i, &(o, n)): (usize, &(V, V))| {
        let light = [-2.0 + 4.0 * random(i, 20), 9.9, -2.0 + 4.0 * random(i, 21)];
        let d = sub(light, o);
        (dot(d, n) > 0.0).then_some(Ray { o, t_max: 0.999, d, time: 0.0 })
    };
    landings.iter().enumerate().filter_map(one).collect()
}

/// Seconds this thread has been on a processor, if the system says so.
fn on_cpu() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split(' ').next()?.parse::<f64>().ok()? * 1e-9)
}

fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let (wall, cpu) = (Instant::now(), on_cpu());
    let result = work();
    let seconds = match (cpu, on_cpu()) {
        (Some(a), Some(b)) => b - a,
        _ => wall.elapsed().as_secs_f64(),
    };
    (result, seconds)
}

fn main() {
    let mut arguments = std::env::args().skip(1).map(|a| a.parse().unwrap_or(5));
    let passes: usize = arguments.next().unwrap_or(5);
    let width: usize = arguments.next().unwrap_or(1024);
    let (points, triangles) = room();
    let meshes = [Mesh { positions: &points, triangles: &triangles, filtered: false }];
    let input = BuildInput { meshes: &meshes, user_boxes: &[] };
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    let mut best = f64::INFINITY;
    let mut bvh = Bvh::build(&BuildInput::default(), &BuildSettings::default());
    for _ in 0..3 {
        let (built, seconds) = one.install(|| timed(|| Bvh::build(&input, &BuildSettings::default())));
        (bvh, best) = (built, best.min(seconds));
    }
    let report = bvh.report();
    println!("build {best:.3} s on one core, {:.1} MB, {report:?}", bvh.memory_bytes() as f64 * 1e-6);
    if let Ok(status) = std::fs::read_to_string("/proc/self/status") {
        println!("{}", status.lines().find(|l| l.starts_with("VmHWM")).unwrap_or_default());
    }

    let camera = primary(width);
    let first = landings(&bvh, &points, &triangles, &camera);
    let bounce1 = bounce(&first, 10);
    let bounce2 = bounce(&landings(&bvh, &points, &triangles, &bounce1), 12);
    let sets = [
        ("primary", camera, false),
        ("bounce 1", bounce1, false),
        ("bounce 2", bounce2, false),
        ("shadow", shadow(&first), true),
    ];
    println!("{:<12}{}", "Mray/s", sets.iter().map(|s| format!("{:>10}", s.0)).collect::<String>());
    for level in Level::available().into_iter().rev() {
        let passes = if level < Level::Sse { 1 } else { passes };
        report_rates(&format!("{level:?}"), &sets, passes, |rays, any| one_by_one(&bvh, level, rays, any));
        report_rates(&format!("{level:?} x256"), &sets, passes, |rays, any| in_batches(&bvh, level, rays, any));
    }
}

/// Prints rates of all sets, the best of some passes, and what `trace` makes of each.
fn report_rates(name: &str, sets: &[(&str, Vec<Ray>, bool)], passes: usize, trace: impl Fn(&[Ray], bool) -> f64) {
    let mut line = format!("{name:<12}");
    let mut sums = Vec::new();
    for (_, rays, any) in sets {
        let (mut best, mut sum) = (f64::INFINITY, 0.0);
        for _ in 0..passes {
            let (total, seconds) = timed(|| trace(rays, *any));
            (best, sum) = (best.min(seconds), total);
        }
        line += &format!("{:>10.2}", rays.len() as f64 / best * 1e-6);
        sums.push(sum);
    }
    println!("{line}   sums {sums:.4?}");
}

/// The sum of all distances, or the number of rays that meet something.
fn one_by_one(bvh: &Bvh, level: Level, rays: &[Ray], any: bool) -> f64 {
    let mut total = 0.0;
    for ray in rays {
        if any {
            total += f64::from(u8::from(bvh.occluded(level, ray, &TrianglesOnly)));
        } else if let Some(hit) = bvh.intersect(level, ray, &TrianglesOnly) {
            total += f64::from(hit.t());
        }
    }
    total
}

/// As [`one_by_one`], 256 rays at a time.
fn in_batches(bvh: &Bvh, level: Level, rays: &[Ray], any: bool) -> f64 {
    let (mut hits, mut blocked) = ([None; 256], [false; 256]);
    let mut total = 0.0;
    for rays in rays.chunks(256) {
        if any {
            bvh.occluded_batch(level, rays, &TrianglesOnly, &mut blocked[..rays.len()]);
            total += blocked[..rays.len()].iter().filter(|b| **b).count() as f64;
        } else {
            bvh.intersect_batch(level, rays, &TrianglesOnly, &mut hits[..rays.len()]);
            total += hits[..rays.len()].iter().flatten().map(|hit| f64::from(hit.t())).sum::<f64>();
        }
    }
    total
}
