//! What a model does with light from one direction, over all directions (A11): numbers to plot.

use super::{Bxdf, Sides, TransportMode};
use irradiant_math::elementary::{cos, sin};
use irradiant_math::hash::Pcg32;
use irradiant_math::{Point2, Vec3};
use std::f32::consts::PI;

/// A direction that takes a share of the light by itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeltaLobe {
    /// Unit.
    pub w: Vec3,
    /// Share of the light, averaged over wavelengths.
    pub weight: f32,
}

/// f and f |cos| over a grid of directions for light that comes from `wi`, averaged over wavelengths.
#[derive(Clone, Debug)]
pub struct LobeView {
    /// Where the light comes from, local, unit.
    pub wi: Vec3,
    /// Rows: polar angles, evenly from 0 to pi, at the middles of their intervals.
    pub rows: usize,
    /// Columns: azimuths, evenly from 0 to 2 pi, at the middles.
    pub columns: usize,
    /// f, 1/sr, row by row.
    pub f: Vec<f32>,
    /// f |cos| of the outgoing direction, 1/sr.
    pub f_cos: Vec<f32>,
    /// Mirrors and refractions.
    pub deltas: Vec<DeltaLobe>,
}

/// The four categories of the lecture, and what transmits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LobeShape {
    /// All light goes into single directions.
    IdealSpecular,
    /// f is the same in all directions of the hemisphere.
    IdealDiffuse,
    /// f is largest near the mirror direction.
    GlossySpecular,
    /// f is largest near where the light comes from.
    RetroReflective,
    /// Something else: several lobes, or most of it through the surface.
    Mixed,
}

impl LobeView {
    /// Looks at a model. `wi` need not be on the upper side.
    pub fn new(bxdf: &Bxdf, wi: Vec3, rows: usize, columns: usize) -> Self {
        let mut view = Self { wi, rows, columns, f: Vec::new(), f_cos: Vec::new(), deltas: Vec::new() };
        for row in 0..rows {
            for column in 0..columns {
                let w = view.direction(row, column);
                let f = bxdf.f(w, wi, TransportMode::Radiance).average();
                view.f.push(f);
                view.f_cos.push(f * w.z.abs());
            }
        }
        view.deltas = deltas(bxdf, wi);
        view
    }

    /// The direction of a place in the grid.
    pub fn direction(&self, row: usize, column: usize) -> Vec3 {
        let theta = PI * (row as f32 + 0.5) / self.rows as f32;
        let phi = 2.0 * PI * (column as f32 + 0.5) / self.columns as f32;
        Vec3::new(sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta))
    }

    /// Where f is largest: the direction and f there. `None` where f is 0 everywhere.
    pub fn peak(&self) -> Option<(Vec3, f32)> {
        let i = (0..self.f.len()).max_by(|&a, &b| self.f[a].total_cmp(&self.f[b]))?;
        (self.f[i] > 0.0).then(|| (self.direction(i / self.columns, i % self.columns), self.f[i]))
    }

    /// The integral of f |cos| over all directions, deltas included: the share of light that goes on (of radiance: its
    /// factor eta^2 is in it).
    pub fn albedo(&self) -> f64 {
        let (step, turn) = (PI / self.rows as f32, 2.0 * PI / self.columns as f32);
        let rows = (0..self.rows).map(|row| {
            let theta = PI * (row as f32 + 0.5) / self.rows as f32;
            let sum: f32 = self.f_cos[row * self.columns..(row + 1) * self.columns].iter().sum();
            f64::from(sum * sin(theta) * step * turn)
        });
        rows.sum::<f64>() + self.deltas.iter().map(|d| f64::from(d.weight)).sum::<f64>()
    }

    /// Which of the lecture's categories it is: near means within `radians`.
    pub fn shape(&self, radians: f32) -> LobeShape {
        let mirror = Vec3::new(-self.wi.x, -self.wi.y, self.wi.z);
        let Some((peak, most)) = self.peak() else {
            return if self.deltas.is_empty() { LobeShape::Mixed } else { LobeShape::IdealSpecular };
        };
        if !self.deltas.is_empty() || peak.z * self.wi.z < 0.0 {
            return LobeShape::Mixed;
        }
        let upper =
            (0..self.f.len()).filter(|i| self.direction(i / self.columns, i % self.columns).z * self.wi.z > 0.0);
        let least = upper.map(|i| self.f[i]).fold(f32::INFINITY, f32::min);
        if least > 0.999 * most {
            return LobeShape::IdealDiffuse;
        }
        let near = |w: Vec3| peak.dot(w) >= cos(radians);
        match (near(mirror), near(self.wi)) {
            (true, false) => LobeShape::GlossySpecular,
            (false, true) => LobeShape::RetroReflective,
            (true, true) | (false, false) => LobeShape::Mixed,
        }
    }
}

