//! Materials: what a surface is made of, with parameters that may vary over it.
//!
//! [`Materials::bsdf`] turns a hit into a [`Bsdf`]: it chooses among mixed materials, bends the shading normal by bump or
//! normal map, evaluates the textures, and makes the scattering model from numbers. It is called at every hit: it does
//! not allocate, and what does not vary (microfacets, coats' tables) is worked out when the scene is compiled.
//!
//! **Wavelengths.** A dielectric whose index varies with wavelength bends each its own way: `bsdf` then ends all
//! wavelengths of the path but the first. Nothing else here changes them.
//!
//! In reading order: this file (the enum and the hit), [`relief`] (bump and normal maps), `compile` (from the description).
//!
//! Semantics, defaults and expected values follow pbrt-v4 (Pharr, Jakob and Humphreys 2023, chapter 10); the kinds marked
//! as Irradiant's own are documented with their models in [`bxdf`](crate::bxdf). Subsurface scattering, hair and measured
//! BRDFs have diffuse stand-ins.

pub mod relief;

mod compile;
#[cfg(test)]
mod tests;

use crate::bsdf::Bsdf;
use crate::bxdf::{
    Bxdf, Coat, CoatWeights, CoatedConductor, CoatedDiffuse, Conductor, Dielectric, Diffuse, DiffuseTransmission,
    Filling, Ggx, GlossyPaint, Retroreflective, ThinDielectric, ThinFilm, ThinFilmPaint, WalkLimits,
};
use crate::interaction::{Interaction, MaterialId, TextureContext};
use crate::sampler::MixDraw;
use crate::texture::{FloatValue, SpectrumValue, Textures};
use irradiant_math::{Frame, hash};
use irradiant_spectrum::{Basis, SampledSpectrum, Wavelengths};
use relief::{NormalMap, Relief};

/// Microfacets, the same everywhere or varying.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Facets {
    /// The same everywhere.
    Constant(Ggx),
    /// From textures.
    Varying {
        /// Along the first tangent.
        u: FloatValue,
        /// Along the second.
        v: FloatValue,
        /// Whether alpha is the square root of these.
        remap: bool,
    },
}

impl Facets {
    fn is_textured(&self) -> bool {
        matches!(self, Self::Varying { .. })
    }

    /// Whether they may be smooth somewhere: textures may say so.
    fn may_be_smooth(&self) -> bool {
        match self {
            Self::Constant(ggx) => ggx.is_smooth(),
            Self::Varying { .. } => true,
        }
    }

    #[inline]
    fn at(&self, textures: &Textures, tex: &TextureContext) -> Ggx {
        match *self {
            Self::Constant(ggx) => ggx,
            Self::Varying { u, v, remap } => {
                let alpha = |roughness: FloatValue| {
                    let r = textures.float(roughness, tex).max(0.0);
                    if remap { Ggx::alpha_from_roughness(r) } else { r }
                };
                Ggx::new(alpha(u), alpha(v))
            }
        }
    }
}

/// A real index of refraction, one for all wavelengths or not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Index {
    /// For all.
    Constant(f32),
    /// Each its own.
    Dispersive(SpectrumValue),
}

impl Index {
    fn is_textured(&self) -> bool {
        matches!(self, Self::Dispersive(spectrum) if spectrum.is_textured())
    }

    /// The index that the path goes on with; ends the other wavelengths if they would go elsewhere.
    #[inline]
    fn at(&self, textures: &Textures, tex: &TextureContext, lambda: &mut Wavelengths) -> f32 {
        match *self {
            Self::Constant(eta) => eta,
            Self::Dispersive(spectrum) => {
                let lanes = textures.spectrum(spectrum, tex, lambda);
                // In RGB one index stands for all: green's.
                let eta = lanes[if lambda.basis == Basis::Rgb { 1 } else { 0 }];
                lambda.terminate_secondary();
                if eta == 0.0 { 1.0 } else { eta }
            }
        }
    }
}

/// How a metal reflects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Metal {
    /// By its complex index eta + i k.
    Index {
        /// Real part.
        eta: SpectrumValue,
        /// Imaginary part.
        k: SpectrumValue,
    },
    /// By its reflectance at normal incidence.
    Reflectance(SpectrumValue),
}

