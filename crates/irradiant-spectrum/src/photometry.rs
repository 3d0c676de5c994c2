//! Integrals of spectra against the CIE 1931 observer, as 1 nm sums in `f64`.

use crate::data::cie1931;
use crate::stored::{Curve, Spectrum};

/// The sum of y-bar over 360..=830 nm in 1 nm steps, nm: what divides photometric integrals.
pub const CIE_Y_INTEGRAL: f32 = 106.856_895;

/// Number of 1 nm samples from 360 to 830 nm inclusive.
pub const DENSE_LENGTH: usize = 471;

/// XYZ of a table of 1 nm samples, divided by [`CIE_Y_INTEGRAL`].
pub(crate) fn xyz_of_dense(values: &[f32; DENSE_LENGTH]) -> [f64; 3] {
    xyz_of(|i| f64::from(values[i]))
}

/// XYZ of `f` of the index from 360 nm, divided by [`CIE_Y_INTEGRAL`].
pub(crate) fn xyz_of(f: impl Fn(usize) -> f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for i in 0..DENSE_LENGTH {
        let v = f(i);
        for (s, curve) in sum.iter_mut().zip([&cie1931::X, &cie1931::Y, &cie1931::Z]) {
            *s += f64::from(curve[i]) * v;
        }
    }
    sum.map(|s| s / f64::from(CIE_Y_INTEGRAL))
}

/// The sum over 360..=830 nm, in 1 nm steps, of the product of two spectra; nm times their units.
pub fn inner_product(a: &Spectrum, b: &Spectrum) -> f64 {
    (0..DENSE_LENGTH).map(|i| 360.0 + i as f32).map(|l| f64::from(a.eval(l)) * f64::from(b.eval(l))).sum()
}

/// CIE XYZ, divided by [`CIE_Y_INTEGRAL`]: a constant spectrum 1 has Y = 1.
pub fn spectrum_to_xyz(spectrum: &Spectrum) -> [f64; 3] {
    xyz_of(|i| f64::from(spectrum.eval(360.0 + i as f32)))
}

/// The integral of the spectrum and y-bar, not divided: what lights divide their scale by.
///
/// Of an RGB illuminant only the illuminant counts, not its colour, so that such a light's RGB
/// stays what the author wrote (pbrt-v4 `SpectrumToPhotometric`).
pub fn spectrum_to_photometric(spectrum: &Spectrum) -> f32 {
    let y = |f: &dyn Fn(usize) -> f64| (0..DENSE_LENGTH).map(|i| f64::from(cie1931::Y[i]) * f(i)).sum::<f64>() as f32;
    match spectrum.curve() {
        Curve::RgbIlluminant(s) => y(&|i| f64::from(s.space.illuminant()[i])),
        _ => y(&|i| f64::from(spectrum.eval(360.0 + i as f32))),
    }
}
