//! OpenEXR images: any number of named planes of numbers, with a FITS header's keywords as attributes (crate `exr`).
//!
//! Row y = 0 comes first in the file, so arrays return as they were given. OpenEXR counts rows from the top: a viewer
//! of OpenEXR shows upside down what DS9 shows of the same frame.

use super::header::{Card, Header, Value};
use exr::block::lines::LineRefMut;
use exr::image::write::samples::{SamplesWriter, WritableSamples};
use exr::math::RoundingMode;
use exr::meta::attribute::LevelMode;
use exr::prelude::*;
use std::collections::HashMap;
use std::io;

/// Bytes before the attributes: magic number and version.
const LEAD: usize = 8;

/// A plane of an image, row by row from y = 0.
#[derive(Debug, Clone, Copy)]
pub enum Samples<'a> {
    /// IEEE single precision.
    F32(&'a [f32]),
    /// Unsigned 32 bit.
    U32(&'a [u32]),
}

impl Samples<'_> {
    fn len(&self) -> usize {
        match self {
            Self::F32(samples) => samples.len(),
            Self::U32(samples) => samples.len(),
        }
    }
}

/// The bytes of an OpenEXR file of `width` x `height` pixels: channels, sorted by name, in one part, compressed without
/// loss if `zip`, and an attribute for every keyword. Logical values become the integers 0 and 1, integers beyond 32
/// bit become floating; all remarks go into the text `history`, one a line.
///
/// # Errors
/// A channel whose number of samples is not `width` * `height`, a name that is not of printable characters or comes
/// twice, an image without pixels or channels; whatever the encoder says.
pub fn encode(
    width: usize,
    height: usize,
    channels: &[(&str, Samples)],
    header: &Header,
    zip: bool,
) -> io::Result<Vec<u8>> {
    check(width, height, channels)?;
    let planes = channels.iter().map(|&(name, samples)| AnyChannel::new(text(name), Plane { width, samples }));
    let encoding = Encoding {
        compression: if zip { Compression::ZIP16 } else { Compression::Uncompressed },
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let mut image = Image::from_encoded_channels((width, height), encoding, AnyChannels::sort(planes.collect()));
    image.layer_data.attributes.other = attributes(header);
    let mut bytes = Vec::new();
    image.write().to_buffered(io::Cursor::new(&mut bytes)).map_err(io::Error::other)?;
    sort_attributes(&mut bytes).ok_or_else(|| io::Error::other("the attributes do not end"))?;
    Ok(bytes)
}

/// What the encoder would stop at, or only tell in part.
fn check(width: usize, height: usize, channels: &[(&str, Samples)]) -> io::Result<()> {
    let wrong = |what: String| Err(io::Error::new(io::ErrorKind::InvalidInput, what));
    if width == 0 || height == 0 || channels.is_empty() {
        return wrong(format!("{} channels of {width} x {height} pixels", channels.len()));
    }
    for (i, (name, samples)) in channels.iter().enumerate() {
        if name.is_empty() || !name.bytes().all(|c| c.is_ascii_graphic()) {
            return wrong(format!("channel {name:?}: not a name of printable ASCII characters"));
        }
        if channels[..i].iter().any(|(other, _)| other == name) {
            return wrong(format!("channel {name:?}: twice in one image"));
        }
        if Some(samples.len()) != width.checked_mul(height) {
            return wrong(format!("channel {name:?}: {} samples of {width} x {height} pixels", samples.len()));
        }
    }
    Ok(())
}

/// Text of OpenEXR is UTF-8; the crate's own conversion makes Latin-1.
fn text(string: &str) -> Text {
    Text::from_slice_unchecked(string.as_bytes())
}

fn attributes(header: &Header) -> HashMap<Text, AttributeValue> {
    let mut attributes = HashMap::new();
    let mut history = Vec::new();
    for card in &header.cards {
        match card {
            Card::Keyword(keyword, value, _) => {
                attributes.insert(text(keyword), attribute(value));
            }
            Card::History(line) => history.push(line.as_str()),
        }
    }
    if !history.is_empty() {
        attributes.insert(text("history"), AttributeValue::Text(text(&history.join("\n"))));
    }
    attributes
}

fn attribute(value: &Value) -> AttributeValue {
    match value {
        Value::Bool(flag) => AttributeValue::I32((*flag).into()),
        Value::Int(number) => {
            i32::try_from(*number).map_or(AttributeValue::F64(*number as f64), AttributeValue::I32)
        }
        Value::Float(number) => AttributeValue::F64(*number),
        Value::Text(string) => AttributeValue::Text(text(string)),
    }
}

/// Order the attributes by name, as the OpenEXR library does: the crate's order changes from run to run. None if they
/// do not end within the bytes.
fn sort_attributes(bytes: &mut [u8]) -> Option<()> {
    let after_text = |from: usize| Some(from + bytes.get(from..)?.iter().position(|b| *b == 0)? + 1);
    let mut attributes = Vec::new();
    let mut at = LEAD;
    // name, type, size, value; an empty name is the end
    while *bytes.get(at)? != 0 {
        let size_at = after_text(after_text(at)?)?;
        let size = u32::from_le_bytes(*bytes.get(size_at..)?.first_chunk()?);
        let end = size_at + 4 + size as usize;
        attributes.push(bytes.get(at..end)?);
        at = end;
    }
    attributes.sort_unstable();
    let sorted = attributes.concat();
    bytes[LEAD..at].copy_from_slice(&sorted);
    Some(())
}

/// Hands the encoder one row after another, so that no plane is copied.
#[derive(Clone, Copy)]
struct Plane<'a> {
    width: usize,
    samples: Samples<'a>,
}

