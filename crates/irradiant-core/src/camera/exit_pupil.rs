//! Where on the rearmost surface's plane rays must pass to make it through the lens.

use super::lens::{Lens, LensRay};

/// Parts of the film's half diagonal that have their own bounds.
const RINGS: usize = 64;

/// For rings of the film around the axis: a box around the exit pupil as seen from the +x axis.
#[derive(Clone, Debug)]
pub(super) struct ExitPupil {
    /// [x0, x1, y0, y1] on the plane z = rear_z, metres; `None` where the lens lets nothing through.
    bounds: Vec<Option<[f64; 4]>>,
    half_diagonal: f64,
}

impl ExitPupil {
    /// Searches with rays: coarsely over the rear opening, then finely around what was found.
    ///
    /// Any box that holds the pupil gives the same expected picture; a tight one wastes fewer rays.
    pub fn new(lens: &Lens, half_diagonal: f64) -> Self {
        // The mask need not be the same from all sides, but the box must hold it from all: search a hole of its reach.
        let mut hole = lens.clone();
        if let Some(mask) = hole.mask.take() {
            hole.elements.iter_mut().filter(|e| e.radius == 0.0).for_each(|stop| stop.opening *= mask.reach);
        }
        // Rims and middles of the rings.
        let mut found: Vec<Option<[f64; 4]>> = Vec::with_capacity(2 * RINGS + 1);
        for i in 0..=2 * RINGS {
            let r = half_diagonal * i as f64 / (2 * RINGS) as f64;
            let hint = found.last().copied().flatten();
            found.push(pupil_at(&hole, r, hint));
        }
        let bounds = (0..RINGS).map(|i| found[2 * i..2 * i + 3].iter().flatten().copied().reduce(union)).collect();
        Self { bounds, half_diagonal }
    }

    /// The box for a film position at distance `r` from the axis.
    #[inline]
    pub fn bounds(&self, r: f64) -> Option<[f64; 4]> {
        let ring = (r / self.half_diagonal * RINGS as f64) as usize;
        self.bounds[ring.min(RINGS - 1)]
    }
}

fn union(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [a[0].min(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].max(b[3])]
}

fn expanded(b: [f64; 4], x: f64, y: f64) -> [f64; 4] {
    [b[0] - x, b[1] + x, b[2] - y, b[3] + y]
}

/// The pupil from (r, 0) on the film, with a margin of one and a half of the last search's steps.
fn pupil_at(lens: &Lens, r: f64, hint: Option<[f64; 4]>) -> Option<[f64; 4]> {
    const STEPS: usize = 64;
    // The pupil can look larger than the rear opening from off the axis, since it lies on another plane.
    let most = 1.5 * lens.elements.last().map_or(0.0, |e| e.opening);
    let all = [-most, most, -most, most];
    let step = 2.0 * most / STEPS as f64;
    let coarse = search(lens, r, all, STEPS, None);
    // Small pupils hide between the steps: search where they were last seen, or very finely the first time.
    let (found, step_x, step_y) = match (coarse, hint) {
        (Some(found), _) => (found, step, step),
        (None, Some(last)) => {
            let (w, h) = (last[1] - last[0], last[3] - last[2]);
            let window = expanded(last, 0.5 * w, 0.5 * h);
            (search(lens, r, window, STEPS, None)?, 2.0 * w / STEPS as f64, 2.0 * h / STEPS as f64)
        }
        (None, None) if r == 0.0 => {
            const FINE: usize = 16 * STEPS;
            (search(lens, r, all, FINE, None)?, 2.0 * most / FINE as f64, 2.0 * most / FINE as f64)
        }
        (None, None) => return None,
    };
    let window = expanded(found, step_x, step_y);
    let steps = [(window[1] - window[0]) / STEPS as f64, (window[3] - window[2]) / STEPS as f64];
    let found = search(lens, r, window, STEPS, Some(found))?;
    Some(expanded(found, 1.5 * steps[0], 1.5 * steps[1]))
}

/// The box around those points of a grid that let a ray from (r, 0) pass, and around `known`.
fn search(lens: &Lens, r: f64, window: [f64; 4], steps: usize, known: Option<[f64; 4]>) -> Option<[f64; 4]> {
    let mut found = known;
    let z = lens.rear_z();
    let at = |low: f64, high: f64, i: usize| low + (high - low) * (i as f64 + 0.5) / steps as f64;
    for iy in 0..steps {
        // A lens is symmetric about its axis: the halves y < 0 and y > 0 are alike.
        let y = at(window[2], window[3], iy);
        if y < 0.0 && window[2] == -window[3] {
            continue;
        }
        for ix in 0..steps {
            let x = at(window[0], window[1], ix);
            if found.is_some_and(|b| b[0] <= x && x <= b[1] && b[2] <= y && y <= b[3]) {
                continue;
            }
            let ray = LensRay { o: [r, 0.0, 0.0], d: [x - r, y, z] };
            if lens.trace_to_scene(ray).is_some() {
                let point = [x, x, -y.abs(), y.abs()];
                found = Some(found.map_or(point, |b| union(b, point)));
            }
        }
    }
    found
}
