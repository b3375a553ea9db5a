//! Rows of samples that are narrower than a byte.

/// Returns the samples of packed rows: `width` samples of 1, 2 or 4 `bits`, the highest bits of a
/// byte first; each row ends with its byte.
pub(super) fn unpack(rows: &[u8], width: usize, bits: usize) -> impl Iterator<Item = u8> {
    let per_byte = 8 / bits;
    rows.chunks_exact(width.div_ceil(per_byte)).flat_map(move |row| {
        (0..width).map(move |n| {
            let shift = 8 - bits * (n % per_byte + 1);
            row[n / per_byte] >> shift & ((1 << bits) - 1)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::unpack;

    #[test]
    fn samples_of_every_width_are_unpacked() {
        let two: Vec<u8> = unpack(&[0b1101_1000, 0b0111_1111], 3, 2).collect();
        assert_eq!(two, [3, 1, 2, 1, 3, 3]);
        let four: Vec<u8> = unpack(&[0xa5, 0xf0], 3, 4).collect();
        assert_eq!(four, [0xa, 0x5, 0xf]);
        let one: Vec<u8> = unpack(&[0b0100_0000, 0b1000_0000], 1, 1).collect();
        assert_eq!(one, [0, 1]);
    }
}
