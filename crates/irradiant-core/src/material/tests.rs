//! Materials through `bsdf()`: parameters reach the models, wavelengths end only where they must, relief bends the normal
//! as calculus says, nothing creates light, and broken input is reported.

use super::*;
use crate::interaction::ShapeId;
use crate::sampler::Sampler;
use irradiant_image::{FileFormat, Image, write};
use irradiant_math::{Normal3, Point2, Point3, Transform, Vec3};
use irradiant_scene::assets::MemoryAssets;
use irradiant_scene::desc::material::{CoatDesc, ConductorDesc};
use irradiant_scene::desc::texture::{BasicTexture, FloatTextureKind, TextureDesc};
use irradiant_scene::desc::{
    ColorSpaceName, FileDesc, FloatParam, FloatTextureRef, MappingDesc, MaterialDesc, MaterialKind, MaterialRef,
    RoughnessDesc, SamplerKind, SceneDesc, SpannedFloat, SpannedSpectrum, SpectrumDesc, SpectrumParam,
};
use irradiant_scene::{Diagnostics, Span, Spanned};
use irradiant_spectrum::{ColorSpace, RgbAlbedo, named};

fn value(v: f32) -> SpannedFloat {
    Spanned::unplaced(FloatParam::Value(v))
}

fn of(s: SpectrumDesc) -> SpannedSpectrum {
    Spanned::unplaced(SpectrumParam::Value(s))
}

fn grey(v: f32) -> SpannedSpectrum {
    of(SpectrumDesc::Constant(v))
}

fn metal(name: &str) -> ConductorDesc {
    let part = |p| of(SpectrumDesc::Named(format!("metal-{name}-{p}")));
    ConductorDesc::Ior { eta: part("eta"), k: part("k") }
}

fn rough(r: f32) -> RoughnessDesc {
    RoughnessDesc { u: value(r), v: value(r), remap: true }
}

fn coat(roughness: f32) -> CoatDesc {
    CoatDesc {
        roughness: rough(roughness),
        thickness: value(0.01),
        eta: grey(1.5),
        g: value(0.0),
        albedo: grey(0.0),
        max_depth: Spanned::unplaced(10),
        n_samples: Spanned::unplaced(1),
    }
}

fn material(kind: MaterialKind) -> MaterialDesc {
    MaterialDesc {
        name: None,
        kind,
        displacement: None,
        normal_map: None,
        color_space: ColorSpaceName::Srgb,
        span: Span::NONE,
    }
}

fn scene(kinds: Vec<MaterialKind>) -> SceneDesc {
    SceneDesc { materials: kinds.into_iter().map(material).collect(), ..SceneDesc::default() }
}

fn compile_with(desc: &SceneDesc, assets: &MemoryAssets) -> (Textures, Materials, Diagnostics) {
    let mut d = Diagnostics::default();
    let space = ColorSpace::srgb();
    let mut textures = Textures::compile(desc, &Transform::IDENTITY, assets, space, &mut d);
    let materials = Materials::compile(desc, &mut textures, assets, space, &mut d);
    (textures, materials, d)
}

fn compile(desc: &SceneDesc) -> (Textures, Materials) {
    let (t, m, d) = compile_with(desc, &MemoryAssets::default());
    assert!(d.is_empty(), "{d:?}");
    (t, m)
}

/// A point of the plane z = 0, with u = x and v = y.
fn flat() -> Interaction {
    let z = Normal3::new(0.0, 0.0, 1.0);
    Interaction {
        p: Point3::new(0.3, 0.6, 0.0),
        p_error: Vec3::ZERO,
        n: z,
        ns: z,
        uv: Point2::new(0.3, 0.6),
        dpdu: Vec3::X,
        dpdv: Vec3::Y,
        dpdus: Vec3::X,
        dpdvs: Vec3::Y,
        dndus: Normal3::new(0.0, 0.0, 0.0),
        dndvs: Normal3::new(0.0, 0.0, 0.0),
        wo: Vec3::new(0.6, 0.0, 0.8),
        t: 1.0,
        time: 0.0,
        material: MaterialId(0),
        light: None,
        shape: ShapeId(0),
        face: 0,
    }
}

