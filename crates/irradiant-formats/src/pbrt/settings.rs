//! `Sampler`, `Integrator`, `Accelerator` and `Option`.

use super::legacy::unknown_name;
use super::params::Params;
use super::reader::Reader;
use irradiant_scene::desc::settings::Randomization;
use irradiant_scene::desc::{
    IntegratorDesc, IntegratorKind, LightSamplerKind, OptionsDesc, RenderSpace, SamplerDesc, SamplerKind,
};
use irradiant_scene::{Diagnostic, Spanned};

const SAMPLERS: &[&str] = &["halton", "independent", "paddedsobol", "pmj02bn", "sobol", "stratified", "zsobol"];

/// `Sampler`: pbrt-v4's names, with 16 samples per pixel unless said (independent: 4, stratified: 4 x 4).
pub(crate) fn sampler(r: &Reader, name: &Spanned<String>, p: &Params) -> SamplerDesc {
    let randomization = |default| {
        let choices = [
            ("none", Randomization::None),
            ("permutedigits", Randomization::PermuteDigits),
            ("fastowen", Randomization::FastOwen),
            ("owen", Randomization::Owen),
        ];
        p.choice(r, "randomization", &choices, default)
    };
    let mut default_samples = 16;
    let mut fixed = None;
    let kind = match name.value.as_str() {
        "zsobol" => {
            randomization(Randomization::FastOwen);
            SamplerKind::ZSobol
        }
        "sobol" => SamplerKind::Sobol(randomization(Randomization::FastOwen)),
        "paddedsobol" => SamplerKind::PaddedSobol(randomization(Randomization::FastOwen)),
        "halton" => SamplerKind::Halton(randomization(Randomization::PermuteDigits)),
        "pmj02bn" => SamplerKind::Pmj02bn,
        "independent" => {
            default_samples = 4;
            SamplerKind::Independent
        }
        "stratified" => {
            let x = p.integer_in(r, "xsamples", 4, 1..=1 << 15);
            let y = p.integer_in(r, "ysamples", 4, 1..=1 << 15);
            let span = if x.span == irradiant_scene::Span::NONE { y.span } else { x.span };
            fixed = Some(Spanned::new((x.value * y.value) as u32, span));
            SamplerKind::Stratified { x: x.value as u32, y: y.value as u32, jitter: p.bool_or(r, "jitter", true) }
        }
        _ => {
            unknown_name(r, "E0208", "sampler", name, SAMPLERS);
            return SamplerDesc::default();
        }
    };
    let samples_per_pixel =
        fixed.unwrap_or_else(|| p.integer_in(r, "pixelsamples", default_samples, 1..=i32::MAX).map(|n| n as u32));
    let seed = p.integer(r, "seed").map(|s| s.value as u32 as u64);
    p.finish(r);
    SamplerDesc { kind, samples_per_pixel, seed, span: p.span }
}

/// What the integrator asked for beyond its description.
#[derive(Clone, Copy, Debug)]
pub(crate) struct IntegratorRequest {
    /// It would render media (as pbrt-v4's default does).
    pub volumetric: bool,
}

impl Default for IntegratorRequest {
    fn default() -> Self {
        Self { volumetric: true }
    }
}

const INTEGRATORS: &[&str] = &[
    "ambientocclusion",
    "bdpt",
    "lightpath",
    "mlt",
    "path",
    "randomwalk",
    "simplepath",
    "simplevolpath",
    "sppm",
    "volpath",
];

