//! Pictures of a scene without a film: from its camera, and through it from outside; and where points lie in them.

use super::tally::Tally;
use crate::integrator::RenderStats;
use crate::path::PathIntegrator;
use crate::record::NoRecord;
use irradiant_core::sampler::Sampler;
use irradiant_core::scene::Scene;
use irradiant_math::{Bounds3, Frame, Point2, Point3, Ray, Vec3};
use irradiant_scene::desc::SamplerKind;

/// A picture of numbers, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid<T> {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Row by row.
    pub values: Vec<T>,
}

/// Computes each value of a grid on all cores; the result does not depend on their number.
pub fn grid<T: Send>(width: usize, height: usize, value: impl Fn(usize, usize) -> T + Sync) -> Grid<T> {
    let workers = std::thread::available_parallelism().map_or(1, usize::from).min(height.max(1));
    let mut rows: Vec<(usize, Vec<T>)> = std::thread::scope(|scope| {
        let value = &value;
        let of_worker = move |worker: usize| -> Vec<(usize, Vec<T>)> {
            (worker..height).step_by(workers).map(|y| (y, (0..width).map(|x| value(x, y)).collect())).collect()
        };
        let others: Vec<_> = (1..workers).map(|worker| scope.spawn(move || of_worker(worker))).collect();
        let mut rows = of_worker(0);
        for other in others {
            // A panic in a row is a bug and stays one.
            rows.extend(other.join().unwrap_or_else(|why| std::panic::resume_unwind(why)));
        }
        rows
    });
    rows.sort_by_key(|(y, _)| *y);
    Grid { width, height, values: rows.into_iter().flat_map(|(_, row)| row).collect() }
}

/// What the camera sees of its whole film in so many pixels: the film's RGB, linear. For a backdrop: stratified anew, with
/// the box filter, and no part of any render's film.
pub fn backdrop(
    scene: &Scene,
    integrator: &PathIntegrator,
    width: usize,
    height: usize,
    samples: u32,
) -> Grid<[f32; 3]> {
    let [film_width, film_height] = scene.resolution();
    let scale = [film_width as f32 / width as f32, film_height as f32 / height as f32];
    let sampler = Sampler::new(SamplerKind::ZSobol, samples, [width as u32, height as u32], scene.seed);
    grid(width, height, |x, y| {
        let mut sum = [0.0; 3];
        for index in 0..samples {
            let stream = sampler.stream([x as i32, y as i32], index);
            let draws = stream.camera();
            let mut lambda = scene.sample_wavelengths(draws.wavelength);
            let film = Point2::new((x as f32 + draws.film.x) * scale[0], (y as f32 + draws.film.y) * scale[1]);
            let lens = if scene.camera.has_lens() { stream.lens() } else { Point2::new(0.5, 0.5) };
            let Some(ray) = scene.camera.generate_ray(film, lens, draws.time) else { continue };
            let mut stats = RenderStats::default();
            let radiance = integrator.radiance(scene, &ray, &stream, &mut lambda, &mut [], &mut stats, &mut NoRecord);
            let rgb = scene.film_rgb(radiance * ray.weight, &lambda);
            for c in 0..3 {
                if rgb[c].is_finite() {
                    sum[c] += rgb[c] / samples as f32;
                }
            }
        }
        sum
    })
}

