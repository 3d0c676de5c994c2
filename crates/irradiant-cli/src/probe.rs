//! `irradiant probe`: one sample replayed, its vertices printed.

use crate::exit::Exit;
use crate::options::PictureOptions;
use clap::Args;
use irradiant::core::bsdf::Bsdf;
use irradiant::core::interaction::Interaction;
use irradiant::math::Vec3;
use irradiant::renderer::RenderStats;
use irradiant::renderer::camera_samples::camera_sample;
use irradiant::renderer::record::{Contribution, PathEnd, PathRecorder, Scattering, Technique};
use irradiant::spectrum::{SampledSpectrum, Wavelengths};
use irradiant::{Error, Job};
use std::path::PathBuf;

/// Replay one sample of one pixel and print its path
#[derive(Args, Debug)]
pub struct ProbeArguments {
    /// Scene file [default: the built-in Cornell box]
    scene: Option<PathBuf>,
    /// Pixel: column, row
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel, allow_hyphen_values = true)]
    pixel: Pixel,
    /// Which of the pixel's samples
    #[arg(long, value_name = "I", default_value_t = 0)]
    sample: u32,
    #[command(flatten)]
    pub picture: PictureOptions,
}

#[derive(Clone, Copy, Debug)]
struct Pixel([i32; 2]);

fn parse_pixel(text: &str) -> Result<Pixel, String> {
    let (x, y) = text.split_once(',').ok_or("write it as X,Y")?;
    let number = |s: &str| s.trim().parse::<i32>().map_err(|_| format!("\"{s}\" is not a whole number"));
    Ok(Pixel([number(x)?, number(y)?]))
}

/// Traces and prints.
pub fn run(arguments: &ProbeArguments) -> Exit {
    match probe(arguments) {
        Ok(()) => Exit::Ok,
        Err(error) => Exit::of(&error),
    }
}

fn probe(arguments: &ProbeArguments) -> Result<(), Error> {
    let file = match &arguments.scene {
        Some(path) => irradiant::load(path)?,
        None => irradiant::cornell_box(),
    };
    let job = Job::new(&file, &arguments.picture.settings())?;
    let scene = &job.scene;
    let bounds = scene.bounds();
    let Pixel([x, y]) = arguments.pixel;
    if !bounds.contains(x, y) {
        return Err(Error::Settings(format!(
            "--pixel {x},{y} is outside the picture: columns {} to {}, rows {} to {}",
            bounds.x0,
            bounds.x1 - 1,
            bounds.y0,
            bounds.y1 - 1
        )));
    }
    if arguments.sample >= scene.samples_per_pixel {
        return Err(Error::Settings(format!(
            "--sample {}: the picture has {} samples per pixel (0 to {}); --spp raises it",
            arguments.sample,
            scene.samples_per_pixel,
            scene.samples_per_pixel - 1
        )));
    }
    let Some(integrator) = job.path_integrator() else {
        return Err(Error::Settings(format!(
            "probe replays the path integrator, not {}; add --integrator path",
            job.integrator_choice().name()
        )));
    };
    let sample = camera_sample(scene, [x, y], arguments.sample);
    println!("{} pixel {x},{y} sample {} seed {}", file.name, arguments.sample, scene.seed);
    let Some(camera_ray) = &sample.camera_ray else {
        println!("the camera sees nothing here (vignetting)");
        return Ok(());
    };
    let mut lambda = sample.lambda;
    let mut printer = Printer { scene };
    let mut stats = RenderStats::default();
    let radiance =
        integrator.radiance(scene, camera_ray, &sample.stream, &mut lambda, &mut [], &mut stats, &mut printer);
    let rgb = scene.film_rgb(radiance * camera_ray.weight, &lambda).map(|c| c * sample.filter_weight);
    println!("radiance     {}  W m^-2 sr^-1 nm^-1", spectrum(radiance));
    if lambda.secondary_terminated() {
        println!("             dispersion ended all wavelengths but the first");
    }
    println!("film         R {:.6e}  G {:.6e}  B {:.6e}", rgb[0], rgb[1], rgb[2]);
    if !rgb.iter().all(|c| c.is_finite()) {
        println!("             NOT FINITE: this sample is refused by the film");
    }
    Ok(())
}

struct Printer<'a> {
    scene: &'a irradiant::core::scene::Scene,
}

fn vector(v: Vec3) -> String {
    format!("({:+.6}, {:+.6}, {:+.6})", v.x, v.y, v.z)
}

fn spectrum(s: SampledSpectrum) -> String {
    format!("[{:.5e} {:.5e} {:.5e} {:.5e}]", s[0], s[1], s[2], s[3])
}

impl PathRecorder for Printer<'_> {
    fn begin(&mut self, lambda: &Wavelengths) {
        let l = lambda.lambda;
        println!("wavelengths  {:.2} {:.2} {:.2} {:.2} nm", l[0], l[1], l[2], l[3]);
    }

    fn vertex(&mut self, depth: u32, at: &Interaction, _bsdf: &Bsdf) {
        let p = self.scene.world_from_render().point(at.p);
        println!("vertex {depth}     at ({:.6}, {:.6}, {:.6}) world, distance {:.6}", p.x, p.y, p.z, at.t);
        println!("             normal {}  shading {}", vector(at.n.as_vec()), vector(at.ns.as_vec()));
        println!(
            "             material {}, shape {}, face {}, uv ({:.5}, {:.5}){}",
            self.scene.material_name(at.material),
            at.shape.0,
            at.face,
            at.uv.x,
            at.uv.y,
            if at.light.is_some() { ", emits" } else { "" }
        );
    }

    fn escape(&mut self, depth: u32, direction: Vec3) {
        println!("escape {depth}     towards {}", vector(direction));
    }

    fn contribution(&mut self, c: &Contribution) {
        let how = match c.technique {
            Technique::Hit => "met by chance",
            Technique::LightSample => "light sample",
        };
        println!(
            "light        {} bounces, {how}, light {}: {}  weight {:.5}, pdf light {:.5e}, bsdf {:.5e}",
            c.bounces,
            c.light.0,
            spectrum(c.radiance),
            c.mis_weight,
            c.light_pdf,
            c.bsdf_pdf
        );
    }

    fn scattering(&mut self, s: &Scattering) {
        println!(
            "scatter {}    {:?} towards {}, pdf {:.5e}, throughput {}, survival {:.4}",
            s.depth,
            s.lobe,
            vector(s.wi),
            s.pdf,
            spectrum(s.throughput),
            s.survival
        );
    }

    fn end(&mut self, why: PathEnd) {
        let why = match why {
            PathEnd::Escaped => "left the scene",
            PathEnd::MaxDepth => "depth limit",
            PathEnd::Absorbed => "absorbed",
            PathEnd::Roulette => "Russian roulette",
        };
        println!("end          {why}");
    }
}