fn lambda() -> Wavelengths {
    Wavelengths::sample_visible(0.3)
}

fn bsdf_at(t: &Textures, m: &Materials, id: u32, at: &Interaction, lambda: &mut Wavelengths) -> Option<Bsdf> {
    let sampler = Sampler::new(SamplerKind::Independent, 16, [16, 16], 0);
    let stream = sampler.stream([0, 0], 0);
    m.bsdf(MaterialId(id), t, at, &TextureContext::point(at), lambda, stream.mix(0))
}

fn bsdf(t: &Textures, m: &Materials, id: u32) -> Bsdf {
    bsdf_at(t, m, id, &flat(), &mut lambda()).unwrap()
}

fn codes(d: &Diagnostics) -> Vec<&'static str> {
    d.iter().map(|d| d.code).collect()
}

#[test]
fn parameters_reach_the_models() {
    let rgb = [0.7, 0.2, 0.1];
    let desc = scene(vec![
        MaterialKind::Diffuse { reflectance: of(SpectrumDesc::Rgb(rgb, ColorSpaceName::Srgb)) },
        MaterialKind::Conductor { fresnel: metal("Au"), roughness: rough(0.04) },
        MaterialKind::Conductor {
            fresnel: metal("Au"),
            roughness: RoughnessDesc { u: value(0.3), v: value(0.1), remap: false },
        },
        MaterialKind::Dielectric { eta: grey(1.5), roughness: rough(0.0) },
        MaterialKind::ThinDielectric { eta: grey(0.0) },
        MaterialKind::DiffuseTransmission {
            reflectance: grey(0.5),
            transmittance: grey(0.25),
            scale: Spanned::unplaced(0.8),
        },
        MaterialKind::CoatedDiffuse { reflectance: grey(0.5), coat: coat(0.0) },
        MaterialKind::CoatedConductor { fresnel: metal("Cu"), roughness: rough(0.25), coat: coat(0.01) },
    ]);
    let (t, m, d) = compile_with(&desc, &MemoryAssets::default());
    assert_eq!(codes(&d), ["W0703"]);
    let l = lambda();
    let sample = |name: &str| named(name).unwrap().sample(&l);
    let s = SampledSpectrum::splat;
    let (eta, k) = (sample("metal-Au-eta"), sample("metal-Au-k"));
    let expected = [
        Bxdf::Diffuse(Diffuse::new(RgbAlbedo::new(rgb, ColorSpace::srgb()).sample(&l))),
        Bxdf::Conductor(Conductor::new(eta, k, Ggx::new(0.2, 0.2))),
        Bxdf::Conductor(Conductor::new(eta, k, Ggx::new(0.3, 0.1))),
        Bxdf::Dielectric(Dielectric::new(1.5, Ggx::SMOOTH)),
        Bxdf::ThinDielectric(ThinDielectric::new(1.0)),
        Bxdf::DiffuseTransmission(DiffuseTransmission::new(s(0.4), s(0.2))),
        Bxdf::CoatedDiffuse(CoatedDiffuse::new(
            &Coat::new(1.5, Ggx::SMOOTH, 0.01, CoatWeights::Pbrt),
            s(0.5),
            Filling::NONE,
            WalkLimits::PBRT,
        )),
        Bxdf::CoatedConductor(CoatedConductor::new(
            Dielectric::new(1.5, Ggx::new(0.1, 0.1)),
            0.01,
            CoatWeights::Pbrt,
            sample("metal-Cu-eta"),
            sample("metal-Cu-k"),
            Ggx::new(0.5, 0.5),
            Filling::NONE,
            WalkLimits::PBRT,
        )),
    ];
    for (i, e) in expected.into_iter().enumerate() {
        let b = bsdf(&t, &m, i as u32);
        assert_eq!(b.bxdf, e, "material {i}");
        assert_eq!((b.frame.x, b.frame.z), (Vec3::X, Vec3::Z));
    }
    assert_eq!((m.len(), m.name(MaterialId(1)), m.coat_depth_limit()), (8, "conductor".into(), Some(10)));
    assert!(bsdf_at(&t, &m, 99, &flat(), &mut lambda()).is_none());
}

