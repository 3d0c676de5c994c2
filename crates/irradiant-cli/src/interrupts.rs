//! Ctrl-C and termination signals: the first asks to stop, a later one quits.

use crate::exit::Exit;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Signals so soon after the first are the same wish: GNU timeout and some schedulers signal the child and then its whole group.
const ONE_WISH: Duration = Duration::from_millis(500);

/// Listens for signals until the program ends.
pub struct Interrupts {
    asked: Arc<AtomicBool>,
}

impl Interrupts {
    /// From here on the first signal only asks; one that comes later than [`ONE_WISH`] after it ends the program at once, with 130.
    ///
    /// A handler that cannot be set (there is one already, in an embedding process) only means no early picture.
    pub fn listen() -> Self {
        let asked = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&asked);
        let mut first = None;
        let _ = ctrlc::set_handler(move || {
            if quits(&mut first, Instant::now()) {
                std::process::exit(Exit::Interrupted as i32);
            }
            flag.store(true, Ordering::Relaxed);
        });
        Self { asked }
    }

    /// A signal came.
    pub fn asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }
}

/// Whether a signal that comes `now` is a second wish; remembers the first.
fn quits(first: &mut Option<Instant>, now: Instant) -> bool {
    now.saturating_duration_since(*first.get_or_insert(now)) > ONE_WISH
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_within_half_a_second_are_one_wish() {
        let (start, mut first) = (Instant::now(), None);
        for (milliseconds, expected) in [(0, false), (0, false), (499, false), (501, true), (9000, true)] {
            let now = start + Duration::from_millis(milliseconds);
            assert_eq!(quits(&mut first, now), expected, "{milliseconds} ms");
        }
    }
}
