//! The contract of every model, from one list: what `sample` draws, what `pdf` claims and what `f` says agree; nothing
//! gains energy; white bodies vanish; hostile directions give zeros.
//!
//! All seeds are fixed. Statistical thresholds: chi-square p > 1e-7 per test (about 100 of them), means within 4.9
//! standard errors (two-sided 1e-6 per test, about 300). A right implementation fails with odds of about 1e-3 for a new
//! seed. Power is stated per test.

use super::*;
use irradiant_testkit::{Chi2, Mean, Rng, assert_mean_close, assert_means_agree};
use std::f32::consts::{FRAC_1_PI, PI};
use std::sync::OnceLock;

const SIGMAS: f64 = 4.9;

fn s(v: f32) -> SampledSpectrum {
    SampledSpectrum::splat(v)
}

fn direction(theta_degrees: f32, phi_degrees: f32) -> Vec3 {
    let (t, p) = (theta_degrees.to_radians(), phi_degrees.to_radians());
    Vec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos()).normalize()
}

fn cosine(rng: &mut Rng) -> Vec3 {
    irradiant_math::warp::cosine_hemisphere(Point2::new(rng.next_f32(), rng.next_f32()))
}

struct Case {
    name: &'static str,
    bxdf: Bxdf,
    /// `f` and `pdf` are exact, not random.
    exact: bool,
}

fn conductor(ax: f32, ay: f32) -> Bxdf {
    let (eta, k) = (SampledSpectrum([0.2, 0.92, 1.1, 1.4]), SampledSpectrum([3.9, 2.45, 2.14, 3.0]));
    Bxdf::Conductor(Conductor::new(eta, k, Ggx::new(ax, ay)))
}

fn film(outside: f32) -> ThinFilm {
    ThinFilm::new(450.0, s(1.9), s(1.0), s(6.5), outside, [430.0, 500.0, 580.0, 660.0])
}

fn coated(coat: &Coat, r: f32, limits: WalkLimits) -> Bxdf {
    Bxdf::CoatedDiffuse(CoatedDiffuse::new(
        coat,
        SampledSpectrum([r, 0.5 * r, 0.9 * r, 0.1 * r]),
        Filling::NONE,
        limits,
    ))
}

fn coated_conductor(top: f32, base: f32, filling: Filling, thickness: f32) -> Bxdf {
    Bxdf::CoatedConductor(CoatedConductor::new(
        Dielectric::new(1.5, Ggx::new(top, top)),
        thickness,
        CoatWeights::Exact,
        SampledSpectrum([0.2, 0.92, 1.1, 1.4]),
        SampledSpectrum([3.9, 2.45, 2.14, 3.0]),
        Ggx::new(base, base),
        filling,
        WalkLimits { max_depth: 100, n_samples: 1 },
    ))
}

/// Coats are tabulated once for all tests.
fn coats() -> &'static [Coat; 6] {
    static COATS: OnceLock<[Coat; 6]> = OnceLock::new();
    COATS.get_or_init(|| {
        [
            Coat::new(1.5, Ggx::SMOOTH, 0.01, CoatWeights::Exact),
            Coat::new(1.5, Ggx::new(0.001, 0.001), 0.01, CoatWeights::Pbrt),
            Coat::new(1.5, Ggx::new(0.1, 0.1), 0.01, CoatWeights::Exact),
            Coat::new(1.5, Ggx::new(0.4, 0.4), 0.3, CoatWeights::Exact),
            Coat::lossless(1.5, 0.05),
            Coat::lossless(1.7, 0.5),
        ]
    })
}

