//! The vertices of some blocks' paths side by side, and what of their connections is computed in lanes: a block's sixteen first vertices are the
//! lanes of a loop.

use super::sky::{GLIMPSES, Glimpse};
use super::{Incoming, PIXELS, Second};
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::conductor::mirror_lobe;
use irradiant_core::bxdf::fresnel::fresnel_conductor_at;
use irradiant_core::bxdf::{Conductor, Ggx, is_usable};
use irradiant_core::geometry::{Kernel, SurfaceLanes};
use irradiant_core::interaction::{MaterialId, ReferencePoint};
use irradiant_math::lanes::{LANES, Triples};
use irradiant_math::{Frame, Normal3, Vec3};
use irradiant_spectrum::{N_WAVELENGTHS, SampledSpectrum};
use std::f32::consts::FRAC_1_PI;
use std::ops::Range;

/// Blocks whose paths go together at most.
pub(super) const BLOCKS: usize = LANES / PIXELS;

/// What becomes of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// It ends before its first vertex, or there.
    Nothing,
    /// It goes apart from its first vertex on, which is of another kind.
    Apart,
    /// Its first vertex takes part; it has no second one.
    First,
    /// Its first vertex takes part; from its second one on, which is of another kind, it is its pixel's own.
    Own,
    /// Its second vertex is shared, light leaves it evenly.
    Evenly,
    /// Its second vertex is shared, light leaves it as its BSDF has it.
    By,
}

/// One number of each pixel of a block.
pub(crate) type Sixteen = [f32; PIXELS];

/// Three numbers of each.
pub(super) type Three = Triples<PIXELS>;

/// One spectrum of each: a row for each wavelength.
pub(super) type Spectra = [Sixteen; N_WAVELENGTHS];

/// A lane's spectrum.
#[inline(always)]
pub(super) fn spectrum(of: &Spectra, i: usize) -> SampledSpectrum {
    SampledSpectrum(std::array::from_fn(|k| of[k][i]))
}

#[inline(always)]
pub(super) fn set_spectrum(of: &mut Spectra, i: usize, value: SampledSpectrum) {
    (0..N_WAVELENGTHS).for_each(|k| of[k][i] = value.0[k]);
}

/// How a first vertex scatters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Model {
    /// It takes no part.
    Nothing,
    /// Diffusely or as a rough metal, by the numbers of its lane.
    Plain,
    /// By a model of its own: its place among those of the batch.
    Alone(u32),
}

/// The same, when it is told.
pub(crate) enum FirstScattering<'a> {
    /// By this reflectance.
    Diffuse(SampledSpectrum),
    /// As this rough metal.
    Metal(&'a Conductor),
    /// In the frame of its vertex.
    Alone(&'a Bsdf),
}

/// The first vertices of a block's paths.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Receivers {
    pub p: Three,
    pub p_error: Three,
    pub n: Three,
    x: Three,
    y: Three,
    z: Three,
    /// In the frames.
    wo: Three,
    /// Of diffuse ones, 1/sr.
    f: Spectra,
    /// Of metals.
    alphas: [Sixteen; 2],
    eta: Spectra,
    k: Spectra,
    is_metal: [u32; PIXELS],
    is_plain: [u32; PIXELS],
    pub models: [Model; PIXELS],
    /// What those are made of that are flat triangles.
    pub materials: [Option<MaterialId>; PIXELS],
    /// The block's, in the scene's units.
    pub time: f32,
}

impl Receivers {
    const NONE: Self = Self {
        p: Three::ZERO,
        p_error: Three::ZERO,
        n: Three::ZERO,
        x: Three::ZERO,
        y: Three::ZERO,
        z: Three::ZERO,
        wo: Three::ZERO,
        f: [[0.0; PIXELS]; N_WAVELENGTHS],
        alphas: [[1.0; PIXELS]; 2],
        eta: [[1.0; PIXELS]; N_WAVELENGTHS],
        k: [[1.0; PIXELS]; N_WAVELENGTHS],
        is_metal: [0; PIXELS],
        is_plain: [0; PIXELS],
        models: [Model::Nothing; PIXELS],
        materials: [None; PIXELS],
        time: 0.0,
    };

    #[inline(always)]
    fn frame(&self, i: usize) -> Frame {
        Frame { x: self.x.vector(i), y: self.y.vector(i), z: self.z.vector(i) }
    }

