//! Stages that are computed in lanes.

use super::batch::Batch;
use crate::path::{Roulette, survival_probability};
use irradiant_core::bxdf::conductor::mirror_lobe;
use irradiant_core::bxdf::fresnel::fresnel_conductor;
use irradiant_core::bxdf::is_usable;
use irradiant_core::geometry::Kernel;
use irradiant_core::light::{ImageInfiniteLight, SampleMode, places_of_sky};
use irradiant_math::lanes::{WHOLE, whole};
use irradiant_math::warp::cosine_hemisphere;
use irradiant_math::{Point3, Vec3, offset_ray_origin};
use irradiant_spectrum::SampledSpectrum;
use std::f32::consts::FRAC_1_PI;

/// Flat surfaces.
pub(super) struct Surfaces<'a>(pub &'a mut Batch, pub usize);

impl Kernel for Surfaces<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self(b, n) = self;
        b.triangles.surfaces(n, &b.d, &mut b.at);
    }
}

/// The random numbers of a vertex. All of them take half as long again as what most vertices ask for.
pub(super) struct Numbers<'a> {
    pub batch: &'a mut Batch,
    pub n: usize,
    pub depth: u32,
    /// Whether there are several lights, and whether one of several candidates is chosen.
    pub pick: bool,
    pub resample: bool,
    /// Whether there are models of their own, with lobes.
    pub lobe: bool,
    /// Whether paths may end by chance.
    pub roulette: bool,
}

impl Kernel for Numbers<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { batch: b, n, depth, pick, resample, lobe, roulette } = self;
        b.streams.light(n, depth, pick, resample, &mut b.light);
        b.streams.scatter(n, depth, lobe, roulette, &mut b.scatter);
    }
}

/// Points of rectangular lamps.
pub(super) struct SampleRectangles<'a>(pub &'a mut Batch, pub usize);

impl Kernel for SampleRectangles<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self(b, n) = self;
        let [u, v, ..] = &b.light.0;
        b.rectangles.sample(n, &b.at, [u, v], &b.two_sided, &mut b.targets);
    }
}

/// Points of spherical lamps.
pub(super) struct SampleSpheres<'a>(pub &'a mut Batch, pub usize);

impl Kernel for SampleSpheres<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self(b, n) = self;
        let [u, v, ..] = &b.light.0;
        b.spheres.sample(n, &b.at, [u, v], &b.two_sided, &mut b.targets);
    }
}

/// Points of the sky.
pub(super) struct SampleSky<'a>(pub &'a mut Batch, pub usize, pub &'a ImageInfiniteLight);

impl Kernel for SampleSky<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self(b, n, sky) = self;
        let [u, v, ..] = &b.light.0;
        b.sky.draw(sky, [u, v], SampleMode::Compensated);
        b.sky.directions(n, sky, &mut b.targets);
    }
}

/// Where on the sky's image rays from the camera lead to.
pub(super) struct PlacesOfCamera<'a>(pub &'a mut Batch, pub usize, pub &'a ImageInfiniteLight);

impl Kernel for PlacesOfCamera<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self(b, n, sky) = self;
        places_of_sky(sky, n, &b.d, &mut b.places);
    }
}

/// The same of directions that are scattered to.
pub(super) struct PlacesOfBounces<'a>(pub &'a mut Batch, pub usize, pub &'a ImageInfiniteLight);

impl Kernel for PlacesOfBounces<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self(b, n, sky) = self;
        places_of_sky(sky, n, &b.next_d, &mut b.places);
    }
}

/// How much of the light samples is scattered along the path, but for models of their own; the rays that ask for what is in the way.
pub(super) struct Weigh<'a>(pub &'a mut Batch, pub usize);

impl Kernel for Weigh<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self(b, n) = self;
        b.targets.aim(n, &b.at);
        for i in whole(n) {
            let frame = b.at.frame(i);
            let wi = b.targets.wi.vector(i);
            let (local_o, local_i) = (frame.to_local(b.at.wo.vector(i)), frame.to_local(wi));
            let pdf = local_i.z.abs() * FRAC_1_PI;
            let scatters = is_usable(local_o) & is_usable(local_i) & (local_o.z * local_i.z > 0.0);
            let cosine = if scatters { wi.dot(frame.z).abs() } else { 0.0 };
            let (light, counts) = b.bring(i, b.reflectance.at(i) * FRAC_1_PI * cosine, pdf);
            b.brought.set(i, light);
            b.brings[i] = u32::from(counts);
        }
        for first in whole(n).step_by(WHOLE) {
            if !b.has_metal(first) {
                continue;
            }
            for i in first..first + WHOLE {
                let frame = b.at.frame(i);
                let wi = b.targets.wi.vector(i);
                let (local_o, local_i) = (frame.to_local(b.at.wo.vector(i)), frame.to_local(wi));
                let (lobe, is_lit) = mirror_lobe(&b.facets(i), local_o, local_i);
                let scatters = is_usable(local_o) & is_usable(local_i) & is_lit & (lobe.pdf.abs() < f32::INFINITY);
                let cosine = if scatters { wi.dot(frame.z).abs() } else { 0.0 };
                let f = fresnel_conductor(lobe.cos, b.eta.at(i), b.k.at(i)) * lobe.value;
                let (light, counts) = b.bring(i, f * cosine, lobe.pdf);
                let is_metal = b.is_metal[i] != 0;
                b.brought.set(i, chosen(is_metal, light, b.brought.at(i)));
                b.brings[i] = if is_metal { u32::from(counts) } else { b.brings[i] };
            }
        }
    }
}

