//! Random bits as a function of their address: (seed, frame, stage, pixel).
//!
//! Philox 4x32-10 (Salmon et al. 2011, "Parallel random numbers: as easy as 1, 2, 3", SC11) maps a 128-bit
//! counter under a 64-bit key to 128 bits. The key is the scene's seed; the counter is the address. The same
//! pixel therefore draws the same bits for any number of threads, row band, crop or subset of frames.

use rand_core::{Infallible, TryRng};

/// What a random number is for. Two stages never share a stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Stage {
    /// Photon arrival and dark current: the one Poisson draw of a pixel.
    Shot = 1,
    /// Read-out noise.
    Read = 2,
    /// Scintillation of one object in one frame; the address is the object's number.
    Scintillation = 3,
    /// Places and magnitudes of random benchmark stars; the address is the star's number.
    RandomStars = 4,
    /// How many faint stars a bin of magnitude in a cell of the sky has; the address is cell and bin.
    SyntheticCount = 5,
    /// Places and magnitudes of those stars; the address is the star's number.
    SyntheticStars = 6,
    /// A chip's fixed pattern of response.
    Prnu = 7,
    /// A chip's fixed pattern of dark current.
    Dsnu = 8,
    /// Which pixels of a chip are hot.
    HotPixels = 9,
    /// Cosmic rays; the address is the ray's number.
    CosmicRays = 10,
    /// Bias of a chip's columns.
    BiasColumns = 11,
    /// Bias of a chip's rows.
    BiasRows = 12,
    /// Widths of the read noise of active pixels.
    ReadSpread = 13,
    /// Gains of active pixels.
    GainSpread = 14,
}

const MULTIPLIER: [u32; 2] = [0xD251_1F53, 0xCD9E_8D57];
const WEYL: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];

/// The ten rounds of Philox 4x32: 128 random bits of `counter` under `key`.
#[inline(always)]
pub fn philox4x32(mut counter: [u32; 4], mut key: [u32; 2]) -> [u32; 4] {
    for _ in 0..10 {
        let a = u64::from(MULTIPLIER[0]) * u64::from(counter[0]);
        let b = u64::from(MULTIPLIER[1]) * u64::from(counter[2]);
        counter =
            [(b >> 32) as u32 ^ counter[1] ^ key[0], b as u32, (a >> 32) as u32 ^ counter[3] ^ key[1], a as u32];
        key = [key[0].wrapping_add(WEYL[0]), key[1].wrapping_add(WEYL[1])];
    }
    counter
}

/// Pixels whose random bits are computed side by side: a chunk begins at a multiple of this.
pub const CHUNK: usize = 64;
/// Blocks of Philox in a chunk.
const BLOCKS: usize = CHUNK / 4;
const LOW: u64 = 0xFFFF_FFFF;

/// Where a stream of random numbers begins: all that its numbers depend on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Address {
    /// The scene's seed.
    pub seed: u64,
    /// Number of the frame.
    pub frame: u32,
    /// What the numbers are for.
    pub stage: Stage,
}

impl Address {
    /// Block number `block` (below 2^24) of the stream of `pixel` (y * width + x of the whole frame, or the
    /// number of an object): two independent words.
    #[inline(always)]
    pub fn block(&self, pixel: u64, block: u32) -> [u64; 2] {
        let counter = [pixel as u32, (pixel >> 32) as u32, self.frame, self.stage as u32 | block << 8];
        let r = philox4x32(counter, [self.seed as u32, (self.seed >> 32) as u32]);
        [u64::from(r[0]) | u64::from(r[1]) << 32, u64::from(r[2]) | u64::from(r[3]) << 32]
    }

    /// One word of 32 bits for each pixel of chunk number `chunk`, computed side by side: word k of block number `j` belongs
    /// to pixel 16 k + j of the chunk.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "four lanes side by side")]
    pub fn chunk(&self, chunk: u64) -> [u32; CHUNK] {
        // 32-bit words in the low halves of 64-bit lanes; what collects in the high halves is masked off
        let mut c = [[0u64; BLOCKS]; 4];
        let first = chunk * BLOCKS as u64;
        for j in 0..BLOCKS {
            // a chunk's counters differ in their lowest four bits only
            c[0][j] = first | j as u64;
            c[1][j] = first >> 32;
            c[2][j] = u64::from(self.frame);
            c[3][j] = self.stage as u64;
        }
        let mut key = [self.seed as u32, (self.seed >> 32) as u32];
        for _ in 0..10 {
            for j in 0..BLOCKS {
                let a = u64::from(MULTIPLIER[0]) * (c[0][j] & LOW);
                let b = u64::from(MULTIPLIER[1]) * (c[2][j] & LOW);
                c[0][j] = b >> 32 ^ c[1][j] ^ u64::from(key[0]);
                c[1][j] = b;
                c[2][j] = a >> 32 ^ c[3][j] ^ u64::from(key[1]);
                c[3][j] = a;
            }
            key = [key[0].wrapping_add(WEYL[0]), key[1].wrapping_add(WEYL[1])];
        }
        let mut words = [0; CHUNK];
        for (words, lane) in words.chunks_exact_mut(BLOCKS).zip(&c) {
            words.iter_mut().zip(lane).for_each(|(word, lane)| *word = *lane as u32);
        }
        words
    }

