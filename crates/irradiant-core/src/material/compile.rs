//! From the description to materials: ranges checked, constants worked out, coats tabulated.

use super::relief::{NormalMap, Relief};
use super::{CoatValue, Coats, Entry, Facets, FillingValue, Index, Material, Materials, Metal, coat_weights};
use crate::bxdf::{Coat, CoatWeights, Ggx, WalkLimits};
use crate::interaction::MaterialId;
use crate::texture::image::read_image;
use crate::texture::{FloatValue, SpectrumValue, Textures};
use irradiant_image::Encoding;
use irradiant_scene::desc::material::{CoatDesc, ConductorDesc};
use irradiant_scene::desc::{
    FileDesc, FloatParam, MaterialDesc, MaterialKind, RoughnessDesc, SceneDesc, SpannedFloat, SpannedSpectrum,
};
use irradiant_scene::{Assets, Diagnostic, Diagnostics, Span, Spanned};
use irradiant_spectrum::{ColorSpace, Role, Spectrum};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Lossless coats that are made where the roughness of a glossy paint varies.
const PAINT_LEVELS: u32 = 17;

/// Parameters of a coat, bit by bit.
type CoatKey = (u32, [u32; 2], u32, bool);

/// A coat to be tabulated: tables take milliseconds each, so they are made side by side at the end.
#[derive(Clone, Copy, Debug)]
enum CoatPlan {
    Clear { eta: f32, facets: Ggx, thickness: f32, weights: CoatWeights },
    Lossless { eta: f32, alpha: f32 },
}

impl CoatPlan {
    fn make(&self) -> Coat {
        match *self {
            Self::Clear { eta, facets, thickness, weights } => Coat::new(eta, facets, thickness, weights),
            Self::Lossless { eta, alpha } => Coat::lossless(eta, alpha),
        }
    }
}

struct Compiler<'a> {
    desc: &'a SceneDesc,
    textures: &'a mut Textures,
    assets: &'a dyn Assets,
    space: &'static ColorSpace,
    diagnostics: &'a mut Diagnostics,
    coats: Vec<CoatPlan>,
    coat_ids: BTreeMap<CoatKey, u32>,
    normal_maps: Vec<NormalMap>,
    normal_map_ids: BTreeMap<std::path::PathBuf, Option<u32>>,
    coat_depth_limit: Option<u32>,
    pbrt_coat_weights: bool,
}

impl Materials {
    /// All materials of a scene, by the indices of the description. Adds the constant spectra and the textures that they
    /// use to `textures`. What is wrong goes to `diagnostics`.
    pub fn compile(
        desc: &SceneDesc,
        textures: &mut Textures,
        assets: &dyn Assets,
        space: &'static ColorSpace,
        diagnostics: &mut Diagnostics,
    ) -> Self {
        let mut c = Compiler {
            desc,
            textures,
            assets,
            space,
            diagnostics,
            coats: Vec::new(),
            coat_ids: BTreeMap::new(),
            normal_maps: Vec::new(),
            normal_map_ids: BTreeMap::new(),
            coat_depth_limit: None,
            pbrt_coat_weights: false,
        };
        let mut entries: Vec<Entry> =
            desc.materials.iter().map(|m| Entry::new(c.material(&m.kind), c.relief(m))).collect();
        c.check_mixes(&mut entries);
        let (normal_maps, coat_depth_limit) = (c.normal_maps, c.coat_depth_limit);
        let coats: Vec<Coat> = c.coats.par_iter().map(CoatPlan::make).collect();
        let may_pass = entries.iter().any(|entry| match entry.material {
            Material::Mix { materials, .. } => materials
                .iter()
                .any(|id| entries.get(id.0 as usize).is_none_or(|part| matches!(part.material, Material::Interface))),
            _ => false,
        });
        let pbrt_coat_weights = c.pbrt_coat_weights || coats.iter().any(Coat::has_pbrt_weights);
        let names = desc.materials.iter().map(|m| m.name.clone().unwrap_or_else(|| kind_name(&m.kind).into()));
        Self {
            names: names.collect(),
            entries,
            coats,
            normal_maps,
            force_diffuse: desc.options.force_diffuse,
            coat_depth_limit,
            pbrt_coat_weights,
            may_pass,
        }
    }
}

