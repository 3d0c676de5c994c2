//! Windows bitmaps in, through the `image` crate.

use std::io::Cursor;

use image::codecs::bmp::BmpDecoder;

use crate::error::ImageError;
use crate::format::jpeg::decode_u8;
use crate::format::{RUN_RATIO, ReadOptions, guarded};
use crate::image::Image;

/// Reads a BMP file: R, G, B or R, G, B, A in 8 bits, sRGB unless the options say otherwise.
pub fn read_bmp(bytes: &[u8], options: &ReadOptions) -> Result<Image, ImageError> {
    guarded("BMP", || {
        let decoder =
            BmpDecoder::new(Cursor::new(bytes)).map_err(|error| ImageError::invalid(format!("BMP: {error}")))?;
        decode_u8(decoder, bytes.len(), RUN_RATIO, options)
    })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A 24-bit bitmap of 3 x 2 pixels, rows from the bottom and padded to 4 bytes.
    pub(crate) fn small() -> Vec<u8> {
        let mut file = b"BM".to_vec();
        file.extend(78u32.to_le_bytes());
        file.extend([0; 4]);
        file.extend(54u32.to_le_bytes());
        file.extend(40u32.to_le_bytes());
        file.extend(3i32.to_le_bytes());
        file.extend(2i32.to_le_bytes());
        file.extend([1, 0, 24, 0]);
        file.extend([0; 24]);
        file.extend([1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 0, 0]);
        file.extend([11, 12, 13, 14, 15, 16, 17, 18, 19, 0, 0, 0]);
        file
    }

    #[test]
    fn blue_comes_first_and_the_bottom_row_too() {
        let image = read_bmp(&small(), &ReadOptions::default()).unwrap();
        let crate::Pixels::U8(codes) = image.pixels() else { panic!("8-bit storage expected") };
        assert_eq!(codes[..6], [13, 12, 11, 16, 15, 14]);
        assert_eq!(codes[9..12], [3, 2, 1]);
    }
}
