//! The numbers of many paths side by side, between vertices and at them.

use super::kernels::{Numbers, PlacesOfBounces, PlacesOfCamera, Scatter};
use super::lamps::{PlainLamp, has_one_light};
use super::split::ChosenLanes;
use crate::camera_samples::{BatchSample, Beginnings};
use crate::light_samples::LightChoice;
use crate::path::{Previous, Walk, power_heuristic};
use irradiant_core::bsdf::Bsdf;
use irradiant_core::bxdf::{Bxdf, Conductor, Diffuse, Ggx, Sides, TransportMode};
use irradiant_core::geometry::{Hit, RayBatch, RectangleLanes, SphereLanes, SurfaceLanes, TriangleLanes};
use irradiant_core::interaction::ReferencePoint;
use irradiant_core::interaction::{Interaction, LightId, MaterialId, TextureContext};
use irradiant_core::light::{ImageInfiniteLight, SkyLanes, SkyPoint, TargetLanes};
use irradiant_core::light_sampler::{PickedLight, TreeLanes};
use irradiant_core::sampler::{BlockLanes, StreamLanes};
use irradiant_core::scene::Scene;
use irradiant_math::lanes::{Floats, LANES, Triples, WHOLE};
use irradiant_math::{Normal3, Point2, Point3, Ray, offset_ray_origin};
use irradiant_spectrum::{Basis, N_WAVELENGTHS, SampledSpectrum, Wavelengths};

/// How a path's vertex scatters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scattering {
    /// Diffusely, by the reflectance of its lane.
    Diffuse,
    /// As a rough metal, that of its lane.
    Metal,
    /// By a model of its own: its place among those of the batch.
    Alone(u32),
    /// Not here: the path has been taken to its end.
    Gone,
}

/// What a path meets.
#[derive(Clone, Copy, Debug)]
pub(super) enum Surface {
    /// A flat triangle of this material, perhaps a lamp.
    Flat(MaterialId, Option<LightId>),
    /// Something else.
    Other,
}

/// A lamp that a path meets.
#[derive(Clone, Copy, Debug)]
pub(super) struct MetLamp {
    /// The path's lane.
    pub lane: u32,
    pub light: LightId,
    /// Parameters of the place, as the hit reports them.
    pub uv: Point2,
    /// What leaves it towards the path, not black.
    pub emitted: SampledSpectrum,
}

/// What a material is that is the same everywhere.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Plain {
    /// Diffuse, of this reflectance.
    Diffuse(SampledSpectrum),
    /// A rough metal.
    Metal(Conductor),
    /// Another one, or it varies.
    Other,
}

impl Plain {
    pub fn of(scene: &Scene, material: MaterialId, lambda: &Wavelengths) -> Self {
        let (materials, textures, nowhere) = (&scene.materials, &scene.textures, nowhere());
        if let Some(reflectance) = materials.plain_diffuse(material, textures, &nowhere, lambda) {
            Self::Diffuse(reflectance)
        } else if let Some(metal) = materials.plain_rough_metal(material, textures, &nowhere, lambda) {
            Self::Metal(metal)
        } else {
            Self::Other
        }
    }
}

/// Nothing varies over plain materials, so that any place will do.
pub(super) fn nowhere() -> TextureContext {
    TextureContext::without_footprint(Point3::ZERO, Normal3::ZERO, Point2::ZERO, 0)
}

/// A spectrum each, an array for each of its lanes. Loops over whole spectra side by side are not made into vector code: the Cornell box took 1.23
/// times the time.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub(super) struct SpectrumLanes(pub [Floats; N_WAVELENGTHS]);

impl SpectrumLanes {
    pub const ZERO: Self = Self([[0.0; LANES]; N_WAVELENGTHS]);

    /// Of a path.
    #[inline(always)]
    pub fn at(&self, i: usize) -> SampledSpectrum {
        let [a, b, c, d] = &self.0;
        SampledSpectrum([a[i], b[i], c[i], d[i]])
    }

    /// Sets that of a path.
    #[inline(always)]
    pub fn set(&mut self, i: usize, spectrum: SampledSpectrum) {
        let [a, b, c, d] = &mut self.0;
        [a[i], b[i], c[i], d[i]] = spectrum.0;
    }

    /// That of lane `from` goes to lane `to`.
    #[inline(always)]
    pub fn shift(&mut self, to: usize, from: usize) {
        self.set(to, self.at(from));
    }
}