/// Directions that samples fall into again and again, with their mean weights.
fn deltas(bxdf: &Bxdf, wi: Vec3) -> Vec<DeltaLobe> {
    const SAMPLES: u32 = 4096;
    if !bxdf.flags().is_specular() {
        return Vec::new();
    }
    let mut random = Pcg32::new(11, 3);
    let mut found: Vec<DeltaLobe> = Vec::new();
    for i in 0..SAMPLES {
        let u = Point2::new(random.next_f32(), random.next_f32());
        let choice = (i as f32 + 0.5) / SAMPLES as f32;
        let Some(s) = bxdf.sample(wi, choice, u, TransportMode::Radiance, Sides::All) else { continue };
        if !s.lobe.is_specular() {
            continue;
        }
        let weight = (s.f * (s.wi.z.abs() / s.pdf)).average() / SAMPLES as f32;
        match found.iter_mut().find(|d| d.w.dot(s.wi) > 0.999_99) {
            Some(lobe) => lobe.weight += weight,
            None => found.push(DeltaLobe { w: s.wi, weight }),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bxdf::{Conductor, Dielectric, Diffuse, Ggx, Retroreflective};
    use irradiant_spectrum::SampledSpectrum;

    fn metal(alpha: f32) -> Bxdf {
        let (eta, k) = (SampledSpectrum([0.2, 0.92, 1.1, 1.4]), SampledSpectrum([3.9, 2.45, 2.14, 3.0]));
        Bxdf::Conductor(Conductor::new(eta, k, Ggx::new(alpha, alpha)))
    }

    /// A11: the peak is at the mirror direction, nowhere, near the mirror direction, back at the source.
    #[test]
    fn the_four_categories_of_the_lecture_are_told_apart() {
        let wi = Vec3::new(0.5, 0.0, 0.75f32.sqrt());
        let mirror = Vec3::new(-0.5, 0.0, 0.75f32.sqrt());
        let view = |bxdf: &Bxdf| LobeView::new(bxdf, wi, 90, 180);
        let ideal = view(&metal(0.0));
        assert_eq!(ideal.shape(0.2), LobeShape::IdealSpecular);
        assert!(ideal.deltas.len() == 1 && ideal.deltas[0].w.dot(mirror) > 0.999_999, "{:?}", ideal.deltas);
        let half = Bxdf::Diffuse(Diffuse::new(SampledSpectrum::splat(0.5)));
        assert_eq!(view(&half).shape(0.2), LobeShape::IdealDiffuse);
        assert!((view(&half).albedo() - 0.5).abs() < 1e-3);
        let glossy = view(&metal(0.1));
        assert_eq!(glossy.shape(0.1), LobeShape::GlossySpecular);
        assert!(glossy.albedo() > 0.6 && glossy.albedo() < 1.0, "{}", glossy.albedo());
        let sign = Bxdf::Retroreflective(Retroreflective::new(
            SampledSpectrum::splat(0.7),
            SampledSpectrum::ONE,
            Ggx::new(0.1, 0.1),
        ));
        assert_eq!(view(&sign).shape(0.15), LobeShape::RetroReflective);
        // Glass is two deltas that share the light; what goes through is scaled by the squared index.
        let glass = view(&Bxdf::Dielectric(Dielectric::new(1.5, Ggx::SMOOTH)));
        assert_eq!(glass.deltas.len(), 2);
        let through = glass.deltas.iter().find(|d| d.w.z < 0.0).expect("a refraction").weight * 2.25;
        let back = glass.deltas.iter().find(|d| d.w.z > 0.0).expect("a reflection").weight;
        assert!((through + back - 1.0).abs() < 1e-3, "{through} {back}");
    }
}
