//! From the description to [`Geometry`]: range checks, transforms, trees.

use super::accel::{Alpha, Group, MeshRange, MeshRanges, NO_EMITTER, ShapeInfo, Shapes, User};
use super::curve::Curve;
use super::cylinder::Cylinder;
use super::disk::Disk;
use super::emitter::{
    BilinearEmitter, CurveEmitter, CylinderEmitter, DiskEmitter, EmitterShape, RectangleEmitter, SphereEmitter,
    TriangleEmitter,
};
use super::instance::{Instance, Motion};
use super::placement::Placement;
use super::sphere::Sphere;
use super::triangle::{Dropped, Mesh};
use super::triangle_lanes::FlatTriangle;
use super::{Emitter, Geometry};
use crate::interaction::{LightId, MaterialId, ShapeId};
use irradiant_bvh as bvh;
use irradiant_math::{Affine, AnimatedTransform, Bounds3, Transform};
use irradiant_scene::desc::shape::{CurveData, CurveStyle};
use irradiant_scene::desc::{
    FloatParam, MaterialDesc, MaterialKind, MaterialRef, MeshData, MotionDesc, SceneDesc, ShapeDesc, ShapeKind,
};
use irradiant_scene::{Diagnostic, Diagnostics, Span, Spanned};

/// Curves may be split into at most 2^this pieces per segment.
const MAX_SPLIT_DEPTH: u32 = 10;

/// All shapes of a scene in render space, with their trees.
///
/// Shape ids count the scene's shapes in order, then those of each object. `material` says what a reference became.
/// Complaints, with their places, go to `diagnostics`; shapes with errors are left out, so the result is sound even when
/// it should not be used.
pub fn compile_geometry(
    desc: &SceneDesc,
    render_from_world: &Transform,
    material: impl Fn(MaterialRef) -> MaterialId,
    diagnostics: &mut Diagnostics,
) -> Geometry {
    let mut c = Compiler {
        shapes: Shapes::default(),
        groups: vec![None],
        emitters: Vec::new(),
        face_emitters: Vec::new(),
        material: &material,
        materials: &desc.materials,
        diagnostics,
    };
    let mut scene = Members::default();
    for shape in &desc.shapes {
        c.shape(shape, render_from_world, &mut scene, true);
    }
    let objects: Vec<Option<u32>> = desc
        .objects
        .iter()
        .map(|object| {
            let mut members = Members::default();
            for shape in &object.shapes {
                c.shape(shape, &Transform::IDENTITY, &mut members, false);
            }
            c.close(members)
        })
        .collect();
    for instance in &desc.instances {
        // The reader has checked the reference; an object in which nothing can be met needs no instance.
        if let Some(Some(group)) = objects.get(instance.object.0 as usize).copied() {
            c.instance(group, &instance.world_from_object, render_from_world, instance.span, &mut scene);
        }
    }
    let top = c.group(scene);
    c.groups[0] = Some(top);
    let Compiler { shapes, groups, emitters, face_emitters, .. } = c;
    let lights = face_emitters.iter().map(|&i| Some(LightId(i))).collect();
    let groups: Vec<Group> = groups.into_iter().flatten().collect();
    let flat_triangles = FlatTriangle::all(&shapes, &groups[0]);
    Geometry { level: bvh::Level::detect(), shapes, groups, flat_triangles, emitters, face_emitters, lights }
}

/// What will stand in one tree.
#[derive(Default)]
struct Members {
    meshes: Vec<u32>,
    users: Vec<User>,
    boxes: Vec<[[f32; 3]; 2]>,
}

impl Members {
    fn add(&mut self, user: User, bounds: Bounds3) {
        self.users.push(user);
        self.boxes.push([bounds.min.to_array(), bounds.max.to_array()]);
    }
}

struct Compiler<'a, F> {
    shapes: Shapes,
    groups: Vec<Option<Group>>,
    emitters: Vec<Emitter>,
    face_emitters: Vec<u32>,
    material: &'a F,
    materials: &'a [MaterialDesc],
    diagnostics: &'a mut Diagnostics,
}

