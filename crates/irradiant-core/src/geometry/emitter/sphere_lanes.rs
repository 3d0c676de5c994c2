//! Points drawn from many balls for many points that they shine on, side by side.

use super::SphereEmitter;
use super::quadric::{Ball, BallPoint, ball_error};
use crate::geometry::SurfaceLanes;
use crate::light::TargetLanes;
use irradiant_math::Point2;
use irradiant_math::lanes::{Floats, LANES, Triples, WHOLE, whole};

type Doubles = [f64; LANES];

/// The ball of each lane.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct SphereLanes {
    center: [Doubles; 3],
    radius: Doubles,
    sign: Doubles,
    /// 1 where a point is to be drawn.
    is_asked: [u32; LANES],
    /// 1 where it was.
    is_outside: [u32; LANES],
    // What was drawn, before it goes to the lanes that asked: loops that read and write what others write too are not made vector code.
    p: Triples,
    p_error: Triples,
    n: Triples,
    pdf: Floats,
}

impl SphereLanes {
    /// Of nothing yet.
    pub const NONE: Self = Self {
        center: [[0.0; LANES]; 3],
        radius: [1.0; LANES],
        sign: [1.0; LANES],
        is_asked: [0; LANES],
        is_outside: [0; LANES],
        p: Triples::ZERO,
        p_error: Triples::ZERO,
        n: Triples::ZERO,
        pdf: [0.0; LANES],
    };

    /// Nothing is to be drawn for a lane, unless it is asked for later.
    #[inline(always)]
    pub fn forget(&mut self, i: usize) {
        self.is_asked[i] = 0;
    }

    /// A point is to be drawn from what the lane holds.
    #[inline(always)]
    pub fn ask(&mut self, i: usize) {
        self.is_asked[i] = 1;
    }

    /// Puts a sphere into a lane; false if it is not a whole ball.
    pub fn set(&mut self, i: usize, sphere: &SphereEmitter) -> bool {
        let Some(Ball { center, radius, sign }) = sphere.ball() else { return false };
        (0..3).for_each(|k| self.center[k][i] = center[k]);
        (self.radius[i], self.sign[i]) = (radius, sign);
        true
    }

    /// Whether a point was asked for in vain, since the ball is seen from within: such are sampled by area.
    #[inline(always)]
    pub fn is_left(&self, i: usize) -> bool {
        (self.is_asked[i] != 0) & (self.is_outside[i] == 0)
    }

    /// For those of `n` lanes that are asked, and see their balls from outside, what
    /// [`AreaLight::sample`](crate::light::AreaLight::sample) draws, to the bit: into `out`.
    #[inline(always)]
    pub fn sample(
        &mut self,
        n: usize,
        at: &SurfaceLanes,
        u: [&Floats; 2],
        two_sided: &[u32; LANES],
        out: &mut TargetLanes,
    ) {
        for first in whole(n).step_by(WHOLE) {
            if self.is_asked[first..first + WHOLE].iter().fold(0, |any, asked| any | asked) != 0 {
                self.draw(first, at, u);
            }
        }
        for i in whole(n) {
            let to = self.p.point(i) - at.p.point(i);
            let d2 = to.length_squared();
            let wi = to * (1.0 / d2.sqrt());
            let (normal, pdf) = (self.n.normal(i), self.pdf[i]);
            let usable = (pdf > 0.0) & (pdf < f32::INFINITY) & (d2 > 0.0);
            let shines = (two_sided[i] != 0) | !(normal.dot(wi) > 0.0);
            let pdf = if usable & shines { pdf } else { 0.0 };
            let is_asked = self.is_asked[i] != 0;
            let choose = |a: f32, b: f32| if is_asked { a } else { b };
            let choose3 = |a: [f32; 3], b: [f32; 3]| [choose(a[0], b[0]), choose(a[1], b[1]), choose(a[2], b[2])];
            out.wi.set(i, choose3(wi.to_array(), out.wi.vector(i).to_array()));
            out.pdf[i] = choose(pdf, out.pdf[i]);
            out.p.set(i, choose3(self.p.point(i).to_array(), out.p.vector(i).to_array()));
            out.p_error.set(i, choose3(self.p_error.vector(i).to_array(), out.p_error.vector(i).to_array()));
            out.n.set(i, choose3(normal.to_array(), out.n.vector(i).to_array()));
            out.is_infinite[i] = if is_asked { 0 } else { out.is_infinite[i] };
        }
    }

