//! Trees over instances of which some are opened, against trees over whole ones. Exact: false alarms are impossible.
//!
//! Seen to fail when broken: parts of one instance in the order of their boxes; one part forgotten; another instance opened instead; packets, crowds
//! or single rays that begin at the top; parts that are nowhere.

use super::tests::{Random, Soup, ball, lattice_soup, random_soup, ray_at, triangle_hit};
use super::*;
use crate::ray::{Hit, TrianglesOnly};
use crate::{Braid, BuildInput, BuildSettings, braid};

/// Moved copies of trees, or parts of such.
struct Copies<'a> {
    trees: &'a [Bvh],
    /// Which tree, and how far from where it was built.
    placed: &'a [(usize, [f32; 3])],
    users: Vec<Braid>,
    level: Level,
}

impl Copies<'_> {
    fn inside(&self, user: u32, ray: &Ray) -> (&Bvh, Part, Ray) {
        let Braid { instance, part, .. } = self.users[user as usize];
        let (tree, at) = self.placed[instance as usize];
        (&self.trees[tree], part, Ray { o: [0, 1, 2].map(|k| ray.o[k] - at[k]), ..*ray })
    }
}

impl Leaves for Copies<'_> {
    /// The instance, and what was met there.
    type UserHit = (u32, Hit);

    fn intersect(&self, user: u32, ray: &Ray) -> Option<(f32, (u32, Hit))> {
        let (tree, part, ray) = self.inside(user, ray);
        match tree.intersect_part(part, self.level, &ray, &TrianglesOnly)? {
            Closest::Triangle(hit) => Some((hit.t, (self.users[user as usize].instance, hit))),
            Closest::User { .. } => None,
        }
    }

    fn occluded(&self, user: u32, ray: &Ray) -> bool {
        let (tree, part, ray) = self.inside(user, ray);
        tree.occluded_part(part, self.level, &ray, &TrianglesOnly)
    }

    fn precedes(&self, (_, (i, a)): (u32, &(u32, Hit)), (_, (j, b)): (u32, &(u32, Hit))) -> bool {
        (i, a.primitive) < (j, b.primitive)
    }

    fn intersect_many(&self, user: u32, rays: &[Ray], hits: &mut [Option<(f32, (u32, Hit))>]) {
        let inside: Vec<Ray> = rays.iter().map(|ray| self.inside(user, ray).2).collect();
        let (tree, part, _) = self.inside(user, &rays[0]);
        let mut found = vec![None; rays.len()];
        tree.intersect_part_batch(part, self.level, &inside, &TrianglesOnly, &mut found);
        for (hit, found) in hits.iter_mut().zip(found) {
            if let Some(Closest::Triangle(found)) = found {
                *hit = Some((found.t, (self.users[user as usize].instance, found)));
            }
        }
    }

    fn occluded_many(&self, user: u32, rays: &[Ray], out: &mut [bool]) {
        let inside: Vec<Ray> = rays.iter().map(|ray| self.inside(user, ray).2).collect();
        let (tree, part, _) = self.inside(user, &rays[0]);
        tree.occluded_part_batch(part, self.level, &inside, &TrianglesOnly, out);
    }
}

/// Steps of a power of two, so that copies meet exactly.
fn step(p: [f32; 3]) -> [f32; 3] {
    p.map(|x| (x * 8.0).round() / 8.0)
}

fn check(name: &str, large: &Soup, n_batches: usize) {
    let mut random = Random(77);
    let trees = [large.build(), random_soup(12, 0.2, 0.1, 4).build(), lattice_soup(20, 5).build()];
    let mut placed: Vec<(usize, [f32; 3])> =
        (0..60).map(|i| (1 + usize::from(i % 20 == 0), step(random.point()))).collect();
    // Two large ones in the same place, and one a step away.
    placed.splice(20..20, [(0, [0.0; 3]), (0, [0.0; 3]), (0, [0.125, 0.0, 0.0])]);
    let outside = |i: usize, b: &[[f32; 3]; 2]| {
        let at = placed[i].1;
        [[0, 1, 2].map(|k| b[0][k] + at[k] - 1e-5), [0, 1, 2].map(|k| b[1][k] + at[k] + 1e-5)]
    };
    let boxes: Vec<_> = (0..placed.len()).map(|i| outside(i, &trees[placed[i].0].bounds().unwrap())).collect();
    let over = |users: Vec<Braid>, level: Level| {
        let boxes: Vec<_> = users.iter().map(|b| b.bounds).collect();
        let top = Bvh::build(&BuildInput { meshes: &[], user_boxes: &boxes }, &BuildSettings::default());
        assert_eq!(top.validate(), Ok(()));
        (top, Copies { trees: &trees, placed: &placed, users, level })
    };
    let whole = |i: usize| Braid { instance: i as u32, part: Part::ALL, bounds: boxes[i] };
    let (expected_top, expected_leaves) = over((0..boxes.len()).map(whole).collect(), Level::Scalar);
    let braids = braid(&boxes, |i| Some(&trees[placed[i].0]), outside);
    assert!(braids.is_sorted_by_key(|b| b.instance), "{name}: instances out of order");
    assert!(braids.iter().filter(|b| b.instance == 20).count() > 3, "{name}: nothing was opened");
    let mut hits = 0;
    for level in Level::available() {
        let (top, leaves) = over(braids.clone(), level);
        let mut random = Random(5);
        for batch in 0..n_batches {
            let o = ray_at(large, 1.0, &mut random).o;
            let rays: Vec<Ray> = (0..32)
                .map(|i| {
                    let ray = ray_at(large, 1.0, &mut random);
                    // Half of the batches travel together.
                    let d = [0, 1, 2].map(|k| 0.05 * ray.d[k] - o[k] + 0.1);
                    if batch % 2 == 0 { ray } else { Ray { o, d, t_max: if i % 3 == 0 { 1.0 } else { 9.0 }, ..ray } }
                })
                .collect();
            let (mut closest, mut any) = (vec![None; rays.len()], vec![false; rays.len()]);
            top.intersect_batch(level, &rays, &leaves, &mut closest);
            top.occluded_batch(level, &rays, &leaves, &mut any);
            for (k, ray) in rays.iter().enumerate() {
                let what = |c: Option<Closest<(u32, Hit)>>| match c {
                    Some(Closest::User { t, hit: (instance, hit), .. }) => {
                        Some((instance, hit.primitive, [t, hit.t, hit.u, hit.v].map(f32::to_bits)))
                    }
                    _ => None,
                };
                let expected = what(expected_top.intersect(Level::Scalar, ray, &expected_leaves));
                hits += usize::from(expected.is_some());
                assert_eq!(what(top.intersect(level, ray, &leaves)), expected, "{name}, {level:?}: {ray:?}");
                assert_eq!(what(closest[k]), expected, "{name}, {level:?}, in a batch: {ray:?}");
                assert_eq!(top.occluded(level, ray, &leaves), expected.is_some(), "{name}, {level:?}: {ray:?}");
                assert_eq!(any[k], expected.is_some(), "{name}, {level:?}, in a batch: {ray:?}");
            }
        }
    }
    assert!(hits > 1000, "{name}: {hits} hits");
}

