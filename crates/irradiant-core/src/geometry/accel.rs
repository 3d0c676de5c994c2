//! Groups of shapes, their trees, and what a tree asks back: user primitives, instances, alpha.
//!
//! One group holds what stands in the scene itself; one more each object and each moving shape. A group's tree holds the
//! triangles of all its meshes directly; quadrics, patches, pieces of curves and instances are user primitives. An
//! instance takes the ray to its group's space and asks that group's tree.

use super::curve::{Curve, CurveHit};
use super::cylinder::Cylinder;
use super::disk::Disk;
use super::instance::Instance;
use super::sphere::Sphere;
use super::triangle::Mesh;
use super::{AlphaTextures, Geometry, Hit, HitOf, NO_INSTANCE, bilinear};
use crate::interaction::{MaterialId, TextureContext};
use irradiant_bvh as bvh;
use irradiant_math::{Point2, Point3, Ray, Vec3, hash};
use irradiant_scene::desc::FloatTextureRef;

/// How much of a surface is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    /// All of it.
    Opaque,
    /// This share of it, in [0, 1).
    Constant(f32),
    /// As a texture says.
    Texture(FloatTextureRef),
}

/// What all primitives of a shape have in common.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShapeInfo {
    pub material: MaterialId,
    pub alpha: Alpha,
    /// Index among faces that emit of its first one, or [`NO_EMITTER`].
    pub first_emitter: u32,
}

pub(crate) const NO_EMITTER: u32 = u32::MAX;

/// A primitive that the tree knows only by its box. Indices into the vectors of [`Geometry`].
#[derive(Clone, Copy, Debug)]
pub(crate) enum User {
    Sphere {
        shape: u32,
        sphere: u32,
    },
    Disk {
        shape: u32,
        disk: u32,
    },
    Cylinder {
        shape: u32,
        cylinder: u32,
    },
    Patch {
        mesh: u32,
        quad: u32,
    },
    Curve {
        shape: u32,
        curve: u32,
        piece: u32,
    },
    /// An instance, or a part of it; the parts of one follow each other.
    Instance {
        instance: u32,
        part: bvh::Part,
    },
}

/// Consecutive triangles of a tree that belong to one mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshRange {
    pub first: u32,
    pub mesh: u32,
}

/// Which mesh each triangle of a tree belongs to.
#[derive(Debug, Default)]
pub(crate) struct MeshRanges {
    ranges: Vec<MeshRange>,
    /// For each stride of triangles, and once past the last, the range of the first of them.
    guide: Vec<u32>,
    /// Binary logarithm of the stride.
    log2_stride: u32,
}

impl MeshRanges {
    /// Binary logarithm of how many triangles share an entry of the guide, where there are many. Up to [`Self::FEW`] each has
    /// its own: a room of a dozen walls would be one entry, and searched through at every hit (60 instructions).
    const LOG2_STRIDE: u32 = 6;
    const FEW: u32 = 1 << 10;

    /// Of ranges that begin at 0 and follow each other, `triangles` in all.
    pub fn new(ranges: Vec<MeshRange>, triangles: u32) -> Self {
        let log2_stride = if triangles <= Self::FEW { 0 } else { Self::LOG2_STRIDE };
        let stride = 1u64 << log2_stride;
        let entries = if ranges.is_empty() { 0 } else { u64::from(triangles).div_ceil(stride) + 1 };
        let range_of = |entry: u64| {
            let triangle = (entry * stride).min(u64::from(triangles).saturating_sub(1));
            ranges.partition_point(|r: &MeshRange| u64::from(r.first) <= triangle) as u32 - 1
        };
        let guide = (0..entries).map(range_of).collect();
        Self { ranges, guide, log2_stride }
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl Iterator<Item = &MeshRange> {
        self.ranges.iter()
    }

    /// The range that a triangle is in.
    #[inline(always)]
    fn of(&self, triangle: u32) -> MeshRange {
        let entry = (triangle >> self.log2_stride) as usize;
        let low = self.guide[entry] as usize;
        if self.log2_stride == 0 {
            return self.ranges[low];
        }
        let high = self.guide[entry + 1] as usize;
        if low == high {
            return self.ranges[low];
        }
        self.ranges[low + self.ranges[low + 1..=high].partition_point(|r| r.first <= triangle)]
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.ranges[..]) + size_of_val(&self.guide[..])
    }
}

/// A tree and what its primitives are.
#[derive(Debug)]
pub(crate) struct Group {
    pub tree: bvh::Bvh,
    pub ranges: MeshRanges,
    pub users: Vec<User>,
}

