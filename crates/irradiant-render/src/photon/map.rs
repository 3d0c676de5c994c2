//! A photon map: photons by place, for adding up those within a radius. Made once, then only read.

use irradiant_math::{Normal3, Point3, Vec3};
use irradiant_spectrum::SampledSpectrum;

/// Power that a path from a light has brought to a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Photon {
    /// Where.
    pub p: Point3,
    /// Geometric normal there.
    pub n: Normal3,
    /// Where it came from, unit, away from the surface.
    pub w: Vec3,
    /// W/nm over the number of paths from lights, scaled so that a model's `f` times it is what leaves.
    pub power: SampledSpectrum,
    /// Scattering events before; 1 or more.
    pub depth: u32,
    /// Only the first wavelength was left.
    pub single_wavelength: bool,
}

/// Photons in cells of twice the radius, found by hash; in each cell in the order in which they were given.
#[derive(Debug, Default)]
pub struct PhotonMap {
    photons: Vec<Photon>,
    /// Where each bucket begins; one more than there are buckets.
    starts: Vec<u32>,
    radius: f32,
}

impl PhotonMap {
    /// For searches within `radius`, > 0. The same photons in the same order make the same map.
    pub fn new(unsorted: &[Photon], radius: f32) -> Self {
        let buckets = (2 * unsorted.len()).next_power_of_two().max(2);
        let mut map = Self { photons: Vec::new(), starts: vec![0; buckets + 1], radius };
        let bucket_of: Vec<u32> = unsorted.iter().map(|photon| map.bucket(map.cell(photon.p))).collect();
        // Counting sort, stable.
        for &b in &bucket_of {
            map.starts[b as usize + 1] += 1;
        }
        for b in 0..buckets {
            map.starts[b + 1] += map.starts[b];
        }
        let mut next = map.starts.clone();
        let mut order = vec![0u32; unsorted.len()];
        for (i, &b) in bucket_of.iter().enumerate() {
            order[next[b as usize] as usize] = i as u32;
            next[b as usize] += 1;
        }
        map.photons = order.iter().map(|&i| unsorted[i as usize]).collect();
        map
    }

    /// Number of photons.
    pub fn len(&self) -> usize {
        self.photons.len()
    }

    /// True when there is no photon.
    pub fn is_empty(&self) -> bool {
        self.photons.is_empty()
    }

    /// Calls `found` for all photons nearer to `p` than the radius, in an order that is the same each time.
    #[inline]
    pub fn for_each_near(&self, p: Point3, mut found: impl FnMut(&Photon)) {
        if self.is_empty() {
            return;
        }
        let r = self.radius;
        let (lo, hi) = (self.cell(p - Vec3::new(r, r, r)), self.cell(p + Vec3::new(r, r, r)));
        // A cell is as wide as a search: at most two in each direction. Two cells may share a bucket.
        let mut searched = [u32::MAX; 27];
        let mut n = 0;
        for z in lo[2]..=hi[2] {
            for y in lo[1]..=hi[1] {
                for x in lo[0]..=hi[0] {
                    let bucket = self.bucket([x, y, z]);
                    if n == searched.len() || searched[..n].contains(&bucket) {
                        continue;
                    }
                    searched[n] = bucket;
                    n += 1;
                    let range = self.starts[bucket as usize] as usize..self.starts[bucket as usize + 1] as usize;
                    self.photons[range]
                        .iter()
                        .filter(|photon| photon.p.distance_squared(p) < r * r)
                        .for_each(&mut found);
                }
            }
        }
    }

    fn cell(&self, p: Point3) -> [i32; 3] {
        p.to_array().map(|x| (x / (2.0 * self.radius)).floor() as i32)
    }

    fn bucket(&self, cell: [i32; 3]) -> u32 {
        // Teschner et al. 2003.
        let [x, y, z] = cell.map(|c| c as u32);
        let hash = x.wrapping_mul(73_856_093) ^ y.wrapping_mul(19_349_663) ^ z.wrapping_mul(83_492_791);
        irradiant_math::hash::mix32(hash) & (self.starts.len() as u32 - 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use irradiant_testkit::Rng;

    #[test]
    fn all_photons_in_reach_are_found_once_and_no_others() {
        let mut rng = Rng::new(7);
        let mut place = || {
            let mut x = || 4.0 * rng.next_f32() - 2.0;
            Point3::new(x(), x(), x())
        };
        let photon = |p, i| Photon {
            p,
            n: Normal3::ZERO,
            w: Vec3::Z,
            power: SampledSpectrum::splat(i as f32),
            depth: 1,
            single_wavelength: false,
        };
        let photons: Vec<Photon> = (0..3000).map(|i| photon(place(), i)).collect();
        for radius in [0.01, 0.2, 1.0] {
            let map = PhotonMap::new(&photons, radius);
            assert_eq!(map.len(), 3000);
            for _ in 0..200 {
                let p = place();
                let mut found = Vec::new();
                map.for_each_near(p, |photon| found.push(photon.power.0[0] as usize));
                found.sort_unstable();
                let expected: Vec<usize> =
                    (0..3000).filter(|&i| photons[i].p.distance_squared(p) < radius * radius).collect();
                assert_eq!(found, expected);
            }
        }
        let mut none = 0;
        PhotonMap::new(&[], 1.0).for_each_near(Point3::ZERO, |_| none += 1);
        PhotonMap::new(&photons[..1], 1e-3).for_each_near(Point3::new(1e30, 0.0, 0.0), |_| none += 1);
        assert_eq!(none, 0);
    }
}
