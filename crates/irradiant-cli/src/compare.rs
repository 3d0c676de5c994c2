//! `irradiant compare`: how two pictures differ.

use crate::exit::Exit;
use clap::Args;
use irradiant::image::{Image, ImageError, ReadOptions, read_file};
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
    let comparison = match irradiant::image::compare(&a, &b) {
        Ok(comparison) => comparison,
        Err(why) => {
            eprintln!("cannot compare {} with {}: {why}", arguments.a.display(), arguments.b.display());
            return Exit::BadInput;
        }
    };
    let c = &comparison;
    if arguments.json {
        let value = json!({
            "mse": c.mse, "mae": c.mae, "relmse": c.rel_mse, "mape": c.mape, "psnr": c.psnr, "flip": c.flip,
            "mean_ratio": c.mean_ratio,
            "worst_tile": { "x": c.worst_tile.x, "y": c.worst_tile.y, "rel_mse": c.worst_tile.rel_mse },
            "not_finite": c.not_finite,
        });
        println!("{}", serde_json::to_string_pretty(&value).unwrap_or_default());
    } else {
        println!("MSE         {:.6e}", c.mse);
        println!("relMSE      {:.6e}", c.rel_mse);
        println!("MAPE        {:.3} %", 100.0 * c.mape);
        println!("FLIP        {:.5}", c.flip);
        println!("mean ratio  {:.6}", c.mean_ratio);
        println!("worst tile  at {}, {}: relMSE {:.6e}", c.worst_tile.x, c.worst_tile.y, c.worst_tile.rel_mse);
    }
    Exit::Ok
}

/// Reads a picture as RGB, or says why not.
pub fn open(path: &Path) -> Result<Image, Exit> {
    match read_file(path, &ReadOptions::default()) {
        Ok(image) => Ok(image),
        Err(why) => {
            eprintln!("{}: {why}", path.display());
            let missing = matches!(&why, ImageError::Io { error, .. } if error.kind() == std::io::ErrorKind::NotFound);
            Err(if missing { Exit::Missing } else { Exit::BadInput })
        }
    }
}
