//! `irradiant compare`: how two pictures differ.

use crate::exit::Exit;
use crate::say::say;
use clap::Args;
use irradiant::image::metrics::{CompareError, WorstTile};
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
    let (a, b, part) = match common_part(a, b) {
        Ok(common) => common,
        Err(why) => {
            say!("cannot compare {} with {}: {why}", arguments.a.display(), arguments.b.display());
            return Exit::BadInput;
        }
    };
    // Places are those of the whole picture.
    let [left, top] = part.map_or([0, 0], |[x, y, ..]| [x, y]);
    let place = |t: &WorstTile| [i64::from(left) + t.x as i64, i64::from(top) + t.y as i64];
    let measured = compare(&a, &b).and_then(|c| Ok((c, flip(&a, &b, [&arguments.a, &arguments.b])?)));
    let (c, flip) = match measured {
        Ok(measured) => measured,
        Err(why) => {
            say!("cannot compare {} with {}: {why}", arguments.a.display(), arguments.b.display());
            return Exit::BadInput;
        }
    };
    if arguments.json {
        let worst = c.worst_tile.as_ref().map(|t| json!({ "x": place(t)[0], "y": place(t)[1], "mean_ratio": t.ratio }));
        let part = part.map(|[x, y, width, height]| json!({ "x": x, "y": y, "width": width, "height": height }));
        let value = json!({
            "mse": c.mse, "mae": c.mae, "relmse": c.rel_mse, "mape": c.mape, "psnr": c.psnr, "flip": flip,
            "mean_ratio": c.mean_ratio, "worst_tile": worst, "not_finite": c.not_finite, "part": part,
        });
        println!("{}", serde_json::to_string_pretty(&value).unwrap_or_default());
    } else {
        if let Some([x, y, width, height]) = part {
            println!("part        {width} x {height} at {x}, {y}: what both pictures show");
        }
        println!("MSE         {:.6e}", c.mse);
        println!("relMSE      {:.6e}", c.rel_mse);
        println!("MAPE        {:.3} %", 100.0 * c.mape);
        println!("FLIP        {flip:.5}");
        println!("mean ratio  {:.6}", c.mean_ratio);
        if let Some(t) = &c.worst_tile {
            let [x, y] = place(t);
            println!("worst tile  16 x 16 at {x}, {y}: mean ratio {:.5}", t.ratio);
        }
        if c.not_finite > 0 {
            println!("not finite  {} values, left out", c.not_finite);
        }
    }
    Exit::Ok
}

/// Two pictures cut to what both show, and where that is (left, top, width, height), if they are different parts of one: of equal
/// display windows. Others stay as they are.
fn common_part(a: Image, b: Image) -> Result<(Image, Image, Option<[i32; 4]>), String> {
    let window = |image: &Image| {
        let [x, y] = image.metadata.origin;
        [x, y, x.saturating_add_unsigned(image.width() as u32), y.saturating_add_unsigned(image.height() as u32)]
    };
    let (wa, wb) = (window(&a), window(&b));
    let one_picture = a.metadata.display_window.is_some() && a.metadata.display_window == b.metadata.display_window;
    if !one_picture || wa == wb {
        return Ok((a, b, None));
    }
    let [x0, y0, x1, y1] = [wa[0].max(wb[0]), wa[1].max(wb[1]), wa[2].min(wb[2]), wa[3].min(wb[3])];
    let cut = |image: &Image, [x, y, ..]: [i32; 4]| {
        image.crop(x0.abs_diff(x) as usize, y0.abs_diff(y) as usize, x1.abs_diff(x0) as usize, y1.abs_diff(y0) as usize)
    };
    match (x0 < x1 && y0 < y1).then(|| (cut(&a, wa), cut(&b, wb))) {
        Some((Some(a), Some(b))) => Ok((a, b, Some([x0, y0, x1 - x0, y1 - y0]))),
        _ => Err("they are parts of one picture that have no pixel in common".into()),
    }
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
                ImageError::Io { .. } => say!("cannot read {why}"),
                _ => say!("{}: {why}", path.display()),
            }
            let missing = matches!(&why, ImageError::Io { error, .. } if error.kind() == std::io::ErrorKind::NotFound);
            Err(if missing { Exit::Missing } else { Exit::BadInput })
        }
    }
}
