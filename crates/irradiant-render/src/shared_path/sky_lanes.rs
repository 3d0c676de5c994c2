//! What [`sky`](super::sky) does for a block, in lanes: its sixteen first vertices are the lanes of the loops.

use super::PIXELS;
use super::blocks::{Blocks, Model, Receivers, Sixteen, Spectra, Three, set_spectrum, spectrum};
use super::sky::{GLIMPSES, Glimpse, LEAST_SHARE, ROUNDS, SharedSky};
use crate::camera_samples::BatchSample;
use crate::integrator::RenderStats;
use irradiant_core::bxdf::TransportMode;
use irradiant_core::geometry::Kernel;
use irradiant_core::light::SkyPoint;
use irradiant_core::scene::Scene;
use irradiant_math::{Ray, Vec3, offset_ray_origin};
use irradiant_spectrum::{Basis, N_WAVELENGTHS};

/// A glimpse of the sky as the first vertices of its block have it.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
struct Outlook {
    glimpse: Glimpse,
    /// The vertex that found it.
    finder: usize,
    /// Whether a ray of the finder is on its way there.
    is_asked: bool,
    /// Towards it, the same for all.
    wi: Three,
    /// Where the rays to it begin.
    o: Three,
    /// What is scattered, with the cosine; and the density with which it is found, 1/sr, 0 where nothing is scattered.
    f_cos: Spectra,
    pdf: Sixteen,
    /// Not 0 where anything is.
    scatters: [u32; PIXELS],
    /// What the radiance is multiplied with in the sum.
    share: f32,
    /// See [`Glimpse::expected`].
    expected: f32,
    /// Of those who test it, the inverse of the chance that they do; or 0. Once tested, 0 where something is in the way.
    inverse_chance: Sixteen,
    /// Its radiance at the wavelengths of those who see it.
    radiance: Spectra,
}

impl Outlook {
    const NONE: Self = Self {
        glimpse: Glimpse { point: SkyPoint { wi: Vec3::Z, pdf: 0.0, rgb: [0.0; 3] }, factor: 0.0, sees: false },
        finder: 0,
        is_asked: false,
        wi: Three::ZERO,
        o: Three::ZERO,
        f_cos: [[0.0; PIXELS]; N_WAVELENGTHS],
        pdf: [0.0; PIXELS],
        scatters: [0; PIXELS],
        share: 0.0,
        expected: 0.0,
        inverse_chance: [0.0; PIXELS],
        radiance: [[0.0; PIXELS]; N_WAVELENGTHS],
    };

    fn ray(&self, i: usize, time: f32) -> Ray {
        Ray::new(self.o.point(i), self.wi.vector(i), time)
    }
}

/// All first vertices of a block look in one direction. Models of their own are still to be asked.
struct LookOut<'a> {
    receivers: &'a Receivers,
    out: &'a mut Outlook,
}

impl Kernel for LookOut<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { receivers: r, out } = self;
        for i in 0..PIXELS {
            let o = offset_ray_origin(r.p.point(i), r.p_error.vector(i), r.n.normal(i), out.wi.vector(i));
            out.o.set(i, o.to_array());
        }
        r.scatter(&out.wi, &mut out.f_cos, &mut out.pdf, &mut out.scatters);
        for i in 0..PIXELS {
            let scatters = (out.scatters[i] != 0) & (out.pdf[i] > 0.0) & (out.pdf[i] < f32::INFINITY);
            out.scatters[i] = u32::from(scatters);
            out.pdf[i] = if scatters { out.pdf[i] } else { 0.0 };
        }
    }
}

/// Which directions each first vertex tests, as [`choose`](super::sky) has it.
struct Choose<'a> {
    outlooks: &'a mut [Outlook],
    /// Where on its line of chances each one's first mark is.
    marks: &'a mut Sixteen,
    tests: f32,
}

