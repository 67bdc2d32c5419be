//! FITS checksums: DATASUM and CHECKSUM of the FITS Standard 4.0, sect. 4.4.2.7 and appendix J.

/// Ones' complement sum of `bytes` as big-endian 32-bit words, continuing from `sum`; a last incomplete word is
/// filled with zeros.
pub fn ones_complement_sum(bytes: &[u8], sum: u32) -> u32 {
    let mut total = u64::from(sum);
    let mut words = bytes.chunks_exact(4);
    for word in &mut words {
        total += u64::from(u32::from_be_bytes([word[0], word[1], word[2], word[3]]));
    }
    let mut last = [0; 4];
    last[..words.remainder().len()].copy_from_slice(words.remainder());
    total += u64::from(u32::from_be_bytes(last));
    folded(total)
}

/// A sum of 32-bit words whose carries have gone round.
pub fn folded(mut total: u64) -> u32 {
    while total >> 32 != 0 {
        total = (total & 0xFFFF_FFFF) + (total >> 32);
    }
    total as u32
}

/// The 16 characters whose own sum is `value`, rotated one to the right as the CHECKSUM card wants them.
pub fn encode(value: u32) -> String {
    const EXCLUDED: [u8; 13] = *b":;<=>?@[\\]^_`";
    let mut text = [0u8; 16];
    for (i, byte) in value.to_be_bytes().into_iter().enumerate() {
        let quarter = byte / 4 + b'0';
        let mut four = [quarter + byte % 4, quarter, quarter, quarter];
        // shift pairs apart, sum kept, until no punctuation is left
        while four.iter().any(|c| EXCLUDED.contains(c)) {
            for pair in [0, 2] {
                if EXCLUDED.contains(&four[pair]) || EXCLUDED.contains(&four[pair + 1]) {
                    four[pair] += 1;
                    four[pair + 1] -= 1;
                }
            }
        }
        for (j, c) in four.into_iter().enumerate() {
            text[4 * j + i] = c;
        }
    }
    text.rotate_right(1);
    text.iter().map(|c| char::from(*c)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// FITS Standard 4.0, appendix J.1: the sum 868229149 of a header has the complement 3426738146 and the
    /// characters hcHjjc9ghcEghc9g.
    #[test]
    fn the_worked_example_of_the_standard() {
        assert_eq!(encode(!868_229_149), "hcHjjc9ghcEghc9g");
    }

    #[test]
    fn carries_go_round() {
        assert_eq!(ones_complement_sum(&[0xFF, 0xFF, 0xFF, 0xFF, 0, 0, 0, 1], 0), 1);
        assert_eq!(ones_complement_sum(&[1], 0), 1 << 24);
    }
}
