//! What rays meet: shapes in render space, the trees over them, and the emitters among them.
//!
//! # Layout
//! In reading order: this file (what a ray may ask: [`Geometry`]); `compile` (from the description); `accel` (groups,
//! trees, alpha); `instance` (groups placed elsewhere, moving or not); the shapes `triangle`, `bilinear`, `sphere`,
//! `disk`, `cylinder`, `curve`; `placement` (quadrics' own spaces); [`emitter`] (shapes as sources of light); [`textbook`]
//! (how not to do it, for teaching); `triangle_lanes` and `ray_batch` (many at once).
//!
//! # Robustness
//! No epsilon is anyone's to choose. Hit points are put back on their surface (quadrics on the quadric in `f64`,
//! triangles on the plane by weights) and carry a bound on what is left; rays leave from beyond that bound
//! ([`Interaction::spawn_ray`]); a triangle must be farther than the error of its own `t`. After Pharr, Jakob and
//! Humphreys 2023, section 6.8.
//!
//! It does not know what surfaces are made of, nor what light is; it hands out ids.

mod accel;
mod bilinear;
mod compile;
mod curve;
mod cylinder;
mod disk;
pub mod emitter;
mod instance;
mod placement;
mod ray_batch;
mod spawn;
mod sphere;
#[cfg(test)]
mod tests;
pub mod textbook;
mod triangle;
mod triangle_lanes;

pub use accel::Alpha;
pub use compile::compile_geometry;
pub use emitter::{EmitterShape, NormalCone, RectangleLanes, ShapeSample, SphereLanes};

pub use irradiant_bvh::{Kernel, Level};
pub use ray_batch::RayBatch;
pub(crate) use spawn::segment;
pub use triangle_lanes::{SurfaceLanes, TriangleLanes};

use crate::interaction::{Interaction, LightId, MaterialId, ShapeId, TextureContext};
use accel::{Group, GroupLeaves, NO_EMITTER, Shapes, User, to_tree};
use irradiant_bvh as bvh;
use irradiant_math::{Bounds3, Ray};
use irradiant_scene::desc::FloatTextureRef;
use triangle_lanes::FlatTriangle;

/// Evaluates opacity textures for hits that depend on them.
pub trait AlphaTextures {
    /// Opacity at a point: 1 or more is there, 0 or less is not, and between is there for that share of rays.
    ///
    /// Inside objects and moving shapes the context is in the object's own space, as pbrt's is.
    fn alpha(&self, texture: FloatTextureRef, at: &TextureContext) -> f32;
}

/// For scenes without opacity textures: everything is there.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoAlphaTextures;

impl AlphaTextures for NoAlphaTextures {
    fn alpha(&self, _texture: FloatTextureRef, _at: &TextureContext) -> f32 {
        1.0
    }
}

pub(crate) const NO_INSTANCE: u32 = u32::MAX;

/// The closest thing a ray meets; [`Geometry::interaction`] tells what it looks like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Ray parameter, in lengths of the ray's direction.
    pub t: f32,
    /// First parameter of the place: weight of vertex 1, u, or which root.
    pub(crate) u: f32,
    /// Second parameter: weight of vertex 2, or v.
    pub(crate) v: f32,
    /// Index in its tree.
    pub(crate) primitive: u32,
    /// What kind of primitive.
    pub(crate) of: HitOf,
    /// Instances from outside in.
    pub(crate) instances: [u32; 2],
}

/// What kind of primitive is hit. As large as the numbers beside it: hits with a byte in them are copied in pieces that overlap, which wait for
/// each other in the processor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum HitOf {
    Triangle,
    User,
}

fn hit_of(closest: bvh::Closest<Hit>) -> Hit {
    match closest {
        bvh::Closest::Triangle(bvh::Hit { t, u, v, primitive }) => {
            Hit { t, u, v, primitive, of: HitOf::Triangle, instances: [NO_INSTANCE; 2] }
        }
        bvh::Closest::User { hit, .. } => hit,
    }
}

/// Rays that go to a tree in one call: few enough to stay in the nearest cache with their answers.
const BATCH: usize = 64;
/// The same where the tree sorts them by where they go.
const SORTED_BATCH: usize = bvh::Bvh::SORTED;

