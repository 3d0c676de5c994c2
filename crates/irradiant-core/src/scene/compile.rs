//! From a description to a scene: each part compiles itself; here they are put together in the one order that works.

use super::{Facts, Labels, LayerPlan, Scene};
use crate::camera::{self, CompiledCamera};
use crate::film::filter::Filter;
use crate::film::{Film, PixelBounds};
use crate::geometry::{Geometry, compile_geometry};
use crate::interaction::MaterialId;
use crate::light::{LightContext, Lights};
use crate::light_sampler::LightSampler;
use crate::material::Materials;
use crate::sampler::Sampler;
use crate::texture::Textures;
use irradiant_image::{Image, ReadOptions};
use irradiant_scene::desc::{
    CameraKind, ColorSpaceName, FileDesc, FilmDesc, FilmKind, FilterKind, LightSamplerKind, Randomization, SamplerKind,
    SceneDesc,
};
use irradiant_scene::{Assets, Diagnostic, Diagnostics, Span, Spanned};
use irradiant_spectrum::{Basis, ColorSpace, Role, Sensor, SensorError, Spectrum};
use std::sync::{Arc, OnceLock};

/// What a caller may set over the description.
#[derive(Clone, Copy, Debug)]
pub struct CompileOptions {
    /// Spectral, or three numbers.
    pub basis: Basis,
    /// Image size, pixels.
    pub resolution: Option<[u32; 2]>,
    /// The part to render: x0, x1, y0, y1 in fractions.
    pub crop: Option<[f32; 4]>,
    /// Samples per pixel.
    pub samples_per_pixel: Option<u32>,
    /// Seed.
    pub seed: Option<u64>,
    /// Where random numbers come from.
    pub sampler: Option<SamplerKind>,
    /// How lights are picked.
    pub light_sampler: Option<LightSamplerKind>,
    /// Whether paths from lights will bring something to the film, for which it takes memory.
    pub splats: bool,
    /// Films that would take more memory than this, bytes, are refused before anything is reserved.
    pub max_film_bytes: u64,
}

impl CompileOptions {
    /// The default of [`Self::max_film_bytes`], 4 GiB: an 8K picture fits.
    pub const MAX_FILM_BYTES: u64 = 4 << 30;
}

impl Default for CompileOptions {
    fn default() -> Self {
        Self {
            basis: Basis::Spectral,
            resolution: None,
            crop: None,
            samples_per_pixel: None,
            seed: None,
            sampler: None,
            light_sampler: None,
            splats: false,
            max_film_bytes: Self::MAX_FILM_BYTES,
        }
    }
}

/// A scene, unless there were errors, and what there is to say.
pub struct Compiled {
    /// None when there are errors.
    pub scene: Option<Scene>,
    /// All complaints.
    pub diagnostics: Diagnostics,
}

/// The colour space of a name.
pub fn color_space(name: ColorSpaceName) -> &'static ColorSpace {
    ColorSpace::named(name.name()).unwrap_or(ColorSpace::srgb())
}

impl Scene {
    /// Compiles a description; never stops early: all errors come at once.
    pub fn compile(desc: &SceneDesc, assets: &dyn Assets, options: &CompileOptions) -> Compiled {
        let mut diagnostics = Diagnostics::default();
        let scene = compile(desc, assets, options, &mut diagnostics);
        Compiled { scene: scene.filter(|_| !diagnostics.has_errors()), diagnostics }
    }
}