/// What the paths of a batch carry, side by side.
#[repr(C, align(64))]
pub(crate) struct Batch {
    // Between vertices.
    pub(super) o: Triples,
    pub(super) d: Triples,
    pub(super) time: Floats,
    pub(super) streams: StreamLanes,
    pub(super) previous: [Triples; 4],
    pub(super) bsdf_pdf: Floats,
    pub(super) specular: [bool; LANES],
    /// How lights were sampled at the last vertex, the same for all.
    pub(super) light_choice: LightChoice,
    pub(super) throughput: SpectrumLanes,
    pub(super) roulette_scale: Floats,
    pub(super) met: [Option<Hit>; LANES],
    pub(super) escape_place: [Option<Point2>; LANES],
    /// Which of the batch's samples.
    pub(super) sample: [u32; LANES],

    // At a vertex.
    pub(super) surface: [Surface; LANES],
    /// What is known of each material, where that is the same for all paths: in the RGB basis.
    pub(super) known: Vec<Option<Plain>>,
    pub(super) triangles: TriangleLanes,
    pub(super) at: SurfaceLanes,
    pub(super) scattering: [Scattering; LANES],
    pub(super) reflectance: SpectrumLanes,
    /// The indices of metals.
    pub(super) eta: SpectrumLanes,
    pub(super) k: SpectrumLanes,
    pub(super) is_metal: [u32; LANES],
    pub(super) alphas: [Floats; 2],
    /// Models of their own, and whose they are.
    pub(super) bsdfs: Vec<Bsdf>,
    pub(super) bsdf_lanes: Vec<u32>,
    /// 1 where light scatters that it is not known where to look for.
    pub(super) seeks: [u32; LANES],
    /// Whether any path has gone since the vertices were met.
    pub(super) any_gone: bool,
    pub(super) light: BlockLanes,
    pub(super) scatter: BlockLanes,

    /// Paths whose surfaces are not plain flat triangles.
    pub(super) uncommon: Vec<u32>,

    // Light of lamps that paths meet.
    /// Lamps that are plain flat triangles: lane, light.
    pub(super) flat_lamps: Vec<(u32, LightId)>,
    pub(super) lamps_met: Vec<MetLamp>,

    // Light samples.
    /// Paths that look for light.
    pub(super) seeking: Vec<u32>,
    /// What is known of each light.
    pub(super) known_lamps: Vec<Option<PlainLamp>>,
    pub(super) tree: TreeLanes,
    /// The lights that were picked.
    pub(super) picked: [u32; LANES],
    pub(super) rectangles: RectangleLanes,
    pub(super) spheres: SphereLanes,
    /// The lamp that each lane of these holds.
    pub(super) rectangle: [u32; LANES],
    pub(super) sphere: [u32; LANES],
    pub(super) two_sided: [u32; LANES],
    pub(super) sky: SkyLanes,
    pub(super) targets: TargetLanes,
    pub(super) is_delta: [u32; LANES],
    pub(super) arriving: SpectrumLanes,
    /// The chance with which the light was picked; 0 where none is sampled.
    pub(super) pmf: Floats,
    /// How often the light is sampled at the vertex on average, and the share of all samples that this one stands for.
    pub(super) light_times: Floats,
    pub(super) light_share: Floats,
    /// What the light brings to the sample, but for what is in the way, and whether it is to be counted.
    pub(super) brought: SpectrumLanes,
    pub(super) brings: [u32; LANES],
    /// Paths whose light samples are drawn alone.
    pub(super) light_alone: Vec<u32>,
    /// Those of several that were chosen, of which one is tested.
    pub(super) chosen: ChosenLanes,
    /// Where several lights are sampled: of each path so many places, with the number of strata that picked the light; how many are taken;
    /// and a stratum's numbers.
    pub(super) light_picks: Vec<(PickedLight, u32)>,
    pub(super) light_counts: [u32; LANES],
    pub(super) light_pick: Floats,
    /// The sky, while vertices share it, and their samples of it: lane, point, share of all samples, chance.
    pub(super) shared_sky: Option<LightId>,
    pub(super) sky_samples: Vec<(u32, SkyPoint, f32, f32)>,
    /// Paths that ask what is in the way of their light.
    pub(super) asking: [u32; LANES],
    /// Their rays to the light, or all paths' rays to the next vertices.
    pub(super) rays: RayBatch,

