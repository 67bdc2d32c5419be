//! FITS images compressed without loss: RICE_1, each row a tile (FITS Standard 4.0, sect. 10).
//!
//! A tile is its first pixel as it is, then for every pixel, that first one too, the difference d from the pixel
//! before, folded into 2 d or, below 0, -2 d - 1, in blocks of 32 (White & Becker 1998). A block opens with a code of
//! a few bits: 0, all its differences are zero; k + 1, of each difference what is above its lowest k bits follows as
//! that many zeros and a one, then those k bits; the largest code, the differences follow whole. Differences wrap
//! round, so any row can be coded.

use super::checksum;
use super::fits::{BLOCK, sealed};
use super::header::{Header, Value};

/// Pixels that share a code.
const SHARED: usize = 32;

/// Width of the pixels of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Depth {
    /// Unsigned 16 bit, stored as signed with BZERO = 32768.
    U16,
    /// Unsigned 32 bit, stored as signed with BZERO = 2147483648.
    U32,
}

/// What the width of the pixels sets.
struct Coding {
    /// Width of a pixel \[bit\].
    pixel: u32,
    /// Width of a code \[bit\].
    code: u32,
    /// The code of whole differences; k is at most two less.
    whole: u32,
}

const SHORT: Coding = Coding { pixel: 16, code: 4, whole: 15 };
const LONG: Coding = Coding { pixel: 32, code: 5, whole: 26 };

/// One row of an image of [`Depth::U16`], compressed.
pub fn compress_row_u16(row: &[u16]) -> Vec<u8> {
    let fold = |value: u16, before: u16| {
        let difference = value.wrapping_sub(before) as i16;
        u32::from(((difference << 1) ^ (difference >> 15)) as u16)
    };
    compress(row, &SHORT, |value| u32::from(value ^ 0x8000), fold)
}

/// One row of an image of [`Depth::U32`], compressed.
pub fn compress_row_u32(row: &[u32]) -> Vec<u8> {
    let fold = |value: u32, before: u32| {
        let difference = value.wrapping_sub(before) as i32;
        ((difference << 1) ^ (difference >> 31)) as u32
    };
    compress(row, &LONG, |value| value ^ 0x8000_0000, fold)
}

fn compress<T: Copy>(
    row: &[T],
    coding: &Coding,
    stored: impl Fn(T) -> u32,
    fold: impl Fn(T, T) -> u32,
) -> Vec<u8> {
    let Some(&(mut before)) = row.first() else { return Vec::new() };
    // no block is longer than its differences whole and a byte of code
    let most = (row.len() + 1) * size_of::<T>() + row.len().div_ceil(SHARED);
    let mut stream = Stream { bytes: Vec::with_capacity(most), pending: 0, count: 0 };
    stream.put(stored(before), coding.pixel);
    let mut folded = [0; SHARED];
    for block in row.chunks(SHARED) {
        for (out, &value) in folded.iter_mut().zip(block) {
            *out = fold(value, before);
            before = value;
        }
        stream.put_block(&folded[..block.len()], coding);
    }
    stream.finish()
}

/// Bits one after another, the highest of a byte first.
struct Stream {
    bytes: Vec<u8>,
    /// The lowest `count` bits, fewer than 32, are not yet in `bytes`.
    pending: u64,
    count: u32,
}

impl Stream {
    /// Append a block of folded differences in its shortest form.
    fn put_block(&mut self, folded: &[u32], coding: &Coding) {
        let count = folded.len() as u64;
        let sum = folded.iter().map(|d| u64::from(*d)).sum::<u64>();
        if sum == 0 {
            return self.put(0, coding.code);
        }
        let guess = (sum / count).max(1).ilog2();
        let bits = |k: u32| count * u64::from(k + 1) + folded.iter().map(|d| u64::from(d >> k)).sum::<u64>();
        // the best k is next to the logarithm of the mean
        let near = |k: u32| k.min(coding.whole - 2);
        let best = (near(guess.saturating_sub(1))..=near(guess + 1)).map(|k| (bits(k), k)).min();
        match best {
            Some((bits, k)) if bits < count * u64::from(coding.pixel) => {
                self.put(k + 1, coding.code);
                folded.iter().for_each(|d| self.put_split(*d, k));
            }
            _ => {
                self.put(coding.whole, coding.code);
                folded.iter().for_each(|d| self.put(*d, coding.pixel));
            }
        }
    }

    fn put_split(&mut self, folded: u32, k: u32) {
        let mut zeros = folded >> k;
        while zeros + 1 + k > 32 {
            let some = zeros.min(32);
            self.put(0, some);
            zeros -= some;
        }
        self.put((1 << k) | (folded & ((1 << k) - 1)), zeros + 1 + k);
    }