impl Metal {
    fn is_textured(&self) -> bool {
        match self {
            Self::Index { eta, k } => eta.is_textured() || k.is_textured(),
            Self::Reflectance(r) => r.is_textured(),
        }
    }

    /// eta and k.
    #[inline]
    fn at(
        &self,
        textures: &Textures,
        tex: &TextureContext,
        lambda: &Wavelengths,
    ) -> (SampledSpectrum, SampledSpectrum) {
        match *self {
            Self::Index { eta, k } => (textures.spectrum(eta, tex, lambda), textures.spectrum(k, tex, lambda)),
            Self::Reflectance(r) => {
                let r = textures.spectrum(r, tex, lambda).clamp(0.0, 0.9999);
                (SampledSpectrum::ONE, r.map(|r| 2.0 * (r / (1.0 - r)).sqrt()))
            }
        }
    }
}

/// What lies between a coat and its base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FillingValue {
    albedo: SpectrumValue,
    g: FloatValue,
}

/// A clear coat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoatValue {
    /// Index into the tabulated coats, where nothing varies.
    tabulated: Option<u32>,
    eta: Index,
    facets: Facets,
    thickness: FloatValue,
    filling: Option<FillingValue>,
    limits: WalkLimits,
}

impl CoatValue {
    fn is_textured(&self) -> bool {
        self.eta.is_textured()
            || self.facets.is_textured()
            || self.thickness.is_textured()
            || self.filling.is_some_and(|filling| filling.albedo.is_textured() || filling.g.is_textured())
    }

    #[inline]
    fn filling(&self, textures: &Textures, tex: &TextureContext, lambda: &Wavelengths) -> Filling {
        match self.filling {
            None => Filling::NONE,
            Some(FillingValue { albedo, g }) => Filling {
                albedo: textures.spectrum(albedo, tex, lambda).clamp(0.0, 1.0),
                g: textures.float(g, tex).clamp(-0.999, 0.999),
            },
        }
    }

    #[inline]
    fn interface(&self, textures: &Textures, tex: &TextureContext, lambda: &mut Wavelengths) -> Dielectric {
        Dielectric::new(self.eta.at(textures, tex, lambda), self.facets.at(textures, tex))
    }
}

/// A depth limit says that the author looked at pbrt-v4's picture, so its weights are kept; 0, our own meaning, is exact.
#[inline]
fn coat_weights(limits: WalkLimits) -> CoatWeights {
    if limits.max_depth == 0 { CoatWeights::Exact } else { CoatWeights::Pbrt }
}

/// A material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Material {
    /// Ideal diffuse reflection.
    Diffuse {
        /// In [0, 1].
        reflectance: SpectrumValue,
    },
    /// Ideal diffuse reflection and transmission.
    DiffuseTransmission {
        /// Reflected share.
        reflectance: SpectrumValue,
        /// Transmitted share.
        transmittance: SpectrumValue,
        /// Factor of both.
        scale: f32,
    },
    /// Metal.
    Conductor {
        /// How it reflects.
        metal: Metal,
        /// Its surface.
        facets: Facets,
    },
    /// Interface of two clear media.
    Dielectric {
        /// Inside over outside.
        eta: Index,
        /// Its surface.
        facets: Facets,
    },
    /// A clear pane.
    ThinDielectric {
        /// Of the pane.
        eta: Index,
    },
    /// A clear coat over a diffuse base.
    CoatedDiffuse {
        /// Of the base.
        reflectance: SpectrumValue,
        /// Over it.
        coat: CoatValue,
    },
    /// A clear coat over metal.
    CoatedConductor {
        /// Of the base.
        metal: Metal,
        /// Of the base.
        facets: Facets,
        /// Over it.
        coat: CoatValue,
    },
    /// One of two, drawn at each hit.
    Mix {
        /// Which.
        materials: [MaterialId; 2],
        /// Chance of the second.
        amount: FloatValue,
    },
    /// No surface at all.
    Interface,
    /// Irradiant's own: light returns to where it came from.
    Retroreflective {
        /// The returned share.
        returned: SpectrumValue,
        /// What the rest falls on.
        base: SpectrumValue,
        /// Spread of the return.
        facets: Facets,
    },
    /// Irradiant's own: a lossless coat over a coloured body.
    GlossyPaint {
        /// Of the body.
        reflectance: SpectrumValue,
        /// Coats for evenly spaced alphas in [0, 1] when the roughness varies, or one.
        coats: Coats,
        /// Of the surface.
        facets: Facets,
    },
    /// Irradiant's own: flakes with an interference film.
    ThinFilmPaint {
        /// nm.
        thickness: FloatValue,
        /// Index of the film.
        film_eta: SpectrumValue,
        /// Under the film.
        metal: Metal,
        /// Spread of the flakes.
        facets: Facets,
    },
}