impl Kernel for Choose<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { outlooks, marks, tests } = self;
        let mut weights = [[0.0; PIXELS]; GLIMPSES];
        let (mut positive, mut total) = ([0.0; PIXELS], [0.0; PIXELS]);
        for (outlook, weights) in outlooks.iter().zip(&mut weights) {
            for i in 0..PIXELS {
                let [a, b, c, d] = &outlook.f_cos;
                let most = a[i].max(b[i]).max(c[i].max(d[i]));
                let counts = (i != outlook.finder) & (outlook.scatters[i] != 0);
                weights[i] = if counts { most * outlook.expected } else { 0.0 };
                positive[i] += if weights[i] > 0.0 { 1.0 } else { 0.0 };
                total[i] += weights[i];
            }
        }
        for weights in &mut weights[..outlooks.len()] {
            for i in 0..PIXELS {
                let least = LEAST_SHARE * total[i];
                weights[i] = if weights[i] > 0.0 { weights[i].max(least) } else { 0.0 };
            }
        }
        let mut scale = [0.0; PIXELS];
        for _ in 0..ROUNDS {
            let (mut certain, mut rest) = ([0.0; PIXELS], [0.0; PIXELS]);
            for weights in &weights[..outlooks.len()] {
                for i in 0..PIXELS {
                    let is_certain = weights[i] * scale[i] >= 1.0;
                    certain[i] += if is_certain { 1.0 } else { 0.0 };
                    rest[i] += if is_certain { 0.0 } else { weights[i] };
                }
            }
            for i in 0..PIXELS {
                let is_any = (rest[i] > 0.0) & (tests > certain[i]);
                scale[i] = if is_any { (tests - certain[i]) / rest[i] } else { scale[i] };
            }
        }
        for i in 0..PIXELS {
            scale[i] = if positive[i] <= tests { f32::INFINITY } else { scale[i] };
        }
        for (outlook, weights) in outlooks.iter_mut().zip(&weights) {
            for i in 0..PIXELS {
                let chance = (weights[i] * scale[i]).min(1.0);
                let (counts, is_certain) = (weights[i] > 0.0, chance >= 1.0);
                let left = marks[i] - chance;
                let is_hit = is_certain | (left < 0.0);
                let moved = if is_hit { left + 1.0 } else { left };
                marks[i] = if counts & !is_certain { moved } else { marks[i] };
                outlook.inverse_chance[i] = if counts & is_hit { 1.0 / chance } else { 0.0 };
            }
        }
    }
}

/// What the tested directions bring to each first vertex.
struct Bring<'a>(&'a [Outlook]);

impl Kernel for Bring<'_> {
    type Output = Spectra;
    #[inline(always)]
    fn run(self) -> Spectra {
        let mut sums = [[0.0; PIXELS]; N_WAVELENGTHS];
        for outlook in self.0 {
            for k in 0..N_WAVELENGTHS {
                for i in 0..PIXELS {
                    let inverse_chance = outlook.inverse_chance[i];
                    let light = outlook.f_cos[k][i] * outlook.radiance[k][i] * (outlook.share * inverse_chance);
                    sums[k][i] += if inverse_chance > 0.0 { light } else { 0.0 };
                }
            }
        }
        sums
    }
}

/// What sharing the sky needs, kept from batch to batch.
pub(super) struct Outlooks {
    all: Vec<Outlook>,
    rays: Vec<Ray>,
    ends: Vec<f32>,
    blocked: Vec<bool>,
}

impl Outlooks {
    pub fn new() -> Self {
        Self { all: vec![Outlook::NONE; GLIMPSES], rays: Vec::new(), ends: Vec::new(), blocked: Vec::new() }
    }

    /// Brings the sky to all first vertices of a batch.
    pub fn share(
        &mut self,
        scene: &Scene,
        sky: &SharedSky,
        samples: &[BatchSample],
        blocks: &mut Blocks,
        stats: &mut RenderStats,
    ) {
        for block in 0..samples.len() / PIXELS {
            let n = self.look_out(scene, sky, block, blocks, stats);
            let (outlooks, marks) = (&mut self.all[..n], &mut blocks.marks[block]);
            scene.geometry.level().run(Choose { outlooks, marks, tests: sky.tests as f32 });
            self.test(scene, n, blocks.receivers[block].time, stats);
            for outlook in &mut self.all[..n] {
                let radiance = |i: usize| sky.sky.radiance(&outlook.glimpse.point, &samples[block * PIXELS + i].lambda);
                if scene.basis() == Basis::Rgb {
                    // The same for all.
                    outlook.radiance = radiance(0).0.map(|value| [value; PIXELS]);
                    continue;
                }
                for i in (0..PIXELS).filter(|i| outlook.inverse_chance[*i] > 0.0) {
                    set_spectrum(&mut outlook.radiance, i, radiance(i));
                }
            }
            let sums = scene.geometry.level().run(Bring(&self.all[..n]));
            for (i, own) in blocks.own[block * PIXELS..][..PIXELS].iter_mut().enumerate() {
                *own += spectrum(&sums, i);
            }
        }
    }

