//! The detector's steps, in the order in which charge meets them, one file each.

pub mod convert;
pub mod dark;
pub mod read_noise;
pub mod shot;
pub mod well;

use crate::base::ledger::{Row, Verdict, Why};
use crate::scene::Scene;

/// The ledger's rows of the detector for an exposure whose brightest mean is `peak_e` \[e-/px\].
pub fn assess(scene: &Scene, exposure_s: f64, peak_e: f64) -> Vec<Row> {
    let d = &scene.detector;
    let needed = |bound: f64| Verdict::Needed { bound };
    let asked = |setting: f64| if setting == 0.0 { Verdict::Absent(Why::NotAsked) } else { needed(setting) };
    let dark_e = dark::rate(d) * exposure_s;
    let full_well = if peak_e + 10.0 * peak_e.sqrt() + 10.0 < d.full_well_e {
        Verdict::Absent(Why::NotVisible(format!(
            "brightest mean at most {peak_e:.0} e-/px, full well {} e-",
            d.full_well_e
        )))
    } else {
        needed(peak_e)
    };
    let mut dark = Row::new("detector.dark", &asked(dark_e), "Poisson, doubling with temperature");
    dark.mean_e_px = dark_e;
    let mut rows = vec![
        Row::new(
            "detector.shot",
            &needed(peak_e),
            "one exact Poisson draw of the summed mean (its time holds all steps of the detector)",
        ),
        dark,
        Row::new("detector.full_well", &full_well, "clipped; the excess is lost"),
        Row::new("detector.read_noise", &asked(d.read_noise_e), "Gaussian, one draw a pixel"),
        Row::new("detector.convert", &needed(d.gain_e_per_adu), "gain, bias, rounding, clipping"),
    ];
    for name in ["prnu", "dsnu", "cosmic_rays", "blooming", "cti", "nonlinearity", "overscan"] {
        rows.push(Row::new(&format!("detector.{name}"), &Verdict::Absent(Why::NotAsked), ""));
    }
    rows
}
