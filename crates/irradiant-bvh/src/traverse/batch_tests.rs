//! Batches against the same rays one by one, at every level. Exact: false alarms are impossible.
//!
//! Seen to fail when broken: the entry bound from one end of the interval of reciprocals only; the far end of the packet
//! taken from one ray; rays of different fastest axes sheared alike; what the fused form loses not allowed for. In crowds: the entry a hundredth too far; ties
//! to the higher index; the own box without its padding; hits of some lanes forgotten.

use super::tests::{Balls, Random, Soup, ball, lattice_soup, random_soup, ray_at};
use super::*;
use crate::ray::TrianglesOnly;
use crate::{BuildInput, BuildSettings, Mesh};

/// Rays that neighbours in a picture might send: from one point or from near it, into a narrow or wide cone, some of
/// them spoilt, with the same end or not.
fn window(soup: &Soup, scale: f32, n: usize, random: &mut Random) -> Vec<Ray> {
    let kind = random.below(10);
    let eye = ray_at(soup, scale, random).o;
    let target = soup.positions[random.below(soup.positions.len())];
    let width = [0.0, 0.01, 0.1, 1.0][random.below(4)];
    let aperture = [0.0, 0.0, 0.01, 0.3][random.below(4)];
    let t_max = [f32::INFINITY, 1.0, 0.5, 1.5][random.below(4)];
    let near = |p: [f32; 3], size: f32, random: &mut Random| {
        let q = random.point();
        [0, 1, 2].map(|k| p[k] + scale * size * q[k])
    };
    (0..n)
        .map(|_| {
            let o = near(eye, aperture, random);
            let to = near(target, width, random);
            let mut ray = Ray { o, t_max, d: [0, 1, 2].map(|k| (to[k] - o[k]) / scale), time: random.unit() };
            ray.t_max *= scale;
            match kind {
                // Along an axis, with zeros of either sign.
                0 => ray.d = [0, 1, 2].map(|k| if k == 1 { ray.d[1] } else { 0.0f32.copysign(ray.d[k]) }),
                1 => ray.d[random.below(3)] = 0.0,
                2 => ray = ray_at(soup, scale, random),
                3 if random.below(4) == 0 => {
                    let bad = [f32::NAN, f32::INFINITY, 0.0, 1e-42, 3e38][random.below(5)];
                    match random.below(7) {
                        6 => ray.t_max = bad,
                        k if k < 3 => ray.o[k] = bad,
                        k => ray.d[k - 3] = bad,
                    }
                }
                4 => ray.t_max *= random.unit(),
                5 if random.below(2) == 0 => ray.d = ray.d.map(|x| -x),
                _ => {}
            }
            ray
        })
        .collect()
}

fn same_as_single<L: Leaves<UserHit: PartialEq + std::fmt::Debug>>(
    name: &str,
    bvh: &Bvh,
    leaves: &L,
    mut rays: impl FnMut(&mut Random, usize) -> Vec<Ray>,
    n_batches: usize,
) {
    let mut random = Random(21);
    let mut hits = 0;
    for batch in 0..n_batches {
        let rays = rays(&mut random, [0, 1, 2, 7, 8, 9, 16, 17, 33, 64][batch % 10]);
        let n = rays.len();
        let expected: Vec<_> = rays.iter().map(|r| bvh.intersect(Level::Scalar, r, leaves)).collect();
        hits += expected.iter().flatten().count();
        for level in Level::available() {
            let mut closest = vec![None; n];
            bvh.intersect_batch(level, &rays, leaves, &mut closest);
            let mut any = vec![batch % 3 == 0; n];
            bvh.occluded_batch(level, &rays, leaves, &mut any);
            for k in 0..n {
                let same = match (&closest[k], &expected[k]) {
                    (Some(Closest::Triangle(a)), Some(Closest::Triangle(b))) => {
                        [a.t, a.u, a.v].map(f32::to_bits) == [b.t, b.u, b.v].map(f32::to_bits)
                            && a.primitive == b.primitive
                    }
                    (a, b) => a == b,
                };
                let what = || format!("{name}, batch {batch} of {n}, {level:?}: {:?}", rays[k]);
                assert!(same, "{}: {:?} but alone {:?}", what(), closest[k], expected[k]);
                assert_eq!(any[k], expected[k].is_some(), "{}", what());
            }
        }
    }
    assert!(hits > n_batches / 5, "{name}: {hits} hits in {n_batches} batches");
}

fn check(name: &str, soup: &Soup, scale: f32, n_batches: usize) {
    let bvh = soup.build();
    same_as_single(name, &bvh, &TrianglesOnly, |random, n| window(soup, scale, n, random), n_batches);
}

#[test]
fn batches_meet_what_single_rays_meet() {
    check("small triangles", &random_soup(2000, 0.05, 1.0, 1), 1.0, 1000);
    check("large triangles", &random_soup(60, 1.0, 1.0, 2), 1.0, 1000);
    check("few", &random_soup(5, 1.0, 1.0, 3), 1.0, 500);
    check("ball", &ball(24, 11), 1.0, 1000);
}

