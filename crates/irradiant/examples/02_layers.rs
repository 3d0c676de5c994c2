//! One render, taken apart: light by bounces and by kinds of paths, from one run.
//!
//! `cargo run --release -p irradiant --example 02_layers`

use irradiant::{Aov, Error, RenderSettings, cornell_box, render};

fn main() -> Result<(), Error> {
    let layer = |text: &str| text.parse::<Aov>().map_err(Error::Settings);
    let settings = RenderSettings {
        samples_per_pixel: Some(16),
        resolution: Some([128, 128]),
        aovs: vec![layer("bounces:6")?, layer("red_wall=L.*D'red'D'white'E")?],
        ..RenderSettings::default()
    };
    let picture = render(&cornell_box(), &settings)?;
    for layer in picture.layer_light() {
        println!("{:10} {:6.2} %  {}", layer.name, 100.0 * layer.share, layer.expression);
    }
    picture.save("layers.exr")?;
    picture.save_contact_sheet("layers.png", 0.0)
}
