//! From the description of a camera to the camera, and to the space that everything is rendered in.

use super::aperture::Mask;
use super::footprint::sample_scale;
use super::lens::{Element, Lens, ThickLens};
use super::projective::{Orthographic, Perspective, ScreenWindow, ThinLens};
use super::realistic::Realistic;
use super::spherical::Spherical;
use super::{Camera, FootprintEstimator, Model};
use irradiant_image::ReadOptions;
use irradiant_math::{Affine, AnimatedTransform, Point3, Transform};
use irradiant_scene::desc::camera::ApertureShape;
use irradiant_scene::desc::settings::RenderSpace;
use irradiant_scene::desc::{CameraDesc, CameraKind, FilmDesc};
use irradiant_scene::{Assets, Diagnostic, Diagnostics, Span, Spanned};

/// A camera and what follows from it for the scene.
#[derive(Clone, Debug)]
pub struct CompiledCamera {
    /// Makes rays.
    pub camera: Camera,
    /// Where everything else has to be put.
    pub render_from_world: Transform,
    /// At shutter opening.
    pub camera_from_world: Transform,
    /// Sizes of pixels on surfaces.
    pub footprint: FootprintEstimator,
    /// The shutter's interval, from opening to closing.
    pub exposure_time: f32,
}

/// Makes a camera for a film whose resolution is final. `None` after an error.
///
/// With `Option "disablepixeljitter"` pass one sample per pixel: all samples then stand for a whole pixel, as in pbrt-v4.
pub fn compile(
    desc: &CameraDesc,
    film: &FilmDesc,
    samples_per_pixel: u32,
    render_space: RenderSpace,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<CompiledCamera> {
    let errors = diagnostics.error_count();
    let shutter = shutter(desc, diagnostics);
    let spaces = Spaces::new(desc, render_space, shutter[0]);
    if spaces.is_none() {
        diagnostics.push(
            Diagnostic::error("E0911", "the camera's transform is singular or projective", desc.span)
                .help("it must be made of translations, rotations and scales that are not zero"),
        );
    }
    // The model lies in render space when the camera rests, else in camera space; a stand-in space serves to find more
    // errors.
    let model_space = match &spaces {
        Some(spaces) if !spaces.render_from_camera.is_animated() => *spaces.render_from_camera.start(),
        _ => Transform::IDENTITY,
    };
    let resolution = film.resolution.value.map(|n| n.max(1));
    let model = model(desc, film, resolution, &model_space, assets, diagnostics);
    let (spaces, model) = spaces.zip(model).filter(|_| diagnostics.error_count() == errors)?;
    if spaces.has_scale {
        diagnostics.push(
            Diagnostic::warning("W0911", "the camera's transform scales", desc.span)
                .label("lens radius and focal distance are scaled with it")
                .help("keep Scale out of the transform of the camera, but for mirroring by -1"),
        );
    }
    let Spaces { render_from_world, camera_from_world, render_from_camera, .. } = spaces;
    let origin = render_from_camera.at(shutter[0]).point(Point3::ZERO);
    let camera = Camera {
        shutter,
        footprint_scale: sample_scale(samples_per_pixel),
        motion: render_from_camera.is_animated().then(|| Box::new(render_from_camera)),
        model,
    };
    let footprint = FootprintEstimator::new(&camera, resolution, origin);
    Some(CompiledCamera {
        camera,
        render_from_world,
        camera_from_world,
        footprint,
        exposure_time: shutter[1] - shutter[0],
    })
}

fn shutter(desc: &CameraDesc, diagnostics: &mut Diagnostics) -> [f32; 2] {
    let (open, close) = (desc.shutter_open.value, desc.shutter_close.value);
    if !(open.is_finite() && close.is_finite()) {
        let at = if open.is_finite() { desc.shutter_close.span } else { desc.shutter_open.span };
        diagnostics.push(Diagnostic::error("E0910", "the shutter's times must be finite", at));
        return [0.0, 1.0];
    }
    if close < open {
        diagnostics.push(
            Diagnostic::warning(
                "W0910",
                format!("the shutter closes at {close}, before it opens at {open}; the two are swapped"),
                desc.shutter_close.span,
            )
            .also(desc.shutter_open.span, "opens here"),
        );
        return [close, open];
    }
    [open, close]
}

/// How the spaces hang together.
struct Spaces {
    render_from_world: Transform,
    camera_from_world: Transform,
    render_from_camera: AnimatedTransform,
    has_scale: bool,
}

impl Spaces {
    fn new(desc: &CameraDesc, render_space: RenderSpace, shutter_open: f32) -> Option<Self> {
        let motion = &desc.camera_from_world;
        let (t0, t1) = (motion.start_time as f32, motion.end_time as f32);
        let (start, end) = (affine(motion.start.inverse()), affine(motion.end.inverse()));
        let world_from_camera = AnimatedTransform::new(start, end, t0, t1)?;
        let at = |time: f32| {
            if world_from_camera.is_animated() { from_affine(&world_from_camera.at(time)) } else { Some(start) }
        };
        let middle = at(0.5 * (t0 + t1))?;
        let render_from_world = match render_space {
            RenderSpace::World => Transform::IDENTITY,
            RenderSpace::Camera => middle.inverse(),
            RenderSpace::CameraWorld => {
                let [x, y, z] = middle.point64([0.0; 3]);
                Transform::translate(-x, -y, -z)
            }
        };
        Some(Self {
            camera_from_world: at(shutter_open)?.inverse(),
            render_from_camera: AnimatedTransform::new(
                affine(render_from_world.compose(&start)),
                affine(render_from_world.compose(&end)),
                t0,
                t1,
            )?,
            render_from_world,
            has_scale: has_scale(&start) || has_scale(&end),
        })
    }
}

/// With the last row exact, which inverting and composing leave so only nearly.
fn affine(mut t: Transform) -> Transform {
    let nearly = |row: &[f64; 4]| (0..4).all(|i| (row[i] - f64::from(u8::from(i == 3))).abs() < 1e-9);
    if nearly(&t.m[3]) && nearly(&t.inv[3]) {
        t.m[3] = [0.0, 0.0, 0.0, 1.0];
        t.inv[3] = [0.0, 0.0, 0.0, 1.0];
    }
    t
}

fn from_affine(a: &Affine) -> Option<Transform> {
    let mut m = Transform::IDENTITY.m;
    for (row, values) in m.iter_mut().zip(&a.m) {
        *row = values.map(|x| x as f64);
    }
    Transform::from_matrix(m)
}

fn has_scale(t: &Transform) -> bool {
    // pbrt-v4's tolerance.
    (0..3).any(|i| ((0..3).map(|k| t.m[k][i] * t.m[k][i]).sum::<f64>() - 1.0).abs() > 1e-3)
}

/// Complains unless a value is in its range.
fn check(value: &Spanned<f32>, valid: bool, name: &str, range: &str, diagnostics: &mut Diagnostics) -> bool {
    if !valid {
        let message = format!("{name} {} is outside of its range", value.value);
        diagnostics.push(Diagnostic::error("E0912", message, value.span).label(range));
    }
    valid
}

fn thin_lens(radius: &Spanned<f32>, distance: &Spanned<f32>, diagnostics: &mut Diagnostics) -> Option<ThinLens> {
    let positive = |x: f32| x > 0.0 && x.is_finite();
    let valid = radius.value >= 0.0 && radius.value.is_finite();
    let valid = check(radius, valid, "lens radius", "must be 0 or more", diagnostics);
    // Of no consequence for a pinhole.
    let sharp = radius.value == 0.0 || positive(distance.value);
    let sharp = check(distance, sharp, "focal distance", "must be above 0", diagnostics);
    (valid && sharp).then_some(ThinLens { radius: radius.value as f64, focal_distance: distance.value as f64 })
}

fn screen_window(
    aspect: &Option<Spanned<f32>>,
    window: &Option<Spanned<[f32; 4]>>,
    resolution: [u32; 2],
    diagnostics: &mut Diagnostics,
) -> Option<ScreenWindow> {
    let mut valid = true;
    if let Some(aspect) = aspect {
        let positive = aspect.value > 0.0 && aspect.value.is_finite();
        valid = check(aspect, positive, "frame aspect ratio", "must be above 0", diagnostics);
    }
    let Some(window) = window else {
        let of_film = resolution[0] as f64 / resolution[1] as f64;
        return valid.then(|| ScreenWindow::of_aspect(aspect.map_or(of_film, |a| a.value as f64)));
    };
    let [x0, x1, y0, y1] = window.value.map(|x| x as f64);
    if !(window.value.iter().all(|x| x.is_finite()) && x0 != x1 && y0 != y1) {
        diagnostics.push(
            Diagnostic::error("E0913", "the screen window is empty", window.span).label("x0, x1, y0, y1 are expected"),
        );
        return None;
    }
    valid.then_some(ScreenWindow { x: [x0, x1], y: [y0, y1] })
}

fn model(
    desc: &CameraDesc,
    film: &FilmDesc,
    resolution: [u32; 2],
    space: &Transform,
    assets: &dyn Assets,
    diagnostics: &mut Diagnostics,
) -> Option<Model> {
    match &desc.kind {
        CameraKind::Perspective { fov, lens_radius, focal_distance, frame_aspect_ratio, screen_window: window } => {
            let wide = fov.value > 0.0 && fov.value < 180.0;
            let wide = check(fov, wide, "field of view", "must be between 0 and 180 degrees", diagnostics);
            let lens = thin_lens(lens_radius, focal_distance, diagnostics);
            let screen = screen_window(frame_aspect_ratio, window, resolution, diagnostics);
            let (lens, screen) = lens.zip(screen).filter(|_| wide)?;
            let (sin, cos) = sin_cos_degrees(0.5 * fov.value as f64);
            Some(Model::Perspective(Perspective::new(sin / cos, &screen, lens, resolution, space)))
        }
        CameraKind::Orthographic { lens_radius, focal_distance, frame_aspect_ratio, screen_window: window } => {
            let lens = thin_lens(lens_radius, focal_distance, diagnostics);
            let screen = screen_window(frame_aspect_ratio, window, resolution, diagnostics);
            let (lens, screen) = lens.zip(screen)?;
            if lens.radius > 0.0 {
                let message = "an orthographic camera with a lens does not show a parallel projection";
                diagnostics.push(
                    Diagnostic::warning("W0912", message, lens_radius.span)
                        .label("rays start on a lens around the camera's position, as in pbrt-v4")
                        .help("leave out \"lensradius\", or use a \"perspective\" camera"),
                );
            }
            Some(Model::Orthographic(Orthographic::new(&screen, lens, resolution, space)))
        }
        CameraKind::Spherical { equirectangular } => Some(Model::Spherical(Spherical {
            equirectangular: *equirectangular,
            scale: resolution.map(|n| 1.0 / n as f32),
            space_from_camera: Affine::from_transform(space)?,
        })),
        CameraKind::Realistic { lens, aperture_diameter, focus_distance, aperture, .. } => {
            let positive = |x: f32| x > 0.0 && x.is_finite();
            let opens = positive(aperture_diameter.value);
            let opens = check(aperture_diameter, opens, "aperture diameter", "must be above 0 mm", diagnostics);
            let sharp = positive(focus_distance.value);
            let sharp = check(focus_distance, sharp, "focus distance", "must be above 0", diagnostics);
            let diagonal = positive(film.diagonal.value);
            let diagonal = check(&film.diagonal, diagonal, "film diagonal", "must be above 0 mm", diagnostics);
            let elements = elements(lens, aperture_diameter, desc.span, diagnostics);
            let mask = mask(aperture, aperture_diameter.span, assets, diagnostics);
            let (elements, mask) = elements.zip(mask).filter(|_| opens && sharp && diagonal)?;
            let diagonal = film.diagonal.value as f64 * 1e-3;
            let lens = focused(Lens { elements, mask }, focus_distance, diagonal, desc.span, diagnostics)?;
            let space = Affine::from_transform(space)?;
            Some(Model::Realistic(Box::new(Realistic::new(lens, diagonal, resolution, space))))
        }
    }
}

/// Read off a rotation's matrix, whose bits are the same on every platform.
fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    Transform::rotate(degrees, [0.0, 0.0, 1.0]).map_or((0.0, 1.0), |t| (t.m[1][0], t.m[0][0]))
}

