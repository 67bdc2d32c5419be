//! Twilight: sunlight scattered high in the atmosphere, as excess over the night sky.
//!
//! Zenith (`patat`, the default): m = a0 + a1 x + a2 x^2 in B, V, R and I, with x the Sun's zenith distance less 95 deg, for
//! 95-105 deg (Patat, Ugolnikov & Postylyakov 2006, A&A 455, 385, Table 1). The measurement contains the night sky; the
//! excess is its radiance less Patat's own night (B 22.64, V 21.61, R 20.87, I 19.71; Patat 2003, A&A 400, 1183). From
//! 104 deg on the excess f goes to zero as f (1 - t)^3, with the width that keeps value and slope (C1) at 104 deg and
//! both at the end, near 107.5 deg: before the difference would turn negative or the parabola rise again.
//!
//! Between 440, 550, 640 and 790 nm the ratio to the Sun's spectrum is linear in wavelength, held beyond; its four values are
//! those that give Bessell's passbands their excesses.
//!
//! Direction (Yoachim et al. 2016, Proc. SPIE 9910): 10^(b (X - 1)), times 10^(c cos dAz (X - 1)) within 90 deg of the
//! Sun's azimuth. The fits are for moderate airmasses: beyond X = 2.5 (23 deg elevation) the value there is held. `yoachim`
//! takes their zenith too: r 10^(a (h + 12 deg)) times their dark sky in B, G and R, for the Sun 11 to 20 deg below the
//! horizon; I there follows R.
//!
//! Measured at the ground. A Sun higher than 5 deg below the horizon is outside the model. Uncertainty: 0.2 mag at the
//! zenith, twice that low in the sky.

use super::{Context, Field, Source, Toward};
use crate::base::ledger::Why;
use crate::base::units::{ARCSEC_PER_RAD, flux_from_mag};
use crate::light::curve::quadrature;
use crate::light::tables;
use crate::light::throughput::Throughput;
use std::sync::LazyLock;

/// A band: Patat's parabola and night, effective wavelength, Yoachim's camera band.
#[derive(Debug, Clone, Copy)]
pub struct Band {
    /// Name of the passband.
    pub name: &'static str,
    /// Effective wavelength \[nm\].
    nm: f64,
    parabola: [f64; 3],
    night_mag: f64,
    yoachim: Yoachim,
}

/// Yoachim's fit in one camera band.
#[derive(Debug, Clone, Copy)]
struct Yoachim {
    dark_mag: f64,
    r12: f64,
    a_dex_rad: f64,
    b_dex: f64,
    c_dex: f64,
}

const CAMERA_B: Yoachim =
    Yoachim { dark_mag: 22.35, r12: 7.56766, a_dex_rad: 22.9798, b_dex: 0.28688, c_dex: 0.301_162 };
const CAMERA_G: Yoachim =
    Yoachim { dark_mag: 21.71, r12: 2.38561, a_dex_rad: 22.9311, b_dex: 0.297_733, c_dex: 0.316_403 };
const CAMERA_R: Yoachim =
    Yoachim { dark_mag: 21.30, r12: 1.75498, a_dex_rad: 22.2012, b_dex: 0.298_619, c_dex: 0.328_88 };

/// The bands of the model, ascending in wavelength.
pub const BANDS: [Band; 4] = [
    Band { name: "B", nm: 440.0, parabola: [11.84, 1.411, -0.041], night_mag: 22.64, yoachim: CAMERA_B },
    Band { name: "V", nm: 550.0, parabola: [11.84, 1.518, -0.057], night_mag: 21.61, yoachim: CAMERA_G },
    Band { name: "R", nm: 640.0, parabola: [11.40, 1.567, -0.064], night_mag: 20.87, yoachim: CAMERA_R },
    Band { name: "I", nm: 790.0, parabola: [10.93, 1.470, -0.062], night_mag: 19.71, yoachim: CAMERA_R },
];

