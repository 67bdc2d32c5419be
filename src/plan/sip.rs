//! Distortion of a field as polynomials of pixel offsets (SIP: Shupe et al. 2005, ASP Conf. 347, 491).
//!
//! A plate tilted by small angles p about its y axis and q about its x axis sees the offset (u, v) where an upright one sees
//! (u, v) (1 - (u tan p + v tan q) / F), F the focal length in pixels (Green 1985, Spherical Astronomy, sect. 13.4, plate
//! tilt): terms of second order.

use crate::scene::{Scene, Table};
use glam::DVec2;

/// Highest order of a term.
pub const HIGHEST: i32 = 5;

/// Powers (of u, of v) of the terms, in the order of [`Sip`]'s coefficients: by orders.
#[rustfmt::skip]
pub const SIP_TERMS: [(i32, i32); 18] = [
    (2, 0), (1, 1), (0, 2),
    (3, 0), (2, 1), (1, 2), (0, 3),
    (4, 0), (3, 1), (2, 2), (1, 3), (0, 4),
    (5, 0), (4, 1), (3, 2), (2, 3), (1, 4), (0, 5),
];

/// Terms up to the third order.
pub(super) const CUBIC: usize = 7;

/// Distortion of second to fifth order: added to the pixel offset (u, v) before the CD matrix.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sip {
    /// A_i_j of [`SIP_TERMS`] \[px^(1 - i - j)\].
    pub a: [f64; 18],
    /// B_i_j of [`SIP_TERMS`] \[px^(1 - i - j)\].
    pub b: [f64; 18],
}

impl Sip {
    /// Number of the leading terms beyond which all are 0.
    fn used(&self) -> usize {
        if self.order() > 3 { SIP_TERMS.len() } else { CUBIC }
    }

    /// The highest order of a term that is not 0; at least 3.
    pub fn order(&self) -> i32 {
        let order =
            |k: usize| if self.a[k] != 0.0 || self.b[k] != 0.0 { SIP_TERMS[k].0 + SIP_TERMS[k].1 } else { 0 };
        (0..SIP_TERMS.len()).map(order).fold(3, i32::max)
    }

    /// What is added to a pixel offset \[px\].
    pub fn shift(&self, p: DVec2) -> DVec2 {
        let mut powers = [DVec2::ONE; HIGHEST as usize + 1];
        for k in 1..powers.len() {
            powers[k] = powers[k - 1] * p;
        }
        let mut sum = DVec2::ZERO;
        for (k, (i, j)) in SIP_TERMS.into_iter().enumerate().take(self.used()) {
            sum += DVec2::new(self.a[k], self.b[k]) * (powers[i as usize].x * powers[j as usize].y);
        }
        sum
    }