impl Material {
    /// Whether any number of it comes from a texture, or may.
    fn is_textured(&self) -> bool {
        match *self {
            Self::Diffuse { reflectance } => reflectance.is_textured(),
            Self::DiffuseTransmission { reflectance, transmittance, scale: _ } => {
                reflectance.is_textured() || transmittance.is_textured()
            }
            Self::Conductor { metal, facets } => metal.is_textured() || facets.is_textured(),
            Self::Dielectric { eta, facets } => eta.is_textured() || facets.is_textured(),
            Self::ThinDielectric { eta } => eta.is_textured(),
            Self::CoatedDiffuse { reflectance, coat } => reflectance.is_textured() || coat.is_textured(),
            Self::CoatedConductor { metal, facets, coat } => {
                metal.is_textured() || facets.is_textured() || coat.is_textured()
            }
            Self::Mix { .. } => true,
            Self::Interface => false,
            Self::Retroreflective { returned, base, facets } => {
                returned.is_textured() || base.is_textured() || facets.is_textured()
            }
            Self::GlossyPaint { reflectance, coats: _, facets } => reflectance.is_textured() || facets.is_textured(),
            Self::ThinFilmPaint { thickness, film_eta, metal, facets } => {
                thickness.is_textured() || film_eta.is_textured() || metal.is_textured() || facets.is_textured()
            }
        }
    }

    /// Whether it may scatter into single directions; mixes themselves do not, what they mix may.
    fn may_be_specular(&self) -> bool {
        // Nothing refracts at an index of 1; dispersive ones are never 1 throughout.
        let interface = |eta: &Index, facets: &Facets| facets.may_be_smooth() || *eta == Index::Constant(1.0);
        match self {
            Self::Diffuse { .. } | Self::DiffuseTransmission { .. } | Self::Mix { .. } | Self::Interface => false,
            // Smooth facets are given a width.
            Self::Retroreflective { .. } => false,
            Self::ThinDielectric { .. } => true,
            Self::Conductor { facets, .. } | Self::GlossyPaint { facets, .. } | Self::ThinFilmPaint { facets, .. } => {
                facets.may_be_smooth()
            }
            Self::Dielectric { eta, facets } => interface(eta, facets),
            Self::CoatedDiffuse { coat, .. } | Self::CoatedConductor { coat, .. } => interface(&coat.eta, &coat.facets),
        }
    }
}

/// A range of tabulated coats, by roughness.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coats {
    first: u32,
    count: u32,
}

/// A material with its relief.
#[derive(Clone, Copy, Debug)]
struct Entry {
    material: Material,
    relief: Relief,
    /// Whether any number of it comes from a texture. Mixes count as if, whatever they mix.
    is_textured: bool,
}

impl Entry {
    fn new(material: Material, relief: Relief) -> Self {
        Self { material, relief, is_textured: relief != Relief::Flat || material.is_textured() }
    }
}

/// All materials of a scene.
#[derive(Clone, Debug)]
pub struct Materials {
    entries: Vec<Entry>,
    names: Vec<String>,
    coats: Vec<Coat>,
    normal_maps: Vec<NormalMap>,
    force_diffuse: bool,
    coat_depth_limit: Option<u32>,
    pbrt_coat_weights: bool,
    /// Some mix may come to an interface.
    may_pass: bool,
}