#[test]
fn parts_meet_what_whole_instances_meet() {
    check("large triangles", &random_soup(60, 1.0, 1.0, 2), 60);
    check("coincident triangles", &lattice_soup(60, 3), 60);
    check("a ball", &ball(12, 6), 60);
}

#[test]
fn walks_that_begin_at_a_part_meet_what_is_there_and_no_more() {
    for soup in [random_soup(300, 0.2, 1.0, 9), lattice_soup(40, 3)] {
        let tree = soup.build();
        let parts: Vec<Part> = tree.parts_below(Part::ALL).map(|(part, _)| part).collect();
        assert!(parts.len() > 2 && tree.sorts_rays(Level::Neon) == (soup.triangles.len() < 100));
        let mut random = Random(3);
        let mut differ = 0;
        for batch in 0..100 {
            let first = ray_at(&soup, 1.0, &mut random);
            let aside = |random: &mut Random| random.point().map(|x| 0.01 * x);
            let rays: Vec<Ray> = (0..32)
                .map(|_| match (batch % 2, aside(&mut random)) {
                    (0, by) => Ray { d: [0, 1, 2].map(|k| first.d[k] + by[k]), ..first },
                    _ => ray_at(&soup, 1.0, &mut random),
                })
                .collect();
            let of = |part: Part, level: Level| {
                rays.iter().map(|ray| triangle_hit(tree.intersect_part(part, level, ray, &TrianglesOnly))).collect()
            };
            let whole: Vec<Option<Hit>> = of(Part::ALL, Level::Scalar);
            let mut nearest = vec![None; rays.len()];
            for &part in &parts {
                let expected: Vec<Option<Hit>> = of(part, Level::Scalar);
                differ += expected.iter().zip(&whole).filter(|(a, b)| a != b).count();
                for (nearest, hit) in nearest.iter_mut().zip(&expected) {
                    let key = |h: &Option<Hit>| h.map_or((u32::MAX, 0), |h| (h.t.to_bits(), h.primitive));
                    *nearest = if key(hit) < key(nearest) { *hit } else { *nearest };
                }
                let met: Vec<bool> = expected.iter().map(Option::is_some).collect();
                for level in Level::available() {
                    let (mut closest, mut any) = (vec![None; rays.len()], vec![false; rays.len()]);
                    tree.intersect_part_batch(part, level, &rays, &TrianglesOnly, &mut closest);
                    tree.occluded_part_batch(part, level, &rays, &TrianglesOnly, &mut any);
                    let closest: Vec<_> = closest.into_iter().map(triangle_hit).collect();
                    let occluded = rays.iter().map(|ray| tree.occluded_part(part, level, ray, &TrianglesOnly));
                    assert_eq!(of(part, level), expected, "{level:?}, batch {batch}");
                    assert_eq!(closest, expected, "{level:?}, batch {batch}");
                    assert_eq!((occluded.collect(), any), (met.clone(), met.clone()), "{level:?}, batch {batch}");
                }
            }
            assert_eq!(nearest, whole, "batch {batch}");
        }
        assert!(differ > 1000, "{differ}");
    }
}

#[test]
fn instances_alone_stay_whole() {
    let trees = [random_soup(60, 1.0, 1.0, 2).build()];
    let bounds = trees[0].bounds().unwrap();
    let boxes: Vec<_> = (0..40).map(|i| bounds.map(|p| [p[0] + 9.0 * i as f32, p[1], p[2]])).collect();
    for boxes in [&boxes[..1], &boxes[..]] {
        let braids = braid(boxes, |_| Some(&trees[0]), |_, b| *b);
        assert!(braids.iter().enumerate().all(|(i, b)| (b.instance as usize, b.part) == (i, Part::ALL)));
    }
    // Nor what is in company but has no tree, nor what would be nowhere.
    let crowd: Vec<_> = (0..40).map(|_| bounds).collect();
    assert_eq!(braid(&crowd, |_| None, |_, b| *b).len(), 40);
    assert_eq!(braid(&crowd, |_| Some(&trees[0]), |_, _| [[f32::NAN; 3]; 2]).len(), 40);
    assert!(braid(&crowd, |_| Some(&trees[0]), |_, b| *b).len() > 40 * 4);
}
