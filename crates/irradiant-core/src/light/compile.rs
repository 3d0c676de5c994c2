//! Lights from their description: range checks, pbrt-v4's scales, images.
//!
//! Codes: E0801 a factor out of range, E0802 a spectrum, E0803 an unknown spectrum name, E0804 a direction or an angle,
//! E0805 an image, E0806 a portal, E0807 contradicting parameters; W0808 bad pixels, W0809 not honoured or ignored, W0810 a value
//! that has no effect.

use super::area::{AreaAlpha, AreaLight, AreaRadiance};
use super::emission::RadianceImage;
use super::orientation::Orientation;
use super::origin::{LightOrigin, LightOrigins};
use super::portal::{PortalError, PortalInfiniteLight};
use super::projection::{ProjectionLight, Screen};
use super::{
    DistantLight, Emission, GoniometricLight, ImageInfiniteLight, Light, PointLight, SceneSphere, Sky, SpotLight,
    UniformInfiniteLight,
};
use crate::geometry::{Alpha, EmitterShape, Geometry};
use crate::interaction::LightId;
use irradiant_image::Image;
use irradiant_math::elementary::cos;
use irradiant_math::{Bounds3, Point2, Point3, Transform, Vec3, warp};
use irradiant_scene::SceneDesc;
use irradiant_scene::desc::texture::BasicTexture;
use irradiant_scene::desc::{
    AreaLightDesc, ColorSpaceName, FileDesc, FloatParam, FloatTextureKind, LightDesc, LightKind, MaterialKind,
    PortalDesc, SpectrumDesc,
};
use irradiant_scene::diagnostic::did_you_mean;
use irradiant_scene::{Diagnostic, Diagnostics, Span, Spanned};
use irradiant_spectrum::{ColorSpace, Curve, Role, Spectrum, spectrum_to_photometric, spectrum_to_xyz};
use std::collections::HashMap;
use std::f32::consts::PI;
use std::sync::Arc;

/// What lights are compiled with.
pub struct LightContext<'a> {
    /// Takes world space to render space.
    pub render_from_world: &'a Transform,
    /// Of everything that is not a light at infinity, render space.
    pub scene_bounds: Bounds3,
    /// The space whose RGB a render in the RGB basis uses: the film's.
    pub color_space: &'static ColorSpace,
    /// Loads an image; says itself what is wrong when there is none.
    #[allow(clippy::type_complexity)]
    pub load_image: &'a mut dyn FnMut(&Spanned<FileDesc>, &mut Diagnostics) -> Option<Arc<Image>>,
}

/// A surface that emits.
pub(super) struct AreaEmitter {
    pub shape: EmitterShape,
    /// Number of the author's faces that it is made of.
    pub faces: u32,
    pub desc: Arc<AreaLightDesc>,
    pub alpha: AreaAlpha,
}

/// All lights of a scene, by [`LightId`].
#[derive(Debug, Default)]
pub struct Lights {
    pub(super) list: Vec<Light>,
    environments: Vec<LightId>,
    origins: LightOrigins,
}

impl Lights {
    /// From a list; ids are indices, and each light is one of the author's.
    pub fn new(list: Vec<Light>) -> Self {
        let kinds = list.iter().map(|_| LightOrigin { kind: "light", group: None }).collect();
        let of_light = (0..list.len() as u32).collect();
        Self::with_origins(list, LightOrigins { list: kinds, of_light })
    }

    fn with_origins(list: Vec<Light>, origins: LightOrigins) -> Self {
        let environments =
            (0..list.len() as u32).map(LightId).filter(|id| list[id.0 as usize].is_environment()).collect();
        Self { list, environments, origins }
    }

