//! Traversal against brute force with the scalar triangle test, at every level.
//!
//! Nothing here is statistical: equality is exact, seeds are fixed, false alarms are impossible. With 10⁵ rays per
//! soup a fault that loses or moves one hit in 3 x 10⁴ is found with probability above 95 %.
//!
//! Seen to fail when broken: tie rule off; padding 1; no `f64` for zero edges; NaN operand order in the slab test;
//! inclusive end in any-hit; half the error bound in the lanes; filter ignored.

use super::*;
use crate::ray::{Hit, TrianglesOnly};
use crate::triangle::{self, Shear};
use crate::{BuildInput, BuildSettings, Mesh};

/// A small generator (SplitMix64), so that tests need nothing else.
pub(super) struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }
    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 24) as f32
    }
    /// Uniform in [-1, 1).
    pub fn signed(&mut self) -> f32 {
        2.0 * self.unit() - 1.0
    }
    pub fn below(&mut self, n: usize) -> usize {
        (self.bits() % n as u64) as usize
    }
    pub fn point(&mut self) -> [f32; 3] {
        [self.signed(), self.signed(), self.signed()]
    }
}

#[derive(Clone, Default)]
pub(super) struct Soup {
    pub positions: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Soup {
    pub fn push(&mut self, corners: [[f32; 3]; 3]) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners);
        self.triangles.push([first, first + 1, first + 2]);
    }
    pub fn mesh(&self) -> Mesh<'_> {
        Mesh { positions: &self.positions, triangles: &self.triangles, filtered: false }
    }
    pub fn build(&self) -> Bvh {
        let bvh = Bvh::build(&BuildInput { meshes: &[self.mesh()], user_boxes: &[] }, &BuildSettings::default());
        assert_eq!(bvh.validate(), Ok(()));
        bvh
    }
    /// The triangles worth testing one by one.
    pub fn usable(&self) -> Vec<(u32, [[f32; 3]; 3])> {
        let corners = self.triangles.iter().map(|t| t.map(|i| self.positions[i as usize]));
        (0..).zip(corners).filter(|(_, c)| c.iter().flatten().all(|x| x.is_finite())).collect()
    }
}

pub(super) fn brute_force(triangles: &[(u32, [[f32; 3]; 3])], ray: &Ray) -> Option<Hit> {
    if !is_proper(ray) {
        return None;
    }
    let shear = Shear::new(ray);
    let mut best = Best::<()>::new(ray.t_max);
    for (id, corners) in triangles {
        // What has no area was dropped at build time.
        if let Some(hit) = triangle::intersect(corners, &shear) {
            best.offer_triangle(&TrianglesOnly, ray, *id, hit, || *corners);
        }
    }
    match best.finish() {
        Some(Closest::Triangle(hit)) => Some(hit),
        _ => None,
    }
}

pub(super) fn bits(hit: Option<Hit>) -> Option<[u32; 4]> {
    hit.map(|h| [h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.primitive])
}

pub(super) fn triangle_hit<U>(closest: Option<Closest<U>>) -> Option<Hit> {
    match closest {
        Some(Closest::Triangle(hit)) => Some(hit),
        _ => None,
    }
}