impl Group {
    /// The mesh of a triangle of the tree, and its index there.
    #[inline]
    pub fn triangle(&self, primitive: u32) -> (u32, u32) {
        let range = self.ranges.of(primitive);
        (range.mesh, primitive - range.first)
    }

    /// How many primitives there are that are not triangles: each instance is one, whatever its parts.
    pub fn n_users(&self) -> usize {
        (0..self.users.len()).filter(|&i| self.begins(i)).count()
    }

    /// Whether user primitive `i` is the first, or only, part of what it is.
    pub fn begins(&self, i: usize) -> bool {
        let instance = |i: usize| match self.users[i] {
            User::Instance { instance, .. } => Some(instance),
            _ => None,
        };
        i == 0 || instance(i).is_none() || instance(i) != instance(i - 1)
    }
}

/// The shapes themselves.
#[derive(Debug, Default)]
pub(crate) struct Shapes {
    pub infos: Vec<ShapeInfo>,
    pub meshes: Vec<Mesh>,
    /// The shape that each mesh is.
    pub mesh_shapes: Vec<u32>,
    pub spheres: Vec<Sphere>,
    pub disks: Vec<Disk>,
    pub cylinders: Vec<Cylinder>,
    pub curves: Vec<Curve>,
    pub instances: Vec<Instance>,
}

/// Answers a tree's questions about one group.
pub(crate) struct GroupLeaves<'a, A> {
    pub geometry: &'a Geometry,
    pub group: &'a Group,
    pub alpha: &'a A,
}

#[inline]
pub(crate) fn to_ray(ray: &bvh::Ray) -> Ray {
    Ray::new(ray.o.into(), ray.d.into(), ray.time)
}

#[inline]
pub(crate) fn to_tree(ray: &Ray, t_max: f32) -> bvh::Ray {
    bvh::Ray { o: ray.o.to_array(), t_max, d: ray.d.to_array(), time: ray.time }
}

/// Whether a surface of this opacity is there for a ray: a fixed pseudo-random choice, by pbrt's rule the same for all
/// surfaces that one ray meets.
#[inline]
fn is_there(alpha: f32, o: Point3, d: Vec3) -> bool {
    if alpha >= 1.0 {
        true
    } else if alpha > 0.0 {
        hash::unit_f32_from_hash(hash::hash_ray(o, d)) < alpha
    } else {
        false
    }
}

impl<A: AlphaTextures> bvh::Leaves for GroupLeaves<'_, A> {
    type UserHit = Hit;
    const HAS_FILTER: bool = true;

    fn intersect(&self, user: u32, ray: &bvh::Ray) -> Option<(f32, Hit)> {
        self.meet(user, ray)
    }

    fn occluded(&self, user: u32, ray: &bvh::Ray) -> bool {
        match self.group.users[user as usize] {
            User::Instance { instance: i, part } => {
                let instance = &self.geometry.shapes.instances[i as usize];
                let local = instance.ray_to_group(ray);
                let group = &self.geometry.groups[instance.group as usize];
                group.tree.occluded_part(part, self.geometry.level, &local, &GroupLeaves { group, ..*self })
            }
            _ => self.meet(user, ray).is_some(),
        }
    }

    fn precedes(&self, (a, hit): (u32, &Hit), (b, other): (u32, &Hit)) -> bool {
        // Parts of one instance hold triangles only.
        let same = hit.instances[0] != NO_INSTANCE && hit.instances == other.instances;
        if same { hit.primitive < other.primitive } else { a < b }
    }

    fn intersect_many(&self, user: u32, rays: &[bvh::Ray], hits: &mut [Option<(f32, Hit)>]) {
        let User::Instance { instance: i, part } = self.group.users[user as usize] else {
            match self.group.users[user as usize] {
                User::Sphere { shape, sphere } => {
                    self.each_near(sphere, rays, |i| hits[i] = self.meet_sphere(user, shape, sphere, &rays[i]));
                }
                _ => rays.iter().zip(hits).for_each(|(ray, hit)| *hit = self.meet(user, ray)),
            }
            return;
        };
        let instance = &self.geometry.shapes.instances[i as usize];
        let group = &self.geometry.groups[instance.group as usize];
        let leaves = GroupLeaves { group, ..*self };
        for (rays, hits) in rays.chunks(MANY).zip(hits.chunks_mut(MANY)) {
            let (local, mut found) = (rays_to_group(instance, rays), [None; MANY]);
            let (local, found_of) = (&local[..rays.len()], &mut found[..rays.len()]);
            group.tree.intersect_part_batch(part, self.geometry.level, local, &leaves, found_of);
            for (hit, found) in hits.iter_mut().zip(found) {
                *hit = found.map(|closest| {
                    let mut inner = super::hit_of(closest);
                    inner.instances = [i, inner.instances[0]];
                    (inner.t, inner)
                });
            }
        }
    }

    fn occluded_many(&self, user: u32, rays: &[bvh::Ray], out: &mut [bool]) {
        let User::Instance { instance: i, part } = self.group.users[user as usize] else {
            match self.group.users[user as usize] {
                User::Sphere { shape, sphere } => self.each_near(sphere, rays, |i| {
                    out[i] = self.meet_sphere(user, shape, sphere, &rays[i]).is_some();
                }),
                _ => rays.iter().zip(out).for_each(|(ray, out)| *out = self.meet(user, ray).is_some()),
            }
            return;
        };
        let instance = &self.geometry.shapes.instances[i as usize];
        let group = &self.geometry.groups[instance.group as usize];
        let leaves = GroupLeaves { group, ..*self };
        for (rays, out) in rays.chunks(MANY).zip(out.chunks_mut(MANY)) {
            let local = rays_to_group(instance, rays);
            group.tree.occluded_part_batch(part, self.geometry.level, &local[..rays.len()], &leaves, out);
        }
    }

    fn accept(&self, triangle: u32, ray: &bvh::Ray, _t: f32, u: f32, v: f32) -> bool {
        let shapes = &self.geometry.shapes;
        let (mesh_index, index) = self.group.triangle(triangle);
        let alpha = match shapes.infos[shapes.mesh_shapes[mesh_index as usize] as usize].alpha {
            Alpha::Opaque => return true,
            Alpha::Constant(a) => a,
            Alpha::Texture(texture) => {
                let mesh = &shapes.meshes[mesh_index as usize];
                let [p0, p1, p2] = mesh.triangles[index as usize].map(|i| mesh.position(i));
                let context = context(
                    mesh.triangle_point(index, u, v).0,
                    (p1 - p0).cross(p2 - p0),
                    mesh.triangle_uv(index, u, v),
                    mesh.face(index as usize),
                );
                self.alpha.alpha(texture, &context)
            }
        };
        is_there(alpha, ray.o.into(), ray.d.into())
    }
}