impl<F: Fn(MaterialRef) -> MaterialId> Compiler<'_, F> {
    fn error(&mut self, code: &'static str, message: impl Into<String>, span: Span, help: &str) {
        let d = Diagnostic::error(code, message, span);
        self.diagnostics.push(if help.is_empty() { d } else { d.help(help) });
    }

    fn warning(&mut self, code: &'static str, message: impl Into<String>, span: Span) {
        self.diagnostics.push(Diagnostic::warning(code, message, span));
    }

    /// Adds a shape to a group; a moving one as an instance of a group of its own.
    fn shape(&mut self, desc: &ShapeDesc, outer: &Transform, members: &mut Members, in_scene: bool) {
        let id = self.shapes.infos.len() as u32;
        let alpha = self.alpha(desc.alpha.as_ref());
        self.shapes.infos.push(ShapeInfo {
            material: (self.material)(desc.material),
            alpha,
            first_emitter: NO_EMITTER,
        });
        let moving = desc.world_from_shape.is_animated();
        let emits = desc.area_light.is_some();
        if emits && (moving || !in_scene) {
            let what = if moving { "a moving shape" } else { "a shape of an object" };
            let message = format!("{what} does not emit: its area light is ignored, as pbrt does");
            self.warning("W0520", message, desc.area_light.as_ref().map_or(desc.span, |l| l.span));
        }
        let emits = emits && !moving && in_scene;
        if emits {
            self.shapes.infos[id as usize].first_emitter = self.face_emitters.len() as u32;
        }
        if !moving {
            let t = outer.compose(&desc.world_from_shape.start);
            self.members(desc, id, &t, members, emits);
            return;
        }
        let mut own = Members::default();
        self.members(desc, id, &Transform::IDENTITY, &mut own, false);
        if let Some(group) = self.close(own) {
            self.instance(group, &desc.world_from_shape, outer, desc.span, members);
        }
    }

    fn alpha(&mut self, alpha: Option<&Spanned<FloatParam>>) -> Alpha {
        match alpha.map(|a| (a.value, a.span)) {
            None => Alpha::Opaque,
            Some((FloatParam::Texture(t), _)) => Alpha::Texture(t),
            Some((FloatParam::Value(a), span)) => {
                if a.is_nan() {
                    self.error("E0508", "\"alpha\" is not a number", span, "alpha is an opacity between 0 and 1");
                }
                if a >= 1.0 { Alpha::Opaque } else { Alpha::Constant(a.max(0.0)) }
            }
        }
    }

    /// Adds the primitives of a shape under `t`.
    fn members(&mut self, desc: &ShapeDesc, id: u32, t: &Transform, members: &mut Members, emits: bool) {
        // What is nowhere cannot be met; it may emit all the same (pbrt's way to hide lights). An interface is no surface
        // but the boundary of a medium: without media nothing is there, and light passes to all sides, as in volpath.
        let interface =
            self.materials.get(desc.material.0 as usize).is_some_and(|m| matches!(m.kind, MaterialKind::Interface));
        let there = self.shapes.infos[id as usize].alpha != Alpha::Constant(0.0) && !interface;
        if !t.m.iter().flatten().all(|x| x.is_finite()) {
            return self.error("E0505", "the transform of this shape is not finite", desc.span, "");
        }
        match &desc.kind {
            ShapeKind::Mesh(data) => self.mesh(data, desc, id, t, members, emits, there),
            ShapeKind::Curve(data) => self.curve(data, desc, id, t, members, emits, there),
            ShapeKind::Sphere { radius, z_min, z_max, phi_max } => {
                let (Some(place), true) =
                    (self.place(desc, t), self.quadric(desc, *radius, *phi_max, &[*z_min, *z_max]))
                else {
                    return;
                };
                let sphere = Sphere::new(radius.value, *z_min, *z_max, phi_max.value, place);
                if sphere.z_min >= sphere.z_max {
                    return self.warning("W0503", "this sphere has no area: its z limits leave nothing", desc.span);
                }
                if emits {
                    self.emitter(id, 0, 1, EmitterShape::Sphere(Box::new(SphereEmitter::new(sphere.clone()))));
                }
                if there {
                    let user = User::Sphere { shape: id, sphere: self.shapes.spheres.len() as u32 };
                    members.add(user, sphere.bounds());
                    self.shapes.spheres.push(sphere);
                }
            }
            ShapeKind::Disk { height, radius, inner_radius, phi_max } => {
                let (Some(place), true) =
                    (self.place(desc, t), self.quadric(desc, *radius, *phi_max, &[*height, *inner_radius]))
                else {
                    return;
                };
                if *inner_radius >= radius.value {
                    return self.warning("W0503", "this disk has no area: its hole is as large as itself", desc.span);
                }
                let disk = Disk::new(*height, radius.value, inner_radius.max(0.0), phi_max.value, place);
                if emits {
                    self.emitter(id, 0, 1, EmitterShape::Disk(Box::new(DiskEmitter::new(disk.clone()))));
                }
                if there {
                    members.add(User::Disk { shape: id, disk: self.shapes.disks.len() as u32 }, disk.bounds());
                    self.shapes.disks.push(disk);
                }
            }
            ShapeKind::Cylinder { radius, z_min, z_max, phi_max } => {
                let (Some(place), true) =
                    (self.place(desc, t), self.quadric(desc, *radius, *phi_max, &[*z_min, *z_max]))
                else {
                    return;
                };
                if z_min == z_max {
                    return self.warning("W0503", "this cylinder has no area: its z limits are equal", desc.span);
                }
                let cylinder = Cylinder::new(radius.value, *z_min, *z_max, phi_max.value, place);
                if emits {
                    self.emitter(id, 0, 1, EmitterShape::Cylinder(Box::new(CylinderEmitter::new(cylinder.clone()))));
                }
                if there {
                    let user = User::Cylinder { shape: id, cylinder: self.shapes.cylinders.len() as u32 };
                    members.add(user, cylinder.bounds());
                    self.shapes.cylinders.push(cylinder);
                }
            }
        }
    }

    fn place(&mut self, desc: &ShapeDesc, t: &Transform) -> Option<Placement> {
        let place = Placement::new(t, desc.reverse_orientation);
        if place.is_none() {
            let help = "a scale of zero flattens the shape to nothing; a perspective matrix is no place for a shape";
            self.error("E0505", "the transform of this shape is singular or has perspective", desc.span, help);
        }
        place
    }

    /// Range checks that quadrics share.
    fn quadric(&mut self, desc: &ShapeDesc, radius: Spanned<f32>, phi_max: Spanned<f32>, others: &[f32]) -> bool {
        let mut sound = true;
        if !(radius.value > 0.0 && radius.value.is_finite()) {
            let message = format!("\"radius\" {} is not a positive number", radius.value);
            self.error("E0501", message, radius.span, "");
            sound = false;
        }
        if !(phi_max.value > 0.0) {
            let message = format!("\"phimax\" {} leaves nothing of the shape", phi_max.value);
            self.error("E0502", message, phi_max.span, "phimax is a sweep in degrees, above 0 and at most 360");
            sound = false;
        }
        if sound && others.iter().any(|x| x.is_nan()) {
            self.error("E0503", "a limit of this shape is not a number", desc.span, "");
            sound = false;
        }
        sound
    }

    fn mesh(
        &mut self,
        data: &MeshData,
        desc: &ShapeDesc,
        id: u32,
        t: &Transform,
        members: &mut Members,
        emits: bool,
        there: bool,
    ) {
        let (mesh, dropped) = Mesh::new(data, t, desc.reverse_orientation);
        let total = data.triangles.len() + data.quads.len();
        let Dropped { not_finite, degenerate } = dropped;
        if not_finite > 0 {
            let message = format!("{not_finite} of {total} faces dropped: not finite");
            self.warning("W0510", message, desc.span);
        }
        if degenerate == total && total > 0 {
            self.warning("W0511", format!("all {total} faces dropped: no area"), desc.span);
        }
        let index = self.shapes.meshes.len() as u32;
        if emits {
            self.mesh_emitters(&mesh, id);
        }
        if there {
            if !mesh.triangles.is_empty() {
                members.meshes.push(index);
            }
            for quad in 0..mesh.quads.len() as u32 {
                let b = Bounds3::from_points(mesh.quads[quad as usize].map(|i| mesh.position(i)));
                // Points inside are rounded; a step outwards on all sides holds them.
                let b = super::placement::outward(b.min.to_array().map(f64::from), b.max.to_array().map(f64::from));
                members.add(User::Patch { mesh: index, quad }, b);
            }
            self.shapes.meshes.push(mesh);
            self.shapes.mesh_shapes.push(id);
        }
    }

    fn mesh_emitters(&mut self, mesh: &Mesh, id: u32) {
        let has_normals = !mesh.normals.is_empty();
        let triangle = |i: usize| {
            let f = mesh.triangles[i];
            let normals = has_normals.then(|| f.map(|v| mesh.normal(v)));
            TriangleEmitter::new(f.map(|v| mesh.position(v)), mesh.triangle_uvs(i as u32), normals, mesh.flip)
        };
        // An opacity texture may depend on the face, so there each face remains a light.
        let may_join = !matches!(self.shapes.infos[id as usize].alpha, Alpha::Texture(_));
        let mut i = 0;
        while i < mesh.triangles.len() {
            let e = triangle(i);
            let next = (may_join && i + 1 < mesh.triangles.len()).then(|| triangle(i + 1));
            match next.and_then(|next| RectangleEmitter::of_triangles(&e, &next)) {
                Some(r) => {
                    self.emitter(id, i as u32, 2, EmitterShape::Rectangle(Box::new(r)));
                    i += 2;
                }
                None => {
                    self.emitter(id, i as u32, 1, EmitterShape::Triangle(Box::new(e)));
                    i += 1;
                }
            }
        }
        for (i, f) in mesh.quads.iter().enumerate() {
            let p = f.map(|v| mesh.position(v));
            let normals = has_normals.then(|| f.map(|v| mesh.normal(v)));
            let uvs = (!mesh.uvs.is_empty()).then(|| f.map(|v| mesh.uvs[v as usize]));
            let e = BilinearEmitter::new(p, uvs, normals, mesh.flip);
            self.emitter(id, (mesh.triangles.len() + i) as u32, 1, EmitterShape::Bilinear(Box::new(e)));
        }
    }

    fn curve(
        &mut self,
        data: &CurveData,
        desc: &ShapeDesc,
        id: u32,
        t: &Transform,
        members: &mut Members,
        emits: bool,
        there: bool,
    ) {
        let width_is_sound = |w: f32| w >= 0.0 && w.is_finite();
        if !(width_is_sound(data.width0) && width_is_sound(data.width1)) {
            let message = format!("the widths {} and {} of this curve must be numbers >= 0", data.width0, data.width1);
            return self.error("E0506", message, desc.span, "");
        }
        if data.split_depth > MAX_SPLIT_DEPTH {
            let message = format!("\"splitdepth\" {} is above {MAX_SPLIT_DEPTH}", data.split_depth);
            return self.error("E0507", message, desc.span, "3 is the default; each step doubles the memory");
        }
        if data.style == CurveStyle::Ribbon && data.normals.len() != data.segments.len() + 1 {
            let (have, want) = (data.normals.len(), data.segments.len() + 1);
            return self.error("E0509", format!("this ribbon has {have} normals and needs {want}"), desc.span, "");
        }
        if !data.segments.iter().flatten().flatten().all(|x| x.is_finite()) {
            return self.warning("W0510", "curve dropped: a control point is not finite", desc.span);
        }
        let Some(curve) = Curve::new(data, t, desc.reverse_orientation) else {
            self.place(desc, t);
            return;
        };
        let index = self.shapes.curves.len() as u32;
        for piece in 0..curve.n_pieces() as u32 {
            let bounds = curve.piece_bounds(piece);
            if emits {
                let e = CurveEmitter { bounds, area: curve.piece_area(piece) };
                self.emitter(id, piece, 1, EmitterShape::Curve(e));
            }
            if there {
                members.add(User::Curve { shape: id, curve: index, piece }, bounds);
            }
        }
        self.shapes.curves.push(curve);
    }

    fn emitter(&mut self, id: u32, face: u32, faces: u32, geometry: EmitterShape) {
        let alpha = self.shapes.infos[id as usize].alpha;
        self.face_emitters.extend((0..faces).map(|_| self.emitters.len() as u32));
        self.emitters.push(Emitter { shape: ShapeId(id), face, faces, alpha, geometry });
    }

    /// Adds an instance of a group to another.
    fn instance(&mut self, group: u32, motion: &MotionDesc, outer: &Transform, span: Span, members: &mut Members) {
        let start = outer.compose(&motion.start);
        let placed = if motion.is_animated() {
            let end = outer.compose(&motion.end);
            AnimatedTransform::new(start, end, motion.start_time as f32, motion.end_time as f32)
                .map(|t| Motion::Moving(Box::new(t)))
        } else {
            Affine::from_transform(&start).map(Motion::Still)
        };
        let Some(motion) = placed else {
            let help = "a scale of zero flattens the shape to nothing; a perspective matrix is no place for a shape";
            return self.error("E0505", "the transform of this instance is singular or has perspective", span, help);
        };
        let Some([min, max]) = self.groups[group as usize].as_ref().and_then(|g| g.tree.bounds()) else { return };
        let bounds = motion.bounds(&Bounds3 { min: min.into(), max: max.into() });
        let index = self.shapes.instances.len() as u32;
        self.shapes.instances.push(Instance { group, motion });
        members.add(User::Instance { instance: index, part: bvh::Part::ALL }, bounds);
    }

    /// Builds the tree of an object or moving shape; `None` when nothing in it can be met.
    fn close(&mut self, members: Members) -> Option<u32> {
        if members.meshes.is_empty() && members.users.is_empty() {
            return None;
        }
        let group = self.group(members);
        self.groups.push(Some(group));
        Some(self.groups.len() as u32 - 1)
    }

    /// Instances that hold many others become their parts.
    fn braided(&self, members: Members) -> Members {
        let instance = |i: usize| match members.users[i] {
            User::Instance { instance, .. } => Some((instance, &self.shapes.instances[instance as usize])),
            _ => None,
        };
        let tree_of = |i: usize| match instance(i)? {
            (_, Instance { group, motion: Motion::Still(_) }) => {
                self.groups[*group as usize].as_ref().filter(|g| g.users.is_empty()).map(|g| &g.tree)
            }
            _ => None,
        };
        let outside = |i: usize, [min, max]: &[[f32; 3]; 2]| {
            let inside = Bounds3 { min: (*min).into(), max: (*max).into() };
            let bounds = instance(i).map_or(inside, |(_, placed)| placed.motion.bounds(&inside));
            [bounds.min.to_array(), bounds.max.to_array()]
        };
        let braids = bvh::braid(&members.boxes, tree_of, outside);
        let user = |b: &bvh::Braid| match instance(b.instance as usize) {
            Some((instance, _)) => User::Instance { instance, part: b.part },
            None => members.users[b.instance as usize],
        };
        let (users, boxes) = (braids.iter().map(user).collect(), braids.iter().map(|b| b.bounds).collect());
        Members { meshes: members.meshes, users, boxes }
    }

    fn group(&mut self, members: Members) -> Group {
        let members = self.braided(members);
        let mut first = 0;
        let mut ranges = Vec::with_capacity(members.meshes.len());
        let mut meshes = Vec::with_capacity(members.meshes.len());
        for &mesh in &members.meshes {
            let m = &self.shapes.meshes[mesh as usize];
            let shape = self.shapes.mesh_shapes[mesh as usize];
            let filtered = self.shapes.infos[shape as usize].alpha != Alpha::Opaque;
            ranges.push(MeshRange { first, mesh });
            meshes.push(bvh::Mesh { positions: &m.positions, triangles: &m.triangles, filtered });
            first += m.triangles.len() as u32;
        }
        let input = bvh::BuildInput { meshes: &meshes, user_boxes: &members.boxes };
        let tree = bvh::Bvh::build(&input, &bvh::BuildSettings::default());
        Group { tree, ranges: MeshRanges::new(ranges, first), users: members.users }
    }
}