    /// Append the lowest `count` bits, at most 32, of `value`, which has no others set.
    fn put(&mut self, value: u32, count: u32) {
        self.pending = (self.pending << count) | u64::from(value);
        self.count += count;
        if self.count >= 32 {
            self.count -= 32;
            self.bytes.extend_from_slice(&((self.pending >> self.count) as u32).to_be_bytes());
        }
    }

    fn finish(mut self) -> Vec<u8> {
        let last = (self.pending << (32 - self.count)) as u32;
        self.bytes.extend_from_slice(&last.to_be_bytes()[..self.count.div_ceil(8) as usize]);
        // rows wait in memory for the file
        self.bytes.shrink_to_fit();
        self.bytes
    }
}

/// The bytes of a FITS file of `width` x `height` pixels, given as compressed rows from y = 0, with `header`'s cards in
/// the extension that holds the image.
///
/// # Panics
/// If the number of rows is not `height`: a fault of the program.
pub fn file(width: usize, height: usize, depth: Depth, rows: &[Vec<u8>], header: &Header) -> Vec<u8> {
    assert_eq!(rows.len(), height, "rows of a {width} x {height} image");
    let heap = rows.iter().map(Vec::len).sum::<usize>();
    // 32-bit descriptors are signed
    let descriptor = if i32::try_from(heap).is_ok() { Descriptor::P } else { Descriptor::Q };
    hdus(width, depth, rows, header, descriptor)
}

/// How the table says where a tile is: its length and the place where it starts \[byte\].
#[derive(Debug, Clone, Copy)]
enum Descriptor {
    /// 32 bit each.
    P,
    /// 64 bit each.
    Q,
}

fn hdus(width: usize, depth: Depth, rows: &[Vec<u8>], header: &Header, descriptor: Descriptor) -> Vec<u8> {
    let mut primary = Header::default();
    primary.push("SIMPLE", true, "FITS Standard 4.0");
    primary.push("BITPIX", 8i64, "");
    primary.push("NAXIS", 0i64, "no data here");
    primary.push("EXTEND", true, "the image is in the extension");
    let data = table(rows, descriptor);
    let mut extension = table_header(width, depth, rows, descriptor);
    extension.cards.extend(header.cards.iter().cloned());
    let mut bytes = sealed(primary, 0);
    bytes.extend(sealed(extension, checksum::ones_complement_sum(&data, 0)));
    bytes.extend(data);
    bytes
}

fn table_header(width: usize, depth: Depth, rows: &[Vec<u8>], descriptor: Descriptor) -> Header {
    let (bitpix, bzero) = match depth {
        Depth::U16 => (16, 32768.0),
        Depth::U32 => (32, 2_147_483_648.0),
    };
    let size = match descriptor {
        Descriptor::P => 8,
        Descriptor::Q => 16,
    };
    let heap = rows.iter().map(Vec::len).sum::<usize>();
    let longest = rows.iter().map(Vec::len).max().unwrap_or(0);
    let mut header = Header::default();
    header.push("XTENSION", "BINTABLE", "a compressed image");
    header.push("BITPIX", 8i64, "");
    header.push("NAXIS", 2i64, "");
    header.push("NAXIS1", Value::Int(size), "[byte] descriptor of a tile");
    header.push("NAXIS2", Value::Int(rows.len() as i64), "tiles");
    header.push("PCOUNT", Value::Int(heap as i64), "[byte] all tiles");
    header.push("GCOUNT", 1i64, "");
    header.push("TFIELDS", 1i64, "");
    header.push("TTYPE1", "COMPRESSED_DATA", "");
    header.push("TFORM1", format!("1{descriptor:?}B({longest})"), "");
    header.push("ZIMAGE", true, "");
    header.push("ZSIMPLE", true, "FITS Standard 4.0");
    header.push("ZBITPIX", Value::Int(bitpix), "bits per pixel");
    header.push("ZNAXIS", 2i64, "");
    header.push("ZNAXIS1", Value::Int(width as i64), "columns");
    header.push("ZNAXIS2", Value::Int(rows.len() as i64), "rows");
    header.push("ZTILE1", Value::Int(width as i64), "a tile is a row");
    header.push("ZTILE2", 1i64, "");
    header.push("ZCMPTYPE", "RICE_1", "without loss");
    header.push("ZNAME1", "BLOCKSIZE", "");
    header.push("ZVAL1", Value::Int(SHARED as i64), "[pixel]");
    header.push("ZNAME2", "BYTEPIX", "");
    header.push("ZVAL2", Value::Int(bitpix / 8), "[byte]");
    header.push("EXTNAME", "COMPRESSED_IMAGE", "");
    header.push("BZERO", bzero, "unsigned integers");
    header.push("BSCALE", 1.0, "");
    header
}

