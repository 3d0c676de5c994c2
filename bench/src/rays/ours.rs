//! Irradiant's tree over the same geometry.

use super::builds::{Spent, Stopwatch};
use super::sets::{Geometry, Placement};
use crate::vector::{V, add, scale, sub};
use irradiant_bvh::{
    Braid, BuildInput, BuildSettings, Bvh, Closest, Hit, Leaves, Level, Mesh, Part, Ray, TrianglesOnly, braid,
};

/// A tree over triangles, or one over instances of such.
pub struct Tree<'a> {
    geometry: &'a Geometry,
    /// One, or one for each mesh that is instanced.
    parts: Vec<Bvh>,
    placed: Vec<Placed>,
    top: Option<Bvh>,
    level: Level,
    /// By the build.
    pub spent: Spent,
}

/// An instance, or a part of one, as the tree over them knows it.
struct Placed {
    mesh: u32,
    part: Part,
    origin: V,
    /// How much smaller it is inside.
    shrink: f32,
    /// Index among the placements.
    instance: u32,
}

struct Instances<'a> {
    parts: &'a [Bvh],
    placed: &'a [Placed],
    level: Level,
}

/// As many rays as a tree asks about at once.
const MANY: usize = 16;

impl Instances<'_> {
    /// The same for up to [`MANY`] rays.
    #[inline(always)]
    fn all_inside(&self, user: u32, rays: &[Ray]) -> (&Bvh, Part, [Ray; MANY]) {
        let mut local = [Ray { o: [0.0; 3], t_max: 0.0, d: [0.0; 3], time: 0.0 }; MANY];
        for (local, ray) in local.iter_mut().zip(rays) {
            *local = self.inside(user, ray).2;
        }
        let p = &self.placed[user as usize];
        (&self.parts[p.mesh as usize], p.part, local)
    }

    /// The ray in the space of an instance: distances along it stay the same.
    #[inline(always)]
    fn inside(&self, user: u32, ray: &Ray) -> (&Bvh, Part, Ray) {
        let p = &self.placed[user as usize];
        let (o, d) = (scale(sub(ray.o, p.origin), p.shrink), scale(ray.d, p.shrink));
        (&self.parts[p.mesh as usize], p.part, Ray { o, t_max: ray.t_max, d, time: ray.time })
    }
}

impl Leaves for Instances<'_> {
    type UserHit = Hit;

    #[inline(always)]
    fn intersect(&self, user: u32, ray: &Ray) -> Option<(f32, Hit)> {
        let (tree, part, ray) = self.inside(user, ray);
        match tree.intersect_part(part, self.level, &ray, &TrianglesOnly)? {
            Closest::Triangle(hit) => Some((hit.t, hit)),
            Closest::User { .. } => None,
        }
    }

    #[inline(always)]
    fn occluded(&self, user: u32, ray: &Ray) -> bool {
        let (tree, part, ray) = self.inside(user, ray);
        tree.occluded_part(part, self.level, &ray, &TrianglesOnly)
    }

    fn precedes(&self, (a, hit): (u32, &Hit), (b, other): (u32, &Hit)) -> bool {
        let instance = |user: u32| self.placed[user as usize].instance;
        (instance(a), hit.primitive) < (instance(b), other.primitive)
    }

    // As in irradiant-core: rays that reach an instance together go on together.
    fn intersect_many(&self, user: u32, rays: &[Ray], hits: &mut [Option<(f32, Hit)>]) {
        let (tree, part, rays) = self.all_inside(user, rays);
        let mut found = [None; MANY];
        tree.intersect_part_batch(part, self.level, &rays[..hits.len()], &TrianglesOnly, &mut found[..hits.len()]);
        for (hit, found) in hits.iter_mut().zip(found) {
            *hit = match found {
                Some(Closest::Triangle(hit)) => Some((hit.t, hit)),
                _ => None,
            };
        }
    }

    fn occluded_many(&self, user: u32, rays: &[Ray], out: &mut [bool]) {
        let (tree, part, rays) = self.all_inside(user, rays);
        tree.occluded_part_batch(part, self.level, &rays[..out.len()], &TrianglesOnly, out);
    }
}

fn mesh_of(mesh: &crate::scene::Mesh) -> Mesh<'_> {
    Mesh { positions: &mesh.positions, triangles: &mesh.triangles, filtered: false }
}

impl<'a> Tree<'a> {
    /// Builds on the current pool of threads.
    pub fn build(geometry: &'a Geometry) -> Self {
        let settings = BuildSettings::default();
        let watch = Stopwatch::start();
        let over = |meshes: &[Mesh]| Bvh::build(&BuildInput { meshes, user_boxes: &[] }, &settings);
        let meshes: Vec<Mesh> = geometry.meshes.iter().map(mesh_of).collect();
        let (parts, placed, top) = if geometry.placements.is_empty() {
            (vec![over(&meshes)], vec![], None)
        } else {
            let parts: Vec<Bvh> = meshes.iter().map(|m| over(std::slice::from_ref(m))).collect();
            let place = |p: &Placement, bounds: &[V; 2]| bounds.map(|corner| add(p.origin, scale(corner, p.size)));
            // A box that is scaled and moved is rounded: an ulp or two of slack.
            let slack = |[lo, hi]: [V; 2]| {
                let pad = |x: f32, y: f32| 4.0 * f32::EPSILON * (x.abs() + y.abs());
                [std::array::from_fn(|i| lo[i] - pad(lo[i], hi[i])), std::array::from_fn(|i| hi[i] + pad(lo[i], hi[i]))]
            };
            let whole = |p: &Placement| slack(place(p, &parts[p.mesh].bounds().unwrap_or_default()));
            let boxes: Vec<[V; 2]> = geometry.placements.iter().map(whole).collect();
            let tree_of = |i: usize| Some(&parts[geometry.placements[i].mesh]);
            let braids = braid(&boxes, tree_of, |i, inside| slack(place(&geometry.placements[i], inside)));
            let placed = |b: &Braid| {
                let p = &geometry.placements[b.instance as usize];
                let (mesh, shrink) = (p.mesh as u32, 1.0 / p.size);
                Placed { mesh, part: b.part, origin: p.origin, shrink, instance: b.instance }
            };
            let placed = braids.iter().map(placed).collect();
            let boxes: Vec<[V; 2]> = braids.iter().map(|b| b.bounds).collect();
            let top = Bvh::build(&BuildInput { meshes: &[], user_boxes: &boxes }, &settings);
            (parts, placed, Some(top))
        };
        Self { geometry, parts, placed, top, level: Level::detect(), spent: watch.spent() }
    }