/// The word that scene files use.
fn kind_name(kind: &MaterialKind) -> &'static str {
    match kind {
        MaterialKind::Diffuse { .. } => "diffuse",
        MaterialKind::DiffuseTransmission { .. } => "diffusetransmission",
        MaterialKind::Conductor { .. } => "conductor",
        MaterialKind::Dielectric { .. } => "dielectric",
        MaterialKind::ThinDielectric { .. } => "thindielectric",
        MaterialKind::CoatedDiffuse { .. } => "coateddiffuse",
        MaterialKind::CoatedConductor { .. } => "coatedconductor",
        MaterialKind::Mix { .. } => "mix",
        MaterialKind::Interface => "interface",
        MaterialKind::Subsurface { .. } => "subsurface",
        MaterialKind::Hair { .. } => "hair",
        MaterialKind::Measured { .. } => "measured",
        MaterialKind::Retroreflective { .. } => "retroreflective",
        MaterialKind::GlossyPaint { .. } => "glossypaint",
        MaterialKind::ThinFilmPaint { .. } => "thinfilmpaint",
    }
}

impl Compiler<'_> {
    fn error(&mut self, code: &'static str, message: String, span: Span) {
        self.diagnostics.push(Diagnostic::error(code, message, span));
    }

    fn warning(&mut self, code: &'static str, message: String, span: Span) {
        self.diagnostics.push(Diagnostic::warning(code, message, span));
    }

    fn spectrum(&mut self, param: &SpannedSpectrum, role: Role, what: &str) -> SpectrumValue {
        self.textures.spectrum_value(self.desc, param, role, what, self.diagnostics)
    }

    fn reflectance(&mut self, param: &SpannedSpectrum, what: &str) -> SpectrumValue {
        self.spectrum(param, Role::Reflectance, what)
    }

    /// A number, checked where it is known; `allowed` says what is in words.
    fn float(
        &mut self,
        param: &SpannedFloat,
        code: &'static str,
        what: &str,
        allowed: &str,
        valid: impl Fn(f32) -> bool,
        fallback: f32,
    ) -> FloatValue {
        let value = self.textures.float_param(param.value);
        match value.as_constant() {
            // A folded texture may hold any number; textures are not checked, here as elsewhere.
            Some(v) if !(v.is_finite() && valid(v)) && matches!(param.value, FloatParam::Value(_)) => {
                self.error(code, format!("{what} is {v}; it must be {allowed}"), param.span);
                FloatValue::Constant(fallback)
            }
            _ => value,
        }
    }

    fn facets(&mut self, desc: &RoughnessDesc) -> Facets {
        let u = self.float(&desc.u, "E0702", "roughness", "at least 0", |v| v >= 0.0, 0.0);
        let v = self.float(&desc.v, "E0702", "roughness", "at least 0", |v| v >= 0.0, 0.0);
        match (u, v) {
            (FloatValue::Constant(u), FloatValue::Constant(v)) => {
                let alpha = |r: f32| if desc.remap { Ggx::alpha_from_roughness(r) } else { r.max(0.0) };
                Facets::Constant(Ggx::new(alpha(u), alpha(v)))
            }
            _ => Facets::Varying { u, v, remap: desc.remap },
        }
    }

    /// A real index of refraction. 0 stands for 1, as in pbrt-v4.
    fn index(&mut self, param: &SpannedSpectrum) -> Index {
        let value = self.spectrum(param, Role::Unbounded, "the index of refraction");
        match self.textures.constant_spectrum(value) {
            Some(s) if s.is_constant() => {
                let eta = s.eval(550.0);
                if eta == 0.0 {
                    self.warning("W0703", "an index of refraction of 0 is taken for 1".into(), param.span);
                }
                Index::Constant(if eta == 0.0 { 1.0 } else { eta })
            }
            _ => Index::Dispersive(value),
        }
    }

    fn metal(&mut self, desc: &ConductorDesc) -> Metal {
        match desc {
            ConductorDesc::Ior { eta, k } => Metal::Index {
                eta: self.spectrum(eta, Role::Unbounded, "eta"),
                k: self.spectrum(k, Role::Unbounded, "k"),
            },
            ConductorDesc::Reflectance(r) => Metal::Reflectance(self.reflectance(r, "the reflectance")),
        }
    }

    /// A coat over a metal with these facets, or over a diffuse base.
    fn coat(&mut self, desc: &CoatDesc, metal: Option<Facets>) -> CoatValue {
        let facets = self.facets(&desc.roughness);
        let eta = self.index(&desc.eta);
        let thickness =
            self.float(&desc.thickness, "E0704", "the thickness of a coat", "at least 0", |v| v >= 0.0, 0.01);
        let g = self.float(&desc.g, "E0705", "g", "between -1 and 1", |v| v > -1.0 && v < 1.0, 0.0);
        let albedo = self.reflectance(&desc.albedo, "the albedo of the coat");
        let empty = self.textures.constant_spectrum(albedo).is_some_and(|s| s.max_value() <= 0.0);
        let filling = (!empty).then_some(FillingValue { albedo, g });
        let mut count = |n: &Spanned<i32>, what: &str, least: i32| {
            if !(least..=i32::from(u16::MAX)).contains(&n.value) {
                self.error("E0706", format!("{what} is {}; it must be {least} to 65535", n.value), n.span);
            }
            n.value.clamp(least, i32::from(u16::MAX)) as u16
        };
        let limits = WalkLimits {
            max_depth: count(&desc.max_depth, "maxdepth", 0),
            n_samples: count(&desc.n_samples, "nsamples", 1),
        };
        if limits.max_depth > 0 {
            let depth = u32::from(limits.max_depth);
            self.coat_depth_limit = Some(self.coat_depth_limit.map_or(depth, |least| least.min(depth)));
        }
        let weights = coat_weights(limits);
        let mut tabulated = None;
        if let (None, Index::Constant(eta), Facets::Constant(ggx), Some(thickness)) =
            (metal, eta, facets, thickness.as_constant())
        {
            let [x, y] = ggx.alphas();
            // Anisotropic coats are not tabulated, but copying one is no slower than making it.
            let exact = weights == CoatWeights::Exact;
            let key = (eta.to_bits(), [x.to_bits(), y.to_bits()], thickness.to_bits(), exact);
            tabulated = Some(self.tabulated(key, CoatPlan::Clear { eta, facets: ggx, thickness, weights }));
        } else if weights == CoatWeights::Pbrt {
            // Walks use the weights where a rough coat lies over anything that is not a mirror.
            let smooth = |facets: Facets| matches!(facets, Facets::Constant(ggx) if ggx.is_smooth());
            let mirror = metal.is_some_and(smooth) && filling.is_none();
            self.pbrt_coat_weights |= !(smooth(facets) || matches!(eta, Index::Constant(1.0)) || mirror);
        }
        CoatValue { tabulated, eta, facets, thickness, filling, limits }
    }

    fn tabulated(&mut self, key: CoatKey, plan: CoatPlan) -> u32 {
        if let Some(&id) = self.coat_ids.get(&key) {
            return id;
        }
        let id = self.coats.len() as u32;
        self.coats.push(plan);
        self.coat_ids.insert(key, id);
        id
    }

    fn diffuse(&mut self, albedo: &SpannedSpectrum) -> Material {
        Material::Diffuse { reflectance: self.reflectance(albedo, "the mean albedo") }
    }

    fn material(&mut self, kind: &MaterialKind) -> Material {
        match kind {
            MaterialKind::Diffuse { reflectance } => {
                Material::Diffuse { reflectance: self.reflectance(reflectance, "the reflectance") }
            }
            MaterialKind::DiffuseTransmission { reflectance, transmittance, scale } => {
                let (r, t) = (
                    self.reflectance(reflectance, "the reflectance"),
                    self.reflectance(transmittance, "the transmittance"),
                );
                if !(scale.value.is_finite() && scale.value >= 0.0) {
                    self.error("E0707", format!("scale is {}; it must be at least 0", scale.value), scale.span);
                }
                let shares = [r, t].map(|v| self.textures.constant_spectrum(v));
                let sum_at =
                    |l: f32| shares.iter().flatten().map(|s| (s.eval(l) * scale.value).clamp(0.0, 1.0)).sum::<f32>();
                let most = (360..=830).map(|l| sum_at(l as f32)).fold(0.0, f32::max);
                if most > 1.001 {
                    let message =
                        format!("reflectance and transmittance add up to {most:.3}: the surface creates light");
                    self.warning("W0707", message, reflectance.span);
                }
                Material::DiffuseTransmission { reflectance: r, transmittance: t, scale: scale.value }
            }
            MaterialKind::Conductor { fresnel, roughness } => {
                Material::Conductor { metal: self.metal(fresnel), facets: self.facets(roughness) }
            }
            MaterialKind::Dielectric { eta, roughness } => {
                Material::Dielectric { eta: self.index(eta), facets: self.facets(roughness) }
            }
            MaterialKind::ThinDielectric { eta } => Material::ThinDielectric { eta: self.index(eta) },
            MaterialKind::CoatedDiffuse { reflectance, coat } => Material::CoatedDiffuse {
                reflectance: self.reflectance(reflectance, "the reflectance"),
                coat: self.coat(coat, None),
            },
            MaterialKind::CoatedConductor { fresnel, roughness, coat } => {
                let (metal, facets) = (self.metal(fresnel), self.facets(roughness));
                Material::CoatedConductor { metal, facets, coat: self.coat(coat, Some(facets)) }
            }
            MaterialKind::Mix { materials, amount } => {
                let value = self.textures.float_param(amount.value);
                if let FloatParam::Value(v) = amount.value {
                    if !v.is_finite() {
                        self.error("E0708", format!("the amount of a mix is {v}"), amount.span);
                    } else if !(0.0..=1.0).contains(&v) {
                        let message = format!("the amount of a mix is {v}; it is cut to [0, 1]");
                        self.warning("W0708", message, amount.span);
                    }
                }
                Material::Mix { materials: materials.map(|m| MaterialId(m.0)), amount: value }
            }
            MaterialKind::Interface => Material::Interface,
            // Stand-ins, of which the reader has told.
            MaterialKind::Subsurface { mean_albedo, .. } => self.diffuse(mean_albedo),
            MaterialKind::Hair { mean_albedo } => self.diffuse(mean_albedo),
            MaterialKind::Measured { .. } => {
                let grey = Spectrum::constant(0.5, Role::Reflectance, self.space);
                Material::Diffuse { reflectance: self.textures.add_spectrum(grey) }
            }
            MaterialKind::Retroreflective { reflectance, base, roughness } => Material::Retroreflective {
                returned: self.reflectance(reflectance, "the reflectance"),
                base: self.reflectance(base, "the reflectance of the base"),
                facets: self.facets(roughness),
            },
            MaterialKind::GlossyPaint { reflectance, eta, roughness } => self.glossy_paint(reflectance, eta, roughness),
            MaterialKind::ThinFilmPaint { thickness, film_eta, fresnel, roughness } => Material::ThinFilmPaint {
                thickness: self.float(
                    thickness,
                    "E0704",
                    "the thickness of a film",
                    "at least 0 (nm)",
                    |v| v >= 0.0,
                    500.0,
                ),
                film_eta: self.positive_index(film_eta, "the film's index of refraction"),
                metal: self.metal(fresnel),
                facets: self.facets(roughness),
            },
        }
    }

    /// An index that divides: 0 is an error.
    fn positive_index(&mut self, param: &SpannedSpectrum, what: &str) -> SpectrumValue {
        let value = self.spectrum(param, Role::Unbounded, what);
        if self.textures.constant_spectrum(value).is_some_and(|s| s.max_value() <= 0.0) {
            self.error("E0703", format!("{what} is 0"), param.span);
        }
        value
    }

    /// The coat's table is for one index: that at 550 nm, since dispersion in a paint's binder does not show.
    fn glossy_paint(
        &mut self,
        reflectance: &SpannedSpectrum,
        eta: &SpannedSpectrum,
        roughness: &RoughnessDesc,
    ) -> Material {
        let reflectance = self.reflectance(reflectance, "the reflectance");
        let facets = self.facets(roughness);
        let index = self.positive_index(eta, "the index of refraction");
        let index = self.textures.constant_spectrum(index).map(|s| s.eval(550.0));
        let index = match index {
            Some(index) if index > 0.0 => index,
            Some(_) => 1.5,
            None => {
                self.error("E0703", "the index of a glossy paint cannot be a texture".into(), eta.span);
                1.5
            }
        };
        let alphas: Vec<f32> = match facets {
            Facets::Constant(ggx) => {
                let [x, y] = ggx.alphas();
                if x != y {
                    let message = "a glossy paint is equally rough along both tangents; the geometric mean is taken";
                    self.warning("W0702", message.into(), roughness.u.span);
                }
                vec![(x * y).sqrt()]
            }
            Facets::Varying { .. } => (0..PAINT_LEVELS).map(|i| i as f32 / (PAINT_LEVELS - 1) as f32).collect(),
        };
        // Paints of the same index that vary share their levels.
        let count = alphas.len() as u32;
        let level = if count == 1 { alphas[0].to_bits() } else { u32::MAX };
        let key = (index.to_bits(), [level, count], u32::MAX, true);
        let coats = &mut self.coats;
        let first = *self.coat_ids.entry(key).or_insert_with(|| {
            let first = coats.len() as u32;
            coats.extend(alphas.into_iter().map(|alpha| CoatPlan::Lossless { eta: index, alpha }));
            first
        });
        Material::GlossyPaint { reflectance, coats: Coats { first, count }, facets }
    }

    fn relief(&mut self, desc: &MaterialDesc) -> Relief {
        if let Some(file) = &desc.normal_map {
            if let Some(displacement) = &desc.displacement {
                let message = "both a normal map and a displacement; the normal map is taken, as pbrt does".into();
                self.warning("W0709", message, displacement.span);
            }
            return self.normal_map(file).map_or(Relief::Flat, Relief::NormalMap);
        }
        match &desc.displacement {
            None => Relief::Flat,
            Some(height) => match self.float(height, "E0709", "displacement", "a finite number", |_| true, 0.0) {
                FloatValue::Constant(0.0) => Relief::Flat,
                height => {
                    self.textures.require_footprint();
                    Relief::Bump(height)
                }
            },
        }
    }

    fn normal_map(&mut self, file: &Spanned<FileDesc>) -> Option<u32> {
        if let Some(id) = self.normal_map_ids.get(&file.value.path) {
            return *id;
        }
        let map = read_image(file, Some(Encoding::Linear), self.assets).and_then(|image| {
            NormalMap::new(&image).map_err(|why| {
                let message = format!("image \"{}\": {why}", file.value.name);
                Box::new(Diagnostic::error("E0602", message, file.span))
            })
        });
        let id = match map {
            Ok(map) => {
                self.normal_maps.push(map);
                Some(self.normal_maps.len() as u32 - 1)
            }
            Err(why) => {
                self.diagnostics.push(*why);
                None
            }
        };
        self.normal_map_ids.insert(file.value.path.clone(), id);
        id
    }

    /// Every chain of mixes must end: those that lead back to themselves, or nowhere, are reported and cut.
    fn check_mixes(&mut self, entries: &mut [Entry]) {
        #[derive(Clone, Copy, PartialEq)]
        enum State {
            New,
            Open,
            Done,
        }
        let mut state = vec![State::New; entries.len()];
        for start in 0..entries.len() {
            let mut path = vec![start];
            while let Some(&i) = path.last() {
                state[i] = match state[i] {
                    State::New => State::Open,
                    _ => State::Done,
                };
                let children = match entries[i].material {
                    Material::Mix { materials, .. } if state[i] == State::Open => materials,
                    _ => {
                        state[i] = State::Done;
                        path.pop();
                        continue;
                    }
                };
                for MaterialId(child) in children {
                    let fault = match state.get(child as usize) {
                        None => Some("a material that does not exist"),
                        Some(State::Open) => Some("itself"),
                        Some(State::Done) => None,
                        Some(State::New) => {
                            path.push(child as usize);
                            None
                        }
                    };
                    if let Some(fault) = fault {
                        self.error("E0708", format!("a mix leads to {fault}"), self.desc.materials[i].span);
                        entries[i].material = Material::Interface;
                        break;
                    }
                }
            }
        }
    }
}
