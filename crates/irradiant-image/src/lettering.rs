//! Plain letters on pictures, for labels: 5 by 7 dots, drawn for this program. Printable ASCII; anything else is a box.

use crate::image::{Image, Pixels};

/// Dots of a letter, across and down; between letters one dot is left free.
pub const LETTER: [usize; 2] = [5, 7];

/// Rows from the top, bit 4 leftmost; from the blank to the tilde.
#[rustfmt::skip]
const LETTERS: [[u8; 7]; 95] = [
    [0, 0, 0, 0, 0, 0, 0],
    [4, 4, 4, 4, 4, 0, 4],
    [10, 10, 10, 0, 0, 0, 0],
    [10, 10, 31, 10, 31, 10, 10],
    [4, 15, 20, 14, 5, 30, 4],
    [25, 25, 2, 4, 8, 19, 19],
    [12, 18, 20, 8, 21, 18, 13],
    [4, 4, 8, 0, 0, 0, 0],
    [2, 4, 8, 8, 8, 4, 2],
    [8, 4, 2, 2, 2, 4, 8],
    [0, 10, 4, 31, 4, 10, 0],
    [0, 4, 4, 31, 4, 4, 0],
    [0, 0, 0, 0, 4, 4, 8],
    [0, 0, 0, 31, 0, 0, 0],
    [0, 0, 0, 0, 0, 12, 12],
    [1, 1, 2, 4, 8, 16, 16],
    [14, 17, 19, 21, 25, 17, 14],
    [4, 12, 4, 4, 4, 4, 14],
    [14, 17, 1, 6, 8, 16, 31],
    [30, 1, 1, 14, 1, 1, 30],
    [2, 6, 10, 18, 31, 2, 2],
    [31, 16, 30, 1, 1, 17, 14],
    [6, 8, 16, 30, 17, 17, 14],
    [31, 1, 2, 4, 4, 8, 8],
    [14, 17, 17, 14, 17, 17, 14],
    [14, 17, 17, 15, 1, 2, 12],
    [0, 12, 12, 0, 12, 12, 0],
    [0, 12, 12, 0, 12, 4, 8],
    [2, 4, 8, 16, 8, 4, 2],
    [0, 0, 31, 0, 31, 0, 0],
    [8, 4, 2, 1, 2, 4, 8],
    [14, 17, 1, 2, 4, 0, 4],
    [14, 17, 23, 21, 23, 16, 14],
    [4, 10, 17, 17, 31, 17, 17],
    [30, 17, 17, 30, 17, 17, 30],
    [14, 17, 16, 16, 16, 17, 14],
    [28, 18, 17, 17, 17, 18, 28],
    [31, 16, 16, 30, 16, 16, 31],
    [31, 16, 16, 30, 16, 16, 16],
    [14, 17, 16, 23, 17, 17, 15],
    [17, 17, 17, 31, 17, 17, 17],
    [14, 4, 4, 4, 4, 4, 14],
    [7, 2, 2, 2, 2, 18, 12],
    [17, 18, 20, 24, 20, 18, 17],
    [16, 16, 16, 16, 16, 16, 31],
    [17, 27, 21, 21, 17, 17, 17],
    [17, 25, 21, 21, 19, 17, 17],
    [14, 17, 17, 17, 17, 17, 14],
    [30, 17, 17, 30, 16, 16, 16],
    [14, 17, 17, 17, 21, 18, 13],
    [30, 17, 17, 30, 20, 18, 17],
    [15, 16, 16, 14, 1, 1, 30],
    [31, 4, 4, 4, 4, 4, 4],
    [17, 17, 17, 17, 17, 17, 14],
    [17, 17, 17, 17, 17, 10, 4],
    [17, 17, 17, 21, 21, 27, 17],
    [17, 17, 10, 4, 10, 17, 17],
    [17, 17, 10, 4, 4, 4, 4],
    [31, 1, 2, 4, 8, 16, 31],
    [14, 8, 8, 8, 8, 8, 14],
    [16, 16, 8, 4, 2, 1, 1],
    [14, 2, 2, 2, 2, 2, 14],
    [4, 10, 17, 0, 0, 0, 0],
    [0, 0, 0, 0, 0, 0, 31],
    [8, 4, 2, 0, 0, 0, 0],
    [0, 0, 14, 1, 15, 17, 15],
    [16, 16, 30, 17, 17, 17, 30],
    [0, 0, 15, 16, 16, 16, 15],
    [1, 1, 15, 17, 17, 17, 15],
    [0, 0, 14, 17, 31, 16, 14],
    [6, 9, 8, 28, 8, 8, 8],
    [0, 15, 17, 17, 15, 1, 14],
    [16, 16, 30, 17, 17, 17, 17],
    [4, 0, 12, 4, 4, 4, 14],
    [2, 0, 6, 2, 2, 18, 12],
    [16, 16, 18, 20, 24, 20, 18],
    [12, 4, 4, 4, 4, 4, 14],
    [0, 0, 26, 21, 21, 21, 21],
    [0, 0, 30, 17, 17, 17, 17],
    [0, 0, 14, 17, 17, 17, 14],
    [0, 30, 17, 17, 30, 16, 16],
    [0, 15, 17, 17, 15, 1, 1],
    [0, 0, 22, 25, 16, 16, 16],
    [0, 0, 15, 16, 14, 1, 30],
    [8, 8, 28, 8, 8, 9, 6],
    [0, 0, 17, 17, 17, 17, 15],
    [0, 0, 17, 17, 17, 10, 4],
    [0, 0, 17, 17, 21, 21, 10],
    [0, 0, 17, 10, 4, 10, 17],
    [0, 0, 17, 17, 15, 1, 14],
    [0, 0, 31, 2, 4, 8, 31],
    [2, 4, 4, 8, 4, 4, 2],
    [4, 4, 4, 4, 4, 4, 4],
    [8, 4, 4, 2, 4, 4, 8],
    [0, 0, 8, 21, 2, 0, 0],
];

