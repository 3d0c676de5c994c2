//! From radiance to film RGB: the CIE observer or a measured camera, exposure, white balance.
//!
//! The model is pbrt-v4's `PixelSensor`: sensor RGB is the integral of radiance and three response curves, times
//! the imaging ratio; a matrix takes sensor RGB to XYZ. For cameras that matrix is the least-squares fit over 24
//! colour-chart patches, after Langlands and Fascione 2020, "PhysLight: An End-to-End Pipeline for Scene-Referred
//! Lighting"; for the CIE observer it is the identity, or Bradford's adaptation if a white balance is asked for.

use crate::data::{self, cie1931};
use crate::emission::daylight;
use crate::matrix::{self, Matrix};
use crate::photometry::{CIE_Y_INTEGRAL, DENSE_LENGTH, xyz_of};
use crate::table::nearest_index;
use crate::{Basis, ColorSpace, LAMBDA_MIN, SampledSpectrum, Wavelengths};

/// A film's response to light.
#[derive(Clone, Debug)]
pub struct Sensor {
    name: String,
    /// Responses at 360..=830 nm in 1 nm steps, one triple (and a pad) per nm so that one cache line serves all three.
    response: Box<[[f32; 4]; DENSE_LENGTH]>,
    imaging_ratio: f32,
    xyz_from_sensor: Matrix,
}

/// Why there is no such sensor.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SensorError {
    /// No sensor of that name; see [`Sensor::names`].
    Unknown(String),
    /// The colour-chart fit has no solution.
    Singular(String),
}

impl std::fmt::Display for SensorError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Unknown(name) => write!(f, "unknown sensor \"{name}\""),
            Self::Singular(name) => write!(f, "sensor \"{name}\" cannot be calibrated under this white"),
        }
    }
}

impl std::error::Error for SensorError {}

impl Sensor {
    /// The CIE 1931 observer, unit imaging ratio, no white balance: pbrt-v4's default.
    pub fn cie1931() -> Self {
        Self::observer(1.0)
    }

    fn observer(imaging_ratio: f32) -> Self {
        let response = std::array::from_fn(|i| [cie1931::X[i], cie1931::Y[i], cie1931::Z[i], 0.0]);
        Self {
            name: "cie1931".into(),
            response: Box::new(response),
            imaging_ratio,
            xyz_from_sensor: matrix::diagonal([1.0; 3]),
        }
    }

    /// The sensor `name`, exposed for `exposure_time` s at `iso`, balanced for a white of `white_balance` K.
    ///
    /// `white_balance` 0 means none for `cie1931` and 6500 K for cameras. The imaging ratio is
    /// `exposure_time * iso / 100`. `space` is the output colour space, whose illuminant becomes white.
    pub fn new(
        name: &str,
        iso: f32,
        exposure_time: f32,
        white_balance: f32,
        space: &'static ColorSpace,
    ) -> Result<Self, SensorError> {
        let imaging_ratio = exposure_time * iso / 100.0;
        if name == "cie1931" {
            let mut sensor = Self::observer(imaging_ratio);
            if white_balance != 0.0 {
                let from = crate::spectrum_to_xyz(&daylight(white_balance, space));
                let sum = from[0] + from[1] + from[2];
                sensor.xyz_from_sensor = bradford([from[0] / sum, from[1] / sum], space.white)
                    .ok_or_else(|| SensorError::Singular(name.into()))?;
            }
            return Ok(sensor);
        }
        let curves = data::sensor(name).ok_or_else(|| SensorError::Unknown(name.into()))?;
        let white_balance = if white_balance == 0.0 { 6500.0 } else { white_balance };
        let white = daylight(white_balance, space);
        let white: [f64; DENSE_LENGTH] = std::array::from_fn(|i| f64::from(white.eval(LAMBDA_MIN + i as f32)));
        let xyz_from_sensor = calibrate(&curves, &white, space).ok_or_else(|| SensorError::Singular(name.into()))?;
        let response = std::array::from_fn(|i| [curves[0][i], curves[1][i], curves[2][i], 0.0]);
        Ok(Self { name: name.into(), response: Box::new(response), imaging_ratio, xyz_from_sensor })
    }