/// The author's surfaces in metres, with the aperture stop set.
fn elements(
    lens: &[[f32; 4]],
    aperture_diameter: &Spanned<f32>,
    span: Span,
    diagnostics: &mut Diagnostics,
) -> Option<Vec<Element>> {
    if lens.is_empty() {
        diagnostics
            .push(Diagnostic::error("E0914", "a realistic camera needs a lens", span).help("name a \"lensfile\""));
        return None;
    }
    let mut elements = Vec::with_capacity(lens.len());
    for (i, row) in lens.iter().enumerate() {
        let [radius, thickness, eta, diameter] = row.map(|x| x as f64);
        let valid = row.iter().all(|x| x.is_finite()) && diameter > 0.0 && (eta == 0.0 || eta >= 1.0);
        if !valid {
            let message = format!("surface {} of the lens is not possible: {row:?}", i + 1);
            diagnostics.push(
                Diagnostic::error("E0914", message, span)
                    .help("each line: curvature radius, thickness, index of refraction, aperture diameter (mm)"),
            );
            return None;
        }
        let mut diameter = diameter;
        if radius == 0.0 {
            let wanted = aperture_diameter.value as f64;
            if wanted > diameter {
                let message = format!(
                    "the aperture of {wanted} mm is wider than the lens's widest, {diameter:.3} mm, which is taken"
                );
                diagnostics.push(Diagnostic::warning("W0913", message, aperture_diameter.span));
            } else {
                diameter = wanted;
            }
        }
        elements.push(Element { radius: radius * 1e-3, thickness: thickness * 1e-3, eta, opening: 0.5e-3 * diameter });
    }
    Some(elements)
}

