//! Broken files give an error or a picture, never a panic and never more memory than their size explains.

use irradiant_image::{Encoding, FileFormat, Image, ImageError, PngDepth, ReadOptions, read, write, write_png};

/// One small valid file of each kind, with its name.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let image = Image::from_fn(23, 19, ["R", "G", "B"], |x, y| [x as f32 / 22.0, y as f32 / 18.0, (x * y % 7) as f32]);
    let half = image.convert(irradiant_image::PixelFormat::F16, Encoding::Linear);
    let grey = image.select(&["G"]).unwrap();
    let mut tga = vec![0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4, 0, 2, 0, 24, 0x20];
    tga.extend([0x84, 1, 2, 3, 0x02, 4, 5, 6, 7, 8, 9, 10, 11, 12]);
    let mut bmp = b"BM\x4e\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x03\0\0\0\x02\0\0\0\x01\0\x18\0".to_vec();
    bmp.resize(54, 0);
    bmp.extend([1, 2, 3, 4, 5, 6, 7, 8, 9, 0, 0, 0, 11, 12, 13, 14, 15, 16, 17, 18, 19, 0, 0, 0]);
    vec![
        ("a.exr", write(&image, FileFormat::Exr).unwrap()),
        ("half.exr", write(&half, FileFormat::Exr).unwrap()),
        ("a.png", write(&image, FileFormat::Png).unwrap()),
        ("grey16.png", write_png(&grey, PngDepth::Sixteen).unwrap()),
        ("a.pfm", write(&image, FileFormat::Pfm).unwrap()),
        ("a.hdr", write(&image, FileFormat::Hdr).unwrap()),
        ("a.jpg", write(&image, FileFormat::Jpeg).unwrap()),
        ("a.qoi", write(&image, FileFormat::Qoi).unwrap()),
        ("a.tga", tga),
        ("a.bmp", bmp),
    ]
}

/// Reads a broken file with a small budget; whatever comes out must respect it.
fn survive(bytes: &[u8], name: &str, what: &str) {
    let options = ReadOptions { max_bytes: 16 << 20, ..ReadOptions::default() };
    if let Ok(image) = read(bytes, name, &options) {
        assert!(image.bytes_used() <= 16 << 20, "{name}, {what}: {} bytes", image.bytes_used());
    }
}

#[test]
fn intact_files_are_read() {
    for (name, bytes) in files() {
        let image = read(&bytes, name, &ReadOptions::default()).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(image.width() > 2 && image.height() > 1);
    }
}

#[test]
fn truncated_files_are_survived() {
    for (name, bytes) in files() {
        for length in (0..bytes.len()).step_by(16).chain([1, 2, 3, 9, 17]).filter(|&length| length < bytes.len()) {
            survive(&bytes[..length], name, &format!("cut at {length}"));
        }
        // Half a file is not a picture in formats that say how much there must be.
        if !name.ends_with("jpg") {
            assert!(read(&bytes[..bytes.len() / 2], name, &ReadOptions::default()).is_err(), "{name}");
        }
    }
}

#[test]
fn flipped_bytes_are_survived() {
    for (name, bytes) in files() {
        for place in 0..bytes.len().min(420) {
            for flip in [0x01, 0x80, 0xff, 0x3d] {
                let mut broken = bytes.clone();
                broken[place] ^= flip;
                survive(&broken, name, &format!("byte {place} ^ {flip:#x}"));
            }
        }
    }
}

#[test]
fn headers_that_promise_too_much_are_refused_early() {
    let huge: [(&str, &[u8]); 4] = [
        ("a.pfm", b"PF\n65535 65535\n-1.0\n1234567890"),
        ("a.qoi", b"qoif\xff\xff\xff\xff\xff\xff\xff\xff\x04\x00"),
        ("a.hdr", b"#?RADIANCE\n\n-Y 100000 +X 100000\n1234"),
        ("a.tga", &[0, 0, 10, 0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255, 32, 0, 1, 2]),
    ];
    for (name, bytes) in huge {
        let options = ReadOptions { max_bytes: u64::MAX, ..ReadOptions::default() };
        assert!(matches!(read(bytes, name, &options), Err(ImageError::TooLarge { .. })), "{name}");
    }
    // The data window of an EXR file, widened to 2^30 x 2^30.
    for (name, mut bytes) in files().into_iter().filter(|(name, _)| name.ends_with("exr")) {
        let mark = b"dataWindow\0box2i\0";
        let at = bytes.windows(mark.len()).position(|window| window == mark).unwrap() + mark.len() + 4 + 8;
        bytes[at..at + 8].copy_from_slice(&[0, 0, 0, 0x40, 0, 0, 0, 0x40]);
        assert!(read(&bytes, name, &ReadOptions::default()).is_err(), "{name}");
    }
}

#[test]
fn errors_say_what_and_where() {
    let error = read(b"PF\nten 10\n-1\n", "a.pfm", &ReadOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "invalid image: \"ten\" is not a width (at byte 3)");
    let error = read(b"hello", "notes.txt", &ReadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("notes.txt"));
}