fn cases() -> Vec<Case> {
    let [smooth, fine, mid, thick, paint_a, paint_b] = coats();
    let fog = Filling { albedo: SampledSpectrum([0.8, 0.5, 0.9, 0.2]), g: 0.4 };
    let mut list = vec![];
    let mut add = |name, bxdf, exact| list.push(Case { name, bxdf, exact });
    add("diffuse", Bxdf::Diffuse(Diffuse::new(SampledSpectrum([0.1, 0.9, 0.5, 1.0]))), true);
    let leaf = DiffuseTransmission::new(SampledSpectrum([0.1, 0.5, 0.2, 0.0]), SampledSpectrum([0.2, 0.4, 0.1, 0.7]));
    add("leaf", Bxdf::DiffuseTransmission(leaf), true);
    add("mirror", conductor(0.0, 0.0), true);
    add("metal 0.05", conductor(0.05, 0.05), true);
    add("metal 0.3", conductor(0.3, 0.3), true);
    add("metal 1", conductor(1.0, 1.0), true);
    add("brushed", conductor(0.1, 0.5), true);
    add("glass", Bxdf::Dielectric(Dielectric::new(1.5, Ggx::SMOOTH)), true);
    add("frosted 0.1", Bxdf::Dielectric(Dielectric::new(1.5, Ggx::new(0.1, 0.1))), true);
    add("frosted 0.5", Bxdf::Dielectric(Dielectric::new(1.5, Ggx::new(0.5, 0.5))), true);
    add("frosted aniso", Bxdf::Dielectric(Dielectric::new(1.33, Ggx::new(0.15, 0.6))), true);
    add("bubble", Bxdf::Dielectric(Dielectric::new(1.0 / 1.5, Ggx::new(0.3, 0.3))), true);
    add("nothing", Bxdf::Dielectric(Dielectric::new(1.0, Ggx::new(0.3, 0.3))), true);
    add("pane", Bxdf::ThinDielectric(ThinDielectric::new(1.5)), true);
    add("plastic smooth", coated(smooth, 0.8, WalkLimits::PBRT), true);
    add("plastic 0.001", coated(fine, 0.8, WalkLimits::PBRT), true);
    add("plastic 0.1", coated(mid, 0.3, WalkLimits::PBRT), true);
    add("plastic 0.4 thick", coated(thick, 1.0, WalkLimits::UNLIMITED), true);
    add("plastic black", coated(mid, 0.0, WalkLimits::PBRT), true);
    let walked = Coat::walked(1.5, Ggx::new(0.2, 0.4), 0.01, CoatWeights::Exact);
    add("plastic aniso", coated(&walked, 0.6, WalkLimits::PBRT), false);
    let foggy = CoatedDiffuse::new(smooth, s(0.6), fog, WalkLimits { max_depth: 60, n_samples: 2 });
    add("plastic foggy", Bxdf::CoatedDiffuse(foggy), false);
    add("lacquered metal 0/0.2", coated_conductor(0.0, 0.2, Filling::NONE, 0.01), false);
    add("lacquered metal 0.2/0", coated_conductor(0.2, 0.0, Filling::NONE, 0.01), false);
    add("lacquered metal 0.15/0.3", coated_conductor(0.15, 0.3, Filling::NONE, 0.01), false);
    add("lacquered metal foggy", coated_conductor(0.3, 0.3, fog, 0.5), false);
    let sign = Retroreflective::new(SampledSpectrum([0.8, 0.5, 0.1, 0.0]), s(0.4), Ggx::new(0.15, 0.15));
    add("road sign", Bxdf::Retroreflective(sign), true);
    let sign = Retroreflective::new(s(0.9), s(0.0), Ggx::new(0.1, 0.4));
    add("road sign aniso", Bxdf::Retroreflective(sign), true);
    let red = SampledSpectrum([0.05, 0.1, 0.8, 0.9]);
    add("paint 0.05", Bxdf::GlossyPaint(GlossyPaint::new(paint_a, red)), true);
    add("paint 0.5", Bxdf::GlossyPaint(GlossyPaint::new(paint_b, red)), true);
    add("flakes", Bxdf::ThinFilmPaint(ThinFilmPaint::new(film(1.0), Ggx::new(0.25, 0.25), None)), true);
    let clear = Dielectric::new(1.5, Ggx::SMOOTH);
    add("flakes coated", Bxdf::ThinFilmPaint(ThinFilmPaint::new(film(1.5), Ggx::new(0.25, 0.25), Some(clear))), false);
    list
}

fn sample(b: &Bxdf, wo: Vec3, rng: &mut Rng, mode: TransportMode) -> Option<BsdfSample> {
    let u = Point2::new(rng.next_f32(), rng.next_f32());
    b.sample(wo, rng.next_f32(), u, mode, Sides::All)
}

fn outgoing() -> [Vec3; 3] {
    [direction(20.0, 30.0), direction(70.0, 200.0), -direction(45.0, 100.0)]
}

// 60,000 draws in 16 x 32 cells: a density wrong by 8 % over half of the samples is seen.
#[test]
fn samplers_have_the_densities_they_claim() {
    for case in cases().iter().filter(|c| c.exact && c.bxdf.flags().is_non_specular()) {
        for wo in outgoing() {
            let mut rng = Rng::new(0xc0de);
            let report = Chi2::new(60_000).depth(9).sphere(
                16,
                |d| {
                    let wi = Vec3::new(d[0] as f32, d[1] as f32, d[2] as f32).normalize();
                    f64::from(case.bxdf.pdf(wo, wi, TransportMode::Radiance, Sides::All))
                },
                || {
                    let s = sample(&case.bxdf, wo, &mut rng, TransportMode::Radiance)?;
                    (!s.lobe.is_specular()).then(|| s.wi.to_array())
                },
            );
            // Lobes of alpha 0.001 are too sharp for cells; the rest is tested fully.
            if case.name != "plastic 0.001" {
                report.assert_above(1e-7, case.name);
            }
            assert!(report.integral < 1.002, "{}: {}", case.name, report.integral);
        }
    }
}