    /// What plain vertices scatter of light from these directions, with the cosine, the densities with which they find it, 1/sr, and
    /// whether it is anything.
    #[inline(always)]
    pub fn scatter(&self, wi: &Three, f_cos: &mut Spectra, pdf: &mut Sixteen, scatters: &mut [u32; PIXELS]) {
        let mut cosine = [0.0; PIXELS];
        for i in 0..PIXELS {
            let wi = wi.vector(i);
            let (local_o, local_i) = (self.wo.vector(i), self.frame(i).to_local(wi));
            let is_above = is_usable(local_o) & is_usable(local_i) & (local_o.z * local_i.z > 0.0);
            cosine[i] = wi.dot(self.z.vector(i)).abs();
            pdf[i] = if is_above { local_i.z.abs() * FRAC_1_PI } else { 0.0 };
        }
        *f_cos = self.f;
        if self.is_metal.iter().fold(0, |any, metal| any | metal) != 0 {
            let (mut facet, mut value) = ([0.0; PIXELS], [0.0; PIXELS]);
            for i in 0..PIXELS {
                let (local_o, local_i) = (self.wo.vector(i), self.frame(i).to_local(wi.vector(i)));
                let (lobe, is_lit) = mirror_lobe(&Ggx::new(self.alphas[0][i], self.alphas[1][i]), local_o, local_i);
                let is_found = is_usable(local_o) & is_usable(local_i) & is_lit & (lobe.pdf.abs() < f32::INFINITY);
                let found = if is_found { lobe.pdf } else { 0.0 };
                pdf[i] = if self.is_metal[i] != 0 { found } else { pdf[i] };
                (facet[i], value[i]) = (lobe.cos, lobe.value);
            }
            for k in 0..N_WAVELENGTHS {
                for i in 0..PIXELS {
                    let f = fresnel_conductor_at(facet[i], self.eta[k][i], self.k[k][i]) * value[i];
                    f_cos[k][i] = if self.is_metal[i] != 0 { f } else { f_cos[k][i] };
                }
            }
        }
        let (mut is_black, mut is_finite) = ([1; PIXELS], [1; PIXELS]);
        for k in 0..N_WAVELENGTHS {
            for i in 0..PIXELS {
                is_finite[i] &= u32::from(f_cos[k][i].abs() < f32::INFINITY);
                f_cos[k][i] *= cosine[i];
                is_black[i] &= u32::from(f_cos[k][i] == 0.0);
            }
        }
        for i in 0..PIXELS {
            scatters[i] = u32::from(is_black[i] == 0) & is_finite[i] & self.is_plain[i];
        }
    }

    /// At the wavelengths of a path.
    pub fn set_diffuse(&mut self, i: usize, reflectance: SampledSpectrum) {
        set_spectrum(&mut self.f, i, reflectance * FRAC_1_PI);
    }

    /// At the wavelengths of a path.
    pub fn set_metal(&mut self, i: usize, metal: &Conductor) {
        let (eta, k) = metal.index();
        set_spectrum(&mut self.eta, i, eta);
        set_spectrum(&mut self.k, i, k);
    }
}

/// Light that leaves a second vertex, as [`Scattered`](super::Scattered).
pub(crate) enum Leaving {
    /// The same radiance in all directions of the side of this normal.
    Evenly { normal: Vec3, radiance: SampledSpectrum },
    /// As its BSDF has it, whose place this is: what arrives.
    By { bsdf: u32, incoming: Range<usize> },
}

/// What the paths of some blocks leave for their own pixels and for one another's, by the places of their samples.
pub(crate) struct Blocks {
    pub kinds: Vec<Kind>,
    /// What is the pixel's own.
    pub own: Vec<SampledSpectrum>,
    /// Light samples at second vertices.
    pub direct: Vec<SampledSpectrum>,
    /// What paths bring after them.
    pub rest: Vec<SampledSpectrum>,
    /// Where paths go from shared second vertices whose directions matter.
    pub next: Vec<Option<Vec3>>,
    pub(super) receivers: Vec<Receivers>,
    /// Models of their own, and the directions from which the camera sees them.
    pub(super) alone: Vec<(Bsdf, Vec3)>,
    /// Second vertices that are shared; in the end, without those that no light leaves.
    pub seconds: Vec<Option<Second<Leaving>>>,
    /// Of second vertices.
    pub bsdfs: Vec<Bsdf>,
    /// What arrives at second vertices; in the end, one's after another's.
    pub incoming: Vec<(u32, Incoming)>,
    // For each block, if the sky is shared:
    /// Directions to it: light samples, then those of BSDFs.
    pub glimpses: Vec<[Option<Glimpse>; GLIMPSES]>,
    /// First vertices that draw light samples.
    pub seeking: Vec<u32>,
    /// A random number of each pixel.
    pub marks: Vec<Sixteen>,
}

