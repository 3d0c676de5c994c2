//! Measured data, by pbrt-v4's names: illuminants, metals, glasses, camera sensors.
//!
//! Tables are generated; each file names its source, and `data-scripts/` holds what wrote them.

pub(crate) mod cie1931;
pub(crate) mod glasses;
pub(crate) mod illuminants;
pub(crate) mod metals;
pub(crate) mod sensors;
pub(crate) mod swatches;

use crate::ColorSpace;
use crate::photometry::{CIE_Y_INTEGRAL, DENSE_LENGTH};
use crate::stored::{Role, Spectrum};
use crate::table::Table;
use std::sync::{Arc, LazyLock};

/// One named table and how to read it.
enum Entry {
    /// First wavelength, then every 5 nm; scaled to unit Y.
    Illuminant(f32, &'static [f32]),
    /// Wavelengths and values, as they stand.
    Index(&'static [f32], &'static [f32]),
}

use Entry::{Illuminant, Index};

/// In alphabetical order of kind, then as pbrt-v4 lists them.
static ENTRIES: &[(&str, Entry)] = &[
    ("glass-BK7", Index(&glasses::BK7_LAMBDA, &glasses::BK7_ETA)),
    ("glass-BAF10", Index(&glasses::BAF10_LAMBDA, &glasses::BAF10_ETA)),
    ("glass-FK51A", Index(&glasses::FK51A_LAMBDA, &glasses::FK51A_ETA)),
    ("glass-LASF9", Index(&glasses::LASF9_LAMBDA, &glasses::LASF9_ETA)),
    // pbrt-v4 knows Schott's SF5, SF10 and SF11 as F5, F10 and F11; both names are understood.
    ("glass-F5", Index(&glasses::SF5_LAMBDA, &glasses::SF5_ETA)),
    ("glass-F10", Index(&glasses::SF10_LAMBDA, &glasses::SF10_ETA)),
    ("glass-F11", Index(&glasses::SF11_LAMBDA, &glasses::SF11_ETA)),
    ("glass-SF5", Index(&glasses::SF5_LAMBDA, &glasses::SF5_ETA)),
    ("glass-SF10", Index(&glasses::SF10_LAMBDA, &glasses::SF10_ETA)),
    ("glass-SF11", Index(&glasses::SF11_LAMBDA, &glasses::SF11_ETA)),
    ("metal-Ag-eta", Index(&metals::AG_LAMBDA, &metals::AG_ETA)),
    ("metal-Ag-k", Index(&metals::AG_LAMBDA, &metals::AG_K)),
    ("metal-Al-eta", Index(&metals::AL_LAMBDA, &metals::AL_ETA)),
    ("metal-Al-k", Index(&metals::AL_LAMBDA, &metals::AL_K)),
    ("metal-Au-eta", Index(&metals::AU_LAMBDA, &metals::AU_ETA)),
    ("metal-Au-k", Index(&metals::AU_LAMBDA, &metals::AU_K)),
    ("metal-Cu-eta", Index(&metals::CU_LAMBDA, &metals::CU_ETA)),
    ("metal-Cu-k", Index(&metals::CU_LAMBDA, &metals::CU_K)),
    ("metal-CuZn-eta", Index(&metals::CUZN_LAMBDA, &metals::CUZN_ETA)),
    ("metal-CuZn-k", Index(&metals::CUZN_LAMBDA, &metals::CUZN_K)),
    ("metal-MgO-eta", Index(&metals::MGO_LAMBDA, &metals::MGO_ETA)),
    ("metal-MgO-k", Index(&metals::MGO_LAMBDA, &metals::MGO_K)),
    ("metal-TiO2-eta", Index(&metals::TIO2_LAMBDA, &metals::TIO2_ETA)),
    ("metal-TiO2-k", Index(&metals::TIO2_LAMBDA, &metals::TIO2_K)),
    ("stdillum-A", Illuminant(300.0, &illuminants::A)),
    ("stdillum-D50", Illuminant(300.0, &illuminants::D50)),
    ("stdillum-D65", Illuminant(300.0, &illuminants::D65)),
    ("stdillum-F1", Illuminant(380.0, &illuminants::F1)),
    ("stdillum-F2", Illuminant(380.0, &illuminants::F2)),
    ("stdillum-F3", Illuminant(380.0, &illuminants::F3)),
    ("stdillum-F4", Illuminant(380.0, &illuminants::F4)),
    ("stdillum-F5", Illuminant(380.0, &illuminants::F5)),
    ("stdillum-F6", Illuminant(380.0, &illuminants::F6)),
    ("stdillum-F7", Illuminant(380.0, &illuminants::F7)),
    ("stdillum-F8", Illuminant(380.0, &illuminants::F8)),
    ("stdillum-F9", Illuminant(380.0, &illuminants::F9)),
    ("stdillum-F10", Illuminant(380.0, &illuminants::F10)),
    ("stdillum-F11", Illuminant(380.0, &illuminants::F11)),
    ("stdillum-F12", Illuminant(380.0, &illuminants::F12)),
    ("illum-acesD60", Illuminant(300.0, &illuminants::ACES_D60)),
];

fn every_5_nm(first: f32, n: usize) -> Vec<f32> {
    (0..n).map(|i| first + 5.0 * i as f32).collect()
}

/// The table of `entry`: normalised if it is an illuminant.
fn table(entry: &Entry) -> Table {
    match *entry {
        Index(lambda, values) => Table::new(lambda, values),
        Illuminant(first, values) => {
            let lambda = every_5_nm(first, values.len());
            let raw = Table::new(&lambda, values);
            // Scaled to unit Y, so that the radiance 1 of such a light has luminance 1.
            let y: f64 =
                (0..DENSE_LENGTH).map(|i| f64::from(cie1931::Y[i]) * f64::from(raw.eval(360.0 + i as f32))).sum();
            let scale = f64::from(CIE_Y_INTEGRAL) / y;
            let scaled: Vec<f32> = values.iter().map(|&v| (f64::from(v) * scale) as f32).collect();
            Table::new(&lambda, &scaled)
        }
    }
}

/// The normalised illuminant of that name at 1 nm; constant 1 for a name that is not an illuminant's.
pub(crate) fn dense_illuminant(name: &str) -> Box<[f32; DENSE_LENGTH]> {
    let found = ENTRIES.iter().find(|(n, e)| *n == name && matches!(e, Illuminant(..)));
    let mut dense = Box::new([1.0; DENSE_LENGTH]);
    if let Some((_, entry)) = found {
        let table = table(entry);
        for (i, v) in dense.iter_mut().enumerate() {
            *v = table.eval(360.0 + i as f32);
        }
    }
    dense
}

/// The response of `camera` in channel 0, 1 or 2.
fn sensor_table(camera: &sensors::Camera, channel: usize) -> Table {
    let lambda: Vec<f32> = (0..35).map(|i| 380.0 + 10.0 * i as f32).collect();
    let values: Vec<f32> = camera[channel].iter().map(|&v| v as f32 * 1e-5).collect();
    Table::new(&lambda, &values)
}

/// The named spectrum (`stdillum-D65`, `metal-Au-eta`, `glass-BK7`, `nikon_d850_r`, …), or `None` if there is none.
///
/// Interpolated linearly and 0 outside its table. Illuminants have role [`Role::Illuminant`] and unit Y;
/// all others are [`Role::Unbounded`]. RGB values are sRGB's; see [`Spectrum::in_space`] for another space.
pub fn named(name: &str) -> Option<Arc<Spectrum>> {
    let (table, role) = if let Some((_, entry)) = ENTRIES.iter().find(|(n, _)| *n == name) {
        let role = if matches!(entry, Illuminant(..)) { Role::Illuminant } else { Role::Unbounded };
        (table(entry), role)
    } else {
        let (stem, channel) = SUFFIXES.iter().zip(0..).find_map(|(s, c)| Some((name.strip_suffix(s)?, c)))?;
        let (_, camera) = sensors::CAMERAS.iter().find(|(n, _)| *n == stem)?;
        (sensor_table(camera, channel), Role::Unbounded)
    };
    Some(Arc::new(Spectrum::from_table(table, role, ColorSpace::srgb())))
}

/// What a camera's name is followed by for each channel.
const SUFFIXES: [&str; 3] = ["_r", "_g", "_b"];

/// The names that [`named`] knows, for "did you mean".
pub fn names() -> impl Iterator<Item = &'static str> {
    static CHANNELS: LazyLock<Vec<String>> =
        LazyLock::new(|| sensors::CAMERAS.iter().flat_map(|(n, _)| SUFFIXES.map(|s| format!("{n}{s}"))).collect());
    ENTRIES.iter().map(|(name, _)| *name).chain(CHANNELS.iter().map(String::as_str))
}