/// Rays that start near the soup and go anywhere, along axes, at vertices, at edges, along edges.
pub(super) fn ray_at(soup: &Soup, scale: f32, random: &mut Random) -> Ray {
    let corner = |random: &mut Random| soup.positions[random.below(soup.positions.len())];
    let edge_point = |random: &mut Random| {
        let t = soup.triangles[random.below(soup.triangles.len())];
        let (a, b) = (soup.positions[t[0] as usize], soup.positions[t[1] as usize]);
        [0, 1, 2].map(|k| 0.5 * a[k] + 0.5 * b[k])
    };
    let mut o = random.point().map(|x| 1.5 * scale * x);
    let kind = random.below(8);
    if kind == 6 {
        o = corner(random);
    }
    let mut d = match kind {
        0 | 6 => random.point(),
        1 => {
            let mut d = [0.0, -0.0, 0.0];
            d[random.below(3)] = random.signed();
            d
        }
        2 | 3 => {
            let target = corner(random);
            [0, 1, 2].map(|k| (target[k] - o[k]) / scale)
        }
        4 => {
            let target = edge_point(random);
            [0, 1, 2].map(|k| (target[k] - o[k]) / scale)
        }
        5 => {
            // Straight down an axis through a vertex.
            let axis = random.below(3);
            let target = corner(random);
            let height = o[axis];
            o = target;
            o[axis] = height;
            let mut d = [0.0, 0.0, -0.0];
            d[axis] = target[axis] - height;
            d.map(|x| x / scale)
        }
        _ => {
            let (a, b) = (corner(random), corner(random));
            o = a;
            [0, 1, 2].map(|k| (b[k] - a[k]) / scale)
        }
    };
    let length = [1.0, 1.0, 1e-3, 1e3][random.below(4)];
    d = d.map(|x| x * length);
    let t_max = if random.below(3) == 0 { random.unit() * scale } else { f32::INFINITY };
    Ray { o, t_max, d, time: 0.0 }
}

fn agree(name: &str, soup: &Soup, scale: f32, n_rays: usize) {
    let bvh = soup.build();
    let all = soup.usable();
    let mut random = Random(7);
    let levels = Level::available();
    let mut hits = 0;
    for i in 0..n_rays {
        let ray = ray_at(soup, scale, &mut random);
        let expected = brute_force(&all, &ray);
        hits += usize::from(expected.is_some());
        for &level in &levels {
            let found = triangle_hit(bvh.intersect(level, &ray, &TrianglesOnly));
            assert_eq!(bits(found), bits(expected), "{name}, ray {i}, {level:?}: {ray:?} {found:?} {expected:?}");
            assert_eq!(
                bvh.occluded(level, &ray, &TrianglesOnly),
                expected.is_some(),
                "{name}, ray {i}, {level:?}: {ray:?}"
            );
        }
    }
    assert!(hits > n_rays / 50, "{name}: only {hits} hits");
}

pub(super) fn random_soup(n: usize, size: f32, scale: f32, seed: u64) -> Soup {
    let mut random = Random(seed);
    let mut soup = Soup::default();
    for _ in 0..n {
        let c = random.point();
        soup.push([(); 3].map(|()| {
            let p = random.point();
            [0, 1, 2].map(|k| scale * (c[k] + size * p[k]))
        }));
    }
    soup
}

/// Triangles between points of a coarse lattice: shared vertices, coplanar and coincident triangles, axis-aligned ones.
pub(super) fn lattice_soup(n: usize, seed: u64) -> Soup {
    let mut random = Random(seed);
    let mut soup = Soup::default();
    for _ in 0..n {
        soup.push([(); 3].map(|()| [(); 3].map(|()| random.below(5) as f32 * 0.5 - 1.0)));
    }
    let repeated: Vec<_> = soup.triangles[..n / 4].to_vec();
    soup.triangles.extend(repeated);
    soup
}

#[test]
fn all_levels_agree_with_brute_force() {
    agree("small triangles", &random_soup(300, 0.1, 1.0, 1), 1.0, 100_000);
    agree("large triangles", &random_soup(60, 1.0, 1.0, 2), 1.0, 100_000);
    agree("few", &random_soup(5, 1.0, 1.0, 3), 1.0, 20_000);
}

#[test]
fn all_levels_agree_on_coincident_and_axis_aligned_triangles() {
    agree("lattice", &lattice_soup(120, 4), 1.0, 100_000);
}

