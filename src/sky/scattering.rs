//! Light of one lamp scattered by a clear, flat atmosphere, seen from the ground.
//!
//! ```text
//! L / E = X / (4 pi)  sum_i w_i tau_i P_i(rho)  [exp(-tau Xs) - exp(-tau X)] / (tau (X - Xs))
//! ```
//!
//! for a lamp of irradiance E above the air, X and Xs the airmasses of the line of sight and of the lamp, tau the whole
//! optical depth, w the share scattered and P the phase function of molecules and aerosol (Chandrasekhar 1960, sect. 4.7
//! integrated over a mixed layer). Molecules: P = 3/4 (1 + cos^2 rho). Aerosol: Mie theory for the remote continental
//! size distribution of Jaenicke 1993 (`catalogs/aerosol`), as Jones et al. 2013, A&A 560, A91, take it.

use crate::base::nodes::bracket;
use crate::light::atmosphere::Depths;
use std::f64::consts::PI;
use std::sync::LazyLock;

/// Share of the extinction by aerosol that is scattering; the rest is absorbed.
const AEROSOL_ALBEDO: f64 = 0.97;

const TABLE: &str = include_str!("../../catalogs/aerosol/remote_continental.csv");

/// The aerosol's phase function: logarithms over angle \[deg\] and wavelength \[nm\].
struct Aerosol {
    angles: Vec<f64>,
    nm: Vec<f64>,
    /// By angle, then wavelength.
    log: Vec<f64>,
}

static AEROSOL: LazyLock<Aerosol> = LazyLock::new(|| {
    let mut lines = TABLE.lines().filter(|l| !l.starts_with('#'));
    let names = lines.next().unwrap_or_default().split(',');
    let nm = names.filter_map(|n| n.strip_prefix('P')?.parse().ok()).collect::<Vec<f64>>();
    let mut aerosol = Aerosol { angles: vec![], nm, log: vec![] };
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
        let row = |i: usize| &a.log[i * a.nm.len()..(i + 1) * a.nm.len()];
        let aerosol_log = row(i).iter().zip(row(i + 1)).map(|(x, y)| x + share * (y - x)).collect();
        Self { molecules: 0.75 * (1.0 + rho.cos().powi(2)), aerosol_log }
    }

    /// Of the aerosol at `nm`.
    fn aerosol(&self, nm: f64) -> f64 {
        let (i, share) = bracket(&AEROSOL.nm, nm);
        (self.aerosol_log[i] + share * (self.aerosol_log[i + 1] - self.aerosol_log[i])).exp()
    }
}

/// Airmasses of the line of sight and of the lamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paths {
    /// Of the line of sight.
    pub view: f64,
    /// Of the lamp.
    pub lamp: f64,
}

/// Radiance over irradiance \[1/sr\] of once-scattered light at `nm`.
pub fn single(nm: f64, depths: &Depths, phase: &Phase, paths: Paths) -> f64 {
    let scattered = depths.rayleigh * phase.molecules + AEROSOL_ALBEDO * depths.aerosol * phase.aerosol(nm);
    paths.view / (4.0 * PI) * scattered * mean_transmission(depths.total(), paths)
}

/// \[exp(-tau Xs) - exp(-tau X)\] / (tau (X - Xs)), without 0/0 where the paths are equal.
fn mean_transmission(depth: f64, paths: Paths) -> f64 {
    let shorter = depth * paths.view.min(paths.lamp);
    let difference = depth * (paths.view - paths.lamp).abs();
    let mean = if difference < 1e-9 { 1.0 } else { -(-difference).exp_m1() / difference };
    (-shorter).exp() * mean
}

/// Factor of light scattered more than once, and by the ground, on once-scattered light.
pub fn multiple(depths: &Depths, _paths: Paths) -> f64 {
    1.0 + 2.2 * depths.rayleigh
}