/// As the tree wants them; at most `N`.
fn gathered<const N: usize>(rays: &[Ray], t_max: &[f32]) -> [bvh::Ray; N] {
    let nothing = bvh::Ray { o: [0.0; 3], t_max: 0.0, d: [0.0; 3], time: 0.0 };
    let mut out = [nothing; N];
    for ((out, ray), &t_max) in out.iter_mut().zip(rays).zip(t_max) {
        *out = to_tree(ray, t_max);
    }
    out
}

/// A surface element that emits.
#[derive(Clone, Debug)]
pub struct Emitter {
    /// The shape it is part of.
    pub shape: ShapeId,
    /// Its face there: triangle, then quad, or piece of curve; 0 for quadrics.
    pub face: u32,
    /// Number of faces: 2 where triangles `face` and `face + 1` are one rectangle, else 1.
    pub faces: u32,
    /// Opacity of the shape.
    pub alpha: Alpha,
    /// Its form.
    pub geometry: EmitterShape,
}

/// All shapes of a scene, ready to be met by rays. Immutable but for [`Geometry::assign_lights`].
#[derive(Debug)]
pub struct Geometry {
    pub(crate) level: Level,
    pub(crate) shapes: Shapes,
    /// The scene itself, then objects and moving shapes.
    pub(crate) groups: Vec<Group>,
    /// The triangles of the scene itself, where they are few, for hits that are looked at in lanes.
    flat_triangles: Vec<Option<FlatTriangle>>,
    emitters: Vec<Emitter>,
    /// The emitter of each face of each emitting shape, and its light.
    face_emitters: Vec<u32>,
    lights: Vec<Option<LightId>>,
}

impl Geometry {
    /// The closest surface with 0 < t < `t_max`, in lengths of `ray.d` (which need not be unit).
    #[inline]
    pub fn intersect(&self, ray: &Ray, t_max: f32, alpha: &impl AlphaTextures) -> Option<Hit> {
        let group = &self.groups[0];
        let leaves = GroupLeaves { geometry: self, group, alpha };
        group.tree.intersect(self.level, &to_tree(ray, t_max), &leaves).map(hit_of)
    }

    /// Whether any surface lies at 0 < t < `t_max`.
    #[inline]
    pub fn occluded(&self, ray: &Ray, t_max: f32, alpha: &impl AlphaTextures) -> bool {
        let group = &self.groups[0];
        group.tree.occluded(self.level, &to_tree(ray, t_max), &GroupLeaves { geometry: self, group, alpha })
    }

    /// Whether any surface lies between two points that [`spawn_ray_to`](Interaction::spawn_ray_to) connected.
    #[inline]
    pub fn occluded_between(&self, segment: &Ray, alpha: &impl AlphaTextures) -> bool {
        self.occluded(segment, 1.0, alpha)
    }

    /// For each ray what [`intersect`](Self::intersect) gives, to the bit: `hits[i]` answers `rays[i]` up to `t_max[i]`.
    ///
    /// Any number of rays in any order, without allocation; fastest where neighbours in the slice travel together
    /// (pixels of a small tile).
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn intersect_batch(&self, rays: &[Ray], t_max: &[f32], alpha: &impl AlphaTextures, hits: &mut [Option<Hit>]) {
        assert_eq!((rays.len(), rays.len()), (t_max.len(), hits.len()), "one end and one answer for each ray");
        if self.sorts_rays() {
            self.closest_of_batch::<SORTED_BATCH>(rays, t_max, alpha, hits);
        } else {
            self.closest_of_batch::<BATCH>(rays, t_max, alpha, hits);
        }
    }

    /// Whether rays of a batch are sorted by where they go, so that large batches are best, in whatever order.
    pub fn sorts_rays(&self) -> bool {
        self.groups[0].tree.sorts_rays(self.level)
    }

    fn closest_of_batch<const N: usize>(
        &self,
        rays: &[Ray],
        t_max: &[f32],
        alpha: &impl AlphaTextures,
        hits: &mut [Option<Hit>],
    ) {
        let group = &self.groups[0];
        let leaves = GroupLeaves { geometry: self, group, alpha };
        let mut closest = [None; N];
        for ((rays, t_max), hits) in rays.chunks(N).zip(t_max.chunks(N)).zip(hits.chunks_mut(N)) {
            let rays = &gathered::<N>(rays, t_max)[..rays.len()];
            let closest = &mut closest[..rays.len()];
            group.tree.intersect_batch(self.level, rays, &leaves, closest);
            for (hit, closest) in hits.iter_mut().zip(closest) {
                *hit = closest.map(hit_of);
            }
        }
    }