#[test]
fn a_metal_given_by_its_reflectance_reflects_it_head_on() {
    let desc = scene(vec![
        MaterialKind::Conductor { fresnel: ConductorDesc::Reflectance(grey(0.3)), roughness: rough(0.0) },
        MaterialKind::Conductor { fresnel: ConductorDesc::Reflectance(grey(1.0)), roughness: rough(0.0) },
    ]);
    let (t, m) = compile(&desc);
    for (i, r) in [0.3, 0.9999].into_iter().enumerate() {
        let Bxdf::Conductor(c) = bsdf(&t, &m, i as u32).bxdf else { panic!("not a conductor") };
        assert!((c.fresnel(1.0)[2] - r).abs() < 1e-4, "{:?}", c.fresnel(1.0));
    }
}

#[test]
fn only_varying_indices_end_wavelengths() {
    let glass = || of(SpectrumDesc::Named("glass-BK7".into()));
    let even = of(SpectrumDesc::Samples([(300.0, 1.4), (900.0, 1.4)].as_slice().into()));
    let dispersive_coat = CoatDesc { eta: glass(), ..coat(0.0) };
    let cases = [
        (MaterialKind::Dielectric { eta: grey(1.5), roughness: rough(0.0) }, false),
        (MaterialKind::Dielectric { eta: even, roughness: rough(0.0) }, false),
        (MaterialKind::Dielectric { eta: glass(), roughness: rough(0.1) }, true),
        (MaterialKind::ThinDielectric { eta: glass() }, true),
        (MaterialKind::CoatedDiffuse { reflectance: grey(0.5), coat: dispersive_coat.clone() }, true),
        (MaterialKind::CoatedDiffuse { reflectance: grey(0.5), coat: coat(0.0) }, false),
        (MaterialKind::CoatedConductor { fresnel: metal("Cu"), roughness: rough(0.0), coat: dispersive_coat }, true),
        (MaterialKind::Conductor { fresnel: metal("Cu"), roughness: rough(0.0) }, false),
    ];
    let desc = scene(cases.iter().map(|(k, _)| k.clone()).collect());
    let (t, m) = compile(&desc);
    for (i, (kind, ends)) in cases.iter().enumerate() {
        let mut l = lambda();
        bsdf_at(&t, &m, i as u32, &flat(), &mut l).unwrap();
        assert_eq!(l.secondary_terminated(), *ends, "{kind:?}");
    }
    // The path goes on with its first wavelength's index.
    let mut l = lambda();
    let Some(Bsdf { bxdf: Bxdf::Dielectric(d), .. }) = bsdf_at(&t, &m, 2, &flat(), &mut l) else { panic!() };
    assert_eq!(d.eta(), named("glass-BK7").unwrap().sample(&lambda())[0]);
    // In RGB it is green's, for all.
    let mut rgb = Wavelengths::rgb();
    let Some(Bsdf { bxdf: Bxdf::Dielectric(d), .. }) = bsdf_at(&t, &m, 2, &flat(), &mut rgb) else { panic!() };
    assert!(!rgb.secondary_terminated() && (d.eta() - 1.5185).abs() < 0.01, "{}", d.eta());
}