impl Blocks {
    pub(super) fn new() -> Self {
        Self {
            kinds: Vec::new(),
            own: Vec::new(),
            direct: Vec::new(),
            rest: Vec::new(),
            next: Vec::new(),
            receivers: vec![Receivers::NONE; BLOCKS],
            alone: Vec::new(),
            seconds: Vec::new(),
            bsdfs: Vec::new(),
            incoming: Vec::new(),
            glimpses: Vec::new(),
            seeking: Vec::new(),
            marks: Vec::new(),
        }
    }

    /// For the paths of so many samples.
    pub fn begin(&mut self, samples: usize) {
        fn fill<T: Clone>(all: &mut Vec<T>, n: usize, value: T) {
            all.clear();
            all.resize(n, value);
        }
        fill(&mut self.kinds, samples, Kind::Nothing);
        for sums in [&mut self.own, &mut self.direct, &mut self.rest] {
            fill(sums, samples, SampledSpectrum::ZERO);
        }
        fill(&mut self.next, samples, None);
        for receivers in &mut self.receivers {
            receivers.models = [Model::Nothing; PIXELS];
            (receivers.is_metal, receivers.is_plain) = ([0; PIXELS], [0; PIXELS]);
        }
        self.alone.clear();
        self.bsdfs.clear();
        self.seconds.clear();
        self.seconds.resize_with(samples, || None);
        self.incoming.clear();
        let blocks = samples.div_ceil(PIXELS);
        fill(&mut self.glimpses, blocks, [None; GLIMPSES]);
        fill(&mut self.seeking, blocks, 0);
        fill(&mut self.marks, blocks, [0.0; PIXELS]);
    }

    /// Notes a direction in which a path looked for the sky from its first vertex, by a light sample or as its BSDF has it.
    pub fn set_glimpse(&mut self, s: usize, is_light_sample: bool, glimpse: Glimpse) {
        let place = if is_light_sample { 0 } else { PIXELS } + s % PIXELS;
        self.glimpses[s / PIXELS][place] = Some(glimpse);
    }

    /// Notes the first vertex of a path: that of lane `i`, and its material if it is that of a flat triangle.
    pub fn set_first(
        &mut self,
        s: usize,
        at: &SurfaceLanes,
        i: usize,
        time: f32,
        scattering: FirstScattering,
        material: Option<MaterialId>,
    ) {
        let (first, k) = (&mut self.receivers[s / PIXELS], s % PIXELS);
        let (wo, frame) = (at.wo.vector(i), at.frame(i));
        first.p.set(k, at.p.point(i).to_array());
        first.p_error.set(k, at.p_error.vector(i).to_array());
        first.n.set(k, at.n.normal(i).to_array());
        first.x.set(k, frame.x.to_array());
        first.y.set(k, frame.y.to_array());
        first.z.set(k, frame.z.to_array());
        first.wo.set(k, frame.to_local(wo).to_array());
        (first.materials[k], first.time) = (material, time);
        (first.is_plain[k], first.is_metal[k]) = (1, 0);
        first.models[k] = Model::Plain;
        match scattering {
            FirstScattering::Diffuse(reflectance) => first.set_diffuse(k, reflectance),
            FirstScattering::Metal(metal) => {
                let [x, y] = metal.facets().alphas();
                (first.alphas[0][k], first.alphas[1][k]) = (x, y);
                first.set_metal(k, metal);
                first.is_metal[k] = 1;
            }
            FirstScattering::Alone(bsdf) => {
                first.is_plain[k] = 0;
                first.models[k] = Model::Alone(self.alone.len() as u32);
                self.alone.push((*bsdf, wo));
            }
        }
    }

