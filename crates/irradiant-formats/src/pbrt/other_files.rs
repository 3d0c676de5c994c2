//! What people hand to a reader of scenes by mistake.

/// First bytes, and what has them.
const BEGINNINGS: [(&[u8], &str); 18] = [
    (b"\x76\x2f\x31\x01", "an OpenEXR picture"),
    (b"\x89PNG", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"#?RADIANCE", "a Radiance picture"),
    (b"#?RGBE", "a Radiance picture"),
    (b"qoif", "a QOI picture"),
    (b"ply\n", "a PLY mesh (a scene names it in Shape \"plymesh\" \"string filename\")"),
    (b"ply\r", "a PLY mesh (a scene names it in Shape \"plymesh\" \"string filename\")"),
    (b"glTF", "a glTF file"),
    (b"{", "a JSON file (glTF?)"),
    (b"<", "an XML file (a scene of Mitsuba?)"),
    (b"PK\x03\x04", "a zip archive; unpack it first"),
    (b"\x28\xb5\x2f\xfd", "a zstd archive; unpack it first"),
    (b"BZh", "a bzip2 archive; unpack it first"),
    (b"\xfd7zXZ", "an xz archive; unpack it first"),
    (b"BLENDER", "a Blender file"),
    (b"\xff\xfe", "UTF-16 text; save it as UTF-8"),
    (b"\xfe\xff", "UTF-16 text; save it as UTF-8"),
];

/// What a file is if it cannot be pbrt text: by its first bytes, or a binary file if there is a zero among the first 4096.
pub(crate) fn not_a_scene(bytes: &[u8]) -> Option<&'static str> {
    let known = BEGINNINGS.iter().find(|(beginning, _)| bytes.starts_with(beginning)).map(|(_, name)| *name);
    known.or_else(|| bytes[..bytes.len().min(4096)].contains(&0).then_some("a binary file"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_are_scenes_and_others_are_not() {
        for text in ["", "WorldBegin", "# comment", "\u{feff}WorldBegin", "  \n<"] {
            assert_eq!(not_a_scene(text.as_bytes()), None, "{text}");
        }
        assert_eq!(not_a_scene(b"\x89PNG\r\n"), Some("a PNG picture"));
        assert_eq!(not_a_scene(b"Shape \0"), Some("a binary file"));
    }
}
