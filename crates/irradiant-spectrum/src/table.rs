//! Tabulated curves: at whole nanometres, and at any increasing wavelengths.

use crate::photometry::DENSE_LENGTH;
use crate::{LAMBDA_MIN, SampledSpectrum, Wavelengths};

/// The integer nearest to `x` (halves to even); more than 4 million for `x` < -0.5, for `x` above 2^22 and for NaN.
///
/// Adding 1.5 * 2^23 leaves the integer in the low bits: a third of the time of a saturating cast, and four go at once.
#[inline]
pub(crate) fn nearest_index(x: f32) -> usize {
    const MAGIC: f32 = 12_582_912.0;
    (x + MAGIC).to_bits().wrapping_sub(MAGIC.to_bits()) as usize
}

/// The entry nearest to `lambda` nm (halves to even); 0 outside 359.5..830.5.
#[inline]
pub(crate) fn eval_dense(values: &[f32; DENSE_LENGTH], lambda: f32) -> f32 {
    values.get(nearest_index(lambda - LAMBDA_MIN)).copied().unwrap_or(0.0)
}

/// [`eval_dense`] at each wavelength.
#[inline]
pub(crate) fn sample_dense(values: &[f32; DENSE_LENGTH], wavelengths: &Wavelengths) -> SampledSpectrum {
    SampledSpectrum(wavelengths.lambda.map(|l| eval_dense(values, l)))
}

/// A table of (wavelength, value), increasing in wavelength, interpolated linearly; 0 outside.
///
/// Finding the segment costs one look-up by whole nanometre and rarely a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    lambda: Box<[f32]>,
    values: Box<[f32]>,
    /// For each whole nm from 360: the last entry at or below it (0 if none).
    segment: Box<[u16; DENSE_LENGTH]>,
}

impl Table {
    /// From checked columns: equally long, increasing.
    pub(crate) fn new(lambda: &[f32], values: &[f32]) -> Self {
        let segment = std::array::from_fn(|i| {
            let nm = LAMBDA_MIN + i as f32;
            lambda.partition_point(|&l| l <= nm).saturating_sub(1).min(usize::from(u16::MAX)) as u16
        });
        Self { lambda: lambda.into(), values: values.into(), segment: Box::new(segment) }
    }

    /// The wavelengths, nm.
    pub fn lambda(&self) -> &[f32] {
        &self.lambda
    }

    /// The values at [`Table::lambda`].
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The same wavelengths, every value times `factor`.
    pub fn scaled(&self, factor: f32) -> Self {
        Self { values: self.values.iter().map(|v| v * factor).collect(), ..self.clone() }
    }

    /// The interpolated value at `lambda` nm.
    #[inline]
    pub fn eval(&self, lambda: f32) -> f32 {
        let (wavelengths, values) = (&*self.lambda, &*self.values);
        let (Some(&first), Some(&last)) = (wavelengths.first(), wavelengths.last()) else { return 0.0 };
        if !(first <= lambda && lambda <= last) {
            return 0.0;
        }
        // The whole nanometre below, or the one before that for whole `lambda`.
        let mut i = match self.segment.get(nearest_index(lambda - (LAMBDA_MIN + 0.5))) {
            Some(&i) => usize::from(i),
            None => wavelengths.partition_point(|&l| l <= lambda).saturating_sub(1),
        };
        while i + 1 < wavelengths.len() && wavelengths[i + 1] <= lambda {
            i += 1;
        }
        if i + 1 >= wavelengths.len() {
            return values[i];
        }
        let t = (lambda - wavelengths[i]) / (wavelengths[i + 1] - wavelengths[i]);
        (1.0 - t) * values[i] + t * values[i + 1]
    }
}

#[cfg(test)]
mod tests {
    use crate::{ColorSpace, Role, Spectrum};

    fn srgb() -> &'static ColorSpace {
        ColorSpace::srgb()
    }

    #[test]
    fn tables_interpolate_at_knots_between_and_outside() {
        let s = Spectrum::interleaved(
            &[350.0, 3.0, 400.0, 0.2, 500.5, 0.8, 500.75, 0.4, 900.0, 0.5],
            Role::Unbounded,
            srgb(),
        )
        .unwrap();
        for (l, v) in [
            (349.0, 0.0),
            (350.0, 3.0),
            (375.0, 1.6),
            (400.0, 0.2),
            (450.25, 0.5),
            (500.5, 0.8),
            (500.625, 0.6),
            (900.0, 0.5),
            (901.0, 0.0),
        ] {
            assert!((s.eval(l) - v).abs() < 1e-5, "{l}: {}", s.eval(l));
        }
        assert_eq!(s.eval(f32::NAN), 0.0);
        let single = Spectrum::interleaved(&[500.0, 2.0], Role::Unbounded, srgb()).unwrap();
        assert_eq!((single.eval(500.0), single.eval(501.0)), (2.0, 0.0));
    }

    #[test]
    fn dense_tables_are_read_at_the_nearest_nanometre() {
        let s = Spectrum::dense_from_fn(|l| l, Role::Unbounded, srgb());
        for (l, v) in [
            (359.4, 0.0),
            (359.6, 360.0),
            (360.0, 360.0),
            (500.49, 500.0),
            (500.51, 501.0),
            (830.4, 830.0),
            (830.6, 0.0),
        ] {
            assert_eq!(s.eval(l), v, "{l}");
        }
        assert_eq!((s.eval(f32::NAN), s.eval(f32::NEG_INFINITY), s.eval(f32::INFINITY)), (0.0, 0.0, 0.0));
    }
}
