//! Shapes of the aperture stop of a real lens.

use irradiant_image::{Image, WrapMode};
use irradiant_math::elementary::{exp, sin_cos};
use std::f32::consts::PI;

/// Resolution of the built-in shapes (pbrt-v4's).
const SIZE: usize = 256;

/// What an aperture stop lets through, on the square around its circular opening. Normalised such that on average over the
/// square as much passes as through a circular hole, hence values above 1.
#[derive(Clone, Debug)]
pub(super) struct Mask {
    image: Image,
    /// Farthest place that lets anything through, in units of the opening's radius.
    pub reach: f64,
}

impl Mask {
    /// From a grey picture as seen from the scene; the average of R, G and B for a coloured one. `None` when it has
    /// several channels but not these, or lets nothing through.
    pub fn new(picture: &Image) -> Option<Self> {
        let rgb = if picture.channel_count() > 1 { Some(picture.to_rgb()?) } else { None };
        let source = rgb.as_ref().unwrap_or(picture);
        let (width, height, channels) = (source.width(), source.height(), source.channel_count());
        let mut values = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                // Upside down: the lens turns it around.
                let sum: f32 = (0..channels).map(|c| source.get(x, height - 1 - y, c)).sum();
                values.push((sum / channels as f32).max(0.0));
            }
        }
        let sum: f64 = values.iter().map(|&v| v as f64).sum();
        let scale = std::f64::consts::FRAC_PI_4 / (sum / values.len() as f64);
        if !(scale.is_finite() && scale > 0.0) {
            return None;
        }
        let mut reach = 0f64;
        for (i, value) in values.iter_mut().enumerate() {
            if *value > 0.0 {
                // Interpolation reaches one texel beyond the centre of the last that is not black.
                let far = |k: usize, n: usize| (((2 * k + 1) as f64 / n as f64) - 1.0).abs() + 2.0 / n as f64;
                let (x, y) = (far(i % width, width), far(i / width, height));
                reach = reach.max((x * x + y * y).sqrt());
            }
            *value = (*value as f64 * scale) as f32;
        }
        let image = Image::from_f32(width, height, &["Y"], values).ok()?;
        Some(Self { image, reach })
    }

    /// exp(-r^2) - exp(-1), or 0 beyond the rim.
    pub fn gaussian() -> Option<Self> {
        Self::from_shape(|x, y| (exp(-(x * x + y * y)) - exp(-1.0)).max(0.0))
    }

    /// A square of half the opening's width.
    pub fn square() -> Option<Self> {
        Self::from_shape(|x, y| if x.abs() < 0.5 && y.abs() < 0.5 { 1.0 } else { 0.0 })
    }

    /// A regular pentagon, its corners at 0.8 of the radius, one up.
    pub fn pentagon() -> Option<Self> {
        let corners: Vec<[f32; 2]> = (0..5).map(|i| corner(0.8, PI * (0.5 + 0.4 * i as f32))).collect();
        Self::polygon(&corners)
    }

    /// A five-pointed star (the pentagram's outline), its tips on the rim.
    pub fn star() -> Option<Self> {
        let inner = sin_cos(0.4 * PI).1 / sin_cos(0.2 * PI).1;
        let radius = |i: usize| if i % 2 == 1 { 1.0 } else { inner };
        let corners: Vec<[f32; 2]> = (0..10).map(|i| corner(radius(i), PI * (0.2 * i as f32))).collect();
        Self::polygon(&corners)
    }

    fn polygon(corners: &[[f32; 2]]) -> Option<Self> {
        Self::from_shape(|x, y| {
            // Inside when a ray towards +x crosses the outline an odd number of times.
            let edges = corners.iter().zip(corners.iter().cycle().skip(1));
            let crossings = edges
                .filter(|([x0, y0], [x1, y1])| (*y0 <= y) != (*y1 <= y) && x < x0 + (y - y0) / (y1 - y0) * (x1 - x0));
            if crossings.count() % 2 == 1 { 1.0 } else { 0.0 }
        })
    }

    fn from_shape(shape: impl Fn(f32, f32) -> f32) -> Option<Self> {
        let at = |i: usize| (2 * i + 1) as f32 / SIZE as f32 - 1.0;
        Self::new(&Image::from_fn(SIZE, SIZE, ["Y"], |x, y| [shape(at(x), at(y))]))
    }

    /// At a place in units of the opening's radius.
    pub fn transmittance(&self, x: f64, y: f64) -> f64 {
        let (s, t) = ((0.5 * (x + 1.0)) as f32, (0.5 * (y + 1.0)) as f32);
        self.image.bilinear(s, t, 0, WrapMode::Black) as f64
    }
}

fn corner(radius: f32, angle: f32) -> [f32; 2] {
    let (sin, cos) = sin_cos(angle);
    [radius * cos, radius * sin]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_pass_as_much_as_a_hole_and_nothing_beyond_their_reach() {
        for mask in [Mask::gaussian(), Mask::square(), Mask::pentagon(), Mask::star()] {
            let mask = mask.unwrap();
            let n = 400;
            let mut sum = 0.0;
            for i in 0..n * n {
                let at = |k: usize| (k as f64 + 0.5) / n as f64 * 3.0 - 1.5;
                let (x, y) = (at(i % n), at(i / n));
                let value = mask.transmittance(x, y);
                sum += value;
                assert!(value == 0.0 || x * x + y * y <= mask.reach * mask.reach);
            }
            let passed = sum * 9.0 / (n * n) as f64;
            assert!((passed - std::f64::consts::PI).abs() < 0.01, "{passed}");
        }
        assert!(Mask::new(&Image::from_fn(4, 4, ["Y"], |_, _| [0.0])).is_none());
        assert!(Mask::new(&Image::from_fn(4, 4, ["A", "B"], |_, _| [1.0; 2])).is_none());
    }

    #[test]
    fn the_star_points_to_the_side_and_the_pentagon_down_after_the_flip() {
        let star = Mask::star().unwrap();
        assert!(star.transmittance(-0.9, 0.0) > 0.0 && star.transmittance(0.9, 0.0) == 0.0);
        let pentagon = Mask::pentagon().unwrap();
        // Pictures have their first row at the top; the shapes are drawn with y downwards in them, then flipped.
        assert!(pentagon.transmittance(0.0, -0.75) > 0.0 && pentagon.transmittance(0.0, 0.75) == 0.0);
    }
}
