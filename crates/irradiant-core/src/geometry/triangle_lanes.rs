//! What hits of many flat triangles look like, side by side.

use super::accel::{Group, NO_EMITTER, Shapes};
use super::triangle::{Mesh, normal_and_length, triangle_point};
use super::{Geometry, Hit, HitOf, Level, NO_INSTANCE};
use crate::interaction::{Interaction, LightId, MaterialId, ReferencePoint};
use irradiant_math::lanes::{Floats, LANES, Triples, whole};
use irradiant_math::{Frame, Point2, Vec3};

/// Triangles without normals, tangents or texture coordinates of their own, and where on them.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct TriangleLanes {
    corners: [Triples; 3],
    u: Floats,
    v: Floats,
    /// 1 where the winding says the opposite of what is outside.
    flip: [u32; LANES],
}

/// Surface points with their shading frames, side by side.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct SurfaceLanes {
    /// Towards where the rays came from, unit.
    pub wo: Triples,
    /// The points.
    pub p: Triples,
    /// Bounds of their errors.
    pub p_error: Triples,
    /// Geometric normals, unit.
    pub n: Triples,
    /// Shading normals, unit.
    pub ns: Triples,
    /// First tangents of the shading frames.
    pub x: Triples,
    /// Second ones.
    pub y: Triples,
    /// Their normal directions.
    pub z: Triples,
}

impl SurfaceLanes {
    /// All zero.
    pub const ZERO: Self = Self {
        wo: Triples::ZERO,
        p: Triples::ZERO,
        p_error: Triples::ZERO,
        n: Triples::ZERO,
        ns: Triples::ZERO,
        x: Triples::ZERO,
        y: Triples::ZERO,
        z: Triples::ZERO,
    };

    /// A lane as lights see it.
    #[inline(always)]
    pub fn reference(&self, i: usize) -> ReferencePoint {
        ReferencePoint {
            p: self.p.point(i),
            p_error: self.p_error.vector(i),
            n: self.n.normal(i),
            ns: self.ns.normal(i),
        }
    }

    /// Sets a lane to a surface that was found alone, and its shading frame.
    pub fn set(&mut self, i: usize, at: &Interaction, frame: &Frame) {
        self.wo.set(i, at.wo.to_array());
        self.p.set(i, at.p.to_array());
        self.p_error.set(i, at.p_error.to_array());
        self.n.set(i, at.n.to_array());
        self.ns.set(i, at.ns.to_array());
        self.x.set(i, frame.x.to_array());
        self.y.set(i, frame.y.to_array());
        self.z.set(i, frame.z.to_array());
    }

    /// The shading frame of a lane.
    #[inline(always)]
    pub fn frame(&self, i: usize) -> Frame {
        Frame { x: self.x.vector(i), y: self.y.vector(i), z: self.z.vector(i) }
    }
}

impl TriangleLanes {
    /// Of nothing yet.
    pub const NONE: Self = Self { corners: [Triples::ZERO; 3], u: [0.0; LANES], v: [0.0; LANES], flip: [0; LANES] };

    /// The surface parameters of a lane.
    #[inline]
    pub fn uv(&self, i: usize) -> Point2 {
        Point2::new(self.u[i] + self.v[i], self.v[i])
    }

    /// For `n` lanes what [`Geometry::interaction`] and [`Materials::bsdf`](crate::material::Materials::bsdf) say, to the bit.
    #[inline(always)]
    pub fn surfaces(&self, n: usize, directions: &Triples, out: &mut SurfaceLanes) {
        let [c0, c1, c2] = &self.corners;
        for i in whole(n) {
            let (p0, p1, p2) = (c0.point(i), c1.point(i), c2.point(i));
            let (p, p_error) = triangle_point([p0, p1, p2], self.u[i], self.v[i]);
            let (n, length) = normal_and_length(p0 - p2, p1 - p2);
            let around = Frame::from_z(-n.as_vec()).x;
            let along = p1 - p0;
            let is_flat = !(length > 1e-18);
            let choose = |a: f32, b: f32| if is_flat { a } else { b };
            let dpdu = Vec3::new(choose(around.x, along.x), choose(around.y, along.y), choose(around.z, along.z));
            let turn = |x: f32| if self.flip[i] != 0 { -x } else { x };
            let z = Vec3::new(turn(n.x), turn(n.y), turn(n.z));
            let frame = Frame::from_z_near_x(z, dpdu);
            out.wo.set(i, (-directions.vector(i).normalize()).to_array());
            out.p.set(i, p.to_array());
            out.p_error.set(i, p_error.to_array());
            out.n.set(i, z.to_array());
            out.ns.set(i, z.to_array());
            out.z.set(i, z.to_array());
            out.x.set(i, frame.x.to_array());
            out.y.set(i, frame.y.to_array());
        }
    }
}