    /// All lights of `desc`: those of `geometry`'s emitters first, which are told their ids, then the others in order.
    ///
    /// Shapes of interface materials do not emit, as in pbrt-v4. Complaints go to `diagnostics`; lights with errors are
    /// left out, so the result is sound even when it should not be used.
    pub fn compile(
        desc: &SceneDesc,
        geometry: &mut Geometry,
        context: &mut LightContext<'_>,
        diagnostics: &mut Diagnostics,
    ) -> Self {
        let scene = SceneSphere::new(&context.scene_bounds);
        let mut compiler = Compiler { context, diagnostics, scene };
        let mut ignored = Vec::new();
        let emitters: Vec<Option<AreaEmitter>> = geometry
            .emitters()
            .iter()
            .map(|emitter| {
                // Shape ids count the scene's own shapes first, and only those emit.
                let shape = desc.shapes.get(emitter.shape.0 as usize)?;
                let area_light = shape.area_light.as_ref()?;
                let material = desc.materials.get(shape.material.0 as usize);
                if material.is_some_and(|m| matches!(m.kind, MaterialKind::Interface)) {
                    if ignored.last() != Some(&shape.span) {
                        ignored.push(shape.span);
                    }
                    return None;
                }
                let alpha = area_alpha(desc, emitter.alpha);
                Some(AreaEmitter {
                    shape: emitter.geometry.clone(),
                    faces: emitter.faces,
                    desc: area_light.clone(),
                    alpha,
                })
            })
            .collect();
        for span in ignored {
            compiler.warning("W0809", "emission of a shape whose material is \"interface\" is ignored", span);
        }
        let mut origins = LightOrigins::default();
        let mut statement: *const AreaLightDesc = std::ptr::null();
        for emitter in emitters.iter().flatten() {
            // Only the order of the list shows, never an address.
            if !std::ptr::eq(statement, Arc::as_ptr(&emitter.desc)) {
                statement = Arc::as_ptr(&emitter.desc);
                origins.list.push(LightOrigin { kind: "diffuse", group: emitter.desc.group.clone() });
            }
            origins.of_light.push(origins.list.len() as u32 - 1);
        }
        let (mut list, ids) = compiler.area_lights(emitters);
        geometry.assign_lights(ids);
        for light in &desc.lights {
            if let Some(compiled) = compiler.light(light) {
                list.push(compiled);
                origins.of_light.push(origins.list.len() as u32);
                origins.list.push(LightOrigin { kind: light.kind.name(), group: light.group.clone() });
            }
        }
        Self::with_origins(list, origins)
    }

    /// The light of an id.
    #[inline]
    pub fn get(&self, id: LightId) -> &Light {
        &self.list[id.0 as usize]
    }

    /// Which of the author's lights each is part of.
    pub fn origins(&self) -> &LightOrigins {
        &self.origins
    }

    /// All of them, by id.
    pub fn as_slice(&self) -> &[Light] {
        &self.list
    }

    /// Number of lights.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// True when nothing shines.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The lights that a ray which leaves the scene meets: all of them, their radiance adds up.
    #[inline]
    pub fn environments(&self) -> &[LightId] {
        &self.environments
    }

    /// Where the one environment's image will be seen by a ray in this direction, should it leave the scene: asked
    /// before the ray is traced, so that the memory is there afterwards. `None` when there is no such image.
    #[inline]
    pub fn place_of_escape(&self, direction: Vec3) -> Option<Point2> {
        self.sky().map(|(_, light)| light.place(direction))
    }

    /// The one environment there is, if it looks the same from everywhere.
    pub fn only_sky(&self) -> Option<(LightId, Sky<'_>)> {
        match self.environments[..] {
            [only] => match &self.list[only.0 as usize] {
                Light::ImageInfinite(light) => Some((only, Sky::Image(light))),
                Light::UniformInfinite(light) => Some((only, Sky::Uniform(light))),
                _ => None,
            },
            _ => None,
        }
    }

    /// The one environment there is, if it is an image: its samples can be drawn in steps.
    #[inline]
    pub fn sky(&self) -> Option<(LightId, &ImageInfiniteLight)> {
        match self.environments[..] {
            [only] => match &self.list[only.0 as usize] {
                Light::ImageInfinite(light) => Some((only, light)),
                _ => None,
            },
            _ => None,
        }
    }
}

