//! Drawings of paths: over the picture that the camera sees, and in the scene as seen through from outside and above.
//!
//! [`draw_paths`] makes one SVG of the stories that [`replay`](irradiant_render::inspect::replay) tells. Files: this one (what
//! is drawn where), `marks` (paths as lines in space), `tables` (what is written below), [`canvas`] (the sheet).

pub mod canvas;
mod marks;
mod tables;

pub use tables::end_in_words;

use crate::render::Job;
use canvas::{Area, Canvas, Stroke, Type};
use irradiant_image::{Image, ImageError};
use irradiant_math::{Point3, Vec3};
use irradiant_render::inspect::view::{Axes, Grid, Outside, backdrop, camera_axes, is_seen, project, through};
use irradiant_render::inspect::{PathStory, story::LightEnd};
use irradiant_render::path::PathIntegrator;
use marks::{Ink, Mark};
use std::ops::RangeInclusive;

const BACKGROUND: &str = "#0f1115";
const PANEL: &str = "#171a21";
const EDGE: &str = "#2a2f3a";
const WORDS: &str = "#e6e8ee";
const QUIET: &str = "#9aa3b2";
/// Around places of lamps that light came from.
const LAMP_RING: &str = "#ffe9a0";
/// Space between things.
const GAP: f32 = 20.0;
const LEFT_WIDTH: f32 = 720.0;
const RIGHT_WIDTH: f32 = 460.0;

/// What is drawn.
#[derive(Clone, Debug)]
pub struct DrawingOptions {
    /// The heading.
    pub title: String,
    /// Only light after so many scattering events, with the paths to it; `None` draws all of every path.
    pub bounces: Option<RangeInclusive<u32>>,
    /// Samples for each pixel of the picture behind the paths.
    pub backdrop_samples: u32,
}

/// Draws paths of one or several samples as an SVG file that carries its pictures.
pub fn draw_paths(
    job: &Job,
    integrator: &PathIntegrator,
    stories: &[PathStory],
    options: &DrawingOptions,
) -> Result<String, ImageError> {
    let scene = &job.scene;
    let [film_width, film_height] = scene.resolution().map(|n| n as f32);
    // The picture fills the left column, unless it is higher than wide.
    let scale = (LEFT_WIDTH / film_width).min(LEFT_WIDTH / film_height);
    let (width, height) = (film_width * scale, film_height * scale);
    let top = 64.0;
    let view_height = ((height.max(480.0) - GAP) / 2.0).max(230.0);
    let left = Area { x: GAP + (LEFT_WIDTH - width) / 2.0, y: top, width, height };
    let right = |i: f32| Area {
        x: 2.0 * GAP + LEFT_WIDTH,
        y: top + i * (view_height + GAP),
        width: RIGHT_WIDTH,
        height: view_height,
    };

    let mut canvas = Canvas::default();
    let heading = Type { size: 20.0, color: WORDS, monospaced: false, bold: true };
    canvas.text([GAP, 40.0], &options.title, heading);

    let lines = marks::marks(job, stories, options);
    let (eye, axes) = camera_axes(scene);

    // From the camera.
    let pixels = [(width / 1.5).round().max(1.0) as usize, (height / 1.5).round().max(1.0) as usize];
    let seen = backdrop(scene, integrator, pixels[0], pixels[1], options.backdrop_samples.max(1));
    canvas.panel(left, PANEL, EDGE, 6.0);
    canvas.picture(left, &shown(&seen)?)?;
    let place = |p: Point3| {
        let film = project(scene, p)?;
        Some(([left.x + film.x * scale, left.y + film.y * scale], is_seen(scene, film, p)))
    };
    canvas.clipped(left, |canvas| {
        for mark in &lines {
            // The eye's own ray is a point in its own picture.
            if mark.from_eye {
                continue;
            }
            draw(canvas, mark, &place, 24);
        }
        for story in stories {
            let at = [story.pixel[0] as f32 + 0.5, story.pixel[1] as f32 + 0.5].map(|v| v * scale);
            let rim = Stroke { color: "#ffffff", width: 1.6, opacity: 1.0, dash: "" };
            canvas.disc([left.x + at[0], left.y + at[1]], 7.0, "none", rim);
        }
    });

    // From outside, and from above.
    let frame = frame(scene.geometry.bounds(), eye, stories, &lines);
    for (i, (name, axes)) in [("from outside", turned(job, axes)), ("from above", above(job, axes))].iter().enumerate()
    {
        let area = right(i as f32);
        let view = Outside::around(*axes, &frame, area.width / area.height);
        let glass = through(scene, &view, area.width as usize, area.height as usize);
        canvas.panel(area, PANEL, EDGE, 6.0);
        canvas.picture(area, &glassy(&glass)?)?;
        let place = |p: Point3| {
            let q = view.place(p);
            Some(([area.x + q.x * area.width, area.y + q.y * area.height], true))
        };
        canvas.clipped(area, |canvas| {
            for mark in eye_marks(job, eye, &view).iter().chain(&lines) {
                draw(canvas, mark, &place, 1);
            }
        });
        let label = Type { size: 13.0, color: QUIET, monospaced: false, bold: false };
        canvas.text([area.x + 10.0, area.y + 20.0], name, label);
    }
    let label = Type { size: 13.0, color: QUIET, monospaced: false, bold: false };
    canvas.text([left.x + 10.0, left.y + 20.0], "from the camera", label);

    let bottom = (left.y + height).max(right(1.0).y + view_height) + GAP;
    let bottom = tables::legend(&mut canvas, [GAP, bottom + 12.0], &lines);
    let bottom = tables::write(&mut canvas, [GAP, bottom + GAP], job, stories, options);
    Ok(canvas.svg(3.0 * GAP + LEFT_WIDTH + RIGHT_WIDTH, bottom + GAP, BACKGROUND))
}

