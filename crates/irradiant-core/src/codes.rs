//! Every code that compiling a scene can say, explained. Those of readers are explained by `irradiant-formats`.
//!
//! Ranges: 05 geometry, 06 textures and images, 07 materials, 08 lights, 09 film, camera and sampler. Readers use others.

/// What stands behind a code; `None` if compiling never says it. Case does not matter.
pub fn explain(code: &str) -> Option<&'static str> {
    CODES.iter().find(|(c, _)| c.eq_ignore_ascii_case(code)).map(|(_, text)| *text)
}

/// All codes of this crate with their explanations, sorted.
pub const CODES: &[(&str, &str)] = &[
    ("E0501", "A radius is a positive, finite number of scene units."),
    ("E0502", "\"phimax\" is the sweep of a shape in degrees: above 0 and at most 360."),
    ("E0503", "A limit of a shape (zmin, zmax, height, innerradius) is not a number."),
    (
        "E0505",
        "The transform of a shape or an instance cannot be inverted: it is not finite, flattens to nothing (a scale of 0), \
         or has perspective.",
    ),
    ("E0506", "The widths of a curve are numbers from 0 up."),
    ("E0507", "\"splitdepth\" is too large: each step doubles the pieces of a curve; 3 is usual."),
    ("E0508", "\"alpha\" is an opacity between 0 and 1."),
    ("E0509", "A ribbon has one normal more than it has segments."),
    ("E0601", "An image is not where the scene says. The help names the path that was tried."),
    ("E0602", "An image was found and cannot be read: it is damaged, or of a kind that is not known."),
    ("E0605", "A number of a texture or a spectrum is not finite, or a direction has no length."),
    ("E0606", "No built-in spectrum has this name: metal-Au-eta, glass-BK7, stdillum-D65 are some."),
    ("E0608", "A texture refers to itself, to one that does not exist, or to too many others."),
    ("E0609", "The transform of a texture cannot be inverted, or has perspective."),
    ("E0610", "Noise has a small whole number of octaves, from 0 up, and a finite roughness."),
    ("E0611", "A checkerboard has 2 or 3 dimensions."),
    (
        "E0701",
        "A reflectance lies between 0 and 1 at each wavelength. For something that shines use AreaLightSource; a texture's \
         \"scale\" is not limited.",
    ),
    ("E0702", "A roughness is a number from 0 (smooth) up; 1 is very rough."),
    ("E0703", "An index of refraction divides, so it cannot be 0 here; that of a glossy paint cannot be a texture."),
    ("E0704", "A thickness is a number from 0 up: of a coat in mean free paths, of an interference film in nm."),
    ("E0705", "The asymmetry \"g\" of a medium lies between -1 (back) and 1 (ahead), both excluded."),
    ("E0706", "\"maxdepth\" (0: no limit) and \"nsamples\" (from 1) of a coat are at most 65535."),
    ("E0707", "The scale of diffuse transmission is a number from 0 up."),
    ("E0708", "The amount of a mix is a number, and a mix cannot lead back to itself."),
    ("E0709", "A displacement is a finite number or a texture."),
    ("E0801", "A factor of a light (scale, power, illuminance) is a finite number; a scale is not negative."),
    ("E0802", "Emission cannot be negative at any wavelength, and a black body shines above 0 kelvin only."),
    ("E0803", "No built-in spectrum has this name: stdillum-D65, stdillum-F11 are some."),
    (
        "E0804",
        "A direction or an angle of a light: \"from\" differs from \"to\", cones are up to 180 degrees, fields of view less.",
    ),
    (
        "E0805",
        "The image of a light cannot be used. Infinite and goniometric lights take square images under the equal-area \
         octahedral map; pbrt's imgtool makeequiarea converts latitude-longitude images.",
    ),
    ("E0806", "The four corners of a portal form a rectangle and are given in order around it."),
    ("E0807", "A light has either \"L\" or \"filename\": an image has its own colours."),
    ("E0901", "A film has at least one pixel and at most so many on a side as the message says."),
    ("E0902", "The crop window or the pixel bounds leave no pixel of the film to render."),
    ("E0903", "The radii of a pixel filter are half-widths in pixels, more than 0."),
    ("E0904", "A parameter of a filter is out of its range."),
    ("E0905", "Exposure time, ISO speed and white balance are positive."),
    ("E0906", "No sensor has this name, or it cannot be used like this."),
    (
        "E0907",
        "The film would take more memory than is allowed: sums and counts of a pixel take 112 bytes, each further channel 16. \
         Render the picture in parts with a crop window, make it smaller, or allow more (--max-film-memory).",
    ),
    (
        "E0908",
        "The buckets of a spectral film lie between two different wavelengths in nm and are at least 0.01 nm wide each.",
    ),
    ("E0910", "The shutter opens and closes at finite times."),
    ("E0911", "The transform of the camera is made of translations, rotations and scales that are not 0."),
    ("E0912", "A parameter of the camera is out of its range; the label says which is meant."),
    ("E0913", "The screen window is x0, x1, y0, y1 with x0 < x1 and y0 < y1."),
    (
        "E0914",
        "A realistic camera needs a lens file: a line for each surface, with curvature radius, thickness, index, diameter in mm.",
    ),
    (
        "E0915",
        "No light passes the lens: the aperture is too small, a surface is in the way, or the focus is too near.",
    ),
    ("E0916", "The image of the aperture is missing or cannot be used."),
    ("W0501", "Nothing shines in this scene, so the picture is black."),
    ("W0503", "A shape has no area: its limits leave nothing of it."),
    ("W0510", "Faces or curves with points that are not finite were left out."),
    ("W0511", "No face of a mesh has an area."),
    ("W0520", "This kind of shape does not emit, or not while it moves; its area light is ignored, as in pbrt-v4."),
    ("W0603", "An image states primaries of no known colour space; they are taken for sRGB's."),
    ("W0701", "A spectrum exceeds 1 at some wavelengths; as a reflectance it is cut there, as in pbrt-v4."),
    ("W0702", "A glossy paint is equally rough along both tangents: the geometric mean is taken."),
    ("W0703", "An index of refraction of 0 is taken for 1, as in pbrt-v4."),
    ("W0707", "Reflectance and transmittance add up to more than 1: the surface creates light."),
    ("W0708", "The amount of a mix is cut to lie between 0 and 1."),
    ("W0709", "A material has a normal map and a displacement; the normal map counts, as in pbrt-v4."),
    ("W0808", "Pixels of a light's image are negative or not finite; they count as 0. The first one is named."),
    ("W0809", "Lights do not move, and shapes of material \"interface\" do not emit, as in pbrt-v4."),
    ("W0810", "A value of a light has no effect."),
    ("W0910", "The shutter closes before it opens; the two times are swapped."),
    ("W0911", "The transform of the camera scales, and lens radius and focal distance with it."),
    (
        "W0912",
        "An orthographic camera with a lens shows no parallel projection: rays start on a lens around its position, as in pbrt-v4.",
    ),
    ("W0913", "The aperture asked for is wider than the lens allows; it is as wide as the lens."),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_sorted_and_found() {
        assert!(CODES.windows(2).all(|w| w[0].0 < w[1].0));
        assert_eq!(explain("e0501"), Some(CODES[0].1));
        assert_eq!(explain("E0000"), None);
    }
}
