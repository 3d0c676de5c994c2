//! Flags that several subcommands share, and how their values are read.

use clap::Args;
use irradiant::scene::desc::{Randomization, SamplerKind};
use irradiant::{ColorMode, IntegratorChoice, MaxDepth, RenderSettings};
use std::time::Duration;

/// What determines the picture beside the scene.
#[derive(Args, Clone, Debug)]
pub struct PictureOptions {
    /// Samples per pixel [default: the scene's]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    pub spp: Option<u32>,
    /// Seed of the random numbers; pictures of different seeds are independent
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = parse_seed)]
    pub seed: Option<u64>,
    /// Where random numbers come from [default: the scene's]
    #[arg(long, value_name = "NAME", value_enum)]
    pub sampler: Option<SamplerName>,
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", allow_hyphen_values = true, value_parser = parse_resolution)]
    pub resolution: Option<[u32; 2]>,
    /// The part to render, as fractions of width and height
    #[arg(long, value_name = "X0,X1,Y0,Y1", allow_hyphen_values = true, value_parser = parse_crop)]
    pub crop: Option<Crop>,
    /// Integrator by name, "help" for a list [default: the scene's]
    #[arg(long, value_name = "NAME", value_parser = parse_integrator)]
    pub integrator: Option<IntegratorArgument>,
    /// An option of the integrator; may be given several times; `irradiant integrators` lists them
    #[arg(long, value_name = "KEY=VALUE")]
    pub estimator: Vec<String>,
    /// Scattering events at most, or "none" for an unbiased picture [default: the scene's, else pbrt's 5]
    #[arg(long, value_name = "N|none", allow_hyphen_values = true, value_parser = parse_max_depth)]
    pub max_depth: Option<MaxDepth>,
    /// Basis of colour
    #[arg(long, value_name = "BASIS", value_enum, default_value = "spectral")]
    pub color: Color,
    /// Memory that the picture's sums may take, e.g. 16G; larger films are refused before anything is reserved
    #[arg(long, value_name = "SIZE", default_value = "4G", allow_hyphen_values = true, value_parser = parse_size)]
    pub max_film_memory: u64,
    /// Scene content that is not honoured is an error
    #[arg(long)]
    pub strict: bool,
}

/// `--color`
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum Color {
    /// Four wavelengths a path
    Spectral,
    /// Three numbers, faster; dispersion and measured spectra are approximated
    Rgb,
}

/// `--sampler`: pbrt-v4's that need no numbers of their own.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum SamplerName {
    /// Owen-scrambled Sobol points along a curve over the picture: errors of neighbours cancel (blue noise)
    Zsobol,
    /// Owen-scrambled Sobol points for each pixel by itself: errors of neighbours are independent
    Paddedsobol,
    /// Independent numbers
    Independent,
    /// Halton points
    Halton,
    /// One Sobol sequence over the picture
    Sobol,
    /// Pairs of Sobol points
    Pmj02bn,
}

impl SamplerName {
    /// As scenes have it, where they say no more than the name.
    pub fn kind(self) -> SamplerKind {
        match self {
            Self::Zsobol => SamplerKind::ZSobol,
            Self::Paddedsobol => SamplerKind::PaddedSobol(Randomization::FastOwen),
            Self::Independent => SamplerKind::Independent,
            Self::Halton => SamplerKind::Halton(Randomization::PermuteDigits),
            Self::Sobol => SamplerKind::Sobol(Randomization::FastOwen),
            Self::Pmj02bn => SamplerKind::Pmj02bn,
        }
    }
}

/// Fractions x0, x1, y0, y1.
#[derive(Clone, Copy, Debug)]
pub struct Crop(pub [f32; 4]);

impl PictureOptions {
    /// True when the list of integrators was asked for instead of a picture.
    pub fn asks_for_integrators(&self) -> bool {
        matches!(self.integrator, Some(IntegratorArgument::Help))
    }

    /// As the library wants them.
    pub fn settings(&self) -> RenderSettings {
        RenderSettings {
            samples_per_pixel: self.spp,
            seed: self.seed,
            sampler: self.sampler.map(SamplerName::kind),
            resolution: self.resolution,
            crop: self.crop.map(|c| c.0),
            integrator: match &self.integrator {
                Some(IntegratorArgument::Choice(choice)) => Some(choice.clone()),
                Some(IntegratorArgument::Help) | None => None,
            },
            estimator: self.estimator.clone(),
            max_depth: self.max_depth,
            color: match self.color {
                Color::Spectral => ColorMode::Spectral,
                Color::Rgb => ColorMode::Rgb,
            },
            max_film_bytes: Some(self.max_film_memory),
            strict: self.strict,
            ..RenderSettings::default()
        }
    }
}

fn parse_resolution(text: &str) -> Result<[u32; 2], String> {
    let (w, h) = text.split_once(['x', 'X']).ok_or("write it as WIDTHxHEIGHT, e.g. 1280x720")?;
    let side = |s: &str| match s.trim().parse::<u32>() {
        Ok(n @ 1..=65_536) => Ok(n),
        Ok(n) => Err(format!("{n} is not between 1 and 65536")),
        Err(_) => Err(format!("\"{s}\" is not a whole number")),
    };
    Ok([side(w)?, side(h)?])
}

