//! No header, however broken, makes the reading fail or give what is no number.

use super::fixtures::*;
use super::*;

/// SplitMix64 (Steele et al. 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    fn number(&mut self) -> f64 {
        const ODD: [f64; 14] = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            1e308,
            -1e308,
            5e-324,
            90.0,
            2e9,
            65.5e3,
            6e4,
        ];
        if self.below(2) == 0 { ODD[self.below(ODD.len())] } else { f64::from_bits(self.next()) }
    }

    fn text(&mut self) -> String {
        const PARTS: [&str; 26] = [
            "1",
            "59",
            "60",
            "2018",
            "-",
            "+",
            ":",
            "/",
            "T",
            " ",
            ".",
            "Z",
            "N",
            "S",
            "W",
            "d",
            "°",
            "′",
            "é",
            "[",
            "]",
            ",",
            "RA---TAN",
            "TAN",
            "NaN",
            "99999999999999999999",
        ];
        (0..self.below(9)).map(|_| PARTS[self.below(PARTS.len())]).collect()
    }
}

fn sound(f: &Facts) {
    let numbers = [f.exptime_s, f.gain_e_adu, f.read_noise_e, f.saturate_adu, f.bias_adu, f.ccd_temp_c, f.airmass];
    let more = [f.aperture_m, f.focal_length_m, f.seeing, f.elevation_m, f.time.as_ref().map(|t| t.plus_s)];
    assert!(numbers.into_iter().chain(more).flatten().all(f64::is_finite), "{f:?}");
    assert!(f.pointing.is_none_or(|p| (p.length() - 1.0).abs() < 1e-9), "{f:?}");
    assert!(f.wcs.is_none_or(|w| w.wcs.cd.is_finite() && w.wcs.centre.is_finite() && w.wcs.crpix.is_finite()));
    assert!(f.notes.iter().all(|n| !n.to_string().is_empty()));
    let _ = f.missing();
}

#[test]
fn garbage_is_read_without_harm() {
    let known: Vec<String> = ALL.iter().flat_map(|(_, text)| Cards::of(text).0.into_keys()).collect();
    let mut random = Random(20_180_115);
    for round in 0..20_000 {
        // a real header, some of whose cards are broken, or nothing but broken cards
        let mut cards = if round % 3 == 0 { Cards::default() } else { Cards::of(ALL[random.below(ALL.len())].1) };
        for _ in 0..1 + random.below(12) {
            let keyword = known[random.below(known.len())].clone();
            let value = match random.below(5) {
                0 | 1 => Value::Number(random.number()),
                2 | 3 => Value::Text(random.text()),
                _ => Value::Flag(random.below(2) == 0),
            };
            cards.0.insert(keyword, value);
        }
        let mut overrides = Overrides::default();
        if round % 7 == 0 {
            overrides.pixel_scale_arcsec = Some(random.number());
            overrides.rotation_deg = Some(random.number());
            overrides.exptime_s = Some(random.number());
            overrides.time_utc = Some(random.text());
            overrides.pointing_deg = Some([random.number(), random.number()]);
            overrides.aperture_mm = Some(random.number());
        }
        let size = [[0, 0], [1, 1], [4096, 4096], [usize::MAX, 3]][random.below(4)];
        sound(&Facts::read(&cards, size, &overrides));
    }
}

#[test]
fn every_layout_is_sound_and_the_empty_one_lacks_everything() {
    for (name, text) in ALL {
        let f = Facts::read(&Cards::of(text), [4096, 4096], &Overrides::default());
        sound(&f);
        assert!(f.time.is_some() && f.exptime_s.is_some(), "{name}");
    }
    let nothing = Facts::read(&Cards::default(), [10, 10], &Overrides::default());
    assert_eq!(nothing.missing().len(), 4);
    assert_eq!(nothing.notes, []);
}