struct Compiler<'a, 'b> {
    context: &'a mut LightContext<'b>,
    diagnostics: &'a mut Diagnostics,
    scene: SceneSphere,
}

/// A spectrum and what its photometric size divides the scale by.
struct Shine {
    spectrum: Spectrum,
    /// 1 / photometric size; 0 for black.
    unit: f32,
}

fn space_of(name: ColorSpaceName) -> &'static ColorSpace {
    ColorSpace::named(name.name()).unwrap_or(ColorSpace::srgb())
}

/// 1 / the photometric size of the illuminant of a space.
fn illuminant_unit(space: &'static ColorSpace) -> f32 {
    1.0 / spectrum_to_photometric(&Spectrum::rgb_illuminant([1.0; 3], space))
}

fn vec3(v: [f32; 3]) -> Vec3 {
    Vec3::new(v[0], v[1], v[2])
}

impl Compiler<'_, '_> {
    fn error(&mut self, code: &'static str, message: impl Into<String>, span: Span) {
        self.diagnostics.push(Diagnostic::error(code, message, span));
    }

    fn warning(&mut self, code: &'static str, message: impl Into<String>, span: Span) {
        self.diagnostics.push(Diagnostic::warning(code, message, span));
    }

    /// A factor in [0, inf).
    fn factor(&mut self, scale: &Spanned<f32>) -> Option<f32> {
        if !(scale.value >= 0.0 && scale.value.is_finite()) {
            let message = format!("a light's scale of {} is not a number from 0 up", scale.value);
            self.error("E0801", message, scale.span);
            return None;
        }
        Some(scale.value)
    }

    /// `power` or `illuminance`: what is asked for, or `None`; not positive means not asked for, as in pbrt-v4.
    fn target(&mut self, what: &str, value: &Option<Spanned<f32>>) -> Option<f32> {
        let value = value.as_ref()?;
        if !value.value.is_finite() {
            self.error("E0801", format!("a light's {what} of {} is not a finite number", value.value), value.span);
            return None;
        }
        if value.value <= 0.0 {
            let message = format!("a light's {what} of {} has no effect: it is not positive", value.value);
            self.warning("W0810", message, value.span);
            return None;
        }
        Some(value.value)
    }

    fn shine(&mut self, desc: &Spanned<SpectrumDesc>, space: ColorSpaceName) -> Option<Shine> {
        let space = space_of(space);
        let span = desc.span;
        let spectrum = match &desc.value {
            SpectrumDesc::Constant(v) if v.is_finite() && *v >= 0.0 => Spectrum::constant(*v, Role::Illuminant, space),
            SpectrumDesc::Constant(v) => {
                self.error("E0802", format!("emission of {v} is not a number from 0 up"), span);
                return None;
            }
            SpectrumDesc::Rgb(rgb, name) => {
                if !rgb.iter().all(|v| v.is_finite() && *v >= 0.0) {
                    let message =
                        format!("emission of RGB ({}, {}, {}) has a component below 0", rgb[0], rgb[1], rgb[2]);
                    self.error("E0802", message, span);
                    return None;
                }
                Spectrum::rgb_illuminant(*rgb, space_of(*name))
            }
            SpectrumDesc::Blackbody(t) if t.is_finite() && *t > 0.0 => Spectrum::blackbody(*t, Role::Illuminant, space),
            SpectrumDesc::Blackbody(t) => {
                self.error("E0802", format!("a black body of {t} K does not shine"), span);
                return None;
            }
            SpectrumDesc::Named(name) => match irradiant_spectrum::named(name) {
                Some(s) => s.with_role(Role::Illuminant, space),
                None => {
                    let mut d = Diagnostic::error("E0803", format!("there is no spectrum \"{name}\""), span);
                    if let Some(near) = did_you_mean(name, irradiant_spectrum::names()) {
                        d = d.help(format!("did you mean \"{near}\"?"));
                    }
                    self.diagnostics.push(d);
                    return None;
                }
            },
            SpectrumDesc::Samples(samples) => {
                let (lambda, values): (Vec<f32>, Vec<f32>) = samples.iter().copied().unzip();
                if let Some(&(nm, v)) = samples.iter().find(|s| s.1 < 0.0) {
                    self.error("E0802", format!("emission of {v} at {nm} nm is below 0"), span);
                    return None;
                }
                match Spectrum::piecewise_linear(&lambda, &values, Role::Illuminant, space) {
                    Ok(s) => s,
                    Err(e) => {
                        self.error("E0802", format!("not a spectrum: {e}"), span);
                        return None;
                    }
                }
            }
        };
        let size = spectrum_to_photometric(&spectrum);
        if !(size > 0.0) {
            self.warning("W0810", "this light emits nothing visible", span);
        }
        Some(Shine { spectrum, unit: if size > 0.0 { 1.0 / size } else { 0.0 } })
    }

