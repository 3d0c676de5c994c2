//! `Material` and `MakeNamedMaterial`.
//!
//! pbrt-v4's types with its parameters and defaults, and three of Irradiant's own, at which pbrt stops:
//!
//! | type | parameter | meaning | default |
//! |---|---|---|---|
//! | `retroreflective` | `spectrum reflectance` | colour of the lobe back to the light, in \[0, 1\] | 0.9 |
//! | | `spectrum base` | diffuse reflectance between the beads, in \[0, 1\] | 0.1 |
//! | | `float roughness`, `uroughness`, `vroughness` | width of the lobe, in \[0, 1\] | 0.1 |
//! | `glossypaint` | `spectrum reflectance` | colour of the pigment, in \[0, 1\] | 0.5 |
//! | | `float` or `spectrum eta` | index of refraction of the binder, above 1 | 1.5 |
//! | | `float roughness`, `uroughness`, `vroughness` | of the coat, in \[0, 1\] | 0.1 |
//! | `thinfilmpaint` | `float thickness` | of the film on the flakes, nm | 400 |
//! | | `float` or `spectrum filmeta` | index of refraction of the film, 1 or more | 1.5 |
//! | | `spectrum eta`, `k`; or `reflectance` | of the flakes below the film | aluminium |
//! | | `float roughness`, `uroughness`, `vroughness` | of the flakes' orientation, in \[0, 1\] | 0.2 |
//!
//! All three take `bool remaproughness` (true), `texture displacement` and `string normalmap`.

use super::legacy::unknown_name;
use super::params::{Params, Role, TextureNames};
use super::reader::Reader;
use super::stand_ins;
use super::state::PendingMaterial;
use irradiant_scene::desc::material::{CoatDesc, ConductorDesc};
use irradiant_scene::desc::{
    FloatParam, MaterialDesc, MaterialKind, MaterialRef, RoughnessDesc, SpannedSpectrum, SpectrumDesc, SpectrumParam,
};
use irradiant_scene::{Diagnostic, Spanned};
use std::collections::BTreeMap;

const MATERIALS: &[&str] = &[
    "coatedconductor",
    "coateddiffuse",
    "conductor",
    "dielectric",
    "diffuse",
    "diffusetransmission",
    "glossypaint",
    "hair",
    "interface",
    "measured",
    "mix",
    "retroreflective",
    "subsurface",
    "thindielectric",
    "thinfilmpaint",
];

/// Describes all materials; their indices stay.
pub(crate) fn resolve(
    r: &Reader,
    pending: &[PendingMaterial],
    named: &BTreeMap<String, u32>,
    t: &TextureNames,
) -> Vec<MaterialDesc> {
    let one = |(index, m): (usize, &PendingMaterial)| {
        let scope = Scope { r, p: &m.params, t, named, index: index as u32, is_named: m.name.is_some() };
        let kind = scope.kind(&m.kind);
        let p = &m.params;
        let can_be_bumped = !matches!(kind, MaterialKind::Mix { .. } | MaterialKind::Interface);
        let displacement = if can_be_bumped { p.float_param(r, t, "displacement") } else { None };
        let normal_map = if can_be_bumped { p.file(r, "normalmap", "normal map") } else { None };
        // pbrt-v4 does not look at the parameters of "interface".
        if !matches!(kind, MaterialKind::Interface) {
            p.finish(r);
        }
        let name = m.name.as_ref().map(|n| n.value.clone());
        MaterialDesc { name, kind, displacement, normal_map, color_space: p.color_space, span: p.span }
    };
    pending.iter().enumerate().map(one).collect()
}

struct Scope<'s, 'a> {
    r: &'s Reader<'a>,
    p: &'s Params,
    t: &'s TextureNames,
    named: &'s BTreeMap<String, u32>,
    index: u32,
    is_named: bool,
}

impl Scope<'_, '_> {
    fn albedo(&self, name: &'static str, default: f32) -> SpannedSpectrum {
        self.p.spectrum_param_or(self.r, self.t, name, Role::Albedo, SpectrumDesc::Constant(default))
    }