#[test]
fn mixes_are_drawn_in_proportion() {
    let mix = |a, b, amount| MaterialKind::Mix { materials: [MaterialRef(a), MaterialRef(b)], amount: value(amount) };
    let desc = scene(vec![
        MaterialKind::Diffuse { reflectance: grey(0.25) },
        MaterialKind::Diffuse { reflectance: grey(0.5) },
        mix(0, 1, 0.3),
        mix(0, 1, 0.0),
        mix(0, 1, 1.0),
        MaterialKind::Interface,
        mix(5, 2, 0.5),
    ]);
    let (t, m) = compile(&desc);
    let sampler = Sampler::new(SamplerKind::Independent, 20_000, [16, 16], 3);
    let draw = |id, i| {
        let stream = sampler.stream([3, 4], i);
        let at = flat();
        let b = m.bsdf(MaterialId(id), &t, &at, &TextureContext::point(&at), &mut lambda(), stream.mix(0));
        b.map(|b| match b.bxdf {
            Bxdf::Diffuse(d) => d.reflectance[0],
            other => panic!("{other:?}"),
        })
    };
    let n = 20_000;
    let count = |id, wanted: Option<f32>| (0..n).filter(|i| draw(id, *i) == wanted).count() as f64 / f64::from(n);
    // Standard errors are 0.0035: a share wrong by 0.02 fails, a right one with odds below 1e-6.
    assert!((count(2, Some(0.5)) - 0.3).abs() < 0.018);
    assert_eq!((count(3, Some(0.25)), count(4, Some(0.5)), count(5, None)), (1.0, 1.0, 1.0));
    // Levels draw independently.
    assert!((count(6, None) - 0.5).abs() < 0.018);
    assert!((count(6, Some(0.5)) - 0.15).abs() < 0.018);
}

/// h = 0.2 u (1 - v) + 0.5 (1 - u) v + 0.1 u v
fn ramp() -> TextureDesc<FloatTextureKind> {
    TextureDesc {
        name: "h".into(),
        kind: FloatTextureKind::Basic(BasicTexture::Bilerp {
            v00: value(0.0),
            v10: value(0.2),
            v01: value(0.5),
            v11: value(0.1),
            mapping: MappingDesc::default(),
        }),
        world_from_texture: Transform::IDENTITY,
        span: Span::NONE,
    }
}

#[test]
fn bumps_bend_the_normal_as_the_height_field_does() {
    let mut desc = scene(vec![MaterialKind::Diffuse { reflectance: grey(0.5) }]);
    desc.float_textures.push(ramp());
    desc.materials[0].displacement = Some(Spanned::unplaced(FloatParam::Texture(FloatTextureRef(0))));
    let (t, m) = compile(&desc);
    assert!(t.needs_footprint(), "the step of a bump map is half a pixel");
    let (u, v) = (0.3f32, 0.6f32);
    let (hu, hv) = (0.2 * (1.0 - v) - 0.5 * v + 0.1 * v, -0.2 * u + 0.5 * (1.0 - u) + 0.1 * u);
    let expected = Vec3::new(-hu, -hv, 1.0).normalize();
    for step in [0.0, 0.01] {
        for side in [1.0, -1.0] {
            let mut at = flat();
            at.n = at.n * side;
            let tex = TextureContext { dudx: step, dvdy: -step, ..TextureContext::point(&at) };
            let sampler = Sampler::new(SamplerKind::Independent, 16, [16, 16], 0);
            let stream = sampler.stream([0, 0], 0);
            let b = m.bsdf(MaterialId(0), &t, &at, &tex, &mut lambda(), stream.mix(0)).unwrap();
            assert!((b.frame.z - expected * side).length() < 2e-3, "{:?} {expected:?}", b.frame.z);
            assert!(b.frame.x.dot(b.frame.z).abs() < 1e-6 && b.frame.x.x > 0.5);
        }
    }
    // A raised sphere is a sphere: the height alone leaves the normal be.
    desc.materials[0].displacement = Some(value(0.2));
    let (t, m) = compile(&desc);
    let mut at = flat();
    (at.dndus, at.dndvs) = (Normal3::new(1.0, 0.0, 0.0), Normal3::new(0.0, 1.0, 0.0));
    assert!((bsdf_at(&t, &m, 0, &at, &mut lambda()).unwrap().frame.z - Vec3::Z).length() < 1e-6);
}

