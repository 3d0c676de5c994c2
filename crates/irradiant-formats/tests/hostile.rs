//! Texts that no author would write: nothing panics, hangs or takes memory beyond its size.

use irradiant_formats::{Limits, mesh, read_pbrt, read_pbrt_with};
use irradiant_scene::assets::MemoryAssets;
use std::sync::Arc;

const SEED: &str = r#"
Option "disablepixeljitter" true
LookAt 0 0 5 0 0 0 0 1 0
ActiveTransform EndTime Translate 1 0 0 ActiveTransform All
Camera "perspective" "float fov" [ 45 ] "float screenwindow" [ -1 1 -1 1 ]
Film "rgb" "string filename" "a.exr" "integer xresolution" [ 400 ] "float cropwindow" [0 1 0 1]
Sampler "stratified" "integer xsamples" 8 "bool jitter" false
PixelFilter "mitchell" "float B" .3
Integrator "path" "integer maxdepth" 7
WorldBegin
Attribute "shape" "float radius" 2
Texture "t" "spectrum" "checkerboard" "rgb tex1" [ .5 .5 .5 ] "float uscale" 8
Texture "s" "float" "scale" "float tex" 2 "float scale" .5
MakeNamedMaterial "m" "string type" "coateddiffuse" "texture reflectance" "t" "float roughness" .1
Material "conductor" "spectrum eta" "metal-Au-eta" "spectrum k" [ 300 1 800 2 ]
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [1 1 1]
MediumInterface "fog" ""
LightSource "infinite" "blackbody L" 6500 "float scale" 2
AttributeBegin AreaLightSource "diffuse" "rgb L" [ 1 1 1 ] Shape "sphere" AttributeEnd
ObjectBegin "o" Shape "disk" "float height" 1e-3 # note
Shape "loopsubdiv" "point3 P" [0 0 0 1 0 0 0 1 0 1 1 1] "integer indices" [0 1 2 2 1 3] "integer levels" 2
ObjectEnd
Rotate 30 0 1 0 Scale 2 2 2 Transform [ 1 0 0 0 0 1 0 0 0 0 1 0 3 4 5 1 ]
ObjectInstance "o" NamedMaterial "m"
Shape "trianglemesh" "point3 P" [0 0 0 1 0 0 0 1 0] "integer indices" [0 1 2] "point2 uv" [0 0 1 0 0 1]
Shape "curve" "string type" "ribbon" "point3 P" [0 0 0 1 1 1 2 2 2 3 3 4] "normal N" [0 0 1 1 0 0] "float width" .1
Include "more.pbrt" Import "more.pbrt"
Shape "plymesh" "string filename" "a.ply" ReverseOrientation
"#;

const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
    element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n4 0 1 3 2\n";

fn binary_ply() -> Vec<u8> {
    let mut out = PLY.split("0 0 0\n").next().unwrap().replace("ascii", "binary_little_endian").into_bytes();
    for v in [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0] {
        out.extend(v.to_le_bytes());
    }
    for face in [&[0i32, 1, 2][..], &[0, 1, 3, 2]] {
        out.push(face.len() as u8);
        face.iter().for_each(|i| out.extend(i.to_le_bytes()));
    }
    out
}

/// A small generator with a fixed seed: the tests pass or fail, never flicker.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as usize) % n.max(1)
    }

    fn mutate(&mut self, text: &[u8]) -> Vec<u8> {
        const WORDS: [&str; 14] = [
            "\"",
            "[",
            "]",
            "-1",
            "99999999999",
            "1e400",
            "nan",
            "AttributeEnd",
            "ObjectEnd",
            "\\",
            "WorldBegin",
            "\n",
            "0",
            "\"string filename\"",
        ];
        let mut out = text.to_vec();
        for _ in 0..1 + self.below(4) {
            let (a, b) = (self.below(out.len()), self.below(out.len()));
            match self.below(6) {
                0 => out[a] = self.below(256) as u8,
                1 => drop(out.drain(a.min(b)..(a.min(b) + self.below(40)).min(out.len()))),
                2 => {
                    let piece = out[a..(a + self.below(60)).min(out.len())].to_vec();
                    out.splice(b..b, piece);
                }
                3 => {
                    let word = WORDS[self.below(WORDS.len())];
                    out.splice(a..a, word.bytes());
                }
                4 => out.truncate(a.max(1)),
                _ => {
                    let bit = self.below(8);
                    out[a] ^= 1 << bit;
                }
            }
            if out.is_empty() {
                out.push(b' ');
            }
        }
        out
    }
}

fn assets() -> MemoryAssets {
    MemoryAssets::default()
        .with("more.pbrt", &b"AttributeBegin Material \"diffuse\" Shape \"cylinder\" AttributeEnd"[..])
        .with("a.ply", PLY.as_bytes())
}

