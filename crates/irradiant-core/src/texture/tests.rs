//! Textures from the description to the value at a hit: against formulas, against pixels, and with broken input.

use super::*;
use irradiant_image::{Chromaticities, Encoding, FileFormat, Image, write};
use irradiant_math::{Normal3, Point2, Point3};
use irradiant_scene::assets::MemoryAssets;
use irradiant_scene::desc::texture::{
    BasicTexture, EncodingDesc, FloatTextureKind, ImageFilter, ImageMapDesc, ImageWrap, SpectrumTextureKind,
    TextureDesc,
};
use irradiant_scene::desc::{
    ColorSpaceName, FileDesc, MappingDesc, SceneDesc, SpannedFloat, SpannedSpectrum, SpectrumDesc, SpectrumParam,
    SpectrumTextureRef,
};
use irradiant_scene::{Diagnostics, Span, Spanned};
use irradiant_spectrum::{RgbAlbedo, RgbUnbounded};

fn lambda() -> Wavelengths {
    Wavelengths::sample_visible(0.3)
}

fn at(u: f32, v: f32) -> TextureContext {
    TextureContext {
        p: Point3::new(u, v, 0.25),
        n: Normal3::new(0.0, 0.6, 0.8),
        uv: Point2::new(u, v),
        dpdx: Vec3::ZERO,
        dpdy: Vec3::ZERO,
        dudx: 0.0,
        dudy: 0.0,
        dvdx: 0.0,
        dvdy: 0.0,
        face: 0,
    }
}

fn value(v: f32) -> SpannedFloat {
    Spanned::unplaced(FloatParam::Value(v))
}

fn float_ref(i: u32) -> SpannedFloat {
    Spanned::unplaced(FloatParam::Texture(FloatTextureRef(i)))
}

fn grey(v: f32) -> SpannedSpectrum {
    Spanned::unplaced(SpectrumParam::Value(SpectrumDesc::Constant(v)))
}

fn spectrum_ref(i: u32) -> SpannedSpectrum {
    Spanned::unplaced(SpectrumParam::Texture(SpectrumTextureRef(i)))
}

fn texture<K>(kind: K) -> TextureDesc<K> {
    TextureDesc { name: "t".into(), kind, world_from_texture: Transform::IDENTITY, span: Span::NONE }
}

fn image_map(name: &str, filter: ImageFilter) -> ImageMapDesc {
    ImageMapDesc {
        file: Spanned::unplaced(FileDesc { name: name.into(), path: name.into() }),
        filter,
        max_anisotropy: 8.0,
        wrap: ImageWrap::Repeat,
        encoding: EncodingDesc::Default,
        scale: 1.0,
        invert: false,
        mapping: MappingDesc::default(),
        color_space: ColorSpaceName::Srgb,
    }
}

fn floats(kinds: Vec<FloatTextureKind>) -> SceneDesc {
    SceneDesc { float_textures: kinds.into_iter().map(texture).collect(), ..SceneDesc::default() }
}

fn basics(kinds: Vec<BasicTexture<SpannedFloat>>) -> SceneDesc {
    floats(kinds.into_iter().map(FloatTextureKind::Basic).collect())
}

fn compile_with(desc: &SceneDesc, assets: &MemoryAssets) -> (Textures, Diagnostics) {
    let mut diagnostics = Diagnostics::default();
    let textures = Textures::compile(desc, &Transform::IDENTITY, assets, ColorSpace::srgb(), &mut diagnostics);
    (textures, diagnostics)
}

fn compile(desc: &SceneDesc) -> Textures {
    let (textures, diagnostics) = compile_with(desc, &MemoryAssets::default());
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    textures
}

fn spectrum(textures: &mut Textures, desc: &SceneDesc, i: u32, role: Role) -> SpectrumValue {
    let mut diagnostics = Diagnostics::default();
    let value = textures.spectrum_value(desc, &spectrum_ref(i), role, "it", &mut diagnostics);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    value
}

fn codes(diagnostics: &Diagnostics) -> Vec<&'static str> {
    diagnostics.iter().map(|d| d.code).collect()
}

/// Codes 0, 40, 80, 120 in the upper row, 200, 210, 220, 255 in the lower one.
const PIXELS: [u8; 8] = [0, 40, 80, 120, 200, 210, 220, 255];