#[test]
fn normal_maps_turn_the_normal_in_its_frame() {
    let n = Vec3::new(0.3, -0.2, 0.9).normalize();
    // Bent at the left; at the right bent the other way in the upper half of the picture, which v near 1 shows.
    let image = Image::from_fn(2, 4, ["R", "G", "B"], |x, y| {
        let n = match (x, y) {
            (0, _) => n,
            (_, 0) => Vec3::new(-n.x, -n.y, n.z),
            _ => Vec3::Z,
        };
        [n.x, n.y, n.z].map(|c| 0.5 * c + 0.5)
    });
    let assets = MemoryAssets::default().with("n.exr", write(&image, FileFormat::Exr).unwrap());
    let mut desc = scene(vec![MaterialKind::Diffuse { reflectance: grey(0.5) }]);
    desc.materials[0].normal_map = Some(Spanned::unplaced(FileDesc { name: "n.exr".into(), path: "n.exr".into() }));
    let (t, m, d) = compile_with(&desc, &assets);
    assert!(d.is_empty(), "{d:?}");
    let mut at = flat();
    // A tangent frame that is not the axes'.
    (at.dpdus, at.dpdvs) = (Vec3::Y * 3.0, -Vec3::X);
    for (u, expected) in [(0.25, Vec3::new(-n.y, n.x, n.z)), (0.75, Vec3::Z), (1.25, Vec3::new(-n.y, n.x, n.z))] {
        at.uv = Point2::new(u, 0.4);
        let frame = bsdf_at(&t, &m, 0, &at, &mut lambda()).unwrap().frame;
        assert!((frame.z - expected).length() < 1e-5, "{:?} {expected:?}", frame.z);
    }
    at.uv = Point2::new(0.75, 0.875);
    let frame = bsdf_at(&t, &m, 0, &at, &mut lambda()).unwrap().frame;
    assert!((frame.z - Vec3::new(n.y, -n.x, n.z)).length() < 1e-5, "{:?}", frame.z);
    // Half way, the mean of the two, before it is scaled.
    at.uv = Point2::new(0.5, 0.4);
    let mean = (Vec3::new(-n.y, n.x, n.z) + Vec3::Z).normalize();
    assert!((bsdf_at(&t, &m, 0, &at, &mut lambda()).unwrap().frame.z - mean).length() < 1e-5);
    let (_, _, d) = compile_with(&desc, &MemoryAssets::default());
    assert_eq!(codes(&d), ["E0601"]);
}

/// Every kind, with the strongest reflectances allowed.
fn all_kinds() -> Vec<MaterialKind> {
    let fog = CoatDesc { albedo: grey(0.9), g: value(0.5), thickness: value(0.5), ..coat(0.1) };
    vec![
        MaterialKind::Diffuse { reflectance: grey(1.0) },
        MaterialKind::DiffuseTransmission {
            reflectance: grey(0.5),
            transmittance: grey(0.5),
            scale: Spanned::unplaced(1.0),
        },
        MaterialKind::Conductor { fresnel: metal("Ag"), roughness: rough(0.2) },
        MaterialKind::Dielectric { eta: grey(1.5), roughness: rough(0.1) },
        MaterialKind::Dielectric { eta: of(SpectrumDesc::Named("glass-SF11".into())), roughness: rough(0.0) },
        MaterialKind::ThinDielectric { eta: grey(1.5) },
        MaterialKind::CoatedDiffuse { reflectance: grey(1.0), coat: coat(0.3) },
        MaterialKind::CoatedDiffuse { reflectance: grey(1.0), coat: fog.clone() },
        MaterialKind::CoatedConductor {
            fresnel: ConductorDesc::Reflectance(grey(1.0)),
            roughness: rough(0.1),
            coat: fog,
        },
        MaterialKind::Subsurface { mean_albedo: grey(0.8), eta: Spanned::unplaced(1.33), roughness: rough(0.0) },
        MaterialKind::Hair { mean_albedo: grey(0.3) },
        MaterialKind::Measured { file: Spanned::unplaced(FileDesc { name: "b".into(), path: "b".into() }) },
        MaterialKind::Retroreflective { reflectance: grey(0.6), base: grey(1.0), roughness: rough(0.1) },
        MaterialKind::GlossyPaint { reflectance: grey(1.0), eta: grey(1.5), roughness: rough(0.1) },
        MaterialKind::ThinFilmPaint {
            thickness: value(450.0),
            film_eta: grey(1.9),
            fresnel: metal("Al"),
            roughness: rough(0.1),
        },
    ]
}