/// A number in [0, 1) from a place.
fn turned(place: u64) -> f32 {
    hash::unit_f32_from_hash(hash::hash_words([place]))
}

/// Samples with which a material's albedo is estimated when all are forced to be diffuse.
const FORCED_DIFFUSE_SAMPLES: u32 = 16;

impl Materials {
    /// Whether rays may pass a surface as if it were not there: where a mix comes to an interface by chance. (What is an
    /// interface and nothing else is no part of the geometry.)
    #[inline]
    pub fn may_pass(&self) -> bool {
        self.may_pass
    }

    /// Whether all materials are replaced by diffuse ones, whose albedo goes by where they are seen from (`Option "forcediffuse"`).
    #[inline]
    pub fn are_forced_diffuse(&self) -> bool {
        self.force_diffuse
    }

    /// Whether any of these materials, or what they mix, may scatter into single directions (a delta), for all that is known without
    /// looking textures up.
    pub fn may_be_specular(&self, ids: impl Iterator<Item = MaterialId>) -> bool {
        if self.force_diffuse {
            return false;
        }
        let (mut seen, mut open) = (vec![false; self.entries.len()], vec![]);
        for id in ids {
            open.push(id.0 as usize);
            while let Some(i) = open.pop() {
                if i >= seen.len() || std::mem::replace(&mut seen[i], true) {
                    continue;
                }
                match &self.entries[i].material {
                    Material::Mix { materials, .. } => open.extend(materials.map(|part| part.0 as usize)),
                    other if other.may_be_specular() => return true,
                    _ => {}
                }
            }
        }
        false
    }

    /// The reflectance of a material that is diffuse and the same everywhere, without relief, and what it makes of it.
    #[inline]
    pub fn plain_diffuse(
        &self,
        id: MaterialId,
        textures: &Textures,
        at: &TextureContext,
        lambda: &Wavelengths,
    ) -> Option<SampledSpectrum> {
        let entry = self.entries.get(id.0 as usize)?;
        match entry.material {
            Material::Diffuse { reflectance } if !entry.is_textured && !self.force_diffuse => {
                Some(textures.spectrum(reflectance, at, lambda).clamp(0.0, 1.0))
            }
            _ => None,
        }
    }

    /// A metal that is rough and the same everywhere, without relief.
    #[inline]
    pub fn plain_rough_metal(
        &self,
        id: MaterialId,
        textures: &Textures,
        at: &TextureContext,
        lambda: &Wavelengths,
    ) -> Option<Conductor> {
        let entry = self.entries.get(id.0 as usize)?;
        match &entry.material {
            Material::Conductor { metal, facets: Facets::Constant(facets) }
                if !entry.is_textured && !self.force_diffuse && !facets.is_smooth() =>
            {
                let (eta, k) = metal.at(textures, at, lambda);
                Some(Conductor::new(eta, k, *facets))
            }
            _ => None,
        }
    }

    /// How light scatters in the shading frame of a hit, of a material without textures, relief or choices; `None` for others.
    #[inline]
    pub fn plain_bsdf(
        &self,
        id: MaterialId,
        frame: Frame,
        textures: &Textures,
        at: &TextureContext,
        lambda: &mut Wavelengths,
    ) -> Option<Bsdf> {
        let entry = self.entries.get(id.0 as usize)?;
        if entry.is_textured || self.force_diffuse {
            return None;
        }
        self.framed(frame, &entry.material, textures, at, lambda)
    }

    /// Whether a material looks anything up in textures, so that it needs to know how large a pixel is where it is met.
    #[inline]
    pub fn is_textured(&self, id: MaterialId) -> bool {
        self.entries.get(id.0 as usize).is_some_and(|entry| entry.is_textured)
    }

    /// Whether a segment passes this surface: with the chance that mixes there come to an interface, decided by the place.
    pub fn passes(&self, id: MaterialId, textures: &Textures, at: &Interaction, tex: &TextureContext) -> bool {
        let number = |level: u32| turned(hash::hash_point(at.p) ^ u64::from(level + 1));
        match self.resolved(id, textures, tex, number) {
            Some(entry) => matches!(entry.material, Material::Interface),
            None => true,
        }
    }