    /// 64 bits of a pixel, the first 32 of them `word`, its own of [`Address::chunk`].
    #[inline(always)]
    pub fn extended(&self, pixel: u64, word: u32) -> u64 {
        u64::from(word) << 32 | self.block(pixel, 1)[0] >> 32
    }

    /// The stream of `pixel` as a generator with `rand`'s traits.
    pub fn stream(&self, pixel: u64) -> Stream {
        Stream { address: *self, pixel, block: 0, spare: None }
    }
}

/// The random numbers of one pixel or object, one after the other.
#[derive(Debug, Clone)]
pub struct Stream {
    address: Address,
    pixel: u64,
    block: u32,
    spare: Option<u64>,
}

impl Stream {
    /// The next 64 bits.
    pub fn word(&mut self) -> u64 {
        if let Some(word) = self.spare.take() {
            return word;
        }
        let [first, second] = self.address.block(self.pixel, self.block);
        self.block = self.block.wrapping_add(1);
        self.spare = Some(second);
        first
    }
}

impl TryRng for Stream {
    type Error = Infallible;

    fn try_next_u32(&mut self) -> Result<u32, Infallible> {
        Ok(self.word() as u32)
    }

    fn try_next_u64(&mut self) -> Result<u64, Infallible> {
        Ok(self.word())
    }

    fn try_fill_bytes(&mut self, bytes: &mut [u8]) -> Result<(), Infallible> {
        for chunk in bytes.chunks_mut(8) {
            chunk.copy_from_slice(&self.word().to_le_bytes()[..chunk.len()]);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known answers of the authors' Random123 distribution (kat_vectors, philox4x32 10).
    #[test]
    fn philox_gives_the_published_known_answers() {
        assert_eq!(philox4x32([0; 4], [0; 2]), [0x6627_e8d5, 0xe169_c58d, 0xbc57_ac4c, 0x9b00_dbd8]);
        assert_eq!(philox4x32([u32::MAX; 4], [u32::MAX; 2]), [0x408f_276d, 0x41c8_3b0e, 0xa20b_c7c6, 0x6d54_51fd]);
        assert_eq!(
            philox4x32([0x243f_6a88, 0x85a3_08d3, 0x1319_8a2e, 0x0370_7344], [0xa409_3822, 0x299f_31d0]),
            [0xd16c_fe09, 0x94fd_cceb, 0x5001_e420, 0x2412_6ea1]
        );
    }

    #[test]
    fn chunks_hold_the_words_of_their_blocks() {
        let address = Address { seed: 5 | 7 << 40, frame: 2, stage: Stage::Read };
        for chunk in [0, 3, 1 << 40] {
            let words = address.chunk(chunk);
            for (pixel, word) in words.iter().enumerate() {
                let counter = chunk * 16 + pixel as u64 % 16;
                let block = address.block(counter, 0);
                assert_eq!(*word, (block[pixel / 32] >> (32 * (pixel / 16 % 2))) as u32, "{chunk} {pixel}");
            }
        }
    }

    #[test]
    fn every_part_of_the_address_changes_the_bits() {
        let base = Address { seed: 1, frame: 2, stage: Stage::Shot };
        let bits = base.block(3, 0);
        let others = [
            Address { seed: 2, ..base }.block(3, 0),
            Address { seed: 1 | 1 << 40, ..base }.block(3, 0),
            Address { frame: 3, ..base }.block(3, 0),
            Address { stage: Stage::Read, ..base }.block(3, 0),
            base.block(4, 0),
            base.block(3 | 1 << 35, 0),
            base.block(3, 1),
        ];
        assert!(others.iter().all(|other| *other != bits));
    }
}