const BOX: [u8; 7] = [31, 17, 17, 17, 17, 17, 31];

fn dots(letter: char) -> [u8; 7] {
    let index = (letter as u32).checked_sub(32).map(|i| i as usize);
    index.and_then(|i| LETTERS.get(i)).copied().unwrap_or(BOX)
}

/// Width of a text in pixels when each dot is `scale` pixels wide.
pub fn text_width(text: &str, scale: usize) -> usize {
    (text.chars().count() * (LETTER[0] + 1)).saturating_sub(1) * scale
}

/// Writes a text on a picture of 8-bit R, G, B, its upper left corner at (x, y); what lies outside is cut off. Pictures of
/// other kinds are left alone.
pub fn write_text(image: &mut Image, [x, y]: [usize; 2], scale: usize, text: &str, colour: [u8; 3]) {
    let (width, height, count) = (image.width(), image.height(), image.channel_count());
    let Some(codes) = image.codes_mut().filter(|_| count == 3) else { return };
    for (i, letter) in text.chars().enumerate() {
        for (row, bits) in dots(letter).into_iter().enumerate() {
            for column in (0..LETTER[0]).filter(|c| bits >> (LETTER[0] - 1 - c) & 1 == 1) {
                for dy in 0..scale {
                    for dx in 0..scale {
                        let at = [x + (i * (LETTER[0] + 1) + column) * scale + dx, y + row * scale + dy];
                        if at[0] < width && at[1] < height {
                            let first = (at[1] * width + at[0]) * 3;
                            codes[first..first + 3].copy_from_slice(&colour);
                        }
                    }
                }
            }
        }
    }
}

impl Image {
    /// The codes of an 8-bit picture.
    fn codes_mut(&mut self) -> Option<&mut [u8]> {
        match self.pixels_mut() {
            Pixels::U8(codes) => Some(codes),
            Pixels::F16(_) | Pixels::F32(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encoding::Encoding;

    #[test]
    fn letters_can_be_told_apart() {
        for a in ' '..='~' {
            assert!(a == ' ' || dots(a) != [0; 7], "{a}");
            assert!(dots(a).iter().all(|row| *row < 32));
            if let Some(b) = (' '..a).find(|b| dots(*b) == dots(a)) {
                panic!("{a} looks like {b}");
            }
        }
        assert_eq!((dots('ä'), dots('\n')), (BOX, BOX));
    }

    #[test]
    fn texts_are_cut_off_at_the_edges() {
        let mut image = Image::from_u8(20, 9, &["R", "G", "B"], vec![0; 540], Encoding::Srgb).unwrap();
        write_text(&mut image, [1, 1], 1, "Hi there", [255, 128, 0]);
        let lit = |x: usize, y: usize| image.get(x, y, 0) > 0.5;
        // The H: two uprights and a bar.
        assert!(lit(1, 1) && lit(5, 7) && lit(3, 4) && !lit(3, 1) && !lit(6, 4));
        write_text(&mut image, [500, 500], 3, "far away", [255; 3]);
        assert_eq!(text_width("Hi", 2), 22);
        assert_eq!(text_width("", 2), 0);
    }
}