fn grey_png() -> MemoryAssets {
    let image = Image::from_u8(4, 2, &["Y"], PIXELS.to_vec(), Encoding::Srgb).unwrap();
    MemoryAssets::default().with("grey.png", write(&image, FileFormat::Png).unwrap())
}

fn colour_png() -> MemoryAssets {
    let codes: Vec<u8> = (0..16 * 3).map(|i| (i * 37 % 256) as u8).collect();
    let image = Image::from_u8(4, 4, &["R", "G", "B"], codes, Encoding::Srgb).unwrap();
    MemoryAssets::default().with("c.png", write(&image, FileFormat::Png).unwrap())
}

#[test]
fn numbers_combine_by_their_formulas() {
    let ramp = BasicTexture::Bilerp {
        v00: value(0.1),
        v01: value(0.9),
        v10: value(0.4),
        v11: value(0.3),
        mapping: MappingDesc::default(),
    };
    let desc = basics(vec![
        ramp,
        BasicTexture::Scale { tex: float_ref(0), scale: value(3.0) },
        BasicTexture::Mix { tex1: float_ref(0), tex2: value(2.0), amount: float_ref(0) },
        BasicTexture::DirectionMix { tex1: value(5.0), tex2: float_ref(0), dir: [0.0, 0.0, 1.0] },
        BasicTexture::Checkerboard {
            tex1: value(7.0),
            tex2: float_ref(0),
            dimension: 2,
            mapping: MappingDesc::default(),
        },
        BasicTexture::Checkerboard {
            tex1: value(7.0),
            tex2: value(8.0),
            dimension: 3,
            mapping: MappingDesc::default(),
        },
        BasicTexture::Dots { inside: value(1.0), outside: value(0.0), mapping: MappingDesc::default() },
        BasicTexture::Scale { tex: value(2.0), scale: float_ref(0) },
    ]);
    let t = compile(&desc);
    for (u, v) in [(0.2f32, 0.7f32), (0.9, 0.1), (1.4, 0.3), (-0.3, 2.2)] {
        let r = (1.0 - u) * (1.0 - v) * 0.1 + u * (1.0 - v) * 0.4 + (1.0 - u) * v * 0.9 + u * v * 0.3;
        let odd = (u.floor() + v.floor()) as i32 & 1 != 0;
        let dot = f32::from(u8::from(procedural::in_polka_dot(u, v)));
        let expected = [
            r,
            3.0 * r,
            (1.0 - r) * r + r * 2.0,
            0.8 * 5.0 + 0.2 * r,
            if odd { r } else { 7.0 },
            if odd { 8.0 } else { 7.0 },
            dot,
            2.0 * r,
        ];
        for (i, e) in expected.into_iter().enumerate() {
            let got = t.float(t.float_value(FloatTextureRef(i as u32)), &at(u, v));
            assert!((got - e).abs() < 1e-5, "texture {i} at {u} {v}: {got}, expected {e}");
        }
    }
}

#[test]
fn spectra_combine_by_their_formulas() {
    let red = [0.7, 0.2, 0.1];
    let colour = Spanned::unplaced(SpectrumParam::Value(SpectrumDesc::Rgb(red, ColorSpaceName::Srgb)));
    let ramp = BasicTexture::Bilerp {
        v00: grey(0.0),
        v01: grey(0.0),
        v10: grey(1.0),
        v11: grey(1.0),
        mapping: MappingDesc::default(),
    };
    let kinds = [
        ramp,
        BasicTexture::Mix { tex1: colour.clone(), tex2: spectrum_ref(0), amount: value(0.25) },
        BasicTexture::Scale { tex: colour.clone(), scale: value(0.5) },
        BasicTexture::Constant(colour),
    ];
    let desc = SceneDesc {
        spectrum_textures: kinds.map(|k| texture(SpectrumTextureKind::Basic(k))).into(),
        ..SceneDesc::default()
    };
    let mut t = compile(&desc);
    let ids: Vec<_> = (0..4).map(|i| spectrum(&mut t, &desc, i, Role::Reflectance)).collect();
    let albedo = RgbAlbedo::new(red, ColorSpace::srgb()).sample(&lambda());
    for u in [0.1, 0.6] {
        let expected = [SampledSpectrum::splat(u), albedo * 0.75 + u * 0.25, albedo * 0.5, albedo];
        for (i, e) in expected.into_iter().enumerate() {
            let got = t.spectrum(ids[i], &at(u, 0.3), &lambda());
            for lane in 0..4 {
                assert!((got[lane] - e[lane]).abs() < 1e-5, "texture {i}: {got:?} {e:?}");
            }
        }
    }
    assert!(matches!(ids[2], SpectrumValue::Constant(_)) && matches!(ids[3], SpectrumValue::Constant(_)));
}

