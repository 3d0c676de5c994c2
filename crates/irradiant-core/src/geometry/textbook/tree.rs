//! A plain tree of boxes over triangles and quadrics in one precision.

use super::number::{Number, Triple, cross, dot, school_roots, sub};
use super::{Met, Question};
use crate::geometry::accel::{GroupLeaves, User};
use crate::geometry::instance::Motion;
use crate::geometry::{Alpha, AlphaTextures, Geometry, Hit, HitOf, NO_INSTANCE};
use irradiant_bvh as bvh;
use irradiant_bvh::Leaves;
use irradiant_math::Bounds3;

/// A primitive and how the scene's geometry names it.
#[derive(Clone, Debug)]
struct Primitive<T> {
    form: Form<T>,
    hit: Hit,
}

#[derive(Clone, Debug)]
enum Form<T> {
    /// One vertex and two edges would be less to compute; three vertices are what the formula is written for.
    Triangle { p: [Triple<T>; 3], is_opaque: bool },
    /// A sphere or an open cylinder of its own space.
    Quadric(User),
    /// Asked of the scene's geometry.
    Other(u32),
}

#[derive(Clone, Debug)]
struct Node<T> {
    min: Triple<T>,
    max: Triple<T>,
    /// First primitive of a leaf, or the second child; the first child comes next.
    index: u32,
    /// Primitives of a leaf; 0 for inner nodes.
    count: u32,
}

/// The tree.
#[derive(Debug)]
pub(crate) struct Tree<T> {
    nodes: Vec<Node<T>>,
    primitives: Vec<Primitive<T>>,
}

const LEAF: usize = 4;

impl<T: Number> Tree<T> {
    pub fn new(geometry: &Geometry) -> Self {
        let mut found: Vec<(Primitive<T>, Bounds3)> = Vec::new();
        gather(geometry, 0, None, &mut found);
        let mut tree = Self { nodes: Vec::new(), primitives: Vec::new() };
        if !found.is_empty() {
            let mut order: Vec<u32> = (0..found.len() as u32).collect();
            tree.build(&found, &mut order);
        }
        tree
    }

    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.primitives[..])
    }

    /// Splits at the median along the longest side of the centres' box.
    fn build(&mut self, found: &[(Primitive<T>, Bounds3)], order: &mut [u32]) {
        let bounds = order.iter().fold(Bounds3::EMPTY, |b, &i| b.union(found[i as usize].1));
        let centers = Bounds3::from_points(order.iter().map(|&i| found[i as usize].1.center()));
        let node = self.nodes.len();
        let corner = |p: irradiant_math::Point3| p.to_array().map(|c| T::of(f64::from(c)));
        self.nodes.push(Node { min: corner(bounds.min), max: corner(bounds.max), index: 0, count: 0 });
        if order.len() <= LEAF {
            self.nodes[node].index = self.primitives.len() as u32;
            self.nodes[node].count = order.len() as u32;
            self.primitives.extend(order.iter().map(|&i| found[i as usize].0.clone()));
            return;
        }
        let d = centers.diagonal().to_array();
        let axis = (0..3).max_by(|&a, &b| d[a].total_cmp(&d[b])).unwrap_or(0);
        let middle = order.len() / 2;
        let key = |&i: &u32| found[i as usize].1.center().to_array()[axis];
        order.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
        let (left, right) = order.split_at_mut(middle);
        self.build(found, left);
        self.nodes[node].index = self.nodes.len() as u32;
        self.build(found, right);
    }

    /// The closest primitive with t_min < t < t_max that is not to be skipped.
    pub fn closest<A: AlphaTextures>(&self, geometry: &Geometry, q: &Question, alpha: &A) -> Option<Met> {
        let o = q.o.map(T::of);
        let d = q.d.map(T::of);
        let mut best: Option<Met> = None;
        let mut nearest = T::of(q.t_max);
        let mut stack = vec![0u32];
        while let Some(index) = stack.pop() {
            let Some(node) = self.nodes.get(index as usize) else { break };
            if !meets_box(node, o, d, nearest) {
                continue;
            }
            if node.count == 0 {
                stack.extend([node.index, index + 1]);
                continue;
            }
            for primitive in node.index..node.index + node.count {
                if q.skip == Some(primitive) {
                    continue;
                }
                if let Some(met) = self.meet(geometry, primitive, o, d, q, nearest, alpha) {
                    nearest = T::of(met.t);
                    best = Some(met);
                }
            }
        }
        best
    }

    fn meet<A: AlphaTextures>(
        &self,
        geometry: &Geometry,
        primitive: u32,
        o: Triple<T>,
        d: Triple<T>,
        q: &Question,
        nearest: T,
        alpha: &A,
    ) -> Option<Met> {
        let p = &self.primitives[primitive as usize];
        let t_min = T::of(q.t_min);
        let group = &geometry.groups[0];
        let leaves = GroupLeaves { geometry, group, alpha };
        let ray = || bvh::Ray {
            o: q.o.map(|c| c as f32),
            t_max: nearest.wide() as f32,
            d: q.d.map(|c| c as f32),
            time: q.time,
        };
        match &p.form {
            Form::Triangle { p: corners, is_opaque } => {
                let [t, u, v] = triangle(o, d, corners)?;
                let within = t > t_min && t < nearest;
                if !within {
                    return None;
                }
                let (t, u, v) = (t.wide(), u.wide() as f32, v.wide() as f32);
                let there = *is_opaque || leaves.accept(p.hit.primitive, &ray(), t as f32, u, v);
                let hit = Hit { t: t as f32, u, v, ..p.hit };
                there.then_some(Met { t, primitive, is_flat: true, hit })
            }
            Form::Quadric(user) => {
                let (roots, kept) = quadric::<T>(geometry, user, o, d)?;
                let root = (0..2).find(|&i| kept[i] && roots[i] > t_min && roots[i] < nearest)?;
                let t = roots[root].wide();
                let hit = Hit { t: t as f32, u: root as f32, v: 0.0, ..p.hit };
                Some(Met { t, primitive, is_flat: false, hit })
            }
            Form::Other(user) => {
                let (t, hit) = leaves.intersect(*user, &ray())?;
                let beyond = f64::from(t) > q.t_min;
                beyond.then_some(Met { t: f64::from(t), primitive, is_flat: false, hit })
            }
        }
    }
}

