//! `Camera`.

use super::legacy::unknown_name;
use super::params::{Params, number_file};
use super::reader::Reader;
use irradiant_scene::desc::camera::ApertureShape;
use irradiant_scene::desc::{CameraDesc, CameraKind, FileDesc, MotionDesc};
use irradiant_scene::{Diagnostic, Spanned};
use std::sync::Arc;

pub(crate) fn camera(r: &Reader, name: &Spanned<String>, p: &Params, camera_from_world: MotionDesc) -> CameraDesc {
    let shutter_open = p.float_or(r, "shutteropen", 0.0);
    let shutter_close = p.float_or(r, "shutterclose", 1.0);
    if shutter_close.value <= shutter_open.value {
        let message = format!("the shutter closes at {}, opens at {}", shutter_close.value, shutter_open.value);
        let span =
            if shutter_close.span == irradiant_scene::Span::NONE { shutter_open.span } else { shutter_close.span };
        r.push(Diagnostic::error("E0309", message, span).help("no light would reach the film; close it later"));
    }
    // pbrt-v4 reads these for all three projections, although the spherical camera has no use for them.
    let lens_radius = || p.float_or(r, "lensradius", 0.0);
    let focal_distance = || p.float_or(r, "focaldistance", 1e6);
    let frame_aspect_ratio = || p.float(r, "frameaspectratio");
    let screen_window = || p.floats_n::<4>(r, "screenwindow");
    let kind = match name.value.as_str() {
        "perspective" => CameraKind::Perspective {
            fov: p.float_or(r, "fov", 90.0),
            lens_radius: lens_radius(),
            focal_distance: focal_distance(),
            frame_aspect_ratio: frame_aspect_ratio(),
            screen_window: screen_window(),
        },
        "orthographic" => CameraKind::Orthographic {
            lens_radius: lens_radius(),
            focal_distance: focal_distance(),
            frame_aspect_ratio: frame_aspect_ratio(),
            screen_window: screen_window(),
        },
        "spherical" => {
            let _ = (lens_radius(), focal_distance(), frame_aspect_ratio(), screen_window());
            CameraKind::Spherical {
                equirectangular: p.choice(r, "mapping", &[("equalarea", false), ("equirectangular", true)], false),
            }
        }
        "realistic" => realistic(r, p),
        _ => {
            unknown_name(r, "E0206", "camera", name, &["perspective", "orthographic", "spherical", "realistic"]);
            return CameraDesc { camera_from_world, ..CameraDesc::default() };
        }
    };
    p.finish(r);
    CameraDesc { kind, camera_from_world, shutter_open, shutter_close, span: p.span }
}

fn realistic(r: &Reader, p: &Params) -> CameraKind {
    let aperture_diameter = p.float_or(r, "aperturediameter", 1.0);
    let focus_distance = p.float_or(r, "focusdistance", 10.0);
    let aperture = match p.string(r, "aperture") {
        None => ApertureShape::Circular,
        Some(name) => match name.value.as_str() {
            "" => ApertureShape::Circular,
            "gaussian" => ApertureShape::Gaussian,
            "square" => ApertureShape::Square,
            "pentagon" => ApertureShape::Pentagon,
            "star" => ApertureShape::Star,
            _ => ApertureShape::Image(r.file("aperture image", name).value),
        },
    };
    let file = p.string(r, "lensfile").filter(|f| !f.is_empty());
    if file.is_none() {
        p.missing(r, "\"string lensfile\"");
    }
    let lens = file.as_ref().and_then(|f| lens(r, f)).unwrap_or_default();
    let lens_file = file.map(|f| FileDesc { path: r.resolve(&f), name: f.value });
    CameraKind::Realistic { lens_file, lens, aperture_diameter, focus_distance, aperture }
}

fn lens(r: &Reader, file: &Spanned<String>) -> Option<Arc<[[f32; 4]]>> {
    let bytes = r.bytes("lens file", file, &r.resolve(file), file.span)?;
    let complain = |message: String| {
        r.push(
            Diagnostic::error("E1007", format!("lens file \"{}\": {message}", file.value), file.span)
                .help("each line: curvature radius, thickness, index of refraction, aperture diameter (mm)"),
        );
    };
    match number_file(&bytes) {
        Err(line) => complain(format!("line {line} holds something that is not a number")),
        Ok(values) if values.is_empty() || values.len() % 4 != 0 => {
            complain(format!("{} numbers, which is not a multiple of 4", values.len()));
        }
        Ok(values) => return Some(values.as_chunks::<4>().0.into()),
    }
    None
}
