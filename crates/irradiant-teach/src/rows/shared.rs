//! Renders that several rows look at, made once for each lesson.

use crate::context::{Context, Setup};
use crate::estimate::{Estimate, Estimator, Part, Production, take_apart};
use crate::scenes;
use irradiant::Error;
use irradiant::core::scene::Scene;
use irradiant::image::Image;
use std::sync::Arc;

/// The Cornell box by bounces: K^0 to K^16, then all beyond, then the whole, from one run.
pub struct ByBounce {
    /// K^i(Le), i = 0..=16.
    pub terms: Vec<Estimate>,
    /// All bounces beyond.
    pub beyond: Estimate,
    /// The picture.
    pub whole: Estimate,
}

/// Bounces kept apart.
pub const BOUNCES: usize = 17;

/// The Cornell box, taken apart by bounces.
pub fn cornell_by_bounce(context: &Context) -> Result<Arc<ByBounce>, Error> {
    context.once("cornell by bounce", || {
        let setup = Setup::square(context.side(64), context.spp(96));
        let scene = context.scene("cornell-box", &scenes::cornell(), setup)?;
        let classify = |part: &Part| Some((part.bounces as usize).min(BOUNCES));
        let mut parts = take_apart(&scene, &Production::default(), context.spp(96), BOUNCES + 1, &classify);
        let (whole, beyond) = (parts.pop().unwrap_or_default(), parts.pop().unwrap_or_default());
        Ok(ByBounce { terms: parts, beyond, whole })
    })
}

/// The room with two balls, taken apart: emitted and direct light, caustics, the rest; the whole; and of the caustics those
/// that are seen straight, L S+ D E.
pub fn balls_apart(context: &Context) -> Result<Arc<Vec<Estimate>>, Error> {
    context.once("two balls apart", || {
        let spp = context.spp(96);
        let setup = Setup { size: Some([context.side(80), context.side(60)]), spp: Some(spp), ..Setup::default() };
        let scene = context.scene("two-balls", scenes::TWO_BALLS, setup)?;
        let classify = |part: &Part| match kind_of_light(part) {
            1 if part.lobes[0].is_specular() => Some(3),
            kind => Some(kind),
        };
        let mut parts = take_apart(&scene, &Production::default(), spp, 4, &classify);
        let straight = parts[1].clone();
        // Of one run, and nearly independent: hardly a path brings both.
        parts[1] = straight.plus(1.0, &parts[3]);
        parts.swap_remove(3);
        parts.push(straight);
        Ok(parts)
    })
}

/// Light of at least one bounce: without the lamps' own edges, whose variance is the same in every estimator.
pub fn reflected(scene: &Scene, estimator: &dyn Estimator, spp: u32) -> Estimate {
    take_apart(scene, estimator, spp, 1, &|part| (part.bounces > 0).then_some(0)).swap_remove(0)
}

/// 0: the light itself, seen straight or by mirrors and glass, and L D E; 1: caustics on what the eye sees, straight or by
/// mirrors and glass, L S+ D S* E; 2: more than one diffuse bounce.
pub fn kind_of_light(part: &Part) -> usize {
    // The last vertex of a light sample is not listed; it is never specular.
    let n = part.bounces as usize;
    let specular = |i: usize| i < part.lobes.len() && part.lobes[i].is_specular();
    let diffuse = (0..n).filter(|&i| !specular(i)).count();
    match diffuse {
        0 => 0,
        1 if specular(n - 1) => 1,
        1 => 0,
        _ => 2,
    }
}

/// Pictures of one size side by side, in reading order: up to four in a row, rows of about as many.
pub fn strip(images: &[&Image]) -> Image {
    let Some(first) = images.first() else { return Image::new(1, 1, &["R", "G", "B"]) };
    let (w, h) = (first.width(), first.height());
    let gap = 2;
    let rows = images.len().div_ceil(4);
    let columns = images.len().div_ceil(rows);
    Image::from_fn(columns * (w + gap) - gap, rows * (h + gap) - gap, ["R", "G", "B"], |x, y| {
        let (column, x, row, y) = (x / (w + gap), x % (w + gap), y / (h + gap), y % (h + gap));
        match images.get(row * columns + column) {
            Some(image) if x < w && y < h => std::array::from_fn(|c| image.get(x, y, c)),
            _ => [1.0; 3],
        }
    })
}

/// The slope of a straight line through points, by least squares, and the square of the correlation.
pub fn fit(points: &[(f64, f64)]) -> (f64, f64) {
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let sxy: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    let sxx: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
    let syy: f64 = points.iter().map(|p| (p.1 - my).powi(2)).sum();
    (sxy / sxx, sxy * sxy / (sxx * syy))
}
