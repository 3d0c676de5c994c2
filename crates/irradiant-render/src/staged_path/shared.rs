//! What [`sharedpath`](crate::shared_path) does otherwise at the first two vertices of its paths, many paths at a time. Between these vertices
//! and after them its paths go by the common stages.

use super::batch::{Batch, Scattering, Surface};
use crate::camera_samples::{BatchSample, Beginnings};
use crate::integrator::RenderStats;
use crate::light_samples::LightChoice;
use crate::path::{PathIntegrator, survival_probability};
use crate::shared_path::blocks::{Blocks, FirstScattering, Kind, Leaving};
use crate::shared_path::sky::{Glimpse, SharedSky};
use crate::shared_path::{Incoming, LEAST_ALPHA, LEAST_IMPORTANCE, Lamps, PIXELS, Second, gains, is_shared};
use irradiant_core::bxdf::Bxdf;
use irradiant_core::interaction::LightId;
use irradiant_core::light::SkyPoint;
use irradiant_core::scene::Scene;
use irradiant_math::Vec3;
use irradiant_spectrum::SampledSpectrum;

impl Batch {
    /// Whether a lane's vertex can be shared.
    fn is_shared(&self, i: usize) -> bool {
        match self.scattering[i] {
            Scattering::Diffuse | Scattering::Metal => true,
            Scattering::Alone(k) => is_shared(&self.bsdfs[k as usize]),
            Scattering::Gone => false,
        }
    }

    /// Whether a lane's vertex, the first of its path, gains from what its neighbours' paths find.
    fn gains(&self, i: usize) -> bool {
        match self.scattering[i] {
            Scattering::Diffuse => true,
            Scattering::Metal => !(self.metal(i).alpha() < LEAST_ALPHA),
            Scattering::Alone(k) => gains(&self.bsdfs[k as usize]),
            Scattering::Gone => false,
        }
    }

    /// Puts aside the light samples of the sky whose vertices share it: they do not count as samples of their own.
    pub(super) fn keep_sky_samples(&mut self, n: usize, sky: LightId) {
        for i in 0..n {
            if self.pmf[i] > 0.0
                && self.picked[i] == sky.0
                && let Some(rgb) = self.sky.rgb(i)
                && self.gains(i)
            {
                let point = SkyPoint { wi: self.targets.wi.vector(i), pdf: self.targets.pdf[i], rgb };
                let pmf = std::mem::take(&mut self.pmf[i]);
                self.sky_samples.push((i as u32, point, self.light_share[i], pmf));
            }
        }
    }

    /// Leaves in `blocks` where paths look from first vertices that share the sky, and ends those that see it. How many go on.
    fn look_at_sky(&mut self, mut n: usize, sky: &SharedSky, blocks: &mut Blocks) -> usize {
        for i in (0..n).rev() {
            let s = self.sample[i] as usize;
            if blocks.kinds[s] != Kind::First {
                continue;
            }
            let point = sky.sky.look(self.d.vector(i), self.escape_place[i]);
            let sees = self.met[i].is_none();
            blocks.set_glimpse(s, false, Glimpse { point, factor: 1.0, sees });
            if sees {
                // The last one takes its place, which has been asked.
                n -= 1;
                self.shift(i, n);
            }
        }
        n
    }

    /// Leaves in `blocks` the light samples of the sky that first vertices have drawn, and what else is needed to share it.
    fn share_sky_samples(&mut self, sky: &SharedSky, blocks: &mut Blocks) {
        for (i, point, share, pmf) in self.sky_samples.drain(..) {
            let glimpse = Glimpse { point, factor: sky.factor(share, pmf), sees: false };
            blocks.set_glimpse(self.sample[i as usize] as usize, true, glimpse);
        }
        self.shared_sky = None;
        for k in 0..self.seeking.len() {
            let i = self.seeking[k] as usize;
            blocks.seeking[self.sample[i] as usize / PIXELS] += u32::from(self.gains(i));
        }
    }

    /// Whether light that leaves a lane's vertex is the same in all directions of one side.
    fn is_even(&self, i: usize) -> bool {
        match self.scattering[i] {
            Scattering::Diffuse => true,
            Scattering::Alone(k) => matches!(self.bsdfs[k as usize].bxdf, Bxdf::Diffuse(_)),
            Scattering::Metal | Scattering::Gone => false,
        }
    }
}

