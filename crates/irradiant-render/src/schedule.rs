//! Which work comes next: a pure function of settings and progress.

use crate::integrator::WorkUnit;
use irradiant_core::film::PixelBounds;
use std::ops::Range;

/// Side of a tile, pixels.
pub const TILE: i32 = 16;

/// All work of a render, in order: passes over the image, each with more samples than the last (the first picture
/// comes early), each cut into tiles.
#[derive(Clone, Debug)]
pub struct Schedule {
    bounds: PixelBounds,
    tiles_x: usize,
    tiles_y: usize,
    passes: Vec<Range<u32>>,
}

impl Schedule {
    /// Samples `first..end` of every pixel, at most `most` (1 or more) of one in a unit.
    pub fn new(bounds: PixelBounds, first: u32, end: u32, most: u32) -> Self {
        let tiles = |n: usize| n.div_ceil(TILE as usize);
        let (mut passes, mut start, mut size) = (Vec::new(), first, 1);
        while start < end {
            let stop = start.saturating_add(size).min(end);
            passes.push(start..stop);
            // 1, 1, 2, 4, ...: the doubling keeps the image always at a power of two until the most.
            size = if passes.len() == 1 { 1 } else { (size * 2).min(most.max(1)) };
            start = stop;
        }
        Self { bounds, tiles_x: tiles(bounds.width()), tiles_y: tiles(bounds.height()), passes }
    }

    /// Number of work units.
    pub fn len(&self) -> usize {
        self.tiles_x * self.tiles_y * self.passes.len()
    }

    /// True when there is nothing to do.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The `i`th unit; `None` past the end.
    pub fn unit(&self, i: usize) -> Option<WorkUnit> {
        let per_pass = self.tiles_x * self.tiles_y;
        let samples = self.passes.get(i.checked_div(per_pass)?)?.clone();
        let tile = i % per_pass;
        let x0 = self.bounds.x0 + (tile % self.tiles_x) as i32 * TILE;
        let y0 = self.bounds.y0 + (tile / self.tiles_x) as i32 * TILE;
        let bounds = PixelBounds { x0, y0, x1: x0 + TILE, y1: y0 + TILE }.intersection(&self.bounds);
        Some(WorkUnit { bounds, samples })
    }

    /// Samples of all pixels together.
    pub fn total_samples(&self) -> u64 {
        let per_pixel: u64 = self.passes.iter().map(|r| (r.end - r.start) as u64).sum();
        per_pixel * self.bounds.area() as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sample_of_every_pixel_is_scheduled_once() {
        for most in [64, 8, 1] {
            let bounds = PixelBounds { x0: 3, y0: -2, x1: 40, y1: 33 };
            let schedule = Schedule::new(bounds, 5, 105, most);
            let mut seen = vec![0u32; bounds.area() * 100];
            let mut samples = 0;
            for i in 0..schedule.len() {
                let unit = schedule.unit(i).unwrap();
                assert!(unit.samples.len() <= most as usize);
                assert!(unit.bounds.area() > 0);
                for y in unit.bounds.y0..unit.bounds.y1 {
                    for x in unit.bounds.x0..unit.bounds.x1 {
                        for s in unit.samples.clone() {
                            let pixel = (y + 2) as usize * bounds.width() + (x - 3) as usize;
                            seen[pixel * 100 + s as usize - 5] += 1;
                            samples += 1;
                        }
                    }
                }
            }
            assert!(seen.iter().all(|&n| n == 1));
            assert_eq!(samples, schedule.total_samples());
            assert!(schedule.unit(schedule.len()).is_none());
        }
    }

    #[test]
    fn the_first_picture_comes_early() {
        let schedule = Schedule::new(PixelBounds { x0: 0, y0: 0, x1: 16, y1: 16 }, 0, 1000, 64);
        assert_eq!(schedule.unit(0).unwrap().samples, 0..1);
        assert_eq!(schedule.unit(1).unwrap().samples, 1..2);
        assert_eq!(schedule.unit(2).unwrap().samples, 2..4);
    }

    #[test]
    fn nothing_to_do_is_an_empty_schedule() {
        let bounds = PixelBounds { x0: 0, y0: 0, x1: 0, y1: 5 };
        assert!(Schedule::new(bounds, 0, 4, 64).is_empty() && Schedule::new(bounds, 0, 4, 64).unit(0).is_none());
        assert!(Schedule::new(PixelBounds { x1: 5, ..bounds }, 4, 4, 64).is_empty());
    }
}
