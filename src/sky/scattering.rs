//! Light of one lamp scattered by a clear, flat atmosphere, seen from the ground.
//!
//! Scattered once (Chandrasekhar 1960, sect. 4.7, integrated over a mixed layer of optical depth t = t_R + t_A):
//!
//! ```text
//! L1 / E = X / (4 pi) [t_R P_R + w t_A P_A] [exp(-t Xs) - exp(-t X)] / (t (X - Xs))
//! ```
//!
//! with E the lamp's irradiance above the air, X and Xs the airmasses of the line of sight and of the lamp, w = 0.97 the share
//! of aerosol extinction that is scattering. Molecules: P_R with depolarisation 0.0279 (Bucholtz 1995). Aerosol: Mie theory for
//! remote continental sizes (Jaenicke 1993; `catalogs/aerosol`), as Jones et al. 2013, A&A 560, A91, take them.
//!
//! Scattered more often, and by the ground of albedo A (a fit to discrete ordinates, `tests/reference/scattering.csv`):
//!
//! ```text
//! L / E = g L1 / E + (1 - exp(-t X)) / (4 pi) (S + G)
//! S = 1.41 x^0.89 (1 - exp(-x Xs)) / (x Xs)                           x = t_R + 0.29 t_A
//! G = 2 A T / Xs [t_R + (1 - 0.85 / X) t_A] / t / (1 - A x / (4/3 + x))    T by Eddington's approximation
//! g = 1 + 0.46 w t_A [(1 - exp(-t X)) / t + Xs] / 2 x (share of L1 that is not the aureole's core)
//! ```
//!
//! Against the reference (780 hPa, t_A(550 nm) = 0.05, A = 0.15, 400 to 800 nm, lamp and view up to 75 deg from the zenith)
//! 1.6 % rms and 5 % at most; with t_A = 0.15 at sea level 3 % and 8 %; with the lamp at 82 deg 10 % and 19 %, at 88 deg up
//! to 34 % too bright. Polarisation, left out, makes up to 7 % in the blue. Ozone lies above: it dims the lamp over its path
//! at 25 km.

use crate::base::nodes::bracket;
use crate::light::atmosphere::Depths;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Share of the extinction by aerosol that is scattering; the rest is absorbed.
const AEROSOL_ALBEDO: f64 = 0.97;

/// Depolarisation factor of air (Bucholtz 1995, Appl. Opt. 34, 2765).
const DEPOLARISATION: f64 = 0.0279;

/// Above this phase function light belongs to the core of the aureole, which further scattering does not make brighter.
const AUREOLE: f64 = 6.0;

const TABLE: &str = include_str!("../../catalogs/aerosol/remote_continental.csv");

/// The aerosol's phase function: logarithms over angle \[deg\] and the logarithm of wavelength \[nm\].
struct Aerosol {
    angles: Vec<f64>,
    log_nm: Vec<f64>,
    /// By angle, then wavelength.
    log: Vec<f64>,
}

static AEROSOL: LazyLock<Aerosol> = LazyLock::new(|| {
    let mut lines = TABLE.lines().filter(|l| !l.starts_with('#'));
    let names = lines.next().unwrap_or_default().split(',');
    let nm = names.filter_map(|n| n.strip_prefix('P')?.parse::<f64>().ok()).map(f64::ln).collect::<Vec<_>>();
    let mut aerosol = Aerosol { angles: vec![], log_nm: nm, log: vec![] };
    for line in lines {
        let mut values = line.split(',').map(|v| v.parse::<f64>().unwrap_or(f64::NAN));
        aerosol.angles.push(values.next().unwrap_or(f64::NAN));
        aerosol.log.extend(values.map(f64::ln));
    }
    aerosol
});

/// Phase functions at one scattering angle, mean 1 over the sphere.
#[derive(Debug, Clone)]
pub struct Phase {
    molecules: f64,
    aerosol_log: Vec<f64>,
}

impl Phase {
    /// At the scattering angle `rho` \[rad\], 0 to pi.
    pub fn at(rho: f64) -> Self {
        let a = &*AEROSOL;
        let (i, share) = bracket(&a.angles, rho.to_degrees());
        let row = |i: usize| &a.log[i * a.log_nm.len()..(i + 1) * a.log_nm.len()];
        let aerosol_log = row(i).iter().zip(row(i + 1)).map(|(x, y)| x + share * (y - x)).collect();
        let g = DEPOLARISATION / (2.0 - DEPOLARISATION);
        let molecules = 0.75 / (1.0 + 2.0 * g) * ((1.0 + 3.0 * g) + (1.0 - g) * rho.cos().powi(2));
        Self { molecules, aerosol_log }
    }

    /// Of the aerosol at `nm`; held beyond 350 to 1000 nm.
    fn aerosol(&self, nm: f64) -> f64 {
        let (i, share) = bracket(&AEROSOL.log_nm, nm.ln());
        (self.aerosol_log[i] + share * (self.aerosol_log[i + 1] - self.aerosol_log[i])).exp()
    }
}

/// Airmasses of the line of sight and of the lamp, 1 or more, and the ground below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paths {
    /// Of the line of sight.
    pub view: f64,
    /// Of the lamp.
    pub lamp: f64,
    /// Of the lamp through the ozone.
    pub lamp_ozone: f64,
    /// Albedo of the ground, 0 to 1.
    pub ground: f64,
}

