//! A million triangles, as text and as PLY: the times and sizes that the program promises rest on these.

use irradiant_formats::{mesh, read_pbrt};
use irradiant_scene::assets::MemoryAssets;
use irradiant_scene::desc::ShapeKind;
use std::fmt::Write as _;
use std::time::Instant;

const SIDE: usize = 708;

fn height(x: usize, y: usize) -> f32 {
    ((x * 31 + y * 17) % 1009) as f32 * 0.001_234_567
}

fn triangles() -> impl Iterator<Item = [usize; 3]> {
    let quads = (0..SIDE - 1).flat_map(|y| (0..SIDE - 1).map(move |x| y * SIDE + x));
    quads.flat_map(|i| [[i, i + 1, i + SIDE], [i + 1, i + SIDE + 1, i + SIDE]])
}

/// CPU seconds of this process's main clock would be better; wall time on a loaded machine is bounded generously.
fn within(seconds: f64, what: &str, start: Instant) {
    let taken = start.elapsed().as_secs_f64();
    eprintln!("{what}: {taken:.3} s");
    assert!(cfg!(debug_assertions) || taken < seconds, "{what} took {taken} s");
}

#[test]
fn a_million_triangles_of_text_are_read_in_seconds() {
    let mut text = String::from("WorldBegin Shape \"trianglemesh\" \"point3 P\" [\n");
    for y in 0..SIDE {
        for x in 0..SIDE {
            let _ = writeln!(text, "{} {} {}", x as f32 * 0.013, y as f32 * 0.0171, height(x, y));
        }
    }
    text += "] \"integer indices\" [\n";
    triangles().for_each(|[a, b, c]| writeln!(text, "{a} {b} {c}").unwrap_or_default());
    text += "]\n";
    eprintln!("{} MB of text", text.len() / 1_000_000);
    let start = Instant::now();
    let parsed = read_pbrt("large", text.as_bytes().into(), &MemoryAssets::default());
    within(3.0, "text", start);
    let ShapeKind::Mesh(mesh) = &parsed.desc.shapes[0].kind else { panic!() };
    assert_eq!(mesh.triangles.len(), 999_698);
    assert_eq!(mesh.positions[SIDE + 1], [0.013, 0.0171, height(1, 1)]);
}

#[test]
fn a_million_triangles_of_binary_ply_are_read_at_once() {
    let n = triangles().count();
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property float nx\nproperty float ny\nproperty float nz\nproperty float u\nproperty float v\n\
         element face {n}\nproperty list uint8 int vertex_indices\nend_header\n",
        SIDE * SIDE
    )
    .into_bytes();
    for y in 0..SIDE {
        for x in 0..SIDE {
            for v in [x as f32, y as f32, height(x, y), 0.0, 0.0, 1.0, 0.5, 0.25] {
                bytes.extend(v.to_le_bytes());
            }
        }
    }
    for face in triangles() {
        bytes.push(3);
        face.iter().for_each(|i| bytes.extend((*i as u32).to_le_bytes()));
    }
    let start = Instant::now();
    let (mesh, remarks) = mesh::ply::read(&bytes).unwrap();
    within(1.0, "PLY", start);
    assert!(remarks.is_empty());
    assert_eq!(mesh.triangles.len(), n);
    assert_eq!(mesh.positions[SIDE], [0.0, 1.0, height(0, 1)]);
}