    /// The sum of two distortions, each small against the field.
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            a: std::array::from_fn(|k| self.a[k] + other.a[k]),
            b: std::array::from_fn(|k| self.b[k] + other.b[k]),
        }
    }

    /// The distortion of a scene's optics, in offsets of stored pixels; none of ideal ones.
    ///
    /// # Errors
    /// What is wrong with the file of coefficients, with its path.
    pub fn of(scene: &Scene) -> Result<Option<Self>, String> {
        let t = &scene.telescope;
        let mut sip = match &t.sip {
            Table::Named(_) => Self::default(),
            Table::File(path) => {
                let told = |what: String| format!("{}: {what}", path.display());
                let bytes = std::fs::read(path).map_err(|e| told(e.to_string()))?;
                Self::parse(&String::from_utf8_lossy(&bytes)).map_err(told)?
            }
        };
        // the file counts unbinned pixels
        let binning = scene.detector.binning as f64;
        for (k, (i, j)) in SIP_TERMS.into_iter().enumerate() {
            let scale = binning.powi(i + j - 1);
            (sip.a[k], sip.b[k]) = (sip.a[k] * scale, sip.b[k] * scale);
        }
        let focal_px = t.focal_length_m / (scene.detector.pixel_um * 1e-6 * binning);
        let [p, q] = t.tilt_deg.map(|degrees| libm::tan(degrees.to_radians()) / focal_px);
        // the terms u^2, u v, v^2 lead the list
        for (k, tilt) in [(0, [p, 0.0]), (1, [q, p]), (2, [0.0, q])] {
            sip.a[k] -= tilt[0];
            sip.b[k] -= tilt[1];
        }
        let size = scene.detector.light_px();
        let corner = DVec2::new(size[0] as f64, size[1] as f64) / 2.0;
        for at in [corner, corner * DVec2::new(-1.0, 1.0)] {
            let shift = sip.shift(at).length();
            if shift.is_nan() || shift > 0.1 * corner.length() {
                return Err(format!(
                    "shifts a corner by {shift:.1} px; at most a tenth of its distance is allowed"
                ));
            }
        }
        // a field that folds has places that no pixel, or more than one, sees
        const GRID: i32 = 16;
        for k in 0..(2 * GRID + 1) * (2 * GRID + 1) {
            let cell = DVec2::new(f64::from(k % (2 * GRID + 1) - GRID), f64::from(k / (2 * GRID + 1) - GRID));
            let at = corner * cell / f64::from(GRID);
            let slope = |step: DVec2| 0.5 * (sip.shift(at + step) - sip.shift(at - step));
            let (x, y) = (slope(DVec2::X) + DVec2::X, slope(DVec2::Y) + DVec2::Y);
            let area = x.x * y.y - x.y * y.x;
            if area.is_nan() || !(0.5..2.0).contains(&area) {
                return Err(format!(
                    "a pixel at offset {at} px has {area:.2} times its area; 0.5 to 2 are allowed"
                ));
            }
        }
        Ok((sip != Self::default()).then_some(sip))
    }

    /// Coefficients from the cards of a FITS header, or lines `A_2_0 = 1e-7`; other lines and the inverse polynomials AP, BP are
    /// passed over.
    ///
    /// # Errors
    /// The card that cannot be used, or that none is there.
    pub fn parse(text: &str) -> Result<Self, String> {
        let cards: Vec<&str> = if text.lines().count() > 1 || text.len() < 160 || !text.is_ascii() {
            text.lines().collect()
        } else {
            (0..text.len() / 80).map(|k| &text[k * 80..(k + 1) * 80]).collect()
        };
        let mut sip = Self::default();
        let mut found = false;
        for card in cards {
            let Some((keyword, value)) = card.split_once('=') else { continue };
            let mut parts = keyword.trim().split('_');
            let (axis, i, j) = (parts.next(), parts.next(), parts.next());
            let (Some(axis @ ("A" | "B")), Some(i), Some(j), None) = (axis, i, j, parts.next()) else { continue };
            let value = value.split('/').next().unwrap_or_default().trim();
            let fault = |why: &str| format!("{} = {value}: {why}", keyword.trim());
            let powers = (i.parse::<i32>(), j.parse::<i32>());
            let (Ok(i), Ok(j)) = powers else { return Err(fault("no powers")) };
            let number = value.parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(|| fault("no number"))?;
            match SIP_TERMS.iter().position(|term| *term == (i, j)) {
                Some(k) if axis == "A" => sip.a[k] = number,
                Some(k) => sip.b[k] = number,
                None if number == 0.0 => {}
                None => return Err(fault("only terms of orders 2 to 5 are understood")),
            }
            found = true;
        }
        if found { Ok(sip) } else { Err("no A_i_j or B_i_j in it".into()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Options, load};

    #[test]
    fn coefficients_are_read_from_cards_and_from_lines() {
        let lines = "# mine\nA_2_0 = 1e-7\nB_0_5 = -2.5e-18 / a remark\nAP_1_0 = 3\n";
        let sip = Sip::parse(lines).expect("coefficients");
        assert_eq!((sip.a[0], sip.b[17], sip.order()), (1e-7, -2.5e-18, 5));
        let cards = format!("{:<80}{:<80}{:<80}", "SIMPLE  = T", "A_ORDER = 2", "A_1_1   = 1.5E-7 / x");
        assert_eq!(Sip::parse(&cards).expect("coefficients").a[1], 1.5e-7);
        for (text, message) in [("A_3_4 = 1", "orders 2 to 5"), ("A_2_0 = x", "no number"), ("", "no A_i_j")] {
            assert!(Sip::parse(text).expect_err("refused").contains(message), "{text}");
        }
    }

    /// Two degrees of tilt about y at f/7: (2048 px)^2 tan(2 deg) / 284 334 px = 0.515 px at the edge.
    #[test]
    fn a_tilted_plate_bends_the_field() {
        let sets = [("telescope.tilt_deg".to_owned(), "[2.0, 0.0]".to_owned())];
        let scene = load("pogs-geo", &Options { sets: &sets, seed: None }).expect("a good scene");
        let sip = Sip::of(&scene).expect("no file").expect("a tilt");
        let edge = sip.shift(DVec2::new(2048.0, 0.0));
        assert!((edge.x + 0.5151).abs() < 2e-3 && edge.y == 0.0, "{edge}");
        let corner = sip.shift(DVec2::new(2048.0, 1000.0));
        assert!((corner.y / corner.x - 1000.0 / 2048.0).abs() < 1e-9);
        let straight = load("pogs-geo", &Options::default()).expect("a good scene");
        assert_eq!(Sip::of(&straight), Ok(None));
    }
}