fn compile(
    desc: &SceneDesc,
    assets: &dyn Assets,
    options: &CompileOptions,
    diagnostics: &mut Diagnostics,
) -> Option<Scene> {
    // Settings that the caller may override come first: the rest depends on them.
    let mut film = desc.film.clone();
    if let Some(resolution) = options.resolution {
        let stated = std::mem::replace(&mut film.resolution.value, resolution);
        if let Some(bounds) = &mut film.pixel_bounds {
            bounds.value = scaled_bounds(bounds.value, stated, resolution);
        }
    }
    if options.crop.is_some() {
        (film.crop_window, film.pixel_bounds) = (options.crop.map(Spanned::unplaced), None);
    }
    let bounds = pixel_bounds(&film, diagnostics).filter(|b| fits(b, &film, options, diagnostics));
    check_filter(desc, diagnostics);
    check_buckets(&film, diagnostics);
    let samples_per_pixel = options.samples_per_pixel.unwrap_or(desc.sampler.samples_per_pixel.value).max(1);
    let sampler = options.sampler.unwrap_or(desc.sampler.kind);
    let seed = options.seed.or(desc.sampler.seed).unwrap_or(desc.options.seed);
    let space = color_space(film.color_space);

    let camera =
        camera::compile(&desc.camera, &film, samples_per_pixel, desc.options.render_space, assets, diagnostics);
    let exposure_time = film.exposure_time.map(|t| t.value).or(camera.as_ref().map(|c| c.exposure_time));
    let sensor = sensor(&film, exposure_time.unwrap_or(1.0), space, diagnostics);
    let render_from_world = camera.as_ref().map(|c| c.render_from_world).unwrap_or_default();

    let mut textures = Textures::compile(desc, &render_from_world, assets, space, diagnostics);
    let materials = Materials::compile(desc, &mut textures, assets, space, diagnostics);
    let material_id = |m: irradiant_scene::desc::MaterialRef| MaterialId(m.0);
    let mut geometry = compile_geometry(desc, &render_from_world, material_id, diagnostics);
    let lights = compile_lights(desc, &mut geometry, &render_from_world, space, assets, diagnostics);
    if lights.is_empty() {
        diagnostics.push(
            Diagnostic::warning("W0501", "there is no light in the scene: the picture will be black", Span::NONE)
                .help("add a LightSource or an AreaLightSource"),
        );
    }

    let (Some(camera), Some(bounds), Some(sensor)) = (camera, bounds, sensor) else { return None };
    if diagnostics.has_errors() {
        return None;
    }
    let CompiledCamera { camera, camera_from_world, footprint, .. } = camera;
    let light_sampler = LightSampler::new(options.light_sampler.unwrap_or(desc.integrator.light_sampler), &lights);
    let world_from_render = render_from_world.inverse();
    let camera_from_render = camera_from_world.compose(&world_from_render);
    let layers = LayerPlan::new(&film, space, options.basis, &camera_from_render, &world_from_render);
    let rgb_from_sensor = sensor.output_rgb_from_sensor_rgb(space, options.basis);
    let white = Spectrum::rgb([1.0; 3], Role::Illuminant, space);
    let white = white.scaled(1.0 / irradiant_spectrum::spectrum_to_photometric(&white));
    let filtered = !desc.options.disable_texture_filtering && textures.needs_footprint();
    let facts = facts(desc, &geometry, &materials, &textures, &lights);
    let truncations = materials.coat_depth_limit().map(|n| format!("coat depth {n}")).into_iter().collect();
    let mut biases = Vec::new();
    if materials.uses_pbrt_coat_weights() {
        biases.push("coats weighted as in pbrt-v4".into());
    }
    if film.max_component_value.is_finite() {
        biases.push(format!("maxcomponentvalue {}", film.max_component_value.value));
    }
    if desc.options.disable_pixel_jitter {
        biases.push("disablepixeljitter".into());
    }
    if desc.options.disable_wavelength_jitter && options.basis == Basis::Spectral {
        biases.push("disablewavelengthjitter".into());
    }
    match sampler {
        SamplerKind::Stratified { jitter: false, .. }
        | SamplerKind::Halton(Randomization::None)
        | SamplerKind::Sobol(Randomization::None)
        | SamplerKind::PaddedSobol(Randomization::None) => biases.push("samples are not randomized".into()),
        SamplerKind::Independent
        | SamplerKind::Stratified { .. }
        | SamplerKind::Halton(_)
        | SamplerKind::Sobol(_)
        | SamplerKind::PaddedSobol(_)
        | SamplerKind::ZSobol
        | SamplerKind::Pmj02bn => {}
    }

    Some(Scene {
        geometry,
        materials,
        textures,
        light_sampler,
        lights,
        camera,
        filter: Filter::new(&desc.filter),
        sampler: Sampler::new(sampler, samples_per_pixel, film.resolution.value, seed),
        layers,
        labels: Labels::new(desc),
        samples_per_pixel,
        seed,
        basis: options.basis,
        sensor,
        color_space: space,
        rgb_from_sensor,
        max_component: film.max_component_value.value,
        white,
        resolution: film.resolution.value,
        bounds,
        footprint: filtered.then_some(footprint),
        render_from_world,
        camera_from_world,
        pixel_jitter: !desc.options.disable_pixel_jitter,
        wavelength_jitter: !desc.options.disable_wavelength_jitter,
        truncations,
        biases,
        facts,
        emission: OnceLock::new(),
    })
}

/// The same part (x0, x1, y0, y1) of an image of another size; what it touches counts whole.
fn scaled_bounds(bounds: [i32; 4], from: [u32; 2], to: [u32; 2]) -> [i32; 4] {
    std::array::from_fn(|i| {
        let scaled = bounds[i] as f64 * to[i / 2] as f64 / from[i / 2].max(1) as f64;
        (if i % 2 == 0 { scaled.floor() } else { scaled.ceil() }) as i32
    })
}