    fn image(&mut self, file: &Spanned<FileDesc>) -> Option<RadianceImage> {
        let image = (self.context.load_image)(file, self.diagnostics)?;
        let Some((radiance, faults)) = RadianceImage::new(&image, self.context.color_space) else {
            let found = image.channels().join(", ");
            let message = format!("{}: a light's image needs channels R, G and B, found {found}", file.value.name);
            self.error("E0805", message, file.span);
            return None;
        };
        if let Some([x, y]) = faults.first {
            let message = format!(
                "{}: {} pixels are not finite and {} are negative, the first at column {x}, row {y}; they count as 0",
                file.value.name, faults.not_finite, faults.negative
            );
            self.warning("W0808", message, file.span);
        }
        Some(radiance)
    }

    fn square_image(&mut self, file: &Spanned<FileDesc>) -> Option<RadianceImage> {
        let image = self.image(file)?;
        if image.width() != image.height() {
            let (w, h) = (image.width(), image.height());
            let mut d = Diagnostic::error(
                "E0805",
                format!("{}: the image is {w} x {h}, but images of directions are square", file.value.name),
                file.span,
            );
            d = d.help(if w == 2 * h {
                "this looks like a latitude-longitude map; convert it to the equal-area octahedral map, for example \
                 with pbrt's `imgtool makeequiarea`"
            } else {
                "it should be an equal-area octahedral map, as pbrt-v4's `imgtool makeequiarea` makes them"
            });
            self.diagnostics.push(d);
            return None;
        }
        Some(image)
    }

    fn direction(&mut self, v: Vec3, span: Span) -> Option<Vec3> {
        let length = v.length();
        if !(length > 0.0 && length.is_finite()) {
            self.error("E0804", "this light has no direction: \"from\" and \"to\" are the same point", span);
            return None;
        }
        Some(v * (1.0 / length))
    }

