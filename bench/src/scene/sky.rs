//! Light from afar, written as each renderer wants its map.

use super::Rgb;
use crate::vector::{V, dot, unit};
use irradiant_image::{Compression, Image, write_exr};
use std::f32::consts::{PI, TAU};
use std::path::Path;

/// A gradient, and a soft sun.
#[derive(Clone, Copy, Debug)]
pub struct Sky {
    /// Radiance at the horizon.
    pub horizon: Rgb,
    /// Radiance at the zenith.
    pub zenith: Rgb,
    /// Radiance of what is below.
    pub ground: Rgb,
    /// Radiance of the middle of the sun.
    pub sun: Rgb,
    /// Towards the sun.
    pub sun_direction: V,
    /// The sun is a Gaussian of this standard deviation, radians.
    pub sun_width: f32,
}

impl Sky {
    /// Radiance from unit direction `d`.
    pub fn radiance(&self, d: V) -> Rgb {
        let t = d[1].clamp(0.0, 1.0).sqrt();
        let angle = dot(d, unit(self.sun_direction)).clamp(-1.0, 1.0).acos() / self.sun_width;
        let sun = (-0.5 * angle * angle).exp();
        std::array::from_fn(|c| {
            let base = if d[1] < 0.0 { self.ground[c] } else { (1.0 - t) * self.horizon[c] + t * self.zenith[c] };
            base + self.sun[c] * sun
        })
    }

    /// Writes `sky-KIND.exr` for all kinds into a folder.
    pub fn write(&self, folder: &Path) -> Result<(), String> {
        // Latitude and longitude: row v from the pole, column u.
        let polar = |x: usize, y: usize| {
            let (u, v) = ((x as f32 + 0.5) / 1024.0 * TAU, (y as f32 + 0.5) / 512.0 * PI);
            (u, v.sin(), v.cos())
        };
        let save = |kind: &str, image: Image| {
            let bytes = write_exr(&image, Compression::None).map_err(|e| e.to_string())?;
            std::fs::write(folder.join(format!("sky-{kind}.exr")), bytes).map_err(|e| e.to_string())
        };
        let rgb = ["R", "G", "B"];
        // Mitsuba: d = (sin u sin v, cos v, -cos u sin v).
        save(
            "mitsuba",
            Image::from_fn(1024, 512, rgb, |x, y| {
                let (u, s, c) = polar(x, y);
                self.radiance([u.sin() * s, c, -u.cos() * s])
            }),
        )?;
        // Blender, z up: azimuth falls from pi to -pi along a row; its (x, y, z) is our (x, z, -y).
        save(
            "cycles",
            Image::from_fn(1024, 512, rgb, |x, y| {
                let (u, s, c) = polar(x, y);
                self.radiance([(PI - u).cos() * s, c, -(PI - u).sin() * s])
            }),
        )?;
        // LuxCore, z up and turned the same way by its driver.
        save(
            "luxcore",
            Image::from_fn(1024, 512, rgb, |x, y| {
                let (u, s, c) = polar(x, y);
                self.radiance([u.cos() * s, c, -u.sin() * s])
            }),
        )?;
        // Equal-area octahedral square (Clarberg 2008), z its axis.
        save("octahedral", Image::from_fn(1024, 1024, rgb, |x, y| self.radiance(octahedral(x, y))))
    }
}

/// Direction of the middle of a pixel of the equal-area square of 1024 x 1024.
fn octahedral(x: usize, y: usize) -> V {
    let (u, v) = ((x as f32 + 0.5) / 512.0 - 1.0, (y as f32 + 0.5) / 512.0 - 1.0);
    let signed = 1.0 - (u.abs() + v.abs());
    let r = 1.0 - signed.abs();
    let phi = if r == 0.0 { 0.0 } else { ((v.abs() - u.abs()) / r + 1.0) * PI / 4.0 };
    let s = r * (2.0 - r * r).max(0.0).sqrt();
    [(phi.cos() * s).copysign(u), (phi.sin() * s).copysign(v), (1.0 - r * r).copysign(signed)]
}