    /// What each first vertex of a block scatters of each glimpse, and whether finders see what they drew as light samples. How many glimpses
    /// there are.
    fn look_out(
        &mut self,
        scene: &Scene,
        sky: &SharedSky,
        block: usize,
        blocks: &Blocks,
        stats: &mut RenderStats,
    ) -> usize {
        let (mut n, receivers) = (0, &blocks.receivers[block]);
        let is_any_alone = receivers.models.iter().any(|model| matches!(model, Model::Alone(_)));
        self.rays.clear();
        for (place, glimpse) in blocks.glimpses[block].iter().enumerate() {
            let Some(glimpse) = glimpse else { continue };
            let out = &mut self.all[n];
            n += 1;
            (out.finder, out.glimpse) = (place % PIXELS, *glimpse);
            let wi = glimpse.point.wi;
            (0..PIXELS).for_each(|i| out.wi.set(i, wi.to_array()));
            scene.geometry.level().run(LookOut { receivers, out });
            for i in (0..PIXELS).filter(|_| is_any_alone) {
                if let Model::Alone(k) = receivers.models[i] {
                    let (bsdf, wo) = &blocks.alone[k as usize];
                    let (f, pdf) = bsdf.f_and_pdf(*wo, wi, TransportMode::Radiance);
                    let f_cos = f * bsdf.abs_cos(wi);
                    let scatters = pdf.is_finite() && !f_cos.is_black();
                    set_spectrum(&mut out.f_cos, i, f_cos);
                    (out.pdf[i], out.scatters[i]) = if scatters { (pdf, 1) } else { (0.0, 0) };
                }
            }
            // Light samples come first.
            out.is_asked = place < PIXELS && out.scatters[out.finder] != 0;
            if out.is_asked {
                self.rays.push(out.ray(out.finder, receivers.time));
            }
        }
        self.trace(scene, stats);
        let mut answers = self.blocked.iter();
        for out in &mut self.all[..n] {
            if out.is_asked {
                out.glimpse.sees = answers.next() == Some(&false);
            }
            let density = sky.density(blocks.seeking[block], &out.glimpse.point, &out.pdf);
            (out.share, out.expected) = (out.glimpse.share(density), out.glimpse.expected(density));
        }
        n
    }

    /// Traces what has been chosen, and adds what needs no ray.
    fn test(&mut self, scene: &Scene, n: usize, time: f32, stats: &mut RenderStats) {
        self.rays.clear();
        for out in &self.all[..n] {
            for i in (0..PIXELS).filter(|i| out.inverse_chance[*i] > 0.0) {
                self.rays.push(out.ray(i, time));
            }
        }
        self.trace(scene, stats);
        let mut answers = self.blocked.iter();
        for out in &mut self.all[..n] {
            for i in 0..PIXELS {
                if out.inverse_chance[i] > 0.0 && answers.next() == Some(&true) {
                    out.inverse_chance[i] = 0.0;
                }
            }
            let is_own = out.glimpse.sees && out.scatters[out.finder] != 0;
            out.inverse_chance[out.finder] = if is_own { 1.0 } else { 0.0 };
        }
    }

    /// Whether anything is in the way of the rays.
    fn trace(&mut self, scene: &Scene, stats: &mut RenderStats) {
        self.ends.clear();
        self.ends.resize(self.rays.len(), f32::INFINITY);
        self.blocked.clear();
        self.blocked.resize(self.rays.len(), false);
        scene.geometry.occluded_batch(&self.rays, &self.ends, &scene.alpha(), &mut self.blocked);
        stats.shadow_rays += self.rays.len() as u64;
    }
}
