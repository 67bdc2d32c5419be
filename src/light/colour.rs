//! Light of stars by their colour.
//!
//! A star of colour B-V has the Sun's spectrum times the ratio of black bodies B(T) / B(5772 K), with one T below 550 nm that
//! gives it its B-V and one above that gives it the V-I of dwarfs of that B-V (Pecaut & Mamajek 2013, ApJS 208, 9;
//! `catalogs/spectra/star_colours.csv`). The Sun's own colour, B-V = 0.652, gives the Sun's own spectrum, so that a star
//! of unknown colour and `mag_v` mean the same light. Lines are the Sun's: bands a few nm wide are not to be trusted,
//! and red giants (B-V > 1.4) are bluer in V-I than the dwarfs by up to 0.5 mag.

use super::curve::Curve;
use super::tables;
use super::tabulated::Tabulated;
use super::throughput::Throughput;
use crate::base::units::flux_from_mag;
use std::sync::LazyLock;

/// Effective temperature of the Sun \[K\] (IAU 2015 Resolution B3, nominal).
const SUN_K: f64 = 5772.0;

/// Second radiation constant hc/k \[nm K\] (CODATA 2018).
const C2_NM_K: f64 = 1.438_776_877e7;

/// Where the two black bodies meet \[nm\].
const JOIN_NM: f64 = 550.0;

/// Spectrum of one colour: inverse temperatures below and above 550 nm \[1/K\].
#[derive(Debug, Clone, Copy)]
struct Template {
    bv: f64,
    blue: f64,
    red: f64,
    /// Factor that makes its V magnitude 0.
    norm: f64,
}

static TEMPLATES: LazyLock<Vec<Template>> = LazyLock::new(|| {
    let text = include_str!("../../catalogs/spectra/star_colours.csv");
    let rows = text.lines().filter(|l| !l.starts_with('#')).skip(1);
    let numbers = rows.map(|l| l.split(',').map(|v| v.parse::<f64>().unwrap_or(f64::NAN)).collect::<Vec<_>>());
    let sun = tables::sun();
    let template = |row: Vec<f64>| {
        let mut t = Template { bv: row[0], blue: row[2] * 1e-4, red: row[3] * 1e-4, norm: 1.0 };
        t.norm = flux_from_mag(-tables::magnitude_v(&sun.clone().map(|nm, value| value * t.tilt(nm))));
        t
    };
    numbers.map(template).collect()
});

impl Template {
    /// Factor on sunlight at `nm`.
    fn tilt(&self, nm: f64) -> f64 {
        let body = |inverse: f64, nm: f64| 1.0 / (C2_NM_K * inverse / nm).exp_m1();
        let inverse = if nm < JOIN_NM { self.blue } else { self.red };
        let ratio = |nm: f64| body(inverse, nm) / body(1.0 / SUN_K, nm);
        self.norm * ratio(nm) / ratio(JOIN_NM)
    }
}

/// The templates about a colour and the place between them, held at the ends.
fn around(bv: f64) -> (usize, f64) {
    let t = &*TEMPLATES;
    let i = t.partition_point(|t| t.bv <= bv).clamp(1, t.len() - 1) - 1;
    (i, ((bv - t[i].bv) / (t[i + 1].bv - t[i].bv)).clamp(0.0, 1.0))
}

/// Spectrum above the atmosphere of a star of V = 0 and colour `bv` \[mag\], -0.3 to 1.7, held beyond \[W m^-2 nm^-1\].
pub fn star(bv: f64) -> Curve {
    let (i, share) = around(bv);
    let [a, b] = [TEMPLATES[i], TEMPLATES[i + 1]];
    let spectrum =
        tables::sun().map(|nm, value| value * (a.tilt(nm).ln() * (1.0 - share) + b.tilt(nm).ln() * share).exp());
    let mag_v = tables::magnitude_v(&spectrum);
    spectrum.scaled(flux_from_mag(-mag_v))
}

/// Electrons per second of stars of V = 0 above the atmosphere, against colour and airmass.
#[derive(Debug, Clone)]
pub struct StarLight {
    solar: Tabulated,
    /// Rates of the templates.
    templates: Vec<Tabulated>,
}

