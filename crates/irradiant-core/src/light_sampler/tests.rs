//! Claims of all light samplers, over random scenes of point, spot and infinite lights.
//!
//! Seeds are fixed; chi-square at p > 1e-6 each.

use super::*;
use crate::light::{
    DistantLight, Emission, LightBounds, Orientation, PointLight, SceneSphere, SpotLight, UniformInfiniteLight,
};
use irradiant_math::{Bounds3, Normal3, Point3, Transform, Vec3};
use irradiant_spectrum::{ColorSpace, Role, Spectrum};
use irradiant_testkit::{Mean, Rng, chi2_counts};

const KINDS: [LightSamplerKind; 4] =
    [LightSamplerKind::Uniform, LightSamplerKind::Power, LightSamplerKind::Bvh, LightSamplerKind::Exhaustive];

fn emission(value: f32) -> Emission {
    Emission::new(&Spectrum::constant(value, Role::Illuminant, ColorSpace::srgb()), 1.0, ColorSpace::srgb())
}

fn random_point(rng: &mut Rng, size: f32) -> Point3 {
    let mut x = || (rng.next_f32() - 0.5) * size;
    Point3::new(x(), x(), x())
}

fn unit(d: [f32; 3]) -> Vec3 {
    Vec3::new(d[0], d[1], d[2]).normalize()
}

fn random_lights(n: usize, infinite: usize, seed: u64) -> Lights {
    let mut rng = Rng::new(seed);
    let scene = SceneSphere { center: Point3::ZERO, radius: 10.0 };
    let mut list: Vec<Light> = (0..n)
        .map(|i| {
            let p = random_point(&mut rng, 10.0);
            let intensity = emission(rng.next_f32() * 5.0 + 0.01);
            if i % 2 == 0 {
                return Light::Point(PointLight { p, intensity });
            }
            let axis = unit(rng.direction());
            let orientation = Orientation::new(&Transform::IDENTITY);
            Light::Spot(SpotLight { p, axis, orientation, intensity, cos_start: 0.8, cos_end: 0.6 })
        })
        .collect();
    for i in 0..infinite {
        let wi = unit(rng.direction());
        list.insert(
            i,
            if i % 2 == 0 {
                Light::Distant(DistantLight { wi, irradiance: emission(1.0), scene })
            } else {
                Light::UniformInfinite(UniformInfiniteLight { radiance: emission(1.0), scene })
            },
        );
    }
    Lights::new(list)
}

pub(super) fn random_reference(rng: &mut Rng) -> ReferencePoint {
    let n = if rng.next_f32() < 0.2 { Normal3::ZERO } else { unit(rng.direction()).as_normal() };
    ReferencePoint { p: random_point(rng, 14.0), p_error: Vec3::ZERO, n, ns: n }
}

pub(super) fn samplers(n: usize, infinite: usize, seed: u64) -> (Lights, Vec<LightSampler>) {
    let lights = random_lights(n, infinite, seed);
    let samplers = KINDS.map(|k| LightSampler::new(k, &lights)).into();
    (lights, samplers)
}

const SCENES: [(usize, usize); 7] = [(1, 0), (2, 0), (0, 1), (0, 3), (5, 1), (37, 2), (300, 0)];

#[test]
fn probabilities_sum_to_one_or_less_and_every_draw_states_its_own() {
    for (i, (n, infinite)) in SCENES.into_iter().enumerate() {
        let (lights, samplers) = samplers(n, infinite, i as u64);
        let mut rng = Rng::new(50 + i as u64);
        for s in &samplers {
            for _ in 0..200 {
                let at = random_reference(&mut rng);
                let sum: f64 = (0..lights.len()).map(|i| f64::from(s.pmf(&at, LightId(i as u32)))).sum();
                assert!(sum < 1.0 + 1e-5, "{sum}");
                for u in [0.0, 1.0 - f32::EPSILON / 2.0, rng.next_f32(), rng.next_f32(), rng.next_f32()] {
                    match s.sample(&at, u) {
                        Some(picked) => {
                            let pmf = s.pmf(&at, picked.id);
                            assert!((picked.pmf / pmf - 1.0).abs() < 1e-5, "{picked:?} {pmf}");
                        }
                        // Nothing is drawn only where something may be missing from the sum.
                        None => assert!(sum < 1.0 - 1e-6, "{sum}"),
                    }
                }
            }
        }
    }
}

// 20,000 draws over n lights: a light picked 20 % too often is seen where its share is above 3 %.
#[test]
fn lights_are_picked_as_often_as_claimed() {
    for (i, (n, infinite)) in SCENES.into_iter().enumerate() {
        let (lights, samplers) = samplers(n, infinite, i as u64);
        let mut rng = Rng::new(70 + i as u64);
        for s in &samplers {
            for _ in 0..3 {
                let at = random_reference(&mut rng);
                let mut probabilities: Vec<f64> =
                    (0..lights.len()).map(|i| f64::from(s.pmf(&at, LightId(i as u32)))).collect();
                let missing = 1.0 - probabilities.iter().sum::<f64>();
                probabilities.push(missing.max(0.0));
                let mut counts = vec![0u64; probabilities.len()];
                for _ in 0..20_000 {
                    counts[s.sample(&at, rng.next_f32()).map_or(lights.len(), |p| p.id.0 as usize)] += 1;
                }
                if counts.iter().filter(|&&c| c > 0).count() > 1 {
                    chi2_counts(&counts, &probabilities).assert_above(1e-6, "picks");
                }
            }
        }
    }
}