impl Geometry {
    /// Which instructions rays are traced with, and other work may be done with.
    #[inline]
    pub fn level(&self) -> Level {
        self.level
    }

    /// Asks for the memory that [`Geometry::flat_triangle`] reads of a hit.
    #[inline(always)]
    pub fn prefetch_flat_triangle(&self, hit: &Hit) {
        if let Some(flat) = self.flat_triangles.get(hit.primitive as usize) {
            irradiant_bvh::prefetch_whole(flat);
        }
    }

    /// Puts a hit into a lane, if it is of a plain flat triangle; what it is made of and its light.
    #[inline(always)]
    pub fn flat_triangle(
        &self,
        hit: &Hit,
        lanes: &mut TriangleLanes,
        i: usize,
    ) -> Option<(MaterialId, Option<LightId>)> {
        if hit.of == HitOf::User || hit.instances[0] != NO_INSTANCE {
            return None;
        }
        match self.flat_triangles.get(hit.primitive as usize) {
            Some(flat) => Some(self.put(flat.as_ref()?, hit, lanes, i)),
            None => self.far_triangle(hit, lanes, i),
        }
    }

    #[inline(always)]
    fn put(
        &self,
        flat: &FlatTriangle,
        hit: &Hit,
        lanes: &mut TriangleLanes,
        i: usize,
    ) -> (MaterialId, Option<LightId>) {
        (0..3).for_each(|k| lanes.corners[k].set(i, flat.corners[k]));
        (lanes.u[i], lanes.v[i], lanes.flip[i]) = (hit.u, hit.v, u32::from(flat.flip));
        let light = match flat.emitter {
            NO_EMITTER => None,
            emitter => self.lights[emitter as usize],
        };
        (flat.material, light)
    }

    /// The same of one of many triangles.
    #[inline(never)]
    fn far_triangle(&self, hit: &Hit, lanes: &mut TriangleLanes, i: usize) -> Option<(MaterialId, Option<LightId>)> {
        let (mesh, triangle) = self.groups[0].triangle(hit.primitive);
        Some(self.put(&FlatTriangle::of(&self.shapes, mesh, triangle)?, hit, lanes, i))
    }
}

/// A triangle without normals, tangents or texture coordinates of its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct FlatTriangle {
    corners: [[f32; 3]; 3],
    flip: bool,
    material: MaterialId,
    /// Index among faces that emit, or [`NO_EMITTER`].
    emitter: u32,
}

const _: () = assert!(size_of::<Option<FlatTriangle>>() == 48);

#[inline(always)]
fn is_flat(mesh: &Mesh) -> bool {
    mesh.normals.is_empty() && mesh.tangents.is_empty() && mesh.uvs.is_empty()
}

impl FlatTriangle {
    /// So many are put together beforehand, 48 bytes each, so that a hit waits for memory once, and that has been asked for
    /// ([`Geometry::prefetch_flat_triangle`]), instead of for indices and then for corners. Share of the time: the Cornell box 0.98; a street of
    /// 250,000 0.91 by paths, 0.96 by shared paths.
    const MOST: usize = 1 << 20;
    /// So many that are not flat may have an empty place among them; more only where as many are flat.
    const EMPTY: usize = 1 << 16;

    #[inline(always)]
    fn of(shapes: &Shapes, mesh_index: u32, triangle: u32) -> Option<Self> {
        let mesh = &shapes.meshes[mesh_index as usize];
        if !is_flat(mesh) {
            return None;
        }
        let [a, b, c] = mesh.triangles[triangle as usize];
        let corners = [mesh.positions[a as usize], mesh.positions[b as usize], mesh.positions[c as usize]];
        let info = &shapes.infos[shapes.mesh_shapes[mesh_index as usize] as usize];
        let emitter = match info.first_emitter {
            NO_EMITTER => NO_EMITTER,
            first => first + triangle,
        };
        Some(Self { corners, flip: mesh.flip, material: info.material, emitter })
    }

    /// Those of the tree of the scene itself, by primitive; none where they are many, or where too many places would be empty.
    pub(super) fn all(shapes: &Shapes, group: &Group) -> Vec<Option<Self>> {
        let meshes = || group.ranges.iter().map(|range| (range.mesh, &shapes.meshes[range.mesh as usize]));
        let all: usize = meshes().map(|(_, mesh)| mesh.triangles.len()).sum();
        let flat: usize = meshes().filter(|(_, mesh)| is_flat(mesh)).map(|(_, mesh)| mesh.triangles.len()).sum();
        if flat == 0 || all > Self::MOST || all - flat > flat.max(Self::EMPTY) {
            return Vec::new();
        }
        let all: Vec<_> = meshes()
            .flat_map(|(mesh, of)| (0..of.triangles.len() as u32).map(move |i| Self::of(shapes, mesh, i)))
            .collect();
        irradiant_bvh::move_to_large_pages(&all);
        all
    }
}