/// As many rays as a tree asks about at once.
const MANY: usize = 16;

/// Which of up to [`MANY`] rays do not clearly miss a sphere, a bit for each.
struct NearSphere<'a> {
    sphere: &'a Sphere,
    rays: &'a [bvh::Ray],
}

impl bvh::Kernel for NearSphere<'_> {
    type Output = u32;
    #[inline(always)]
    fn run(self) -> u32 {
        let Self { sphere, rays } = self;
        let (mut o, mut d, mut t_max) = ([[0.0; MANY]; 3], [[0.0; MANY]; 3], [0.0; MANY]);
        for (i, ray) in rays.iter().take(MANY).enumerate() {
            for axis in 0..3 {
                (o[axis][i], d[axis][i]) = (ray.o[axis], ray.d[axis]);
            }
            t_max[i] = ray.t_max;
        }
        let mut near = [0u32; MANY];
        for i in 0..MANY {
            let (o, d) = ([o[0][i], o[1][i], o[2][i]], [d[0][i], d[1][i], d[2][i]]);
            let (o, d) = sphere.placement.ray_to_shape(&Ray::new(o.into(), d.into(), 0.0));
            near[i] = u32::from(!sphere.is_clearly_missed(o, d, t_max[i])) << i;
        }
        let all = near.iter().fold(0, |all, bit| all | bit);
        all & ((1u64 << rays.len()) - 1) as u32
    }
}

fn hit_of_user(user: u32, t: f32, u: f32, v: f32) -> Hit {
    Hit { t, u, v, primitive: user, of: HitOf::User, instances: [NO_INSTANCE; 2] }
}

/// Whether a root counts with 0 < t < t_max, first as a double, then as the single that is reported.
#[inline]
fn is_within(t: f64, t_max: f32) -> bool {
    t > 0.0 && (t as f32) > 0.0 && (t as f32) < t_max
}

#[inline(always)]
fn rays_to_group(instance: &Instance, rays: &[bvh::Ray]) -> [bvh::Ray; MANY] {
    let mut local = [bvh::Ray { o: [0.0; 3], t_max: 0.0, d: [0.0; 3], time: 0.0 }; MANY];
    for (local, ray) in local.iter_mut().zip(rays) {
        *local = instance.ray_to_group(ray);
    }
    local
}

fn context(p: Point3, n: Vec3, uv: Point2, face: u32) -> TextureContext {
    TextureContext::without_footprint(p, n.normalize().as_normal(), uv, face)
}