/// The pixels to render: the author's bounds, or the part of the image that the crop window says.
fn pixel_bounds(film: &FilmDesc, diagnostics: &mut Diagnostics) -> Option<PixelBounds> {
    const LARGEST: u32 = 1 << 16;
    let [width, height] = film.resolution.value;
    if !((1..=LARGEST).contains(&width) && (1..=LARGEST).contains(&height)) {
        let message = format!("a film of {width} x {height} pixels");
        diagnostics.push(
            Diagnostic::error("E0901", message, film.resolution.span)
                .help(format!("each side must be from 1 to {LARGEST} pixels")),
        );
        return None;
    }
    let full = PixelBounds { x0: 0, y0: 0, x1: width as i32, y1: height as i32 };
    let (bounds, span) = match (&film.pixel_bounds, &film.crop_window) {
        (Some(b), _) => {
            let [x0, x1, y0, y1] = b.value;
            (PixelBounds { x0, y0, x1, y1 }.intersection(&full), b.span)
        }
        (None, Some(crop)) => {
            let at = |fraction: f32, size: u32| (fraction.clamp(0.0, 1.0) * size as f32).ceil() as i32;
            let [x0, x1, y0, y1] = crop.value;
            (PixelBounds { x0: at(x0, width), y0: at(y0, height), x1: at(x1, width), y1: at(y1, height) }, crop.span)
        }
        (None, None) => (full, film.span),
    };
    if bounds.area() == 0 {
        diagnostics.push(
            Diagnostic::error("E0902", "no pixel is left to render", span)
                .help("bounds are x0 x1 y0 y1, inside the film, with x0 < x1 and y0 < y1"),
        );
        return None;
    }
    Some(bounds)
}

/// Complains of a film that is too large for the memory it may take; says what to do.
fn fits(bounds: &PixelBounds, film: &FilmDesc, options: &CompileOptions, diagnostics: &mut Diagnostics) -> bool {
    let (limit, of_splats) = (options.max_film_bytes, if options.splats { Film::SPLAT_BYTES_PER_PIXEL } else { 0 });
    let per_pixel = Film::bytes_per_pixel(LayerPlan::channels_of(film)) + of_splats;
    let bytes = (bounds.area() as u64).saturating_mul(per_pixel);
    if bytes > limit {
        // Small limits deserve small units.
        let size = |bytes: u64| match bytes {
            0..0x10_0000 => format!("{:.1} KiB", bytes as f64 / 1024.0),
            0x10_0000..0x4000_0000 => format!("{:.1} MiB", bytes as f64 / 1_048_576.0),
            _ => format!("{:.1} GiB", bytes as f64 / 1_073_741_824.0),
        };
        let [width, height] = [bounds.width(), bounds.height()];
        let message =
            format!("a film of {width} x {height} pixels takes {} of memory; {} are allowed", size(bytes), size(limit));
        diagnostics.push(Diagnostic::error("E0907", message, film.resolution.span).help(
            "render it in parts with \"cropwindow\" (or --crop), make it smaller (--resolution), or allow more \
                     (--max-film-memory)",
        ));
    }
    bytes <= limit
}

fn check_filter(desc: &SceneDesc, diagnostics: &mut Diagnostics) {
    for radius in [desc.filter.x_radius, desc.filter.y_radius] {
        if !(radius.value > 0.0 && radius.value <= 1e4) {
            let message = format!("a pixel filter of radius {}", radius.value);
            diagnostics.push(
                Diagnostic::error("E0903", message, radius.span)
                    .help("radii are half-widths in pixels, more than 0, at most 10000"),
            );
        }
    }
    let positive = match desc.filter.kind {
        FilterKind::Gaussian { sigma } => Some(sigma),
        FilterKind::Sinc { tau } => Some(tau),
        FilterKind::Box | FilterKind::Triangle | FilterKind::Mitchell { .. } => None,
    };
    if let Some(value) = positive.filter(|v| !(v.value > 0.0 && v.value.is_finite())) {
        diagnostics.push(
            Diagnostic::error("E0904", format!("{} is out of range", value.value), value.span)
                .help("must be more than 0"),
        );
    }
}

/// Buckets of a spectral film: narrower ones than this could not be told apart by their names.
const NARROWEST_BUCKET: f32 = 0.01;

