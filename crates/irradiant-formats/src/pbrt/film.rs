//! `Film` and `PixelFilter`.

use super::legacy::unknown_name;
use super::params::Params;
use super::reader::Reader;
use irradiant_scene::desc::{FilmDesc, FilmKind, FilterDesc, FilterKind};
use irradiant_scene::{Diagnostic, Span, Spanned};

const SENSORS: &[&str] = &[
    "cie1931",
    "canon_eos_100d",
    "canon_eos_1dx_mkii",
    "canon_eos_200d",
    "canon_eos_200d_mkii",
    "canon_eos_5d",
    "canon_eos_5d_mkii",
    "canon_eos_5d_mkiii",
    "canon_eos_5d_mkiv",
    "canon_eos_5ds",
    "canon_eos_m",
    "hasselblad_l1d_20c",
    "nikon_d810",
    "nikon_d850",
    "sony_ilce_6400",
    "sony_ilce_7m3",
    "sony_ilce_7rm3",
    "sony_ilce_9",
];

/// Pixels along an edge at most: more than any file format of images holds.
const MAX_RESOLUTION: i32 = 1 << 20;

pub(crate) fn film(r: &Reader, name: &Spanned<String>, p: &Params) -> FilmDesc {
    let default = FilmDesc::default();
    let kind = match name.value.as_str() {
        "rgb" => FilmKind::Rgb,
        "gbuffer" => FilmKind::Gbuffer {
            camera_space: p.choice(r, "coordinatesystem", &[("camera", true), ("world", false)], true),
        },
        "spectral" => FilmKind::Spectral {
            n_buckets: p.integer_in(r, "nbuckets", 16, 1..=1 << 12).map(|n| n as u32),
            lambda_min: p.float_or(r, "lambdamin", 360.0),
            lambda_max: p.float_or(r, "lambdamax", 830.0),
        },
        _ => {
            unknown_name(r, "E0207", "film", name, &["rgb", "gbuffer", "spectral"]);
            return default;
        }
    };
    let x = p.integer_in(r, "xresolution", default.resolution.value[0] as i32, 1..=MAX_RESOLUTION);
    let y = p.integer_in(r, "yresolution", default.resolution.value[1] as i32, 1..=MAX_RESOLUTION);
    let span = if x.span == Span::NONE { y.span } else { x.span };
    let crop_window = p.floats_n::<4>(r, "cropwindow");
    let pixel_bounds = p.integers(r, "pixelbounds").and_then(|b| match b.value {
        [x0, x1, y0, y1] => Some(Spanned::new([*x0, *x1, *y0, *y1], b.span)),
        _ => {
            r.push(Diagnostic::error("E0303", "\"pixelbounds\" needs four values", b.span).label("x0 x1 y0 y1"));
            None
        }
    });
    if let (Some(bounds), Some(window)) = (&pixel_bounds, &crop_window) {
        r.push(
            Diagnostic::warning("W0115", "both \"pixelbounds\" and \"cropwindow\" are given", bounds.span)
                .also(window.span, "the crop window counts"),
        );
    }
    let sensor = p.string(r, "sensor").unwrap_or(default.sensor);
    if !SENSORS.contains(&sensor.value.as_str()) {
        r.unknown("E0213", "sensor", &sensor, SENSORS);
    }
    let desc = FilmDesc {
        kind,
        resolution: Spanned::new([x.value as u32, y.value as u32], span),
        filename: p.string(r, "filename").filter(|f| !f.is_empty()),
        pixel_bounds,
        crop_window,
        diagonal: p.float_or(r, "diagonal", 35.0),
        sensor,
        iso: p.float_or(r, "iso", 100.0),
        white_balance: p.float_or(r, "whitebalance", 0.0),
        exposure_time: p.float(r, "exposuretime"),
        max_component_value: p.float_or(r, "maxcomponentvalue", f32::INFINITY),
        save_fp16: p.bool_or(r, "savefp16", true),
        color_space: p.color_space,
        span: p.span,
    };
    p.finish(r);
    desc
}

pub(crate) fn filter(r: &Reader, name: &Spanned<String>, p: &Params) -> FilterDesc {
    let (kind, radius) = match name.value.as_str() {
        "box" => (FilterKind::Box, 0.5),
        "gaussian" => (FilterKind::Gaussian { sigma: p.float_or(r, "sigma", 0.5) }, 1.5),
        "mitchell" => {
            (FilterKind::Mitchell { b: p.float_or(r, "B", 1.0 / 3.0), c: p.float_or(r, "C", 1.0 / 3.0) }, 2.0)
        }
        "sinc" => (FilterKind::Sinc { tau: p.float_or(r, "tau", 3.0) }, 4.0),
        "triangle" => (FilterKind::Triangle, 2.0),
        _ => {
            unknown_name(r, "E0210", "filter", name, &["box", "gaussian", "mitchell", "sinc", "triangle"]);
            return FilterDesc::default();
        }
    };
    let desc = FilterDesc {
        kind,
        x_radius: p.float_or(r, "xradius", radius),
        y_radius: p.float_or(r, "yradius", radius),
        span: p.span,
    };
    p.finish(r);
    desc
}
