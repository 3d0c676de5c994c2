//! What lies outside a picture: repeat, black, clamp, and the octahedral sphere's folded edges.

use crate::image::Image;

/// What a lookup outside the picture finds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum WrapMode {
    /// The picture again and again.
    #[default]
    Repeat,
    /// Black.
    Black,
    /// The nearest texel of the edge.
    Clamp,
    /// The texel across the fold of an octahedral map of the sphere (Clarberg 2008), for a texel or two outside.
    OctahedralSphere,
}

impl WrapMode {
    /// The mode that a pbrt-v4 scene calls so: "repeat", "black", "clamp" or "octahedralsphere".
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "repeat" => Some(Self::Repeat),
            "black" => Some(Self::Black),
            "clamp" => Some(Self::Clamp),
            "octahedralsphere" => Some(Self::OctahedralSphere),
            _ => None,
        }
    }

    /// The texel inside a picture of `width` x `height` that stands for (x, y), or `None` for black.
    pub fn remap(self, x: i32, y: i32, width: i32, height: i32) -> Option<(usize, usize)> {
        let inside = |x: i32, y: i32| Some((x as usize, y as usize));
        if (0..width).contains(&x) && (0..height).contains(&y) {
            return inside(x, y);
        }
        match self {
            Self::Repeat => inside(x.rem_euclid(width), y.rem_euclid(height)),
            Self::Black => None,
            Self::Clamp => inside(x.clamp(0, width - 1), y.clamp(0, height - 1)),
            Self::OctahedralSphere => {
                let (x, y) = unfold(x, y, width, height);
                inside(x, y)
            }
        }
    }
}

/// The texel on the other side of an octahedral map's edge; pbrt-v4's formula, clamped where that leaves the map.
#[inline]
pub(crate) fn unfold(mut x: i32, mut y: i32, width: i32, height: i32) -> (i32, i32) {
    // 64 bits, since coordinates may be anything.
    let (w, h) = (i64::from(width), i64::from(height));
    let (mut u, mut v) = (i64::from(x), i64::from(y));
    if u < 0 {
        (u, v) = (-u, h - 1 - v);
    } else if u >= w {
        (u, v) = (2 * w - 1 - u, h - 1 - v);
    }
    if v < 0 {
        (u, v) = (w - 1 - u, -v);
    } else if v >= h {
        (u, v) = (w - 1 - u, 2 * h - 1 - v);
    }
    x = u.clamp(0, w - 1) as i32;
    y = v.clamp(0, h - 1) as i32;
    (x, y)
}

impl Image {
    /// The linear value of the texel that holds (s, t) of the unit square, (0, 0) being the top left corner.
    pub fn nearest(&self, s: f32, t: f32, channel: usize, wrap: WrapMode) -> f32 {
        let (width, height) = (self.width() as i32, self.height() as i32);
        let (x, y) = (floor_i32(s * width as f32), floor_i32(t * height as f32));
        wrap.remap(x, y, width, height).map_or(0.0, |(x, y)| self.get(x, y, channel))
    }

    /// The linear value at (s, t) of the unit square, interpolated between the four nearest texel centres.
    pub fn bilinear(&self, s: f32, t: f32, channel: usize, wrap: WrapMode) -> f32 {
        let (width, height) = (self.width() as i32, self.height() as i32);
        let (x, y) = (s * width as f32 - 0.5, t * height as f32 - 0.5);
        let (x0, y0) = (floor_i32(x), floor_i32(y));
        let (dx, dy) = (x - x0 as f32, y - y0 as f32);
        let at = |x, y| wrap.remap(x, y, width, height).map_or(0.0, |(x, y)| self.get(x, y, channel));
        let (x1, y1) = (x0.wrapping_add(1), y0.wrapping_add(1));
        (1.0 - dy) * ((1.0 - dx) * at(x0, y0) + dx * at(x1, y0)) + dy * ((1.0 - dx) * at(x0, y1) + dx * at(x1, y1))
    }
}

/// The greatest integer not above, saturating; without SSE4.1 `f32::floor` is a call.
#[inline]
pub(crate) fn floor_i32(value: f32) -> i32 {
    let truncated = value as i32;
    truncated.saturating_sub(i32::from((truncated as f32) > value))
}

/// The least integer not below, saturating.
#[inline]
pub(crate) fn ceil_i32(value: f32) -> i32 {
    let truncated = value as i32;
    truncated.saturating_add(i32::from((truncated as f32) < value))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outside_is_where_it_should_be() {
        assert_eq!(WrapMode::Repeat.remap(-1, 8, 5, 3), Some((4, 2)));
        assert_eq!(WrapMode::Clamp.remap(-7, 9, 5, 3), Some((0, 2)));
        assert_eq!(WrapMode::Black.remap(5, 0, 5, 3), None);
        for wrap in [WrapMode::Repeat, WrapMode::Black, WrapMode::Clamp, WrapMode::OctahedralSphere] {
            for x in [i32::MIN, -3, -1, 0, 4, 5, 9, i32::MAX] {
                for y in [i32::MIN, -1, 0, 3, 4, 7, i32::MAX] {
                    assert!(wrap.remap(x, y, 5, 4).is_none_or(|(x, y)| x < 5 && y < 4), "{wrap:?} {x} {y}");
                }
            }
        }
        assert_eq!(WrapMode::OctahedralSphere.remap(8, 2, 8, 8), Some((7, 5)));
        assert_eq!(WrapMode::OctahedralSphere.remap(2, 8, 8, 8), Some((5, 7)));
    }

    #[test]
    fn floors_and_ceilings() {
        for value in [-2.0f32, -1.5, -0.1, 0.0, 0.1, 1.0, 7.99, 1e20, -1e20] {
            assert_eq!(floor_i32(value), value.floor() as i32);
            assert_eq!(ceil_i32(value), value.ceil() as i32);
        }
    }

    #[test]
    fn interpolation_meets_the_texels() {
        let image = Image::from_fn(4, 2, ["Y"], |x, y| [(x + 4 * y) as f32]);
        assert_eq!(image.bilinear(0.375, 0.25, 0, WrapMode::Clamp), 1.0);
        assert_eq!(image.bilinear(0.5, 0.5, 0, WrapMode::Clamp), 3.5);
        assert_eq!(image.bilinear(0.0, 0.25, 0, WrapMode::Repeat), 1.5);
        assert_eq!(image.bilinear(0.0, 0.25, 0, WrapMode::Black), 0.0);
        assert_eq!(image.nearest(0.99, 0.99, 0, WrapMode::Clamp), 7.0);
        assert_eq!(image.nearest(-0.01, 0.0, 0, WrapMode::Repeat), 3.0);
    }
}
