//! Where a light is, where it shines to and how much: what a light tree needs to know of lights and groups of them.
//!
//! Conty Estevez and Kulla 2018, "Importance sampling of many lights with adaptive tree splitting"; importance as in
//! pbrt-v4 `LightBounds::Importance`.

use irradiant_math::elementary::{acos, cos, safe_acos, safe_sqrt, sin_cos};
use irradiant_math::{Bounds3, Normal3, Point3, Vec3};
use std::f32::consts::PI;

/// Bounds in position, direction and power of one light or of several.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// Where emission starts, render space.
    pub bounds: Bounds3,
    /// Axis of the cone of normals, unit.
    pub axis: Vec3,
    /// Cosine of the half-angle of the cone of normals.
    pub cos_normals: f32,
    /// Cosine of the greatest angle between a normal and emission.
    pub cos_emission: f32,
    /// About the greatest spectral power.
    pub power: f32,
    /// Emission goes to the other side too.
    pub two_sided: bool,
}

/// A cone of directions around a unit axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cone {
    axis: Vec3,
    cos: f32,
}

impl Cone {
    const ALL: Self = Self { axis: Vec3::Z, cos: -1.0 };

    /// A cone that holds both, a little wider than the least one.
    fn union(self, b: Self) -> Self {
        let a = self;
        if a.cos <= -1.0 || b.cos <= -1.0 {
            return Self::ALL;
        }
        let (angle_a, angle_b) = (safe_acos(a.cos), safe_acos(b.cos));
        let between = safe_acos(a.axis.dot(b.axis));
        if (between + angle_b).min(PI) <= angle_a {
            return a;
        }
        if (between + angle_a).min(PI) <= angle_b {
            return b;
        }
        // Wider by what acos near 1 may have lost.
        let angle = (angle_a + between + angle_b) * 0.5 + 1e-3;
        let normal = a.axis.cross(b.axis);
        if angle >= PI || normal.length_squared() < 1e-12 {
            return if between < 1.0 && angle < PI {
                Self { axis: a.axis, cos: cos((2.0 * angle - angle_a).min(PI)) }
            } else {
                Self::ALL
            };
        }
        // Turn a's axis towards b's.
        let toward = normal.normalize().cross(a.axis);
        let (s, c) = sin_cos(angle - angle_a);
        Self { axis: (a.axis * c + toward * s).normalize(), cos: cos(angle) }
    }
}

impl LightBounds {
    /// Bounds that hold both; powers add up.
    pub fn union(&self, b: &Self) -> Self {
        let cone = Cone { axis: self.axis, cos: self.cos_normals }.union(Cone { axis: b.axis, cos: b.cos_normals });
        Self {
            bounds: self.bounds.union(b.bounds),
            axis: cone.axis,
            cos_normals: cone.cos,
            cos_emission: self.cos_emission.min(b.cos_emission),
            power: self.power + b.power,
            two_sided: self.two_sided || b.two_sided,
        }
    }

    /// The cost of a tree node with these bounds for a split along `dimension` of the `parent` box: power times the
    /// measures of directions and of places (Conty Estevez and Kulla 2018, eq. 1 and sec. 4.4).
    pub fn cost(&self, parent: &Bounds3, dimension: usize) -> f32 {
        let angle_normals = acos(self.cos_normals.clamp(-1.0, 1.0));
        let angle_emission = acos(self.cos_emission.clamp(-1.0, 1.0));
        let reach = (angle_normals + angle_emission).min(PI);
        let sin_normals = safe_sqrt(1.0 - self.cos_normals * self.cos_normals);
        let directions = 2.0 * PI * (1.0 - self.cos_normals)
            + 0.5
                * PI
                * (2.0 * reach * sin_normals - cos(angle_normals - 2.0 * reach) - 2.0 * angle_normals * sin_normals
                    + self.cos_normals);
        let extent = parent.diagonal().to_array();
        let stretch = extent.iter().copied().fold(0.0, f32::max) / extent[dimension];
        // Points have no area; a part of the diagonal lets them be compared too (pbrt-v4 halves them blindly).
        let places = self.bounds.surface_area() + 0.1 * self.bounds.diagonal().length_squared();
        self.power * directions * stretch * places
    }

    /// The least squared distance that counts: half of the diagonal, as pbrt-v4, and never 0, so that importance is
    /// finite.
    pub fn least_distance_squared(&self) -> f32 {
        (self.bounds.diagonal().length() * 0.5).max(1e-20)
    }

    /// An estimate of what arrives at `p` on a surface of normal `n` (zero: no surface); 0 only when nothing can.
    ///
    /// The scalar form of what the tree computes four lanes at a time.
    pub fn importance(&self, p: Point3, n: Normal3) -> f32 {
        let center = self.bounds.center();
        let offset = p - center;
        let distance_squared = offset.length_squared();
        let radius = center.distance(self.bounds.max);
        let clamped = distance_squared.max(self.least_distance_squared());
        let wi = offset * (1.0 / distance_squared.max(f32::MIN_POSITIVE).sqrt());

        // cos and sin of max(0, a - b).
        let cos_sub = |sin_a: f32, cos_a: f32, sin_b: f32, cos_b: f32| {
            if cos_a > cos_b { 1.0 } else { cos_a * cos_b + sin_a * sin_b }
        };
        let sin_sub = |sin_a: f32, cos_a: f32, sin_b: f32, cos_b: f32| {
            if cos_a > cos_b { 0.0 } else { sin_a * cos_b - cos_a * sin_b }
        };

        let cos_w = if self.two_sided { self.axis.dot(wi).abs() } else { self.axis.dot(wi) };
        let sin_w = safe_sqrt(1.0 - cos_w * cos_w);
        // The cone that the bounding sphere fills, seen from p.
        let sin2_b = if distance_squared > radius * radius { radius * radius / distance_squared } else { 1.0 };
        let inside = distance_squared <= radius * radius;
        let (cos_b, sin_b) = if inside { (-1.0, 0.0) } else { (safe_sqrt(1.0 - sin2_b), sin2_b.sqrt()) };

        let sin_normals = safe_sqrt(1.0 - self.cos_normals * self.cos_normals);
        let cos_x = cos_sub(sin_w, cos_w, sin_normals, self.cos_normals);
        let sin_x = sin_sub(sin_w, cos_w, sin_normals, self.cos_normals);
        let cos_p = cos_sub(sin_x, cos_x, sin_b, cos_b);
        if cos_p <= self.cos_emission {
            return 0.0;
        }
        let mut importance = self.power * cos_p / clamped;
        if n != Normal3::ZERO {
            let cos_i = wi.dot_normal(n).abs();
            importance *= cos_sub(safe_sqrt(1.0 - cos_i * cos_i), cos_i, sin_b, cos_b);
        }
        importance.max(0.0)
    }
}
