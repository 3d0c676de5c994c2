//! The pixel filter, by importance sampling: each sample falls into one pixel, at an offset drawn from |f|, and its
//! weight has mean 1 (Ernst et al. 2006). Weights are exactly 1 for filters without negative lobes.

use irradiant_math::elementary::{exp, sin};
use irradiant_math::lanes::{Floats, whole};
use irradiant_math::{Point2, warp};
use irradiant_scene::desc::{FilterDesc, FilterKind};
use std::f32::consts::PI;

/// A pixel filter.
#[derive(Clone, Debug)]
pub enum Filter {
    /// Constant within the radii.
    Box {
        /// Pixels.
        radius: [f32; 2],
    },
    /// Tent.
    Triangle {
        /// Pixels.
        radius: [f32; 2],
    },
    /// A product of two tabulated profiles.
    Tabulated(Box<[Profile; 2]>),
}

/// An offset and its weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSample {
    /// From the pixel's centre, pixels.
    pub offset: [f32; 2],
    /// Filter over (density times the filter's integral); mean 1.
    pub weight: f32,
}

const CELLS: usize = 1024;

/// Parts of [0, 1) for each of which the search for a cell knows where to begin.
const GUIDES: usize = 1024;

/// One dimension of a separable filter, constant in each of many cells.
#[derive(Clone, Debug)]
pub struct Profile {
    radius: f32,
    cdf: Vec<f32>,
    /// For each part of [0, 1) the cell that its start lies in: a search from there takes a step or two.
    guide: Vec<u16>,
    /// Sign over |f|'s share: the weight of a sample in a cell; +w or -w.
    weight: Vec<f32>,
}

impl Profile {
    fn new(radius: f32, f: impl Fn(f32) -> f32) -> Self {
        let at = |i: usize| f(radius * (2.0 * (i as f32 + 0.5) / CELLS as f32 - 1.0)) as f64;
        let values: Vec<f64> = (0..CELLS).map(at).collect();
        let (sum, sum_abs) = values.iter().fold((0.0, 0.0), |(s, a), v| (s + v, a + v.abs()));
        let mut cdf = Vec::with_capacity(CELLS + 1);
        let mut running = 0.0;
        cdf.push(0.0);
        for v in &values {
            running += v.abs();
            cdf.push((running / sum_abs) as f32);
        }
        let magnitude = sum_abs / sum;
        // All of one sign: exactly 1, whatever the rounding of the sums.
        let magnitude = if values.iter().all(|v| *v >= 0.0) { 1.0 } else { magnitude as f32 };
        let weight = values.iter().map(|v| if *v < 0.0 { -magnitude } else { magnitude }).collect();
        let cell_of = |u: f32| cdf.partition_point(|c| *c <= u).clamp(1, CELLS) - 1;
        let guide = (0..GUIDES).map(|i| cell_of(i as f32 / GUIDES as f32) as u16).collect();
        Self { radius, cdf, guide, weight }
    }

    #[inline]
    fn sample(&self, u: f32) -> (f32, f32) {
        // The last cell that starts at or below u.
        let mut cell = usize::from(self.guide[((u * GUIDES as f32) as usize).min(GUIDES - 1)]);
        while cell + 1 < CELLS && self.cdf[cell + 1] <= u {
            cell += 1;
        }
        let (lo, hi) = (self.cdf[cell], self.cdf[cell + 1]);
        let within = if hi > lo { ((u - lo) / (hi - lo)).clamp(0.0, 1.0) } else { 0.5 };
        (self.radius * (2.0 * (cell as f32 + within) / CELLS as f32 - 1.0), self.weight[cell])
    }

    /// Density times weight, per pixel of length.
    fn value(&self, x: f32) -> f32 {
        let cell = ((x / self.radius + 1.0) * (0.5 * CELLS as f32)).floor();
        if !(cell >= 0.0 && cell < CELLS as f32) {
            return 0.0;
        }
        let cell = cell as usize;
        (self.cdf[cell + 1] - self.cdf[cell]) * self.weight[cell] * CELLS as f32 / (2.0 * self.radius)
    }
}

