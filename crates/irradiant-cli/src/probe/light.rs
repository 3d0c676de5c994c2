//! Light at a point, and the rendering equation.

use irradiant::image::{FileFormat, Image};
use irradiant::math::Point2;
use irradiant::renderer::inspect::incident::{Estimate, mean_residual};
use irradiant::renderer::inspect::{IncidentSettings, incident as measure, residuals};
use irradiant::renderer::path::PathIntegrator;
use irradiant::{Error, Job};
use serde_json::{Value, json};
use std::path::Path;

fn row(name: &str, e: &Estimate) -> String {
    let [r, g, b] = e.rgb;
    let [er, eg, eb] = e.error;
    let refused = match e.refused {
        0 => String::new(),
        n => format!("  ({n} samples were not finite and are left out)"),
    };
    format!("{name:<34} R {r:.6e} +- {er:.1e}  G {g:.6e} +- {eg:.1e}  B {b:.6e} +- {eb:.1e}{refused}")
}

fn estimate(e: &Estimate) -> Value {
    json!({ "rgb": e.rgb, "error": e.error, "refused": e.refused })
}

/// `--incident`
pub fn incident(
    job: &Job,
    integrator: &PathIntegrator,
    name: &str,
    pixel: [i32; 2],
    path: &Path,
    side: u32,
    rays: u32,
    as_json: bool,
) -> Result<(), Error> {
    let known = FileFormat::from_name(&path.to_string_lossy())
        .filter(|f| matches!(f, FileFormat::Exr | FileFormat::Pfm | FileFormat::Hdr));
    let Some(format) = known else {
        return Err(Error::Settings(format!(
            "--incident {}: radiance is not for display; write .exr, .pfm or .hdr (irradiant image converts)",
            path.display()
        )));
    };
    let scene = &job.scene;
    let [x, y] = pixel;
    let film = Point2::new(x as f32 + 0.5, y as f32 + 0.5);
    let ray = scene.camera.generate_ray(film, Point2::new(0.5, 0.5), 0.5);
    let settings = IncidentSettings { side: side as usize, samples: rays, seed: scene.seed };
    let found = ray.and_then(|ray| measure(scene, integrator, &ray.ray, &settings));
    let Some(light) = found else {
        return Err(Error::Settings(format!("--pixel {x},{y}: there is no surface in the middle of this pixel")));
    };
    let samples = light.hemisphere.values.iter().flatten().copied().collect();
    let size = side as usize;
    let written = Image::from_f32(size, size, &["R", "G", "B"], samples)
        .and_then(|image| irradiant::image::write(&image, format))
        .and_then(|bytes| irradiant::image::atomic_write(path, &bytes));
    written.map_err(|why| Error::Output { path: path.to_owned(), why })?;

    let world = scene.world_from_render();
    let p = world.point(light.at.p);
    let material = scene.material_name(light.at.material);
    let z = light.scattered.z(&light.path_traced);
    if as_json {
        let axis = |v| {
            let v = world.vector(v);
            json!([v.x, v.y, v.z])
        };
        let value = json!({
            "scene": name,
            "pixel": pixel,
            "p": [p.x, p.y, p.z],
            "material": material,
            "right": axis(light.frame.x),
            "up": axis(light.frame.y),
            "middle": axis(light.frame.z),
            "emitted": light.emitted,
            "irradiance": estimate(&light.irradiance),
            "scattered": estimate(&light.scattered),
            "path_traced": estimate(&light.path_traced),
            "z": z,
        });
        println!("{}", serde_json::to_string_pretty(&value).unwrap_or_default());
        return Ok(());
    }
    println!("{name} pixel {x},{y}: at ({:.6}, {:.6}, {:.6}) world, material {material}", p.x, p.y, p.z);
    println!("{}", row("irradiance", &light.irradiance));
    println!("{}", row("scattered: integral of f L cos", &light.scattered));
    println!("{}", row("scattered, by the path tracer", &light.path_traced));
    println!("{:<34} R {:+.2}  G {:+.2}  B {:+.2} standard errors", "difference", z[0], z[1], z[2]);
    println!("wrote {} (equal areas of the disk are equal irradiance; f is albedo / pi where diffuse)", path.display());
    Ok(())
}

/// `--residual`
pub fn residual(
    job: &Job,
    integrator: &PathIntegrator,
    name: &str,
    points: u32,
    samples: u32,
    as_json: bool,
) -> Result<(), Error> {
    let scene = &job.scene;
    let found = residuals(scene, integrator, points, samples, scene.seed);
    if found.is_empty() {
        return Err(Error::Settings(format!(
            "--residual {points}: none of {points} rays from the camera met a surface, so nothing was tested; try more points, or a \
             scene or camera that sees one"
        )));
    }
    let (mean, error) = mean_residual(&found);
    // Without light both sides are 0, and a share of nothing is no number.
    let lit = found.iter().any(|r| r.left.rgb[1] > 0.0 || r.right.rgb[1] > 0.0);
    let world = scene.world_from_render();
    if as_json {
        let rows: Vec<Value> = found
            .iter()
            .map(|r| {
                let p = world.point(r.at.p);
                json!({
                    "p": [p.x, p.y, p.z],
                    "material": scene.material_name(r.at.material),
                    "left": estimate(&r.left),
                    "right": estimate(&r.right),
                    "z": r.left.z(&r.right),
                })
            })
            .collect();
        let share = |x: f64| lit.then_some(x);
        let value = json!({ "scene": name, "points": rows, "relative_residual": share(mean), "error": share(error) });
        println!("{}", serde_json::to_string_pretty(&value).unwrap_or_default());
        return Ok(());
    }
    println!(
        "{name}: Lo against Le + integral of f L cos, at {} points of {points} tried, {samples} paths a side",
        found.len()
    );
    println!(
        "{:<20} {:>36} {:>15} {:>15} {:>10} {:>6}",
        "material", "place (world)", "Lo (G)", "right side (G)", "error", "z"
    );
    for r in &found {
        let p = world.point(r.at.p);
        println!(
            "{:<20} {:>36} {:>15.6e} {:>15.6e} {:>10.1e} {:>+6.2}",
            scene.material_name(r.at.material),
            format!("({:.4}, {:.4}, {:.4})", p.x, p.y, p.z),
            r.left.rgb[1],
            r.right.rgb[1],
            r.left.error[1].hypot(r.right.error[1]),
            r.left.z(&r.right)[1]
        );
    }
    let refused: u64 = found.iter().map(|r| r.left.refused + r.right.refused).sum();
    if refused > 0 {
        println!("refused      {refused} samples were not finite and are left out; please report the scene");
    }
    if !lit {
        println!("residual     none: no light was found at any of these points");
        return Ok(());
    }
    println!(
        "residual {:+.3} % of the mean radiance, standard error {:.3} % (a bias of {:.2} % would be seen)",
        100.0 * mean,
        100.0 * error,
        100.0 * 4.0 * error
    );
    Ok(())
}
