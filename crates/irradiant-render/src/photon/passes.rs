//! Passes: what all samples of one index share. A pass is a pure function of (scene, settings, index); what is kept here
//! is a cache of it.
//!
//! Threads that come for the same pass make its photons together, in pieces whose order is then restored.

use super::map::{Photon, PhotonMap};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};

/// Photons that a thread makes at a time.
const PIECE: u32 = 4096;

/// The passes in use.
#[derive(Debug, Default)]
pub(super) struct Passes(Mutex<Vec<Arc<Pass>>>);

/// One pass.
#[derive(Debug)]
pub(super) struct Pass {
    pub index: u32,
    paths: u32,
    next: AtomicUsize,
    pieces: Mutex<Pieces>,
    finished: Condvar,
    map: OnceLock<PhotonMap>,
}

#[derive(Debug)]
struct Pieces {
    done: Vec<Vec<Photon>>,
    n_done: usize,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Passes {
    /// The pass of an index, of so many paths from lights.
    pub fn get(&self, index: u32, paths: u32) -> Arc<Pass> {
        let mut passes = lock(&self.0);
        if let Some(pass) = passes.iter().find(|p| p.index == index) {
            return Arc::clone(pass);
        }
        // Those that nobody uses and nobody will soon.
        passes.retain(|p| Arc::strong_count(p) > 1 || p.index + 1 >= index);
        let pass = Arc::new(Pass::new(index, paths));
        passes.push(Arc::clone(&pass));
        pass
    }
}

impl Pass {
    fn new(index: u32, paths: u32) -> Self {
        let pieces = paths.div_ceil(PIECE) as usize;
        Self {
            index,
            paths,
            next: AtomicUsize::new(0),
            pieces: Mutex::new(Pieces { done: vec![Vec::new(); pieces], n_done: 0 }),
            finished: Condvar::new(),
            map: OnceLock::new(),
        }
    }

    /// The map, made by all threads that ask for it. `trace` makes the photons of one path from a light; all callers must
    /// mean the same by it.
    pub fn map(&self, radius: f32, mut trace: impl FnMut(u32, &mut Vec<Photon>)) -> &PhotonMap {
        let n_pieces = lock(&self.pieces).done.len();
        loop {
            let piece = self.next.fetch_add(1, Ordering::Relaxed);
            if piece >= n_pieces {
                break;
            }
            // Handed in even if tracing panics, so that the other threads do not wait for ever.
            let mut work = Work { pass: self, piece, radius, photons: Vec::new() };
            let first = piece as u32 * PIECE;
            for path in first..first.saturating_add(PIECE).min(self.paths) {
                trace(path, &mut work.photons);
            }
        }
        let mut pieces = lock(&self.pieces);
        while pieces.n_done < n_pieces {
            pieces = self.finished.wait(pieces).unwrap_or_else(PoisonError::into_inner);
        }
        drop(pieces);
        self.map.get_or_init(PhotonMap::default)
    }
}

/// A piece under way; dropping it hands it in.
struct Work<'a> {
    pass: &'a Pass,
    piece: usize,
    radius: f32,
    photons: Vec<Photon>,
}

impl Drop for Work<'_> {
    fn drop(&mut self) {
        let mut pieces = lock(&self.pass.pieces);
        pieces.done[self.piece] = std::mem::take(&mut self.photons);
        if pieces.n_done + 1 == pieces.done.len() {
            let all = std::mem::take(&mut pieces.done).concat();
            let _ = self.pass.map.set(PhotonMap::new(&all, self.radius));
        }
        pieces.n_done += 1;
        self.pass.finished.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_math::{Normal3, Point3, Vec3};
    use irradiant_spectrum::SampledSpectrum;

    fn order(map: &PhotonMap) -> Vec<u32> {
        let mut list = Vec::new();
        map.for_each_near(Point3::ZERO, |photon| list.push(photon.depth));
        list
    }

    fn trace(path: u32, photons: &mut Vec<Photon>) {
        for _ in 0..path % 3 {
            let p = Point3::new((path % 89) as f32 / 89.0, (path % 97) as f32 / 97.0, 0.0);
            let (n, w, power) = (Normal3::ZERO, Vec3::Z, SampledSpectrum::ONE);
            photons.push(Photon { p, n, w, power, depth: path, single_wavelength: false });
        }
    }

    #[test]
    fn any_number_of_threads_makes_the_same_map() {
        let paths = 30_000;
        let alone = Passes::default().get(0, paths);
        let expected = order(alone.map(0.7, trace));
        assert!(expected.len() > 10_000);
        for threads in [2, 5] {
            let passes = Passes::default();
            std::thread::scope(|scope| {
                for _ in 0..threads {
                    scope.spawn(|| assert_eq!(order(passes.get(3, paths).map(0.7, trace)), expected));
                }
            });
        }
    }

    #[test]
    fn passes_that_nobody_needs_are_dropped_and_made_again_if_asked_for() {
        let passes = Passes::default();
        let first = passes.get(0, 10);
        for i in 1..6 {
            passes.get(i, 10);
        }
        let kept: Vec<u32> = lock(&passes.0).iter().map(|p| p.index).collect();
        assert_eq!(kept, [0, 4, 5]);
        drop(first);
        passes.get(2, 10).map(1.0, trace);
        assert_eq!(passes.get(2, 10).map(1.0, trace).len(), 9);
        assert!(Passes::default().get(0, 0).map(1.0, trace).is_empty());
    }

    #[test]
    fn a_panic_in_one_thread_does_not_keep_the_others_waiting() {
        let passes = Passes::default();
        std::thread::scope(|scope| {
            let broken = scope.spawn(|| {
                passes.get(0, 20_000).map(1.0, |path, photons| {
                    assert!(path % PIECE != 7, "as a bug would");
                    trace(path, photons);
                });
            });
            assert!(broken.join().is_err());
            // The rest is made by whoever asks.
            let map = passes.get(0, 20_000);
            assert!(!map.map(1.0, trace).is_empty());
        });
    }
}
