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

    /// True within a rounding error of [`Self::SRGB`].
    pub fn is_srgb(&self) -> bool {
        let flat = |c: &Self| [c.red, c.green, c.blue, c.white].concat();
        flat(self).iter().zip(flat(&Self::SRGB)).all(|(a, b)| (a - b).abs() < 5e-4)
    }

    /// Rows of the matrix from linear R, G, B of these primaries to sRGB's, white to white (Bradford's adaptation,
    /// Lam 1985); `None` when primaries or white span no colours.
    pub fn to_srgb(&self) -> Option<[[f64; 3]; 3]> {
        const BRADFORD: [[f64; 3]; 3] =
            [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];
        let adapted = |c: &Self| Some(multiply(&BRADFORD, &c.xyz_from_rgb()?));
        let (ours, srgb) = (adapted(self)?, adapted(&Self::SRGB)?);
        // White is 1 1 1, so its cone responses are the sums of the rows.
        let cones = |m: &[[f64; 3]; 3]| m.map(|row| row.iter().sum::<f64>());
        let (from, to) = (cones(&ours), cones(&srgb));
        let scaled = std::array::from_fn(|i| ours[i].map(|v| v * to[i] / from[i]));
        let matrix = multiply(&inverse(&srgb)?, &scaled);
        matrix.iter().flatten().all(|v| v.is_finite()).then_some(matrix)
    }

    fn xyz_from_rgb(&self) -> Option<[[f64; 3]; 3]> {
        let xyz =
            |[x, y]: [f32; 2]| [f64::from(x) / f64::from(y), 1.0, (1.0 - f64::from(x) - f64::from(y)) / f64::from(y)];
        let columns = [self.red, self.green, self.blue].map(xyz);
        let unscaled: [[f64; 3]; 3] = std::array::from_fn(|r| std::array::from_fn(|c| columns[c][r]));
        let (to_weights, white) = (inverse(&unscaled)?, xyz(self.white));
        let weight = to_weights.map(|row| (0..3).map(|i| row[i] * white[i]).sum::<f64>());
        Some(unscaled.map(|row| std::array::from_fn(|c| row[c] * weight[c])))
    }
}

fn multiply(a: &[[f64; 3]; 3], b: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|r| std::array::from_fn(|c| (0..3).map(|i| a[r][i] * b[i][c]).sum()))
}

fn inverse(m: &[[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let minor = |r: usize, c: usize| {
        let (r, c) = ([(r + 1) % 3, (r + 2) % 3], [(c + 1) % 3, (c + 2) % 3]);
        m[r[0]][c[0]] * m[r[1]][c[1]] - m[r[0]][c[1]] * m[r[1]][c[0]]
    };
    let determinant: f64 = (0..3).map(|c| m[0][c] * minor(0, c)).sum();
    // Not a number is none either.
    (determinant.abs() > 1e-12).then(|| std::array::from_fn(|r| std::array::from_fn(|c| minor(c, r) / determinant)))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_primaries_become_srgbs_and_white_stays_white() {
        // ITU-R BT.2087: from BT.2020 to BT.709, both under D65.
        let rec2020 =
            Chromaticities { red: [0.708, 0.292], green: [0.170, 0.797], blue: [0.131, 0.046], ..Chromaticities::SRGB };
        let expected = [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]];
        let matrix = rec2020.to_srgb().unwrap();
        assert!((0..9).all(|i| (matrix[i / 3][i % 3] - expected[i / 3][i % 3]).abs() < 2e-4), "{matrix:?}");
        let aces = Chromaticities {
            red: [0.7347, 0.2653],
            green: [0.0, 1.0],
            blue: [0.0001, -0.077],
            white: [0.32168, 0.33767],
        };
        for space in [rec2020, aces, Chromaticities::SRGB] {
            let white = space.to_srgb().unwrap().map(|row| row.iter().sum::<f64>());
            assert!(white.iter().all(|v| (v - 1.0).abs() < 1e-9), "{white:?}");
        }
        let same = Chromaticities { red: [0.3, 0.3], green: [0.3, 0.3], ..Chromaticities::SRGB };
        let flat = Chromaticities { white: [0.3, 0.0], ..Chromaticities::SRGB };
        assert!(same.to_srgb().is_none() && flat.to_srgb().is_none());
    }
}
