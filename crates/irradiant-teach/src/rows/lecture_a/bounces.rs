//! Light paths and why the sum cannot be cut (A41 to A45).

use super::super::shared::{cornell_by_bounce, fit};
use crate::context::{Context, Setup};
use crate::estimate::{take_apart, whole};
use crate::row::{Outcome, Row};
use crate::scenes::{self, furnace};
use crate::sheet::{Sheet, number};
use crate::walk::{Roulette, Walk};
use irradiant::Error;

/// A41 to A45.
pub const ROWS: &[Row] = &[
    Row {
        id: "A41",
        name: "1-, 2-, 3-bounce paths (diagrams)",
        says: "A path joins eye, surface points and a light.",
        check: "The vertices, densities and contributions that a path tells of are those of an independent evaluation (B18).",
        run: |c| Ok(c.inherit(&["B18"])),
    },
    Row {
        id: "A42",
        name: "Sum over all paths of all lengths",
        says: "How to generate all paths, and how to sample them well?",
        check: "Each length by itself, roulette without bias, and multiple importance sampling.",
        run: |c| Ok(c.inherit(&["A38", "A46", "B32"])),
    },
    Row {
        id: "A43",
        name: "Try 1: Monte Carlo sum over paths",
        says: "Recursion by BRDF samples; it never ends.",
        check: "The slide's code needs a safety stop in a closed room, counted; in an open scene it ends because rays escape.",
        run: try_1,
    },
    Row {
        id: "A44",
        name: "Higher bounces decrease exponentially",
        says: "If energy dissipates.",
        check: "A straight line through log of the mean of K^i(Le) over i in the Cornell box.",
        run: exponential,
    },
    Row {
        id: "A45",
        name: "Just use N bounces: biased",
        says: "Light of N + 1 and more bounces is never seen.",
        check: "Depth-limited furnaces are the partial sums, exactly so much too dark; in the Cornell box the missing light is the sum of the missing terms.",
        run: truncation,
    },
];

fn try_1(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let spp = c.spp(32);
    let stop = 64;
    let run = |name: &str, text: &str| -> Result<(f64, u32), Error> {
        let scene = c.scene(name, text, Setup::square(8, spp))?;
        let e = whole(&scene, &Walk { max_depth: Some(stop), ..Walk::TRY_1 }, spp);
        Ok((e.stats.scatterings as f64 / e.stats.paths as f64, e.stats.longest_path))
    };
    let (closed, longest) = run("lit-box", &scenes::lit_box(8))?;
    sheet.close("closed box: mean bounces until the safety stop of 64", closed, 64.0, 0.01);
    sheet.close("closed box: longest path", f64::from(longest), 64.0, 0.0);
    let open = scenes::lit_box(8).replace("LookAt 0 0 -0.95  0 -0.1 0", "LookAt 0 0 -6  0 0 0");
    // Seen from outside the box is convex: every reflected ray escapes.
    let (open, longest) = run("box-from-outside", &open)?;
    sheet.at_most("the box from outside: mean bounces", open, 1.0);
    sheet.at_most("the box from outside: longest path", f64::from(longest), 1.0);
    sheet.command(c.command("lit-box", "--integrator try1"));
    Ok(sheet.finish())
}

fn exponential(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let box_ = cornell_by_bounce(c)?;
    let points: Vec<(f64, f64)> = (2..=10).map(|i| (i as f64, box_.terms[i].grey().ln())).collect();
    let (slope, r2) = fit(&points);
    sheet.at_least("Cornell box: R^2 of log mean K^i over i = 2..10", r2, 0.99);
    sheet.between("each bounce keeps", slope.exp(), [0.3, 0.95]);
    Ok(sheet.finish())
}

fn truncation(c: &Context) -> Result<Outcome, Error> {
    let mut sheet = Sheet::new();
    let rho = 0.5f64;
    for depth in 0..5u32 {
        let expected: f64 = (0..=depth as i32).map(|i| rho.powi(i)).sum();
        let spp = c.spp(2048);
        let e = whole(&*c.scene("furnace", &furnace(8, rho), Setup::square(8, spp))?, &*c.production(Some(depth)), spp);
        sheet.is(&format!("furnace to depth {depth}: (1 - rho^{}) / (1 - rho)", depth + 1), &e, expected, 0.02);
        if c.noticed(&sheet) {
            return Ok(sheet.finish());
        }
    }
    let box_ = cornell_by_bounce(c)?;
    let spp = c.spp(32);
    let scene = c.scene("cornell-box", &scenes::cornell(), Setup::square(c.side(64), spp))?;
    let cut = whole(&scene, &*c.production(Some(3)), spp);
    let missing = box_.terms[4..].iter().fold(box_.beyond.clone(), |a, b| a.plus(1.0, b));
    sheet.agree("Cornell box to depth 3, and all minus the missing terms", &cut.plus(1.0, &missing), &box_.whole, 0.09);
    sheet.note(format!(
        "Depth 3 leaves out {} % of the Cornell box's light; the picture's header says \"truncated: maxdepth 3\".",
        number(100.0 * missing.grey() / box_.whole.grey())
    ));
    // Without a limit nothing is missing: the witness with roulette from the first bounce on agrees with the whole.
    let walk = Walk { roulette: Roulette::Bsdf, ..Walk::PATH };
    let free = take_apart(
        &*c.scene("cornell-box", &scenes::cornell(), Setup::square(c.side(64), spp))?,
        &walk,
        spp,
        0,
        &|_| None,
    )
    .remove(0);
    sheet.agree("without limit: production against the witness", &box_.whole, &free, 0.08);
    sheet.command(c.command("cornell-box", "--max-depth 3"));
    Ok(sheet.finish())
}