/// Descriptors and tiles, in whole blocks.
fn table(rows: &[Vec<u8>], descriptor: Descriptor) -> Vec<u8> {
    let most = rows.iter().map(|row| row.len() + 16).sum::<usize>();
    let mut data = Vec::with_capacity(most.next_multiple_of(BLOCK));
    let mut start = 0;
    for row in rows {
        for number in [row.len(), start] {
            match descriptor {
                Descriptor::P => data.extend_from_slice(&(number as u32).to_be_bytes()),
                Descriptor::Q => data.extend_from_slice(&(number as u64).to_be_bytes()),
            }
        }
        start += row.len();
    }
    rows.iter().for_each(|row| data.extend_from_slice(row));
    data.resize(data.len().next_multiple_of(BLOCK), 0);
    data
}

#[cfg(test)]
mod tests {
    use super::*;
    use fitsy::FitsFile;
    use fitsy::hdu::Hdu;
    use proptest::prelude::*;

    /// The pixels as crate `fitsy` reads them, sums and a card checked.
    fn read(bytes: Vec<u8>, width: usize) -> Vec<u32> {
        assert_eq!(bytes.len() % BLOCK, 0);
        let file = FitsFile::from_bytes(bytes).expect("a FITS file");
        for report in file.verify_checksums().expect("sums") {
            assert_eq!((report.datasum_ok, report.checksum_ok), (Some(true), Some(true)));
        }
        let image = file.iter_decompressed().find_map(|hdu| match hdu.expect("an HDU") {
            Hdu::Image(image) if !image.axes().is_empty() => Some(image),
            _ => None,
        });
        let image = image.expect("an image");
        assert_eq!(image.axes()[0], width as u64);
        assert_eq!(image.header().first("EXPTIME"), Some(fitsy::header::Value::Real(1.5)));
        image.read_physical().expect("pixels").into_vec().into_iter().map(|v| v as u32).collect()
    }

    fn returns(width: usize, pixels: &[u32], depth: Depth) {
        let mut header = Header::default();
        header.push("EXPTIME", 1.5, "[s]");
        let rows = pixels.chunks(width).map(|row| match depth {
            Depth::U16 => compress_row_u16(&row.iter().map(|v| *v as u16).collect::<Vec<_>>()),
            Depth::U32 => compress_row_u32(row),
        });
        let rows = rows.collect::<Vec<_>>();
        let expected = match depth {
            Depth::U16 => pixels.iter().map(|v| v & 0xFFFF).collect::<Vec<_>>(),
            Depth::U32 => pixels.to_vec(),
        };
        assert_eq!(read(file(width, rows.len(), depth, &rows, &header), width), expected);
        assert_eq!(read(hdus(width, depth, &rows, &header, Descriptor::Q), width), expected);
    }

    #[test]
    fn extreme_rows_return_exactly() {
        for width in [1, 2, 31, 32, 33, 64, 100] {
            for depth in [Depth::U16, Depth::U32] {
                for height in [1, 3] {
                    let rows = |value: fn(u32) -> u32| (0..(width * height) as u32).map(value).collect::<Vec<_>>();
                    returns(width, &rows(|_| 0), depth);
                    returns(width, &rows(|_| u32::MAX), depth);
                    returns(width, &rows(|i| i), depth);
                    returns(width, &rows(|i| u32::MAX - 1000 * i), depth);
                    returns(width, &rows(|i| if i % 2 == 0 { 0 } else { u32::MAX }), depth);
                    returns(width, &rows(|i| if i % 32 == 17 { u32::MAX / 2 } else { 0 }), depth);
                    returns(width, &rows(|i| i.wrapping_mul(2_654_435_761)), depth);
                }
            }
        }
    }

    #[test]
    fn constant_rows_are_a_pixel_and_a_code_a_block() {
        assert_eq!(compress_row_u16(&[40_000; 64]), [0x1C, 0x40, 0x00]);
        assert!(compress_row_u16(&[]).is_empty());
    }

    proptest! {
        #[test]
        fn any_row_returns_exactly(row in prop::collection::vec(any::<u32>(), 1..150), shift in 0u32..32) {
            let row = row.iter().map(|v| v >> shift).collect::<Vec<_>>();
            returns(row.len(), &row, Depth::U16);
            returns(row.len(), &row, Depth::U32);
        }
    }
}