/// First Sun zenith distance of the model \[deg\].
const FIRST_DEG: f64 = 95.0;
/// Where the blend to zero begins \[deg\].
const BLEND_DEG: f64 = 104.0;
/// Sun's elevations of Yoachim's fit \[deg\].
const YOACHIM_DEG: [f64; 2] = [-20.0, -11.0];

/// The fit to the sky's direction is not carried beyond this airmass; nearer to the horizon its value is held.
const LONGEST_PATH: f64 = 2.5;

impl Band {
    /// Patat's night and twilight together at the zenith: his parabola \[mag/arcsec^2\].
    pub fn patat(&self, sun_zenith_deg: f64) -> f64 {
        let [a, b, c] = self.parabola;
        let x = sun_zenith_deg - FIRST_DEG;
        a + b * x + c * x * x
    }

    /// Patat's own night \[mag/arcsec^2\].
    pub fn night(&self) -> f64 {
        self.night_mag
    }

    /// Excess radiance at the zenith in units of magnitude 0 a square arcsecond, for the Sun `sun_zenith_deg` from the
    /// zenith; none above the model's range.
    pub fn zenith_excess(&self, sun_zenith_deg: f64) -> Option<f64> {
        let excess = |z: f64| flux_from_mag(self.patat(z)) - flux_from_mag(self.night_mag);
        if sun_zenith_deg.is_nan() || sun_zenith_deg < FIRST_DEG {
            return None;
        }
        if sun_zenith_deg <= BLEND_DEG {
            return Some(excess(sun_zenith_deg));
        }
        let [_, b, c] = self.parabola;
        let slope = -0.4
            * std::f64::consts::LN_10
            * (b + 2.0 * c * (BLEND_DEG - FIRST_DEG))
            * flux_from_mag(self.patat(BLEND_DEG));
        let width = -3.0 * excess(BLEND_DEG) / slope;
        let left = (1.0 - (sun_zenith_deg - BLEND_DEG) / width).max(0.0);
        Some(excess(BLEND_DEG) * left * left * left)
    }
}

impl Yoachim {
    fn zenith_excess(&self, sun_elevation: f64) -> f64 {
        let above = sun_elevation + 12f64.to_radians();
        self.r12 * flux_from_mag(self.dark_mag) * 10f64.powf(self.a_dex_rad * above)
    }

    /// Brightness towards a direction relative to the zenith.
    fn direction(&self, airmass: f64, from_sun_azimuth: f64) -> f64 {
        let path = (airmass.min(LONGEST_PATH) - 1.0).max(0.0);
        10f64.powf(path * (self.b_dex + self.c_dex * from_sun_azimuth.cos().max(0.0)))
    }
}

/// Electrons per second and square arcsecond of light of magnitude 0 at each band's wavelength, measured at the ground.
#[derive(Debug, Clone, Copy)]
pub struct Rates([f64; 4]);

impl Rates {
    /// The rates of an instrument.
    pub fn new(throughput: &Throughput) -> Self {
        let integrand = throughput.integrand(&tables::solar_of_v_zero());
        Self([0, 1, 2, 3].map(|k| integrand.through(|nm| hat(k, nm))))
    }
}

/// What each band sees of sunlight (V = 0) that is there at one band's wavelength and faded to nothing at its neighbours', in
/// units of magnitude 0 of the band that sees: by band that sees, then wavelength.
static SEEN: LazyLock<[[f64; 4]; 4]> = LazyLock::new(|| {
    let sun = tables::solar_of_v_zero();
    BANDS.map(|band| {
        let passband = tables::passband(band.name);
        let zero = flux_from_mag(tables::magnitude(&sun, &passband));
        let photons = |k: Option<usize>| {
            let share = |nm: f64| k.map_or(1.0, |k| hat(k, nm));
            let nodes = quadrature(&[&sun, &passband]);
            nodes.iter().map(|(nm, w)| w * nm * sun.at(*nm) * passband.at(*nm) * share(*nm)).sum::<f64>()
        };
        [0, 1, 2, 3].map(|k| zero * photons(Some(k)) / photons(None))
    })
});