/// Chooses between what a path's light samples have brought so far and the next one.
pub(super) struct Choose<'a>(pub &'a mut Batch, pub usize);

impl Kernel for Choose<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self(b, n) = self;
        for i in whole(n) {
            let brought = b.brought.at(i);
            let weight = if b.counts(i) { brought.average() } else { 0.0 };
            let to = &mut b.chosen;
            let is_taken = to.takes(i, weight);
            to.brought.set(i, chosen(is_taken, brought, to.brought.at(i)));
            to.targets.keep(i, &b.targets, is_taken);
            to.picked[i] = if is_taken { b.picked[i] } else { to.picked[i] };
            to.is_delta[i] = if is_taken { b.is_delta[i] } else { to.is_delta[i] };
        }
    }
}

/// The one or the other, lane by lane.
#[inline(always)]
fn chosen(first: bool, a: SampledSpectrum, b: SampledSpectrum) -> SampledSpectrum {
    let choose = |a: f32, b: f32| if first { a } else { b };
    SampledSpectrum([choose(a.0[0], b.0[0]), choose(a.0[1], b.0[1]), choose(a.0[2], b.0[2]), choose(a.0[3], b.0[3])])
}

/// Directions that diffuse surfaces and metals scatter to, and the rays that go there.
pub(super) struct Scatter<'a>(pub &'a mut Batch, pub usize);

impl Kernel for Scatter<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self(b, n) = self;
        for i in whole(n) {
            let frame = b.at.frame(i);
            let wo = frame.to_local(b.at.wo.vector(i));
            let drawn = cosine_hemisphere(b.scatter.uv(i));
            let pdf = drawn.z * FRAC_1_PI;
            let local = Vec3::new(drawn.x, drawn.y, drawn.z.copysign(wo.z));
            let is_good = is_usable(wo) & (pdf > 0.0) & (pdf < f32::INFINITY) & is_usable(local);
            let wi = frame.from_local(local);
            let factor = wi.dot(frame.z).abs() / pdf;
            b.next_d.set(i, wi.to_array());
            b.next_pdf[i] = pdf;
            let f = b.reflectance.at(i) * FRAC_1_PI;
            b.next_weight.set(i, f * factor);
            b.goes_on[i] = u32::from(is_good & !f.is_black());
        }
        for first in whole(n).step_by(WHOLE) {
            if !b.has_metal(first) {
                continue;
            }
            for i in first..first + WHOLE {
                let frame = b.at.frame(i);
                let wo = frame.to_local(b.at.wo.vector(i));
                let facets = b.facets(i);
                let (local, is_above) = facets.bounded_reflection(wo, b.scatter.uv(i));
                let (lobe, is_lit) = mirror_lobe(&facets, wo, local);
                let is_good = is_usable(wo)
                    & is_above
                    & is_lit
                    & (lobe.pdf > 0.0)
                    & (lobe.pdf < f32::INFINITY)
                    & is_usable(local);
                let wi = frame.from_local(local);
                let factor = wi.dot(frame.z).abs() / lobe.pdf;
                let f = fresnel_conductor(lobe.cos, b.eta.at(i), b.k.at(i)) * lobe.value;
                let goes_on = u32::from(is_good & !f.is_black() & f.is_finite());
                let is_metal = b.is_metal[i] != 0;
                let choose = |a: f32, b: f32| if is_metal { a } else { b };
                let other = b.next_d.vector(i);
                b.next_d.set(i, [choose(wi.x, other.x), choose(wi.y, other.y), choose(wi.z, other.z)]);
                b.next_pdf[i] = choose(lobe.pdf, b.next_pdf[i]);
                b.next_weight.set(i, chosen(is_metal, f * factor, b.next_weight.at(i)));
                b.goes_on[i] = if is_metal { goes_on } else { b.goes_on[i] };
            }
        }
        for i in whole(n) {
            let wi = b.next_d.vector(i);
            let o: Point3 = offset_ray_origin(b.at.p.point(i), b.at.p_error.vector(i), b.at.n.normal(i), wi);
            b.next_o.set(i, o.to_array());
        }
    }
}

/// What paths carry on in the directions that they were given, and roulette.
pub(super) struct Survive<'a> {
    pub batch: &'a mut Batch,
    pub n: usize,
    pub roulette: Roulette,
    /// Scattering events by then.
    pub depth: u32,
}

impl Kernel for Survive<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { batch: b, n, roulette, depth } = self;
        for i in whole(n) {
            let throughput = b.throughput.at(i) * b.next_weight.at(i);
            let scale = b.roulette_scale[i] * b.next_scale[i];
            let survival = match roulette {
                Roulette::Throughput => survival_probability(&throughput, scale, depth),
                Roulette::Constant(q) => 1.0 - q,
            };
            let is_tried = survival < 1.0;
            let ends = throughput.is_black() | (is_tried & (b.scatter.roulette(i) >= survival));
            b.throughput.set(i, throughput * if is_tried { 1.0 / survival } else { 1.0 });
            b.roulette_scale[i] = scale;
            b.goes_on[i] = if ends { 0 } else { b.goes_on[i] };
        }
    }
}
