//! FITS images as written: one image in the primary HDU, big-endian, with checksums (FITS Standard 4.0).

use super::header::{Header, Value};
use super::{atomic, checksum};
use std::io;
use std::path::Path;

/// Size of a FITS block \[bytes\].
const BLOCK: usize = 2880;

/// Pixels of an image, row by row from y = 0.
#[derive(Debug, Clone, Copy)]
pub enum Pixels<'a> {
    /// Unsigned 16 bit, stored as signed with BZERO = 32768.
    U16(&'a [u16]),
    /// IEEE single precision.
    F32(&'a [f32]),
}

/// The bytes of a FITS file of `width` x `height` pixels with `header`'s cards.
///
/// # Panics
/// If the number of pixels is not `width` * `height`: a fault of the program.
pub fn encode(width: usize, height: usize, pixels: Pixels, header: &Header) -> Vec<u8> {
    let data = data_bytes(width, height, pixels);
    let datasum = checksum::ones_complement_sum(&data, 0);
    let mut full = Header::default();
    let (bitpix, bzero) = match pixels {
        Pixels::U16(_) => (16, Some(32768.0)),
        Pixels::F32(_) => (-32, None),
    };
    full.push("SIMPLE", true, "FITS Standard 4.0");
    full.push("BITPIX", Value::Int(bitpix), "bits per pixel");
    full.push("NAXIS", Value::Int(2), "");
    full.push("NAXIS1", Value::Int(width as i64), "columns");
    full.push("NAXIS2", Value::Int(height as i64), "rows");
    if let Some(bzero) = bzero {
        full.push("BZERO", bzero, "unsigned integers");
        full.push("BSCALE", 1.0, "");
    }
    full.cards.extend(header.cards.iter().cloned());
    full.push("DATASUM", datasum.to_string(), "ones' complement sum of the data");
    full.push("CHECKSUM", "0".repeat(16), "sum of the whole HDU is -0");
    let mut head = full.lines().concat().into_bytes();
    let checksum_at = head.len() - 80 + 11;
    head.extend_from_slice(format!("{:<80}", "END").as_bytes());
    head.resize(head.len().next_multiple_of(BLOCK), b' ');
    let total = checksum::ones_complement_sum(&head, datasum);
    head[checksum_at..checksum_at + 16].copy_from_slice(checksum::encode(!total).as_bytes());
    head.extend_from_slice(&data);
    head
}

/// Write an image under `path`, whole or not at all.
///
/// # Errors
/// Whatever the file system says, with the path.
pub fn write(path: &Path, width: usize, height: usize, pixels: Pixels, header: &Header) -> io::Result<()> {
    atomic::write(path, &encode(width, height, pixels, header))
}

fn data_bytes(width: usize, height: usize, pixels: Pixels) -> Vec<u8> {
    let (count, size) = match pixels {
        Pixels::U16(p) => (p.len(), 2),
        Pixels::F32(p) => (p.len(), 4),
    };
    assert_eq!(count, width * height, "pixels of a {width} x {height} image");
    let mut bytes = vec![0u8; (count * size).next_multiple_of(BLOCK)];
    match pixels {
        Pixels::U16(p) => {
            for (out, value) in bytes.chunks_exact_mut(2).zip(p) {
                out.copy_from_slice(&(value ^ 0x8000).to_be_bytes());
            }
        }
        Pixels::F32(p) => {
            for (out, value) in bytes.chunks_exact_mut(4).zip(p) {
                out.copy_from_slice(&value.to_be_bytes());
            }
        }
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_of_a_whole_file_is_minus_zero() {
        let pixels = (0..35 * 7).map(|i| (i * 997) as u16).collect::<Vec<_>>();
        let bytes = encode(35, 7, Pixels::U16(&pixels), &Header::default());
        assert_eq!(bytes.len() % BLOCK, 0);
        assert_eq!(checksum::ones_complement_sum(&bytes, 0), u32::MAX);
    }
}