#[test]
fn samples_state_the_value_and_density_of_their_direction() {
    for case in cases() {
        let mut rng = Rng::new(5);
        for wo in outgoing() {
            for _ in 0..300 {
                let Some(s) = sample(&case.bxdf, wo, &mut rng, TransportMode::Radiance) else { continue };
                assert!((s.wi.length() - 1.0).abs() < 1e-4, "{}", case.name);
                assert_eq!(s.lobe.is_reflective(), s.wi.z * wo.z > 0.0, "{}", case.name);
                if s.lobe.is_specular() {
                    continue;
                }
                let (f, pdf) = case.bxdf.f_and_pdf(wo, s.wi, TransportMode::Radiance);
                assert_eq!(f, case.bxdf.f(wo, s.wi, TransportMode::Radiance));
                assert_eq!(pdf, case.bxdf.pdf(wo, s.wi, TransportMode::Radiance, Sides::All), "{}", case.name);
                // Half vectors are found again from rounded directions: sharp lobes keep fewer digits.
                let sharp = if case.name.ends_with("0.001") { 0.05 } else { 3e-3 };
                assert!((s.pdf / pdf - 1.0).abs() < sharp, "{}: {} {pdf}", case.name, s.pdf);
                if case.exact {
                    for lane in 0..4 {
                        let e = (s.f[lane] - f[lane]).abs();
                        assert!(e <= sharp * f[lane], "{} {:?} {f:?}", case.name, s.f);
                    }
                }
            }
        }
    }
}

/// Albedos by own sampling, without deltas, in one lane: mean of `f cos / pdf`.
fn sampled_albedo(b: &Bxdf, wo: Vec3, lane: usize, n: u64, seed: u64) -> Mean {
    let mut rng = Rng::new(seed);
    Mean::of(n, || match sample(b, wo, &mut rng, TransportMode::Radiance) {
        Some(s) if !s.lobe.is_specular() => f64::from(s.f[lane] * s.wi.z.abs() / s.pdf),
        _ => 0.0,
    })
}

/// The same by evaluation in directions drawn independently of the model, of known density: cosines on each side that
/// scatters, lobes about the mirror direction, and about the refracted one or (if nothing is transmitted) about `wo`.
fn evaluated_albedo(b: &Bxdf, wo: Vec3, lane: usize, n: u64, seed: u64) -> Mean {
    let mut rng = Rng::new(seed);
    let lobes = [0.05, 0.3, 1.0].map(|alpha| Ggx::new(alpha, alpha));
    let panes = [(1.5, 0.1), (1.33, 0.4), (1.0 / 1.5, 0.3)].map(|(eta, a)| Dielectric::new(eta, Ggx::new(a, a)));
    let transmissive = b.flags().is_transmissive();
    let (radiance, across) = (TransportMode::Radiance, Sides::Transmission);
    let back = Vec3::new(-wo.x, -wo.y, wo.z);
    Mean::of(n, || {
        let u = Point2::new(rng.next_f32(), rng.next_f32());
        let pick = ((rng.next_f32() * 10.0) as usize).min(9);
        let wi = match pick {
            0..3 => lobes[pick].sample_bounded_reflection(wo, u),
            3..6 if transmissive => panes[pick - 3].sample_interface(wo, 0.5, u, radiance, across).map(|s| s.wi),
            3..6 => lobes[pick - 3].sample_bounded_reflection(back, u),
            _ => {
                let mut wi = irradiant_math::warp::cosine_hemisphere(u);
                wi.z = wi.z.copysign(if transmissive && rng.next_f32() < 0.5 { -wo.z } else { wo.z });
                Some(wi)
            }
        };
        let Some(wi) = wi else { return 0.0 };
        let mut pdf = wi.z.abs() * FRAC_1_PI * if transmissive { 0.2 } else { 0.4 };
        for i in 0..3 {
            if wi.z * wo.z > 0.0 {
                pdf += 0.1 * lobes[i].bounded_pdf(wo, (wo + wi).normalize());
                if !transmissive {
                    pdf += 0.1 * lobes[i].bounded_pdf(back, (back + wi).normalize());
                }
            } else {
                pdf += 0.1 * panes[i].f_and_pdf(wo, wi, radiance, across).1;
            }
        }
        f64::from(b.f(wo, wi, radiance)[lane] * wi.z.abs() / pdf)
    })
}