impl WritableSamples<'_> for Plane<'_> {
    type Writer = Self;

    fn sample_type(&self) -> SampleType {
        match self.samples {
            Samples::F32(_) => SampleType::F32,
            Samples::U32(_) => SampleType::U32,
        }
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&self, _: &exr::meta::header::Header) -> Self {
        *self
    }
}

impl SamplesWriter for Plane<'_> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let start = line.location.position.y() * self.width + line.location.position.x();
        let row = start..start + line.location.sample_count;
        let out = line.value.chunks_exact_mut(4);
        // the encoder turns the machine's order of bytes into the file's
        match self.samples {
            Samples::F32(s) => out.zip(&s[row]).for_each(|(out, v)| out.copy_from_slice(&v.to_ne_bytes())),
            Samples::U32(s) => out.zip(&s[row]).for_each(|(out, v)| out.copy_from_slice(&v.to_ne_bytes())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header() -> Header {
        let mut header = Header::default();
        header.push("DATE-OBS", "2025-01-01T00:00:00", "UTC");
        header.push("OBJECT", "", "");
        header.push("EXPTIME", 0.1, "[s]");
        header.push("CROPX0", -3i64, "");
        header.push("SIMSEED", 1i64 << 40, "");
        header.push("SIMULATD", true, "");
        header.history("sky: absent");
        header.history("moon: absent, below the horizon");
        header
    }

    #[test]
    fn planes_and_keywords_return() {
        for ((width, height), zip) in [((1, 1), true), ((7, 40), true), ((33, 17), false)] {
            let floats = (0..width * height).map(|i| (i as f32).sin() * 1e6).collect::<Vec<_>>();
            let numbers = (0..width * height).map(|i| u32::MAX - i as u32).collect::<Vec<_>>();
            let channels = [("mean_e", Samples::F32(&floats)), ("adu", Samples::U32(&numbers))];
            let bytes = encode(width, height, &channels, &header(), zip).expect("encodes");
            let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
            let image = image.all_attributes().from_buffered(io::Cursor::new(&bytes)).expect("reads");
            let layer = &image.layer_data;
            let names = layer.channel_data.list.iter().map(|c| c.name.to_string()).collect::<Vec<_>>();
            assert_eq!((layer.size, names), (Vec2(width, height), vec!["adu".to_owned(), "mean_e".to_owned()]));
            assert_eq!(layer.channel_data.list[0].sample_data, FlatSamples::U32(numbers.clone()));
            assert_eq!(layer.channel_data.list[1].sample_data, FlatSamples::F32(floats.clone()));
            let other = &layer.attributes.other;
            assert_eq!(other.len(), 7);
            assert_eq!(other[&text("DATE-OBS")], AttributeValue::Text(text("2025-01-01T00:00:00")));
            assert_eq!(other[&text("OBJECT")], AttributeValue::Text(text("")));
            assert_eq!(other[&text("EXPTIME")], AttributeValue::F64(0.1));
            assert_eq!(other[&text("CROPX0")], AttributeValue::I32(-3));
            assert_eq!(other[&text("SIMSEED")], AttributeValue::F64((1i64 << 40) as f64));
            assert_eq!(other[&text("SIMULATD")], AttributeValue::I32(1));
            let history = "sky: absent\nmoon: absent, below the horizon";
            assert_eq!(other[&text("history")], AttributeValue::Text(text(history)));
            let again = encode(width, height, &channels, &header(), zip).expect("encodes");
            assert!(bytes == again, "the same image has the same bytes");
        }
    }

    #[test]
    fn faults_name_the_channel() {
        let told = |width, channels: &[(&str, Samples)]| {
            encode(width, 1, channels, &Header::default(), false).expect_err("a fault").to_string()
        };
        let plane = Samples::U32(&[1, 2]);
        assert_eq!(told(0, &[]), "0 channels of 0 x 1 pixels");
        assert_eq!(told(3, &[("Y", plane)]), "channel \"Y\": 2 samples of 3 x 1 pixels");
        assert_eq!(told(2, &[("Y", plane), ("Y", plane)]), "channel \"Y\": twice in one image");
        assert!(told(2, &[("a\0b", plane)]).starts_with("channel \"a\\0b\": not a name"));
    }
}