impl PathIntegrator {
    /// The paths of some blocks, whose camera rays' hits are known: what they bring to their own pixels, their first vertices and their second
    /// ones are left in `blocks`.
    pub(crate) fn shared_batch(
        &self,
        b: &mut Batch,
        scene: &Scene,
        sky: Option<&SharedSky>,
        samples: &mut [BatchSample],
        begin: Beginnings,
        blocks: &mut Blocks,
        stats: &mut RenderStats,
    ) {
        blocks.begin(samples.len());

        // First vertices.
        let n = b.begin(scene, samples, &begin);
        let n = self.meet(b, n, 0, scene, samples, &mut blocks.own, stats);
        if self.is_at_limit(0) || n == 0 {
            return;
        }
        let choice = self.light_choice_at(scene, 0);
        b.draw(n, 0, scene, choice, sky.is_some());
        b.shared_sky = sky.map(|sky| sky.id);
        b.light_samples(n, choice, scene, samples, &mut blocks.own, stats);
        if let Some(sky) = sky {
            b.share_sky_samples(sky, blocks);
        }
        b.scatter(n, scene);
        for i in 0..n {
            let s = b.sample[i] as usize;
            blocks.kinds[s] = if b.gains(i) {
                let material = match b.surface[i] {
                    Surface::Flat(material, _) => Some(material),
                    Surface::Other => None,
                };
                let metal = b.metal(i);
                let scattering = match b.scattering[i] {
                    Scattering::Diffuse | Scattering::Gone => FirstScattering::Diffuse(b.reflectance.at(i)),
                    Scattering::Metal => FirstScattering::Metal(&metal),
                    Scattering::Alone(k) => FirstScattering::Alone(&b.bsdfs[k as usize]),
                };
                blocks.set_first(s, &b.at, i, b.time[i], scattering, material);
                blocks.marks[s / PIXELS][s % PIXELS] = b.scatter.roulette(i);
                Kind::First
            } else {
                Kind::Apart
            };
        }
        let n = self.leave_first(b, n, scene, sky, blocks, stats);

        // Second vertices. What paths bring that are apart from here on is a sum of its own.
        for (s, kind) in blocks.kinds.iter().enumerate() {
            blocks.rest[s] = if *kind == Kind::Apart { SampledSpectrum::ZERO } else { blocks.own[s] };
        }
        let n = self.meet(b, n, 1, scene, samples, &mut blocks.rest, stats);
        for (s, kind) in blocks.kinds.iter().enumerate() {
            if *kind != Kind::Apart {
                blocks.own[s] = std::mem::replace(&mut blocks.rest[s], SampledSpectrum::ZERO);
            }
        }
        if !self.is_at_limit(1) && n > 0 {
            self.share_second(b, n, blocks);
            b.draw(n, 1, scene, LightChoice::ONE, true);
            self.light_at_second(b, n, scene, samples, blocks, stats);
            b.scatter(n, scene);
            for (s, kind) in blocks.kinds.iter().enumerate() {
                if *kind != Kind::Apart {
                    blocks.direct[s] = std::mem::replace(&mut blocks.rest[s], SampledSpectrum::ZERO);
                }
            }
            let n = self.leave_second(b, n, scene, samples, blocks, stats);
            self.walk_on(b, n, 2, scene, samples, &mut blocks.rest, stats);
        }
        blocks.end();
    }

    /// Traces the rays of paths that leave their first vertices. How many do.
    fn leave_first(
        &self,
        b: &mut Batch,
        n: usize,
        scene: &Scene,
        sky: Option<&SharedSky>,
        blocks: &mut Blocks,
        stats: &mut RenderStats,
    ) -> usize {
        b.carry(n, |b, i, throughput, scale| {
            let s = b.sample[i] as usize;
            stats.scatterings += 1;
            stats.longest_path = stats.longest_path.max(1);
            // What is of no use to its own pixel is of use to others. Roulette ends no path here.
            if throughput.is_black() && blocks.kinds[s] == Kind::Apart {
                return None;
            }
            stats.bounce_rays += 1;
            Some((throughput, scale))
        });
        let n = b.leave(n, scene);
        b.light_choice = self.light_choice_at(scene, 0);
        scene.geometry.intersect_rays(&mut b.rays, true, &scene.alpha(), &mut b.met[..n]);
        match sky {
            Some(sky) => b.look_at_sky(n, sky, blocks),
            None => n,
        }
    }

    /// Notes second vertices that can be shared, and from there counts light as it leaves them.
    fn share_second(&self, b: &mut Batch, n: usize, blocks: &mut Blocks) {
        for i in 0..n {
            let s = b.sample[i] as usize;
            if blocks.kinds[s] != Kind::First || b.scattering[i] == Scattering::Gone {
                continue;
            }
            let carried = b.throughput.at(i);
            if !b.is_shared(i) {
                blocks.kinds[s] = Kind::Own;
                if carried.is_black() {
                    b.set_gone(i);
                }
                continue;
            }
            b.roulette_scale[i] = carried.max_component().max(LEAST_IMPORTANCE);
            b.throughput.set(i, SampledSpectrum::ONE);
            let wo = b.at.wo.vector(i);
            let light = if b.is_even(i) {
                blocks.kinds[s] = Kind::Evenly;
                let z = match b.scattering[i] {
                    Scattering::Alone(k) => b.bsdfs[k as usize].frame.z,
                    _ => b.at.z.vector(i),
                };
                Leaving::Evenly { normal: z * 1f32.copysign(wo.dot(z)), radiance: SampledSpectrum::ZERO }
            } else {
                blocks.kinds[s] = Kind::By;
                blocks.bsdfs.push(b.bsdf(i));
                Leaving::By { bsdf: blocks.bsdfs.len() as u32 - 1, incoming: 0..0 }
            };
            blocks.seconds[s] = Some(Second { place: b.at.reference(i), wo, pdf: b.bsdf_pdf[i], carried, light });
        }
    }