// The heart of the matter: what is drawn is what is evaluated, from three directions and in three lanes. Deviations above
// 10 % are seen for every model (asserted), above 2 % for most: errors of formulas, not of rounding.
#[test]
fn drawn_and_evaluated_albedos_agree() {
    for case in cases() {
        if !case.bxdf.flags().is_non_specular() || case.name == "plastic 0.001" {
            continue;
        }
        let n = if case.exact { 100_000 } else { 150_000 };
        for (i, wo) in outgoing().into_iter().enumerate() {
            let lane = (i + 2) % 4;
            let a = sampled_albedo(&case.bxdf, wo, lane, n, 11);
            let b = evaluated_albedo(&case.bxdf, wo, lane, n, 12);
            let se = (a.standard_error().powi(2) + b.standard_error().powi(2)).sqrt();
            let z = (a.mean() - b.mean()) / se.max(1e-12);
            assert!(
                z.abs() < SIGMAS || (a.mean() - b.mean()).abs() < 1e-6,
                "{} from {wo:?}: drawn {} evaluated {} z {z}",
                case.name,
                a.mean(),
                b.mean()
            );
            let power = (SIGMAS + 2.0) * se / a.mean().max(0.02);
            assert!(power < 0.1, "{}: only a bias of {power} would be seen", case.name);
        }
    }
}

// Walked models at a detectable bias of 0.3 %, the metal at 0.6 % (asserted; 3.9 standard errors, a false-alarm rate of 1e-4, and 2 more
// for a power of 98 %). The coat's own lobe, exact and tested above, is left out of the evaluation for less noise.
#[test]
fn walked_albedos_agree_closely() {
    let limits = WalkLimits { max_depth: 60, n_samples: 1 };
    let rough = Dielectric::new(1.5, Ggx::new(0.2, 0.4));
    let fog = Filling { albedo: s(0.95), g: 0.4 };
    let plastic = |thickness, filling| {
        let coat = Coat::walked(1.5, rough.facets, thickness, CoatWeights::Exact);
        Bxdf::CoatedDiffuse(CoatedDiffuse::new(&coat, s(0.95), filling, limits))
    };
    let (eta, k, base) = (s(0.2), s(4.0), Ggx::new(0.5, 0.5));
    let metal = CoatedConductor::new(rough, 0.02, CoatWeights::Exact, eta, k, base, Filling::NONE, limits);
    let wo = direction(35.0, 10.0);
    for (name, b, by_lobe, evaluations, draws) in [
        ("plastic", plastic(0.02, Filling::NONE), 0.0, 3_600_000, 4_400_000),
        ("foggy plastic", plastic(0.3, fog), 0.0, 4_800_000, 5_000_000),
        ("metal", Bxdf::CoatedConductor(metal), 0.8, 1_600_000, 1_800_000),
    ] {
        let mut rng = Rng::new(22);
        let coat = Mean::of(500_000, || {
            let u = Point2::new(rng.next_f32(), rng.next_f32());
            rough
                .sample_interface(wo, 0.0, u, TransportMode::Radiance, Sides::Reflection)
                .map_or(0.0, |s| f64::from(s.weight))
        });
        let lobe = Ggx::new(0.7, 0.7);
        let inner = Mean::of(evaluations, || {
            let u = Point2::new(rng.next_f32(), rng.next_f32());
            let wi =
                if rng.next_f32() < by_lobe { lobe.sample_bounded_reflection(wo, u) } else { Some(cosine(&mut rng)) };
            let Some(wi) = wi else { return 0.0 };
            let pdf = by_lobe * lobe.bounded_pdf(wo, (wo + wi).normalize()) + (1.0 - by_lobe) * wi.z * FRAC_1_PI;
            let coat = rough.f_and_pdf(wo, wi, TransportMode::Radiance, Sides::All).0;
            f64::from((b.f(wo, wi, TransportMode::Radiance)[0] - coat) * wi.z / pdf)
        });
        let drawn = sampled_albedo(&b, wo, 0, draws, 21);
        let se = [coat, inner, drawn].iter().map(|m| m.standard_error().powi(2)).sum::<f64>().sqrt();
        let difference = coat.mean() + inner.mean() - drawn.mean();
        let power = 5.9 * se / drawn.mean();
        assert!(difference.abs() < 3.9 * se, "{name}: {} {} z {}", inner.mean(), drawn.mean(), difference / se);
        assert!(power < if name == "metal" { 0.006 } else { 0.003 }, "{name}: only {power} would be seen");
    }
}

/// The mean of f over a cosine-weighted hemisphere, times pi: the albedo without its importance sampling.
fn mean_value(b: &Bxdf, wo: Vec3, n: u64, lane: usize) -> Mean {
    let mut rng = Rng::new(31);
    Mean::of(n, || f64::from(b.f(wo, cosine(&mut rng), TransportMode::Radiance)[lane] * PI))
}