#[test]
fn constants_are_folded() {
    let desc = basics(vec![
        BasicTexture::Constant(value(0.5)),
        BasicTexture::Scale { tex: float_ref(0), scale: value(3.0) },
        BasicTexture::Mix { tex1: float_ref(1), tex2: value(0.5), amount: value(0.5) },
    ]);
    let t = compile(&desc);
    assert_eq!(t.float_value(FloatTextureRef(1)), FloatValue::Constant(1.5));
    assert_eq!(t.constant_float(FloatTextureRef(2)), Some(1.0));
    assert!(!t.needs_footprint() && t.counts() == (3, 0, 0));
}

// Point lookups are the pixels, bilinear ones their weighted means, with (0, 0) at the lower left.
#[test]
fn images_are_their_pixels() {
    let mut darker = image_map("grey.png", ImageFilter::Point);
    (darker.scale, darker.invert) = (0.5, true);
    let desc = basics(vec![
        BasicTexture::ImageMap(image_map("grey.png", ImageFilter::Point)),
        BasicTexture::ImageMap(image_map("grey.png", ImageFilter::Bilinear)),
        BasicTexture::ImageMap(darker),
        BasicTexture::Scale { tex: float_ref(2), scale: value(3.0) },
    ]);
    let (t, diagnostics) = compile_with(&desc, &grey_png());
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    assert_eq!(t.counts().1, 2, "textures that differ by scale share their image");
    assert!(t.needs_footprint());
    let pixel = |x: usize, y: usize| Encoding::Srgb.decode_u8(PIXELS[y * 4 + x]);
    let get = |i, u, v| t.float(t.float_value(FloatTextureRef(i)), &at(u, v));
    for x in 0..4 {
        for y in 0..2 {
            let (u, v) = ((x as f32 + 0.5) / 4.0, 1.0 - (y as f32 + 0.5) / 2.0);
            for period in [0.0, 1.0, -3.0] {
                let p = pixel(x, y);
                assert!((get(0, u + period, v) - p).abs() < 1e-6);
                assert!((get(1, u, v + period) - p).abs() < 1e-5);
                assert!((get(2, u, v) - (1.0 - 0.5 * p)).abs() < 1e-6);
                // The factor goes to the image before it is inverted, as in pbrt-v4.
                assert!((get(3, u, v) - (1.0 - 1.5 * p).max(0.0)).abs() < 1e-6);
            }
        }
    }
    let (a, b, c, d) = (pixel(1, 0), pixel(2, 0), pixel(1, 1), pixel(2, 1));
    let expected = 0.75 * (0.4 * a + 0.6 * b) + 0.25 * (0.4 * c + 0.6 * d);
    assert!((get(1, (1.5 + 0.6) / 4.0, 1.0 - (0.5 + 0.25) / 2.0) - expected).abs() < 1e-5);
    assert_eq!(get(1, f32::NAN, f32::INFINITY), get(1, 0.0, 1.0));
}

#[test]
fn encodings_are_honoured() {
    let with =
        |encoding| BasicTexture::ImageMap(ImageMapDesc { encoding, ..image_map("grey.png", ImageFilter::Point) });
    let desc = basics(vec![with(EncodingDesc::Linear), with(EncodingDesc::Srgb), with(EncodingDesc::Gamma(2.0))]);
    let (t, diagnostics) = compile_with(&desc, &grey_png());
    assert!(diagnostics.is_empty() && t.counts().1 == 3);
    let code = f32::from(PIXELS[3]) / 255.0;
    let expected = [code, irradiant_image::encoding::linear_from_srgb(code), code * code];
    for (i, e) in expected.into_iter().enumerate() {
        let got = t.float(t.float_value(FloatTextureRef(i as u32)), &at(0.9, 0.9));
        assert!((got - e).abs() < 1e-6, "{i}: {got} {e}");
    }
}