/// Light at the four wavelengths, in units of sunlight of V = 0, that gives the four bands these excesses (magnitude 0 = 1); none
/// of it negative.
fn at_wavelengths(excess: [f64; 4]) -> [f64; 4] {
    // Gauss-Seidel: each band sees mostly its own wavelength
    let mut light = excess.map(|_| 0.0);
    for _ in 0..60 {
        for (k, seen) in SEEN.iter().enumerate() {
            let others: f64 = (0..4).filter(|j| *j != k).map(|j| seen[j] * light[j]).sum();
            light[k] = ((excess[k] - others) / seen[k]).max(0.0);
        }
    }
    light
}

/// Share of band `k` at `nm`: 1 at its own wavelength, 0 at its neighbours', linear between; the outermost are held.
fn hat(k: usize, nm: f64) -> f64 {
    let toward = |other: usize| ((nm - BANDS[other].nm) / (BANDS[k].nm - BANDS[other].nm)).clamp(0.0, 1.0);
    let left = if k == 0 { 1.0 } else { toward(k - 1) };
    let right = if k + 1 == BANDS.len() { 1.0 } else { toward(k + 1) };
    left.min(right)
}

/// Twilight of a frame.
pub struct Twilight<'a> {
    context: &'a Context<'a>,
    /// Electrons per pixel at the zenith, by band.
    zenith: [f64; 4],
    outside: Option<String>,
    yoachim: bool,
}

impl<'a> Twilight<'a> {
    /// With Patat's zenith.
    pub fn patat(context: &'a Context<'a>) -> Self {
        let sun_zenith_deg = 90.0 - context.now.sun.horizontal.elevation.to_degrees();
        let outside = (sun_zenith_deg < FIRST_DEG)
            .then(|| format!("Sun at {:.1} deg elevation, model below -5 deg", 90.0 - sun_zenith_deg));
        let excess = BANDS.map(|band| band.zenith_excess(sun_zenith_deg).unwrap_or(f64::NAN));
        Self { zenith: Self::electrons(context, excess), context, outside, yoachim: false }
    }

    /// With Yoachim's zenith.
    pub fn yoachim(context: &'a Context<'a>) -> Self {
        let elevation = context.now.sun.horizontal.elevation;
        let [low, high] = YOACHIM_DEG;
        let degrees = elevation.to_degrees();
        let outside =
            (degrees > high).then(|| format!("Sun at {degrees:.1} deg elevation, model {low} to {high} deg"));
        let excess = BANDS.map(|band| match (degrees > high, degrees < low) {
            (true, _) => f64::NAN,
            (_, true) => 0.0,
            _ => band.yoachim.zenith_excess(elevation),
        });
        Self { zenith: Self::electrons(context, excess), context, outside, yoachim: true }
    }

    fn electrons(context: &Context, excess: [f64; 4]) -> [f64; 4] {
        if excess.iter().any(|e| e.is_nan()) {
            return [f64::NAN; 4];
        }
        let (rates, light) = (context.response.twilight.0, at_wavelengths(excess));
        let arcsec2 = context.per_steradian() * ARCSEC_PER_RAD * ARCSEC_PER_RAD;
        std::array::from_fn(|k| light[k] * rates[k] * arcsec2)
    }
}

