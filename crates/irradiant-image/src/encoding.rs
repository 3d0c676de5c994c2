//! Transfer functions between stored code values and linear light, and tables for 8-bit storage.
//!
//! All tables are built with `libm` in f64 and rounded once, so they have the same bits everywhere.
//! Source: IEC 61966-2-1:1999 (sRGB).

use std::sync::OnceLock;

/// How integer code values stand for linear light. Float storage is always linear.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Encoding {
    /// Code value / maximum is linear already.
    Linear,
    /// The piecewise sRGB curve.
    #[default]
    Srgb,
    /// linear = code^gamma; the exponent is positive.
    Gamma(f32),
}

impl Encoding {
    /// The encoding that a pbrt-v4 scene calls so: "linear", "sRGB", or "gamma" and a positive number.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "linear" => Some(Self::Linear),
            "sRGB" => Some(Self::Srgb),
            _ => {
                let gamma: f32 = name.strip_prefix("gamma ")?.trim().parse().ok()?;
                (gamma.is_finite() && gamma > 0.0).then_some(Self::Gamma(gamma))
            }
        }
    }

    /// The linear value of a code value in [0, 1]; codes outside are extended as the curve's formula says, below 0 mirrored.
    pub fn decode(self, code: f32) -> f32 {
        match self {
            Self::Linear => code,
            Self::Srgb => linear_from_srgb(code),
            Self::Gamma(gamma) => (libm::pow(f64::from(code.abs()), f64::from(gamma)) as f32).copysign(code),
        }
    }

    /// The code value of a linear value: the inverse of [`Encoding::decode`].
    pub fn encode(self, linear: f32) -> f32 {
        match self {
            Self::Linear => linear,
            Self::Srgb => srgb_from_linear(linear),
            Self::Gamma(gamma) => (libm::pow(f64::from(linear.abs()), 1.0 / f64::from(gamma)) as f32).copysign(linear),
        }
    }

    /// Linear values of the 256 codes of 8-bit storage.
    pub fn decode_table(self) -> [f32; 256] {
        match self {
            Self::Srgb => *srgb_table(),
            Self::Linear | Self::Gamma(_) => std::array::from_fn(|code| self.decode_u8_slowly(code as u8)),
        }
    }

    /// The linear value of an 8-bit code; for many of them take [`Encoding::decode_table`].
    #[inline]
    pub fn decode_u8(self, code: u8) -> f32 {
        match self {
            Self::Srgb => srgb_table()[usize::from(code)],
            Self::Linear | Self::Gamma(_) => self.decode_u8_slowly(code),
        }
    }

    fn decode_u8_slowly(self, code: u8) -> f32 {
        let code = f64::from(code) / 255.0;
        match self {
            Self::Linear => code as f32,
            Self::Srgb => linear_from_srgb_f64(code) as f32,
            Self::Gamma(gamma) => libm::pow(code, f64::from(gamma)) as f32,
        }
    }
}

/// sRGB code value of a linear value; negative values are mirrored, values above 1 extend the power curve.
pub fn srgb_from_linear(linear: f32) -> f32 {
    let magnitude = f64::from(linear.abs());
    let code =
        if magnitude <= 0.003_130_8 { 12.92 * magnitude } else { 1.055 * libm::pow(magnitude, 1.0 / 2.4) - 0.055 };
    (code as f32).copysign(linear)
}

/// Linear value of an sRGB code value; negative values are mirrored.
pub fn linear_from_srgb(code: f32) -> f32 {
    (linear_from_srgb_f64(f64::from(code.abs())) as f32).copysign(code)
}

fn linear_from_srgb_f64(code: f64) -> f64 {
    if code <= 0.04045 { code / 12.92 } else { libm::pow((code + 0.055) / 1.055, 2.4) }
}

/// Linear values of the 256 sRGB codes.
fn srgb_table() -> &'static [f32; 256] {
    static TABLE: OnceLock<Box<[f32; 256]>> = OnceLock::new();
    TABLE.get_or_init(|| Box::new(std::array::from_fn(|code| Encoding::Srgb.decode_u8_slowly(code as u8))))
}