#[test]
fn colours_of_images_become_spectra_by_their_role() {
    let mut bright = image_map("c.png", ImageFilter::Point);
    bright.scale = 4.0;
    // The second is the same by a texture that scales a half as bright one: before it is clamped, as in pbrt-v4.
    let half = ImageMapDesc { scale: 2.0, ..bright.clone() };
    let kinds = [
        BasicTexture::ImageMap(bright),
        BasicTexture::Scale { tex: spectrum_ref(2), scale: value(2.0) },
        BasicTexture::ImageMap(half),
    ];
    let desc = SceneDesc {
        spectrum_textures: kinds.map(|k| texture(SpectrumTextureKind::Basic(k))).into(),
        ..SceneDesc::default()
    };
    let (mut t, diagnostics) = compile_with(&desc, &colour_png());
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    let rgb: [f32; 3] = std::array::from_fn(|c| 4.0 * Encoding::Srgb.decode_u8(((3 + c) * 37 % 256) as u8));
    let here = at(0.375, 0.9);
    let srgb = ColorSpace::srgb();
    for (role, expected) in [
        (Role::Reflectance, RgbAlbedo::new(rgb, srgb).sample(&lambda())),
        (Role::Unbounded, RgbUnbounded::new(rgb, srgb).sample(&lambda())),
    ] {
        let id = spectrum(&mut t, &desc, 0, role);
        let got = t.spectrum(id, &here, &lambda());
        assert!((0..4).all(|i| (got[i] - expected[i]).abs() < 1e-4), "{role:?}: {got:?} {expected:?}");
        let scaled = spectrum(&mut t, &desc, 1, role);
        assert_eq!(t.spectrum(scaled, &here, &lambda()), got);
        let lanes = t.spectrum(id, &here, &Wavelengths::rgb());
        let most = if role == Role::Reflectance { 1.0 } else { 4.0 };
        assert!((0..3).all(|i| (lanes[i] - rgb[i].min(most)).abs() < 1e-5), "{lanes:?} {rgb:?}");
    }
    assert!(rgb.iter().any(|v| *v > 1.0), "the test needs a colour beyond 1");
    assert_eq!(spectrum(&mut t, &desc, 0, Role::Reflectance), spectrum(&mut t, &desc, 0, Role::Reflectance));
}

#[test]
fn the_images_own_colour_space_is_taken() {
    let mut image = Image::from_fn(2, 2, ["R", "G", "B"], |_, _| [0.2, 0.6, 0.3]);
    image.metadata.chromaticities = Some(Chromaticities {
        red: [0.708, 0.292],
        green: [0.170, 0.797],
        blue: [0.131, 0.046],
        white: [0.3127, 0.3290],
    });
    let assets = MemoryAssets::default().with("wide.exr", write(&image, FileFormat::Exr).unwrap());
    let map = BasicTexture::ImageMap(image_map("wide.exr", ImageFilter::Bilinear));
    let desc = SceneDesc { spectrum_textures: vec![texture(SpectrumTextureKind::Basic(map))], ..SceneDesc::default() };
    let (mut t, diagnostics) = compile_with(&desc, &assets);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    let id = spectrum(&mut t, &desc, 0, Role::Reflectance);
    let rec2020 = ColorSpace::rec2020();
    let expected = RgbAlbedo::new([0.2, 0.6, 0.3], rec2020).sample(&lambda());
    let got = t.spectrum(id, &at(0.4, 0.6), &lambda());
    assert!((0..4).all(|i| (got[i] - expected[i]).abs() < 1e-3), "{got:?} {expected:?}");
    // A render in sRGB sees it in sRGB.
    let srgb = ColorSpace::srgb().from_xyz(rec2020.to_xyz([0.2, 0.6, 0.3]));
    let lanes = t.spectrum(id, &at(0.4, 0.6), &Wavelengths::rgb());
    assert!((0..3).all(|i| (lanes[i] - srgb[i].max(0.0)).abs() < 1e-3), "{lanes:?} {srgb:?}");
}

