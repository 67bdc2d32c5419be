//! Built-in spectra, passbands, extinction curves and quantum efficiencies; `catalogs/README.md` tells their
//! origins.

use super::curve::{Curve, CurveError};
use crate::base::constants::VEGA_V_MAG;
use crate::base::units::flux_from_mag;
use crate::scene::Table;

/// What a curve of a scene is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Extinction \[mag/airmass\]; its end values hold outside the table.
    Extinction,
    /// Transmission of a filter.
    Filter,
    /// Quantum efficiency \[e-/photon\].
    Qe,
}

macro_rules! table {
    ($path:literal) => {
        include_str!(concat!("../../catalogs/", $path, ".csv"))
    };
}

const EXTINCTION: [(&str, &str); 3] = [
    ("kpno", table!("extinction/kpno")),
    ("ctio", table!("extinction/ctio")),
    ("krag2003", table!("extinction/krag2003")),
];
const FILTER: [(&str, &str); 5] = [
    ("B", table!("passbands/B")),
    ("V", table!("passbands/V")),
    ("R", table!("passbands/R")),
    ("I", table!("passbands/I")),
    ("G", table!("passbands/G")),
];
const QE: [(&str, &str); 5] = [
    ("kaf16803", table!("qe/kaf16803")),
    ("krag2003", table!("qe/krag2003")),
    ("e2v230_84", table!("qe/e2v230_84")),
    ("andor_dw936", table!("qe/andor_dw936")),
    ("thx7899m", table!("qe/thx7899m")),
];

/// The curve a scene names: built in, or read from a file.
///
/// # Errors
/// [`CurveError`] for an unknown name, an unreadable file or a damaged table.
pub fn curve(kind: Kind, table: &Table) -> Result<Curve, CurveError> {
    let curve = match table {
        Table::Named(name) if name == "none" => {
            return Ok(Curve::constant(if kind == Kind::Extinction { 0.0 } else { 1.0 }));
        }
        Table::Named(name) => {
            let list: &[(&str, &str)] = match kind {
                Kind::Extinction => &EXTINCTION,
                Kind::Filter => &FILTER,
                Kind::Qe => &QE,
            };
            let found = list.iter().find(|(known, _)| known == name);
            let text = found.map(|(_, text)| *text).ok_or_else(|| CurveError::Unreadable {
                name: name.clone(),
                reason: "no such built-in table".into(),
            })?;
            Curve::parse(text, name)?
        }
        Table::File(path) => {
            let name = path.display().to_string();
            let text = std::fs::read_to_string(path)
                .map_err(|e| CurveError::Unreadable { name: name.clone(), reason: e.to_string() })?;
            let curve = Curve::parse(&text, &name)?;
            plausible(kind, &curve, &name)?;
            curve
        }
    };
    Ok(if kind == Kind::Extinction { curve.held() } else { curve })
}

/// Refuse wavelengths that are not in nanometres and values that a curve of this kind cannot have.
fn plausible(kind: Kind, curve: &Curve, name: &str) -> Result<(), CurveError> {
    let fault = |reason: String| Err(CurveError::Unreadable { name: name.to_owned(), reason });
    let (what, most) = match kind {
        Kind::Extinction => ("an extinction must lie in 0..20 mag/airmass", 20.0),
        Kind::Filter => ("a transmission must lie in 0..1", 1.0),
        Kind::Qe => ("a quantum efficiency must lie in 0..1 e-/photon", 1.0),
    };
    for nm in curve.wavelengths() {
        let value = curve.at(*nm);
        if !(100.0..=30_000.0).contains(nm) {
            return fault(format!("wavelength {nm}: must lie in 100..30000 nm"));
        }
        if !(0.0..=most).contains(&value) {
            return fault(format!("{value} at {nm} nm: {what}"));
        }
    }
    Ok(())
}

/// Solar spectrum above the atmosphere at 1 au \[W m^-2 nm^-1\], ASTM E490-00a.
pub fn sun() -> Curve {
    built_in(table!("spectra/solar_astm_e490"), "solar_astm_e490")
}