fn check_buckets(film: &FilmDesc, diagnostics: &mut Diagnostics) {
    let FilmKind::Spectral { n_buckets, lambda_min, lambda_max } = &film.kind else { return };
    let (lo, hi) = (lambda_min.value, lambda_max.value);
    if !(lo >= 1.0 && lo < hi && hi <= 1e5) {
        diagnostics.push(
            Diagnostic::error("E0908", format!("a spectral film from {lo} to {hi} nm"), film.span)
                .help("\"lambdamin\" is less than \"lambdamax\"; both are wavelengths in nm, 1 to 100000"),
        );
    } else if !((hi - lo) / n_buckets.value as f32 >= NARROWEST_BUCKET) {
        diagnostics.push(
            Diagnostic::error("E0908", format!("{} buckets from {lo} to {hi} nm", n_buckets.value), film.span)
                .help(format!("a bucket is at least {NARROWEST_BUCKET} nm wide")),
        );
    }
}

fn sensor(
    film: &FilmDesc,
    exposure_time: f32,
    space: &'static ColorSpace,
    diagnostics: &mut Diagnostics,
) -> Option<Sensor> {
    if !(exposure_time > 0.0 && film.iso.value > 0.0 && film.white_balance.value >= 0.0) {
        diagnostics.push(
            Diagnostic::error("E0905", "exposure time, iso and white balance must be positive", film.span)
                .help("the exposure time is shutterclose - shutteropen unless the film says otherwise"),
        );
        return None;
    }
    match Sensor::new(&film.sensor.value, film.iso.value, exposure_time, film.white_balance.value, space) {
        Ok(sensor) => Some(sensor),
        Err(why) => {
            let near = irradiant_scene::diagnostic::did_you_mean(&film.sensor.value, Sensor::names());
            let help = match (&why, near) {
                (SensorError::Unknown(_), Some(near)) => format!("did you mean \"{near}\"?"),
                (SensorError::Unknown(_), None) => {
                    format!("known are {}", Sensor::names().collect::<Vec<_>>().join(", "))
                }
                (SensorError::Singular(_), _) => "try another white balance temperature".into(),
            };
            diagnostics.push(Diagnostic::error("E0906", why.to_string(), film.sensor.span).help(help));
            None
        }
    }
}

fn compile_lights(
    desc: &SceneDesc,
    geometry: &mut Geometry,
    render_from_world: &irradiant_math::Transform,
    space: &'static ColorSpace,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Lights {
    let mut load_image =
        |file: &Spanned<FileDesc>, diagnostics: &mut Diagnostics| load_image(file, assets, diagnostics);
    let mut context = LightContext {
        render_from_world,
        scene_bounds: geometry.bounds(),
        color_space: space,
        load_image: &mut load_image,
    };
    Lights::compile(desc, geometry, &mut context, diagnostics)
}

/// Reads and decodes an image, or says where the scene asks for it and what is wrong.
pub(crate) fn load_image(
    file: &Spanned<FileDesc>,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<Arc<Image>> {
    let bytes = match assets.read(&file.path) {
        Ok(bytes) => bytes,
        Err(why) => {
            let message = format!("image \"{}\": {why}", file.name);
            let help = format!("tried {}", file.path.display());
            diagnostics.push(Diagnostic::error("E0601", message, file.span).help(help).missing());
            return None;
        }
    };
    match irradiant_image::read(&bytes, &file.name, &ReadOptions::default()) {
        Ok(image) => Some(Arc::new(image)),
        Err(why) => {
            let message = format!("image \"{}\": {why}", file.name);
            diagnostics.push(Diagnostic::error("E0602", message, file.span));
            None
        }
    }
}

fn facts(desc: &SceneDesc, geometry: &Geometry, materials: &Materials, textures: &Textures, lights: &Lights) -> Facts {
    let (triangles, other_primitives) = geometry.n_primitives();
    let (n_textures, images, image_bytes) = textures.counts();
    let area_lights = lights.as_slice().iter().filter(|l| matches!(l, crate::light::Light::Area(_))).count();
    Facts {
        camera: match &desc.camera.kind {
            CameraKind::Perspective { .. } => "perspective",
            CameraKind::Orthographic { .. } => "orthographic",
            CameraKind::Spherical { .. } => "spherical",
            CameraKind::Realistic { .. } => "realistic",
        }
        .into(),
        shapes: geometry.n_shapes(),
        triangles,
        other_primitives,
        instances: desc.instances.len(),
        materials: materials.len(),
        material_names: (0..materials.len() as u32).map(|i| materials.name(MaterialId(i))).collect(),
        textures: n_textures,
        images,
        image_bytes,
        lights: lights.len(),
        area_lights,
        infinite_lights: lights.environments().len(),
        geometry_bytes: geometry.memory_bytes(),
    }
}