#[test]
fn footprints_blur_unless_switched_off() {
    let board = || BasicTexture::Checkerboard {
        tex1: value(0.0),
        tex2: value(1.0),
        dimension: 2,
        mapping: MappingDesc::default(),
    };
    let image = || BasicTexture::ImageMap(image_map("grey.png", ImageFilter::Trilinear));
    let mut desc = basics(vec![board(), image()]);
    let wide = TextureContext { dudx: 40.0, dvdy: 40.0, ..at(0.9, 0.9) };
    let (t, _) = compile_with(&desc, &grey_png());
    let mean = t.mean_float(t.float_value(FloatTextureRef(1)));
    let direct: f32 = PIXELS.map(|p| Encoding::Srgb.decode_u8(p)).iter().sum::<f32>() / 8.0;
    assert!((mean - direct).abs() < 0.01, "{mean} {direct}: levels are rounded to 8 bits");
    let get = |t: &Textures, i, c: &TextureContext| t.float(t.float_value(FloatTextureRef(i)), c);
    assert!((get(&t, 0, &wide) - 0.5).abs() < 1e-3 && (get(&t, 1, &wide) - mean).abs() < 1e-6);
    desc.options.disable_texture_filtering = true;
    let (t, _) = compile_with(&desc, &grey_png());
    assert!(!t.needs_footprint());
    assert_eq!((get(&t, 0, &wide), get(&t, 1, &wide)), (get(&t, 0, &at(0.9, 0.9)), get(&t, 1, &at(0.9, 0.9))));
    assert_eq!(get(&t, 0, &wide), 0.0);
}

#[test]
fn means_of_combinations() {
    let ramp = || BasicTexture::Bilerp {
        v00: value(0.0),
        v01: value(0.4),
        v10: value(0.8),
        v11: value(0.4),
        mapping: MappingDesc::default(),
    };
    let desc = basics(vec![
        ramp(),
        BasicTexture::Mix { tex1: float_ref(0), tex2: value(1.0), amount: value(0.25) },
        BasicTexture::Checkerboard {
            tex1: float_ref(0),
            tex2: value(1.0),
            dimension: 2,
            mapping: MappingDesc::default(),
        },
        BasicTexture::Dots { inside: value(1.0), outside: value(0.0), mapping: MappingDesc::default() },
    ]);
    let t = compile(&desc);
    for (i, expected) in [0.4, 0.55, 0.7, procedural::DOT_SHARE].into_iter().enumerate() {
        assert!((t.mean_float(t.float_value(FloatTextureRef(i as u32))) - expected).abs() < 1e-6);
    }
}

#[test]
fn noise_textures_are_pbrts_in_their_own_space() {
    let kinds = [
        FloatTextureKind::Fbm { octaves: 6, omega: 0.5 },
        FloatTextureKind::Wrinkled { octaves: 6, omega: 0.5 },
        FloatTextureKind::Windy,
    ];
    let mut desc = floats(kinds.into());
    let move_by = Transform::translate(1.0, 2.0, 3.0);
    desc.float_textures.iter_mut().for_each(|t| t.world_from_texture = move_by);
    let t = compile(&desc);
    let here = TextureContext { dpdx: Vec3::new(0.01, 0.0, 0.0), ..at(0.3, 0.8) };
    let p = here.p - Vec3::new(1.0, 2.0, 3.0);
    let c = mapping::SolidCoordinates { p, dpdx: here.dpdx, dpdy: here.dpdy };
    let expected = [
        irradiant_math::noise::fbm(p, here.dpdx, here.dpdy, 0.5, 6),
        irradiant_math::noise::turbulence(p, here.dpdx, here.dpdy, 0.5, 6),
        procedural::windy(&c),
    ];
    for (i, e) in expected.into_iter().enumerate() {
        let got = t.float(t.float_value(FloatTextureRef(i as u32)), &here);
        assert!((got - e).abs() < 1e-4 && e != 0.0, "{i}: {got} {e}");
    }
}

#[test]
fn broken_images_are_reported_with_their_path() {
    let map = |name| BasicTexture::ImageMap(image_map(name, ImageFilter::Bilinear));
    let desc = basics(vec![map("none.png"), map("broken.png"), map("none.png")]);
    let assets = MemoryAssets::default().with("broken.png", b"\x89PNG\r\n\x1a\nnonsense".to_vec());
    let (t, diagnostics) = compile_with(&desc, &assets);
    assert_eq!(codes(&diagnostics), ["E0601", "E0602"]);
    let missing = diagnostics.iter().next().unwrap();
    assert!(missing.missing_file && missing.help.as_ref().unwrap().contains("none.png"));
    assert!(t.float(t.float_value(FloatTextureRef(0)), &at(0.1, 0.2)).is_finite());
}