    /// For each ray what [`occluded`](Self::occluded) says: `out[i]` answers `rays[i]` up to `t_max[i]`.
    ///
    /// Any number of rays in any order, without allocation; fastest where neighbours in the slice travel together
    /// (from neighbouring points towards one light).
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn occluded_batch(&self, rays: &[Ray], t_max: &[f32], alpha: &impl AlphaTextures, out: &mut [bool]) {
        assert_eq!((rays.len(), rays.len()), (t_max.len(), out.len()), "one end and one answer for each ray");
        if self.sorts_rays() {
            self.occlusion_of_batch::<SORTED_BATCH>(rays, t_max, alpha, out);
        } else {
            self.occlusion_of_batch::<BATCH>(rays, t_max, alpha, out);
        }
    }

    fn occlusion_of_batch<const N: usize>(
        &self,
        rays: &[Ray],
        t_max: &[f32],
        alpha: &impl AlphaTextures,
        out: &mut [bool],
    ) {
        let group = &self.groups[0];
        let leaves = GroupLeaves { geometry: self, group, alpha };
        for ((rays, t_max), out) in rays.chunks(N).zip(t_max.chunks(N)).zip(out.chunks_mut(N)) {
            let rays = &gathered::<N>(rays, t_max)[..rays.len()];
            group.tree.occluded_batch(self.level, rays, &leaves, out);
        }
    }

    /// What the ray met at `hit` (which [`Geometry::intersect`] gave for this very ray).
    #[inline]
    pub fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction {
        let mut at = Interaction::unknown(ray, hit.t);
        self.fill_in(ray, hit, &mut at);
        at
    }

    /// As [`Geometry::interaction`], into what [`Interaction::unknown`] made of the ray: for the loops of integrators, since
    /// what is returned is first made elsewhere and then copied.
    #[inline]
    pub fn fill_in(&self, ray: &Ray, hit: &Hit, at: &mut Interaction) {
        self.fill(0, &to_tree(ray, f32::INFINITY), hit, hit.instances, at);
    }

    /// The same, but that neither parameters nor derivatives other than the first need be told where `is_plain` says so of a material and a
    /// light: those of spheres are not.
    pub fn fill_in_plainly(
        &self,
        ray: &Ray,
        hit: &Hit,
        at: &mut Interaction,
        is_plain: impl FnOnce(MaterialId, Option<LightId>) -> bool,
    ) {
        if hit.of == HitOf::Triangle || hit.instances[0] != NO_INSTANCE {
            return self.fill_in(ray, hit, at);
        }
        let User::Sphere { shape, sphere } = self.groups[0].users[hit.primitive as usize] else {
            return self.fill_in(ray, hit, at);
        };
        let info = &self.shapes.infos[shape as usize];
        let light = match info.first_emitter {
            NO_EMITTER => None,
            emitter => self.lights[emitter as usize],
        };
        if !is_plain(info.material, light) {
            return self.fill_in(ray, hit, at);
        }
        // The root was there when the ray met it.
        if let Some(placed) = self.shapes.spheres[sphere as usize].place(ray, hit.u as usize) {
            (at.p, at.p_error, at.n, at.ns) = (placed.p, placed.p_error, placed.n, placed.n);
            (at.dpdu, at.dpdus) = (placed.dpdu, placed.dpdu);
        }
        (at.material, at.shape, at.light) = (info.material, ShapeId(shape), light);
    }