/// Draws a mark in a view. `place` says where a point lies and whether it is seen there.
fn draw(canvas: &mut Canvas, mark: &Mark, place: &dyn Fn(Point3) -> Option<([f32; 2], bool)>, pieces: usize) {
    let look = mark.ink.look();
    let at = |i: usize| mark.a + (mark.b - mark.a) * (i as f32 / pieces as f32);
    // Runs of pieces that are all seen, or all hidden.
    let mut run: Vec<[f32; 2]> = Vec::new();
    let mut run_is_seen = true;
    let flush = |canvas: &mut Canvas, run: &mut Vec<[f32; 2]>, seen: bool| {
        let opacity = mark.opacity * if seen { look.opacity } else { 0.35 * look.opacity };
        let halo = Stroke { color: "#000000", width: look.width + 2.2, opacity: 0.45 * opacity, dash: look.dash };
        canvas.line(run, halo);
        canvas.line(run, Stroke { opacity, ..look });
        run.clear();
    };
    for i in 0..pieces {
        let ends = [at(i), at(i + 1)].map(place);
        let [Some((a, _)), Some((b, _))] = ends else {
            flush(canvas, &mut run, run_is_seen);
            continue;
        };
        let seen = place(at(i) + (at(i + 1) - at(i)) * 0.5).is_some_and(|(_, seen)| seen);
        if run.is_empty() || seen != run_is_seen {
            flush(canvas, &mut run, run_is_seen);
            run.push(a);
            run_is_seen = seen;
        }
        run.push(b);
    }
    flush(canvas, &mut run, run_is_seen);
    let Some((end, seen)) = place(mark.b) else { return };
    let fade = if seen { 1.0 } else { 0.5 };
    match mark.ink {
        Ink::Segment(_) if mark.is_vertex => {
            let rim = Stroke { color: "#000000", width: 1.2, opacity: 0.8 * fade, dash: "" };
            canvas.disc(end, if mark.label.is_empty() { 2.6 } else { 4.2 }, look.color, rim);
        }
        Ink::Segment(_) | Ink::Eye => {}
        Ink::Lit(_) => {
            let rim = Stroke { color: LAMP_RING, width: 1.4, opacity: mark.opacity * fade, dash: "" };
            canvas.disc(end, 5.0, "none", rim);
            canvas.disc(end, 2.0, "#ffe9a0", Stroke { width: 0.0, ..rim });
        }
        Ink::Blocked => {
            let r = 3.2;
            for (x, y) in [(r, r), (r, -r)] {
                canvas.line(&[[end[0] - x, end[1] - y], [end[0] + x, end[1] + y]], Stroke { dash: "", ..look });
            }
        }
    }
    if !mark.label.is_empty() {
        let label = Type { size: 13.0, color: "#ffffff", monospaced: false, bold: true };
        canvas.text([end[0] + 7.0, end[1] - 6.0], &mark.label, label);
    }
}

/// The points that views from outside must show: the paths, and of the scene and the camera what is not far from them.
fn frame(bounds: irradiant_math::Bounds3, eye: Point3, stories: &[PathStory], marks: &[Mark]) -> Vec<Point3> {
    let mut points: Vec<Point3> = stories.iter().flat_map(|s| s.vertices.iter().map(|v| v.at.p)).collect();
    points.extend(stories.iter().flat_map(|s| &s.found).filter_map(|f| match f.to {
        LightEnd::Point(p) => Some(p),
        LightEnd::Direction(_) => None,
    }));
    points.extend(marks.iter().filter(|m| m.is_vertex).map(|m| m.b));
    if points.is_empty() {
        points.push(eye);
    }
    let extent = |points: &[Point3]| irradiant_math::Bounds3::from_points(points.iter().copied());
    let paths = extent(&points).diagonal().length();
    if !bounds.is_empty() && bounds.diagonal().length() < 6.0 * paths.max(1e-6) {
        points.extend((0..8).map(|i| bounds.corner(i)));
    }
    let box_of = extent(&points);
    if (eye - box_of.center()).length() < 0.8 * box_of.diagonal().length() {
        points.push(eye);
    }
    if box_of.diagonal().length() == 0.0 {
        points.extend([-1.0, 1.0].map(|s| box_of.center() + Vec3::new(s, s, s)));
    }
    points
}