#[test]
fn all_levels_agree_at_extreme_scales() {
    agree("1e-30", &random_soup(60, 0.5, 1e-30, 5), 1e-30, 20_000);
    agree("1e-10", &random_soup(60, 0.5, 1e-10, 6), 1e-10, 20_000);
    agree("1e30", &random_soup(60, 0.5, 1e30, 7), 1e30, 20_000);
    let mut mixed = random_soup(40, 0.5, 1.0, 8);
    for i in 0..40 {
        let far = random_soup(1, 1.0, 10f32.powi(i / 2 - 10), 100 + i as u64);
        mixed.push(far.triangles[0].map(|v| far.positions[v as usize]));
    }
    agree("mixed scales", &mixed, 1.0, 50_000);
}

#[test]
fn long_thin_triangles_and_slivers_are_found() {
    let mut random = Random(9);
    let mut soup = Soup::default();
    for _ in 0..150 {
        let (a, b) = (random.point(), random.point());
        let width = 10f32.powi(-(random.below(7) as i32));
        let d = random.point();
        soup.push([a, b, [0, 1, 2].map(|k| b[k] + width * d[k])]);
    }
    agree("slivers", &soup, 1.0, 100_000);
}

#[test]
fn exact_ties_go_to_the_lowest_index() {
    // The same triangle 50 times, in reverse order of distance from anything an accident of layout would prefer.
    let mut soup = Soup::default();
    for _ in 0..50 {
        soup.push([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]]);
    }
    let bvh = soup.build();
    let ray = Ray { o: [0.1, 0.0, 3.0], t_max: f32::INFINITY, d: [0.0, 0.0, -1.0], time: 0.0 };
    for level in Level::available() {
        let hit = triangle_hit(bvh.intersect(level, &ray, &TrianglesOnly)).expect("a hit");
        assert_eq!((hit.primitive, hit.t), (0, 3.0));
        // The end of the ray does not count.
        let short = Ray { t_max: 3.0, ..ray };
        assert!(bvh.intersect(level, &short, &TrianglesOnly).is_none());
        assert!(!bvh.occluded(level, &short, &TrianglesOnly));
        let just = Ray { t_max: 3.0f32.next_up(), ..ray };
        assert!(bvh.intersect(level, &just, &TrianglesOnly).is_some());
        assert!(bvh.occluded(level, &just, &TrianglesOnly));
    }
}

#[test]
fn barycentrics_weigh_vertices_one_and_two() {
    let mut soup = Soup::default();
    soup.push([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
    let bvh = soup.build();
    let ray = Ray { o: [1.0, 2.0, 5.0], t_max: f32::INFINITY, d: [0.0, 0.0, -2.0], time: 0.0 };
    for level in Level::available() {
        let hit = triangle_hit(bvh.intersect(level, &ray, &TrianglesOnly)).expect("a hit");
        assert_eq!(hit, Hit { t: 2.5, u: 0.25, v: 0.5, primitive: 0 });
    }
}

#[test]
fn empty_and_improper_queries_meet_nothing() {
    let empty = Bvh::build(&BuildInput::default(), &BuildSettings::default());
    assert_eq!((empty.bounds(), empty.validate()), (None, Ok(())));
    let soup = random_soup(50, 1.0, 1.0, 10);
    let bvh = soup.build();
    let good = Ray { o: [0.0; 3], t_max: f32::INFINITY, d: [0.0, 0.0, 1.0], time: 0.0 };
    let mut bad = vec![Ray { d: [0.0; 3], ..good }];
    for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for k in 0..3 {
            let mut ray = good;
            ray.o[k] = x;
            bad.push(ray);
            let mut ray = good;
            ray.d[k] = x;
            bad.push(ray);
        }
    }
    bad.extend([f32::NAN, 0.0, -0.0, -1.0, f32::NEG_INFINITY].map(|t_max| Ray { t_max, ..good }));
    for level in Level::available() {
        assert!(empty.intersect(level, &good, &TrianglesOnly).is_none());
        assert!(!empty.occluded(level, &good, &TrianglesOnly));
        for ray in &bad {
            assert!(bvh.intersect(level, ray, &TrianglesOnly).is_none(), "{ray:?}");
            assert!(!bvh.occluded(level, ray, &TrianglesOnly), "{ray:?}");
        }
    }
}

/// A closed ball of triangles with irregular vertices, all shared.
pub(super) fn ball(n: usize, seed: u64) -> Soup {
    let mut random = Random(seed);
    let mut soup = Soup::default();
    let (rows, columns) = (n, 2 * n);
    soup.positions.push([0.0, 1.0, 0.0]);
    for i in 1..rows {
        for j in 0..columns {
            let theta = (i as f32 + 0.3 * random.signed()) / rows as f32 * std::f32::consts::PI;
            let phi = (j as f32 + 0.3 * random.signed()) / columns as f32 * std::f32::consts::TAU;
            let r = 1.0 + 0.1 * random.signed();
            soup.positions.push([r * theta.sin() * phi.cos(), r * theta.cos(), r * theta.sin() * phi.sin()]);
        }
    }
    soup.positions.push([0.0, -1.0, 0.0]);
    let at = |i: usize, j: usize| match i {
        0 => 0,
        _ if i == rows => ((rows - 1) * columns + 1) as u32,
        _ => ((i - 1) * columns + j % columns + 1) as u32,
    };
    for i in 0..rows {
        for j in 0..columns {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            soup.triangles
                .extend([[a, b, c], [a, c, d]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]));
        }
    }
    soup
}