#[test]
fn circles_and_explosions_are_reported() {
    let desc = basics(vec![
        BasicTexture::Scale { tex: float_ref(1), scale: value(2.0) },
        BasicTexture::Scale { tex: float_ref(0), scale: value(2.0) },
        BasicTexture::Constant(float_ref(77)),
    ]);
    let (t, diagnostics) = compile_with(&desc, &MemoryAssets::default());
    assert_eq!(codes(&diagnostics), ["E0608", "E0608"]);
    assert!(t.float(t.float_value(FloatTextureRef(0)), &at(0.1, 0.2)).is_finite());
    // Each looks up the one before twice.
    let ramp = BasicTexture::Dots { inside: value(0.0), outside: value(1.0), mapping: MappingDesc::default() };
    let mut chain = vec![ramp];
    chain.extend((0..60).map(|i| BasicTexture::Mix { tex1: float_ref(i), tex2: float_ref(i), amount: value(0.5) }));
    let (_, diagnostics) = compile_with(&basics(chain), &MemoryAssets::default());
    assert!(diagnostics.has_errors() && codes(&diagnostics).iter().all(|c| *c == "E0608"));
    // The same of spectra.
    let link = |i| texture(SpectrumTextureKind::Basic(BasicTexture::Scale { tex: spectrum_ref(i), scale: value(2.0) }));
    let desc = SceneDesc { spectrum_textures: vec![link(1), link(0)], ..SceneDesc::default() };
    let (mut t, mut diagnostics) = compile_with(&desc, &MemoryAssets::default());
    t.spectrum_value(&desc, &spectrum_ref(0), Role::Reflectance, "it", &mut diagnostics);
    assert_eq!(codes(&diagnostics), ["E0608"]);
}

#[test]
fn impossible_values_are_reported() {
    let named = |s: &str| SpectrumDesc::Named(s.into());
    let table = |v: &[(f32, f32)]| SpectrumDesc::Samples(v.into());
    let rgb = |r| SpectrumDesc::Rgb([r, 0.5, 0.5], ColorSpaceName::Srgb);
    let cases: Vec<(SpectrumDesc, Role, &[&str])> = vec![
        (SpectrumDesc::Constant(1.5), Role::Reflectance, &["E0701"]),
        (SpectrumDesc::Constant(1.5), Role::Unbounded, &[]),
        (rgb(1.01), Role::Reflectance, &["E0701"]),
        (rgb(20.0), Role::Illuminant, &[]),
        (rgb(-0.1), Role::Unbounded, &["E0605"]),
        (rgb(f32::NAN), Role::Unbounded, &["E0605"]),
        (SpectrumDesc::Blackbody(-3.0), Role::Illuminant, &["E0605"]),
        (named("metal-Au-eta"), Role::Unbounded, &[]),
        (named("metal-Aw-eta"), Role::Unbounded, &["E0606"]),
        (named("metal-Au-k"), Role::Reflectance, &["W0701"]),
        (table(&[(400.0, 0.1), (500.0, 0.2)]), Role::Reflectance, &[]),
        (table(&[(400.0, 0.1), (300.0, 0.2)]), Role::Reflectance, &["E0605"]),
        (table(&[(400.0, -0.1), (500.0, 0.2)]), Role::Reflectance, &["E0605"]),
        (table(&[(400.0, 0.1), (500.0, 1.2)]), Role::Reflectance, &["W0701"]),
        (table(&[]), Role::Reflectance, &["E0605"]),
    ];
    let desc = SceneDesc::default();
    let (mut t, _) = compile_with(&desc, &MemoryAssets::default());
    for (s, role, expected) in cases {
        let mut diagnostics = Diagnostics::default();
        let param = Spanned::unplaced(SpectrumParam::Value(s.clone()));
        let id = t.spectrum_value(&desc, &param, role, "the colour", &mut diagnostics);
        assert_eq!(codes(&diagnostics), expected, "{s:?}");
        assert!(t.spectrum(id, &at(0.0, 0.0), &lambda()).is_finite());
    }
    let flat = Transform::from_matrix([[1.0; 4]; 4]).unwrap_or(Transform { m: [[0.0; 4]; 4], inv: [[0.0; 4]; 4] });
    let mut bad = floats(vec![
        FloatTextureKind::Fbm { octaves: -1, omega: 0.5 },
        FloatTextureKind::Windy,
        FloatTextureKind::Basic(BasicTexture::Constant(value(f32::NAN))),
        FloatTextureKind::Basic(BasicTexture::DirectionMix { tex1: value(0.0), tex2: value(1.0), dir: [0.0; 3] }),
    ]);
    bad.float_textures[1].world_from_texture = flat;
    let (_, diagnostics) = compile_with(&bad, &MemoryAssets::default());
    assert_eq!(codes(&diagnostics), ["E0610", "E0609", "E0605", "E0605"]);
}
