//! The widest eight lanes that the machine has.

use std::marker::PhantomData;

#[cfg(target_arch = "x86_64")]
use crate::lanes::Avx;
use crate::lanes::{Native, Twice, TwoFours};
use crate::level::{Kernel, Level};

/// Work on eight lanes, with the same bits whatever they are.
pub(super) trait Wide {
    /// What it gives.
    type Output;
    /// Does it. To be `#[inline(always)]`, with all that it calls, as [`Kernel::run`]; lanes in closures that go through functions of the library
    /// (`for_each`, `map`) are compiled for the baseline and made the whole build three times slower.
    fn run<E: TwoFours>(self) -> Self::Output;
}

struct On<E, W>(W, PhantomData<E>);

impl<E: TwoFours, W: Wide> Kernel for On<E, W> {
    type Output = W::Output;
    #[inline(always)]
    fn run(self) -> W::Output {
        self.0.run::<E>()
    }
}

/// Does a piece of work on the widest lanes.
#[inline]
pub(super) fn widest<W: Wide>(work: W) -> W::Output {
    let level = Level::detect();
    #[cfg(target_arch = "x86_64")]
    if level >= Level::Avx2 {
        // `Level::run` calls what is compiled for AVX2 and more here.
        return level.run(On::<Avx, W>(work, PhantomData));
    }
    level.run(On::<Twice<Native>, W>(work, PhantomData))
}