/// No ray from inside a closed mesh gets out, aimed at vertices and points on edges. 10⁶ rays: a leak rate of
/// 3 x 10⁻⁶ would be seen with probability 95 %.
#[test]
fn closed_meshes_do_not_leak() {
    for (offset, n_rays) in [(0.0f32, 500_000), (1000.0, 500_000)] {
        let mut soup = ball(24, 11);
        for p in &mut soup.positions {
            *p = p.map(|x| x + offset);
        }
        let bvh = soup.build();
        let mut random = Random(12);
        for i in 0..n_rays {
            let o = random.point().map(|x| 0.4 * x + offset);
            let t = soup.triangles[random.below(soup.triangles.len())];
            let (a, b) = (soup.positions[t[i % 3] as usize], soup.positions[t[(i + 1) % 3] as usize]);
            let s = if i % 4 == 0 { 0.0 } else { random.unit() };
            let target: [f32; 3] = std::array::from_fn(|k| a[k] + s * (b[k] - a[k]));
            let d = std::array::from_fn(|k| target[k] - o[k]);
            let ray = Ray { o, t_max: f32::INFINITY, d, time: 0.0 };
            assert!(bvh.intersect(Level::detect(), &ray, &TrianglesOnly).is_some(), "leak at {ray:?}");
            assert!(bvh.occluded(Level::detect(), &ray, &TrianglesOnly), "leak at {ray:?}");
        }
    }
}

/// Balls, and a filter that lets through every third triangle near its first corner only.
pub(super) struct Balls(pub Vec<([f32; 3], f32)>);

impl Balls {
    pub fn boxes(&self) -> Vec<[[f32; 3]; 2]> {
        self.0.iter().map(|(c, r)| [c.map(|x| x - r * 1.0001), c.map(|x| x + r * 1.0001)]).collect()
    }
}

impl Leaves for Balls {
    type UserHit = u32;
    const HAS_FILTER: bool = true;

    fn intersect(&self, user: u32, ray: &Ray) -> Option<(f32, u32)> {
        let (c, r) = self.0[user as usize];
        let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        let f = std::array::from_fn(|k| ray.o[k] - c[k]);
        let (a, b, c) = (dot(ray.d, ray.d), dot(ray.d, f), dot(f, f) - r * r);
        let root = (b * b - a * c).sqrt();
        let first = [(-b - root) / a, (-b + root) / a].into_iter().find(|&t| t > 0.0)?;
        (first < ray.t_max).then_some((first, user * 10))
    }
    fn occluded(&self, user: u32, ray: &Ray) -> bool {
        self.intersect(user, ray).is_some()
    }
    fn accept(&self, triangle: u32, ray: &Ray, t: f32, u: f32, v: f32) -> bool {
        assert!(triangle >= 100 && t > 0.0 && ray.t_max > 0.0, "only the second mesh is filtered");
        u + v < 0.5
    }
}