    /// Fills in a hit in the space of a group.
    fn fill(&self, group: u32, ray: &bvh::Ray, hit: &Hit, instances: [u32; 2], at: &mut Interaction) {
        if instances[0] != NO_INSTANCE {
            let instance = &self.shapes.instances[instances[0] as usize];
            let affine = instance.at(ray.time);
            self.fill(instance.group, &instance::ray_inside(&affine, ray), hit, [instances[1], NO_INSTANCE], at);
            instance::interaction_outside(&affine, at);
            return;
        }
        let group = &self.groups[group as usize];
        let shapes = &self.shapes;
        let (shape, emitter) = if hit.of == HitOf::User {
            let single = accel::to_ray(ray);
            let mut quadric = |placed: Option<placement::Placed>| {
                // The roots were there when the ray met them, and this is the same computation.
                let Some(p) = placed else { return };
                (at.p, at.p_error, at.n, at.ns, at.uv) = (p.p, p.p_error, p.n, p.n, p.uv);
                (at.dpdu, at.dpdv, at.dpdus, at.dpdvs) = (p.dpdu, p.dpdv, p.dpdu, p.dpdv);
                (at.dndus, at.dndvs) = (p.dndu, p.dndv);
            };
            let root = hit.u as usize;
            match group.users[hit.primitive as usize] {
                User::Sphere { shape, sphere } => {
                    quadric(shapes.spheres[sphere as usize].place(&single, root));
                    (shape, 0)
                }
                User::Disk { shape, disk } => {
                    quadric(shapes.disks[disk as usize].place(&single));
                    (shape, 0)
                }
                User::Cylinder { shape, cylinder } => {
                    quadric(shapes.cylinders[cylinder as usize].place(&single, root));
                    (shape, 0)
                }
                User::Patch { mesh, quad } => {
                    let m = &shapes.meshes[mesh as usize];
                    m.patch_interaction(quad, hit.u, hit.v, at);
                    (shapes.mesh_shapes[mesh as usize], m.triangles.len() as u32 + quad)
                }
                User::Curve { shape, curve, piece } => {
                    let met = curve::CurveHit { t: hit.t, u: hit.u, v: hit.v };
                    shapes.curves[curve as usize].interaction(piece, &single, &met, at);
                    (shape, piece)
                }
                User::Instance { .. } => return,
            }
        } else {
            let (mesh, triangle) = group.triangle(hit.primitive);
            shapes.meshes[mesh as usize].triangle_interaction(triangle, hit.u, hit.v, at);
            (shapes.mesh_shapes[mesh as usize], triangle)
        };
        let info = &shapes.infos[shape as usize];
        at.material = info.material;
        at.shape = ShapeId(shape);
        if info.first_emitter != NO_EMITTER {
            at.light = self.lights[(info.first_emitter + emitter) as usize];
        }
    }

    /// The surface elements that emit, each to become one light.
    pub fn emitters(&self) -> &[Emitter] {
        &self.emitters
    }

    /// Says which light each emitter became; `None` for those that are no light after all. Until then emitter `i` is
    /// light `i`. A short list leaves the rest without light.
    pub fn assign_lights(&mut self, lights: impl IntoIterator<Item = Option<LightId>>) {
        let by_emitter: Vec<Option<LightId>> = lights.into_iter().collect();
        self.lights = self.face_emitters.iter().map(|&e| by_emitter.get(e as usize).copied().flatten()).collect();
    }

    /// A box around everything; empty for an empty scene.
    pub fn bounds(&self) -> Bounds3 {
        match self.groups[0].tree.bounds() {
            Some([min, max]) => Bounds3 { min: min.into(), max: max.into() },
            None => Bounds3::EMPTY,
        }
    }

    /// Number of shapes as the author described them, those of objects included: [`ShapeId`]s are below it.
    pub fn n_shapes(&self) -> usize {
        self.shapes.infos.len()
    }

    /// What a shape is made of.
    pub fn material(&self, shape: ShapeId) -> MaterialId {
        self.shapes.infos[shape.0 as usize].material
    }

    /// How much of a shape is there.
    pub fn alpha(&self, shape: ShapeId) -> Alpha {
        self.shapes.infos[shape.0 as usize].alpha
    }

    /// Uses other instructions for traversal; results are the same bits.
    pub fn set_level(&mut self, level: Level) {
        self.level = level;
    }

    /// Number of triangles, and of other primitives, over all groups.
    pub fn n_primitives(&self) -> (usize, usize) {
        let triangles = self.shapes.meshes.iter().map(|m| m.triangles.len()).sum();
        (triangles, self.groups.iter().map(Group::n_users).sum())
    }

    /// Bytes held by vertices, faces, trees and emitters.
    pub fn memory_bytes(&self) -> usize {
        let s = &self.shapes;
        s.meshes.iter().map(triangle::Mesh::memory_bytes).sum::<usize>()
            + s.curves.iter().map(curve::Curve::memory_bytes).sum::<usize>()
            + size_of_val(&s.spheres[..])
            + size_of_val(&s.disks[..])
            + size_of_val(&s.cylinders[..])
            + size_of_val(&s.instances[..])
            + size_of_val(&s.infos[..])
            + size_of_val(&self.flat_triangles[..])
            + self
                .groups
                .iter()
                .map(|g| g.tree.memory_bytes() + g.ranges.memory_bytes() + size_of_val(&g.users[..]))
                .sum::<usize>()
            + self.emitters.iter().map(|e| size_of_val(e) + e.geometry.memory_bytes()).sum::<usize>()
    }
}