/// Where the camera sees a point: film position in pixels of the full picture, perhaps outside of it. `None` behind the
/// camera, and where no place of the film looks at the point. By Newton's method on the camera's own rays through the
/// middle of its lens, so that it works for every camera.
pub fn project(scene: &Scene, p: Point3) -> Option<Point2> {
    let [width, height] = scene.resolution().map(|n| n as f32);
    let ray = |film: Point2| scene.camera.generate_ray(film, Point2::new(0.5, 0.5), 0.5).map(|r| r.ray);
    // How far the ray passes the point, seen from its origin: the two components of a unit vector across it.
    let miss = |film: Point2| {
        let ray = ray(film)?;
        let to = p - ray.o;
        Some((ray, to, Frame::from_z(ray.d)))
    };
    let start = [(0.5, 0.5), (0.25, 0.5), (0.75, 0.5), (0.5, 0.25), (0.5, 0.75), (0.1, 0.5), (0.9, 0.5)];
    for (x, y) in start {
        let mut film = Point2::new(x * width, y * height);
        for _ in 0..24 {
            let Some((here, to, frame)) = miss(film) else { break };
            let length = to.length();
            if !(length > 0.0) {
                return None;
            }
            let off = |ray: &Ray| {
                let along = (p - ray.o).dot(ray.d);
                // Where the ray is nearest to the point, seen from the first ray's frame.
                let q = ray.at(along) - p;
                [q.dot(frame.x), q.dot(frame.y)]
            };
            let e = off(&here);
            let step = 1e-3 * width.max(height);
            let (Some(right), Some(down)) =
                (ray(Point2::new(film.x + step, film.y)), ray(Point2::new(film.x, film.y + step)))
            else {
                break;
            };
            let (ex, ey) = (off(&right), off(&down));
            let j = [[(ex[0] - e[0]) / step, (ey[0] - e[0]) / step], [(ex[1] - e[1]) / step, (ey[1] - e[1]) / step]];
            let Some(d) = irradiant_math::solve::linear_2x2(j, e) else { break };
            // No farther than half the picture at once: a perspective folds beyond.
            let limit = |d: f32, size: f32| d.clamp(-0.5 * size, 0.5 * size);
            film = Point2::new(film.x - limit(d[0], width), film.y - limit(d[1], height));
            if d[0].abs().max(d[1].abs()) < 0.02 {
                let ray = ray(film)?;
                let seen = (p - ray.o).dot(ray.d) > 1e-4 * length;
                return (seen && film.x.is_finite() && film.y.is_finite()).then_some(film);
            }
            if !(film.x.abs() < 50.0 * width && film.y.abs() < 50.0 * height) {
                break;
            }
        }
    }
    None
}

/// True when nothing stands between the camera and a point, but what lies within a thousandth of the way of it.
pub fn is_seen(scene: &Scene, film: Point2, p: Point3) -> bool {
    let Some(ray) = scene.camera.generate_ray(film, Point2::new(0.5, 0.5), 0.5) else { return false };
    let distance = (p - ray.ray.o).length();
    !scene.geometry.occluded(&ray.ray, distance * 0.999, &scene.alpha())
}

/// Which way the camera looks, in render space: right, up, forward, about orthonormal.
#[derive(Clone, Copy, Debug)]
pub struct Axes {
    /// Towards the right of the picture.
    pub right: Vec3,
    /// Towards its top.
    pub up: Vec3,
    /// Into it.
    pub forward: Vec3,
}

/// The camera's axes at the middle of its film, and where it stands.
pub fn camera_axes(scene: &Scene) -> (Point3, Axes) {
    let [width, height] = scene.resolution().map(|n| n as f32);
    let ray = |x: f32, y: f32| {
        let at = scene.camera.generate_ray(Point2::new(x * width, y * height), Point2::new(0.5, 0.5), 0.5);
        at.map_or(Ray::new(Point3::ZERO, Vec3::Z, 0.0), |r| r.ray)
    };
    let (middle, right, top) = (ray(0.5, 0.5), ray(0.75, 0.5), ray(0.5, 0.25));
    let forward = middle.d;
    // Directions of a perspective, origins of an orthographic camera.
    let towards = |r: &Ray| {
        let v = (r.d - forward) + (r.o - middle.o);
        v - forward * v.dot(forward)
    };
    let unit = |v: Vec3, instead: Vec3| if v.length_squared() > 0.0 { v.normalize() } else { instead };
    let frame = Frame::from_z(forward);
    (middle.o, Axes { right: unit(towards(&right), frame.x), up: unit(towards(&top), frame.y), forward })
}

/// A parallel projection from outside.
#[derive(Clone, Copy, Debug)]
pub struct Outside {
    /// Axes of the picture.
    pub axes: Axes,
    /// The point in its middle.
    pub center: Point3,
    /// Half its width in scene units.
    pub half_width: f32,
    /// Half its height.
    pub half_height: f32,
}