#[test]
fn users_and_filtered_triangles_mix_in_one_tree() {
    let (plain, cut) = (random_soup(100, 0.3, 1.0, 13), random_soup(100, 0.3, 1.0, 14));
    let mut random = Random(15);
    let mut balls = Balls((0..60).map(|_| (random.point(), 0.02 + 0.3 * random.unit())).collect());
    // Three coincident balls: ties between users.
    let twin = balls.0[40];
    (balls.0[10], balls.0[59]) = (twin, twin);
    let meshes = [plain.mesh(), Mesh::default(), Mesh { filtered: true, ..cut.mesh() }];
    let boxes = balls.boxes();
    let bvh = Bvh::build(&BuildInput { meshes: &meshes, user_boxes: &boxes }, &BuildSettings::default());
    assert_eq!(bvh.validate(), Ok(()));
    assert_eq!((bvh.report().triangles, bvh.report().users), (200, 60));
    let mut triangles = plain.usable();
    triangles.extend(cut.usable().into_iter().map(|(id, c)| (id + 100, c)));
    let (mut n_users, mut n_cut) = (0, 0);
    for _ in 0..50_000 {
        let ray = ray_at(&plain, 1.0, &mut random);
        let mut best = Best::new(ray.t_max);
        for (id, corners) in &triangles {
            let id = id | if *id >= 100 { crate::node::Block::FILTERED } else { 0 };
            if let Some(hit) = triangle::intersect(corners, &Shear::new(&ray)) {
                best.offer_triangle(&balls, &ray, id, hit, || *corners);
            }
        }
        for user in 0..60 {
            best.offer_user(&balls, &ray, user);
        }
        let expected = best.finish();
        n_users += usize::from(matches!(expected, Some(Closest::User { .. })));
        n_cut += usize::from(matches!(expected, Some(Closest::Triangle(h)) if h.primitive >= 100));
        for level in Level::available() {
            assert_eq!(bvh.intersect(level, &ray, &balls), expected, "{level:?} {ray:?}");
            assert_eq!(bvh.occluded(level, &ray, &balls), expected.is_some(), "{level:?} {ray:?}");
        }
    }
    assert!(n_users > 5_000 && n_cut > 1_000, "{n_users} {n_cut}");
}

#[test]
fn infinite_user_boxes_are_always_asked() {
    let balls = Balls(vec![([0.0; 3], 1.0), ([5.0, 0.0, 0.0], 1.0)]);
    let mut boxes = balls.boxes();
    boxes[0] = [[f32::NEG_INFINITY; 3], [f32::INFINITY; 3]];
    let bvh = Bvh::build(&BuildInput { meshes: &[], user_boxes: &boxes }, &BuildSettings::default());
    assert_eq!(bvh.validate(), Ok(()));
    for level in Level::available() {
        for d in [[0.0, 0.0, -1.0], [1e-20, 0.0, -1.0], [-0.0, 1e-3, -1.0]] {
            let ray = Ray { o: [0.0, 0.0, 9.0], t_max: f32::INFINITY, d, time: 0.0 };
            assert!(matches!(bvh.intersect(level, &ray, &balls), Some(Closest::User { user: 0, hit: 0, .. })));
        }
    }
}

#[test]
fn levels_beyond_the_machine_fall_back() {
    let soup = random_soup(30, 1.0, 1.0, 16);
    let bvh = soup.build();
    let ray = Ray { o: [0.0, 0.0, 3.0], t_max: f32::INFINITY, d: [0.0, 0.0, -1.0], time: 0.0 };
    let expected = bvh.intersect(Level::Scalar, &ray, &TrianglesOnly);
    for level in [Level::Scalar, Level::Neon, Level::Sse, Level::Avx2, Level::Avx512] {
        assert_eq!(bvh.intersect(level, &ray, &TrianglesOnly), expected);
    }
}