#[test]
fn the_seed_itself_is_right() {
    let parsed = read_pbrt("seed", SEED.as_bytes().into(), &assets());
    let errors: String = parsed.diagnostics.iter().map(|d| d.render(&parsed.sources)).collect();
    assert_eq!(parsed.diagnostics.error_count(), 0, "{errors}");
    assert_eq!(parsed.desc.shapes.len(), 6);
    assert_eq!(parsed.desc.objects[0].shapes.len(), 2);
}

#[test]
fn twenty_thousand_damaged_scenes_are_survived() {
    let mut random = Random(1);
    let assets = assets();
    let limits = Limits { max_subdivided_faces: 1 << 12, ..Limits::default() };
    let mut with_errors = 0;
    for _ in 0..20_000 {
        let text = random.mutate(SEED.as_bytes());
        let parsed = read_pbrt_with("damaged", text.into(), &assets, limits);
        with_errors += usize::from(parsed.diagnostics.has_errors());
        for d in parsed.diagnostics.iter() {
            d.render(&parsed.sources);
        }
        // What it holds is in range whatever was said.
        let n = parsed.desc.materials.len() as u32;
        assert!(parsed.desc.shapes.iter().all(|s| s.material.0 < n));
    }
    assert!(with_errors > 10_000, "{with_errors}");
}

#[test]
fn twenty_thousand_damaged_meshes_are_survived() {
    let mut random = Random(2);
    let binary = binary_ply();
    assert_eq!(mesh::ply::read(&binary).unwrap().0, mesh::ply::read(PLY.as_bytes()).unwrap().0);
    let mut read = 0;
    for i in 0..20_000 {
        let bytes = random.mutate(if i % 2 == 0 { PLY.as_bytes() } else { &binary });
        if let Ok((m, _)) = mesh::ply::read(&bytes) {
            read += 1;
            let n = m.positions.len() as u32;
            assert!(m.triangles.iter().flatten().chain(m.quads.iter().flatten()).all(|i| *i < n));
            assert!(m.positions.iter().flatten().all(|c| c.is_finite()));
        }
    }
    assert!(read > 100, "{read}");
}

fn codes(text: &str, assets: &MemoryAssets, limits: Limits) -> Vec<&'static str> {
    let parsed = read_pbrt_with("hostile", text.as_bytes().into(), assets, limits);
    parsed.diagnostics.iter().map(|d| d.code).collect()
}

#[test]
fn nesting_and_includes_are_bounded() {
    let deep = format!("WorldBegin {}", "AttributeBegin ".repeat(1_000_000));
    assert_eq!(codes(&deep, &assets(), Limits::default()), ["E0109"]);
    let deep = format!("WorldBegin {}", "ObjectBegin \"a\" ".repeat(100_000));
    assert!(codes(&deep, &assets(), Limits::default()).len() <= 101);
    // Two files that include one another, and a chain in which each includes the next twice: 2^40 lines.
    let circle = MemoryAssets::default().with("a", &b"Include \"b\""[..]).with("b", &b"Include \"a\""[..]);
    assert_eq!(codes("WorldBegin Include \"a\"", &circle, Limits::default()), ["E0109"]);
    let mut doubling = MemoryAssets::default().with("40", &b"Identity"[..]);
    for i in 0..40 {
        let text = format!("Include \"{0}\" Include \"{0}\"", i + 1);
        doubling = doubling.with(i.to_string(), text.into_bytes());
    }
    let limits = Limits { max_total_bytes: 1 << 20, ..Limits::default() };
    assert!(codes("WorldBegin Include \"0\"", &doubling, limits).contains(&"E0109"));
    // An import at the end of which something is open is closed there.
    let open = MemoryAssets::default().with("o", &b"AttributeBegin Shape \"sphere\""[..]);
    assert_eq!(codes("WorldBegin Import \"o\" Shape \"sphere\"", &open, Limits::default()), ["E0103"]);
    let closing = MemoryAssets::default().with("c", &b"AttributeEnd"[..]);
    assert_eq!(codes("WorldBegin AttributeBegin Import \"c\" AttributeEnd", &closing, Limits::default()), ["E0102"]);
}

#[test]
fn endless_errors_stop_at_a_hundred() {
    let text = format!("WorldBegin {}", "Shape \"spere\" ".repeat(100_000));
    assert!(codes(&text, &assets(), Limits::default()).len() <= 101);
    let text = "\"".repeat(100_000);
    assert!(codes(&text, &assets(), Limits::default()).len() <= 102);
    let text = "[".repeat(1_000_000);
    assert!(codes(&text, &assets(), Limits::default()).len() <= 102);
    let long = format!("WorldBegin Shape \"{}\"", "x".repeat(1_000_000));
    assert_eq!(codes(&long, &assets(), Limits::default()), ["E0201"]);
}

#[test]
fn a_broken_gzip_file_is_an_error() {
    let parsed = read_pbrt("s.pbrt.gz", Arc::from(&[0x1f, 0x8b, 8, 0, 0][..]), &MemoryAssets::default());
    assert_eq!(parsed.diagnostics.iter().map(|d| d.code).next(), Some("E1002"));
}
