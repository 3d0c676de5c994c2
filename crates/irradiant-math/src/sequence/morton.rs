//! Morton codes: interleaved bits, so that near codes are near points.

const fn spread_2(v: u32) -> u64 {
    let mut v = v as u64;
    v = (v ^ (v << 16)) & 0x0000_ffff_0000_ffff;
    v = (v ^ (v << 8)) & 0x00ff_00ff_00ff_00ff;
    v = (v ^ (v << 4)) & 0x0f0f_0f0f_0f0f_0f0f;
    v = (v ^ (v << 2)) & 0x3333_3333_3333_3333;
    (v ^ (v << 1)) & 0x5555_5555_5555_5555
}

const fn gather_2(mut v: u64) -> u32 {
    v &= 0x5555_5555_5555_5555;
    v = (v ^ (v >> 1)) & 0x3333_3333_3333_3333;
    v = (v ^ (v >> 2)) & 0x0f0f_0f0f_0f0f_0f0f;
    v = (v ^ (v >> 4)) & 0x00ff_00ff_00ff_00ff;
    v = (v ^ (v >> 8)) & 0x0000_ffff_0000_ffff;
    (v ^ (v >> 16)) as u32
}

/// The code of (x, y): bit 0 of x, bit 0 of y, bit 1 of x, ...
#[inline]
pub const fn morton_encode_2(x: u32, y: u32) -> u64 {
    spread_2(x) | spread_2(y) << 1
}

/// The (x, y) of a code.
#[inline]
pub const fn morton_decode_2(code: u64) -> (u32, u32) {
    (gather_2(code), gather_2(code >> 1))
}

const fn spread_3(v: u32) -> u64 {
    let mut v = (v & 0x1f_ffff) as u64;
    v = (v | v << 32) & 0x001f_0000_0000_ffff;
    v = (v | v << 16) & 0x001f_0000_ff00_00ff;
    v = (v | v << 8) & 0x100f_00f0_0f00_f00f;
    v = (v | v << 4) & 0x10c3_0c30_c30c_30c3;
    (v | v << 2) & 0x1249_2492_4924_9249
}

const fn gather_3(mut v: u64) -> u32 {
    v &= 0x1249_2492_4924_9249;
    v = (v | v >> 2) & 0x10c3_0c30_c30c_30c3;
    v = (v | v >> 4) & 0x100f_00f0_0f00_f00f;
    v = (v | v >> 8) & 0x001f_0000_ff00_00ff;
    v = (v | v >> 16) & 0x001f_0000_0000_ffff;
    ((v | v >> 32) & 0x1f_ffff) as u32
}

/// The code of the low 21 bits of (x, y, z).
#[inline]
pub const fn morton_encode_3(x: u32, y: u32, z: u32) -> u64 {
    spread_3(x) | spread_3(y) << 1 | spread_3(z) << 2
}

/// The (x, y, z) of a code.
#[inline]
pub const fn morton_decode_3(code: u64) -> (u32, u32, u32) {
    (gather_3(code), gather_3(code >> 1), gather_3(code >> 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_interleave_and_come_back() {
        assert_eq!(morton_encode_2(0b101, 0b011), 0b011011);
        assert_eq!(morton_encode_3(1, 1, 0), 0b011);
        let mut v = 12_345u32;
        for _ in 0..1000 {
            v = crate::hash::mix32(v);
            let w = crate::hash::mix32(v ^ 99);
            assert_eq!(morton_decode_2(morton_encode_2(v, w)), (v, w));
            let (a, b, c) = (v & 0x1f_ffff, w & 0x1f_ffff, (v ^ w) & 0x1f_ffff);
            assert_eq!(morton_decode_3(morton_encode_3(a, b, c)), (a, b, c));
        }
        assert_eq!(morton_encode_2(u32::MAX, 0), 0x5555_5555_5555_5555);
    }
}