impl StarLight {
    /// The light of stars through `throughput`.
    pub fn new(throughput: &Throughput) -> Self {
        let integrand = throughput.integrand(&tables::sun());
        let scale = flux_from_mag(-tables::magnitude_v(&tables::sun()));
        let solar = move |_: f64| scale;
        let factors = TEMPLATES.iter().map(|t| move |nm: f64| t.tilt(nm)).collect::<Vec<_>>();
        let mut all: Vec<&dyn Fn(f64) -> f64> = vec![&solar];
        all.extend(factors.iter().map(|f| f as &dyn Fn(f64) -> f64));
        let mut rates = integrand.tabulate(&all);
        let solar = rates.remove(0);
        Self { solar, templates: rates }
    }

    /// Electrons per second of a star of V = 0 and the Sun's spectrum.
    pub fn solar(&self) -> &Tabulated {
        &self.solar
    }

    /// Electrons per second of a star of V = 0 and colour `bv`, the Sun's spectrum where it is unknown.
    pub fn at(&self, bv: Option<f64>, airmass: f64) -> f64 {
        let Some(bv) = bv else { return self.solar.at(airmass) };
        let (i, share) = around(bv);
        let (a, b) = (self.templates[i].at(airmass).ln(), self.templates[i + 1].at(airmass).ln());
        (a + share * (b - a)).exp()
    }

    /// Mean and rms \[mag\] of the error made by giving the Sun's spectrum to stars whose B-V is spread by `sigma` about `mean`
    /// (five-point Gauss-Hermite quadrature).
    pub fn error_of_solar(&self, mean: f64, sigma: f64, airmass: f64) -> (f64, f64) {
        // Abramowitz & Stegun table 25.10, abscissae times sqrt(2), weights over sqrt(pi)
        const NODES: [(f64, f64); 5] = [
            (-2.856_970_013_872_806, 0.011_257_411_327_720_69),
            (-1.355_626_179_974_266, 0.222_075_922_005_612_65),
            (0.0, 0.533_333_333_333_333_3),
            (1.355_626_179_974_266, 0.222_075_922_005_612_65),
            (2.856_970_013_872_806, 0.011_257_411_327_720_69),
        ];
        let errors = NODES
            .map(|(x, w)| (2.5 * (self.at(Some(mean + sigma * x), airmass) / self.solar.at(airmass)).log10(), w));
        let first: f64 = errors.iter().map(|(e, w)| e * w).sum();
        let second: f64 = errors.iter().map(|(e, w)| e * e * w).sum();
        (first, second.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn colours(bv: f64) -> (f64, f64) {
        let spectrum = star(bv);
        let mag = |band: &str| tables::magnitude(&spectrum, &tables::passband(band));
        (mag("B") - mag("V"), mag("V") - mag("I"))
    }

    /// V-I of dwarfs: Pecaut & Mamajek 2013, ApJS 208, 9, table 5, and between its rows.
    #[test]
    fn a_star_has_the_colours_of_real_stars() {
        for (bv, vi) in
            [(-0.2, -0.212), (0.0, 0.004), (0.35, 0.4), (0.65, 0.716), (1.0, 1.03), (1.25, 1.42), (1.5, 2.131)]
        {
            let got = colours(bv);
            assert!((got.0 - bv).abs() < 0.005 && (got.1 - vi).abs() < 0.025, "{bv} {vi}: {got:?}");
        }
    }

    /// B-V of the Sun: 0.653 +- 0.005 (Ramirez et al. 2012, ApJ 752, 5).
    #[test]
    fn the_suns_colour_gives_the_suns_light() {
        let sun = tables::sun();
        let bv = tables::magnitude(&sun, &tables::passband("B")) - tables::magnitude_v(&sun);
        assert!((bv - 0.653).abs() < 0.005, "{bv}");
        for nm in [400.0, 700.0, 1000.0] {
            let ratio = star(bv).at(nm) / tables::solar_of_v_zero().at(nm);
            assert!((ratio - 1.0).abs() < 0.002, "{nm}: {ratio}");
        }
    }

    #[test]
    fn a_table_of_rates_follows_the_spectra() {
        let scene =
            crate::scene::load("pogs-geo", &crate::scene::Options { sets: &[], seed: None }).expect("a scene");
        let throughput = Throughput::of(&scene).expect("tables");
        let light = StarLight::new(&throughput);
        for bv in [-0.5, -0.3, 0.13, 0.652, 1.07, 1.7, 3.0] {
            let exact = throughput.electrons_per_s(&star(bv), 1.3);
            assert!((light.at(Some(bv), 1.3) / exact - 1.0).abs() < 2e-3, "{bv}");
        }
        let (offset, rms) = light.error_of_solar(0.7, 0.5, 1.3);
        assert!(rms > 0.02 && rms < 0.5 && offset.abs() < rms, "{offset} {rms}");
    }
}