#[test]
fn batches_agree_on_coincident_and_axis_aligned_triangles() {
    check("lattice", &lattice_soup(120, 4), 1.0, 1000);
}

#[test]
fn batches_agree_at_extreme_scales() {
    check("1e-30", &random_soup(60, 0.5, 1e-30, 5), 1e-30, 1000);
    check("1e-10", &random_soup(60, 0.5, 1e-10, 6), 1e-10, 1000);
    check("1e30", &random_soup(60, 0.5, 1e30, 7), 1e30, 1000);
    let mut mixed = random_soup(40, 0.5, 1.0, 8);
    for i in 0..40 {
        let far = random_soup(1, 1.0, 10f32.powi(i / 2 - 10), 100 + i as u64);
        mixed.push(far.triangles[0].map(|v| far.positions[v as usize]));
    }
    check("mixed scales", &mixed, 1.0, 1000);
}

#[test]
fn batches_agree_far_from_the_origin_of_space() {
    // Flat boxes and short ways beside large products with the origin, which the fused box test subtracts.
    let near = lattice_soup(120, 4);
    let mut far = near.clone();
    far.positions.iter_mut().for_each(|p| *p = p.map(|x| x + 1000.0));
    let bvh = far.build();
    let rays = |random: &mut Random, n: usize| {
        let mut rays = window(&near, 1.0, n, random);
        rays.iter_mut().for_each(|ray| ray.o = ray.o.map(|x| x + 1000.0));
        rays
    };
    same_as_single("far", &bvh, &TrianglesOnly, rays, 3000);
}

#[test]
fn batches_ask_users_and_filters_as_single_rays_do() {
    let (plain, cut) = (random_soup(100, 0.3, 1.0, 13), random_soup(100, 0.3, 1.0, 14));
    let mut random = Random(15);
    let mut balls = Balls((0..60).map(|_| (random.point(), 0.02 + 0.3 * random.unit())).collect());
    let twin = balls.0[40];
    (balls.0[10], balls.0[59]) = (twin, twin);
    let meshes = [plain.mesh(), Mesh::default(), Mesh { filtered: true, ..cut.mesh() }];
    let boxes = balls.boxes();
    let bvh = Bvh::build(&BuildInput { meshes: &meshes, user_boxes: &boxes }, &BuildSettings::default());
    same_as_single("users", &bvh, &balls, |random, n| window(&plain, 1.0, n, random), 4000);
}

/// Trees that [sort](Bvh::sorts_rays) the rays, and many rays that go anywhere.
#[test]
fn crowds_meet_what_single_rays_meet() {
    let soups = [
        random_soup(5, 1.0, 1.0, 31),
        random_soup(60, 1.0, 1.0, 32),
        random_soup(90, 0.3, 1.0, 33),
        lattice_soup(90, 34),
    ];
    for (k, soup) in soups.iter().enumerate() {
        let bvh = soup.build();
        assert!(bvh.sorts_rays(Level::Sse), "{k}: {} nodes", bvh.nodes.len());
        same_as_single(&format!("crowd {k}"), &bvh, &TrianglesOnly, |random, n| anywhere(soup, 4 * n, random), 400);
    }
    let (plain, cut) = (random_soup(25, 0.5, 1.0, 35), random_soup(25, 0.7, 1.0, 36));
    // Points, which are dropped, but counted.
    let nothing = random_soup(75, 0.0, 1.0, 38);
    let mut random = Random(37);
    let balls = Balls((0..6).map(|_| (random.point(), 0.05 + 0.3 * random.unit())).collect());
    let meshes = [plain.mesh(), nothing.mesh(), Mesh { filtered: true, ..cut.mesh() }];
    let boxes = balls.boxes();
    let bvh = Bvh::build(&BuildInput { meshes: &meshes, user_boxes: &boxes }, &BuildSettings::default());
    assert!(bvh.sorts_rays(Level::Sse));
    same_as_single("crowd with users", &bvh, &balls, |random, n| anywhere(&plain, 4 * n, random), 1000);
}

/// Rays of all kinds from all places, one in eight spoilt.
fn anywhere(soup: &Soup, n: usize, random: &mut Random) -> Vec<Ray> {
    (0..n)
        .map(|_| if random.below(8) == 0 { window(soup, 1.0, 1, random)[0] } else { ray_at(soup, 1.0, random) })
        .collect()
}

#[test]
fn empty_trees_answer_batches_too() {
    let bvh = Bvh::build(&BuildInput::default(), &BuildSettings::default());
    let ray = Ray { o: [0.0; 3], t_max: f32::INFINITY, d: [0.2, 0.1, 1.0], time: 0.0 };
    for level in Level::available() {
        let (mut closest, mut any) = ([Some(Closest::User { t: 1.0, user: 0, hit: () }); 20], [true; 20]);
        bvh.intersect_batch(level, &[ray; 20], &TrianglesOnly, &mut closest);
        bvh.occluded_batch(level, &[ray; 20], &TrianglesOnly, &mut any);
        assert_eq!((closest, any), ([None; 20], [false; 20]));
    }
}