    /// When all paths are at their ends: puts together what came at different times.
    pub fn end(&mut self) {
        for (s, kind) in self.kinds.iter().enumerate() {
            match kind {
                Kind::Nothing | Kind::First => {}
                Kind::Apart => self.own[s] += self.rest[s],
                Kind::Own => self.own[s] += self.direct[s] + self.rest[s],
                Kind::Evenly => {
                    if let Some(Second { light: Leaving::Evenly { radiance, .. }, .. }) = &mut self.seconds[s] {
                        *radiance = self.direct[s] + self.rest[s];
                    }
                }
                Kind::By => {
                    if let Some(wi) = self.next[s].filter(|_| !self.rest[s].is_black()) {
                        let light = Incoming { wi, radiance: self.rest[s], light_pdf: 0.0, found_by_bsdf: true };
                        self.incoming.push((s as u32, light));
                    }
                }
            }
        }
        // Of one vertex in the order in which they came.
        self.incoming.sort_by_key(|(s, _)| *s);
        let mut begin = 0;
        for of_one in self.incoming.chunk_by(|a, b| a.0 == b.0) {
            let end = begin + of_one.len();
            if let Some(Second { light: Leaving::By { incoming, .. }, .. }) = &mut self.seconds[of_one[0].0 as usize] {
                *incoming = begin..end;
            }
            begin = end;
        }
        // Nobody needs to be asked whether he sees what is dark.
        for second in &mut self.seconds {
            let is_black = match second {
                Some(Second { light: Leaving::Evenly { radiance, .. }, .. }) => radiance.is_black(),
                Some(Second { light: Leaving::By { incoming, .. }, .. }) => {
                    self.incoming[incoming.clone()].iter().all(|(_, light)| light.radiance.is_black())
                }
                None => false,
            };
            if is_black {
                *second = None;
            }
        }
    }
}

/// A second vertex as the first vertices of its block see it.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct Meeting {
    /// From the second to the first ones.
    pub wo: Three,
    /// cos / r^2 at the second: from density per solid angle to density per area.
    pub there: Sixteen,
    /// Density with which a first one's BSDF finds the second, per area.
    pub pdf: Sixteen,
    /// What the light of the second is multiplied with on its way along the first to the camera.
    pub f: Spectra,
    /// 1 where light leaves the second vertex this way.
    pub leaves: [u32; PIXELS],
    /// Not 0 where light is scattered so, and not yet known to be blocked.
    pub is_joined: [u32; PIXELS],
    /// The segment from the first to the second.
    pub o: Three,
    pub d: Three,
}

impl Meeting {
    pub const NONE: Self = Self {
        wo: Three::ZERO,
        there: [0.0; PIXELS],
        pdf: [0.0; PIXELS],
        f: [[0.0; PIXELS]; N_WAVELENGTHS],
        leaves: [0; PIXELS],
        is_joined: [0; PIXELS],
        o: Three::ZERO,
        d: Three::ZERO,
    };

    /// Sets a lane: what is scattered, with the cosine at the first vertex, and its density, 1/sr.
    pub fn set(&mut self, i: usize, f_cos: SampledSpectrum, pdf: f32) {
        let pdf = pdf * self.there[i];
        self.is_joined[i] = u32::from(pdf > 0.0 && pdf.is_finite() && !f_cos.is_black());
        self.pdf[i] = pdf;
        set_spectrum(&mut self.f, i, f_cos * self.there[i]);
    }
}

/// All first vertices of a block meet one second vertex. Models of their own are still to be asked.
pub(super) struct Meet<'a> {
    pub receivers: &'a Receivers,
    pub place: &'a ReferencePoint,
    /// The normal on the only side that light leaves, if there is one.
    pub side: Option<Vec3>,
    pub out: &'a mut Meeting,
}

impl Kernel for Meet<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { receivers: r, place, side, out } = self;
        let ReferencePoint { p, p_error, n, .. } = *place;
        let (has_side, side) = (side.is_some(), side.unwrap_or(Vec3::ZERO));
        let (mut wi, mut pdf) = (Three::ZERO, [0.0; PIXELS]);
        for i in 0..PIXELS {
            let d = p - r.p.point(i);
            let r2 = d.length_squared();
            let towards = d * (1.0 / r2.sqrt());
            wi.set(i, towards.to_array());
            out.wo.set(i, (-towards).to_array());
            out.there[i] = towards.dot_normal(n).abs() / r2;
            out.leaves[i] = u32::from(!has_side | (towards.dot(side) < 0.0));
        }
        for i in 0..PIXELS {
            let from =
                ReferencePoint { p: r.p.point(i), p_error: r.p_error.vector(i), n: r.n.normal(i), ns: Normal3::ZERO };
            let ray = from.spawn_ray_to(p, p_error, n, 0.0);
            out.o.set(i, ray.o.to_array());
            out.d.set(i, ray.d.to_array());
        }
        r.scatter(&wi, &mut out.f, &mut pdf, &mut out.is_joined);
        for k in 0..N_WAVELENGTHS {
            for i in 0..PIXELS {
                out.f[k][i] *= out.there[i];
            }
        }
        for i in 0..PIXELS {
            let pdf = pdf[i] * out.there[i];
            // Directions in which nothing is scattered are never drawn.
            out.is_joined[i] &= u32::from((pdf > 0.0) & (pdf < f32::INFINITY)) & out.leaves[i];
            out.pdf[i] = pdf;
        }
    }
}

