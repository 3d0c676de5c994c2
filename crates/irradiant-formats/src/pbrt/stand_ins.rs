//! Mean albedos of materials that are not rendered yet.

use super::params::{Params, Role, TextureNames};
use super::reader::Reader;
use irradiant_math::elementary;
use irradiant_scene::desc::{ColorSpaceName, FloatParam, SpannedSpectrum, SpectrumDesc, SpectrumParam};
use irradiant_scene::{Diagnostic, Span, Spanned};

/// Says once per kind that a diffuse surface stands in.
pub(crate) fn warn(r: &Reader, code: &'static str, what: &str, kind: &str, span: Span) {
    r.push(
        Diagnostic::warning(
            code,
            format!("{what} is not here yet; a diffuse surface of its mean albedo stands in"),
            span,
        )
        .not_honoured(kind),
    );
}

fn rgb(c: [f32; 3]) -> SpannedSpectrum {
    Spanned::unplaced(SpectrumParam::Value(SpectrumDesc::Rgb(c.map(|v| v.clamp(0.0, 1.0)), ColorSpaceName::Srgb)))
}

/// Names that "subsurface" knows, with reduced scattering and absorption, 1/mm (Jensen et al. 2001, A Practical Model
/// for Subsurface Light Transport, figure 5).
const MEASURED: &[(&str, [f32; 3], [f32; 3])] = &[
    ("Apple", [2.29, 2.39, 1.97], [0.0030, 0.0034, 0.046]),
    ("Chicken1", [0.15, 0.21, 0.38], [0.015, 0.077, 0.19]),
    ("Chicken2", [0.19, 0.25, 0.32], [0.018, 0.088, 0.20]),
    ("Cream", [7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163]),
    ("Ketchup", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45]),
    ("Marble", [2.19, 2.62, 3.00], [0.0021, 0.0041, 0.0071]),
    ("Potato", [0.68, 0.70, 0.55], [0.0024, 0.0090, 0.12]),
    ("Skimmilk", [0.70, 1.22, 1.90], [0.0014, 0.0025, 0.0142]),
    ("Skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48]),
    ("Skin2", [1.09, 1.59, 1.79], [0.013, 0.070, 0.145]),
    ("Spectralon", [11.6, 20.4, 14.9], [0.0, 0.0, 0.0]),
    ("Wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014]),
];

/// Names of thinner liquids that pbrt-v4 knows from Narasimhan et al. 2006; their stand-in is a middle grey.
const LIQUIDS: &[&str] = &[
    "Lowfat Milk",
    "Reduced Milk",
    "Regular Milk",
    "Espresso",
    "Mint Mocha Coffee",
    "Lowfat Soy Milk",
    "Regular Soy Milk",
    "Lowfat Chocolate Milk",
    "Regular Chocolate Milk",
    "Coke",
    "Pepsi",
    "Sprite",
    "Gatorade",
    "Chardonnay",
    "White Zinfandel",
    "Merlot",
    "Budweiser Beer",
    "Coors Light Beer",
    "Clorox",
    "Apple Juice",
    "Cranberry Juice",
    "Grape Juice",
    "Ruby Grapefruit Juice",
    "White Grapefruit Juice",
    "Shampoo",
    "Strawberry Shampoo",
    "Head & Shoulders Shampoo",
    "Lemon Tea Powder",
    "Orange Powder",
    "Pink Lemonade Powder",
    "Cappuccino Powder",
    "Salt Powder",
    "Sugar Powder",
    "Suisse Mocha Powder",
    "Pacific Ocean Surface Water",
];

/// Diffuse reflectance of a half-space of isotropic scatterers of single-scattering albedo `a`, by the approximation of
/// van de Hulst 1980, Multiple Light Scattering: good enough for the colour of a stand-in.
fn half_space(a: f32) -> f32 {
    let s = (1.0 - a).max(0.0).sqrt();
    (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s)
}

fn from_coefficients(scattering: [f32; 3], absorption: [f32; 3]) -> SpannedSpectrum {
    rgb(std::array::from_fn(|i| {
        let sum = scattering[i] + absorption[i];
        half_space(if sum > 0.0 { scattering[i] / sum } else { 0.0 })
    }))
}

/// Three numbers for a spectrum, good enough for the colour of a stand-in.
fn three(s: &SpannedSpectrum) -> Option<[f32; 3]> {
    match &s.value {
        SpectrumParam::Value(SpectrumDesc::Rgb(c, _)) => Some(*c),
        SpectrumParam::Value(SpectrumDesc::Constant(v)) => Some([*v; 3]),
        SpectrumParam::Value(SpectrumDesc::Samples(samples)) => {
            let near = |lambda: f32| {
                let at = samples.iter().min_by(|a, b| (a.0 - lambda).abs().total_cmp(&(b.0 - lambda).abs()));
                at.map_or(0.0, |s| s.1)
            };
            Some([near(610.0), near(550.0), near(465.0)])
        }
        _ => None,
    }
}

/// Of "subsurface": by its name, its coefficients, its reflectance, or pbrt-v4's default (whole milk).
pub(crate) fn subsurface(r: &Reader, p: &Params, t: &TextureNames) -> SpannedSpectrum {
    let get = |name, role| p.spectrum_param(r, t, name, role);
    let g = p.float_or(r, "g", 0.0).value;
    p.float(r, "scale");
    let given = (get("sigma_a", Role::Unbounded), get("sigma_s", Role::Unbounded));
    let reflectance = get("reflectance", Role::Albedo);
    get("mfp", Role::Unbounded);
    if let Some(name) = p.string(r, "name").filter(|n| !n.is_empty()) {
        if let Some((_, s, a)) = MEASURED.iter().find(|(n, ..)| *n == name.value) {
            return from_coefficients(*s, *a);
        }
        if !LIQUIDS.contains(&name.value.as_str()) {
            let known: Vec<&str> = MEASURED.iter().map(|m| m.0).chain(LIQUIDS.iter().copied()).collect();
            r.unknown("E0220", "scattering material", &name, &known);
        }
        return rgb([0.5; 3]);
    }
    match given {
        (Some(absorption), Some(scattering)) => match (three(&absorption), three(&scattering)) {
            (Some(a), Some(s)) => {
                let mut albedo = from_coefficients(s.map(|v| v * (1.0 - g)), a);
                albedo.span = scattering.span;
                albedo
            }
            _ => rgb([0.5; 3]),
        },
        (Some(one), None) | (None, Some(one)) => {
            r.error("E0304", "\"sigma_a\" and \"sigma_s\" go together", one.span);
            rgb([0.5; 3])
        }
        (None, None) => reflectance.unwrap_or_else(|| from_coefficients([2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014])),
    }
}

/// Of "hair": its colour, or what its pigments leave (the inverse of Chiang et al. 2016, A Practical and Controllable
/// Hair and Fur Model, equation 9).
pub(crate) fn hair(r: &Reader, p: &Params, t: &TextureNames) -> SpannedSpectrum {
    let absorption = p.spectrum_param(r, t, "sigma_a", Role::Unbounded);
    let color = p.spectrum_param(r, t, "color", Role::Unbounded);
    let reflectance = p.spectrum_param(r, t, "reflectance", Role::Albedo);
    let pigments = [p.float_param(r, t, "eumelanin"), p.float_param(r, t, "pheomelanin")];
    let roughness = match p.float_param(r, t, "beta_n").map(|b| b.value) {
        Some(FloatParam::Value(b)) => b,
        _ => 0.3,
    };
    for name in ["eta", "beta_m", "alpha"] {
        p.float_param(r, t, name);
    }
    let clamp = |s: SpannedSpectrum| match three(&s) {
        Some(c) => Spanned::new(rgb(c).value, s.span),
        None => s,
    };
    let amount = |i: usize| match pigments[i].map(|v| v.value) {
        Some(FloatParam::Value(v)) => Some(v.max(0.0)),
        Some(FloatParam::Texture(_)) => Some(1.0),
        None => None,
    };
    let sigma = match (&absorption, amount(0), amount(1)) {
        (Some(s), ..) => three(s).unwrap_or([1.0; 3]),
        (None, None, None) => match color.or(reflectance) {
            Some(c) => return clamp(c),
            None => [0.419, 0.697, 1.37].map(|v| 1.3 * v),
        },
        (None, e, f) => {
            let (e, f) = (e.unwrap_or(0.0), f.unwrap_or(0.0));
            [0.419 * e + 0.187 * f, 0.697 * e + 0.4 * f, 1.37 * e + 1.05 * f]
        }
    };
    let b = roughness;
    let d = 5.969 - 0.215 * b + 2.532 * b * b - 10.73 * b * b * b + 5.574 * b * b * b * b + 0.245 * b * b * b * b * b;
    rgb(sigma.map(|s| elementary::exp(-s.max(0.0).sqrt() * d)))
}

#[cfg(test)]
mod tests {
    use super::half_space;

    #[test]
    fn a_half_space_returns_nothing_if_black_and_everything_if_white() {
        assert_eq!(half_space(1.0), 1.0);
        assert_eq!(half_space(0.0), 0.0);
        let values: Vec<f32> = (0..=100).map(|i| half_space(i as f32 / 100.0)).collect();
        assert!(values.windows(2).all(|w| w[0] < w[1]));
        assert!(half_space(0.5) < 0.25 && half_space(0.5) > 0.1);
    }
}