    /// A point of each ball of a vector.
    #[inline(always)]
    fn draw(&mut self, first: usize, at: &SurfaceLanes, u: [&Floats; 2]) {
        for i in first..first + WHOLE {
            let ball = Ball {
                center: [self.center[0][i], self.center[1][i], self.center[2][i]],
                radius: self.radius[i],
                sign: self.sign[i],
            };
            let (seen, is_outside) = ball.seen_from(at.p.point(i), at.p_error.vector(i));
            let BallPoint { p, n, pdf, exact } = ball.sample(&seen, Point2::new(u[0][i], u[1][i]));
            self.p.set(i, p.to_array());
            self.p_error.set(i, ball_error(exact).to_array());
            self.n.set(i, n.to_array());
            self.pdf[i] = pdf;
            self.is_outside[i] = u32::from(is_outside);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::emitter::ShapeSample;
    use crate::geometry::placement::Placement;
    use crate::geometry::sphere::Sphere;
    use crate::geometry::{EmitterShape, Kernel, Level};
    use crate::light::{AreaAlpha, AreaLight, AreaRadiance, Emission};
    use irradiant_math::{Transform, Vec3};
    use irradiant_spectrum::{ColorSpace, Role, Spectrum, Wavelengths};
    use irradiant_testkit::Rng;

    struct Draw<'a>(
        &'a mut SphereLanes,
        usize,
        &'a SurfaceLanes,
        [&'a Floats; 2],
        &'a [u32; LANES],
        &'a mut TargetLanes,
    );

    impl Kernel for Draw<'_> {
        type Output = ();
        #[inline(always)]
        fn run(self) {
            self.0.sample(self.1, self.2, self.3, self.4, self.5);
        }
    }

    // Large and tiny cones, both orientations, points within, lanes that are not asked: as one lamp at a time, to the bit.
    #[test]
    fn lanes_draw_what_lamps_alone_do() {
        let mut rng = Rng::new(4);
        let white = Spectrum::constant(1.0, Role::Illuminant, ColorSpace::srgb());
        let lamps: Vec<AreaLight> = (0..LANES)
            .map(|i| {
                let mut x = || rng.next_f32() as f64 * 4.0 - 2.0;
                let move_by = Transform::translate(x(), x(), x());
                let placement = Placement::new(&move_by, i % 3 == 0).expect("an affine map");
                let radius = [0.01, 0.3, 2.0][i % 3];
                let sphere = SphereEmitter::new(Sphere::new(radius, -radius, radius, 360.0, placement));
                AreaLight {
                    shape: EmitterShape::Sphere(Box::new(sphere)),
                    radiance: AreaRadiance::Uniform(Emission::new(&white, 1.0, ColorSpace::srgb())),
                    scale: 1.0,
                    two_sided: i % 5 == 0,
                    alpha: AreaAlpha::Constant(1.0),
                }
            })
            .collect();
        for level in Level::available() {
            let (mut lanes, mut at, mut out) = (SphereLanes::NONE, SurfaceLanes::ZERO, TargetLanes::NONE);
            let (mut u, mut two_sided) = ([[0.0; LANES]; 2], [0; LANES]);
            for (i, lamp) in lamps.iter().enumerate() {
                let EmitterShape::Sphere(sphere) = &lamp.shape else { unreachable!("all are spheres") };
                assert!(lanes.set(i, sphere));
                if i % 7 != 0 {
                    lanes.ask(i);
                }
                at.p.set(i, [0; 3].map(|_| rng.next_f32() * 6.0 - 3.0));
                at.p_error.set(i, [1e-6; 3]);
                u.iter_mut().for_each(|u| u[i] = rng.next_f32());
                two_sided[i] = u32::from(lamp.two_sided);
                out.pdf[i] = -1.0;
            }
            level.run(Draw(&mut lanes, 229, &at, [&u[0], &u[1]], &two_sided, &mut out));
            let mut left = 0;
            for (i, lamp) in lamps.iter().enumerate().take(229) {
                let (reference, uv) = (at.reference(i), Point2::new(u[0][i], u[1][i]));
                if i % 7 == 0 {
                    assert_eq!((out.pdf[i], lanes.is_left(i)), (-1.0, false), "not asked");
                } else if lanes.is_left(i) {
                    let EmitterShape::Sphere(sphere) = &lamp.shape else { unreachable!("all are spheres") };
                    assert!(sphere.pdf(&reference, Vec3::X, reference.p).is_none());
                    left += 1;
                } else {
                    let drawn = lamp.sample(&reference, uv, &Wavelengths::rgb());
                    assert_eq!(out.pdf[i], drawn.map_or(0.0, |s| s.pdf), "{level:?} {i}");
                    if let Some(drawn) = drawn {
                        let ShapeSample { p, p_error, n, .. } =
                            lamp.shape.sample(&reference, uv, false).expect("just drawn");
                        assert_eq!((out.wi.vector(i), out.p.point(i)), (drawn.wi, p), "{level:?} {i}");
                        assert_eq!((out.p_error.vector(i), out.n.normal(i)), (p_error, n), "{level:?} {i}");
                    }
                }
            }
            assert!(left > 2, "none within");
        }
    }
}