/// `Integrator`: path tracers as they are; those that are not here yet as `path`, with a warning.
pub(crate) fn integrator(r: &Reader, name: &Spanned<String>, p: &Params) -> (IntegratorDesc, IntegratorRequest) {
    let mut desc = IntegratorDesc { span: p.span, ..IntegratorDesc::default() };
    let mut request = IntegratorRequest { volumetric: false };
    let light_sampler = |default| {
        let choices = [
            ("uniform", LightSamplerKind::Uniform),
            ("power", LightSamplerKind::Power),
            ("bvh", LightSamplerKind::Bvh),
            ("exhaustive", LightSamplerKind::Exhaustive),
        ];
        p.choice(r, "lightsampler", &choices, default)
    };
    let mut stand_in = false;
    match name.value.as_str() {
        "path" | "volpath" => {
            desc.light_sampler = light_sampler(LightSamplerKind::Bvh);
            desc.regularize = p.bool_or(r, "regularize", false);
            request.volumetric = name.value == "volpath";
        }
        "simplepath" => {
            desc.kind = IntegratorKind::SimplePath {
                sample_lights: p.bool_or(r, "samplelights", true),
                sample_bsdf: p.bool_or(r, "samplebsdf", true),
            };
        }
        "simplevolpath" => {
            desc.kind = IntegratorKind::SimplePath { sample_lights: false, sample_bsdf: true };
            request.volumetric = true;
        }
        "randomwalk" => desc.kind = IntegratorKind::RandomWalk,
        "ambientocclusion" => {
            desc.kind = IntegratorKind::AmbientOcclusion {
                cos_sample: p.bool_or(r, "cossample", true),
                max_distance: p.float_or(r, "maxdistance", f32::INFINITY).value,
            };
            p.finish(r);
            return (desc, request);
        }
        "bdpt" => {
            desc.kind = IntegratorKind::Bidirectional;
            p.bool_or(r, "visualizestrategies", false);
            p.bool_or(r, "visualizeweights", false);
            // Of light samples; paths from lights choose by power.
            desc.light_sampler = light_sampler(LightSamplerKind::Power);
            // Nothing is blurred here, which pbrt's flag would be a bias for.
            p.bool_or(r, "regularize", false);
            request.volumetric = true;
        }
        "mlt" => {
            stand_in = true;
            p.integer(r, "bootstrapsamples");
            p.integer(r, "chains");
            p.integer(r, "mutationsperpixel");
            p.float(r, "sigma");
            p.float(r, "largestepprobability");
            desc.regularize = p.bool_or(r, "regularize", false);
            request.volumetric = true;
        }
        "sppm" => {
            let paths = p.integer(r, "photonsperiteration").map_or(0, |n| n.value.max(0) as u32);
            p.integer(r, "seed");
            let radius = p.float_or(r, "radius", 1.0);
            if !(radius.value > 0.0 && radius.value.is_finite()) {
                r.push(
                    Diagnostic::error("E0309", format!("a photon radius of {}", radius.value), radius.span)
                        .label("expected more than 0, in scene units"),
                );
            }
            desc.kind = IntegratorKind::Photon { paths_per_pass: paths, radius: radius.value };
        }
        "lightpath" => desc.kind = IntegratorKind::LightTrace,
        "function" => {
            let help = "use \"path\" to render the scene";
            r.error_help("E0209", "integrator \"function\" draws a formula, not the scene", name.span, help);
            return (desc, request);
        }
        _ => {
            unknown_name(r, "E0209", "integrator", name, INTEGRATORS);
            return (desc, request);
        }
    }
    let depth = p.integer_in(r, "maxdepth", 5, 0..=i32::MAX);
    desc.max_depth_stated = depth.span != irradiant_scene::Span::NONE;
    desc.max_depth = depth.map(|d| d as u32);
    p.finish(r);
    if stand_in {
        let message = format!("integrator \"{}\" is not here yet; \"path\" renders this scene", name.value);
        r.push(
            Diagnostic::warning("W0102", message, name.span)
                .help("caustics of small lights will be noisier")
                .not_honoured(format!("integrator {}: path", name.value)),
        );
    }
    (desc, request)
}

/// `Accelerator`: checked and left unused, since it changes no pixel.
pub(crate) fn accelerator(r: &Reader, name: &Spanned<String>, p: &Params) {
    match name.value.as_str() {
        "bvh" => {
            p.integer(r, "maxnodeprims");
            p.choice(r, "splitmethod", &[("sah", ()), ("hlbvh", ()), ("middle", ()), ("equal", ())], ());
        }
        "kdtree" => {
            p.integer(r, "intersectcost");
            p.integer(r, "traversalcost");
            p.float(r, "emptybonus");
            p.integer(r, "maxprims");
            p.integer(r, "maxdepth");
        }
        _ => return unknown_name(r, "E0211", "accelerator", name, &["bvh", "kdtree"]),
    }
    p.finish(r);
}

const OPTIONS: &[&str] = &[
    "disablepixeljitter",
    "disabletexturefiltering",
    "disablewavelengthjitter",
    "displacementedgescale",
    "forcediffuse",
    "msereferenceimage",
    "msereferenceout",
    "pixelstats",
    "rendercoordsys",
    "seed",
    "wavefront",
];

/// `Option`. Names are pbrt-v4's in any case, with `-` and `_` left out; a type before the name is allowed.
pub(crate) fn option(r: &Reader, options: &mut OptionsDesc, name: &Spanned<String>, value: &Spanned<String>) {
    let last_word = name.value.split_ascii_whitespace().last().unwrap_or_default();
    let normal: String =
        last_word.chars().filter(|c| !matches!(c, '-' | '_')).map(|c| c.to_ascii_lowercase()).collect();
    let wrong = |expected: &str| {
        r.push(
            Diagnostic::error("E0110", format!("option \"{}\" is {}", name.value, value.value), value.span)
                .label(format!("expected {expected}")),
        );
    };
    let flag = |slot: &mut bool| match value.value.as_str() {
        "true" => *slot = true,
        "false" => *slot = false,
        _ => wrong("true or false"),
    };
    match normal.as_str() {
        "disablepixeljitter" => flag(&mut options.disable_pixel_jitter),
        "disabletexturefiltering" => flag(&mut options.disable_texture_filtering),
        "disablewavelengthjitter" => flag(&mut options.disable_wavelength_jitter),
        "forcediffuse" => flag(&mut options.force_diffuse),
        // Of pbrt's own machinery: understood, without an effect on pixels.
        "pixelstats" | "wavefront" => flag(&mut false),
        "msereferenceimage" | "msereferenceout" => {}
        "seed" => match super::lex::parse_i32(value.value.as_bytes()) {
            Some(seed) => options.seed = seed as u32 as u64,
            None => wrong("a whole number"),
        },
        "displacementedgescale" => match super::lex::parse_f32(value.value.as_bytes()) {
            Some(scale) if scale > 0.0 => options.displacement_edge_scale = Some(scale),
            _ => wrong("a number above 0"),
        },
        "rendercoordsys" => match value.value.as_str() {
            "cameraworld" => options.render_space = RenderSpace::CameraWorld,
            "camera" => options.render_space = RenderSpace::Camera,
            "world" => options.render_space = RenderSpace::World,
            _ => wrong("\"cameraworld\", \"camera\" or \"world\""),
        },
        _ => r.unknown("E0110", "option", name, OPTIONS),
    }
}
