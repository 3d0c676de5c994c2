//! From sums to an image of averages.

use super::exact::ExactSum;
use super::{Film, Layer, SplatEstimate};
use irradiant_image::Image;

/// What to write beside radiance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DevelopOptions {
    /// Channels `SE.R`, `SE.G`, `SE.B`: standard error of the mean as if samples were independent (low-discrepancy
    /// samples usually do better).
    pub standard_error: bool,
    /// Channels `Variance.*` and `RelativeVariance.*` as pbrt's gbuffer film has them: sample variance, and that
    /// over the squared mean.
    pub variance: bool,
}

impl Film {
    /// The image of averages: linear `R`, `G`, `B` in the film's colour space, then the layers, then error estimates.
    pub fn develop(&self, options: DevelopOptions) -> Image {
        let mut names: Vec<String> = ["R", "G", "B"].map(String::from).to_vec();
        names.extend(self.layers.iter().flat_map(|l| l.channel_names()));
        if options.variance {
            for kind in ["Variance", "RelativeVariance"] {
                names.extend(["R", "G", "B"].map(|c| format!("{kind}.{c}")));
            }
        }
        if options.standard_error {
            names.extend(["R", "G", "B"].map(|c| format!("SE.{c}")));
        }
        let bounds = self.bounds();
        let n_layers = self.channels_per_pixel();
        let mut samples = Vec::with_capacity(bounds.area() * names.len());
        let splats = self.splats.as_ref().map(|s| (s, self.samples_taken()));
        for (i, pixel) in self.tile.pixels.iter().enumerate() {
            let light = splats.map_or(SplatEstimate::default(), |(plane, n)| plane.estimate(i, n));
            let own = pixel.mean();
            let mean: [f64; 3] = std::array::from_fn(|c| own[c] + light.mean[c]);
            samples.extend(mean.map(|x| x as f32));
            let n = pixel.count.max(1) as f64;
            self.develop_layers(&self.tile.layers[i * n_layers..(i + 1) * n_layers], n, &mut samples);
            let own = pixel.variance();
            let variance: [f64; 3] = std::array::from_fn(|c| own[c] + n * light.variance[c]);
            if options.variance {
                samples.extend(variance.map(|v| v as f32));
                samples.extend((0..3).map(|c| {
                    let square = mean[c] * mean[c];
                    if square > 0.0 { (variance[c] / square) as f32 } else { 0.0 }
                }));
            }
            if options.standard_error {
                samples.extend(variance.map(|v| (v / n).sqrt() as f32));
            }
        }
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        Image::from_f32(bounds.width(), bounds.height(), &names, samples)
            .unwrap_or_else(|_| unreachable!("one sample per pixel and channel by construction"))
    }

    /// One pixel's layers from their sums over `n` samples.
    fn develop_layers(&self, sums: &[ExactSum], n: f64, written: &mut Vec<f32>) {
        let start_of = |layer: usize| self.layers[..layer].iter().map(Layer::n_channels).sum::<usize>();
        let hits = self.layers.iter().position(|l| *l == Layer::Hits).map_or(n, |i| sums[start_of(i)].value());
        let over = |sum: f64, count: f64| if count != 0.0 { (sum / count) as f32 } else { 0.0 };
        let mut rest = sums;
        for layer in &self.layers {
            let (own, others) = rest.split_at(layer.n_channels());
            rest = others;
            let values = own.iter().map(|s| s.value());
            match layer {
                Layer::Albedo | Layer::Bucket { .. } | Layer::Paths { .. } => {
                    written.extend(values.map(|v| over(v, n)))
                }
                Layer::Position | Layer::Uv => written.extend(values.map(|v| over(v, hits))),
                Layer::DepthSlope => written.extend(values.map(|v| over(v, hits).abs())),
                Layer::Normal | Layer::ShadingNormal => {
                    let length = values.clone().map(|v| v * v).sum::<f64>().sqrt();
                    written.extend(values.map(|v| over(v, length)));
                }
                Layer::Hits => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{FilmTile, Layer, PixelBounds};
    use super::*;

    #[test]
    fn averages_and_errors_come_out_under_pbrts_names() {
        let bounds = PixelBounds { x0: 0, y0: 0, x1: 2, y1: 1 };
        let mut film = Film::new([2, 1], bounds, vec![Layer::Uv]);
        let mut tile = FilmTile::new(bounds, film.channels_per_pixel());
        tile.add(1, 0, [1.0, 2.0, 4.0], &[0.5, 0.25]);
        tile.add(1, 0, [3.0, 2.0, 0.0], &[0.5, 0.75]);
        film.merge_tile(&tile);
        let image = film.develop(DevelopOptions { standard_error: true, variance: true });
        let at = |name: &str| image.get(1, 0, image.channels().iter().position(|c| c == name).unwrap());
        assert_eq!((at("R"), at("G"), at("B"), at("u"), at("v")), (2.0, 2.0, 2.0, 0.5, 0.5));
        assert_eq!((at("Variance.R"), at("RelativeVariance.B"), at("SE.R")), (2.0, 2.0, 1.0));
        assert_eq!(image.get(0, 0, 0), 0.0);
    }
    /// pbrt-v4's `GBufferFilm::GetImage`: what is not hit counts for reflectance only.
    #[test]
    fn geometry_is_averaged_over_hits_alone() {
        let bounds = PixelBounds { x0: 0, y0: 0, x1: 2, y1: 1 };
        let layers = vec![Layer::Albedo, Layer::Position, Layer::DepthSlope, Layer::Normal, Layer::Uv, Layer::Hits];
        let mut film = Film::new([2, 1], bounds, layers);
        let mut tile = FilmTile::new(bounds, film.channels_per_pixel());
        tile.add(0, 0, [1.0; 3], &[0.5, 0.5, 0.5, 2.0, 4.0, 6.0, -0.5, 0.25, 1.0, 0.0, 0.0, 0.25, 0.75, 1.0]);
        tile.add(0, 0, [1.0; 3], &[0.5, 0.5, 0.5, 4.0, 4.0, 6.0, -1.0, 0.25, 0.0, 1.0, 0.0, 0.75, 0.75, 1.0]);
        tile.add(0, 0, [1.0; 3], &[0.0; 14]);
        tile.add(0, 0, [1.0; 3], &[0.0; 14]);
        tile.add(1, 0, [1.0; 3], &[0.0; 14]);
        film.merge_tile(&tile);
        let image = film.develop(DevelopOptions::default());
        let names = "R G B Albedo.R Albedo.G Albedo.B P.X P.Y P.Z dzdx dzdy N.X N.Y N.Z u v";
        assert_eq!(image.channels().join(" "), names);
        let row = |x: usize| (3..16).map(|c| image.get(x, 0, c)).collect::<Vec<_>>();
        let h = std::f32::consts::FRAC_1_SQRT_2;
        assert_eq!(row(0), [0.25, 0.25, 0.25, 3.0, 4.0, 6.0, 0.75, 0.25, h, h, 0.0, 0.5, 0.75]);
        assert_eq!(row(1), [0.0; 13]);
    }
}