    /// The names that [`Sensor::new`] knows.
    pub fn names() -> impl Iterator<Item = &'static str> {
        std::iter::once("cie1931").chain(data::sensor_names())
    }

    /// The name it was made by.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What every response is multiplied by.
    pub fn imaging_ratio(&self) -> f32 {
        self.imaging_ratio
    }

    /// Sensor RGB of `radiance` (W/(m^2 sr nm) in the spectral basis), an unbiased estimate of the integral over
    /// wavelength; lanes of density 0 count nothing. In the RGB basis the first three lanes times
    /// `imaging_ratio * CIE_Y_INTEGRAL`.
    #[inline(always)]
    pub fn to_rgb(&self, radiance: SampledSpectrum, wavelengths: &Wavelengths) -> [f32; 3] {
        match wavelengths.basis {
            Basis::Rgb => {
                let scale = self.imaging_ratio * CIE_Y_INTEGRAL;
                [radiance[0] * scale, radiance[1] * scale, radiance[2] * scale]
            }
            Basis::Spectral => self.response_to(radiance, wavelengths),
        }
    }

    #[inline]
    fn response_to(&self, radiance: SampledSpectrum, wavelengths: &Wavelengths) -> [f32; 3] {
        let weighted = radiance.safe_div(wavelengths.pdf());
        let mut sum = [0.0f32; 4];
        for lane in 0..4 {
            let Some(response) = self.response.get(nearest_index(wavelengths.lambda[lane] - LAMBDA_MIN)) else {
                continue;
            };
            for c in 0..4 {
                sum[c] += response[c] * weighted[lane];
            }
        }
        let scale = self.imaging_ratio * 0.25;
        [sum[0] * scale, sum[1] * scale, sum[2] * scale]
    }

    /// The matrix from sensor RGB to XYZ.
    pub fn xyz_from_sensor_rgb(&self) -> [[f32; 3]; 3] {
        matrix::rounded(&self.xyz_from_sensor)
    }

    /// The matrix from sensor RGB to linear RGB of `space`, for a render in `basis`; identity in the RGB basis.
    pub fn output_rgb_from_sensor_rgb(&self, space: &ColorSpace, basis: Basis) -> [[f32; 3]; 3] {
        match basis {
            Basis::Rgb => matrix::rounded(&matrix::diagonal([1.0; 3])),
            Basis::Spectral => matrix::rounded(&matrix::multiply(&space.rgb_from_xyz_exact, &self.xyz_from_sensor)),
        }
    }
}

/// The matrix that adapts XYZ from white `from` to white `to` (xy), by Bradford's cone responses (Lam 1985).
fn bradford(from: [f64; 2], to: [f64; 2]) -> Option<Matrix> {
    const LMS: Matrix = [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];
    let lms = |[x, y]: [f64; 2]| matrix::apply(&LMS, [x / y, 1.0, (1.0 - x - y) / y]);
    let (from, to) = (lms(from), lms(to));
    let gain = matrix::diagonal(std::array::from_fn(|i| to[i] / from[i]));
    Some(matrix::multiply(&matrix::multiply(&matrix::invert(&LMS)?, &gain), &LMS))
}