impl<A: AlphaTextures> GroupLeaves<'_, A> {
    fn meet(&self, user: u32, ray: &bvh::Ray) -> Option<(f32, Hit)> {
        let shapes = &self.geometry.shapes;
        let hit = |t: f32, u: f32, v: f32| hit_of_user(user, t, u, v);
        let within = |t: f64| is_within(t, ray.t_max);
        match self.group.users[user as usize] {
            User::Sphere { shape, sphere } => {
                let s = &shapes.spheres[sphere as usize];
                let (o, d) = s.placement.ray_to_shape(&to_ray(ray));
                if s.is_clearly_missed(o, d, ray.t_max) {
                    return None;
                }
                self.meet_sphere(user, shape, sphere, ray)
            }
            User::Cylinder { shape, cylinder } => {
                let c = &shapes.cylinders[cylinder as usize];
                let single = to_ray(ray);
                let (o, d) = c.placement.ray_to_shape(&single);
                let roots = c.roots(o, d)?;
                (0..2).find_map(|i| {
                    let t = roots[i];
                    let p = within(t).then(|| c.point(o, d, t)).flatten()?;
                    let there = self.is_there(shape, &single, i > 0, || {
                        let n = c.placement.unit_normal([p[0], p[1], 0.0]).0;
                        context(c.placement.point(p).0, n.as_vec(), c.uv(p), 0)
                    });
                    there.then(|| (t as f32, hit(t as f32, i as f32, 0.0)))
                })
            }
            User::Disk { shape, disk } => {
                let k = &shapes.disks[disk as usize];
                let single = to_ray(ray);
                let (o, d) = k.placement.ray_to_shape(&single);
                let (t, p) = k.meet(o, d).filter(|(t, _)| within(*t))?;
                let there = self.is_there(shape, &single, false, || {
                    let n = k.placement.unit_normal([0.0, 0.0, 1.0]).0;
                    context(k.placement.point(p).0, n.as_vec(), k.uv(p), 0)
                });
                there.then(|| (t as f32, hit(t as f32, 0.0, 0.0)))
            }
            User::Patch { mesh, quad } => {
                let shape = shapes.mesh_shapes[mesh as usize];
                let mesh = &shapes.meshes[mesh as usize];
                let single = to_ray(ray);
                let corners = mesh.corners(quad);
                let mut met = bilinear::meet(&single, &corners).into_iter().flatten().enumerate();
                met.find_map(|(i, h)| {
                    let (u, v) = (h.u as f32, h.v as f32);
                    let there = within(h.t)
                        && self.is_there(shape, &single, i > 0, || {
                            let (p, _) = bilinear::point_and_error(&corners, h.u, h.v);
                            let (du, dv) = bilinear::derivatives(&corners, h.u, h.v);
                            let n = super::placement::single(super::placement::cross(du, dv)).into();
                            context(p, n, mesh.patch_uv(quad, u, v), mesh.face(mesh.triangles.len() + quad as usize))
                        });
                    there.then(|| (h.t as f32, hit(h.t as f32, u, v)))
                })
            }
            User::Curve { shape, curve, piece } => {
                let single = to_ray(ray);
                let CurveHit { t, u, v } = shapes.curves[curve as usize].meet(piece, &single, ray.t_max)?;
                let there =
                    self.is_there(shape, &single, false, || context(single.at(t), -single.d, Point2::new(u, v), 0));
                there.then(|| (t, hit(t, u, v)))
            }
            User::Instance { instance: i, part } => {
                let instance = &shapes.instances[i as usize];
                let local = instance.ray_to_group(ray);
                let group = &self.geometry.groups[instance.group as usize];
                let leaves = GroupLeaves { group, ..*self };
                let mut found =
                    group.tree.intersect_part(part, self.geometry.level, &local, &leaves).map(super::hit_of)?;
                found.instances = [i, found.instances[0]];
                Some((found.t, found))
            }
        }
    }

    /// A sphere that may be met.
    #[inline]
    fn meet_sphere(&self, user: u32, shape: u32, sphere: u32, ray: &bvh::Ray) -> Option<(f32, Hit)> {
        let s = &self.geometry.shapes.spheres[sphere as usize];
        let single = to_ray(ray);
        let (o, d) = s.placement.ray_to_shape(&single);
        let roots = s.roots(o, d)?;
        (0..2).find_map(|i| {
            let t = roots[i];
            let p = is_within(t, ray.t_max).then(|| s.point(o, d, t)).flatten()?;
            let there = self.is_there(shape, &single, i > 0, || {
                context(s.placement.point(p).0, s.placement.unit_normal(p).0.as_vec(), s.uv(p), 0)
            });
            there.then(|| (t as f32, hit_of_user(user, t as f32, i as f32, 0.0)))
        })
    }

    /// Looks at the rays that do not clearly miss a sphere.
    #[inline]
    fn each_near(&self, sphere: u32, rays: &[bvh::Ray], mut look: impl FnMut(usize)) {
        let sphere = &self.geometry.shapes.spheres[sphere as usize];
        for (k, rays) in rays.chunks(MANY).enumerate() {
            let mut near = self.geometry.level.run(NearSphere { sphere, rays });
            while near != 0 {
                look(MANY * k + near.trailing_zeros() as usize);
                near &= near - 1;
            }
        }
    }

    /// Whether a user primitive of `shape` is there for a ray. A ray that has passed its first hit looks at the second
    /// with a choice of its own, like pbrt's, which starts a new ray there.
    #[inline]
    fn is_there(&self, shape: u32, ray: &Ray, again: bool, at: impl FnOnce() -> TextureContext) -> bool {
        let alpha = match self.geometry.shapes.infos[shape as usize].alpha {
            Alpha::Opaque => return true,
            Alpha::Constant(a) => a,
            Alpha::Texture(texture) => self.alpha.alpha(texture, &at()),
        };
        // Twice the direction is the same ray with another hash.
        is_there(alpha, ray.o, if again { ray.d * 2.0 } else { ray.d })
    }
}

