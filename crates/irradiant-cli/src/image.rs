//! `irradiant image`: convert and tone map pictures.

use crate::compare::open;
use crate::exit::Exit;
use crate::options::parse_exposure;
use crate::say::say;
use clap::Args;
use irradiant::image::{FileFormat, ToneCurve, ToneOptions, atomic_write, to_srgb8, write};
use std::path::PathBuf;

/// Convert a picture; display formats (.png, .qoi, .jpg) are exposed and tone mapped
#[derive(Args, Debug)]
pub struct ImageArguments {
    /// Picture to read
    input: PathBuf,
    /// Picture to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Brighten by this many stops
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = parse_exposure)]
    exposure: f32,
    /// Curve from scene to display
    #[arg(long, value_enum, default_value = "none")]
    tone: Tone,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Tone {
    /// Clip
    None,
    /// Reinhard 2002
    Reinhard,
    /// Fit of the ACES reference curve
    Aces,
}

/// Reads, converts, writes.
pub fn run(arguments: &ImageArguments) -> Exit {
    let image = match open(&arguments.input) {
        Ok(image) => image,
        Err(exit) => return exit,
    };
    let Some(format) = FileFormat::from_name(&arguments.output.to_string_lossy()) else {
        say!("{}: unknown kind of picture; known are .exr .png .pfm .hdr .qoi .jpg", arguments.output.display());
        return Exit::Usage;
    };
    let curve = match arguments.tone {
        Tone::None => ToneCurve::None,
        Tone::Reinhard => ToneCurve::Reinhard,
        Tone::Aces => ToneCurve::Aces,
    };
    let tone = ToneOptions { exposure: arguments.exposure, curve, ..ToneOptions::default() };
    let linear = matches!(format, FileFormat::Exr | FileFormat::Pfm | FileFormat::Hdr);
    if linear && (!matches!(arguments.tone, Tone::None) || arguments.exposure != 0.0) {
        say!(
            "warning: {} keeps linear values: --tone and --exposure are for pictures for display (.png, .qoi, .jpg) and change nothing here",
            arguments.output.display()
        );
    }
    let converted = match format {
        FileFormat::Exr | FileFormat::Pfm | FileFormat::Hdr => Ok(image),
        _ => to_srgb8(&image, &tone),
    };
    match converted.and_then(|i| write(&i, format)).and_then(|bytes| atomic_write(&arguments.output, &bytes)) {
        Ok(()) => Exit::Ok,
        Err(why) => {
            say!("cannot write {}: {why}", arguments.output.display());
            Exit::Output
        }
    }
}