/// The least-squares matrix from camera responses under `white` to XYZ under the space's illuminant, over the chart.
fn calibrate(curves: &[[f32; DENSE_LENGTH]; 3], white: &[f64; DENSE_LENGTH], space: &ColorSpace) -> Option<Matrix> {
    let integral = |f: &dyn Fn(usize) -> f64| (0..DENSE_LENGTH).map(f).sum::<f64>();
    let white_g = integral(&|i| white[i] * f64::from(curves[1][i]));
    let white_y = integral(&|i| white[i] * f64::from(cie1931::Y[i]));
    let light = space.illuminant();
    let light_y = integral(&|i| f64::from(light[i]) * f64::from(cie1931::Y[i]));
    // Normal equations: (A^T A) M^T = A^T B, one row of A and B per patch.
    let (mut ata, mut atb) = ([[0.0; 3]; 3], [[0.0; 3]; 3]);
    for patch in data::swatches_dense() {
        let camera: [f64; 3] =
            std::array::from_fn(|c| integral(&|i| f64::from(curves[c][i]) * f64::from(patch[i]) * white[i]) / white_g);
        let xyz = xyz_of(|i| f64::from(patch[i]) * f64::from(light[i]));
        let xyz = xyz.map(|v| v * f64::from(CIE_Y_INTEGRAL) / light_y * (white_y / white_g));
        for r in 0..3 {
            for c in 0..3 {
                ata[r][c] += camera[r] * camera[c];
                atb[r][c] += camera[r] * xyz[c];
            }
        }
    }
    let solution = matrix::multiply(&matrix::invert(&ata)?, &atb);
    Some(std::array::from_fn(|r| std::array::from_fn(|c| solution[c][r])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::apply_f32;
    use crate::{Role, Spectrum};

    /// Output RGB of light `f`, by 1 nm sums.
    fn seen(sensor: &Sensor, f: impl Fn(usize) -> f64, space: &ColorSpace) -> [f32; 3] {
        let rgb: [f32; 3] = std::array::from_fn(|c| {
            (0..DENSE_LENGTH).map(|i| f64::from(sensor.response[i][c]) * f(i)).sum::<f64>() as f32
                * sensor.imaging_ratio
        });
        apply_f32(&sensor.output_rgb_from_sensor_rgb(space, Basis::Spectral), rgb)
    }

    #[test]
    fn every_camera_is_white_under_its_white() {
        let space = ColorSpace::srgb();
        assert_eq!(Sensor::names().count(), 18);
        for name in Sensor::names() {
            for kelvin in [3200.0, 5000.0, 6500.0, 9000.0] {
                let sensor = Sensor::new(name, 100.0, 1.0, kelvin, space).unwrap();
                let light = daylight(kelvin, space);
                let rgb = seen(&sensor, |i| f64::from(light.eval(360.0 + i as f32)), space);
                // The colour-chart fit is not made to hit white exactly; the observer's adaptation is.
                let tolerance = if name == "cie1931" { 1e-4 } else { 0.06 };
                for c in rgb {
                    assert!((c / rgb[1] - 1.0).abs() < tolerance, "{name} at {kelvin}: {rgb:?}");
                }
                // Luminance is that of the light.
                let y = f64::from(crate::spectrum_to_photometric(&light)) as f32;
                assert!((space.luminance(rgb) / y - 1.0).abs() < 0.05, "{name} at {kelvin}: {rgb:?} {y}");
            }
        }
    }

    // The 24 patches seen by the camera and by the observer, in linear RGB of white 1: the mean difference of all is 0.005 to 0.0073.
    #[test]
    fn cameras_see_the_chart_nearly_as_the_observer_does() {
        let space = ColorSpace::srgb();
        let light = space.illuminant();
        for name in Sensor::names() {
            let sensor = Sensor::new(name, 100.0, 1.0, 0.0, space).unwrap();
            let day = if name == "cie1931" {
                Spectrum::dense(light, Role::Illuminant, space)
            } else {
                daylight(6500.0, space)
            };
            let day: Vec<f64> = (0..DENSE_LENGTH).map(|i| f64::from(day.eval(360.0 + i as f32))).collect();
            let white = seen(&sensor, |i| day[i], space)[1];
            let mut mean = 0.0;
            for patch in data::swatches_dense() {
                let rgb = seen(&sensor, |i| day[i] * f64::from(patch[i]), space);
                let xyz = xyz_of(|i| f64::from(light[i]) * f64::from(patch[i]));
                let want = matrix::apply(&space.rgb_from_xyz_exact, xyz);
                for c in 0..3 {
                    let apart = (rgb[c] / white - want[c] as f32).abs();
                    assert!(apart < 0.12, "{name}: {rgb:?} {want:?}");
                    mean += apart / 72.0;
                }
            }
            assert!(mean < 0.008, "{name}: {mean}");
        }
    }

    #[test]
    fn exposure_multiplies() {
        let space = ColorSpace::srgb();
        let (a, b) = (Sensor::cie1931(), Sensor::new("cie1931", 200.0, 0.25, 0.0, space).unwrap());
        let w = Wavelengths::sample_visible(0.4);
        let (a, b) = (a.to_rgb(SampledSpectrum::ONE, &w), b.to_rgb(SampledSpectrum::ONE, &w));
        assert_eq!(a.map(|v| v * 0.5), b);
        assert!(matches!(Sensor::new("kodak", 100.0, 1.0, 0.0, space), Err(SensorError::Unknown(_))));
    }

    #[test]
    fn the_rgb_basis_passes_straight_through() {
        let space = ColorSpace::srgb();
        for name in ["cie1931", "nikon_d850"] {
            let sensor = Sensor::new(name, 100.0, 1.0, 0.0, space).unwrap();
            let light = Spectrum::rgb_illuminant([0.5, 2.0, 0.25], space);
            let w = Wavelengths::rgb();
            let radiance = light.sample(&w) / crate::spectrum_to_photometric(&light);
            let rgb = apply_f32(&sensor.output_rgb_from_sensor_rgb(space, w.basis), sensor.to_rgb(radiance, &w));
            for (got, want) in rgb.into_iter().zip([0.5, 2.0, 0.25]) {
                assert!((got - want).abs() < 1e-4, "{rgb:?}");
            }
        }
    }
}
