//! Scenes for the drivers of the peers: `scene.json`, and `geometry.bin` with points (3 x f32) and indices (3 x u32).

use super::{Geometry, Material, Scene};
use serde_json::{Value, json};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes both files into a folder; gives the path of the first.
pub fn write(scene: &Scene, folder: &Path) -> Result<PathBuf, String> {
    let fail = |e: std::io::Error| format!("{}: {e}", folder.display());
    std::fs::create_dir_all(folder).map_err(fail)?;
    let file = std::fs::File::create(folder.join("geometry.bin")).map_err(fail)?;
    let mut out = std::io::BufWriter::new(file);
    let mut offset = 0;
    let mut shapes = Vec::new();
    for shape in &scene.shapes {
        let geometry = match &shape.geometry {
            Geometry::Mesh(mesh) => {
                let points = mesh.positions.iter().flatten().flat_map(|x| x.to_le_bytes());
                let indices = mesh.triangles.iter().flatten().flat_map(|x| x.to_le_bytes());
                let bytes: Vec<u8> = points.chain(indices).collect();
                out.write_all(&bytes).map_err(fail)?;
                let said =
                    json!({ "offset": offset, "points": mesh.positions.len(), "triangles": mesh.triangles.len() });
                offset += bytes.len();
                json!({ "mesh": said })
            }
            Geometry::Sphere { centre, radius } => json!({ "sphere": { "centre": centre, "radius": radius } }),
        };
        let material = match shape.material {
            Material::Diffuse(rgb) => json!({ "kind": "diffuse", "rgb": rgb }),
            Material::Conductor { f0, alpha } => json!({ "kind": "conductor", "f0": f0, "alpha": alpha }),
        };
        shapes.push(
            json!({ "name": shape.name, "geometry": geometry, "material": material, "emission": shape.emission }),
        );
    }
    out.flush().map_err(fail)?;
    let camera = &scene.camera;
    let all: Value = json!({
        "name": scene.name, "width": scene.resolution[0], "height": scene.resolution[1], "max_bounces": scene.max_bounces,
        "camera": { "origin": camera.origin, "target": camera.target, "fov_x": camera.fov_x },
        "sky": scene.sky.is_some(), "shapes": shapes,
    });
    let path = folder.join("scene.json");
    std::fs::write(&path, all.to_string()).map_err(fail)?;
    Ok(path)
}
