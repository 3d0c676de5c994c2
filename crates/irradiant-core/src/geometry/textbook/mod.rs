//! Intersection as a textbook writes it, in single or double precision, with the lectures' remedies against rays that meet
//! the surface they leave (A63 to A68). For teaching: biased or slow, each in its own way; [`Geometry`] is neither.
//!
//! A [`Textbook`] is a copy of the scene's triangles and quadrics in the precision asked for, with a plain tree of boxes
//! over it: Möller and Trumbore's triangle test, the quadratic formula from school, hit points at o + t d. What it does not
//! copy (patches, curves, instances that move or hold quadrics) it asks of the scene's geometry.
//!
//! Files: this one (remedies, what rays ask), `number` (the two precisions), `tree`, [`far_circle`] (the lecture's
//! example in numbers).

pub mod far_circle;
mod number;
mod tree;

use super::{AlphaTextures, Geometry, Hit};
use crate::interaction::Interaction;
use crate::light::LightTarget;
use irradiant_math::{Point3, Ray, Vec3};
use tree::Tree;

/// What is done against meeting the surface that a ray leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Remedy {
    /// Nothing, in single precision: the ray starts at o + t d.
    Nothing,
    /// Hits nearer than this do not count, in scene units along the ray (A67).
    FixedOffset(f32),
    /// The primitive that the ray leaves does not count, if it is flat (A66).
    SkipLast,
    /// The ray starts at the hit put back on its surface, in single precision (A68).
    Project,
    /// Geometry and rays in double precision; hits nearer than 2^-30 of the coordinates' size do not count (A65).
    Double,
}

/// A surface that a ray met, and what leaving it needs.
#[derive(Clone, Copy, Debug)]
pub struct Departure {
    /// The surface.
    pub at: Interaction,
    /// Which primitive, by its number in the copy: the same number is the same primitive.
    pub primitive: u32,
    /// Where rays leave.
    origin: [f64; 3],
    is_flat: bool,
}

#[derive(Debug)]
enum Copy {
    Single(Tree<f32>),
    Double(Tree<f64>),
}

/// A copy of a scene's geometry with a remedy.
#[derive(Debug)]
pub struct Textbook {
    remedy: Remedy,
    copy: Copy,
}

/// What a ray meets in the copy, in the precision of the caller.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Met {
    pub t: f64,
    pub primitive: u32,
    pub is_flat: bool,
    pub hit: Hit,
}

/// A ray as the copy takes it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Question {
    pub o: [f64; 3],
    pub d: [f64; 3],
    pub t_min: f64,
    pub t_max: f64,
    pub skip: Option<u32>,
    pub time: f32,
}

impl Departure {
    /// Where rays leave, render space.
    pub fn origin(&self) -> [f64; 3] {
        self.origin
    }
}

impl Textbook {
    /// Copies what is to be copied.
    pub fn new(geometry: &Geometry, remedy: Remedy) -> Self {
        let copy = match remedy {
            Remedy::Double => Copy::Double(Tree::new(geometry)),
            Remedy::Nothing | Remedy::FixedOffset(_) | Remedy::SkipLast | Remedy::Project => {
                Copy::Single(Tree::new(geometry))
            }
        };
        Self { remedy, copy }
    }

    /// Bytes of the copied vertices and the tree over them.
    pub fn memory_bytes(&self) -> usize {
        match &self.copy {
            Copy::Single(tree) => tree.memory_bytes(),
            Copy::Double(tree) => tree.memory_bytes(),
        }
    }

    /// The closest surface on a ray that comes from no surface.
    pub fn first(&self, geometry: &Geometry, ray: &Ray, alpha: &impl AlphaTextures) -> Option<Departure> {
        let question = Question {
            o: ray.o.to_array().map(f64::from),
            d: ray.d.to_array().map(f64::from),
            t_min: 0.0,
            t_max: f64::INFINITY,
            skip: None,
            time: ray.time,
        };
        self.ask(geometry, &question, alpha)
    }

    /// The closest surface that a ray from `from` in direction `w`, unit, meets, by the remedy.
    pub fn next(
        &self,
        geometry: &Geometry,
        from: &Departure,
        w: Vec3,
        alpha: &impl AlphaTextures,
    ) -> Option<Departure> {
        self.ask(geometry, &self.leave(from, w.to_array().map(f64::from)), alpha)
    }

    /// What stands between `from` and the end of a light sample in direction `wi`. The light's own end is taken care of as
    /// in production, so that only leaving makes a difference.
    pub fn blocker(
        &self,
        geometry: &Geometry,
        from: &Departure,
        wi: Vec3,
        target: &LightTarget,
        alpha: &impl AlphaTextures,
    ) -> Option<Departure> {
        let end = match *target {
            LightTarget::Infinite => return self.next(geometry, from, wi, alpha),
            LightTarget::Point(p) => p,
            LightTarget::Surface { p, p_error, n, .. } => {
                let segment = from.at.spawn_ray_to(p, p_error, n);
                segment.o + segment.d
            }
        };
        let end = end.to_array().map(f64::from);
        let d = [0, 1, 2].map(|i| end[i] - from.origin[i]);
        let length = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        if !(length > 0.0) {
            return None;
        }
        let question = Question { t_max: length, ..self.leave(from, d.map(|c| c / length)) };
        self.ask(geometry, &question, alpha)
    }

    fn leave(&self, from: &Departure, d: [f64; 3]) -> Question {
        let largest = from.origin.iter().fold(0.0, |m: f64, c| m.max(c.abs()));
        let (t_min, skip) = match self.remedy {
            Remedy::Nothing | Remedy::Project => (0.0, None),
            Remedy::FixedOffset(epsilon) => (f64::from(epsilon), None),
            Remedy::SkipLast => (0.0, from.is_flat.then_some(from.primitive)),
            Remedy::Double => (largest.max(f64::from(from.at.t)) * 2f64.powi(-30), None),
        };
        Question { o: from.origin, d, t_min, t_max: f64::INFINITY, skip, time: from.at.time }
    }

    fn ask(&self, geometry: &Geometry, q: &Question, alpha: &impl AlphaTextures) -> Option<Departure> {
        let met = match &self.copy {
            Copy::Single(tree) => tree.closest(geometry, q, alpha),
            Copy::Double(tree) => tree.closest(geometry, q, alpha),
        }?;
        let ray = Ray::new(Point3::from(q.o.map(|c| c as f32)), Vec3::from(q.d.map(|c| c as f32)), q.time);
        let at = geometry.interaction(&ray, &met.hit);
        // A grazing quadric that the textbook meets and the scene's own arithmetic does not.
        if at.n.length_squared() == 0.0 {
            return None;
        }
        let origin = match self.remedy {
            Remedy::Double => [0, 1, 2].map(|i| q.o[i] + met.t * q.d[i]),
            Remedy::Project => at.p.to_array().map(f64::from),
            Remedy::Nothing | Remedy::FixedOffset(_) | Remedy::SkipLast => {
                ray.at(met.t as f32).to_array().map(f64::from)
            }
        };
        Some(Departure { at, primitive: met.primitive, origin, is_flat: met.is_flat })
    }
}