    /// Bytes of nodes and leaves, and of placements where there are any.
    pub fn memory_bytes(&self) -> usize {
        let trees: usize = self.parts.iter().chain(&self.top).map(Bvh::memory_bytes).sum();
        trees + size_of_val(&self.placed[..])
    }

    fn instances(&self) -> Instances<'_> {
        Instances { parts: &self.parts, placed: &self.placed, level: self.level }
    }

    /// Distance of the closest hit, and the triangle there.
    pub fn hit(&self, ray: &Ray) -> Option<(f32, [V; 3])> {
        let corners =
            |mesh: &crate::scene::Mesh, triangle: usize| mesh.triangles[triangle].map(|i| mesh.positions[i as usize]);
        let Some(top) = &self.top else {
            let Closest::Triangle(hit) = self.parts[0].intersect(self.level, ray, &TrianglesOnly)? else { return None };
            let mut index = hit.primitive as usize;
            for mesh in &self.geometry.meshes {
                match index.checked_sub(mesh.triangles.len()) {
                    Some(rest) => index = rest,
                    None => return Some((hit.t, corners(mesh, index))),
                }
            }
            return None;
        };
        let Closest::User { t, user, hit } = top.intersect(self.level, ray, &self.instances())? else { return None };
        // Instances are not turned, so that their triangles have the same normals.
        let mesh = &self.geometry.meshes[self.placed[user as usize].mesh as usize];
        Some((t, corners(mesh, hit.primitive as usize)))
    }

    /// Distances to what the rays meet first, infinite for none; one at a time.
    pub fn closest(&self, rays: &[Ray], out: &mut [f32]) {
        let distance = |t: Option<f32>| t.unwrap_or(f32::INFINITY);
        if let Some(top) = &self.top {
            let leaves = self.instances();
            let one = |ray| distance(top.intersect(self.level, ray, &leaves).map(|h| h.t()));
            rays.iter().zip(out).for_each(|(ray, out)| *out = one(ray));
        } else {
            let one = |ray| distance(self.parts[0].intersect(self.level, ray, &TrianglesOnly).map(|h| h.t()));
            rays.iter().zip(out).for_each(|(ray, out)| *out = one(ray));
        }
    }

    /// Whether the rays meet anything (1) or not (0), one at a time.
    pub fn occluded(&self, rays: &[Ray], out: &mut [f32]) {
        if let Some(top) = &self.top {
            let leaves = self.instances();
            let one = |ray| f32::from(top.occluded(self.level, ray, &leaves));
            rays.iter().zip(out).for_each(|(ray, out)| *out = one(ray));
        } else {
            let one = |ray| f32::from(self.parts[0].occluded(self.level, ray, &TrianglesOnly));
            rays.iter().zip(out).for_each(|(ray, out)| *out = one(ray));
        }
    }

    /// As [`Tree::closest`], in batches of 256.
    pub fn closest_batch(&self, rays: &[Ray], out: &mut [f32]) {
        let mut triangles = [None; 256];
        let mut users = [None; 256];
        let leaves = self.instances();
        for (rays, out) in rays.chunks(256).zip(out.chunks_mut(256)) {
            let n = rays.len();
            if let Some(top) = &self.top {
                top.intersect_batch(self.level, rays, &leaves, &mut users[..n]);
                let distance = |h: &Option<Closest<Hit>>| h.map_or(f32::INFINITY, |h| h.t());
                out.iter_mut().zip(&users).for_each(|(out, h)| *out = distance(h));
            } else {
                self.parts[0].intersect_batch(self.level, rays, &TrianglesOnly, &mut triangles[..n]);
                let distance = |h: &Option<Closest<()>>| h.map_or(f32::INFINITY, |h| h.t());
                out.iter_mut().zip(&triangles).for_each(|(out, h)| *out = distance(h));
            }
        }
    }

    /// As [`Tree::occluded`], in batches of 256.
    pub fn occluded_batch(&self, rays: &[Ray], out: &mut [f32]) {
        let mut any = [false; 256];
        let leaves = self.instances();
        for (rays, out) in rays.chunks(256).zip(out.chunks_mut(256)) {
            let any = &mut any[..rays.len()];
            match &self.top {
                Some(top) => top.occluded_batch(self.level, rays, &leaves, any),
                None => self.parts[0].occluded_batch(self.level, rays, &TrianglesOnly, any),
            }
            out.iter_mut().zip(any).for_each(|(out, any)| *out = f32::from(*any));
        }
    }
}