// The closed form against the random walk it replaces, with both kinds of weights, truncated and not: evaluation at two
// angles of wo, over wi. Detectable: 0.3 % of the body's part.
#[test]
fn closed_forms_equal_the_walks() {
    let limits =
        [WalkLimits::PBRT, WalkLimits { max_depth: 2, n_samples: 1 }, WalkLimits { max_depth: 400, n_samples: 1 }];
    let mut worst: f64 = 0.0;
    for (alpha, thickness, weights, limits) in [
        (0.0, 0.01, CoatWeights::Exact, limits[0]),
        (0.0, 0.5, CoatWeights::Exact, limits[2]),
        (0.001, 0.01, CoatWeights::Pbrt, limits[0]),
        (0.02, 0.01, CoatWeights::Pbrt, limits[1]),
        (0.158, 0.01, CoatWeights::Pbrt, limits[0]),
        (0.158, 0.01, CoatWeights::Exact, limits[0]),
        (0.387, 0.01, CoatWeights::Pbrt, limits[0]),
        (0.387, 0.2, CoatWeights::Exact, limits[2]),
        (0.9, 0.01, CoatWeights::Exact, limits[0]),
    ] {
        let facets = Ggx::new(alpha, alpha);
        let known = Coat::new(1.5, facets, thickness, weights);
        let unknown = Coat::walked(1.5, facets, thickness, weights);
        let (closed, walked) = (coated(&known, 0.9, limits), coated(&unknown, 0.9, limits));
        for theta in [15.0, 65.0] {
            let wo = direction(theta, 0.0);
            // The coat's own lobe is the same in both: leave its neighbourhood out, it would only add noise.
            let away = |b: &Bxdf, n: u64| {
                let mut rng = Rng::new(41);
                Mean::of(n, || {
                    let wi = cosine(&mut rng);
                    let coat = known.interface().f_and_pdf(wo, wi, TransportMode::Radiance, Sides::All).0;
                    let f = b.f(wo, wi, TransportMode::Radiance)[0];
                    f64::from((f - coat) * PI)
                })
            };
            let (a, b) = (away(&closed, 20_000), away(&walked, 400_000));
            let z = (a.mean() - b.mean()) / (a.standard_error().powi(2) + b.standard_error().powi(2)).sqrt();
            let relative = a.mean() / b.mean() - 1.0;
            assert!(
                z.abs() < SIGMAS,
                "alpha {alpha} thickness {thickness} {weights:?} theta {theta}: {} for {}, z = {z}",
                a.mean(),
                b.mean()
            );
            worst = worst.max(relative.abs());
        }
    }
    assert!(worst < 0.004, "worst relative deviation {worst}");
}

// Reversing a path gives the same number: f(wo, wi) in radiance is f(wi, wo) in importance.
#[test]
fn values_are_reciprocal() {
    for case in cases().iter().filter(|c| c.exact) {
        let mut rng = Rng::new(51);
        let mut compared = 0;
        for _ in 0..20_000 {
            let (wo, wi) = (Vec3::from(rng.direction()), Vec3::from(rng.direction()));
            if wo.z.abs().min(wi.z.abs()) < 0.02 {
                continue;
            }
            let a = case.bxdf.f(wo, wi, TransportMode::Radiance);
            let b = case.bxdf.f(wi, wo, TransportMode::Importance);
            for lane in 0..4 {
                assert!((a[lane] - b[lane]).abs() <= 2e-3 * a[lane] + 1e-6, "{}: {wo:?} {wi:?} {a:?} {b:?}", case.name);
            }
            compared += usize::from(!a.is_black());
        }
        assert!(compared > 100 || !case.bxdf.flags().is_non_specular(), "{}: {compared}", case.name);
    }
}

// The same for walks, on average over directions: f(wo, wi) against f(wi, wo), weighted so that the two differ if f is
// not symmetric. Detectable: about 3 %.
#[test]
fn walks_are_reciprocal_on_average() {
    for case in cases().iter().filter(|c| !c.exact) {
        let mut rng = Rng::new(61);
        let (mut a, mut b) = (Mean::new(), Mean::new());
        for _ in 0..200_000 {
            let (wo, wi) = (cosine(&mut rng), cosine(&mut rng));
            // Weighting by the first direction's height makes the two sums differ for an asymmetric f.
            let weight = f64::from(wo.z * wo.z * wo.z);
            a.add(weight * f64::from(case.bxdf.f(wo, wi, TransportMode::Radiance)[0]));
            b.add(weight * f64::from(case.bxdf.f(wi, wo, TransportMode::Importance)[0]));
        }
        let z = (a.mean() - b.mean()) / (a.standard_error().powi(2) + b.standard_error().powi(2)).sqrt();
        assert!(z.abs() < SIGMAS, "{}: {} {} z {z}", case.name, a.mean(), b.mean());
    }
}

/// All that leaves, deltas included; transmitted light as power (importance mode).
fn total(b: &Bxdf, wo: Vec3, lane: usize, n: u64) -> Mean {
    let mut rng = Rng::new(71);
    Mean::of(n, || {
        sample(b, wo, &mut rng, TransportMode::Importance).map_or(0.0, |s| f64::from(s.f[lane] * s.wi.z.abs() / s.pdf))
    })
}

#[test]
fn nothing_gains_energy() {
    for case in cases() {
        for wo in [direction(5.0, 0.0), direction(60.0, 40.0), direction(88.0, 80.0), -direction(50.0, 0.0)] {
            for lane in 0..4 {
                let mean = total(&case.bxdf, wo, lane, 8_000);
                let bound = 1.001 + SIGMAS * mean.standard_error();
                assert!(mean.mean() < bound, "{} from {wo:?}: {}", case.name, mean.mean());
            }
        }
    }
}