    /// What a material is once chance has decided its mixes; `number` is asked for each mix inside the other.
    #[inline]
    fn resolved(
        &self,
        id: MaterialId,
        textures: &Textures,
        tex: &TextureContext,
        number: impl Fn(u32) -> f32,
    ) -> Option<&Entry> {
        let mut entry = self.entries.get(id.0 as usize)?;
        let mut level = 0;
        while let Material::Mix { materials, amount } = entry.material {
            let amount = textures.float(amount, tex);
            let second = amount >= 1.0 || (amount > 0.0 && number(level) <= amount);
            level += 1;
            entry = self.entries.get(materials[usize::from(second)].0 as usize)?;
        }
        Some(entry)
    }

    /// How light scatters at a hit; `None` where there is no surface (an interface, or no such material).
    ///
    /// `tex` is how the hit looks to textures. `mix` is asked once per level of mixed materials. May end all wavelengths
    /// but the first, at dispersive dielectrics.
    #[inline]
    pub fn bsdf(
        &self,
        id: MaterialId,
        textures: &Textures,
        at: &Interaction,
        tex: &TextureContext,
        lambda: &mut Wavelengths,
        mix: MixDraw<'_>,
    ) -> Option<Bsdf> {
        // A path that passes surfaces comes to several with the same numbers: there the place has a say too.
        let turn = if self.may_pass { turned(hash::hash_point(at.p)) } else { 0.0 };
        let number = |level| {
            let u = mix.get(level) + turn;
            if u < 1.0 { u } else { u - 1.0 }
        };
        let entry = self.resolved(id, textures, tex, number)?;
        let frame = match entry.relief {
            Relief::Flat => Frame::from_z_near_x(at.ns.as_vec(), at.dpdus),
            Relief::Bump(height) => relief::bump(height, textures, at, tex),
            Relief::NormalMap(map) => self.normal_maps[map as usize].frame(at),
        };
        if self.force_diffuse {
            return self.forced_diffuse(frame, &entry.material, textures, tex, lambda, at);
        }
        self.framed(frame, &entry.material, textures, tex, lambda)
    }

    /// A diffuse model of about the same albedo (`Option "forcediffuse"`).
    #[cold]
    #[inline(never)]
    fn forced_diffuse(
        &self,
        frame: Frame,
        material: &Material,
        textures: &Textures,
        tex: &TextureContext,
        lambda: &mut Wavelengths,
        at: &Interaction,
    ) -> Option<Bsdf> {
        let bsdf = self.framed(frame, material, textures, tex, lambda)?;
        let albedo = bsdf.rho_hd(at.wo, FORCED_DIFFUSE_SAMPLES).clamp(0.0, 1.0);
        Some(Bsdf::new(frame, Bxdf::Diffuse(Diffuse::new(albedo))))
    }