/// Möller and Trumbore 1997: t and the weights of corners 1 and 2.
fn triangle<T: Number>(o: Triple<T>, d: Triple<T>, p: &[Triple<T>; 3]) -> Option<Triple<T>> {
    let (zero, one) = (T::of(0.0), T::of(1.0));
    let (e1, e2) = (sub(p[1], p[0]), sub(p[2], p[0]));
    let s = cross(d, e2);
    let determinant = dot(e1, s);
    if determinant == zero {
        return None;
    }
    let inverse = one / determinant;
    let from = sub(o, p[0]);
    let u = dot(from, s) * inverse;
    let r = cross(from, e1);
    let v = dot(d, r) * inverse;
    let inside = u >= zero && v >= zero && u + v <= one;
    inside.then(|| [dot(e2, r) * inverse, u, v])
}

/// Roots on a sphere or a cylinder by the formula from school, in its own space, and which of them are not cut off.
fn quadric<T: Number>(geometry: &Geometry, user: &User, o: Triple<T>, d: Triple<T>) -> Option<([T; 2], [bool; 2])> {
    let shapes = &geometry.shapes;
    let local = |placement: &crate::geometry::placement::Placement| {
        // The map is part of the arithmetic: each result is rounded.
        let point = placement.point_to_shape(o.map(T::wide)).map(T::of);
        let origin = placement.point_to_shape([0.0; 3]);
        let tip = placement.point_to_shape(d.map(T::wide));
        (point, [0, 1, 2].map(|i| T::of(tip[i] - origin[i])))
    };
    let two = T::of(2.0);
    match user {
        User::Sphere { sphere, .. } => {
            let s = &shapes.spheres[*sphere as usize];
            let (o, d) = local(&s.placement);
            let r = T::of(s.radius);
            let roots = school_roots(dot(d, d), two * dot(o, d), dot(o, o) - r * r)?;
            let kept = roots.map(|t| s.point(o.map(T::wide), d.map(T::wide), t.wide()).is_some());
            Some((roots, kept))
        }
        User::Cylinder { cylinder, .. } => {
            let c = &shapes.cylinders[*cylinder as usize];
            let (o, d) = local(&c.placement);
            let r = T::of(c.radius);
            let flat = |a: Triple<T>, b: Triple<T>| a[0] * b[0] + a[1] * b[1];
            let roots = school_roots(flat(d, d), two * flat(o, d), flat(o, o) - r * r)?;
            let kept = roots.map(|t| c.point(o.map(T::wide), d.map(T::wide), t.wide()).is_some());
            Some((roots, kept))
        }
        User::Disk { .. } | User::Patch { .. } | User::Curve { .. } | User::Instance { .. } => None,
    }
}

