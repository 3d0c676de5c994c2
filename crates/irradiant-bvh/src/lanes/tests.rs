//! Lanes agree with each other, to the bit.

use super::*;

const VALUES: [f32; 12] =
    [0.0, -0.0, 1.0, -1.5, 1e-40, 3e38, -3e38, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, 0.3, 7.25];

const WORDS: [u32; 3] = [0x7654_3210, 0x0123_4567, 0xf8f9_1122];

fn agrees_with_portable_ones<F: Four>() {
    for x in [[0.0, -0.0, 0.99, 1.0], [1.5, 63.999, 1e-40, 2_147_483_520.0]] {
        assert_eq!(Portable::load(&x).round_down(), F::load(&x).round_down());
        let n = Portable::load(&x).round_down();
        assert_eq!(Portable::from_integers(n).to_array(), F::from_integers(n).to_array());
    }
    let rows = [[1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0], [9.0, 10.0, 11.0, 12.0]];
    let columns = Portable::transpose(rows.map(|r| Portable::load(&r))).map(|c| c.to_array());
    let same_columns = F::transpose(rows.map(|r| F::load(&r))).map(|c| c.to_array());
    for i in 0..3 {
        assert_eq!(columns[i][..3], same_columns[i][..3]);
    }
    for (i, &a) in VALUES.iter().enumerate() {
        for &b in &VALUES {
            let (x, y) = ([a, b, VALUES[(i + 1) % 12], -a], [b, a, 0.5, b]);
            same(&run::<Portable>(x, y), &run::<F>(x, y));
            let (x, y) = ([a, b, b, a, 1.0, b, VALUES[(i + 1) % 12], -a], [b, a, a, 1.0, b, -b, 0.5, b]);
            same(&run::<Twice<Portable>>(x, y), &run::<Twice<F>>(x, y));
        }
    }
    for word in WORDS {
        let (low, high) = ([0.5, 1.5, 2.5, 3.5], [4.5, 5.5, 6.5, 7.5]);
        let chosen = F::choose(F::load(&low), F::load(&high), word);
        let expected = Portable::choose(Portable::load(&low), Portable::load(&high), word);
        assert_eq!(chosen.to_array(), expected.to_array());
    }
}

#[test]
#[cfg(target_arch = "x86_64")]
fn sse_lanes_agree_with_portable_ones() {
    agrees_with_portable_ones::<Sse>();
}

#[test]
#[cfg(target_arch = "aarch64")]
fn neon_lanes_agree_with_portable_ones() {
    agrees_with_portable_ones::<neon::Neon>();
}

#[test]
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
fn avx_lanes_agree_with_portable_ones() {
    #[target_feature(enable = "avx2,fma")]
    fn compiled(x: [f32; 8], y: [f32; 8]) -> Vec<[f32; 8]> {
        let lanes = [Avx::load(&x), Avx::load(&y), Avx::splat(1.0)];
        let chosen = Avx::choose(lanes, WORDS).as_flattened().iter().map(|l| l.to_array()).collect::<Vec<_>>();
        [run::<Avx>(x, y), chosen, by_halves::<Avx>(x, y)].concat()
    }
    fn portable(x: [f32; 8], y: [f32; 8]) -> Vec<[f32; 8]> {
        type P = Twice<Native>;
        let lanes = [P::load(&x), P::load(&y), P::splat(1.0)];
        let chosen = P::choose(lanes, WORDS).as_flattened().iter().map(|l| l.to_array()).collect::<Vec<_>>();
        [run::<P>(x, y), chosen, by_halves::<P>(x, y)].concat()
    }
    if !is_x86_feature_detected!("avx2") || !is_x86_feature_detected!("fma") {
        return;
    }
    for (i, &a) in VALUES.iter().enumerate() {
        for &b in &VALUES {
            let (x, y) = ([a, b, b, a, 1.0, b, VALUES[(i + 1) % 12], -a], [b, a, a, 1.0, b, -b, 0.5, b]);
            // SAFETY: the machine has AVX2 and FMA.
            same(&portable(x, y), &unsafe { compiled(x, y) });
        }
    }
}

