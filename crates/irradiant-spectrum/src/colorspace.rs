//! RGB colour spaces: primaries, white, conversion to and from XYZ, uplifting.
//!
//! Four spaces are known, by pbrt-v4's names. Matrices are built in `f64` from the primaries and from
//! the tabulated illuminant's own white (not a rounded chromaticity), as pbrt-v4 does.

use crate::matrix::{self, Matrix, apply_f32};
use crate::photometry::{DENSE_LENGTH, xyz_of_dense};
use crate::uplift::{Columns, Gamut, SigmoidPolynomial};
use std::sync::LazyLock;

/// An RGB colour space with linear components.
///
/// There is one instance of each, reached by [`ColorSpace::named`] or the functions named for them;
/// compare with `==`, which compares names.
#[derive(Debug)]
pub struct ColorSpace {
    /// pbrt-v4's name: `srgb`, `dci-p3`, `rec2020`, `aces2065-1`.
    pub name: &'static str,
    /// CIE 1931 xy of red, green and blue.
    pub primaries: [[f64; 2]; 3],
    /// CIE 1931 xy of the illuminant.
    pub white: [f64; 2],
    /// Linear RGB to XYZ; (1, 1, 1) becomes the illuminant's XYZ with Y = 1.
    pub xyz_from_rgb: [[f32; 3]; 3],
    /// XYZ to linear RGB.
    pub rgb_from_xyz: [[f32; 3]; 3],
    pub(crate) xyz_from_rgb_exact: Matrix,
    pub(crate) rgb_from_xyz_exact: Matrix,
    illuminant: Box<[f32; DENSE_LENGTH]>,
    columns: Columns,
}

impl PartialEq for ColorSpace {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for ColorSpace {}

static SRGB: LazyLock<ColorSpace> =
    LazyLock::new(|| ColorSpace::build("srgb", [[0.64, 0.33], [0.3, 0.6], [0.15, 0.06]], "stdillum-D65", Gamut::Srgb));
static DCI_P3: LazyLock<ColorSpace> = LazyLock::new(|| {
    ColorSpace::build("dci-p3", [[0.68, 0.32], [0.265, 0.69], [0.15, 0.06]], "stdillum-D65", Gamut::DciP3)
});
static REC2020: LazyLock<ColorSpace> = LazyLock::new(|| {
    ColorSpace::build("rec2020", [[0.708, 0.292], [0.17, 0.797], [0.131, 0.046]], "stdillum-D65", Gamut::Rec2020)
});
static ACES2065_1: LazyLock<ColorSpace> = LazyLock::new(|| {
    ColorSpace::build("aces2065-1", [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077]], "illum-acesD60", Gamut::Aces2065)
});

impl ColorSpace {
    /// The names that [`ColorSpace::named`] knows.
    pub const NAMES: [&'static str; 4] = ["srgb", "dci-p3", "rec2020", "aces2065-1"];

    /// sRGB: the primaries of ITU-R BT.709 under D65.
    pub fn srgb() -> &'static Self {
        &SRGB
    }