/// What a second vertex gives to each first one of its block that is joined to it: radiance that reaches the camera.
pub(super) struct GiveEvenly<'a> {
    pub meeting: &'a Meeting,
    pub radiance: SampledSpectrum,
    pub out: &'a mut Spectra,
}

impl Kernel for GiveEvenly<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { meeting: m, radiance, out } = self;
        let mut total = 0.0;
        for i in 0..PIXELS {
            total += if m.is_joined[i] != 0 { m.pdf[i] } else { 0.0 };
        }
        let share = 1.0 / total;
        for k in 0..N_WAVELENGTHS {
            for i in 0..PIXELS {
                let given = m.f[k][i] * radiance.0[k] * share;
                out[k][i] = if m.is_joined[i] != 0 { given } else { 0.0 };
            }
        }
    }
}

/// As [`GiveEvenly`], of one light that arrives at a metal; nothing where it finds no way to it.
pub(super) struct GiveByMetal<'a> {
    pub meeting: &'a Meeting,
    pub frame: &'a Frame,
    pub metal: &'a Conductor,
    pub light: &'a Incoming,
    pub out: &'a mut Spectra,
}

impl Kernel for GiveByMetal<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        let Self { meeting: m, frame, metal, light, out } = self;
        let facets = metal.facets();
        let (eta, k) = metal.index();
        let local_i = frame.to_local(light.wi);
        let i_is_usable = is_usable(local_i);
        let (mut facet, mut value, mut pdf) = ([0.0; PIXELS], [0.0; PIXELS], [0.0; PIXELS]);
        for i in 0..PIXELS {
            let local_o = frame.to_local(m.wo.vector(i));
            let (lobe, is_lit) = mirror_lobe(&facets, local_o, local_i);
            let scatters = is_usable(local_o) & i_is_usable & is_lit & (lobe.pdf.abs() < f32::INFINITY);
            facet[i] = lobe.cos;
            value[i] = lobe.value;
            pdf[i] = if scatters & (m.is_joined[i] != 0) { lobe.pdf } else { f32::INFINITY };
        }
        let (mut is_black, mut is_finite) = ([1; PIXELS], [1; PIXELS]);
        for lane in 0..N_WAVELENGTHS {
            for i in 0..PIXELS {
                let f = fresnel_conductor_at(facet[i], eta.0[lane], k.0[lane]) * value[i];
                is_black[i] &= u32::from(f == 0.0);
                is_finite[i] &= u32::from(f.abs() < f32::INFINITY);
                out[lane][i] = f;
            }
        }
        let mut total = 0.0;
        let mut scatters = [0; PIXELS];
        for i in 0..PIXELS {
            let is_found = (pdf[i] < f32::INFINITY) & (is_finite[i] != 0);
            scatters[i] = u32::from(is_found);
            let found = if is_found & light.found_by_bsdf & (is_black[i] == 0) { pdf[i] } else { 0.0 };
            pdf[i] = if m.is_joined[i] != 0 { m.pdf[i] * (light.light_pdf + found) } else { 0.0 };
        }
        for i in 0..PIXELS {
            total += pdf[i];
        }
        let scale = light.wi.dot(frame.z).abs() / total;
        let is_any = total > 0.0;
        for lane in 0..N_WAVELENGTHS {
            let radiance = light.radiance.0[lane] * scale;
            for i in 0..PIXELS {
                let f = if scatters[i] != 0 { out[lane][i] } else { 0.0 };
                let given = m.f[lane][i] * f * radiance;
                out[lane][i] = if is_any & (m.is_joined[i] != 0) { given } else { 0.0 };
            }
        }
    }
}

/// Adds what the sensor makes of radiance in the RGB basis, which is its multiple.
pub(super) struct Respond<'a> {
    pub radiance: &'a Spectra,
    pub scale: [f32; 3],
    pub sums: &'a mut [Sixteen; 3],
}

impl Kernel for Respond<'_> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        for c in 0..3 {
            for i in 0..PIXELS {
                self.sums[c][i] += self.radiance[c][i] * self.scale[c];
            }
        }
    }
}
