//! An image of the sky in many directions, side by side.

use super::{ImageInfiniteLight, PixelLine, PixelRun, SampleMode, TargetLanes};
use irradiant_math::Point2;
use irradiant_math::lanes::{Floats, LANES, Triples, whole};
use irradiant_spectrum::{SampledSpectrum, Wavelengths};

/// Points of the image that are drawn for some lanes.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct SkyLanes {
    wanted: Vec<u32>,
    lines: Vec<PixelLine>,
    runs: Vec<PixelRun>,
    // Points that were drawn.
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
        wanted: Vec::new(),
        lines: Vec::new(),
        runs: Vec::new(),
        u: [0.0; LANES],
        v: [0.0; LANES],
        pdf: [0.0; LANES],
        rgb: [[0.0; 3]; LANES],
        is_drawn: [0; LANES],
        wi: Triples::ZERO,
        per_angle: [0.0; LANES],
    };

    /// No lane wants a point yet.
    #[inline]
    pub fn begin(&mut self) {
        self.wanted.clear();
        self.is_drawn = [0; LANES];
    }

    /// A lane wants a point.
    #[inline(always)]
    pub fn ask(&mut self, i: usize) {
        self.wanted.push(i as u32);
    }

    /// The lanes that want a point.
    pub fn wanted(&self) -> &[u32] {
        &self.wanted
    }

    /// Draws a point for each lane that wants one, by its numbers `u`. Each step of [`ImageInfiniteLight::sample`] for all lanes before the next:
    /// the way to a point of the sky is waiting for memory.
    #[inline(always)]
    pub fn draw(&mut self, sky: &ImageInfiniteLight, [u, v]: [&Floats; 2], mode: SampleMode) {
        self.lines.clear();
        for &i in &self.wanted {
            self.lines.push(sky.seek(Point2::new(u[i as usize], v[i as usize]), mode));
        }
        self.runs.clear();
        for &line in &self.lines {
            self.runs.push(sky.approach(line, mode));
        }
        for (&i, &run) in self.wanted.iter().zip(&self.runs) {
            let i = i as usize;
            if let Some(sample) = sky.arrive_at(run, mode) {
                (self.u[i], self.v[i], self.pdf[i], self.is_drawn[i]) = (sample.uv.x, sample.uv.y, sample.pdf, 1);
                self.rgb[i] = sample.rgb;
            }
        }
    }

    /// Radiance at the point drawn for a lane, `None` if none is.
    #[inline(always)]
    pub fn radiance(&self, i: usize, sky: &ImageInfiniteLight, lambda: &Wavelengths) -> Option<SampledSpectrum> {
        self.rgb(i).map(|rgb| sky.radiance(rgb, lambda))
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
        numbers: &'a [Floats; 2],
        directions: &'a Triples,
        places: &'a mut [Floats; 2],
        out: &'a mut TargetLanes,
    }

    impl Kernel for Look<'_> {
        type Output = ();
        #[inline(always)]
        fn run(self) {
            let [u, v] = self.numbers;
            self.lanes.draw(self.sky, [u, v], SampleMode::Compensated);
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
                let (mut directions, mut numbers) = (Triples::ZERO, [[0.0; LANES]; 2]);
                let mut alone = Vec::new();
                for i in 0..LANES {
                    let u = Point2::new(rng.next_f32(), rng.next_f32());
                    let sample = sky.sample(u, &lambda, mode).expect("not black");
                    (numbers[0][i], numbers[1][i]) = (u.x, u.y);
                    if i % 5 != 0 {
                        lanes.ask(i);
                    }
                    out.pdf[i] = -1.0;
                    alone.push(sample);
                    let d = [rng.direction(), [0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]][i % 20 % 4];
                    directions.set(i, d);
                }
                let lanes = &mut lanes;
                level.run(Look {
                    sky: &sky,
                    lanes: &mut *lanes,
                    numbers: &numbers,
                    directions: &directions,
                    places: &mut places,
                    out: &mut out,
                });
                for (i, sample) in alone.iter().enumerate().take(233) {
                    if i % 5 == 0 {
                        assert_eq!(out.pdf[i], -1.0, "not asked");
                    } else {
                        assert_eq!((out.wi.vector(i), out.pdf[i]), (sample.wi, sample.pdf), "{level:?} {i}");
                        assert_eq!(lanes.radiance(i, &sky, &lambda), Some(sample.radiance));
                    }
                    let place = sky.place(directions.vector(i));
                    assert_eq!(Point2::new(places[0][i], places[1][i]), place, "{level:?} {i}");
                }
            }
        }
    }
}