// Estimates from 4000 samples have standard errors below 0.01 (bounded weights): 0.05 more than 1 fails.
#[test]
fn nothing_creates_light() {
    let (t, m) = compile(&scene(all_kinds()));
    for i in 0..m.len() as u32 {
        for wo in [Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.1, 0.97, 0.2).normalize()] {
            let at = Interaction { wo, ..flat() };
            let b = bsdf_at(&t, &m, i, &at, &mut lambda()).unwrap();
            let albedo = b.rho_hd(wo, 4000);
            assert!(albedo.max_component() < 1.05 && albedo.max_component() > 0.2, "material {i}: {albedo:?}");
        }
    }
}

#[test]
fn stand_ins_are_diffuse() {
    let kinds = all_kinds();
    let (t, m) = compile(&scene(kinds.clone()));
    for (i, kind) in kinds.iter().enumerate() {
        let albedo = match kind {
            MaterialKind::Subsurface { .. } => 0.8,
            MaterialKind::Hair { .. } => 0.3,
            MaterialKind::Measured { .. } => 0.5,
            _ => continue,
        };
        assert_eq!(bsdf(&t, &m, i as u32).bxdf, Bxdf::Diffuse(Diffuse::new(SampledSpectrum::splat(albedo))));
    }
}

#[test]
fn all_can_be_forced_diffuse() {
    let mut desc = scene(all_kinds());
    desc.options.force_diffuse = true;
    let (t, m) = compile(&desc);
    for i in 0..m.len() as u32 {
        let Bxdf::Diffuse(d) = bsdf(&t, &m, i).bxdf else { panic!("material {i} is not diffuse") };
        assert!(d.reflectance.max_component() <= 1.0 && d.reflectance.max_component() > 0.1);
    }
}

#[test]
fn a_varying_roughness_reaches_coats_and_paints() {
    let textured = RoughnessDesc {
        u: Spanned::unplaced(FloatParam::Texture(FloatTextureRef(0))),
        v: Spanned::unplaced(FloatParam::Texture(FloatTextureRef(0))),
        remap: true,
    };
    let mut desc = scene(vec![
        MaterialKind::CoatedDiffuse {
            reflectance: grey(0.5),
            coat: CoatDesc { roughness: textured.clone(), ..coat(0.0) },
        },
        MaterialKind::GlossyPaint { reflectance: grey(0.5), eta: grey(1.5), roughness: textured.clone() },
        MaterialKind::Conductor { fresnel: metal("Au"), roughness: textured },
    ]);
    desc.float_textures.push(ramp());
    let (t, m) = compile(&desc);
    let h: f32 = 0.2 * 0.3 * 0.4 + 0.5 * 0.7 * 0.6 + 0.1 * 0.3 * 0.6;
    let Bxdf::Conductor(c) = bsdf(&t, &m, 2).bxdf else { panic!() };
    let l = lambda();
    let sample = |name: &str| named(name).unwrap().sample(&l);
    let facets = Ggx::new(h.sqrt(), h.sqrt());
    assert_eq!(c, Conductor::new(sample("metal-Au-eta"), sample("metal-Au-k"), facets));
    // The paint's coat is the nearest of 17: alpha 0.5.
    let paint = GlossyPaint::new(&Coat::lossless(1.5, 0.5), SampledSpectrum::splat(0.5));
    assert_eq!(bsdf(&t, &m, 1).bxdf, Bxdf::GlossyPaint(paint));
    let walked = Coat::walked(1.5, facets, 0.01, CoatWeights::Pbrt);
    let expected = CoatedDiffuse::new(&walked, SampledSpectrum::splat(0.5), Filling::NONE, WalkLimits::PBRT);
    assert_eq!(bsdf(&t, &m, 0).bxdf, Bxdf::CoatedDiffuse(expected));
}