// With either kind of weights the drawn paths are the same truth, only the stated density differs. Detectable: 2 %.
#[test]
fn drawn_paths_are_right_with_either_weights() {
    let facets = Ggx::new(0.2, 0.2);
    let [exact, pbrt] = [CoatWeights::Exact, CoatWeights::Pbrt]
        .map(|weights| coated(&Coat::new(1.5, facets, 0.01, weights), 0.9, WalkLimits::PBRT));
    for theta in [10.0, 60.0] {
        let wo = direction(theta, 0.0);
        let (a, b) = (total(&exact, wo, 0, 100_000), total(&pbrt, wo, 0, 100_000));
        assert_means_agree(&a, &b, SIGMAS);
        // Evaluation is brighter, as the reference is.
        let (c, d) = (mean_value(&exact, wo, 100_000, 0), mean_value(&pbrt, wo, 100_000, 0));
        assert!(d.mean() > 1.02 * c.mean(), "{} {}", c.mean(), d.mean());
    }
}

#[test]
fn white_bodies_vanish_in_a_white_furnace() {
    let white_mirror = Conductor::new(s(1.0), s(1e6), Ggx::SMOOTH);
    let lossless = Coat::new(1.5, Ggx::SMOOTH, 0.0, CoatWeights::Exact);
    let unlimited = CoatedDiffuse::new(&lossless, s(1.0), Filling::NONE, WalkLimits::UNLIMITED);
    let bodies = [
        Bxdf::Diffuse(Diffuse::new(s(1.0))),
        Bxdf::DiffuseTransmission(DiffuseTransmission::new(s(0.3), s(0.7))),
        Bxdf::Conductor(white_mirror),
        Bxdf::Dielectric(Dielectric::new(1.5, Ggx::SMOOTH)),
        Bxdf::ThinDielectric(ThinDielectric::new(1.5)),
        Bxdf::CoatedDiffuse(unlimited),
    ];
    for body in bodies {
        for theta in [0.0, 50.0, 85.0] {
            let mean = total(&body, direction(theta, 0.0), 0, 400_000);
            let error = (mean.mean() - 1.0).abs();
            assert!(error < SIGMAS * mean.standard_error() + 1e-3, "{body:?} at {theta}: {}", mean.mean());
            assert!(mean.standard_error() < 4e-4);
        }
    }
    // A smooth paint reflects by a delta, which evaluation does not see: by samples, above. It is the same model.
    let smooth = GlossyPaint::new(&Coat::lossless(1.5, 0.0), s(1.0));
    assert_eq!(smooth, GlossyPaint::new(&lossless, s(1.0)));
    // Our paint: by evaluation, quadrature-like, since its coat is rough. A loss of 1 % would be seen.
    for (eta, alpha) in [(1.5, 0.05), (1.5, 0.3), (1.7, 0.6), (1.5, 1.0)] {
        let paint = Bxdf::GlossyPaint(GlossyPaint::new(&Coat::lossless(eta, alpha), s(1.0)));
        for theta in [0.0, 30.0, 60.0, 80.0] {
            let mean = total(&paint, direction(theta, 0.0), 0, 100_000);
            let error = (mean.mean() - 1.0).abs();
            assert!(error < 0.004 + SIGMAS * mean.standard_error(), "{eta} {alpha} at {theta}: {}", mean.mean());
            assert!(mean.standard_error() < 0.001);
        }
    }
}

// 0.04 + 0.96 (1 - K^5) with K = 0.5963, Fresnel's diffuse internal reflectance at 1.5 (Walsh 1926: 0.596).
#[test]
fn a_depth_limit_costs_what_the_series_says() {
    for (max_depth, expected) in [(10, 0.9276), (2, 0.04 + 0.96 * (1.0 - 0.5963)), (0, 1.0)] {
        let limits = WalkLimits { max_depth, n_samples: 1 };
        for coat in [
            Coat::new(1.5, Ggx::SMOOTH, 0.0, CoatWeights::Exact),
            Coat::walked(1.5, Ggx::SMOOTH, 0.0, CoatWeights::Exact),
        ] {
            let plastic = Bxdf::CoatedDiffuse(CoatedDiffuse::new(&coat, s(1.0), Filling::NONE, limits));
            let mean = total(&plastic, Vec3::Z, 0, 300_000);
            let error = (mean.mean() - expected).abs();
            assert!(error < 5e-4 + SIGMAS * mean.standard_error(), "depth {max_depth}: {}", mean.mean());
            assert!(mean.standard_error() < 1e-3);
        }
    }
    let coat = Coat::new(1.5, Ggx::SMOOTH, 0.0, CoatWeights::Exact);
    assert!((coat.internal_reflectance - 0.5963).abs() < 2e-4, "{}", coat.internal_reflectance);
}