    fn light(&mut self, desc: &LightDesc) -> Option<Light> {
        if desc.world_from_light.is_animated() {
            self.diagnostics.push(
                Diagnostic::warning(
                    "W0809",
                    "lights do not move: the transform at the shutter's start is used",
                    desc.span,
                )
                .not_honoured("moving lights: at the shutter's start"),
            );
        }
        let render_from_light = self.context.render_from_world.compose(&desc.world_from_light.start);
        let scale = self.factor(&desc.scale)?;
        let space = self.context.color_space;
        let at = |p: [f32; 3]| render_from_light.point(Point3::new(p[0], p[1], p[2]));
        match &desc.kind {
            LightKind::Point { intensity, from, power } => {
                let shine = self.shine(intensity, desc.color_space)?;
                let asked = self.target("power", power).map_or(1.0, |phi| phi / (4.0 * PI));
                let intensity = Emission::new(&shine.spectrum, scale * shine.unit * asked, space);
                Some(Light::Point(PointLight { p: at(*from), intensity }))
            }
            LightKind::Distant { radiance, from, to, illuminance } => {
                let shine = self.shine(radiance, desc.color_space)?;
                let towards = self.direction(vec3(*from) - vec3(*to), desc.span)?;
                let wi = self.direction(render_from_light.vector(towards), desc.span)?;
                let asked = self.target("illuminance", illuminance).unwrap_or(1.0);
                let irradiance = Emission::new(&shine.spectrum, scale * shine.unit * asked, space);
                Some(Light::Distant(DistantLight { wi, irradiance, scene: self.scene }))
            }
            LightKind::Spot { intensity, from, to, cone_angle, cone_delta_angle, power } => {
                let shine = self.shine(intensity, desc.color_space)?;
                let axis = self.direction(vec3(*to) - vec3(*from), desc.span)?;
                if !(cone_angle.value > 0.0 && cone_angle.value <= 180.0) {
                    let message = format!("a cone angle of {} degrees is outside (0, 180]", cone_angle.value);
                    self.error("E0804", message, cone_angle.span);
                    return None;
                }
                if !(cone_delta_angle.value >= 0.0) {
                    let message = format!("a cone delta angle of {} degrees is below 0", cone_delta_angle.value);
                    self.error("E0804", message, cone_delta_angle.span);
                    return None;
                }
                if cone_delta_angle.value > cone_angle.value {
                    let message = "the soft border is wider than the cone; it starts at the axis";
                    self.warning("W0810", message, cone_delta_angle.span);
                }
                let start = (cone_angle.value - cone_delta_angle.value).max(0.0);
                let (cos_start, cos_end) = (cos(start.to_radians()), cos(cone_angle.value.to_radians()));
                let asked =
                    self.target("power", power).map_or(1.0, |phi| phi / SpotLight::solid_angle(cos_start, cos_end));
                Some(Light::Spot(SpotLight {
                    p: at(*from),
                    axis,
                    orientation: Orientation::new(&render_from_light),
                    intensity: Emission::new(&shine.spectrum, scale * shine.unit * asked, space),
                    cos_start,
                    cos_end,
                }))
            }
            LightKind::Goniometric { intensity, file, power } => {
                let shine = self.shine(intensity, desc.color_space)?;
                let (values, size): (Box<[f32]>, usize) = match file {
                    Some(file) => {
                        let image = self.square_image(file)?;
                        let mean = |c: [f32; 3]| (c[0] + c[1] + c[2]) * (1.0 / 3.0);
                        (image.pixels().map(mean).collect(), image.width())
                    }
                    None => {
                        self.warning("W0810", "a goniometric light without \"filename\" is a point light", desc.span);
                        (Box::new([1.0]), 1)
                    }
                };
                let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
                let asked = self.target("power", power);
                let asked = asked.map_or(1.0, |phi| if mean > 0.0 { phi / (4.0 * PI * mean as f32) } else { 0.0 });
                // The image's z is the light's y.
                let mut swap = Transform::IDENTITY.m;
                swap.swap(1, 2);
                let orientation = Orientation::new(&render_from_light.compose(&Transform { m: swap, inv: swap }));
                let intensity = Emission::new(&shine.spectrum, scale * shine.unit * asked, space);
                GoniometricLight::new(at([0.0; 3]), orientation, intensity, values, size)
                    .map(|l| Light::Goniometric(Box::new(l)))
            }
            LightKind::Projection { intensity: _, file, fov, power } => {
                let image = self.image(file)?;
                if !(fov.value > 0.0 && fov.value < 180.0) {
                    let message = format!("a field of view of {} degrees is outside (0, 180)", fov.value);
                    self.error("E0804", message, fov.span);
                    return None;
                }
                let screen = Screen::new(image.width(), image.height(), fov.value);
                let mut scale = scale * illuminant_unit(image.space());
                if let Some(phi) = self.target("power", power) {
                    let mean = image.mean_rgb(|uv| screen.solid_angle_by_area(uv));
                    let luminous = screen.area() * image.space().luminance(mean);
                    scale *= if luminous > 0.0 { phi / luminous } else { 0.0 };
                }
                let flip = Transform::scale(1.0, -1.0, 1.0).unwrap_or(Transform::IDENTITY);
                let orientation = Orientation::new(&render_from_light.compose(&flip));
                ProjectionLight::new(at([0.0; 3]), orientation, image, scale, fov.value)
                    .map(|l| Light::Projection(Box::new(l)))
            }
            LightKind::Infinite { radiance, file, portal, illuminance } => {
                if let (Some(_), Some(file)) = (radiance, file) {
                    self.error("E0807", "an infinite light has either \"L\" or \"filename\", not both", file.span);
                    return None;
                }
                let asked = self.target("illuminance", illuminance);
                match (file, portal) {
                    (None, None) => self.uniform_environment(desc, radiance, scale, asked),
                    _ => self.image_environment(desc, &render_from_light, scale, asked),
                }
            }
        }
    }

