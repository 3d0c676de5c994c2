//! Large triangles, whose `t` has an error beyond any padding of boxes: every kernel against brute force, to the bit.
//!
//! Exact: seeds are fixed, false alarms are impossible. Seen to fail when broken: no question about the own box (432 of the
//! answers for 960,000 rays, all kernels together, and the real ray at once).

use super::tests::{Random, Soup, bits, brute_force, random_soup, triangle_hit};
use super::*;
use crate::ray::TrianglesOnly;

type V = [f32; 3];

/// How many answers of all kernels differ from brute force: single rays, and batches of these sizes in turn.
fn mismatches(bvh: &Bvh, soup: &Soup, rays: &[Ray], sizes: &[usize]) -> (usize, usize) {
    let all = soup.usable();
    let expected: Vec<_> = rays.iter().map(|ray| bits(brute_force(&all, ray))).collect();
    let hits = expected.iter().flatten().count();
    let mut wrong = 0;
    for level in Level::available() {
        for (ray, expected) in rays.iter().zip(&expected) {
            wrong += usize::from(bits(triangle_hit(bvh.intersect(level, ray, &TrianglesOnly))) != *expected);
            wrong += usize::from(bvh.occluded(level, ray, &TrianglesOnly) != expected.is_some());
        }
        let (mut start, mut sizes) = (0, sizes.iter().cycle());
        while start < rays.len() {
            let end = rays.len().min(start + sizes.next().expect("endless"));
            let (mut closest, mut any) = (vec![None; end - start], vec![false; end - start]);
            bvh.intersect_batch(level, &rays[start..end], &TrianglesOnly, &mut closest);
            bvh.occluded_batch(level, &rays[start..end], &TrianglesOnly, &mut any);
            for ((closest, any), expected) in closest.into_iter().zip(any).zip(&expected[start..end]) {
                wrong += usize::from(bits(triangle_hit(closest)) != *expected);
                wrong += usize::from(any != expected.is_some());
            }
            start = end;
        }
    }
    (wrong, hits)
}

/// A shadow ray of a real scene that ended on its floor: the triangle test says `t` = 0.9999998, the box test that
/// the ray enters at 1.0000011, and whether it is culled depended on the kernel.
#[test]
fn a_shadow_ray_that_ends_on_a_large_floor() {
    let of = |bits: [u32; 3]| bits.map(f32::from_bits);
    let floor = [
        [0xc1f0_0000, 0xc026_6666, 0x41bc_0000],
        [0x41f0_0000, 0xc026_6666, 0x41bc_0000],
        [0x41f0_0000, 0xc026_6666, 0xc212_0000],
    ];
    let o = of([0xbf55_3f13, 0xbf2a_2f11, 0xc0c8_4865]);
    let ray = Ray { o, t_max: 1.0, d: of([0x3fb2_3438, 0xbff7_b532, 0x3fff_bfb8]), time: 0.0 };
    let mut alone = Soup::default();
    alone.push(floor.map(of));
    let mut among = random_soup(400, 0.02, 1.0, 31);
    among.positions.iter_mut().for_each(|p| *p = p.map(|x| 20.0 * x + 40.0));
    among.push(floor.map(of));
    for soup in [alone, among] {
        let bvh = soup.build();
        // Neighbours of the ray to fill packets with: a little aside, and the same.
        let mut rays = vec![ray; 40];
        for (i, ray) in rays.iter_mut().enumerate().filter(|(i, _)| i % 5 != 0) {
            ray.d[i % 3] *= 1.0 + i as f32 * 1e-3;
        }
        for sizes in [&[1][..], &[3], &[8], &[16], &[40], &[1, 16, 9]] {
            assert_eq!(mismatches(&bvh, &soup, &rays, sizes).0, 0, "batches of {sizes:?}");
        }
    }
}

/// Axis-aligned rectangles and triangles that are not, tens of units wide; each once more, and a piece of it, a few steps
/// aside.
fn large_soup(n: usize, random: &mut Random) -> Soup {
    let mut soup = Soup::default();
    for i in 0..n {
        let mut triangles = Vec::new();
        if i % 2 == 0 {
            let axis = random.below(3);
            let (a, b, height) = (random.point(), random.point(), 4.0 * random.signed());
            let corner = |u: f32, v: f32| {
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (height, u, v);
                p
            };
            let (u0, u1, v0, v1) = (-40.0 * a[0].abs(), 40.0 * a[1].abs(), -40.0 * b[0].abs(), 40.0 * b[1].abs());
            triangles.push([corner(u0, v0), corner(u1, v0), corner(u1, v1)]);
            triangles.push([corner(u0, v0), corner(u1, v1), corner(u0, v1)]);
        } else {
            triangles.push([(); 3].map(|()| random.point().map(|x| 40.0 * x)));
        }
        for triangle in triangles {
            soup.push(triangle);
            // All of it aside along one axis, or each vertex by itself.
            let (axis, all) = (random.below(3), random.below(2) == 0);
            let aside = 1.0 + random.signed() * 4e-6;
            soup.push(triangle.map(|mut p| {
                p[axis] *= if all { aside } else { 1.0 + random.signed() * 1e-6 };
                p
            }));
            // A small piece of it, a little aside, of which the tests know better where it is.
            let [a, b, c] = triangle;
            let (u, v) = (0.1 + 0.3 * random.unit(), 0.1 + 0.3 * random.unit());
            let at = |u: f32, v: f32| -> V {
                let mut p: V = std::array::from_fn(|k| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]));
                p[axis] *= aside;
                p
            };
            soup.push([at(u, v), at(u + 0.05, v), at(u, v + 0.05)]);
        }
    }
    soup
}