impl Outside {
    /// Looking along `axes.forward` at points, all inside with a margin, in a picture of this ratio of width to height.
    pub fn around(axes: Axes, points: &[Point3], aspect: f32) -> Self {
        let mut box_of = Bounds3::EMPTY;
        for p in points {
            let v = p.as_vec();
            box_of = box_of.including(Point3::new(v.dot(axes.right), v.dot(axes.up), v.dot(axes.forward)));
        }
        let (c, d) = (box_of.center(), box_of.diagonal());
        let center = (axes.right * c.x + axes.up * c.y + axes.forward * c.z).as_point();
        let half_width = 0.54 * d.x.max(d.y * aspect).max(1e-6);
        Self { axes, center, half_width, half_height: half_width / aspect }
    }

    /// Where a point lies, as fractions of width and height from the top left.
    pub fn place(&self, p: Point3) -> Point2 {
        let v = p - self.center;
        Point2::new(
            0.5 + 0.5 * v.dot(self.axes.right) / self.half_width,
            0.5 - 0.5 * v.dot(self.axes.up) / self.half_height,
        )
    }
}

/// One surface on the way of a ray through the scene.
#[derive(Clone, Copy, PartialEq)]
struct Layer {
    shape: u32,
    n: Vec3,
    emits: bool,
}

/// The scene as if of glass: how opaque (0 to 1) the surfaces on each line of sight are together, whether an edge of one runs
/// there (0 to 1), and whether a light does. Four lines of sight a pixel.
pub fn through(scene: &Scene, view: &Outside, width: usize, height: usize) -> Grid<[f32; 3]> {
    const LAYERS: usize = 10;
    let bounds = scene.geometry.bounds();
    let (center, radius) = bounds.bounding_sphere();
    let (fine_width, fine_height) = (2 * width, 2 * height);
    let start = (view.center - center).length() + 2.0 * radius;
    let layers = grid(fine_width, fine_height, |x, y| {
        let fx = ((x as f32 + 0.5) / fine_width as f32 - 0.5) * 2.0 * view.half_width;
        let fy = (0.5 - (y as f32 + 0.5) / fine_height as f32) * 2.0 * view.half_height;
        let o = view.center + view.axes.right * fx + view.axes.up * fy - view.axes.forward * start;
        let mut ray = Ray::new(o, view.axes.forward, scene.camera.time(0.5));
        let mut met = Vec::new();
        while met.len() < LAYERS {
            let Some(hit) = scene.geometry.intersect(&ray, f32::INFINITY, &scene.alpha()) else { break };
            let at = scene.geometry.interaction(&ray, &hit);
            met.push(Layer { shape: at.shape.0, n: at.n.as_vec(), emits: at.light.is_some() });
            ray = at.spawn_ray(ray.d);
        }
        met
    });
    let at = |x: usize, y: usize| &layers.values[y.min(fine_height - 1) * fine_width + x.min(fine_width - 1)];
    let differs = |a: &[Layer], b: &[Layer]| {
        a.len() != b.len() || a.iter().zip(b).any(|(a, b)| a.n.dot(b.n) < 0.9 || a.emits != b.emits)
    };
    let forward = view.axes.forward;
    grid(width, height, |x, y| {
        let mut tally = Tally::<3>::default();
        for (i, j) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let (x, y) = (2 * x + i, 2 * y + j);
            let here = at(x, y);
            // Surfaces seen edge-on are darker, as glass is.
            let clear: f32 = here.iter().map(|l| 1.0 - (0.05 + 0.3 * (1.0 - l.n.dot(forward).abs()).powi(3))).product();
            let edge = differs(here, at(x + 1, y)) || differs(here, at(x, y + 1));
            let lamp = here.iter().any(|l| l.emits);
            tally.add([f64::from(1.0 - clear), f64::from(u8::from(edge)), f64::from(u8::from(lamp))]);
        }
        tally.mean().map(|v| v as f32)
    })
}