    // Directions of diffuse surfaces and metals.
    pub(super) next_o: Triples,
    pub(super) next_d: Triples,
    pub(super) next_pdf: Floats,
    /// f cos / pdf, and whether anything is scattered.
    pub(super) next_weight: SpectrumLanes,
    pub(super) goes_on: [u32; LANES],
    /// Where on the sky's image directions lead to.
    pub(super) places: [Floats; 2],
    /// What the scale of roulette is multiplied with.
    pub(super) next_scale: Floats,
}

const NO_LAMP: u32 = u32::MAX;

impl Batch {
    /// For paths of this scene.
    // Apart, so that what is made on the stack first is gone from it afterwards.
    #[inline(never)]
    pub fn new(scene: &Scene) -> Box<Self> {
        Box::new(Self {
            o: Triples::ZERO,
            d: Triples::ZERO,
            time: [0.0; LANES],
            streams: StreamLanes::NONE,
            previous: [Triples::ZERO; 4],
            bsdf_pdf: [0.0; LANES],
            specular: [false; LANES],
            light_choice: LightChoice::ONE,
            throughput: SpectrumLanes::ZERO,
            roulette_scale: [0.0; LANES],
            met: [None; LANES],
            escape_place: [None; LANES],
            sample: [0; LANES],
            surface: [Surface::Other; LANES],
            known: vec![None; scene.materials.len()],
            triangles: TriangleLanes::NONE,
            at: SurfaceLanes::ZERO,
            scattering: [Scattering::Gone; LANES],
            reflectance: SpectrumLanes::ZERO,
            eta: SpectrumLanes::ZERO,
            k: SpectrumLanes::ZERO,
            is_metal: [0; LANES],
            alphas: [[1.0; LANES]; 2],
            bsdfs: Vec::new(),
            bsdf_lanes: Vec::new(),
            seeks: [0; LANES],
            any_gone: false,
            light: BlockLanes::ZERO,
            scatter: BlockLanes::ZERO,
            uncommon: Vec::new(),
            flat_lamps: Vec::new(),
            lamps_met: Vec::new(),
            seeking: Vec::new(),
            known_lamps: PlainLamp::all(scene),
            tree: TreeLanes::NONE,
            picked: [0; LANES],
            rectangles: RectangleLanes::NONE,
            spheres: SphereLanes::NONE,
            rectangle: [NO_LAMP; LANES],
            sphere: [NO_LAMP; LANES],
            two_sided: [0; LANES],
            sky: SkyLanes::NONE,
            targets: TargetLanes::NONE,
            is_delta: [0; LANES],
            arriving: SpectrumLanes::ZERO,
            pmf: [0.0; LANES],
            light_times: [0.0; LANES],
            light_share: [0.0; LANES],
            brought: SpectrumLanes::ZERO,
            brings: [0; LANES],
            light_alone: Vec::new(),
            chosen: ChosenLanes::NONE,
            light_picks: Vec::new(),
            light_counts: [0; LANES],
            light_pick: [0.0; LANES],
            shared_sky: None,
            sky_samples: Vec::new(),
            asking: [0; LANES],
            rays: RayBatch::NONE,
            next_o: Triples::ZERO,
            next_d: Triples::ZERO,
            next_pdf: [0.0; LANES],
            next_weight: SpectrumLanes::ZERO,
            goes_on: [0; LANES],
            places: [[0.0; LANES]; 2],
            next_scale: [1.0; LANES],
        })
    }

    /// Puts the camera rays of some samples into lanes, whose first hits are known. How many there are.
    pub fn begin(&mut self, scene: &Scene, samples: &[BatchSample], begin: &Beginnings) -> usize {
        self.o.copy(samples.len(), &begin.rays.o);
        self.d.copy(samples.len(), &begin.rays.d);
        self.time = begin.rays.time;
        self.streams.clone_from(begin.streams);
        let mut n = samples.len();
        self.met[..n].copy_from_slice(begin.hits);
        for s in 0..n {
            self.sample[s] = s as u32;
        }
        // Cameras that see everything need no look at each sample.
        if begin.rays.weight[..n].iter().any(|weight| *weight < 0.0) {
            n = 0;
            for (s, sample) in samples.iter().enumerate() {
                if sample.camera_weight.is_some() {
                    self.shift(n, s);
                    n += 1;
                }
            }
        }
        self.throughput.0.iter_mut().for_each(|lane| lane[..n].fill(1.0));
        self.roulette_scale[..n].fill(1.0);
        self.escape_place[..n].fill(None);
        if let Some((_, sky)) = scene.lights.sky()
            && self.met[..n].iter().any(Option::is_none)
        {
            scene.geometry.level().run(PlacesOfCamera(self, n, sky));
            for i in 0..n {
                self.escape_place[i] = self.met[i].map_or_else(|| Some(self.place(i, sky)), |_| None);
            }
        }
        n
    }

