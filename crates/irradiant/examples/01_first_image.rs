//! Load a scene, render it, save a picture: all that most programs need.
//!
//! `cargo run --release -p irradiant --example 01_first_image`

use irradiant::{Error, RenderSettings, cornell_box, render};

fn main() -> Result<(), Error> {
    // Or: irradiant::load("scenes/cornell-box.pbrt")?
    let scene = cornell_box();
    let settings =
        RenderSettings { samples_per_pixel: Some(16), resolution: Some([256, 256]), ..RenderSettings::default() };
    let picture = render(&scene, &settings)?;
    println!("{}: {} paths, {}", scene.name, picture.stats.paths, picture.header.estimate);
    picture.save("first_image.exr")?;
    picture.save("first_image.png")
}
