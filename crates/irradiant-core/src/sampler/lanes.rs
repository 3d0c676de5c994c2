//! The random numbers of many samples side by side.

use super::{BLOCKS_PER_VERTEX, CAMERA_BLOCKS, LightDraws, SampleStream, Sampler, Source};
use irradiant_math::Point2;
use irradiant_math::lanes::{Floats, LANES};
use irradiant_math::sequence::owen_sobol_4d_lanes;
use irradiant_scene::desc::Randomization;
use std::ops::Range;

/// Many samples' streams.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct StreamLanes {
    reversed_index: [u32; LANES],
    seed: [u32; LANES],
}

/// A block of each.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
pub struct BlockLanes(pub [Floats; 4]);

impl StreamLanes {
    /// Of nothing yet.
    pub const NONE: Self = Self { reversed_index: [0; LANES], seed: [0; LANES] };

    /// Whether a stream can be drawn from side by side with others.
    pub fn can_hold(stream: &SampleStream) -> bool {
        padded_owen(stream).is_some()
    }

    /// Sets lanes from `i` on to samples of a pixel that follow each other, if they [can be held](Self::can_hold).
    #[inline]
    pub fn set(&mut self, i: usize, sampler: &Sampler, pixel: [i32; 2], samples: Range<u32>) {
        let Some(last) = samples.end.checked_sub(1).filter(|last| *last >= samples.start) else { return };
        let ends = [samples.start, last].map(|index| padded_owen(&sampler.stream(pixel, index)));
        let [Some((first, seed)), Some((last, _))] = ends else { return };
        let (first, last) = (first.reverse_bits(), last.reverse_bits());
        // They follow each other in one sequence, unless it began anew in between.
        if last.checked_sub(first) == Some(samples.end - 1 - samples.start) {
            for (k, index) in (first..=last).enumerate() {
                (self.reversed_index[i + k], self.seed[i + k]) = (index.reverse_bits(), seed);
            }
        } else {
            for (k, index) in samples.enumerate() {
                if let Some((reversed_index, seed)) = padded_owen(&sampler.stream(pixel, index)) {
                    (self.reversed_index[i + k], self.seed[i + k]) = (reversed_index, seed);
                }
            }
        }
    }

    /// Lane `from` goes to lane `to`.
    #[inline(always)]
    pub fn shift(&mut self, to: usize, from: usize) {
        (self.reversed_index[to], self.seed[to]) = (self.reversed_index[from], self.seed[from]);
    }

    /// As [`SampleStream::camera`], of `n` lanes: place on the film, perhaps wavelength, time.
    #[inline(always)]
    pub fn camera(&self, n: usize, wavelength: bool, out: &mut BlockLanes) {
        self.block(n, 0, [wavelength, true], out);
    }

    /// As [`SampleStream::lens`], of `n` lanes.
    #[inline(always)]
    pub fn lens(&self, n: usize, out: &mut BlockLanes) {
        self.block(n, 1, [false, false], out);
    }

    /// As [`SampleStream::light`], of `n` lanes: where on the light, perhaps which, perhaps one for resampling.
    #[inline(always)]
    pub fn light(&self, n: usize, depth: u32, pick: bool, resample: bool, out: &mut BlockLanes) {
        self.block(n, CAMERA_BLOCKS + depth * BLOCKS_PER_VERTEX, [pick, resample], out);
    }

    /// As [`SampleStream::scatter`], of `n` lanes: which direction, perhaps which lobe, perhaps roulette.
    #[inline(always)]
    pub fn scatter(&self, n: usize, depth: u32, lobe: bool, roulette: bool, out: &mut BlockLanes) {
        self.block(n, CAMERA_BLOCKS + 1 + depth * BLOCKS_PER_VERTEX, [lobe, roulette], out);
    }

    #[inline(always)]
    fn block(&self, n: usize, block: u32, asked: [bool; 2], out: &mut BlockLanes) {
        owen_sobol_4d_lanes(n, &self.reversed_index, &self.seed, block, asked, &mut out.0);
    }
}

/// Reversed index and seed of a padded, Owen-scrambled Sobol sequence.
#[inline]
fn padded_owen(stream: &SampleStream) -> Option<(u32, u32)> {
    match stream.source {
        Source::Padded { reversed_index, seed, randomization: Randomization::FastOwen | Randomization::Owen } => {
            Some((reversed_index, seed))
        }
        _ => None,
    }
}

impl BlockLanes {
    /// All zero.
    pub const ZERO: Self = Self([[0.0; LANES]; 4]);

    /// Where on the light, or which direction.
    #[inline(always)]
    pub fn uv(&self, i: usize) -> Point2 {
        Point2::new(self.0[0][i], self.0[1][i])
    }

    /// Roulette, of a scattering block.
    #[inline(always)]
    pub fn roulette(&self, i: usize) -> f32 {
        self.0[3][i]
    }

    /// [`LightDraws::pick_in_stratum`] of a light's block.
    #[inline]
    pub fn pick_in_stratum(&self, lane: usize, i: u32, count: u32) -> f32 {
        let [_, _, pick, _] = &self.0;
        LightDraws { pick: pick[lane], uv: Point2::ZERO, resample: 0.0 }.pick_in_stratum(i, count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_scene::desc::SamplerKind;

    // Runs that a sampler continues, and such as begin another sequence, by a pixel far off or by a sample beyond 2^32.
    #[test]
    fn runs_of_samples_have_their_own_numbers() {
        let kinds = [SamplerKind::ZSobol, SamplerKind::PaddedSobol(Randomization::FastOwen)];
        for (kind, spp) in kinds.into_iter().flat_map(|kind| [(kind, 64), (kind, 1 << 24)]) {
            let sampler = Sampler::new(kind, spp, [512, 512], 11);
            for (pixel, samples) in [
                ([0, 0], 0..17),
                ([9, 200], 3..64),
                ([-1, 70_000], 60..70),
                ([15, 15], (1 << 24) - 5..(1 << 24) + 6),
                ([1, 1], 5..5),
                ([1, 1], u32::MAX - 3..u32::MAX),
            ] {
                let mut lanes = StreamLanes::NONE;
                lanes.set(2, &sampler, pixel, samples.clone());
                for (k, index) in samples.enumerate() {
                    let single = padded_owen(&sampler.stream(pixel, index)).expect("a padded sequence");
                    let found = (lanes.reversed_index[2 + k], lanes.seed[2 + k]);
                    assert_eq!(found, single, "{kind:?} {spp} {pixel:?} {index}");
                }
            }
        }
    }
}