/// The colour-chart patches at 1 nm, 0 outside 380..=730 nm as in pbrt-v4.
pub(crate) fn swatches_dense() -> Vec<[f32; DENSE_LENGTH]> {
    let lambda: Vec<f32> = (0..36).map(|i| 380.0 + 10.0 * i as f32).collect();
    swatches::SWATCHES
        .iter()
        .map(|values| {
            let table = Table::new(&lambda, values);
            std::array::from_fn(|i| table.eval(360.0 + i as f32))
        })
        .collect()
}

/// Red, green and blue responses of the camera `name` at 1 nm.
pub(crate) fn sensor(name: &str) -> Option<Box<[[f32; DENSE_LENGTH]; 3]>> {
    let (_, camera) = sensors::CAMERAS.iter().find(|(n, _)| *n == name)?;
    let mut curves = Box::new([[0.0; DENSE_LENGTH]; 3]);
    for (channel, curve) in curves.iter_mut().enumerate() {
        let table = sensor_table(camera, channel);
        for (i, v) in curve.iter_mut().enumerate() {
            *v = table.eval(360.0 + i as f32);
        }
    }
    Some(curves)
}

/// The cameras that [`sensor`] knows.
pub(crate) fn sensor_names() -> impl Iterator<Item = &'static str> {
    sensors::CAMERAS.iter().map(|(n, _)| *n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_named_spectrum_exists_and_is_plausible() {
        let all: Vec<&str> = names().collect();
        assert_eq!(all.len(), 10 + 14 + 15 + 1 + 51);
        for &name in &all {
            let s = named(name).unwrap();
            assert!(s.max_value() > 0.0 || name.ends_with("-k"), "{name}");
            for l in (360..=830).step_by(5) {
                let v = s.eval(l as f32);
                assert!((0.0..20.0).contains(&v), "{name} at {l}: {v}");
                // Some glasses' tables begin at 370 or 380 nm; before that they are 0, as in pbrt-v4.
                if name.starts_with("glass") && l >= 380 {
                    assert!((1.47..1.96).contains(&v), "{name} at {l}: {v}");
                }
            }
        }
        assert!(named("stdillum-D66").is_none() && named("nikon_d850").is_none() && named("").is_none());
        assert_eq!(all.iter().collect::<std::collections::BTreeSet<_>>().len(), all.len(), "a name twice");
    }

    // The responses are typed by hand: a digit lost or doubled makes a step of 2.3 in the logarithm.
    #[test]
    fn camera_responses_are_smooth() {
        for (name, camera) in &sensors::CAMERAS {
            assert_eq!(camera[1].iter().max(), Some(&100_000), "{name}");
            for (curve, channel) in camera.iter().zip(SUFFIXES) {
                // 430 to 690 nm; the ultraviolet edge is steep.
                for i in 5..32 {
                    let [before, at, after] = [curve[i - 1], curve[i], curve[i + 1]].map(|v| f64::from(v).ln());
                    let kink = (at - (before + after) / 2.0).abs();
                    assert!(kink < 0.85, "{name}{channel} at {} nm: {kink}", 380 + 10 * i);
                }
            }
        }
    }

    #[test]
    fn published_figures_are_reproduced() {
        // Schott's catalogue index at the d line, 587.6 nm; interpolation errs by some 1e-5.
        for (name, nd) in [
            ("BK7", 1.5168),
            ("BAF10", 1.67003),
            ("LASF9", 1.85025),
            ("F5", 1.6727),
            ("SF10", 1.72825),
            ("F11", 1.78472),
        ] {
            let n = named(&format!("glass-{name}")).unwrap().eval(587.6);
            assert!((n - nd).abs() < 3e-4, "{name}: {n}");
        }
        assert_eq!(named("metal-Au-eta").unwrap().eval(442.80063), 1.562);
        assert_eq!(named("metal-Cu-k").unwrap().eval(298.75705), 1.662125);
        // Ratios of the unnormalised tables.
        let d65 = named("stdillum-D65").unwrap();
        assert!((d65.eval(450.0) / d65.eval(560.0) - 1.17008).abs() < 1e-5);
        assert!((d65.eval(830.0) / d65.eval(560.0) - 0.603125).abs() < 1e-5);
        assert_eq!(d65.eval(299.0), 0.0);
        assert!(named("stdillum-A").unwrap().eval(785.0) > 0.0);
    }

    #[test]
    fn illuminants_have_unit_luminance_and_the_published_white() {
        for (name, x, y) in [
            ("stdillum-A", 0.44757, 0.40745),
            ("stdillum-D50", 0.34567, 0.35850),
            ("stdillum-D65", 0.31271, 0.32902),
            ("illum-acesD60", 0.32168, 0.33767),
            ("stdillum-F2", 0.37208, 0.37529),
            ("stdillum-F11", 0.38052, 0.37713),
        ] {
            let xyz = crate::spectrum_to_xyz(&named(name).unwrap());
            assert!((xyz[1] - 1.0).abs() < 1e-5, "{name}: Y {}", xyz[1]);
            let sum: f64 = xyz.iter().sum();
            let (gx, gy) = (xyz[0] / sum, xyz[1] / sum);
            // pbrt-v4's D50 is bluer than CIE's (91.6 at 700 nm there, 77.8 here); kept, so that pictures agree.
            let tolerance = if name == "stdillum-D50" { 1e-2 } else { 5e-4 };
            assert!((gx - x).abs() < tolerance && (gy - y).abs() < tolerance, "{name}: {gx} {gy}");
        }
    }
}
