//! What a file says beside its pixels.

/// CIE 1931 (x, y) chromaticities of three primaries and a white point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chromaticities {
    /// Red primary.
    pub red: [f32; 2],
    /// Green primary.
    pub green: [f32; 2],
    /// Blue primary.
    pub blue: [f32; 2],
    /// White point.
    pub white: [f32; 2],
}

impl Chromaticities {
    /// Rec. 709 primaries with a D65 white, the ones of sRGB (ITU-R BT.709).
    pub const SRGB: Self = Self { red: [0.64, 0.33], green: [0.30, 0.60], blue: [0.15, 0.06], white: [0.3127, 0.3290] };
}

/// A header value of an OpenEXR file.
#[derive(Clone, Debug, PartialEq)]
pub enum Attribute {
    /// Text, UTF-8 when written by us.
    Text(String),
    /// A list of texts.
    TextVector(Vec<String>),
    /// A 32-bit integer.
    Int(i32),
    /// A 32-bit float.
    Float(f32),
    /// A 64-bit float.
    Double(f64),
    /// Two floats.
    Vec2([f32; 2]),
    /// Three floats.
    Vec3([f32; 3]),
    /// A 4x4 matrix, row by row as stored.
    Matrix4([f32; 16]),
}

/// Windows, colour space and attributes; [`Metadata::default`] is what a plain picture has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// Where the first pixel stands in the full frame: the data window's minimum (x, y).
    pub origin: [i32; 2],
    /// The full frame as (x0, y0, x1, y1), exclusive at the far end; `None` is the data window itself.
    pub display_window: Option<[i32; 4]>,
    /// The primaries of R, G and B; `None` means sRGB's.
    pub chromaticities: Option<Chromaticities>,
    /// Further attributes, sorted by name when they were read from a file.
    pub attributes: Vec<(String, Attribute)>,
    /// Parts of a multi-part file that were left out because their size differs from the first's.
    pub skipped_parts: Vec<String>,
}

impl Metadata {
    /// The attribute of that name, if there is one.
    pub fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|(key, _)| key == name).map(|(_, value)| value)
    }

    /// Sets an attribute, replacing one of the same name.
    pub fn set_attribute(&mut self, name: &str, value: Attribute) {
        match self.attributes.iter_mut().find(|(key, _)| key == name) {
            Some((_, old)) => *old = value,
            None => self.attributes.push((name.to_owned(), value)),
        }
    }
}
