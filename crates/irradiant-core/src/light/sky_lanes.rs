//! An image of the sky in many directions, side by side.

use super::{ImageInfiniteLight, PixelRun, SampleMode, TargetLanes};
use irradiant_math::Point2;
use irradiant_math::lanes::{Floats, LANES, Triples, whole};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// Points of the image that were drawn for some lanes.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct SkyLanes {
    u: Floats,
    v: Floats,
    /// Densities over the image.
    pdf: Floats,
    /// 1 where one was drawn.
    is_drawn: [u32; LANES],
    // Directions, before they go to the lanes that have one, and their densities.
    wi: Triples,
    per_angle: Floats,
}

impl SkyLanes {
    /// Nothing yet.
    pub const NONE: Self = Self {
        u: [0.0; LANES],
        v: [0.0; LANES],
        pdf: [0.0; LANES],
        is_drawn: [0; LANES],
        wi: Triples::ZERO,
        per_angle: [0.0; LANES],
    };

    /// Nothing is drawn for a lane, unless it is later.
    #[inline(always)]
    pub fn forget(&mut self, i: usize) {
        self.is_drawn[i] = 0;
    }

    /// [`ImageInfiniteLight::arrive`] for a lane, but for the direction: the radiance, or `None`.
    #[inline]
    pub fn arrive(
        &mut self,
        i: usize,
        sky: &ImageInfiniteLight,
        run: PixelRun,
        lambda: &Wavelengths,
        mode: SampleMode,
    ) -> Option<SampledSpectrum> {
        let (sample, radiance) = sky.arrive_at(run, lambda, mode)?;
        (self.u[i], self.v[i], self.pdf[i], self.is_drawn[i]) = (sample.uv.x, sample.uv.y, sample.pdf, 1);
        Some(radiance)
    }

    /// For those of `n` lanes that have arrived the directions and densities, to the bit: into `out`.
    #[inline(always)]
    pub fn directions(&mut self, n: usize, sky: &ImageInfiniteLight, out: &mut TargetLanes) {
        for i in whole(n) {
            let (wi, pdf) = sky.direction(Point2::new(self.u[i], self.v[i]), self.pdf[i]);
            self.wi.set(i, wi.to_array());
            self.per_angle[i] = pdf;
        }
        for i in whole(n) {
            let is_drawn = self.is_drawn[i] != 0;
            let choose = |a: f32, b: f32| if is_drawn { a } else { b };
            let (wi, other) = (self.wi.vector(i), out.wi.vector(i));
            out.wi.set(i, [choose(wi.x, other.x), choose(wi.y, other.y), choose(wi.z, other.z)]);
            out.pdf[i] = choose(self.per_angle[i], out.pdf[i]);
            out.is_infinite[i] = if is_drawn { 1 } else { out.is_infinite[i] };
        }
    }
}

/// For each of `n` lanes what [`ImageInfiniteLight::place`] says of its direction, to the bit; memory is not asked for.
#[inline(always)]
pub fn places_of_sky(sky: &ImageInfiniteLight, n: usize, directions: &Triples, out: &mut [Floats; 2]) {
    for i in whole(n) {
        let uv = sky.place_of(directions.vector(i));
        (out[0][i], out[1][i]) = (uv.x, uv.y);
    }
}