/// Towards points of a triangle from about one place: a few at a time close together.
fn rays_to(soup: &Soup, n: usize, random: &mut Random) -> Vec<Ray> {
    let mut rays = Vec::new();
    while rays.len() < n {
        let corners: [V; 3] = soup.triangles[random.below(soup.triangles.len())].map(|i| soup.positions[i as usize]);
        let (eye, mut at) = (random.point().map(|x| 5.0 * x), [random.unit(), random.unit()]);
        if at[0] + at[1] > 1.0 {
            at = at.map(|x| 1.0 - x);
        }
        let width = [0.0, 0.001, 0.02][random.below(3)];
        for _ in 0..16 {
            let o: V = eye.map(|x| x + width * random.signed());
            let [u, v] = at.map(|x| x + width * random.signed());
            let p: V = std::array::from_fn(|k| {
                let (a, b, c) = (corners[0][k], corners[1][k], corners[2][k]);
                // Exact where all three agree.
                a + u * (b - a) + v * (c - a)
            });
            let t_max = match random.below(4) {
                0 => f32::INFINITY,
                1 => 1.0,
                // The triangle test's error and the padding of boxes, and what is between.
                _ => 1.0 + 3e-6 * random.signed(),
            };
            rays.push(Ray { o, t_max, d: std::array::from_fn(|k| p[k] - o[k]), time: 0.0 });
        }
    }
    rays
}

#[test]
fn large_triangles_are_met_alike_by_all_kernels() {
    let mut random = Random(41);
    let (mut wrong, mut hits, mut n) = (0, 0, 0);
    for _ in 0..60 {
        // Few surfaces, so that rays get as far as they were meant to.
        let surfaces = 1 + random.below(6);
        let soup = large_soup(surfaces, &mut random);
        let bvh = soup.build();
        let rays = rays_to(&soup, 8000, &mut random);
        for sizes in [&[16][..], &[5, 8, 33, 2]] {
            let (more, met) = mismatches(&bvh, &soup, &rays, sizes);
            (wrong, hits, n) = (wrong + more, hits + met, n + rays.len());
        }
    }
    assert!(hits > n / 2, "{hits} hits of {n} rays");
    assert_eq!(wrong, 0, "answers that differ from brute force, {n} rays");
}

/// No ray from inside a closed room of large triangles gets out, aimed at points on edges, where the room's planes are
/// along axes and where they are not.
#[test]
fn large_closed_rooms_do_not_leak() {
    for (turned, n) in [(false, 1), (true, 1), (false, 4), (true, 4)] {
        let mut soup = Soup::default();
        let place = |p: V| -> V {
            let [x, y, z] = [p[0] * 71.5 - 30.0, p[1] * 9.3 - 2.6, p[2] * 60.0 - 36.5];
            if turned {
                [0.8 * x - 0.6 * y, 0.48 * x + 0.64 * y - 0.6 * z, 0.36 * x + 0.48 * y + 0.8 * z]
            } else {
                [x, y, z]
            }
        };
        for (axis, side, i, j) in (0..6 * n * n).map(|k| (k / (2 * n * n), k / (n * n) % 2, k / n % n, k % n)) {
            let corner = |u: usize, v: usize| {
                let mut p = [0.0; 3];
                p[axis] = side as f32;
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (u as f32 / n as f32, v as f32 / n as f32);
                place(p)
            };
            soup.push([corner(i, j), corner(i + 1, j), corner(i + 1, j + 1)]);
            soup.push([corner(i, j), corner(i + 1, j + 1), corner(i, j + 1)]);
        }
        let bvh = soup.build();
        let mut random = Random(12);
        for i in 0..500_000 {
            let o = place(std::array::from_fn(|_| 0.4 + 0.2 * random.unit()));
            let t = soup.triangles[random.below(soup.triangles.len())];
            let (a, b) = (soup.positions[t[i % 3] as usize], soup.positions[t[(i + 1) % 3] as usize]);
            let s = random.unit();
            let target: V = std::array::from_fn(|k| a[k] + s * (b[k] - a[k]));
            let ray = Ray { o, t_max: f32::INFINITY, d: std::array::from_fn(|k| target[k] - o[k]), time: 0.0 };
            assert!(bvh.intersect(Level::detect(), &ray, &TrianglesOnly).is_some(), "leak at {ray:?}");
        }
    }
}