/// Rounds linear values to 8-bit codes, exactly and without a power function per value.
///
/// The code changes at the linear values of the half-way codes; a coarse table finds the
/// neighbourhood and a step or two the code.
#[derive(Clone, Debug)]
pub struct EncoderU8 {
    /// `thresholds[k]` is the least linear value whose code is above `k`.
    thresholds: [f32; 256],
    /// The code at the lower end of each of [`Self::CELLS`] equal intervals of [0, 1].
    starts: Vec<u8>,
}

impl EncoderU8 {
    const CELLS: usize = 4096;

    /// A rounder for that encoding.
    pub fn new(encoding: Encoding) -> Self {
        let mut thresholds = [f32::INFINITY; 256];
        for (code, threshold) in thresholds.iter_mut().enumerate().take(255) {
            let half_way = (code as f64 + 0.5) / 255.0;
            *threshold = match encoding {
                Encoding::Linear => half_way as f32,
                Encoding::Srgb => linear_from_srgb_f64(half_way) as f32,
                Encoding::Gamma(gamma) => libm::pow(half_way, f64::from(gamma)) as f32,
            };
        }
        let starts = (0..=Self::CELLS)
            .map(|cell| {
                let lower = cell as f32 / Self::CELLS as f32;
                thresholds.partition_point(|&threshold| threshold <= lower).min(255) as u8
            })
            .collect();
        Self { thresholds, starts }
    }

    /// The nearest code; below 0 and NaN give 0, above 1 gives 255.
    #[inline]
    pub fn encode(&self, linear: f32) -> u8 {
        // NaN fails the comparison and leaves as 0.
        let clamped = if linear > 0.0 { linear.min(1.0) } else { 0.0 };
        let mut code = self.starts[usize::from((clamped * Self::CELLS as f32) as u16)];
        while clamped >= self.thresholds[usize::from(code)] {
            code += 1;
        }
        code
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_survive_decoding_and_encoding() {
        for encoding in [Encoding::Linear, Encoding::Srgb, Encoding::Gamma(2.2), Encoding::Gamma(0.7)] {
            let table = encoding.decode_table();
            let encoder = EncoderU8::new(encoding);
            for code in 0..=255u8 {
                assert_eq!(encoder.encode(table[usize::from(code)]), code, "{encoding:?}");
                assert_eq!(encoding.decode_u8(code), table[usize::from(code)]);
            }
        }
    }

    #[test]
    fn table_rounding_is_the_formula_rounded() {
        for encoding in [Encoding::Linear, Encoding::Srgb, Encoding::Gamma(2.2)] {
            let encoder = EncoderU8::new(encoding);
            for step in 0..=100_000 {
                let linear = step as f32 / 100_000.0;
                let code = encoding.encode(linear) * 255.0;
                let distance = (f32::from(encoder.encode(linear)) - code).abs();
                assert!(distance <= 0.5001, "{encoding:?} {linear}: off by {distance}");
            }
        }
    }

    #[test]
    fn names_of_scenes_are_understood() {
        assert_eq!(Encoding::from_name("sRGB"), Some(Encoding::Srgb));
        assert_eq!(Encoding::from_name("gamma 2.2"), Some(Encoding::Gamma(2.2)));
        for name in ["gamma", "gamma 0", "gamma -1", "gamma nan", "srgb", ""] {
            assert_eq!(Encoding::from_name(name), None, "{name:?}");
        }
    }

    #[test]
    fn ends_and_nonsense() {
        let encoder = EncoderU8::new(Encoding::Srgb);
        assert_eq!(encoder.encode(f32::NAN), 0);
        assert_eq!(encoder.encode(-1.0), 0);
        assert_eq!(encoder.encode(f32::INFINITY), 255);
        assert_eq!(encoder.encode(1.0), 255);
        assert_eq!(srgb_from_linear(0.0), 0.0);
        assert!((srgb_from_linear(1.0) - 1.0).abs() < 1e-7);
        assert!((srgb_from_linear(0.5) - 0.735_357).abs() < 1e-6);
        assert_eq!(linear_from_srgb(-0.5), -linear_from_srgb(0.5));
    }
}
