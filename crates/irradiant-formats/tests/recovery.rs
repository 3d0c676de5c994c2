//! One mistake, one error, and reading goes on: what the others say is read as if the mistake were mended.

use irradiant_formats::{Parsed, read_pbrt};
use irradiant_scene::Severity;
use irradiant_scene::assets::MemoryAssets;

fn read(text: &str) -> Parsed {
    read_pbrt("scene.pbrt", text.as_bytes().into(), &MemoryAssets::default())
}

/// Codes and lines of the errors of a text, in the order in which they are shown.
fn errors(text: &str) -> Vec<(&'static str, usize)> {
    let parsed = read(text);
    let errors = parsed.diagnostics.iter().filter(|d| d.severity == Severity::Error);
    errors.map(|d| (d.code, parsed.sources.locate(d.labels[0].0).map_or(0, |l| l.0))).collect()
}

#[test]
fn one_mistake_is_one_error() {
    for (text, expected) in [
        // A number too few: the next directive is still one.
        ("Translate 1 2\nWorldBegin\nShape \"sphere\"", ("E0004", 2)),
        ("LookAt 0 0 0 0 0 1 0 1\nCamera \"perspective\"\nWorldBegin", ("E0004", 2)),
        ("Scale\nWorldBegin", ("E0004", 2)),
        ("Rotate 90 1\nWorldBegin AttributeBegin AttributeEnd", ("E0004", 2)),
        ("WorldBegin\nTransform [ 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0\nAttributeBegin\nAttributeEnd", ("E0004", 3)),
        ("WorldBegin\nConcatTransform\nAttributeBegin\nAttributeEnd", ("E0013", 3)),
        ("ActiveTransform\nWorldBegin", ("E0006", 2)),
        ("WorldBegin\nMakeNamedMaterial\nAttributeBegin\nAttributeEnd", ("E0003", 3)),
        ("Option\nWorldBegin", ("E0003", 2)),
        ("Option \"disablepixeljitter\"\nWorldBegin", ("E0007", 2)),
        ("Option \"disablepixeljitter\" [ true\nWorldBegin", ("E0007", 2)),
        // A value, its list's end or the name before it is missing.
        ("WorldBegin\nShape \"sphere\" \"float radius\"\nShape \"disk\"", ("E0007", 3)),
        ("WorldBegin\nShape \"sphere\" \"float radius\" \"float zmin\" 2", ("E0007", 2)),
        ("WorldBegin\nShape \"plymesh\" \"string filename\" \"float alpha\" 1", ("E0007", 2)),
        ("WorldBegin\nShape \"sphere\" \"float radius\" [ 1 \"float zmin\" 0", ("E0007", 2)),
        ("WorldBegin\nShape \"sphere\" \"float radius\" [ 1\nAttributeBegin\nAttributeEnd", ("E0007", 2)),
        ("WorldBegin\nMaterial \"mix\" \"string materials\" [ \"a\" \"b\"\nAttributeBegin\nAttributeEnd", ("E0007", 2)),
        ("WorldBegin\nShape \"sphere\" \"float radius\" [ x 1 2\nAttributeBegin\nAttributeEnd", ("E0010", 2)),
        ("WorldBegin\nShape \"sphere\" \"flaot radius\" [ 1 2\nAttributeBegin\nAttributeEnd", ("E0009", 2)),
        ("WorldBegin\nShape \"float radius\" 1\nAttributeBegin\nAttributeEnd", ("E0003", 2)),
        // A misspelt directive is read as what it means.
        ("WorldBegn\nAttributeBegin\nShape \"sphere\"\nAttributeEnd", ("E0006", 1)),
        ("worldbegin\nShape \"sphere\"", ("E0006", 1)),
        ("WorldBegin\nAttributBegin\nShape \"sphere\"\nAttributeEnd", ("E0006", 2)),
        ("WorldBegin\nAttributeBegin\nShape \"sphere\"\nAtributeEnd", ("E0006", 4)),
        ("WorldBegin\nObjectBegn \"o\"\nShape \"sphere\"\nObjectEnd\nObjectInstance \"o\"", ("E0006", 2)),
        ("WorldBegin\nMakeNameMaterial \"m\" \"string type\" \"diffuse\"\nNamedMaterial \"m\"", ("E0006", 2)),
        ("Integ \"path\"\nWorldBegin", ("E0006", 1)),
        // A definition that cannot be read: its uses are not errors too.
        (
            "WorldBegin\nMakeNamedMaterial \"m\" \"type\" \"diffuse\"\nNamedMaterial \"m\"\nShape \"sphere\"",
            ("E0008", 2),
        ),
        (
            "WorldBegin\nTexture \"t\" \"float\" \"constant\" \"value\" 1\n\
             Material \"conductor\" \"texture roughness\" \"t\"\nShape \"sphere\"",
            ("E0008", 2),
        ),
        (
            "MakeNamedMedium \"fog\" \"type\" \"homogeneous\"\nWorldBegin\nMediumInterface \"fog\"\nShape \"sphere\"",
            ("E0008", 1),
        ),
        ("WorldBegin\nObjectBegin\nShape \"sphere\"\nObjectEnd", ("E0003", 3)),
        // No WorldBegin at all, or too far down.
        ("Camera \"perspective\"\nShape \"sphere\"\nShape \"disk\"", ("E0104", 2)),
        ("AttributeBegin\nShape \"sphere\"\nAttributeEnd\nShape \"disk\"\nWorldBegin", ("E0101", 1)),
        (
            "WorldBegin\nTexture \"t\" \"color\" \"constant\"\nMaterial \"diffuse\" \"texture reflectance\" \"t\"\nShape \"sphere\"",
            ("E1102", 2),
        ),
        // What is needed is there, though not as it should be.
        ("WorldBegin\nShape \"plymesh\" \"string filename\" 3", ("E0010", 2)),
        ("WorldBegin\nShape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 y ]", ("E0010", 2)),
        // Too much.
        ("Translate 1 2 3 4\nWorldBegin", ("E0006", 1)),
        ("WorldBegin\nTransform [ 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1 1 ]\nShape \"sphere\"", ("E0013", 2)),
    ] {
        assert_eq!(errors(text), [expected], "{text}");
    }
}

