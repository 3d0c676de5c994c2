//! The rows of both lectures, by topic, and the faults that show that their checks bite.

mod hard_paths;
mod lecture_a;
mod lecture_b;
mod shared;

use crate::row::{Fault, Row};
use crate::walk::Wrong;

/// All rows, in the lectures' order.
pub fn rows() -> Vec<Row> {
    let mut rows: Vec<Row> =
        lecture_a::ROWS.iter().chain(lecture_b::ROWS).flat_map(|list| list.iter()).copied().collect();
    rows.sort_by_key(|r| r.id);
    rows
}

/// All faults.
pub fn faults() -> Vec<Fault> {
    FAULTS.iter().map(|(fault, _)| *fault).collect()
}

const fn fault(name: &'static str, row: &'static str, what: &'static str, wrong: Wrong) -> (Fault, Wrong) {
    (Fault { name, row, what }, wrong)
}

/// Faults of the estimator (the witness stands in for the production one, with that wrong) and of the row's own
/// scene or numbers (nothing wrong with the estimator).
pub(crate) const FAULTS: &[(Fault, Wrong)] = &[
    fault("lamp-half-as-wide", "A02", "the lamp whose penumbra is measured has half of its width", Wrong::Nothing),
    fault("emission-fades", "A09", "emission fades with the distance that the ray has gone", Wrong::EmissionFades),
    fault(
        "density-too-flat",
        "A11",
        "the density that sampling claims is a tenth too high on one side",
        Wrong::Nothing,
    ),
    fault("missing-cosine", "A13", "light samples lack the cosine at the surface", Wrong::NoCosine),
    fault("film-too-thick", "A17", "the interference film is 2 % thicker than the prediction", Wrong::Nothing),
    fault("not-reciprocal", "A19", "f is 5 % larger for light from the right", Wrong::Nothing),
    fault("light-density-halved", "A21", "the density of light samples is off by 2", Wrong::LightDensityHalved),
    fault("samples-run-out", "A22", "the random numbers repeat after 64 samples", Wrong::Nothing),
    fault("shadows-forgotten", "A27", "shadow rays are not shot", Wrong::NoShadows),
    fault(
        "emission-left-out",
        "A31",
        "the right side of the rendering equation lacks Le at the next surface",
        Wrong::Nothing,
    ),
    fault("samples-clamped", "A32", "bright contributions are cut", Wrong::Clamped),
    fault("albedo-off", "A35", "the furnace reflects 1 % more than stated", Wrong::Nothing),
    fault("bounce-too-many", "A38", "depth-limited renders go one bounce too far", Wrong::DepthOffByOne),
    fault("depth-off-by-one", "A45", "the depth limit is off by one", Wrong::DepthOffByOne),
    fault(
        "roulette-not-compensated",
        "A46",
        "survivors of the roulette are not made heavier",
        Wrong::RouletteNotCompensated,
    ),
    fault("pick-not-counted", "A59", "the chance of picking the light is left out", Wrong::PickNotCounted),
    fault("naive-quadratic", "A63", "the sphere is intersected by the textbook quadratic in f32", Wrong::Nothing),
    fault("no-offset", "A64", "rays leave from the rounded hit itself", Wrong::NoOffset),
    fault("no-area-conversion", "B21", "the density over area is not converted to solid angle", Wrong::Nothing),
    fault("weights-dropped", "B32", "both techniques count fully", Wrong::WeightsDropped),
    fault(
        "no-squared-index",
        "B35",
        "radiance is not scaled by the squared index at refractions",
        Wrong::NoSquaredIndex,
    ),
    fault(
        "emission-twice",
        "B38",
        "emission after one diffuse bounce counts although light samples cover it",
        Wrong::EmissionTwice,
    ),
    fault("inverse-square-missing", "B28", "the expected value of a point light lacks 1/d^2", Wrong::Nothing),
];

/// Where the lectures' pseudo-code or figures are wrong or incomplete: row, what, and what to do.
pub fn gaps() -> &'static [(&'static str, &'static str)] {
    &[
        (
            "A43, A50, A54, B24",
            "No pseudo-code asks whether the ray hit anything. A miss must return the environment's radiance (or 0).",
        ),
        (
            "A54",
            "The next ray is traced before the roulette decides whether it is wanted: the work is wasted where the path ends.",
        ),
        (
            "A54",
            "Emission is added for zero bounces only, so light that arrives by a mirror or through glass is lost; a lamp looks black in a mirror. The Bern notes have the missing exception (B38).",
        ),
        (
            "A27",
            "shadowIntersection means two things: \"the first thing hit is not a light\" where directions are sampled, \"the segment to the light's point is blocked\" where lights are.",
        ),
        (
            "A63",
            "The slide's digits contradict each other: its true point lies 1.0006 from the centre of a circle of radius 1, its computed point is the centre.",
        ),
        ("B17", "||T^k(E)|| = ||T^(k+1)(E)|| should read ||T^(k+1)(E)|| <= gamma ||T^k(E)|| with gamma < 1."),
        (
            "B25",
            "A constant q = 0.5 does not \"work fine\": its variance is infinite where the albedo exceeds 0.707, which white walls do.",
        ),
        ("B24", "No emission on what the eye ray hits, and no case for delta lights and delta surfaces."),
        ("B11", "Polarization does fit into ray optics (Stokes vectors instead of radiance); diffraction does not."),
        ("A32", "The derivative D(f) is printed with variational deltas; d is meant. Harmless."),
    ]
}
