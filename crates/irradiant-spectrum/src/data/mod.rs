//! Measured data, by pbrt-v4's names: illuminants, metals, glasses, camera sensors.
//!
//! Tables are generated; each file names its source, and `data-scripts/` holds what wrote them.

pub(crate) mod cie1931;
pub(crate) mod glasses;
pub(crate) mod illuminants;
pub(crate) mod metals;
pub(crate) mod swatches;

use crate::photometry::{CIE_Y_INTEGRAL, DENSE_LENGTH};
use crate::stored::{Role, Spectrum, Table};
use crate::ColorSpace;
use std::sync::Arc;

/// One named table and how to read it.
enum Entry {
    /// First wavelength, then every 5 nm; scaled to unit Y.
    Illuminant(f32, &'static [f32]),
    /// Wavelengths and values, as they stand.
    Index(&'static [f32], &'static [f32]),
    /// First wavelength, then every 5 nm; as they stand.
    Sensor(f32, &'static [f32]),
}

use Entry::{Illuminant, Index, Sensor};

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
        Sensor(first, values) => Table::new(&every_5_nm(first, values.len()), values),
        Illuminant(first, values) => {
            let lambda = every_5_nm(first, values.len());
            let raw = Table::new(&lambda, values);
            // Scaled to unit Y, so that the radiance 1 of such a light has luminance 1.
            let y: f64 = (0..DENSE_LENGTH).map(|i| f64::from(cie1931::Y[i]) * f64::from(raw.eval(360.0 + i as f32))).sum();
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

/// The named spectrum (`stdillum-D65`, `metal-Au-eta`, `glass-BK7`, …), or `None` if there is none.
///
/// Interpolated linearly and 0 outside its table. Illuminants have role [`Role::Illuminant`] and unit Y;
/// all others are [`Role::Unbounded`]. RGB values are sRGB's; see [`Spectrum::in_space`] for another space.
pub fn named(name: &str) -> Option<Arc<Spectrum>> {
    let (_, entry) = ENTRIES.iter().find(|(n, _)| *n == name)?;
    let role = if matches!(entry, Illuminant(..)) { Role::Illuminant } else { Role::Unbounded };
    Some(Arc::new(Spectrum::from_table(table(entry), role, ColorSpace::srgb())))
}

/// The names that [`named`] knows, for "did you mean".
pub fn names() -> impl Iterator<Item = &'static str> {
    ENTRIES.iter().map(|(name, _)| *name)
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
    let mut curves = Box::new([[0.0; DENSE_LENGTH]; 3]);
    for (curve, suffix) in curves.iter_mut().zip(["_r", "_g", "_b"]) {
        let (_, entry) = ENTRIES.iter().find(|(n, e)| {
            matches!(e, Sensor(..)) && n.strip_suffix(suffix).is_some_and(|stem| stem == name)
        })?;
        let table = table(entry);
        for (i, v) in curve.iter_mut().enumerate() {
            *v = table.eval(360.0 + i as f32);
        }
    }
    Some(curves)
}

/// The cameras that [`sensor`] knows.
pub(crate) fn sensor_names() -> impl Iterator<Item = &'static str> {
    ENTRIES.iter().filter(|(_, e)| matches!(e, Sensor(..))).filter_map(|(n, _)| n.strip_suffix("_r"))
}