    #[inline(always)]
    pub fn ray(&self, i: usize) -> Ray {
        Ray::new(self.o.point(i), self.d.vector(i), self.time[i])
    }

    /// Where on the sky's image the direction of a lane leads to, whose memory is asked for.
    #[inline]
    pub fn place(&self, i: usize, sky: &ImageInfiniteLight) -> Point2 {
        let place = Point2::new(self.places[0][i], self.places[1][i]);
        sky.prefetch(place);
        place
    }

    /// A path on its way to what it meets.
    pub fn walk(&self, i: usize, depth: u32) -> Walk {
        let previous = (depth > 0).then(|| {
            let [p, p_error, n, ns] = &self.previous;
            let reference =
                ReferencePoint { p: p.point(i), p_error: p_error.vector(i), n: n.normal(i), ns: ns.normal(i) };
            Previous {
                reference,
                bsdf_pdf: self.bsdf_pdf[i],
                specular: self.specular[i],
                light_choice: self.light_choice,
            }
        });
        Walk {
            throughput: self.throughput.at(i),
            depth,
            roulette_scale: self.roulette_scale[i],
            previous,
            // Only regularisation asks, which has no stages.
            any_non_specular: depth > 0,
            escape_place: self.escape_place[i],
            ..Walk::from_camera(self.ray(i), self.met[i])
        }
    }

    /// What a path carries goes from lane `from` to lane `to`.
    #[inline(always)]
    pub fn shift(&mut self, to: usize, from: usize) {
        if to == from {
            return;
        }
        self.o.shift(to, from);
        self.d.shift(to, from);
        self.time[to] = self.time[from];
        self.streams.shift(to, from);
        self.previous.iter_mut().for_each(|t| t.shift(to, from));
        self.bsdf_pdf[to] = self.bsdf_pdf[from];
        self.specular[to] = self.specular[from];
        self.throughput.shift(to, from);
        self.roulette_scale[to] = self.roulette_scale[from];
        self.met[to] = self.met[from];
        self.escape_place[to] = self.escape_place[from];
        self.sample[to] = self.sample[from];
    }

    /// What a material is, if that is the same everywhere.
    #[inline(always)]
    pub(super) fn plain(&mut self, scene: &Scene, material: MaterialId, lambda: &Wavelengths) -> Plain {
        match self.known.get_mut(material.0 as usize) {
            Some(known) if scene.basis() == Basis::Rgb => {
                *known.get_or_insert_with(|| Plain::of(scene, material, lambda))
            }
            _ => Plain::of(scene, material, lambda),
        }
    }

    /// Makes a lane's surface scatter as a material does that is the same everywhere. Whether it is.
    #[inline(always)]
    pub(super) fn set_plain(&mut self, i: usize, scene: &Scene, material: MaterialId, lambda: &Wavelengths) -> bool {
        // Not a copy of all that may be known.
        let of_this;
        let plain = match self.known.get_mut(material.0 as usize) {
            Some(known) if scene.basis() == Basis::Rgb => {
                &*known.get_or_insert_with(|| Plain::of(scene, material, lambda))
            }
            _ => {
                of_this = Plain::of(scene, material, lambda);
                &of_this
            }
        };
        match plain {
            Plain::Diffuse(reflectance) => {
                let reflectance = *reflectance;
                self.set_diffuse(i, reflectance);
                true
            }
            Plain::Metal(metal) => {
                let metal = *metal;
                self.set_metal(i, metal);
                true
            }
            Plain::Other => false,
        }
    }

    /// The weight of a lane's light sample over its density, where scattering finds its direction with the density `pdf`.
    #[inline(always)]
    pub fn light_weight(&self, i: usize, pdf: f32) -> f32 {
        let weight = power_heuristic(self.light_times[i] * self.targets.pdf[i], pdf);
        let weight = if self.is_delta[i] != 0 { 1.0 } else { weight };
        weight * self.light_share[i] / (self.pmf[i] * self.targets.pdf[i])
    }