    fn radiance_or_white(&mut self, radiance: &Option<Spanned<SpectrumDesc>>, space: ColorSpaceName) -> Option<Shine> {
        let white = Spanned::unplaced(SpectrumDesc::Rgb([1.0; 3], space));
        self.shine(radiance.as_ref().unwrap_or(&white), space)
    }

    fn uniform_environment(
        &mut self,
        desc: &LightDesc,
        radiance: &Option<Spanned<SpectrumDesc>>,
        scale: f32,
        illuminance: Option<f32>,
    ) -> Option<Light> {
        let shine = self.radiance_or_white(radiance, desc.color_space)?;
        let scale = scale * shine.unit * illuminance.map_or(1.0, |e| e / PI);
        let radiance = Emission::new(&shine.spectrum, scale, self.context.color_space);
        Some(Light::UniformInfinite(UniformInfiniteLight { radiance, scene: self.scene }))
    }

    fn image_environment(
        &mut self,
        desc: &LightDesc,
        render_from_light: &Transform,
        scale: f32,
        illuminance: Option<f32>,
    ) -> Option<Light> {
        let LightKind::Infinite { radiance, file, portal, .. } = &desc.kind else { return None };
        let image = match file {
            Some(file) => self.square_image(file)?,
            // A uniform light behind a portal: one pixel, of the colour that the spectrum has.
            None => {
                let shine = self.radiance_or_white(radiance, desc.color_space)?;
                if !matches!(shine.spectrum.curve(), Curve::RgbIlluminant(_)) {
                    let span = radiance.as_ref().map_or(desc.span, |r| r.span);
                    self.warning("W0810", "behind a portal a spectrum is turned into RGB, as in pbrt-v4", span);
                }
                let xyz = spectrum_to_xyz(&shine.spectrum).map(|v| v as f32);
                let rgb = ColorSpace::srgb().from_xyz(xyz).map(|v| v.max(0.0));
                RadianceImage::from_pixels(1, 1, Box::new([rgb]), ColorSpace::srgb(), self.context.color_space)
            }
        };
        let mut scale = scale * illuminant_unit(image.space());
        if let Some(asked) = illuminance {
            let found = upper_illuminance(&image);
            scale *= if found > 0.0 { asked / found } else { 0.0 };
        }
        let orientation = Orientation::new(render_from_light);
        let Some(portal) = portal else {
            return ImageInfiniteLight::new(image, orientation, scale, self.scene)
                .map(|l| Light::ImageInfinite(Box::new(l)));
        };
        let corners: PortalDesc = portal.value;
        let corners = corners.map(|c| self.context.render_from_world.point(Point3::new(c[0], c[1], c[2])));
        match PortalInfiniteLight::new(corners, &image, &orientation, scale) {
            Ok(l) => Some(Light::PortalInfinite(Box::new(l))),
            Err(PortalError::NotRectangle) => {
                self.error(
                    "E0806",
                    "the four corners of this portal are not a rectangle, in order around it",
                    portal.span,
                );
                None
            }
            Err(PortalError::NotSquare) => {
                self.error("E0805", "the image behind a portal must be square", portal.span);
                None
            }
        }
    }