/// Vega above the atmosphere \[W m^-2 nm^-1\], CALSPEC alpha_lyr_stis_011.
pub fn vega() -> Curve {
    built_in(table!("spectra/vega_calspec"), "vega_calspec")
}

/// Johnson V, relative response (Bessell 1990, PASP 102, 1181).
pub fn johnson_v() -> Curve {
    built_in(table!("passbands/V"), "V")
}

/// Zenith airglow \[W m^-2 m^-1 sr^-1\], the table of Krag 2003.
pub fn airglow() -> Curve {
    built_in(table!("airglow/zenith_krag"), "zenith_krag")
}

/// A built-in table; the tests read every one of them.
fn built_in(text: &str, name: &str) -> Curve {
    Curve::parse(text, name).unwrap_or_else(|_| Curve::constant(0.0))
}

/// Luminous efficiency of the eye, 2 degrees, relative to its peak: CIE 170-2:2015 (the functions of 2008).
pub fn luminous_efficiency() -> Curve {
    built_in(table!("passbands/cie2008"), "cie2008")
}

/// A built-in passband by name, `B`, `V`, `R`, `I` or `G`; one without light for another name.
pub fn passband(name: &str) -> Curve {
    let found = FILTER.iter().find(|(known, _)| *known == name);
    found.map_or_else(|| Curve::constant(0.0), |(name, text)| built_in(text, name))
}

/// Photon-weighted integral of a spectrum through a passband, up to a constant factor.
fn photons(spectrum: &Curve, band: &Curve) -> f64 {
    super::curve::quadrature(&[spectrum, band]).iter().map(|(x, w)| w * x * spectrum.at(*x) * band.at(*x)).sum()
}

/// Magnitude of a spectrum \[W m^-2 nm^-1\] in `band`, where Vega has the same magnitude in every band, +0.03.
pub fn magnitude(spectrum: &Curve, band: &Curve) -> f64 {
    VEGA_V_MAG - 2.5 * (photons(spectrum, band) / photons(&vega(), band)).log10()
}

/// Johnson V magnitude of a spectrum \[W m^-2 nm^-1\].
pub fn magnitude_v(spectrum: &Curve) -> f64 {
    magnitude(spectrum, &johnson_v())
}

/// The solar spectrum scaled to V = 0 \[W m^-2 nm^-1\]: the spectrum behind every `mag_v`.
pub fn solar_of_v_zero() -> Curve {
    let sun = sun();
    let factor = flux_from_mag(-magnitude_v(&sun));
    sun.scaled(factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_table_is_whole() {
        for (kind, list) in [(Kind::Extinction, &EXTINCTION[..]), (Kind::Filter, &FILTER[..]), (Kind::Qe, &QE[..])]
        {
            for (name, _) in list {
                let c = curve(kind, &Table::Named((*name).to_owned())).expect(name);
                assert!(c.wavelengths().len() > 5 && c.at(600.0) >= 0.0, "{name}");
            }
        }
        for c in [sun(), vega(), johnson_v(), airglow()] {
            assert!(c.at(550.0) > 0.0);
        }
    }

    /// Willmer 2018, ApJS 236, 47: V of the Sun -26.76; E490 through Bessell's V against CALSPEC gives -26.746.
    #[test]
    fn the_sun_has_its_magnitude() {
        assert!((magnitude_v(&sun()) + 26.746).abs() < 0.003, "{}", magnitude_v(&sun()));
        assert!((magnitude_v(&vega()) - 0.03).abs() < 1e-12);
        assert!(magnitude_v(&solar_of_v_zero()).abs() < 1e-12);
    }

    #[test]
    fn unknown_names_and_files_are_told() {
        assert!(curve(Kind::Qe, &Table::Named("kaf".into())).is_err());
        assert!(curve(Kind::Qe, &Table::File("/nowhere/qe.csv".into())).is_err());
    }
}