    /// Whether any of the lanes of a vector is one of metal.
    #[inline(always)]
    pub fn has_metal(&self, first: usize) -> bool {
        self.is_metal[first..first + WHOLE].iter().fold(0, |any, metal| any | metal) != 0
    }

    /// What light from a lane's sample brings, where the surface scatters `f` of it and finds its direction with the density `pdf`; and whether
    /// it is to be counted.
    #[inline(always)]
    pub fn bring(&self, i: usize, f: SampledSpectrum, pdf: f32) -> (SampledSpectrum, bool) {
        let light = self.throughput.at(i) * f * self.arriving.at(i) * self.light_weight(i, pdf);
        (light, !f.is_black() & !self.arriving.at(i).is_black() & f.is_finite())
    }

    /// Whether a lane's light sample is to be counted. Not comparisons that NaN fails: what is wrong must reach the film, which counts it. No path
    /// that has gone has a light.
    #[inline(always)]
    pub fn counts(&self, i: usize) -> bool {
        (self.brings[i] != 0) & (self.pmf[i] != 0.0) & (self.targets.pdf[i] != 0.0)
    }

    /// A lane's metal.
    #[inline(always)]
    pub fn metal(&self, i: usize) -> Conductor {
        Conductor::new(self.eta.at(i), self.k.at(i), self.facets(i))
    }

    /// Its facets.
    #[inline(always)]
    pub fn facets(&self, i: usize) -> Ggx {
        Ggx::new(self.alphas[0][i], self.alphas[1][i])
    }

    /// Makes a lane's surface scatter so.
    #[inline(always)]
    pub fn set_metal(&mut self, i: usize, metal: Conductor) {
        let [x, y] = metal.facets().alphas();
        let (eta, k) = metal.index();
        self.eta.set(i, eta);
        self.k.set(i, k);
        (self.is_metal[i], self.alphas[0][i], self.alphas[1][i]) = (1, x, y);
        (self.scattering[i], self.seeks[i]) = (Scattering::Metal, 1);
    }

    #[inline(always)]
    pub fn set_diffuse(&mut self, i: usize, reflectance: SampledSpectrum) {
        self.reflectance.set(i, reflectance);
        self.is_metal[i] = 0;
        (self.scattering[i], self.seeks[i]) = (Scattering::Diffuse, u32::from(!reflectance.is_black()));
    }

    pub fn set_alone(&mut self, i: usize, bsdf: Bsdf) {
        self.scattering[i] = Scattering::Alone(self.bsdfs.len() as u32);
        self.is_metal[i] = 0;
        self.seeks[i] = u32::from(bsdf.flags().is_non_specular());
        self.bsdfs.push(bsdf);
        self.bsdf_lanes.push(i as u32);
    }

    /// Nothing is known of the vertices that come next.
    pub fn forget_vertices(&mut self) {
        self.uncommon.clear();
        self.flat_lamps.clear();
        self.lamps_met.clear();
        self.bsdfs.clear();
        self.bsdf_lanes.clear();
        self.any_gone = false;
    }

    /// The path of a lane goes on elsewhere, or has ended.
    pub fn set_gone(&mut self, i: usize) {
        (self.scattering[i], self.seeks[i], self.any_gone) = (Scattering::Gone, 0, true);
        self.is_metal[i] = 0;
    }

    /// All that lights look at.
    pub fn interaction(&self, i: usize) -> Interaction {
        let n: Normal3 = self.at.n.normal(i);
        Interaction {
            p: self.at.p.point(i),
            p_error: self.at.p_error.vector(i),
            n,
            ns: self.at.ns.normal(i),
            wo: self.at.wo.vector(i),
            ..Interaction::unknown(&self.ray(i), 0.0)
        }
    }

    /// How light scatters at a lane's vertex, of whatever kind.
    pub fn bsdf(&self, i: usize) -> Bsdf {
        match self.scattering[i] {
            Scattering::Alone(k) => self.bsdfs[k as usize],
            Scattering::Metal => Bsdf::new(self.at.frame(i), Bxdf::Conductor(self.metal(i))),
            Scattering::Diffuse | Scattering::Gone => {
                Bsdf::new(self.at.frame(i), Bxdf::Diffuse(Diffuse::new(self.reflectance.at(i))))
            }
        }
    }