impl Filter {
    /// From its description, whose radii are positive and finite.
    pub fn new(desc: &FilterDesc) -> Self {
        let radius = [desc.x_radius.value, desc.y_radius.value];
        let separable =
            |f: &dyn Fn(f32, f32) -> f32| Self::Tabulated(Box::new(radius.map(|r| Profile::new(r, |x| f(x, r)))));
        match desc.kind {
            FilterKind::Box => Self::Box { radius },
            FilterKind::Triangle => Self::Triangle { radius },
            FilterKind::Gaussian { sigma } => {
                let s = sigma.value;
                let g = |x: f32| exp(-x * x / (2.0 * s * s));
                separable(&|x, r| (g(x) - g(r)).max(0.0))
            }
            FilterKind::Mitchell { b, c } => separable(&|x, r| mitchell(2.0 * x / r, b.value, c.value)),
            FilterKind::Sinc { tau } => separable(&|x, _| sinc(x) * sinc(x / tau.value)),
        }
    }

    /// An offset by two numbers in [0, 1).
    #[inline]
    pub fn sample(&self, u: Point2) -> FilterSample {
        match self {
            Self::Box { radius } => {
                FilterSample { offset: [evenly(u.x, radius[0]), evenly(u.y, radius[1])], weight: 1.0 }
            }
            Self::Triangle { radius } => {
                FilterSample { offset: [warp::tent(u.x, radius[0]), warp::tent(u.y, radius[1])], weight: 1.0 }
            }
            Self::Tabulated(profiles) => {
                let ((x, wx), (y, wy)) = (profiles[0].sample(u.x), profiles[1].sample(u.y));
                FilterSample { offset: [x, y], weight: wx * wy }
            }
        }
    }

    /// For `n` lanes offsets, in place of the numbers that draw them, and weights: those of [`Filter::sample`], to the bit. Tabulated profiles are
    /// searched one after another.
    #[inline(always)]
    pub fn sample_lanes(&self, n: usize, [x, y]: &mut [Floats; 2], weight: &mut Floats) {
        weight[whole(n)].fill(1.0);
        match self {
            Self::Box { radius } => {
                for i in whole(n) {
                    (x[i], y[i]) = (evenly(x[i], radius[0]), evenly(y[i], radius[1]));
                }
            }
            Self::Triangle { radius } => {
                for i in whole(n) {
                    (x[i], y[i]) = (warp::tent(x[i], radius[0]), warp::tent(y[i], radius[1]));
                }
            }
            Self::Tabulated(_) => {
                for i in 0..n {
                    let FilterSample { offset, weight: w } = self.sample(Point2::new(x[i], y[i]));
                    (x[i], y[i], weight[i]) = (offset[0], offset[1], w);
                }
            }
        }
    }

    /// Half-widths of the support, pixels.
    pub fn radius(&self) -> [f32; 2] {
        match self {
            Self::Box { radius } | Self::Triangle { radius } => *radius,
            Self::Tabulated(profiles) => [profiles[0].radius, profiles[1].radius],
        }
    }

    /// The filter at an offset from a pixel's centre over its integral, per square pixel: what light that arrives there
    /// adds to that pixel. Exactly the function that [`Filter::sample`] draws from, with its weights.
    pub fn value(&self, offset: [f32; 2]) -> f32 {
        match self {
            Self::Box { radius } => {
                // Half open, so that a place between two pixels belongs to one of them.
                let inside = |x: f32, r: f32| -r <= x && x < r;
                let [x, y] = offset;
                if inside(x, radius[0]) && inside(y, radius[1]) { 0.25 / (radius[0] * radius[1]) } else { 0.0 }
            }
            Self::Triangle { radius } => {
                let tent = |x: f32, r: f32| (r - x.abs()).max(0.0) / (r * r);
                tent(offset[0], radius[0]) * tent(offset[1], radius[1])
            }
            Self::Tabulated(profiles) => profiles[0].value(offset[0]) * profiles[1].value(offset[1]),
        }
    }
}

/// A point of [-radius, radius).
#[inline(always)]
fn evenly(u: f32, radius: f32) -> f32 {
    radius * (2.0 * u - 1.0)
}

