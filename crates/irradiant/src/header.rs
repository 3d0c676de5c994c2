//! What the header of a picture says: only what determines its pixels, so that equal pixels are equal files.

use irradiant_image::{Attribute, Metadata};

/// The facts that determine a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Hash over every byte of the scene and the files it uses.
    pub scene_hash: String,
    /// Name of the integrator.
    pub integrator: String,
    /// Name of the sampler.
    pub sampler: String,
    /// "spectral" or "rgb".
    pub color: String,
    /// Seed.
    pub seed: u64,
    /// Samples per pixel asked for.
    pub samples_per_pixel: u32,
    /// Fewest and most samples that a pixel has, when the render was stopped early.
    pub samples_taken: Option<[u32; 2]>,
    /// "unbiased", or "truncated: ..." with the limits, or "biased: ..." with the causes.
    pub estimate: String,
    /// Scene content that was rendered as a stand-in or left out, once per kind.
    pub not_honoured: Vec<String>,
    /// Samples that were not finite or out of range, and are left out of the means.
    pub samples_refused: u64,
    /// Layers of paths, each as "name = expression".
    pub layers: Vec<String>,
    /// World to camera at shutter opening, row-major, row vectors (OpenEXR's convention).
    pub world_to_camera: [f32; 16],
}

impl Header {
    /// As attributes of an EXR file, in a fixed order.
    pub fn write_to(&self, metadata: &mut Metadata) {
        let mut text = |name: &str, value: String| metadata.set_attribute(name, Attribute::Text(value));
        text("irradiant/version", crate::VERSION.into());
        text("irradiant/scene_hash", self.scene_hash.clone());
        text("irradiant/integrator", self.integrator.clone());
        text("irradiant/sampler", self.sampler.clone());
        text("irradiant/color", self.color.clone());
        text("irradiant/seed", self.seed.to_string());
        text("irradiant/spp", self.samples_per_pixel.to_string());
        if let Some([least, most]) = self.samples_taken {
            text("irradiant/spp_taken", format!("{least} to {most}"));
        }
        text("irradiant/estimate", self.estimate.clone());
        text("irradiant/samples_refused", self.samples_refused.to_string());
        if !self.not_honoured.is_empty() {
            text("irradiant/not_honoured", self.not_honoured.join("; "));
        }
        if !self.layers.is_empty() {
            metadata.set_attribute("irradiant/layers", Attribute::Text(self.layers.join("; ")));
        }
        metadata.set_attribute("samplesPerPixel", Attribute::Int(self.samples_per_pixel.min(i32::MAX as u32) as i32));
        metadata.set_attribute("worldToCamera", Attribute::Matrix4(self.world_to_camera));
    }
}