fn meets_box<T: Number>(node: &Node<T>, o: Triple<T>, d: Triple<T>, nearest: T) -> bool {
    // A little wider than they are: what counts here is the primitives' own arithmetic.
    let (mut enter, mut leave) = (0.0, nearest.wide());
    for i in 0..3 {
        let inverse = 1.0 / d[i].wide();
        let (a, b) = (node.min[i].wide() - o[i].wide(), node.max[i].wide() - o[i].wide());
        let slack = 1e-5 * (a.abs().max(b.abs()) + o[i].wide().abs());
        let (near, far) = ((a - slack) * inverse, (b + slack) * inverse);
        let (near, far) = if inverse < 0.0 { ((b + slack) * inverse, (a - slack) * inverse) } else { (near, far) };
        // NaN (a ray in the plane of a side) keeps what was known.
        enter = near.max(enter);
        leave = far.min(leave);
    }
    enter <= leave
}

/// The primitives of a group, as seen through instance `through`.
fn gather<T: Number>(geometry: &Geometry, group: u32, through: Option<u32>, found: &mut Vec<(Primitive<T>, Bounds3)>) {
    let shapes = &geometry.shapes;
    let group = &geometry.groups[group as usize];
    let affine = through.and_then(|i| match &shapes.instances[i as usize].motion {
        Motion::Still(affine) => Some(*affine),
        Motion::Moving(_) => None,
    });
    for range in group.ranges.iter() {
        let mesh = &shapes.meshes[range.mesh as usize];
        let info = &shapes.infos[shapes.mesh_shapes[range.mesh as usize] as usize];
        // Alpha inside of instances is asked in another space.
        let is_opaque = info.alpha == Alpha::Opaque || through.is_some();
        for (i, corners) in mesh.triangles.iter().enumerate() {
            let outside = corners.map(|c| {
                let p = mesh.position(c);
                affine.map_or(p, |a| a.point(p))
            });
            let hit = Hit {
                t: 0.0,
                u: 0.0,
                v: 0.0,
                primitive: range.first + i as u32,
                of: HitOf::Triangle,
                instances: [through.unwrap_or(NO_INSTANCE), NO_INSTANCE],
            };
            let p = outside.map(|p| p.to_array().map(|c| T::of(f64::from(c))));
            found.push((Primitive { form: Form::Triangle { p, is_opaque }, hit }, Bounds3::from_points(outside)));
        }
    }
    for (i, user) in group.users.iter().enumerate() {
        let hit = Hit { t: 0.0, u: 0.0, v: 0.0, primitive: i as u32, of: HitOf::User, instances: [NO_INSTANCE; 2] };
        let opaque = |shape: u32| shapes.infos[shape as usize].alpha == Alpha::Opaque;
        let mut add = |form, bounds| found.push((Primitive { form, hit }, bounds));
        match *user {
            User::Sphere { shape, sphere } if opaque(shape) => {
                add(Form::Quadric(*user), shapes.spheres[sphere as usize].bounds());
            }
            User::Cylinder { shape, cylinder } if opaque(shape) => {
                add(Form::Quadric(*user), shapes.cylinders[cylinder as usize].bounds());
            }
            User::Instance { .. } if !group.begins(i) => {}
            User::Instance { instance, .. } => {
                let placed = &shapes.instances[instance as usize];
                let inner = &geometry.groups[placed.group as usize];
                let still = matches!(placed.motion, Motion::Still(_));
                if still && inner.users.is_empty() && is_all_opaque(geometry, inner) {
                    gather(geometry, placed.group, Some(instance), found);
                } else if let Some([min, max]) = inner.tree.bounds() {
                    let bounds = Bounds3 { min: min.into(), max: max.into() };
                    add(Form::Other(i as u32), placed.motion.bounds(&bounds));
                }
            }
            User::Sphere { sphere, .. } => add(Form::Other(i as u32), shapes.spheres[sphere as usize].bounds()),
            User::Cylinder { cylinder, .. } => add(Form::Other(i as u32), shapes.cylinders[cylinder as usize].bounds()),
            User::Disk { disk, .. } => add(Form::Other(i as u32), shapes.disks[disk as usize].bounds()),
            User::Curve { curve, piece, .. } => {
                add(Form::Other(i as u32), shapes.curves[curve as usize].piece_bounds(piece));
            }
            User::Patch { mesh, quad } => {
                let mesh = &shapes.meshes[mesh as usize];
                let corners = mesh.quads[quad as usize].map(|c| mesh.position(c));
                add(Form::Other(i as u32), Bounds3::from_points(corners));
            }
        }
    }
}

fn is_all_opaque(geometry: &Geometry, group: &crate::geometry::accel::Group) -> bool {
    let shapes = &geometry.shapes;
    let opaque = |mesh: u32| shapes.infos[shapes.mesh_shapes[mesh as usize] as usize].alpha == Alpha::Opaque;
    group.ranges.iter().all(|r| opaque(r.mesh))
}
