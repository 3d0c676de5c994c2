//! Multiple importance sampling over all ways to make one path: a formula over its densities, without a scene.
//!
//! A path has `n` vertices, from 0 on the light to `n - 1` on the lens. Strategy `s` takes the first `s` of them from a
//! walk that began at the light and the others from one that began at the camera; vertex `i` then comes with density
//! `from_light[i]` or `from_camera[i]`, whatever the strategy. So neighbouring strategies differ by one ratio, and all weights
//! follow from the chain of ratios (Veach 1997, section 10.2). Densities of what is a delta count by their geometry
//! alone: they stand in both strategies, or in none.

use crate::registry::words;

words! {
    /// How strategies share a path.
    pub enum Heuristic {
        /// By the square of density.
        Power = "power",
        /// By density.
        Balance = "balance",
    }
}

/// One vertex in the eyes of both walks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Density {
    /// With which a walk from the light finds it, given the vertices before; per area (at infinity: per solid angle).
    pub from_light: f32,
    /// With which a walk from the camera finds it, given the vertices after.
    pub from_camera: f32,
    /// The path scatters here by something other than a delta, so that two walks may be joined here.
    pub connectible: bool,
}

/// A path in the eyes of all strategies.
#[derive(Debug, Default)]
pub(super) struct PathDensities {
    /// From the light to the lens.
    pub vertices: Vec<Density>,
    /// With which a light sample from vertex 1 finds vertex 0: what strategy 1 has in place of `from_light`.
    pub light_sample: f32,
    /// A walk from the camera may meet the light.
    pub light_can_be_met: bool,
    /// A walk from the light may be joined to the lens.
    pub lens_can_be_joined: bool,
}

impl PathDensities {
    /// Whether strategy `s` makes paths like this one.
    pub fn allows(&self, s: usize) -> bool {
        let n = self.vertices.len();
        if s == 0 {
            return self.light_can_be_met;
        }
        if s + 1 > n {
            return false;
        }
        // Joined to the lens; a light that the camera sees directly is left to the camera's ray.
        if s + 1 == n {
            return s >= 2 && self.lens_can_be_joined && self.vertices[s - 1].connectible;
        }
        (s == 1 || self.vertices[s - 1].connectible) && self.vertices[s].connectible
    }

    /// The weight of strategy `s`, which has made this path, in [0, 1]; over all strategies that make it they add up to 1.
    pub fn weight(&self, s: usize, heuristic: Heuristic) -> f32 {
        let n = self.vertices.len();
        let shaped = |ratio: f64| match heuristic {
            Heuristic::Balance => ratio,
            Heuristic::Power => ratio * ratio,
        };
        let v = &self.vertices;
        // What strategy j has for vertex 0.
        let first = |j: usize| match j {
            0 => f64::from(v[0].from_camera),
            1 => f64::from(self.light_sample),
            _ => f64::from(v[0].from_light),
        };
        let of_vertex_0 = |j: usize| first(j) / first(s);
        let mut others = 0.0;
        // Strategies with more of the light's walk; then with less.
        let mut ratio = 1.0;
        for j in s + 1..n {
            if j >= 2 {
                ratio *= f64::from(v[j - 1].from_light) / f64::from(v[j - 1].from_camera);
            }
            if self.allows(j) {
                others += shaped(ratio * of_vertex_0(j));
            }
        }
        let mut ratio = 1.0;
        for j in (0..s).rev() {
            if j >= 1 {
                ratio *= f64::from(v[j].from_camera) / f64::from(v[j].from_light);
            }
            if self.allows(j) {
                others += shaped(ratio * of_vertex_0(j));
            }
        }
        // Not a number only where densities have overflown.
        if others.is_nan() { 0.0 } else { (1.0 / (1.0 + others)) as f32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_testkit::Rng;

    /// A path of random densities; some vertices deltas.
    fn path(n: usize, rng: &mut Rng) -> PathDensities {
        let mut density = || (rng.next_f32() * 12.0 - 6.0).exp();
        let mut vertices: Vec<_> =
            (0..n).map(|_| Density { from_light: density(), from_camera: density(), connectible: true }).collect();
        let light_sample = density();
        for v in &mut vertices[1..n - 1] {
            v.connectible = rng.next_f64() < 0.7;
        }
        PathDensities {
            vertices,
            light_sample,
            light_can_be_met: rng.next_f64() < 0.8,
            lens_can_be_joined: rng.next_f64() < 0.8,
        }
    }

    /// The product of densities that the chain of ratios stands for.
    fn density(p: &PathDensities, s: usize) -> f64 {
        (0..p.vertices.len())
            .map(|i| {
                let v = &p.vertices[i];
                f64::from(if i >= s {
                    v.from_camera
                } else if i == 0 && s == 1 {
                    p.light_sample
                } else {
                    v.from_light
                })
            })
            .product()
    }

    #[test]
    fn weights_are_shares_of_density_and_add_up_to_one() {
        let mut rng = Rng::new(1);
        let mut seen = 0;
        for i in 0..3000 {
            let n = 2 + i % 9;
            let p = path(n, &mut rng);
            let strategies: Vec<usize> = (0..n).filter(|&s| p.allows(s)).collect();
            seen += strategies.len();
            for heuristic in [Heuristic::Balance, Heuristic::Power] {
                let power = if heuristic == Heuristic::Power { 2 } else { 1 };
                let total: f64 = strategies.iter().map(|&s| density(&p, s).powi(power)).sum();
                for &s in &strategies {
                    let (got, exact) = (p.weight(s, heuristic), density(&p, s).powi(power) / total);
                    assert!((f64::from(got) - exact).abs() < 1e-5, "{p:?} {s}: {got} {exact}");
                }
                let sum: f32 = strategies.iter().map(|&s| p.weight(s, heuristic)).sum();
                assert!(strategies.is_empty() || (sum - 1.0).abs() < 1e-5);
            }
        }
        assert!(seen > 5000);
    }

    #[test]
    fn walks_are_joined_only_where_light_scatters_broadly() {
        let mut rng = Rng::new(2);
        let mut p = path(5, &mut rng);
        (p.light_can_be_met, p.lens_can_be_joined) = (true, true);
        p.vertices.iter_mut().for_each(|v| v.connectible = true);
        assert_eq!((0..6).map(|s| p.allows(s)).collect::<Vec<_>>(), [true, true, true, true, true, false]);
        // Light, diffuse, glass, diffuse, lens.
        p.vertices[2].connectible = false;
        assert_eq!((0..5).map(|s| p.allows(s)).collect::<Vec<_>>(), [true, true, false, false, true]);
        // A point light's caustic: joined to the lens or not at all.
        p.vertices[1].connectible = false;
        p.light_can_be_met = false;
        assert_eq!((0..5).map(|s| p.allows(s)).collect::<Vec<_>>(), [false, false, false, false, true]);
        assert_eq!(p.weight(4, Heuristic::Power), 1.0);
        // A light that the camera looks at.
        p.vertices.truncate(2);
        p.light_can_be_met = true;
        assert_eq!((0..2).map(|s| p.allows(s)).collect::<Vec<_>>(), [true, false]);
    }
}