fn parse_crop(text: &str) -> Result<Crop, String> {
    let parts: Vec<f32> = text
        .split(',')
        .map(|s| s.trim().parse().map_err(|_| format!("\"{s}\" is not a number")))
        .collect::<Result<_, _>>()?;
    let [x0, x1, y0, y1] = parts[..] else {
        return Err("write four fractions x0,x1,y0,y1, e.g. 0.25,0.75,0,0.5".into());
    };
    let valid = |a: f32, b: f32| (0.0..=1.0).contains(&a) && (0.0..=1.0).contains(&b) && a < b;
    if !(valid(x0, x1) && valid(y0, y1)) {
        return Err("needs 0 <= x0 < x1 <= 1 and 0 <= y0 < y1 <= 1".into());
    }
    Ok(Crop([x0, x1, y0, y1]))
}

/// `--integrator`
#[derive(Clone, Debug)]
pub enum IntegratorArgument {
    /// One of the registry.
    Choice(IntegratorChoice),
    /// The list of all is wanted.
    Help,
}

fn parse_integrator(text: &str) -> Result<IntegratorArgument, String> {
    match text {
        "help" => Ok(IntegratorArgument::Help),
        _ => IntegratorChoice::named(text).map(IntegratorArgument::Choice).map_err(|why| why.to_string()),
    }
}

fn parse_max_depth(text: &str) -> Result<MaxDepth, String> {
    match text {
        "none" => Ok(MaxDepth::None),
        _ => text.parse().map(MaxDepth::Limit).map_err(|_| "write a whole number, 0 or more, or \"none\"".into()),
    }
}

/// `--seed`
pub fn parse_seed(text: &str) -> Result<u64, String> {
    text.parse().map_err(|_| format!("write a whole number from 0 to {}", u64::MAX))
}

/// Stops.
pub fn parse_exposure(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(ev) if ev.abs() <= 64.0 => Ok(ev),
        Ok(_) => Err("must be between -64 and 64".into()),
        Err(_) => Err("not a number".into()),
    }
}

/// `500M`, `16G`, `16GiB`: powers of 1024.
fn parse_size(text: &str) -> Result<u64, String> {
    if text.starts_with('-') {
        return Err("memory is not negative: write it as 500M or 16G".into());
    }
    let split = text.find(|c: char| !c.is_ascii_digit()).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let shift = match unit.trim().trim_end_matches("iB").trim_end_matches('B') {
        "" => 0,
        "k" | "K" => 10,
        "M" => 20,
        "G" => 30,
        "T" => 40,
        _ => return Err(format!("\"{unit}\" is not a unit of memory; use K, M, G or T")),
    };
    let number: u64 = number.parse().map_err(|_| "write it as 500M or 16G".to_string())?;
    number.checked_mul(1 << shift).ok_or_else(|| "more than any machine has".into())
}

/// `90`, `90s`, `1.5m`, `2h`, `500ms`.
pub fn parse_duration(text: &str) -> Result<Duration, String> {
    if text.starts_with('-') {
        return Err("not a time that can pass: write it as 60s, 5m, 1h or 500ms".into());
    }
    let split = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
    let (number, unit) = text.split_at(split);
    let number: f64 = number.parse().map_err(|_| "write it as 60s, 5m, 1h or 500ms".to_string())?;
    let seconds = match unit.trim() {
        "" | "s" => number,
        "ms" => number * 1e-3,
        "m" | "min" => number * 60.0,
        "h" => number * 3600.0,
        other => return Err(format!("\"{other}\" is not a unit of time; use ms, s, m or h")),
    };
    if !(seconds > 0.0 && seconds < 1e9) {
        return Err("must be more than zero and less than 30 years".into());
    }
    Ok(Duration::from_secs_f64(seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_have_units() {
        assert_eq!(parse_duration("90").unwrap(), Duration::from_secs(90));
        assert_eq!(parse_duration("1.5m").unwrap(), Duration::from_secs(90));
        assert_eq!(parse_duration("250ms").unwrap(), Duration::from_millis(250));
        for bad in ["", "x", "5 parsecs", "0s", "-3s"] {
            assert!(parse_duration(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn memory_is_counted_in_powers_of_two() {
        assert_eq!(parse_size("4G").unwrap(), 4 << 30);
        assert_eq!(parse_size("16GiB").unwrap(), 16 << 30);
        assert_eq!(parse_size("500MB").unwrap(), 500 << 20);
        assert_eq!(parse_size("7").unwrap(), 7);
        for bad in ["", "G", "4X", "-1G", "1.5G", "99999999T"] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn values_are_checked_at_the_door() {
        assert_eq!(parse_resolution("640x480").unwrap(), [640, 480]);
        for bad in ["640", "0x5", "axb", "70000x1"] {
            assert!(parse_resolution(bad).is_err(), "{bad}");
        }
        assert!(parse_crop("0,1,0,1").is_ok());
        for bad in ["0,1,0", "1,0,0,1", "0,2,0,1", "0,x,0,1"] {
            assert!(parse_crop(bad).is_err(), "{bad}");
        }
        assert!(parse_integrator("pth").unwrap_err().contains("did you mean \"path\"?"));
        assert_eq!(parse_max_depth("none").unwrap(), MaxDepth::None);
    }
}