    /// Display P3: the DCI-P3 primaries under D65.
    pub fn dci_p3() -> &'static Self {
        &DCI_P3
    }

    /// ITU-R BT.2020 under D65.
    pub fn rec2020() -> &'static Self {
        &REC2020
    }

    /// ACES2065-1 (AP0 primaries) under ACES D60.
    pub fn aces2065_1() -> &'static Self {
        &ACES2065_1
    }

    /// The space of that name, upper or lower case; `None` if there is none.
    pub fn named(name: &str) -> Option<&'static Self> {
        match name.to_ascii_lowercase().as_str() {
            "srgb" => Some(Self::srgb()),
            "dci-p3" => Some(Self::dci_p3()),
            "rec2020" => Some(Self::rec2020()),
            "aces2065-1" => Some(Self::aces2065_1()),
            _ => None,
        }
    }

    /// The space with these chromaticities (red, green, blue, white), each within 0.1 %; `None` if there is none.
    ///
    /// For images that state chromaticities.
    pub fn with_chromaticities(primaries: [[f64; 2]; 3], white: [f64; 2]) -> Option<&'static Self> {
        let close = |a: f64, b: f64| a == b || ((a - b) / b).abs() < 1e-3;
        let close2 = |a: [f64; 2], b: [f64; 2]| close(a[0], b[0]) && close(a[1], b[1]);
        [Self::aces2065_1(), Self::dci_p3(), Self::rec2020(), Self::srgb()]
            .into_iter()
            .find(|s| (0..3).all(|i| close2(primaries[i], s.primaries[i])) && close2(white, s.white))
    }

    fn build(name: &'static str, primaries: [[f64; 2]; 3], illuminant: &str, gamut: Gamut) -> Self {
        let illuminant = crate::data::dense_illuminant(illuminant);
        let white_xyz = xyz_of_dense(&illuminant);
        let sum: f64 = white_xyz.iter().sum();
        let columns = primaries.map(|[x, y]| if y == 0.0 { [0.0; 3] } else { [x / y, 1.0, (1.0 - x - y) / y] });
        let unscaled: Matrix = std::array::from_fn(|r| std::array::from_fn(|c| columns[c][r]));
        // The primaries of the four spaces above span XYZ, so both inverses exist.
        let scale = matrix::invert(&unscaled).map_or([1.0; 3], |inverse| matrix::apply(&inverse, white_xyz));
        let xyz_from_rgb = matrix::multiply(&unscaled, &matrix::diagonal(scale));
        let rgb_from_xyz = matrix::invert(&xyz_from_rgb).unwrap_or(matrix::diagonal([1.0; 3]));
        Self {
            name,
            primaries,
            white: [white_xyz[0] / sum, white_xyz[1] / sum],
            xyz_from_rgb: matrix::rounded(&xyz_from_rgb),
            rgb_from_xyz: matrix::rounded(&rgb_from_xyz),
            xyz_from_rgb_exact: xyz_from_rgb,
            rgb_from_xyz_exact: rgb_from_xyz,
            illuminant,
            columns: Columns::new(gamut),
        }
    }

    /// XYZ of linear `rgb`.
    #[inline]
    pub fn to_xyz(&self, rgb: [f32; 3]) -> [f32; 3] {
        apply_f32(&self.xyz_from_rgb, rgb)
    }

    /// Linear RGB of `xyz`; components may be negative.
    #[inline]
    pub fn from_xyz(&self, xyz: [f32; 3]) -> [f32; 3] {
        apply_f32(&self.rgb_from_xyz, xyz)
    }

    /// Relative luminance Y of linear `rgb`; 1 for (1, 1, 1).
    #[inline]
    pub fn luminance(&self, rgb: [f32; 3]) -> f32 {
        let y = &self.xyz_from_rgb[1];
        y[0] * rgb[0] + y[1] * rgb[1] + y[2] * rgb[2]
    }

    /// The matrix that takes linear RGB of this space to linear RGB of `other`; identity for the same space.
    pub fn convert_to(&self, other: &Self) -> [[f32; 3]; 3] {
        if self == other {
            return matrix::rounded(&matrix::diagonal([1.0; 3]));
        }
        matrix::rounded(&matrix::multiply(&other.rgb_from_xyz_exact, &self.xyz_from_rgb_exact))
    }

    /// The illuminant at 360..=830 nm in 1 nm steps, normalised so that its Y is 1.
    #[inline]
    pub fn illuminant(&self) -> &[f32; DENSE_LENGTH] {
        &self.illuminant
    }

    /// A smooth reflectance spectrum that looks like linear `rgb` under this space's illuminant.
    ///
    /// Components are clamped to [0, 1] (NaN to 0). About 60 ns once the neighbourhood of the colour has
    /// been seen, up to 1.5 ms the first time (four columns of up to 64 fits). See [`crate::uplift`].
    #[inline]
    pub fn uplift(&self, rgb: [f32; 3]) -> SigmoidPolynomial {
        self.columns.uplift(rgb)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_matrix_is_the_published_one() {
        let s = ColorSpace::srgb();
        let published =
            [[0.412_453, 0.357_580, 0.180_423], [0.212_671, 0.715_160, 0.072_169], [0.019_334, 0.119_193, 0.950_227]];
        for r in 0..3 {
            for c in 0..3 {
                assert!((s.xyz_from_rgb[r][c] - published[r][c]).abs() < 3e-4, "{:?}", s.xyz_from_rgb);
            }
        }
        assert!((s.white[0] - 0.3127).abs() < 1e-4 && (s.white[1] - 0.3290).abs() < 1e-4, "{:?}", s.white);
    }

    #[test]
    fn white_has_unit_luminance_and_round_trips_in_every_space() {
        for name in ColorSpace::NAMES {
            let s = ColorSpace::named(name).unwrap();
            assert_eq!(s.name, name);
            assert!((s.luminance([1.0; 3]) - 1.0).abs() < 1e-5, "{name}");
            let rgb = s.from_xyz(s.to_xyz([0.2, 0.5, 0.9]));
            for (got, want) in rgb.into_iter().zip([0.2, 0.5, 0.9]) {
                assert!((got - want).abs() < 1e-5, "{name}: {rgb:?}");
            }
            assert_eq!(ColorSpace::with_chromaticities(s.primaries, s.white).map(|s| s.name), Some(name));
        }
        assert_eq!(ColorSpace::named("sRGB"), Some(ColorSpace::srgb()));
        assert_eq!(ColorSpace::named("adobe"), None);
    }

    #[test]
    fn conversion_between_spaces_goes_through_xyz() {
        let (a, b) = (ColorSpace::srgb(), ColorSpace::rec2020());
        let m = a.convert_to(b);
        let direct = apply_f32(&m, [0.9, 0.1, 0.3]);
        let by_xyz = b.from_xyz(a.to_xyz([0.9, 0.1, 0.3]));
        for (got, want) in direct.into_iter().zip(by_xyz) {
            assert!((got - want).abs() < 1e-5);
        }
        assert_eq!(a.convert_to(a), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    }
}