    /// Light samples at second vertices: where the directions matter from which they are seen, what arrives.
    fn light_at_second(
        &self,
        b: &mut Batch,
        n: usize,
        scene: &Scene,
        samples: &[BatchSample],
        blocks: &mut Blocks,
        stats: &mut RenderStats,
    ) {
        b.pick_lights(n, scene);
        if !b.sample_picked(n, scene, samples) {
            return;
        }
        b.rays.clear();
        let begin = blocks.incoming.len();
        for i in 0..n {
            let s = b.sample[i];
            if blocks.kinds[s as usize] != Kind::By {
                continue;
            }
            let pmf = std::mem::take(&mut b.pmf[i]);
            if pmf == 0.0 || b.targets.pdf[i] == 0.0 || b.arriving.at(i).is_black() {
                continue;
            }
            b.targets.put_ray(i, b.time[i], &mut b.rays);
            let incoming = Incoming {
                wi: b.targets.wi.vector(i),
                radiance: b.arriving.at(i),
                light_pdf: pmf * b.targets.pdf[i],
                found_by_bsdf: b.is_delta[i] == 0,
            };
            blocks.incoming.push((s, incoming));
        }
        stats.shadow_rays += b.rays.len() as u64;
        scene.geometry.occluded_rays(&mut b.rays, &scene.alpha());
        let mut stay = begin;
        for k in 0..b.rays.len() {
            if !b.rays.is_blocked(k) {
                blocks.incoming.swap(stay, begin + k);
                stay += 1;
            }
        }
        blocks.incoming.truncate(stay);
        b.arriving_light(n, scene, samples, &mut blocks.rest, stats);
    }

    /// Plays roulette at second vertices, traces the rays of paths that go on, and asks what those of lamps see that others see by BSDFs. How
    /// many go on.
    fn leave_second(
        &self,
        b: &mut Batch,
        n: usize,
        scene: &Scene,
        samples: &[BatchSample],
        blocks: &mut Blocks,
        stats: &mut RenderStats,
    ) -> usize {
        b.carry(n, |b, i, mut throughput, mut scale| {
            let s = b.sample[i] as usize;
            stats.scatterings += 1;
            stats.longest_path = stats.longest_path.max(2);
            if blocks.kinds[s] == Kind::By {
                // By one number, not by colours, and never to nothing: others see the surface from elsewhere.
                scale *= throughput.max_component().max(LEAST_IMPORTANCE);
                let survival = survival_probability(&SampledSpectrum::splat(scale), 1.0, 2);
                if b.scatter.roulette(i) >= survival {
                    return None;
                }
                throughput = SampledSpectrum::splat(1.0 / survival);
                blocks.next[s] = Some(b.next_d.vector(i));
            } else {
                if throughput.is_black() {
                    return None;
                }
                let survival = survival_probability(&throughput, scale, 2);
                if survival < 1.0 {
                    if b.scatter.roulette(i) >= survival {
                        return None;
                    }
                    throughput *= 1.0 / survival;
                }
            }
            stats.bounce_rays += 1;
            Some((throughput, scale))
        });
        let n = b.leave(n, scene);
        b.light_choice = LightChoice::ONE;
        scene.geometry.intersect_rays(&mut b.rays, true, &scene.alpha(), &mut b.met[..n]);
        for i in 0..n {
            let s = b.sample[i] as usize;
            if blocks.kinds[s] == Kind::By {
                // As in `SharedPathIntegrator::incoming`: first with any density of the direction, then with none.
                (b.bsdf_pdf[i], b.specular[i]) = (1.0, false);
                self.lamps_seen(b, i, scene, &samples[s], b.d.vector(i), blocks);
                b.bsdf_pdf[i] = 0.0;
            }
        }
        n
    }

    /// What the ray of a lane sees of lamps that light samples find too.
    fn lamps_seen(&self, b: &mut Batch, i: usize, scene: &Scene, sample: &BatchSample, wi: Vec3, blocks: &mut Blocks) {
        let s = b.sample[i];
        let mut lamps = Lamps(wi, |light| blocks.incoming.push((s, light)));
        let Some(hit) = b.met[i] else {
            self.escaped(scene, &b.walk(i, 2), &sample.lambda, &mut lamps);
            return;
        };
        // Most surfaces are no lamps.
        if let Some((_, None)) = scene.geometry.flat_triangle(&hit, &mut b.triangles, i) {
            return;
        }
        let met = scene.geometry.interaction(&b.ray(i), &hit);
        if met.light.is_some() {
            self.emitted(scene, &b.walk(i, 2), &met, &sample.lambda, &mut lamps);
        }
    }
}
