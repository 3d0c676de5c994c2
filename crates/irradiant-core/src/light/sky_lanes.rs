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
    /// Colours.
    rgb: [[f32; 3]; LANES],
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
        rgb: [[0.0; 3]; LANES],
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
        self.rgb[i] = sample.rgb;
        Some(radiance)
    }

    /// The colour of the image at the point drawn for a lane, `None` if none is.
    #[inline(always)]
    pub fn rgb(&self, i: usize) -> Option<[f32; 3]> {
        (self.is_drawn[i] != 0).then_some(self.rgb[i])
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Kernel, Level};
    use crate::light::{Orientation, RadianceImage, SceneSphere};
    use irradiant_math::{Point3, Transform};
    use irradiant_spectrum::ColorSpace;
    use irradiant_testkit::Rng;

    struct Look<'a> {
        sky: &'a ImageInfiniteLight,
        lanes: &'a mut SkyLanes,
        directions: &'a Triples,
        places: &'a mut [Floats; 2],
        out: &'a mut TargetLanes,
    }

    impl Kernel for Look<'_> {
        type Output = ();
        #[inline(always)]
        fn run(self) {
            self.lanes.directions(233, self.sky, self.out);
            places_of_sky(self.sky, 233, self.directions, self.places);
        }
    }

    // Turned and squeezed skies, all levels: as one direction at a time, to the bit.
    #[test]
    fn lanes_see_what_directions_alone_do() {
        let pixels = (0..32 * 32).map(|i| [(i % 31) as f32, (i % 7) as f32 * 3.0, 1.0]).collect();
        let image = RadianceImage::from_pixels(32, 32, pixels, ColorSpace::srgb(), ColorSpace::srgb());
        let (lambda, mode) = (Wavelengths::rgb(), SampleMode::Compensated);
        let mut rng = Rng::new(8);
        for squeeze in [1.0, 0.4] {
            let turn = Transform::rotate(40.0, [1.0, 2.0, 0.5]).expect("an axis");
            let turned = turn.compose(&Transform::scale(1.0, squeeze, 1.0).expect("invertible"));
            let scene = SceneSphere { center: Point3::ZERO, radius: 1.0 };
            let sky = ImageInfiniteLight::new(image.clone(), Orientation::new(&turned), 2.0, scene).expect("a square");
            for level in Level::available() {
                let (mut lanes, mut out, mut places) = (SkyLanes::NONE, TargetLanes::NONE, [[0.0; LANES]; 2]);
                let mut directions = Triples::ZERO;
                let mut alone = Vec::new();
                for i in 0..LANES {
                    let u = Point2::new(rng.next_f32(), rng.next_f32());
                    let sample = sky.sample(u, &lambda, mode).expect("not black");
                    if i % 5 != 0 {
                        let run = sky.approach(sky.seek(u, mode), mode);
                        assert_eq!(lanes.arrive(i, &sky, run, &lambda, mode), Some(sample.radiance));
                    }
                    out.pdf[i] = -1.0;
                    alone.push(sample);
                    let d = [rng.direction(), [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]][i % 20 % 4];
                    directions.set(i, d);
                }
                let lanes = &mut lanes;
                level.run(Look { sky: &sky, lanes, directions: &directions, places: &mut places, out: &mut out });
                for (i, sample) in alone.iter().enumerate().take(233) {
                    if i % 5 == 0 {
                        assert_eq!(out.pdf[i], -1.0, "not asked");
                    } else {
                        assert_eq!((out.wi.vector(i), out.pdf[i]), (sample.wi, sample.pdf), "{level:?} {i}");
                    }
                    let place = sky.place(directions.vector(i));
                    assert_eq!(Point2::new(places[0][i], places[1][i]), place, "{level:?} {i}");
                }
            }
        }
    }
}