#[test]
fn the_mean_of_one_over_the_probability_counts_the_lights_that_can_be_picked() {
    let (lights, samplers) = samplers(37, 2, 5);
    let mut rng = Rng::new(99);
    let at = random_reference(&mut rng);
    for s in &samplers {
        let reachable = (0..lights.len()).filter(|&i| s.pmf(&at, LightId(i as u32)) > 0.0).count();
        // Rarely picked lights make this heavy-tailed: draw u in strata.
        let n = 200_000;
        let mut i = 0;
        let mean = Mean::of(n, || {
            i += 1;
            let u = (i as f64 - rng.next_f64()) / n as f64;
            s.sample(&at, (u as f32).min(1.0 - f32::EPSILON)).map_or(0.0, |p| 1.0 / f64::from(p.pmf))
        });
        let off = (mean.mean() / reachable as f64 - 1.0).abs();
        assert!(off < 1e-6 + 4.9 * mean.standard_error() / reachable as f64 && off < 0.05, "{off}");
    }
}

// A light that brings something must be possible: checked with every light's own illumination.
#[test]
fn no_light_that_reaches_a_point_is_left_out() {
    let (lights, samplers) = samplers(300, 0, 3);
    let lambda = Wavelengths::sample_visible(0.5);
    let mut rng = Rng::new(7);
    for _ in 0..500 {
        let at = random_reference(&mut rng);
        for (i, l) in lights.as_slice().iter().enumerate() {
            let u = irradiant_math::Point2::new(0.5, 0.5);
            if l.sample(&at, u, &lambda, crate::light::SampleMode::Complete).is_some_and(|s| !s.radiance.is_black()) {
                for s in &samplers {
                    assert!(s.pmf(&at, LightId(i as u32)) > 0.0);
                }
            }
        }
    }
}

#[test]
fn the_tree_estimates_what_the_bounds_do() {
    let (lights, _) = samplers(4, 0, 21);
    let tree = TreeSampler::new(lights.as_slice());
    assert_eq!(tree.node_count(), 1);
    let exhaustive = ExhaustiveSampler::new(lights.as_slice());
    let mut rng = Rng::new(3);
    for _ in 0..2000 {
        let at = random_reference(&mut rng);
        for i in 0..4 {
            let (a, b) = (tree.pmf(&at, LightId(i)), exhaustive.pmf(&at, LightId(i)));
            assert!((a - b).abs() <= 1e-3 * a.max(b) + 1e-9, "{a} {b}");
        }
    }
}

#[test]
fn unions_of_bounds_are_conservative() {
    let mut rng = Rng::new(13);
    for round in 0..300 {
        let spread = if round % 3 == 0 { 1e-3 } else { 1.0 };
        let bounds: Vec<LightBounds> = (0..3)
            .map(|_| {
                let p = random_point(&mut rng, 2.0);
                LightBounds {
                    bounds: Bounds3 { min: p, max: p },
                    axis: (Vec3::X + unit(rng.direction()) * spread).normalize(),
                    cos_normals: 1.0 - 0.5 * rng.next_f32() * rng.next_f32(),
                    cos_emission: 0.0,
                    power: 1.0,
                    two_sided: false,
                }
            })
            .collect();
        let all = bounds[0].union(&bounds[1]).union(&bounds[2]);
        for _ in 0..50 {
            let at = random_reference(&mut rng);
            for b in &bounds {
                assert!(b.importance(at.p, at.n) == 0.0 || all.importance(at.p, at.n) > 0.0, "{b:?} {all:?}");
            }
        }
    }
}

#[test]
fn thousands_of_lights_in_one_place_build_and_sample() {
    let p = Point3::new(1.0, 2.0, 3.0);
    let list = (0..5000).map(|i| Light::Point(PointLight { p, intensity: emission(1.0 + (i % 7) as f32) })).collect();
    let lights = Lights::new(list);
    let s = LightSampler::new(LightSamplerKind::Bvh, &lights);
    let at = ReferencePoint { p, p_error: Vec3::ZERO, n: Normal3::ZERO, ns: Normal3::ZERO };
    for i in 0..100 {
        let picked = s.sample(&at, i as f32 / 100.0).unwrap();
        assert!((s.pmf(&at, picked.id) / picked.pmf - 1.0).abs() < 1e-4);
    }
    assert!(LightSampler::new(LightSamplerKind::Bvh, &Lights::default()).sample(&at, 0.5).is_none());
}