#[test]
#[cfg(target_arch = "x86_64")]
#[allow(unsafe_code)]
fn avx512_lanes_agree_with_portable_ones() {
    #[target_feature(enable = "avx512f,avx512dq")]
    fn compiled(x: [f32; 16], y: [f32; 16]) -> Vec<[f32; 16]> {
        run::<Avx512>(x, y)
    }
    if !is_x86_feature_detected!("avx512f") || !is_x86_feature_detected!("avx512dq") {
        return;
    }
    for (i, &a) in VALUES.iter().enumerate() {
        for (j, &b) in VALUES.iter().enumerate() {
            let x = std::array::from_fn(|k| if k == 5 { a } else { VALUES[(i + k) % 12] });
            let y = std::array::from_fn(|k| if k == 3 { a } else { VALUES[(j + 5 * k) % 12].min(b) });
            // SAFETY: the machine has AVX-512 F and DQ.
            same(&run::<Pair<Twice<Portable>>>(x, y), &unsafe { compiled(x, y) });
        }
    }
}

/// Fourth lanes of a transpose are noise and left out.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn by_halves<E: TwoFours>(x: [f32; 8], y: [f32; 8]) -> Vec<[f32; 8]> {
    let (a, b) = (E::load(&x), E::load(&y));
    let whole = E::load(&[0.0, 0.99, 1.0, 1.5, 63.999, 1e-40, 7.0, 2_147_483_520.0]).truncate();
    let [p, q, r] = E::transpose([a, b, E::splat(3.0)]).map(|l| {
        let l = l.to_array();
        [l[0], l[1], l[2], 0.0, l[4], l[5], l[6], 0.0]
    });
    let [low, high] = E::halves(a, b).map(|l| l.to_array());
    [a.swapped(), E::of_halves(a.low(), b.low()), whole]
        .map(|l| l.to_array())
        .into_iter()
        .chain([low, high, p, q, r])
        .collect()
}

#[inline(always)]
fn run<F: Lanes>(x: F::Array, y: F::Array) -> Vec<F::Array> {
    let (a, b) = (F::load(&x), F::load(&y));
    let mut rows = x;
    (0..F::ALL.count_ones()).for_each(|i| rows[i as usize] = f32::from_bits((i % 3) << 3));
    let table = [1.0, 2.0, 3.0].map(|row: f32| std::array::from_fn(|column| 10.0 * row + column as f32));
    let four: Vec<_> = (0..F::ALL.count_ones() as usize).map(|i| [y[i], x[i], -x[i], i as f32]).collect();
    let [c0, c1, c2, c3] = F::columns(&four.iter().collect::<Vec<_>>());
    let results = [
        c0,
        c1,
        c2,
        c3,
        a + b,
        a - b,
        a * b,
        a / b,
        a & b,
        a | b,
        a.min(b),
        a.max(b),
        a.abs(),
        a.lt(b),
        a.le(b),
        F::splat(x[1]),
        F::splat(a.lt(b).mask() as f32),
        F::splat(a.mask() as f32),
        F::splat((a.lt(b) & b.le(a.abs()) | a.le(b)).mask() as f32),
        F::splat(2.0).multiply_add(F::splat(3.0), F::splat(0.5)),
        F::select(a.lt(b).mask(), a, b),
        F::select(0x5a37 & F::ALL, a, b),
        F::look_up(&table, F::load(&rows), 0),
        F::look_up(&table, F::load(&rows), 7),
    ];
    results.iter().map(|r| r.to_array()).collect()
}

fn same<A: Copy + AsRef<[f32]>>(portable: &[A], other: &[A]) {
    for (p, s) in portable.iter().zip(other) {
        for (p, s) in p.as_ref().iter().zip(s.as_ref()) {
            // The payload of a NaN is not promised, and sign bits of NaNs only show up through `mask`.
            assert!(p.to_bits() == s.to_bits() || (p.is_nan() && s.is_nan()), "{p:?} {s:?}");
        }
    }
}
