//! A finished picture's layers as numbers: how much light each holds.

use crate::render::Rendering;
use irradiant_core::film::Layer;

/// How much of the picture's light a layer shows.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerLight {
    /// Its channels are this and `.R`, `.G`, `.B`.
    pub name: String,
    /// Which paths.
    pub expression: String,
    /// Mean over the picture, linear RGB of the film's colour space.
    pub mean: [f64; 3],
    /// Its luminance over the picture's; 0 for a black picture.
    pub share: f64,
}

impl Rendering {
    /// The layers of paths, in the order of their channels.
    pub fn layer_light(&self) -> Vec<LayerLight> {
        let bounds = self.film.bounds();
        let area = bounds.area().max(1) as f64;
        let pixels = || (bounds.y0..bounds.y1).flat_map(|y| (bounds.x0..bounds.x1).map(move |x| (x, y)));
        let luminance = |rgb: [f64; 3]| f64::from(self.color_space.luminance(rgb.map(|c| c as f32)));
        let mut whole = [0.0; 3];
        for (x, y) in pixels() {
            let mean = self.film.pixel(x, y).mean();
            (0..3).for_each(|c| whole[c] += mean[c] / area);
        }
        let whole = luminance(whole);
        let mut list = Vec::new();
        for (i, layer) in self.film.layers().iter().enumerate() {
            let Layer::Paths { name, expression } = layer else { continue };
            let mut mean = [0.0; 3];
            for (x, y) in pixels() {
                let n = f64::from(self.film.pixel(x, y).count.max(1));
                let sums = self.film.layer_sums(x, y, i);
                (0..3).for_each(|c| mean[c] += sums[c].value() / (n * area));
            }
            let share = if whole > 0.0 { luminance(mean) / whole } else { 0.0 };
            list.push(LayerLight { name: name.clone(), expression: expression.clone(), mean, share });
        }
        list
    }
}
