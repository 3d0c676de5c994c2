//! Materials. Kinds marked *Irradiant's own* are beyond pbrt-v4 (pbrt stops at them).

use super::{ColorSpaceName, FileDesc, MaterialRef, SpannedFloat, SpannedSpectrum};
use crate::span::{Span, Spanned};

/// A material.
#[derive(Clone, Debug)]
pub struct MaterialDesc {
    /// Its name, when made by `MakeNamedMaterial`.
    pub name: Option<String>,
    /// What kind.
    pub kind: MaterialKind,
    /// Bump map: displacement along the normal, scene units.
    pub displacement: Option<SpannedFloat>,
    /// Normal map: an RGB image, linear, (n + 1) / 2.
    pub normal_map: Option<Spanned<FileDesc>>,
    /// The colour space of its RGB values (for stand-ins and images).
    pub color_space: ColorSpaceName,
    /// Where it was said.
    pub span: Span,
}

/// Roughness along the two tangents; microfacet alpha = sqrt(roughness) when `remap`.
#[derive(Clone, Debug)]
pub struct RoughnessDesc {
    /// Along u.
    pub u: SpannedFloat,
    /// Along v.
    pub v: SpannedFloat,
    /// Convert roughness to alpha (else it *is* alpha).
    pub remap: bool,
}

/// The bulk between a coat and its base.
#[derive(Clone, Debug)]
pub struct CoatDesc {
    /// Roughness of the coat's interface.
    pub roughness: RoughnessDesc,
    /// Thickness, in units of the mean free path.
    pub thickness: SpannedFloat,
    /// Index of refraction (real), spectrum or constant.
    pub eta: SpannedSpectrum,
    /// Henyey-Greenstein asymmetry of the medium inside, in (-1, 1).
    pub g: SpannedFloat,
    /// Scattering albedo of the medium inside; 0: none.
    pub albedo: SpannedSpectrum,
    /// Most scattering events inside; 0: unlimited (Irradiant's own meaning; pbrt's default is 10).
    pub max_depth: Spanned<i32>,
    /// Random walks per evaluation (pbrt's default 1).
    pub n_samples: Spanned<i32>,
}

/// How a conductor's Fresnel reflectance is given.
#[derive(Clone, Debug)]
pub enum ConductorDesc {
    /// Complex index of refraction eta + i k.
    Ior {
        /// Real part.
        eta: SpannedSpectrum,
        /// Imaginary part (absorption).
        k: SpannedSpectrum,
    },
    /// Reflectance at normal incidence (pbrt: eta = 1, k = 2 sqrt(r) / sqrt(1 - r)).
    Reflectance(SpannedSpectrum),
}

/// Kinds of material.
#[derive(Clone, Debug)]
pub enum MaterialKind {
    /// Lambertian.
    Diffuse {
        /// In [0, 1].
        reflectance: SpannedSpectrum,
    },
    /// Lambertian on both sides.
    DiffuseTransmission {
        /// Reflected part.
        reflectance: SpannedSpectrum,
        /// Transmitted part.
        transmittance: SpannedSpectrum,
        /// Factor on both.
        scale: Spanned<f32>,
    },
    /// Metal.
    Conductor {
        /// Fresnel.
        fresnel: ConductorDesc,
        /// Microfacets.
        roughness: RoughnessDesc,
    },
    /// Glass, water.
    Dielectric {
        /// Index of refraction inside over outside; dispersive when it varies with wavelength.
        eta: SpannedSpectrum,
        /// Microfacets.
        roughness: RoughnessDesc,
    },
    /// A pane whose two interfaces coincide.
    ThinDielectric {
        /// Index of refraction.
        eta: SpannedSpectrum,
    },
    /// Dielectric coat over diffuse.
    CoatedDiffuse {
        /// Of the base.
        reflectance: SpannedSpectrum,
        /// The coat.
        coat: CoatDesc,
    },
    /// Dielectric coat over metal.
    CoatedConductor {
        /// Of the base.
        fresnel: ConductorDesc,
        /// Of the base.
        roughness: RoughnessDesc,
        /// The coat.
        coat: CoatDesc,
    },
    /// A random choice between two others at each hit.
    Mix {
        /// With weight `1 - amount` and `amount`.
        materials: [MaterialRef; 2],
        /// Fraction of the second.
        amount: SpannedFloat,
    },
    /// No surface: light passes straight on (a boundary of media).
    Interface,
    /// A participating subsurface. Rendered as diffuse of the mean albedo for now.
    Subsurface {
        /// Diffuse albedo where it is known or derived by the reader.
        mean_albedo: SpannedSpectrum,
        /// Index of refraction.
        eta: Spanned<f32>,
        /// Of the surface.
        roughness: RoughnessDesc,
    },
    /// Hair fibres. Rendered as diffuse of the mean albedo for now.
    Hair {
        /// Diffuse albedo as derived by the reader (from color/reflectance or the pigments).
        mean_albedo: SpannedSpectrum,
    },
    /// A measured BRDF file. Rendered as diffuse of the mean albedo for now.
    Measured {
        /// The file.
        file: Spanned<FileDesc>,
    },
    /// *Irradiant's own* ("retroreflective"): a lobe back towards where light came from, over a diffuse base.
    Retroreflective {
        /// Colour of the retro-reflected lobe.
        reflectance: SpannedSpectrum,
        /// Diffuse base.
        base: SpannedSpectrum,
        /// Width of the lobe.
        roughness: RoughnessDesc,
    },
    /// *Irradiant's own* ("glossypaint"): a rough clear coat over a coloured, internally scattering base, without
    /// depth limit, so that no energy is lost.
    GlossyPaint {
        /// Colour of the base.
        reflectance: SpannedSpectrum,
        /// Index of refraction of the binder.
        eta: SpannedSpectrum,
        /// Of the coat.
        roughness: RoughnessDesc,
    },
    /// *Irradiant's own* ("thinfilmpaint"): interference pigment whose hue flops with angle.
    ThinFilmPaint {
        /// Film thickness, nm.
        thickness: SpannedFloat,
        /// Index of refraction of the film.
        film_eta: SpannedSpectrum,
        /// The flakes below the film.
        fresnel: ConductorDesc,
        /// Of the flakes.
        roughness: RoughnessDesc,
    },
}