// pbrt-v4's deviation from the truth, which its weights cause: figures from an independent quadrature (NumPy, 2 M points)
// of the same weights at eta 1.5, thickness 0.01.
#[test]
fn the_reference_renderers_weights_are_reproduced() {
    for (alpha, mu, transmitted, ratio) in [
        (0.1, 0.2, 0.7047, 1.1293),
        (0.1, 1.0, 0.9496, 1.0182),
        (0.158, 0.5, 0.8907, 1.0687),
        (0.387, 0.2, 0.7642, 1.1339),
        (0.387, 0.8, 0.9191, 1.0855),
    ] {
        let coat = Coat::new(1.5, Ggx::new(alpha, alpha), 0.01, CoatWeights::Pbrt);
        let (enter, exit) = (coat.enter(mu), coat.exit(mu));
        assert!((enter / transmitted - 1.0).abs() < 2e-3, "{alpha} {mu}: {enter} for {transmitted}");
        assert!((exit / enter / ratio - 1.0).abs() < 2e-3, "{alpha} {mu}: {} for {ratio}", exit / enter);
    }
}

// Tables against direct integration between their nodes.
#[test]
fn tables_are_true_between_nodes() {
    for alpha in [0.005, 0.05, 0.2, 0.7] {
        let pane = Dielectric::new(1.5, Ggx::new(alpha, alpha));
        let coat = Coat::new(1.5, Ggx::new(alpha, alpha), 0.0, CoatWeights::Exact);
        for mu in [0.03f32, 0.1, 0.23, 0.42, 0.77, 0.96] {
            let w = Vec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
            let mut rng = Rng::new(81);
            let mean = Mean::of(200_000, || {
                let u = Point2::new(rng.next_f32(), rng.next_f32());
                pane.sample_interface(w, 0.5, u, TransportMode::Importance, Sides::Transmission)
                    .map_or(0.0, |s| f64::from(s.weight))
            });
            let error = (f64::from(coat.enter(mu)) - mean.mean()).abs();
            let allowed = SIGMAS * mean.standard_error() + 2e-3 * mean.mean();
            assert!(error < allowed, "{alpha} {mu}: {} for {}", coat.enter(mu), mean.mean());
        }
    }
}

#[test]
fn rough_becomes_smooth() {
    let eta = s(0.2);
    let k = s(3.9);
    let wo = direction(40.0, 0.0);
    for (rough, smooth) in [
        (
            Bxdf::Dielectric(Dielectric::new(1.5, Ggx::new(2e-3, 2e-3))),
            Bxdf::Dielectric(Dielectric::new(1.5, Ggx::SMOOTH)),
        ),
        (
            Bxdf::Conductor(Conductor::new(eta, k, Ggx::new(2e-3, 2e-3))),
            Bxdf::Conductor(Conductor::new(eta, k, Ggx::SMOOTH)),
        ),
        (coated(&coats()[1], 0.7, WalkLimits::PBRT), coated(&coats()[0], 0.7, WalkLimits::PBRT)),
    ] {
        let (a, b) = (total(&rough, wo, 0, 200_000), total(&smooth, wo, 0, 200_000));
        assert!((a.mean() - b.mean()).abs() < 1e-3 + SIGMAS * (a.standard_error() + b.standard_error()));
    }
}

// Sharp lobes keep their digits: the peak of a lobe of alpha 0.001 integrates to 1 over half vectors, in f32.
#[test]
fn sharp_lobes_integrate_to_one() {
    for alpha in [0.001f32, 0.01, 0.3] {
        let facets = Ggx::new(alpha, 2.0 * alpha);
        let mut rng = Rng::new(91);
        // Sample slopes of a distribution twice as rough and weigh.
        let wider = Ggx::new(2.0 * alpha, 2.0 * alpha);
        let mean = Mean::of(400_000, || {
            let m = wider.sample_visible(Vec3::Z, Point2::new(rng.next_f32(), rng.next_f32()));
            f64::from(facets.d(m) / wider.d(m))
        });
        assert_mean_close(&mean, 1.0, SIGMAS);
    }
}

