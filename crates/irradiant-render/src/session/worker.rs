//! What each thread does: take the next unit, render it into a tile of its own, add the tile to the film.

use super::{Shared, lock};
use crate::integrator::RenderStats;
use irradiant_core::film::FilmTile;
use std::sync::atomic::Ordering;
use std::time::Instant;

pub(super) fn work(shared: &Shared) {
    let channels = lock(&shared.film).channels_per_pixel();
    let mut stats = RenderStats::default();
    let mut tile: Option<FilmTile> = None;
    let mut render = shared.integrator.renderer(&shared.scene);
    while !shared.cancelled.load(Ordering::Relaxed) && shared.deadline.is_none_or(|d| Instant::now() < d) {
        let Some(unit) = shared.schedule.unit(shared.next.fetch_add(1, Ordering::Relaxed)) else { break };
        // Reuse the last tile's storage when the shape allows.
        let mut current = match tile.take() {
            Some(mut t) if t.bounds().width() == unit.bounds.width() && t.bounds().height() == unit.bounds.height() => {
                t.restart(unit.bounds);
                t
            }
            _ => FilmTile::new(unit.bounds, channels),
        };
        render(&unit, &mut current, &mut stats);
        lock(&shared.film).merge_tile(&current);
        let n = unit.bounds.area() as u64 * (unit.samples.end - unit.samples.start) as u64;
        shared.samples_done.fetch_add(n, Ordering::Relaxed);
        tile = Some(current);
    }
    *lock(&shared.stats) += &stats;
}
