//! FITS images as written: one image in the primary HDU, big-endian, with checksums (FITS Standard 4.0).

use super::header::{Header, Value};
use super::{atomic, checksum};
use std::fs::File;
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Size of a FITS block \[bytes\].
pub(super) const BLOCK: usize = 2880;
/// Size of a card \[bytes\].
const CARD: usize = 80;

/// Kind of the pixels of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Unsigned 16 bit, stored as signed with BZERO = 2^15.
    U16,
    /// Unsigned 32 bit, stored as signed with BZERO = 2^31.
    U32,
    /// IEEE single precision.
    F32,
}

impl Kind {
    /// Bytes of a pixel.
    fn bytes(self) -> usize {
        if self == Self::U16 { 2 } else { 4 }
    }
}

/// Rows of pixels, from y = 0 on.
#[derive(Debug, Clone, Copy)]
pub enum Pixels<'a> {
    /// Unsigned 16 bit.
    U16(&'a [u16]),
    /// Unsigned 32 bit.
    U32(&'a [u32]),
    /// IEEE single precision.
    F32(&'a [f32]),
}

impl Pixels<'_> {
    fn kind(&self) -> Kind {
        match self {
            Self::U16(_) => Kind::U16,
            Self::U32(_) => Kind::U32,
            Self::F32(_) => Kind::F32,
        }
    }

    /// The bytes as stored.
    fn stored(&self) -> Vec<u8> {
        match self {
            Self::U16(pixels) => pixels.iter().flat_map(|v| (v ^ 0x8000).to_be_bytes()).collect(),
            Self::U32(pixels) => pixels.iter().flat_map(|v| (v ^ 0x8000_0000).to_be_bytes()).collect(),
            Self::F32(pixels) => pixels.iter().flat_map(|v| v.to_be_bytes()).collect(),
        }
    }
}

/// An image as it is written: rows in any order, from any thread, straight to their place in the file; the header, whose sums
/// are known at the end only, comes last. The file has its final name only when it is whole.
#[derive(Debug)]
pub struct Writer {
    file: Mutex<File>,
    path: PathBuf,
    header: Header,
    width: usize,
    height: usize,
    kind: Kind,
    /// Where the pixels begin \[bytes\].
    data_at: u64,
    /// Ones' complement sum of the rows so far.
    datasum: AtomicU64,
}

impl Writer {
    /// Begin the file of an image of `width` x `height` pixels with `header`'s cards.
    ///
    /// # Errors
    /// Whatever the file system says, with the path.
    pub fn create(path: &Path, width: usize, height: usize, kind: Kind, header: &Header) -> io::Result<Self> {
        let mut full = Header::default();
        let (bitpix, bzero) = match kind {
            Kind::U16 => (16, Some(32_768.0)),
            Kind::U32 => (32, Some(2_147_483_648.0)),
            Kind::F32 => (-32, None),
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
        let lines = full.lines().len() + 3;
        Ok(Self {
            file: Mutex::new(atomic::create(path)?),
            path: path.to_owned(),
            header: full,
            width,
            height,
            kind,
            data_at: (lines * CARD).next_multiple_of(BLOCK) as u64,
            datasum: AtomicU64::new(0),
        })
    }

    fn told(&self, error: io::Error) -> io::Error {
        io::Error::new(error.kind(), format!("{}: {error}", self.path.display()))
    }

    /// Write rows from `first_row` on. All but the last rows of the image must be whole words of 4 bytes.
    ///
    /// # Errors
    /// Whatever the file system says, with the path.
    ///
    /// # Panics
    /// If the pixels are of another kind or lie outside the image: a fault of the program.
    pub fn rows(&self, first_row: usize, pixels: Pixels) -> io::Result<()> {
        assert_eq!(pixels.kind(), self.kind, "kind of the pixels");
        let bytes = pixels.stored();
        let from = first_row * self.width * self.kind.bytes();
        assert!(from + bytes.len() <= self.width * self.height * self.kind.bytes(), "rows of the image");
        self.datasum.fetch_add(u64::from(checksum::ones_complement_sum(&bytes, 0)), Ordering::Relaxed);
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(self.data_at + from as u64)).map_err(|e| self.told(e))?;
        file.write_all(&bytes).map_err(|e| self.told(e))
    }

    /// Write the header and give the file its name.
    ///
    /// # Errors
    /// Whatever the file system says, with the path.
    pub fn finish(mut self) -> io::Result<()> {
        let datasum = checksum::folded(self.datasum.load(Ordering::Relaxed));
        let head = sealed(std::mem::take(&mut self.header), datasum);
        let data = (self.width * self.height * self.kind.bytes()).next_multiple_of(BLOCK) as u64;
        let file = self.file.get_mut().unwrap_or_else(PoisonError::into_inner);
        let written = file
            .set_len(self.data_at + data)
            .and_then(|()| file.seek(SeekFrom::Start(0)))
            .and_then(|_| file.write_all(&head));
        written.map_err(|e| self.told(e))?;
        atomic::finish(&self.path)
    }
}

/// The blocks of a header with the sums of its HDU, whose data sum to `datasum`.
pub(super) fn sealed(mut header: Header, datasum: u32) -> Vec<u8> {
    header.push("DATASUM", datasum.to_string(), "ones' complement sum of the data");
    header.push("CHECKSUM", "0".repeat(16), "sum of the whole HDU is -0");
    let mut head = header.lines().concat().into_bytes();
    let checksum_at = head.len() - CARD + 11;
    head.extend_from_slice(format!("{:<80}", "END").as_bytes());
    head.resize(head.len().next_multiple_of(BLOCK), b' ');
    let total = checksum::ones_complement_sum(&head, datasum);
    head[checksum_at..checksum_at + 16].copy_from_slice(checksum::encode(!total).as_bytes());
    head
}

/// Write a whole image under `path`, whole or not at all.
///
/// # Errors
/// Whatever the file system says, with the path.
pub fn write(path: &Path, width: usize, height: usize, pixels: Pixels, header: &Header) -> io::Result<()> {
    let writer = Writer::create(path, width, height, pixels.kind(), header)?;
    writer.rows(0, pixels)?;
    writer.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sum_of_a_whole_file_is_minus_zero() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.fits");
        let pixels = (0..35 * 7).map(|i| (i * 997) as u16).collect::<Vec<_>>();
        write(&path, 35, 7, Pixels::U16(&pixels), &Header::default()).expect("written");
        let whole = std::fs::read(&path).expect("read");
        assert_eq!(whole.len() % BLOCK, 0);
        assert_eq!(checksum::ones_complement_sum(&whole, 0), u32::MAX);
        // bands in any order give the same bytes
        let banded = folder.path().join("b.fits");
        let writer = Writer::create(&banded, 35, 7, Kind::U16, &Header::default()).expect("created");
        assert!(!banded.exists());
        for first in [4, 0, 6, 2] {
            let last = (first + 2).min(7);
            writer.rows(first, Pixels::U16(&pixels[first * 35..last * 35])).expect("written");
        }
        writer.finish().expect("finished");
        assert_eq!(std::fs::read(&banded).expect("read"), whole);
    }
}