    /// An index of refraction: a number or a spectrum, no texture.
    fn ior(&self, name: &'static str, default: f32) -> SpannedSpectrum {
        self.p
            .float_or_spectrum(self.r, name, Role::Unbounded)
            .unwrap_or(Spanned::unplaced(SpectrumParam::Value(SpectrumDesc::Constant(default))))
    }

    fn roughness(&self, names: [&'static str; 3], default: f32, remap: bool) -> RoughnessDesc {
        let [u, v, both] = names;
        let own = [u, v].map(|name| self.p.float_param(self.r, self.t, name));
        let shared = self.p.float_param(self.r, self.t, both);
        if let ([Some(_), Some(_)], Some(shared)) = (&own, &shared) {
            let message = format!("\"{both}\" has no effect beside \"{u}\" and \"{v}\"");
            self.r.error_help("E0305", message, shared.span, "leave it out");
        }
        let [u, v] = own.map(|own| own.or(shared).unwrap_or(Spanned::unplaced(FloatParam::Value(default))));
        RoughnessDesc { u, v, remap }
    }

    fn remap(&self) -> bool {
        self.p.bool_or(self.r, "remaproughness", true)
    }

    fn plain_roughness(&self, default: f32) -> RoughnessDesc {
        self.roughness(["uroughness", "vroughness", "roughness"], default, self.remap())
    }

    /// `eta` and `k`, or `reflectance`; without any, the given metal.
    fn conductor(&self, eta: &'static str, k: &'static str, metal: &str) -> ConductorDesc {
        let get = |name, role| self.p.spectrum_param(self.r, self.t, name, role);
        let given = (get(eta, Role::Unbounded), get(k, Role::Unbounded));
        if let Some(reflectance) = get("reflectance", Role::Albedo) {
            if let Some(other) = given.0.as_ref().or(given.1.as_ref()) {
                self.r.push(
                    Diagnostic::error("E0305", "a metal is given twice", other.span)
                        .also(reflectance.span, "by its reflectance here")
                        .help(format!("keep \"reflectance\", or \"{eta}\" and \"{k}\"")),
                );
            }
            return ConductorDesc::Reflectance(reflectance);
        }
        let named =
            |part| Spanned::unplaced(SpectrumParam::Value(SpectrumDesc::Named(format!("metal-{metal}-{part}"))));
        ConductorDesc::Ior { eta: given.0.unwrap_or_else(|| named("eta")), k: given.1.unwrap_or_else(|| named("k")) }
    }

    fn coat(&self, roughness: RoughnessDesc, eta: SpannedSpectrum) -> CoatDesc {
        let (r, p, t) = (self.r, self.p, self.t);
        CoatDesc {
            roughness,
            thickness: p.float_param_or(r, t, "thickness", 0.01),
            eta,
            g: p.float_param_or(r, t, "g", 0.0),
            albedo: self.albedo("albedo", 0.0),
            max_depth: p.integer_in(r, "maxdepth", 10, 0..=i32::MAX),
            n_samples: p.integer_in(r, "nsamples", 1, 1..=1 << 16),
        }
    }

    fn kind(&self, name: &Spanned<String>) -> MaterialKind {
        let (r, p) = (self.r, self.p);
        match name.value.as_str() {
            "diffuse" => MaterialKind::Diffuse { reflectance: self.albedo("reflectance", 0.5) },
            "diffusetransmission" => MaterialKind::DiffuseTransmission {
                reflectance: self.albedo("reflectance", 0.25),
                transmittance: self.albedo("transmittance", 0.25),
                scale: p.float_or(r, "scale", 1.0),
            },
            "conductor" => MaterialKind::Conductor {
                fresnel: self.conductor("eta", "k", "Cu"),
                roughness: self.plain_roughness(0.0),
            },
            "dielectric" => {
                MaterialKind::Dielectric { eta: self.ior("eta", 1.5), roughness: self.plain_roughness(0.0) }
            }
            "thindielectric" => MaterialKind::ThinDielectric { eta: self.ior("eta", 1.5) },
            "coateddiffuse" => MaterialKind::CoatedDiffuse {
                reflectance: self.albedo("reflectance", 0.5),
                coat: self.coat(self.plain_roughness(0.0), self.ior("eta", 1.5)),
            },
            "coatedconductor" => {
                let remap = self.remap();
                let of = |names, default| self.roughness(names, default, remap);
                let interface = of(["interface.uroughness", "interface.vroughness", "interface.roughness"], 0.0);
                MaterialKind::CoatedConductor {
                    fresnel: self.conductor("conductor.eta", "conductor.k", "Cu"),
                    roughness: of(["conductor.uroughness", "conductor.vroughness", "conductor.roughness"], 0.0),
                    coat: self.coat(interface, self.ior("interface.eta", 1.5)),
                }
            }
            "mix" => self.mix(),
            "interface" => MaterialKind::Interface,
            "" | "none" => {
                let message = format!("material \"{}\" is called \"interface\" in pbrt-v4", name.value);
                r.push(Diagnostic::new(irradiant_scene::Severity::Note, "N0116", message, name.span));
                MaterialKind::Interface
            }
            "subsurface" => {
                stand_ins::warn(r, "W0103", "subsurface scattering", "subsurface: diffuse", name.span);
                MaterialKind::Subsurface {
                    mean_albedo: stand_ins::subsurface(r, p, self.t),
                    eta: p.float_or(r, "eta", 1.33),
                    roughness: self.plain_roughness(0.0),
                }
            }
            "hair" => {
                stand_ins::warn(r, "W0104", "hair", "hair: diffuse", name.span);
                MaterialKind::Hair { mean_albedo: stand_ins::hair(r, p, self.t) }
            }
            "measured" => {
                stand_ins::warn(r, "W0105", "measured reflectance", "measured: diffuse", name.span);
                match p.file(r, "filename", "measured reflectance") {
                    Some(file) => MaterialKind::Measured { file },
                    None => {
                        p.missing(r, "\"string filename\"");
                        MaterialKind::Diffuse { reflectance: self.albedo("reflectance", 0.5) }
                    }
                }
            }
            "retroreflective" => MaterialKind::Retroreflective {
                reflectance: self.albedo("reflectance", 0.9),
                base: self.albedo("base", 0.1),
                roughness: self.plain_roughness(0.1),
            },
            "glossypaint" => MaterialKind::GlossyPaint {
                reflectance: self.albedo("reflectance", 0.5),
                eta: self.ior("eta", 1.5),
                roughness: self.plain_roughness(0.1),
            },
            "thinfilmpaint" => MaterialKind::ThinFilmPaint {
                thickness: p.float_param_or(r, self.t, "thickness", 400.0),
                film_eta: self.ior("filmeta", 1.5),
                fresnel: self.conductor("eta", "k", "Al"),
                roughness: self.plain_roughness(0.2),
            },
            _ => {
                unknown_name(r, "E0202", "material", name, MATERIALS);
                // One complaint is enough: the parameters belong to something unknown.
                MaterialKind::Interface
            }
        }
    }

    fn mix(&self) -> MaterialKind {
        let amount = self.p.float_param_or(self.r, self.t, "amount", 0.5);
        let fallback = MaterialKind::Mix { materials: [MaterialRef(0); 2], amount };
        let Some(names) = self.p.strings("materials") else {
            self.p.missing(self.r, "two names in \"string materials\"");
            return fallback;
        };
        let [a, b] = names.value else {
            let message = format!("a mix is of two materials; {} are named", names.value.len());
            self.r.error("E0303", message, names.span);
            return fallback;
        };
        let found = [a, b].map(|name| self.material(name));
        MaterialKind::Mix { materials: found, amount }
    }

    fn material(&self, name: &Spanned<String>) -> MaterialRef {
        match self.named.get(&name.value) {
            // As in pbrt-v4 a named mix takes named materials that stand above it, so there are no circles.
            Some(index) if self.is_named && *index >= self.index => {
                let message = format!("material \"{}\" is used before it is defined", name.value);
                self.r.error_help("E0404", message, name.span, "a named mix takes materials that stand above it");
                MaterialRef(0)
            }
            Some(index) => MaterialRef(*index),
            None => {
                let known: Vec<&str> = self.named.keys().map(String::as_str).collect();
                self.r.unknown("E0401", "named material", name, &known);
                MaterialRef(0)
            }
        }
    }
}