/// The lens at the distance from the film that makes the focus distance sharp.
fn focused(
    mut lens: Lens,
    focus_distance: &Spanned<f32>,
    diagonal: f64,
    span: Span,
    diagnostics: &mut Diagnostics,
) -> Option<Lens> {
    let Some(thick) = ThickLens::new(&lens, 1e-3 * diagonal) else {
        diagnostics.push(
            Diagnostic::error("E0915", "no light passes along the axis of the lens", span)
                .help("is the aperture extremely small, or a surface of the lens in the way?"),
        );
        return None;
    };
    let rear = thick
        .shift_to_focus(focus_distance.value as f64)
        .map(|shift| lens.rear_z() + shift)
        .filter(|rear| *rear > 0.0 && rear.is_finite());
    let Some(rear) = rear else {
        let message = format!(
            "this lens of focal length {:.1} mm cannot be focused at {} m",
            1e3 * thick.focal_length(),
            focus_distance.value
        );
        diagnostics.push(Diagnostic::error("E0915", message, focus_distance.span).help("focus farther away"));
        return None;
    };
    if let Some(last) = lens.elements.last_mut() {
        last.thickness = rear;
    }
    Some(lens)
}

/// The outer `None` is an error, the inner a circular hole.
fn mask(shape: &ApertureShape, span: Span, assets: &dyn Assets, diagnostics: &mut Diagnostics) -> Option<Option<Mask>> {
    let file = match shape {
        ApertureShape::Circular => return Some(None),
        ApertureShape::Gaussian => return Mask::gaussian().map(Some),
        ApertureShape::Square => return Mask::square().map(Some),
        ApertureShape::Pentagon => return Mask::pentagon().map(Some),
        ApertureShape::Star => return Mask::star().map(Some),
        ApertureShape::Image(file) => file,
    };
    let bytes = match assets.read(&file.path) {
        Ok(bytes) => bytes,
        Err(why) => {
            let error = Diagnostic::error("E0916", format!("aperture image \"{}\": {why}", file.name), span);
            diagnostics.push(if why == irradiant_scene::AssetError::NotFound { error.missing() } else { error });
            return None;
        }
    };
    let problem = match irradiant_image::read(&bytes, &file.name, &ReadOptions::default()) {
        Ok(image) => match Mask::new(&image) {
            Some(mask) => return Some(Some(mask)),
            None => "it needs a grey channel or R, G and B, and must not be all black".to_string(),
        },
        Err(why) => why.to_string(),
    };
    diagnostics.push(Diagnostic::error("E0916", format!("aperture image \"{}\": {problem}", file.name), span));
    None
}