    /// The lights, and for each emitter the id of its light.
    fn area_lights(&mut self, emitters: Vec<Option<AreaEmitter>>) -> (Vec<Light>, Vec<Option<LightId>>) {
        // Descriptions are shared by the primitives of a shape; look-ups only, so its order never shows.
        let mut known: HashMap<*const AreaLightDesc, Option<AreaPart>> = HashMap::new();
        let mut list = Vec::with_capacity(emitters.len());
        let ids = emitters
            .into_iter()
            .map(|emitter| {
                let AreaEmitter { shape, faces, desc, alpha } = emitter?;
                let part = known.entry(Arc::as_ptr(&desc)).or_insert_with(|| self.area_part(&desc)).as_ref()?;
                let two_sided = desc.two_sided;
                let scale = part.power.map_or(1.0, |phi| {
                    let sides = if two_sided { 2.0 } else { 1.0 };
                    let luminous = part.luminance * sides * (shape.area() / faces as f32) * PI;
                    if luminous > 0.0 { phi / luminous } else { 0.0 }
                });
                list.push(Light::Area(AreaLight { shape, radiance: part.radiance.clone(), scale, two_sided, alpha }));
                Some(LightId(list.len() as u32 - 1))
            })
            .collect();
        (list, ids)
    }

    fn area_part(&mut self, desc: &AreaLightDesc) -> Option<AreaPart> {
        let scale = self.factor(&desc.scale)?;
        let power = self.target("power", &desc.power);
        let Some(file) = &desc.file else {
            let shine = self.radiance_or_white(&desc.radiance, desc.color_space)?;
            let emission = Emission::new(&shine.spectrum, scale * shine.unit, self.context.color_space);
            let radiance = AreaRadiance::Uniform(emission);
            // As pbrt-v4: of an RGB light, its colour is not taken out.
            return Some(AreaPart { radiance, power, luminance: 1.0 });
        };
        if desc.radiance.is_some() {
            self.error("E0807", "an area light has either \"L\" or \"filename\", not both", file.span);
            return None;
        }
        let image = self.image(file)?;
        let luminance = image.space().luminance(image.mean_rgb(|_| 1.0));
        let unit = illuminant_unit(space_of(desc.color_space));
        Some(AreaPart { radiance: AreaRadiance::image(image, scale * unit), power, luminance })
    }
}

/// What a shape's opacity is to its light; textures that are a number count as that number.
fn area_alpha(desc: &SceneDesc, alpha: Alpha) -> AreaAlpha {
    let number = match alpha {
        Alpha::Opaque => 1.0,
        Alpha::Constant(a) => a,
        Alpha::Texture(texture) => match desc.float_textures.get(texture.0 as usize).map(|t| &t.kind) {
            Some(FloatTextureKind::Basic(BasicTexture::Constant(Spanned { value: FloatParam::Value(a), .. }))) => *a,
            _ => return AreaAlpha::Texture(texture),
        },
    };
    if number <= 0.0 { AreaAlpha::Unseen } else { AreaAlpha::Constant(number.min(1.0)) }
}

/// What the primitives of one description share.
struct AreaPart {
    radiance: AreaRadiance,
    /// Luminous power asked for, of each primitive.
    power: Option<f32>,
    /// Mean luminance of the image, 1 without.
    luminance: f32,
}

/// The illuminance that pbrt-v4 takes an image to give to a surface facing light-space +z, in units of its scale.
///
/// It is half of the true one (2 pi instead of 4 pi over the number of pixels); kept, so that pictures agree.
fn upper_illuminance(image: &RadianceImage) -> f32 {
    let mut sum = 0.0;
    for y in 0..image.height() {
        for x in 0..image.width() {
            let w = warp::equal_area_square_to_sphere(image.center_of(x, y));
            let rgb = image.pixel(x, y);
            sum += f64::from(image.space().luminance(rgb)) * f64::from(w.z.max(0.0));
        }
    }
    (sum * 2.0 * std::f64::consts::PI / image.pixels().len() as f64) as f32
}