impl<A> Clone for GroupLeaves<'_, A> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<A> Copy for GroupLeaves<'_, A> {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::placement::Placement;
    use irradiant_testkit::Rng;

    // Any number of rays, at all levels: near are those of which one alone is not told that it clearly misses.
    #[test]
    fn rays_near_a_sphere_are_those_that_one_by_one_do_not_clearly_miss() {
        let mut rng = Rng::new(4);
        let placement = Placement::new(&irradiant_math::Transform::translate(3.0, -2.0, 0.5), false);
        let sphere = Sphere::new(0.5, -0.5, 0.5, 360.0, placement.expect("a translation is affine"));
        let mut told = [0; 2];
        for i in 0..4000 {
            let rays: Vec<bvh::Ray> = (0..1 + i % MANY)
                .map(|_| {
                    let [o, to] = [rng.direction(), rng.direction()].map(Vec3::from);
                    let o = Point3::new(3.0, -2.0, 0.5) + o * [0.5, 0.8, 40.0][i % 3];
                    let d = Point3::new(3.0, -2.0, 0.5) + to * 0.6 - o;
                    let t_max = if rng.next_f32() < 0.5 { f32::INFINITY } else { 1.5 * rng.next_f32() };
                    to_tree(&Ray::new(o, d, 0.0), t_max)
                })
                .collect();
            let expected = rays.iter().enumerate().fold(0, |near, (k, ray)| {
                let (o, d) = sphere.placement.ray_to_shape(&to_ray(ray));
                let is_missed = sphere.is_clearly_missed(o, d, ray.t_max);
                told[usize::from(is_missed)] += 1;
                near | u32::from(!is_missed) << k
            });
            for level in bvh::Level::available() {
                let near = level.run(NearSphere { sphere: &sphere, rays: &rays });
                assert_eq!(near, expected, "{level:?} {rays:?}");
            }
        }
        assert!(told.iter().all(|&n| n > 4000), "{told:?}");
    }

    // Meshes of one triangle, of none, of many, and ends that fall on the guide's entries.
    #[test]
    fn every_triangle_is_found_in_its_mesh() {
        for sizes in [
            &[1u32][..],
            &[0, 3, 0, 0, 61, 64, 1, 1, 1, 200, 0],
            &[0, 3, 0, 0, 61, 64, 1, 1, 1, 2000, 0],
            &[64; 40],
            &[1; 300],
            &[1; 3000],
            &[1000, 24],
            &[1000, 25],
        ] {
            let (mut first, mut ranges, mut expected) = (0, Vec::new(), Vec::new());
            for (mesh, &size) in sizes.iter().enumerate() {
                ranges.push(MeshRange { first, mesh: mesh as u32 });
                expected.extend((0..size).map(|i| (mesh as u32, first + i)));
                first += size;
            }
            let ranges = MeshRanges::new(ranges, first);
            for (mesh, triangle) in expected {
                assert_eq!(ranges.of(triangle).mesh, mesh, "{sizes:?} {triangle}");
            }
        }
        assert_eq!(MeshRanges::new(Vec::new(), 0).iter().count(), 0);
    }
}