impl Source for Twilight<'_> {
    fn name(&self) -> &'static str {
        "sky.twilight"
    }

    fn keyword(&self) -> &'static str {
        "SKYTWIL"
    }

    fn basis(&self) -> String {
        match self.yoachim {
            true => "Yoachim 2016, zenith and direction, B G R".into(),
            false => "Patat 2006 less its night sky in B V R I, direction of Yoachim 2016".into(),
        }
    }

    fn absent(&self, _: &Field) -> Option<Why> {
        if let Some(outside) = &self.outside {
            return Some(Why::OutsideModel(outside.clone()));
        }
        let below = -self.context.now.sun.horizontal.elevation.to_degrees();
        let dark = self.zenith.iter().all(|e| *e == 0.0);
        dark.then(|| Why::NotVisible(format!("Sun {below:.1} deg below the horizon")))
    }

    fn mean(&self, toward: &Toward) -> f64 {
        let from_sun = toward.azimuth - self.context.now.sun.horizontal.azimuth;
        let band = |(band, electrons): (&Band, &f64)| electrons * band.yoachim.direction(toward.airmass, from_sun);
        BANDS.iter().zip(&self.zenith).map(band).sum()
    }

    fn uncertainty(&self) -> f64 {
        if self.context.field.centre().airmass > 2.0 { 0.4 } else { 0.2 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::units::mag_from_flux;

    /// Patat's published parabola at every whole degree is the excess and his night together.
    #[test]
    fn the_excess_is_patats_less_his_night() {
        for band in BANDS {
            for z in 95..=104 {
                let z = f64::from(z);
                let both = band.zenith_excess(z).expect("inside") + flux_from_mag(band.night());
                assert!((mag_from_flux(both) - band.patat(z)).abs() < 1e-9, "{} {z}", band.name);
            }
            assert_eq!(band.zenith_excess(94.9), None);
            assert_eq!(band.zenith_excess(120.0), Some(0.0));
        }
        // hand-worked: V at 100 deg is 11.84 + 7.59 - 1.425
        assert!((BANDS[1].patat(100.0) - 18.005).abs() < 1e-12);
    }

    #[test]
    fn the_excess_falls_smoothly_to_zero() {
        for band in BANDS {
            let f = |z: f64| band.zenith_excess(z).expect("inside");
            let scale = f(103.0);
            let (mut before, mut slope_before) = (scale, f64::NAN);
            for i in 1..=600 {
                let now = f(103.0 + 0.01 * f64::from(i));
                let slope = (now - before) / 0.01;
                assert!(now >= 0.0 && now <= before, "{} {i}", band.name);
                assert!(slope_before.is_nan() || (slope - slope_before).abs() < 0.02 * scale, "{} {i}", band.name);
                (before, slope_before) = (now, slope);
            }
            assert_eq!(f(108.3), 0.0, "{}", band.name);
        }
    }

    /// Through Bessell's passbands the spectrum gives the four excesses over Patat's range of the Sun. Beyond, R fades before
    /// its neighbours, whose light alone gives it more than its own excess.
    #[test]
    fn each_band_sees_its_own_excess() {
        for tenth in 950..=1050 {
            let excess = BANDS.map(|band| band.zenith_excess(f64::from(tenth) / 10.0).expect("inside"));
            let light = at_wavelengths(excess);
            for (k, seen) in SEEN.iter().enumerate() {
                let got: f64 = seen.iter().zip(light).map(|(s, l)| s * l).sum();
                let error = (got - excess[k]) / excess[k].max(flux_from_mag(25.0));
                assert!(error.abs() < 1e-6, "{} at {tenth}: {error}", BANDS[k].name);
            }
        }
    }

    /// The constants above are those of the tables in `catalogs/twilight`.
    #[test]
    fn the_constants_are_the_tables() {
        let rows = |text: &'static str| {
            let lines = text.lines().filter(|l| !l.starts_with('#')).skip(1);
            lines.map(|l| l.split(',').skip(1).map(|v| v.parse::<f64>().expect("a number")).collect::<Vec<_>>())
        };
        for (band, row) in BANDS.iter().zip(rows(include_str!("../../catalogs/twilight/patat2006.csv"))) {
            let [a, b, c] = band.parabola;
            assert_eq!(row, [a, b, c, band.night_mag]);
        }
        let fits = [CAMERA_B, CAMERA_G, CAMERA_R];
        for (fit, row) in fits.iter().zip(rows(include_str!("../../catalogs/twilight/yoachim2016.csv"))) {
            assert_eq!(row, [fit.r12, fit.a_dex_rad, fit.b_dex, fit.c_dex, fit.dark_mag]);
        }
    }

    #[test]
    fn the_shares_of_the_bands_sum_to_one() {
        for nm in [300.0, 440.0, 500.0, 550.0, 600.0, 700.0, 790.0, 1000.0] {
            let sum: f64 = (0..4).map(|k| hat(k, nm)).sum();
            assert!((sum - 1.0).abs() < 1e-12, "{nm}: {sum}");
        }
    }
}