/// Radiance over irradiance \[1/sr\] of the sky at `nm`.
pub fn radiance(nm: f64, depths: &Depths, phase: &Phase, paths: Paths) -> f64 {
    let (molecules, aerosol) = (depths.rayleigh, depths.aerosol);
    let depth = molecules + aerosol;
    if depth <= 0.0 {
        return 0.0;
    }
    let (x, xs) = (paths.view, paths.lamp);
    let scattered = AEROSOL_ALBEDO * aerosol;
    let phase_aerosol = phase.aerosol(nm);
    let once = molecules * phase.molecules + scattered * phase_aerosol;
    let first = x / (4.0 * PI) * once * mean_transmission(depth, paths);

    let absorbed = -(-depth * x).exp_m1();
    let open = (molecules * phase.molecules + scattered * phase_aerosol.min(AUREOLE)) / once;
    let gain = 1.0 + 0.46 * scattered * 0.5 * (absorbed / depth + xs) * open;
    let soft = molecules + 0.29 * aerosol;
    let sky = if soft > 0.0 { 1.41 * soft.powf(0.89) * -(-soft * xs).exp_m1() / (soft * xs) } else { 0.0 };
    let passed = ((2.0 / 3.0 + 1.0 / xs) + (2.0 / 3.0 - 1.0 / xs) * (-soft * xs).exp()) / (4.0 / 3.0 + soft);
    let back = (molecules + (1.0 - 0.85 / x) * aerosol) / depth / (1.0 - paths.ground * soft / (4.0 / 3.0 + soft));
    let ground = 2.0 * paths.ground * passed / xs * back;
    let ozone = (-depths.ozone * paths.lamp_ozone).exp();
    (first * gain + absorbed / (4.0 * PI) * (sky + ground)) * ozone
}

/// \[exp(-tau Xs) - exp(-tau X)\] / (tau (X - Xs)), without 0/0 where the paths are equal.
fn mean_transmission(depth: f64, paths: Paths) -> f64 {
    let shorter = depth * paths.view.min(paths.lamp);
    let difference = depth * (paths.view - paths.lamp).abs();
    let mean = if difference < 1e-9 { 1.0 } else { -(-difference).exp_m1() / difference };
    (-shorter).exp() * mean
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All orders of scattering by discrete ordinates: rms and largest error more than 10 deg from the lamp.
    #[test]
    fn the_sky_is_as_bright_as_radiative_transfer_says() {
        let text = include_str!("../../tests/reference/scattering.csv");
        let (mut sum, mut number, mut worst) = (0.0, 0.0, 0.0f64);
        for line in text.lines().filter(|l| l.starts_with(|c: char| c.is_ascii_digit())) {
            let v = line.split(',').map(|v| v.parse::<f64>().expect("a number")).collect::<Vec<_>>();
            let [nm, rayleigh, aerosol, lamp, view, _, rho, full, _] = v[..] else { panic!("{line}") };
            let airmass = |z: f64| 1.0 / z.to_radians().cos();
            let paths = Paths { view: airmass(view), lamp: airmass(lamp), lamp_ozone: 1.0, ground: 0.15 };
            let own = radiance(nm, &Depths { rayleigh, aerosol, ozone: 0.0 }, &Phase::at(rho.to_radians()), paths);
            let error = own / full - 1.0;
            assert!(rho > 0.5 || error.abs() < 0.03, "at the lamp: {line}: {error}");
            if rho > 10.0 {
                sum += error * error;
                number += 1.0;
                worst = worst.max(error.abs());
            }
        }
        let rms = f64::sqrt(sum / number);
        println!(
            "scattered light against discrete ordinates: rms {rms:.4}, largest {worst:.4} of {number} places"
        );
        assert!(rms < 0.02 && worst < 0.06, "{rms} {worst}");
    }

    #[test]
    fn phase_functions_have_mean_one() {
        for nm in [350.0, 550.0, 900.0] {
            let (mut molecules, mut aerosol) = (0.0, 0.0);
            let steps = 200_000;
            for k in 0..steps {
                let rho = PI * (f64::from(k) + 0.5) / f64::from(steps);
                let phase = Phase::at(rho);
                let weight = 0.5 * rho.sin() * PI / f64::from(steps);
                molecules += weight * phase.molecules;
                aerosol += weight * phase.aerosol(nm);
            }
            assert!((molecules - 1.0).abs() < 1e-6 && (aerosol - 1.0).abs() < 0.02, "{nm}: {molecules} {aerosol}");
        }
    }

    #[test]
    fn thin_air_scatters_little_and_the_horizon_is_finite() {
        let phase = Phase::at(1.0);
        let paths = |view, lamp| Paths { view, lamp, lamp_ozone: 1.0, ground: 0.15 };
        let none = Depths { rayleigh: 0.0, aerosol: 0.0, ozone: 0.1 };
        assert_eq!(radiance(550.0, &none, &phase, paths(1.0, 1.0)), 0.0);
        let thick = Depths { rayleigh: 0.5, aerosol: 0.3, ozone: 0.0 };
        for (view, lamp) in [(1.0, 38.0), (38.0, 1.0), (38.0, 38.0), (1.0, 1.0)] {
            let l = radiance(400.0, &thick, &phase, paths(view, lamp));
            assert!(l.is_finite() && l > 0.0 && l < 1.0, "{view} {lamp}: {l}");
        }
    }
}