#[test]
fn impossible_parameters_are_reported() {
    let dielectric = |eta, r| MaterialKind::Dielectric { eta: grey(eta), roughness: rough(r) };
    let coated = |coat| MaterialKind::CoatedDiffuse { reflectance: grey(0.5), coat };
    let depth = |n| CoatDesc { max_depth: Spanned::unplaced(n), ..coat(0.0) };
    let mix = |a, amount| MaterialKind::Mix { materials: [MaterialRef(a), MaterialRef(a)], amount: value(amount) };
    let transmission = |r, scale| MaterialKind::DiffuseTransmission {
        reflectance: grey(r),
        transmittance: grey(0.5),
        scale: Spanned::unplaced(scale),
    };
    let film = |d, n| MaterialKind::ThinFilmPaint {
        thickness: value(d),
        film_eta: grey(n),
        fresnel: metal("Al"),
        roughness: rough(0.1),
    };
    let cases: Vec<(MaterialKind, &[&str])> = vec![
        (MaterialKind::Diffuse { reflectance: grey(1.5) }, &["E0701"]),
        (MaterialKind::Diffuse { reflectance: grey(-0.5) }, &["E0605"]),
        (dielectric(1.5, -0.1), &["E0702", "E0702"]),
        (dielectric(1.5, f32::NAN), &["E0702", "E0702"]),
        (dielectric(-1.5, 0.0), &["E0605"]),
        (coated(CoatDesc { thickness: value(-1.0), ..coat(0.0) }), &["E0704"]),
        (coated(CoatDesc { g: value(1.0), ..coat(0.0) }), &["E0705"]),
        (coated(depth(-1)), &["E0706"]),
        (coated(depth(70_000)), &["E0706"]),
        (coated(CoatDesc { n_samples: Spanned::unplaced(0), ..coat(0.0) }), &["E0706"]),
        (transmission(0.5, -1.0), &["E0707"]),
        (transmission(0.7, 1.0), &["W0707"]),
        (mix(0, 0.5), &["E0708"]),
        (mix(7, 0.5), &["E0708"]),
        (film(-1.0, 1.5), &["E0704"]),
        (film(500.0, 0.0), &["E0703"]),
    ];
    for (kind, expected) in cases {
        let text = format!("{kind:?}");
        let (t, m, d) = compile_with(&scene(vec![kind]), &MemoryAssets::default());
        assert_eq!(codes(&d), expected, "{text}");
        // What was reported still answers.
        let _ = bsdf_at(&t, &m, 0, &flat(), &mut lambda());
    }
    // Unlimited depth is not a limit.
    let (_, m) = compile(&scene(vec![coated(depth(0)), coated(depth(30)), coated(depth(20))]));
    assert_eq!(m.coat_depth_limit(), Some(20));
    let (_, m) = compile(&scene(vec![coated(depth(0))]));
    assert_eq!(m.coat_depth_limit(), None);
}

#[test]
fn coats_are_weighed_as_pbrt_does_only_where_the_author_limits_their_depth() {
    let diffuse = |roughness, depth| MaterialKind::CoatedDiffuse {
        reflectance: grey(0.5),
        coat: CoatDesc { max_depth: Spanned::unplaced(depth), ..coat(roughness) },
    };
    let conductor = |roughness, base, depth| MaterialKind::CoatedConductor {
        fresnel: metal("Al"),
        roughness: rough(base),
        coat: CoatDesc { max_depth: Spanned::unplaced(depth), ..coat(roughness) },
    };
    let cases = [
        (diffuse(0.0, 10), false),
        (diffuse(0.2, 10), true),
        (diffuse(0.2, 0), false),
        (conductor(0.2, 0.1, 10), true),
        (conductor(0.2, 0.0, 10), false),
        (conductor(0.0, 0.1, 10), false),
        (conductor(0.2, 0.1, 0), false),
    ];
    for (kind, expected) in cases {
        let text = format!("{kind:?}");
        assert_eq!(compile(&scene(vec![kind])).1.uses_pbrt_coat_weights(), expected, "{text}");
    }
    // One coat of either kind, though all else is equal.
    let (t, m) = compile(&scene(vec![diffuse(0.2, 10), diffuse(0.2, 0)]));
    let value = |id| {
        let bsdf = bsdf_at(&t, &m, id, &flat(), &mut lambda()).unwrap();
        bsdf.f(Vec3::Z, Vec3::new(0.6, 0.0, 0.8), crate::bxdf::TransportMode::Radiance)[0]
    };
    assert!(m.uses_pbrt_coat_weights() && value(0) != value(1));
}
