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
