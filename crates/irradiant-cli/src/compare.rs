//! `irradiant compare`: how two pictures differ.

use crate::exit::Exit;
use crate::say::say;
use clap::Args;
use irradiant::image::metrics::CompareError;
use irradiant::image::{
    FileFormat, FlipOptions, Image, ImageError, ReadOptions, compare, flip_hdr, flip_ldr, read_file,
};
use serde_json::json;
use std::path::{Path, PathBuf};

/// How picture A differs from reference B: MSE, relMSE, MAPE, FLIP, mean ratio, worst tile
#[derive(Args, Debug)]
pub struct CompareArguments {
    /// Picture (.exr, .pfm, .png, ...)
    a: PathBuf,
    /// Reference
    b: PathBuf,
    /// As JSON
    #[arg(long)]
    json: bool,
}

/// Prints the measures. Exit codes: 0 compared, 65 unreadable or of different size, 66 missing.
pub fn run(arguments: &CompareArguments) -> Exit {
    let (a, b) = match (open(&arguments.a), open(&arguments.b)) {
        (Ok(a), Ok(b)) => (a, b),
        (Err(exit), _) | (_, Err(exit)) => return exit,
    };
    let measured = compare(&a, &b).and_then(|c| Ok((c, flip(&a, &b, [&arguments.a, &arguments.b])?)));
    let (c, flip) = match measured {
        Ok(measured) => measured,
        Err(why) => {
            say!("cannot compare {} with {}: {why}", arguments.a.display(), arguments.b.display());
            return Exit::BadInput;
        }
    };
    if arguments.json {
        let worst = c.worst_tile.as_ref().map(|t| json!({ "x": t.x, "y": t.y, "mean_ratio": t.ratio }));
        let value = json!({
            "mse": c.mse, "mae": c.mae, "relmse": c.rel_mse, "mape": c.mape, "psnr": c.psnr, "flip": flip,
            "mean_ratio": c.mean_ratio, "worst_tile": worst, "not_finite": c.not_finite,
        });
        println!("{}", serde_json::to_string_pretty(&value).unwrap_or_default());
    } else {
        println!("MSE         {:.6e}", c.mse);
        println!("relMSE      {:.6e}", c.rel_mse);
        println!("MAPE        {:.3} %", 100.0 * c.mape);
        println!("FLIP        {flip:.5}");
        println!("mean ratio  {:.6}", c.mean_ratio);
        if let Some(t) = &c.worst_tile {
            println!("worst tile  16 x 16 at {}, {}: mean ratio {:.5}", t.x, t.y, t.ratio);
        }
        if c.not_finite > 0 {
            println!("not finite  {} values, left out", c.not_finite);
        }
    }
    Exit::Ok
}

/// Mean FLIP difference: of displays for two pictures of display formats, else of high dynamic range.
fn flip(a: &Image, b: &Image, names: [&Path; 2]) -> Result<f64, CompareError> {
    let options = FlipOptions::default();
    let display = names.iter().all(|name| {
        matches!(
            FileFormat::from_name(&name.to_string_lossy()),
            Some(FileFormat::Png | FileFormat::Jpeg | FileFormat::Qoi | FileFormat::Bmp | FileFormat::Tga)
        )
    });
    let flip = if display { flip_ldr(a, b, &options)? } else { flip_hdr(a, b, &options)? };
    Ok(flip.mean)
}

/// Reads a picture as RGB, or says why not.
pub fn open(path: &Path) -> Result<Image, Exit> {
    match read_file(path, &ReadOptions::default()) {
        Ok(image) => Ok(image),
        Err(why) => {
            match &why {
                // It names the file itself.
                ImageError::Io { .. } => say!("{why}"),
                _ => say!("{}: {why}", path.display()),
            }
            let missing = matches!(&why, ImageError::Io { error, .. } if error.kind() == std::io::ErrorKind::NotFound);
            Err(if missing { Exit::Missing } else { Exit::BadInput })
        }
    }
}