#[test]
fn hostile_directions_give_zeros_and_no_nan() {
    let tiny = f32::MIN_POSITIVE;
    let hostile = [
        Vec3::ZERO,
        Vec3::X,
        -Vec3::Y,
        Vec3::Z,
        -Vec3::Z,
        Vec3::new(1.0, 0.0, 1e-8),
        Vec3::new(1.0, 0.0, -1e-8),
        Vec3::new(0.0, 1.0, 1e-20),
        Vec3::new(0.0, 1.0, tiny),
        Vec3::new(0.0, -1.0, f32::from_bits(1)),
        Vec3::new(f32::NAN, 0.0, 1.0),
        Vec3::new(0.0, 0.0, f32::NAN),
        Vec3::new(f32::INFINITY, 0.0, 1.0),
        Vec3::new(0.6, 0.0, 0.8),
        Vec3::new(-0.6, 0.0, 0.8),
        Vec3::new(-0.6, 0.0, -0.8),
    ];
    let corners = [0.0, 0.5, 1.0 - f32::EPSILON / 2.0];
    for mut case in cases() {
        for pass in 0..2 {
            for wo in hostile {
                for wi in hostile {
                    for mode in [TransportMode::Radiance, TransportMode::Importance] {
                        let (f, pdf) = case.bxdf.f_and_pdf(wo, wi, mode);
                        assert!(f.is_finite() && f.min_component() >= 0.0, "{} {wo:?} {wi:?} {f:?}", case.name);
                        assert!(pdf.is_finite() && pdf >= 0.0, "{} {wo:?} {wi:?} {pdf}", case.name);
                        if !is_usable(wo) || !is_usable(wi) {
                            assert!(f.is_black() && pdf == 0.0, "{}", case.name);
                        }
                        for which in [Sides::Reflection, Sides::Transmission] {
                            let pdf = case.bxdf.pdf(wo, wi, mode, which);
                            assert!(pdf.is_finite() && pdf >= 0.0, "{} {wo:?} {wi:?}", case.name);
                        }
                    }
                }
                for uc in corners {
                    for x in corners {
                        for y in corners {
                            for which in [Sides::All, Sides::Reflection, Sides::Transmission] {
                                let u = Point2::new(x, y);
                                let Some(s) = case.bxdf.sample(wo, uc, u, TransportMode::Radiance, which) else {
                                    continue;
                                };
                                assert!(is_usable(wo) && is_usable(s.wi), "{} {wo:?} {s:?}", case.name);
                                assert!(s.f.is_finite() && s.f.min_component() >= 0.0, "{} {s:?}", case.name);
                                assert!(s.pdf > 0.0 && s.pdf.is_finite() && s.eta > 0.0, "{} {s:?}", case.name);
                                assert!(which == Sides::All || which.reflection() == s.lobe.is_reflective());
                            }
                        }
                    }
                }
            }
            if pass == 0 {
                case.bxdf.regularize();
            }
        }
    }
}

#[test]
fn flags_tell_what_sampling_does() {
    for case in cases() {
        let flags = case.bxdf.flags();
        let mut rng = Rng::new(101);
        for wo in outgoing() {
            for _ in 0..500 {
                let Some(s) = sample(&case.bxdf, wo, &mut rng, TransportMode::Radiance) else { continue };
                assert!(!s.lobe.is_specular() || flags.is_specular(), "{}", case.name);
                assert!(s.lobe.is_specular() || flags.is_non_specular(), "{}", case.name);
                assert!(!s.lobe.is_transmissive() || flags.is_transmissive(), "{}", case.name);
                assert!(s.lobe.is_transmissive() || s.eta == 1.0);
            }
        }
    }
}

// A mirror returns to the mirror direction, a sign to where light came from.
#[test]
fn lobes_peak_where_they_should() {
    let wo = direction(40.0, 25.0);
    let mirror = Vec3::new(-wo.x, -wo.y, wo.z);
    let sign = Bxdf::Retroreflective(Retroreflective::new(s(0.9), s(0.1), Ggx::new(0.05, 0.05)));
    let (back, forth) = (sign.f(wo, wo, TransportMode::Radiance)[0], sign.f(wo, mirror, TransportMode::Radiance)[0]);
    assert!(back > 100.0 * forth, "{back} {forth}");
    let metal = conductor(0.05, 0.05);
    let (back, forth) = (metal.f(wo, wo, TransportMode::Radiance)[0], metal.f(wo, mirror, TransportMode::Radiance)[0]);
    assert!(forth > 100.0 * back, "{back} {forth}");
}

#[test]
fn rho_is_the_albedo() {
    let diffuse = Bxdf::Diffuse(Diffuse::new(SampledSpectrum([0.1, 0.2, 0.3, 0.4])));
    let rho = diffuse.rho_hd(direction(30.0, 0.0), 16);
    for lane in 0..4 {
        assert!((rho[lane] - 0.1 * (lane + 1) as f32).abs() < 1e-5);
    }
    let plastic = coated(&coats()[2], 0.5, WalkLimits::PBRT);
    let wo = direction(30.0, 0.0);
    let (a, b) = (plastic.rho_hd(wo, 4096)[0], total(&plastic, wo, 0, 100_000));
    assert!((f64::from(a) - b.mean()).abs() < 0.02);
    let value = mean_value(&plastic, wo, 200_000, 0);
    assert!((value.mean() - b.mean()).abs() < SIGMAS * (value.standard_error() + b.standard_error()));
    assert_eq!(diffuse.rho_hd(wo, 0), SampledSpectrum::ZERO);
}