fn sinc(x: f32) -> f32 {
    let x = PI * x;
    if x.abs() < 1e-4 { 1.0 } else { sin(x) / x }
}

/// Mitchell and Netravali 1988, support [-2, 2].
fn mitchell(x: f32, b: f32, c: f32) -> f32 {
    let x = x.abs();
    if x <= 1.0 {
        ((12.0 - 9.0 * b - 6.0 * c) * x * x * x + (-18.0 + 12.0 * b + 6.0 * c) * x * x + (6.0 - 2.0 * b)) / 6.0
    } else if x <= 2.0 {
        ((-b - 6.0 * c) * x * x * x + (6.0 * b + 30.0 * c) * x * x + (-12.0 * b - 48.0 * c) * x + (8.0 * b + 24.0 * c))
            / 6.0
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Kernel, Level};
    use irradiant_math::lanes::LANES;
    use irradiant_scene::{Span, Spanned};

    fn filter(kind: FilterKind, radius: f32) -> Filter {
        let r = Spanned::unplaced(radius);
        Filter::new(&FilterDesc { kind, x_radius: r, y_radius: r, span: Span::NONE })
    }

    // The guided search is the plain one: at, below and above every step of the distribution function.
    #[test]
    fn cells_are_found_as_by_bisection() {
        for f in [(|x: f32| exp(-2.0 * x * x)) as fn(f32) -> f32, |x| if x < 0.3 { 0.0 } else { 1.0 }, |x| x, sinc] {
            let profile = Profile::new(4.0, f);
            let ends = profile.cdf.iter().flat_map(|&c| [c.next_down(), c, c.next_up()]);
            for u in ends.filter(|u| (0.0..1.0).contains(u)) {
                let cell = profile.cdf.partition_point(|c| *c <= u).clamp(1, CELLS) - 1;
                let (x, weight) = profile.sample(u);
                assert_eq!(weight, profile.weight[cell]);
                let place = (x / profile.radius + 1.0) * (0.5 * CELLS as f32);
                assert!((cell as f32 - 1e-3..=cell as f32 + 1.001).contains(&place), "{u} {cell} {place}");
            }
        }
    }

    /// One dimension by a regular grid of u; the other's weight is divided out. The grid's error is about 1e-3.
    #[test]
    fn weights_have_mean_one_and_moments_match_quadrature() {
        let s = |x: f32| Spanned::unplaced(x);
        let third = s(1.0 / 3.0);
        type Shape<'a> = &'a dyn Fn(f32) -> f32;
        let cases: [(FilterKind, f32, Shape); 5] = [
            (FilterKind::Box, 0.5, &|_| 1.0),
            (FilterKind::Triangle, 2.0, &|x| 2.0 - x.abs()),
            (FilterKind::Gaussian { sigma: s(0.5) }, 1.5, &|x| exp(-2.0 * x * x) - exp(-4.5)),
            (FilterKind::Mitchell { b: third, c: third }, 2.0, &|x| mitchell(x, 1.0 / 3.0, 1.0 / 3.0)),
            (FilterKind::Sinc { tau: s(3.0) }, 4.0, &|x| sinc(x) * sinc(x / 3.0)),
        ];
        for (kind, radius, f) in cases {
            let filter = filter(kind, radius);
            let n = 20_000;
            let grid = |i: usize| (i as f32 + 0.5) / n as f32;
            let (mut mean, mut second, mut area, mut moment) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
            // At the centre in y the weight is the positive one, whose square root is one dimension's.
            let one_dimension = filter.sample(Point2::new(0.5, 0.5)).weight.sqrt();
            for i in 0..n {
                let sample = filter.sample(Point2::new(grid(i), 0.5));
                assert!(sample.offset[0].abs() <= radius);
                let w = (sample.weight / one_dimension) as f64;
                mean += w;
                second += w * (sample.offset[0] * sample.offset[0]) as f64;
                let x = radius * (2.0 * grid(i) - 1.0);
                area += f(x) as f64;
                moment += (f(x) * x * x) as f64;
            }
            let n = n as f64;
            assert!((mean / n - 1.0).abs() < 2e-3, "{kind:?}: mean weight {}", mean / n);
            let (got, expected) = (second / n, moment / area);
            assert!((got - expected).abs() < 5e-3 * radius as f64, "{kind:?}: second moment {got}, {expected}");
        }
    }

    /// Light that arrives on the film adds to pixels what samples of these pixels would have found: the value is density
    /// times weight, cell by cell of a histogram (200,000 draws: 5 % of a cell would be seen), and has integral 1.
    #[test]
    fn values_are_what_is_drawn() {
        let s = |x: f32| Spanned::unplaced(x);
        let third = s(1.0 / 3.0);
        for (kind, radius) in [
            (FilterKind::Box, 0.5),
            (FilterKind::Triangle, 2.0),
            (FilterKind::Gaussian { sigma: s(0.5) }, 1.5),
            (FilterKind::Mitchell { b: third, c: third }, 2.0),
            (FilterKind::Sinc { tau: s(3.0) }, 4.0),
        ] {
            let filter = filter(kind, radius);
            assert_eq!(filter.radius(), [radius; 2]);
            const CELLS: usize = 16;
            let cell = 2.0 * radius / CELLS as f32;
            let (mut drawn, mut valued) = (vec![0f64; CELLS * CELLS], vec![0f64; CELLS * CELLS]);
            let n = 512;
            for i in 0..n * n {
                let u = Point2::new(((i % n) as f32 + 0.5) / n as f32, ((i / n) as f32 + 0.5) / n as f32);
                let sample = filter.sample(u);
                let at = |x: f32| (((x + radius) / cell) as usize).min(CELLS - 1);
                drawn[at(sample.offset[1]) * CELLS + at(sample.offset[0])] += f64::from(sample.weight) / (n * n) as f64;
                let place = |u: f32| radius * (2.0 * u - 1.0);
                let offset = [place(u.x), place(u.y)];
                let area = f64::from(2.0 * radius / n as f32).powi(2);
                valued[at(offset[1]) * CELLS + at(offset[0])] += f64::from(filter.value(offset)) * area;
            }
            let total: f64 = valued.iter().sum();
            assert!((total - 1.0).abs() < 2e-3, "{kind:?}: {total}");
            let most = valued.iter().fold(0f64, |m, v| m.max(v.abs()));
            for (a, b) in drawn.iter().zip(&valued) {
                assert!((a - b).abs() < 0.05 * most, "{kind:?}: {a} {b}");
            }
            assert_eq!(filter.value([1.1 * radius, 0.0]), 0.0);
        }
    }

    struct Draw<'a>(&'a Filter, &'a mut [Floats; 2], &'a mut Floats);

    impl Kernel for Draw<'_> {
        type Output = ();
        #[inline(always)]
        fn run(self) {
            self.0.sample_lanes(N, self.1, self.2);
        }
    }

    /// Not whole vectors.
    const N: usize = 233;

    #[test]
    fn lanes_have_the_places_of_single_samples() {
        let s = |x: f32| Spanned::unplaced(x);
        let kinds = [FilterKind::Box, FilterKind::Triangle, FilterKind::Sinc { tau: s(3.0) }];
        for filter in kinds.map(|kind| filter(kind, 1.7)) {
            let mut rng = irradiant_testkit::Rng::new(1);
            let drawn: [Floats; 2] = std::array::from_fn(|_| std::array::from_fn(|_| rng.next_f32()));
            for level in Level::available() {
                let (mut places, mut weight) = (drawn, [-7.0; LANES]);
                level.run(Draw(&filter, &mut places, &mut weight));
                for i in 0..N {
                    let found = FilterSample { offset: [places[0][i], places[1][i]], weight: weight[i] };
                    assert_eq!(found, filter.sample(Point2::new(drawn[0][i], drawn[1][i])), "{level:?}");
                }
            }
        }
    }

    #[test]
    fn positive_filters_have_weight_exactly_one() {
        let filter = filter(FilterKind::Gaussian { sigma: Spanned::unplaced(0.5) }, 1.5);
        for i in 0..100 {
            assert_eq!(filter.sample(Point2::new(i as f32 / 100.0, 0.7)).weight, 1.0);
        }
    }
}
