//! Bump maps and normal maps: the shading frame of a surface that is not as flat as its geometry.
//!
//! As pbrt-v4's (Pharr, Jakob and Humphreys 2023, 10.1 and 10.5.3; Blinn 1978). The normal stays on the geometric
//! normal's side.

use crate::interaction::{Interaction, TextureContext};
use crate::texture::{FloatValue, Textures};
use irradiant_image::{Image, ImageError, Pixels};
use irradiant_math::{Frame, Point2, Vec3};

/// What bends a material's shading normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Relief {
    /// Nothing.
    Flat,
    /// A height along the normal, scene units.
    Bump(FloatValue),
    /// An image of normals, by index.
    NormalMap(u32),
}

/// The frame about the normal of two tangents, on the side of the geometric normal; the flat one if they have none.
fn frame_of(dpdu: Vec3, dpdv: Vec3, at: &Interaction) -> Frame {
    let n = dpdu.cross(dpdv);
    let length = n.length();
    if !(length > 0.0 && length.is_finite()) {
        return Frame::from_z_near_x(at.ns.as_vec(), at.dpdus);
    }
    Frame::from_z_near_x((n / length).face_forward(at.n.as_vec()), dpdu)
}

/// Steps of parameters where the footprint gives none.
const SMALLEST_STEP: f32 = 0.0005;

/// The frame of a surface raised by `height` along its normal: its tangents by forward differences over half a pixel.
#[inline(never)]
pub(super) fn bump(height: FloatValue, textures: &Textures, at: &Interaction, tex: &TextureContext) -> Frame {
    let filtered = !textures.ignores_footprints();
    let step = |dx: f32, dy: f32| {
        let step = if filtered { 0.5 * (dx.abs() + dy.abs()) } else { 0.0 };
        if step > 0.0 && step.is_finite() { step } else { SMALLEST_STEP }
    };
    let (du, dv) = (step(tex.dudx, tex.dudy), step(tex.dvdx, tex.dvdy));
    let here = textures.float(height, tex);
    let beside = |d: Vec3, uv: Point2| textures.float(height, &TextureContext { p: tex.p + d, uv, ..*tex });
    let slope_u = (beside(at.dpdus * du, Point2::new(tex.uv.x + du, tex.uv.y)) - here) / du;
    let slope_v = (beside(at.dpdvs * dv, Point2::new(tex.uv.x, tex.uv.y + dv)) - here) / dv;
    let n = at.ns.as_vec();
    let dpdu = at.dpdus + n * slope_u + at.dndus.as_vec() * here;
    let dpdv = at.dpdvs + n * slope_v + at.dndvs.as_vec() * here;
    frame_of(dpdu, dpdv, at)
}

/// An image of normals, (n + 1) / 2 in the frame of the shading tangent and normal.
#[derive(Clone, Debug)]
pub struct NormalMap {
    width: usize,
    height: usize,
    /// Interleaved.
    texels: Texels,
}

#[derive(Clone, Debug)]
enum Texels {
    /// Codes stand for code / 255.
    Bytes(Vec<u8>),
    Floats(Vec<f32>),
}

impl NormalMap {
    /// From an image with channels R, G, B, read with a linear encoding.
    pub fn new(image: &Image) -> Result<Self, ImageError> {
        let Some(rgb) = image.select(&["R", "G", "B"]) else {
            let what = format!("a normal map needs channels R, G, B, the image has {:?}", image.channels());
            return Err(ImageError::Unsupported { what });
        };
        let (width, height) = (rgb.width(), rgb.height());
        if width == 0 || height == 0 {
            return Err(ImageError::Unsupported { what: "an empty normal map".into() });
        }
        let texels = match rgb.pixels() {
            Pixels::U8(codes) => Texels::Bytes(codes.clone()),
            Pixels::F16(_) | Pixels::F32(_) => Texels::Floats(rgb.to_f32()),
        };
        Ok(Self { width, height, texels })
    }

    /// The normal at surface parameters: bilinear, repeating; not unit.
    fn normal(&self, uv: Point2) -> Vec3 {
        let (x, y) = (uv.x * self.width as f32 - 0.5, (1.0 - uv.y) * self.height as f32 - 0.5);
        let (x0, y0) = (x.floor(), y.floor());
        let (dx, dy) = (x - x0, y - y0);
        let wrap = |i: i64, n: usize| i.rem_euclid(n as i64) as usize;
        let texel = |i: i64, j: i64| {
            let base = 3 * (wrap(y0 as i64 + j, self.height) * self.width + wrap(x0 as i64 + i, self.width));
            let read = |c| match &self.texels {
                Texels::Bytes(codes) => f32::from(codes[base + c]) * (1.0 / 255.0),
                Texels::Floats(values) => values[base + c],
            };
            Vec3::new(read(0), read(1), read(2))
        };
        let low = texel(0, 0) * (1.0 - dx) + texel(1, 0) * dx;
        let high = texel(0, 1) * (1.0 - dx) + texel(1, 1) * dx;
        (low * (1.0 - dy) + high * dy) * 2.0 - Vec3::new(1.0, 1.0, 1.0)
    }

    /// The frame that the map gives a hit.
    #[inline(never)]
    pub(super) fn frame(&self, at: &Interaction) -> Frame {
        let flat = Frame::from_z_near_x(at.ns.as_vec(), at.dpdus);
        if !(at.uv.x.is_finite() && at.uv.y.is_finite()) {
            return flat;
        }
        let n = flat.from_local(self.normal(at.uv));
        let length = n.length();
        if !(length > 0.0 && length.is_finite()) {
            return flat;
        }
        let n = n / length;
        // The tangent that remains of the old one; its normal is on the geometric normal's side.
        let dpdu = at.dpdus - n * at.dpdus.dot(n);
        Frame::from_z_near_x(n.face_forward(at.n.as_vec()), dpdu)
    }
}