    /// The model in its frame. Each arm makes the whole [`Bsdf`], so that it writes no more than its own numbers: made after
    /// all arms, it was copied at every hit (250 bytes, 75 instructions).
    #[inline(always)]
    fn framed(
        &self,
        frame: Frame,
        material: &Material,
        textures: &Textures,
        tex: &TextureContext,
        lambda: &mut Wavelengths,
    ) -> Option<Bsdf> {
        let reflectance = |v, lambda: &Wavelengths| textures.spectrum(v, tex, lambda).clamp(0.0, 1.0);
        let framed = |bxdf| Some(Bsdf::new(frame, bxdf));
        match material {
            Material::Diffuse { reflectance: r } => framed(Bxdf::Diffuse(Diffuse::new(reflectance(*r, lambda)))),
            Material::DiffuseTransmission { reflectance, transmittance, scale } => {
                let share = |v| (textures.spectrum(v, tex, lambda) * *scale).clamp(0.0, 1.0);
                framed(Bxdf::DiffuseTransmission(DiffuseTransmission::new(share(*reflectance), share(*transmittance))))
            }
            Material::Conductor { metal, facets } => {
                let (eta, k) = metal.at(textures, tex, lambda);
                framed(Bxdf::Conductor(Conductor::new(eta, k, facets.at(textures, tex))))
            }
            Material::Dielectric { eta, facets } => {
                let facets = facets.at(textures, tex);
                framed(Bxdf::Dielectric(Dielectric::new(eta.at(textures, tex, lambda), facets)))
            }
            Material::ThinDielectric { eta } => {
                framed(Bxdf::ThinDielectric(ThinDielectric::new(eta.at(textures, tex, lambda))))
            }
            Material::CoatedDiffuse { reflectance: r, coat } => {
                let filling = coat.filling(textures, tex, lambda);
                if let Some(i) = coat.tabulated {
                    let r = reflectance(*r, lambda);
                    framed(Bxdf::CoatedDiffuse(CoatedDiffuse::new(&self.coats[i as usize], r, filling, coat.limits)))
                } else {
                    let r = reflectance(*r, lambda);
                    let (facets, thickness) = (coat.facets.at(textures, tex), textures.float(coat.thickness, tex));
                    let eta = coat.eta.at(textures, tex, lambda);
                    let walked = Coat::walked(eta, facets, thickness, coat_weights(coat.limits));
                    framed(Bxdf::CoatedDiffuse(CoatedDiffuse::new(&walked, r, filling, coat.limits)))
                }
            }
            Material::CoatedConductor { metal, facets, coat } => {
                let (eta, k) = metal.at(textures, tex, lambda);
                let filling = coat.filling(textures, tex, lambda);
                let interface = coat.interface(textures, tex, lambda);
                framed(Bxdf::CoatedConductor(CoatedConductor::new(
                    interface,
                    textures.float(coat.thickness, tex),
                    coat_weights(coat.limits),
                    eta,
                    k,
                    facets.at(textures, tex),
                    filling,
                    coat.limits,
                )))
            }
            // Resolved by the caller.
            Material::Mix { .. } | Material::Interface => None,
            Material::Retroreflective { returned, base, facets } => {
                framed(Bxdf::Retroreflective(Retroreflective::new(
                    reflectance(*returned, lambda),
                    reflectance(*base, lambda),
                    facets.at(textures, tex),
                )))
            }
            Material::GlossyPaint { reflectance: r, coats, facets } => {
                let i = match coats.count {
                    0 | 1 => 0,
                    count => {
                        let [x, y] = facets.at(textures, tex).alphas();
                        let alpha = (x * y).sqrt().clamp(0.0, 1.0);
                        (alpha * (count - 1) as f32 + 0.5) as u32
                    }
                };
                let coat = &self.coats[(coats.first + i) as usize];
                framed(Bxdf::GlossyPaint(GlossyPaint::new(coat, reflectance(*r, lambda))))
            }
            Material::ThinFilmPaint { thickness, film_eta, metal, facets } => {
                let (eta, k) = metal.at(textures, tex, lambda);
                let film_eta = textures.spectrum(*film_eta, tex, lambda);
                let thickness = textures.float(*thickness, tex).max(0.0);
                let film = ThinFilm::new(thickness, film_eta, eta, k, 1.0, lambda.lambda);
                framed(Bxdf::ThinFilmPaint(ThinFilmPaint::new(film, facets.at(textures, tex), None)))
            }
        }
    }

    /// How many there are, mixes included.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// The author's name of a material, or its kind.
    pub fn name(&self, id: MaterialId) -> String {
        self.names.get(id.0 as usize).cloned().unwrap_or_default()
    }

    /// A material.
    pub fn get(&self, id: MaterialId) -> Option<&Material> {
        self.entries.get(id.0 as usize).map(|e| &e.material)
    }

    /// The smallest depth to which walks within coats are followed, if any is limited: pictures lose light there.
    pub fn coat_depth_limit(&self) -> Option<u32> {
        self.coat_depth_limit
    }

    /// Whether a coat is evaluated with pbrt-v4's weights where they differ from the right ones ([`CoatWeights::Pbrt`]):
    /// rough coats whose depth is limited. The picture is then biased, as pbrt-v4's is.
    pub fn uses_pbrt_coat_weights(&self) -> bool {
        self.pbrt_coat_weights
    }
}