    /// Draws the numbers of vertices that are known, those for roulette only where it is played.
    pub fn draw(&mut self, n: usize, depth: u32, scene: &Scene, choice: LightChoice, roulette: bool) {
        let (pick, lobe) = (!has_one_light(scene), !self.bsdfs.is_empty());
        let resample = choice.is_resampled;
        scene.geometry.level().run(Numbers { batch: self, n, depth, pick, resample, lobe, roulette });
    }

    /// Draws directions, and the rays that go there.
    pub fn scatter(&mut self, n: usize, scene: &Scene) {
        let level = scene.geometry.level();
        level.run(Scatter(self, n));
        self.next_scale[..n].fill(1.0);
        self.specular[..n].fill(false);
        for k in 0..self.bsdfs.len() {
            let i = self.bsdf_lanes[k] as usize;
            self.goes_on[i] = u32::from(self.scatter_alone(i, k));
        }
        if self.any_gone {
            for i in 0..n {
                self.goes_on[i] = if self.scattering[i] == Scattering::Gone { 0 } else { self.goes_on[i] };
            }
        }
        if let Some((_, sky)) = scene.lights.sky() {
            level.run(PlacesOfBounces(self, n, sky));
        }
    }

    /// Draws the direction of a model of its own. Whether there is one.
    fn scatter_alone(&mut self, i: usize, k: usize) -> bool {
        let (bsdf, wo) = (&self.bsdfs[k], self.at.wo.vector(i));
        let [_, _, lobe, _] = &self.scatter.0;
        let sample = bsdf.sample(wo, lobe[i], self.scatter.uv(i), TransportMode::Radiance, Sides::All);
        let Some(sample) = sample else { return false };
        let (wi, specular) = (sample.wi, sample.lobe.is_specular());
        self.next_weight.set(i, sample.f * (wi.dot(bsdf.frame.z).abs() / sample.pdf));
        self.next_scale[i] = if sample.lobe.is_transmissive() { sample.eta * sample.eta } else { 1.0 };
        self.next_pdf[i] = if sample.pdf_is_proportional && !specular {
            bsdf.pdf(wo, wi, TransportMode::Radiance, Sides::All)
        } else {
            sample.pdf
        };
        self.specular[i] = specular;
        let o = offset_ray_origin(self.at.p.point(i), self.at.p_error.vector(i), self.at.n.normal(i), wi);
        self.next_o.set(i, o.to_array());
        self.next_d.set(i, wi.to_array());
        true
    }

    /// For each path to which a direction was given: by what its throughput and the scale of roulette would be, `carry` says what they are, or
    /// that it ends.
    pub fn carry(
        &mut self,
        n: usize,
        mut carry: impl FnMut(&Self, usize, SampledSpectrum, f32) -> Option<(SampledSpectrum, f32)>,
    ) {
        for i in 0..n {
            if self.goes_on[i] == 0 {
                continue;
            }
            let throughput = self.throughput.at(i) * self.next_weight.at(i);
            match carry(self, i, throughput, self.roulette_scale[i] * self.next_scale[i]) {
                Some((throughput, scale)) => {
                    self.throughput.set(i, throughput);
                    self.roulette_scale[i] = scale;
                }
                None => self.goes_on[i] = 0,
            }
        }
    }

    /// How many paths go on.
    pub fn count_going(&self, n: usize) -> u64 {
        u64::from(self.goes_on[..n].iter().sum::<u32>())
    }

    /// Sends the paths that go on on their ways. How many do, whose rays are known then, but not what these meet.
    pub fn leave(&mut self, mut n: usize, scene: &Scene) -> usize {
        // All at once; few lanes move.
        let SurfaceLanes { p, p_error, n: normal, ns, .. } = &self.at;
        for (previous, here) in self.previous.iter_mut().zip([p, p_error, normal, ns]) {
            previous.copy(n, here);
        }
        self.o.copy(n, &self.next_o);
        self.d.copy(n, &self.next_d);
        self.bsdf_pdf[..n].copy_from_slice(&self.next_pdf[..n]);
        if let Some((_, sky)) = scene.lights.sky() {
            for i in (0..n).filter(|&i| self.goes_on[i] != 0) {
                self.escape_place[i] = Some(self.place(i, sky));
            }
        }
        // From the last one: what takes the place of a path that ends has gone on.
        for i in (0..n).rev() {
            if self.goes_on[i] == 0 {
                n -= 1;
                self.shift(i, n);
            }
        }
        self.rays.take(n, &self.o, &self.d, &self.time, |_| f32::INFINITY);
        n
    }
}