/// The world's axis that is nearest to the camera's up, in render space.
fn world_up(job: &Job, up: Vec3) -> Vec3 {
    let render_from_world = job.scene.world_from_render().inverse();
    let axes = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::Z].map(|a| render_from_world.vector(a));
    let signed = axes.into_iter().flat_map(|a| [a.normalize(), -a.normalize()]);
    signed.max_by(|a, b| a.dot(up).total_cmp(&b.dot(up))).unwrap_or(up)
}

/// The camera's axes laid level.
fn level(job: &Job, axes: Axes) -> Axes {
    let up = world_up(job, axes.up);
    let flat = |v: Vec3| v - up * v.dot(up);
    let forward = flat(axes.forward);
    // A camera that looks straight down has its forward in its up.
    let forward = if forward.length() > 0.05 { forward } else { flat(axes.up) }.normalize();
    let right = flat(axes.right);
    let right = (right - forward * right.dot(forward)).normalize();
    Axes { right, up, forward }
}

/// From beside and above the camera.
fn turned(job: &Job, axes: Axes) -> Axes {
    let a = level(job, axes);
    let ((turn_sin, turn_cos), (tilt_sin, tilt_cos)) = (0.62f32.sin_cos(), 0.42f32.sin_cos());
    let forward = a.forward * turn_cos + a.right * turn_sin;
    let right = a.right * turn_cos - a.forward * turn_sin;
    Axes { right, up: forward * tilt_sin + a.up * tilt_cos, forward: forward * tilt_cos - a.up * tilt_sin }
}

/// A plan: up in the drawing is where the camera looks.
fn above(job: &Job, axes: Axes) -> Axes {
    let a = level(job, axes);
    Axes { right: a.right, up: a.forward, forward: -a.up }
}

/// The camera as a small pyramid.
fn eye_marks(job: &Job, eye: Point3, view: &Outside) -> Vec<Mark> {
    let [width, height] = job.scene.resolution().map(|n| n as f32);
    let length = 0.16 * view.half_width.min(view.half_height);
    let corners: Vec<Point3> = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
        .into_iter()
        .filter_map(|(x, y)| {
            let film = irradiant_math::Point2::new(x, y);
            let ray = job.scene.camera.generate_ray(film, irradiant_math::Point2::new(0.5, 0.5), 0.5)?.ray;
            Some(ray.at(length))
        })
        .collect();
    let mark =
        |a, b| Mark { a, b, ink: Ink::Eye, opacity: 1.0, is_vertex: false, from_eye: false, label: String::new() };
    let sides = corners.iter().map(|&c| mark(eye, c));
    sides.chain((0..corners.len()).map(|i| mark(corners[i], corners[(i + 1) % corners.len()]))).collect()
}

fn bytes(grid: &Grid<[f32; 3]>, to_srgb: impl Fn([f32; 3]) -> [f32; 3]) -> Result<Image, ImageError> {
    let quantise = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    let samples = grid.values.iter().flat_map(|&rgb| to_srgb(rgb).map(quantise)).collect();
    Image::from_u8(grid.width, grid.height, &["R", "G", "B"], samples, irradiant_image::Encoding::Srgb)
}

/// The picture at an exposure that shows most of it, a little dimmed so that lines stand out.
fn shown(grid: &Grid<[f32; 3]>) -> Result<Image, ImageError> {
    let mut brightness: Vec<f32> = grid.values.iter().map(|c| c.iter().fold(0.0, |m: f32, &v| m.max(v))).collect();
    brightness.sort_by(f32::total_cmp);
    let bright = brightness[(brightness.len() - 1) * 94 / 100];
    let exposure = if bright > 0.0 { 0.9 / bright } else { 1.0 };
    let encode = |v: f32| if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    bytes(grid, |rgb| rgb.map(|v| 0.72 * encode((v * exposure).clamp(0.0, 1.0))))
}

/// Opacity, edges and lamps as colours.
fn glassy(grid: &Grid<[f32; 3]>) -> Result<Image, ImageError> {
    let mix = |a: [f32; 3], b: [f32; 3], t: f32| std::array::from_fn(|i| a[i] + (b[i] - a[i]) * t.clamp(0.0, 1.0));
    bytes(grid, |[opacity, edge, lamp]| {
        let body = mix([0.09, 0.102, 0.129], [0.45, 0.55, 0.70], 0.85 * opacity);
        let body = mix(body, [0.98, 0.85, 0.50], 0.30 * lamp);
        mix(body, [0.46, 0.53, 0.66], 0.75 * edge)
    })
}