#[test]
fn what_follows_a_mistake_is_read() {
    let parsed = read(
        "Translate 1 2\nCamera \"orthographic\"\nWorldBegn\nShpae \"sphere\" \"float radius\" 3\n\
         Shape \"disk\" \"float radius\" \"float height\" 2\nShape \"cylinder\" \"float radius\" [ 4 \"float zmin\" 0",
    );
    let kinds: Vec<&str> = parsed.diagnostics.iter().map(|d| d.code).collect();
    assert_eq!(kinds, ["E0004", "E0006", "E0006", "E0007", "E0007"]);
    assert_eq!(parsed.desc.shapes.len(), 3);
    assert!(matches!(parsed.desc.camera.kind, irradiant_scene::desc::CameraKind::Orthographic { .. }));
}

#[test]
fn errors_come_in_the_order_of_lines() {
    // Textures and materials are looked at when all names are known, shapes before; the reader of messages need not know.
    let text = "WorldBegin\nMaterial \"difuse\"\nShape \"spere\"\nTexture \"t\" \"float\" \"constnt\"\nShape \"dsk\"\n\
        NamedMaterial \"gone\"\nShape \"sphere\" \"float radus\" 1";
    let found = errors(text);
    let lines: Vec<usize> = found.iter().map(|e| e.1).collect();
    assert_eq!(lines, [2, 3, 4, 5, 6, 7], "{found:?}");
}

#[test]
fn everyday_names_of_metals_lead_to_the_chemists() {
    for (word, meant) in [
        ("metal-Gold-eta", "metal-Au-eta"),
        ("silver k", "metal-Ag-k"),
        ("Copper", "metal-Cu-eta"),
        ("metal-brass-k", "metal-CuZn-k"),
        ("metal-aluminum-eta", "metal-Al-eta"),
        ("metal-au-eta", "metal-Au-eta"),
        ("glass-BK8", "glass-BK7"),
    ] {
        let parsed = read(&format!("WorldBegin Material \"conductor\" \"spectrum eta\" \"{word}\""));
        let help = parsed.diagnostics.iter().find_map(|d| d.help.clone());
        assert_eq!(help, Some(format!("did you mean \"{meant}\"?")), "{word}");
    }
}

#[test]
fn what_is_no_text_is_named_and_keeps_its_bytes() {
    let cases: [(&[u8], &str); 4] = [
        (b"\x76\x2f\x31\x01\x02\0\0\0", "an OpenEXR picture"),
        (b"<scene version=\"3.0.0\"></scene>", "an XML file"),
        (b"Shape \0\x1b[31m", "a binary file"),
        (b"ply\nformat ascii 1.0\n", "a PLY mesh"),
    ];
    for (bytes, name) in cases {
        let parsed = read_pbrt("scene.pbrt", bytes.into(), &MemoryAssets::default());
        let shown: String = parsed.diagnostics.iter().map(|d| d.render(&parsed.sources)).collect();
        assert_eq!(parsed.diagnostics.error_count(), 1, "{shown}");
        assert!(shown.contains("E1010") && shown.contains(name), "{shown}");
        let assets = MemoryAssets::default().with("other", bytes);
        let parsed = read_pbrt("scene.pbrt", b"WorldBegin\nInclude \"other\""[..].into(), &assets);
        let found: Vec<&str> = parsed.diagnostics.iter().map(|d| d.code).collect();
        assert_eq!(found, ["E1010"]);
    }
    // Control characters that stand in text are shown, not obeyed.
    let parsed = read("WorldBegin\nShape \"\u{1b}[31msphere\u{7}\"\nMaterial \"\u{8}\u{8}\"\n\u{1b}c");
    let shown: String = parsed.diagnostics.iter().map(|d| d.render(&parsed.sources)).collect();
    assert!(shown.contains("error") && !shown.contains(|c: char| c.is_control() && c != '\n'), "{shown:?}");
}
