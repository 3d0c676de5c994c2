//! Images as textures: reading each once, and looking them up.
//!
//! An image is decoded once per (file, filter, wrap, encoding), several at a time; 8-bit images stay 8-bit in memory.
//! Values are pbrt-v4's: the lookup is scaled, then inverted if asked, then kept from going below 0. As in pbrt-v4, the
//! colour space is the one that the file states (by its chromaticities) or sRGB, whatever the scene's directives say.
//! Unlike pbrt-v4, which decodes JPEG and TGA as sRGB always, a stated `encoding` counts for every 8-bit format.

use super::mapping::Coordinates;
use irradiant_image::{Encoding, Image, MipFilter, MipMap, MipOptions, ReadOptions, WrapMode};
use irradiant_scene::desc::texture::{EncodingDesc, ImageFilter, ImageWrap};
use irradiant_scene::desc::{FileDesc, ImageMapDesc};
use irradiant_scene::{Assets, Diagnostic, Span, Spanned};
use irradiant_spectrum::ColorSpace;
use std::path::PathBuf;

/// A decoded image with its pyramid.
#[derive(Clone, Debug)]
pub struct ImageTexture {
    /// The texels.
    pub mip: MipMap,
    /// What R, G, B mean.
    pub space: &'static ColorSpace,
}

/// What makes two image textures share their texels.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ImageKey {
    path: PathBuf,
    encoding: (u8, u32),
    filter: u8,
    wrap: u8,
    max_anisotropy: u32,
}

impl ImageKey {
    pub(super) fn new(desc: &ImageMapDesc) -> Self {
        let encoding = match desc.encoding {
            EncodingDesc::Default => (0, 0),
            EncodingDesc::Linear => (1, 0),
            EncodingDesc::Srgb => (2, 0),
            EncodingDesc::Gamma(g) => (3, g.to_bits()),
        };
        // Only elliptical filters care.
        let max_anisotropy = if desc.filter == ImageFilter::Ewa { desc.max_anisotropy.to_bits() } else { 0 };
        Self {
            path: desc.file.value.path.clone(),
            encoding,
            filter: desc.filter as u8,
            wrap: desc.wrap as u8,
            max_anisotropy,
        }
    }
}

fn encoding(desc: EncodingDesc) -> Option<Encoding> {
    match desc {
        EncodingDesc::Default => None,
        EncodingDesc::Linear => Some(Encoding::Linear),
        EncodingDesc::Srgb => Some(Encoding::Srgb),
        EncodingDesc::Gamma(g) => Some(Encoding::Gamma(g)),
    }
}

/// Reads and decodes an image; the error names where the scene asks for it and the path that was tried.
pub(crate) fn read_image(
    file: &Spanned<FileDesc>,
    encoding: Option<Encoding>,
    assets: &dyn Assets,
) -> Result<Image, Box<Diagnostic>> {
    let name = &file.value.name;
    let bytes = assets.read(&file.value.path).map_err(|why| {
        let message = format!("image \"{name}\": {why}");
        let help = format!("tried {}", file.value.path.display());
        Diagnostic::error("E0601", message, file.span).help(help).missing()
    })?;
    let options = ReadOptions { encoding, ..ReadOptions::default() };
    let image = irradiant_image::read(&bytes, name, &options);
    Ok(image.map_err(|why| Diagnostic::error("E0602", format!("image \"{name}\": {why}"), file.span))?)
}

/// The colour space that an image states; sRGB if none, or with a warning if it is of none that is known.
pub(crate) fn image_space(image: &Image, name: &str, span: Span) -> (&'static ColorSpace, Option<Diagnostic>) {
    let Some(c) = image.metadata.chromaticities else { return (ColorSpace::srgb(), None) };
    let wide = |[x, y]: [f32; 2]| [f64::from(x), f64::from(y)];
    match ColorSpace::with_chromaticities([c.red, c.green, c.blue].map(wide), wide(c.white)) {
        Some(space) => (space, None),
        None => {
            let message = format!("image \"{name}\" has primaries of no known colour space; they are taken for sRGB's");
            (ColorSpace::srgb(), Some(Diagnostic::warning("W0603", message, span)))
        }
    }
}

/// Reads an image texture.
pub(super) fn load(
    desc: &ImageMapDesc,
    assets: &dyn Assets,
) -> Result<(ImageTexture, Option<Diagnostic>), Box<Diagnostic>> {
    let image = read_image(&desc.file, encoding(desc.encoding), assets)?;
    let (name, span) = (&desc.file.value.name, desc.file.span);
    let (space, warning) = image_space(&image, name, span);
    let filter = match desc.filter {
        ImageFilter::Point => MipFilter::Point,
        ImageFilter::Bilinear => MipFilter::Bilinear,
        ImageFilter::Trilinear => MipFilter::Trilinear,
        ImageFilter::Ewa => MipFilter::Ewa,
    };
    let wrap = match desc.wrap {
        ImageWrap::Repeat => WrapMode::Repeat,
        ImageWrap::Black => WrapMode::Black,
        ImageWrap::Clamp => WrapMode::Clamp,
        ImageWrap::OctahedralSphere => WrapMode::OctahedralSphere,
    };
    let options = MipOptions { filter, wrap, max_anisotropy: desc.max_anisotropy };
    let mip = MipMap::new(&image, options)
        .map_err(|why| Diagnostic::error("E0602", format!("image \"{name}\": {why}"), span))?;
    Ok((ImageTexture { mip, space }, warning))
}

/// What is done to a looked-up value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grade {
    /// Factor.
    pub scale: f32,
    /// Take one minus it.
    pub invert: bool,
}

impl ImageTexture {
    /// Image coordinates run downwards; the derivatives keep their sign, as in pbrt-v4.
    #[inline]
    fn place(c: &Coordinates) -> [f32; 2] {
        // Lookups need numbers; texture coordinates of broken meshes may be none.
        if c.s.is_finite() && c.t.is_finite() { [c.s, 1.0 - c.t] } else { [0.0; 2] }
    }

    /// A single number: see [`MipMap::filter_f32`] for which.
    #[inline]
    pub fn float(&self, c: &Coordinates, grade: Grade) -> f32 {
        let v = grade.scale * self.mip.filter_f32(Self::place(c), c.dx, c.dy);
        if grade.invert { (1.0 - v).max(0.0) } else { v }
    }

    /// Linear R, G, B in the image's colour space, none below 0.
    #[inline]
    pub fn rgb(&self, c: &Coordinates, grade: Grade) -> [f32; 3] {
        let rgb = self.mip.filter_rgb(Self::place(c), c.dx, c.dy);
        rgb.map(|v| {
            let v = grade.scale * v;
            (if grade.invert { 1.0 - v } else { v }).max(0.0)
        })
    }
}
