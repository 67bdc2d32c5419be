//! The detector's steps, in the order in which charge meets them, one file each.

pub mod bias;
pub mod convert;
pub mod cosmic_rays;
pub mod cte;
pub mod dark;
pub mod nonlinearity;
pub mod pattern;
pub mod prnu;
pub mod read_noise;
pub mod shot;
pub mod shutter;
pub mod smear;
pub mod well;

use crate::base::ledger::{Row, Verdict, Why};
use crate::scene::{Chip, Scene};

/// The ledger's rows of the detector for an exposure whose brightest mean is `peak_e` \[e-/px\].
pub fn assess(scene: &Scene, exposure_s: f64, peak_e: f64) -> Vec<Row> {
    let d = &scene.detector;
    let ccd = d.kind == Chip::Ccd;
    let row = |name: &str, setting: f64, basis: String| {
        let verdict =
            if setting == 0.0 { Verdict::Absent(Why::NotAsked) } else { Verdict::Needed { bound: setting } };
        Row::new(&format!("detector.{name}"), &verdict, &basis)
    };
    let only = |yes: bool, setting: f64| if yes { setting } else { 0.0 };
    let full_well_e = d.stored_full_well_e();
    let dark_e = dark::Dark::new(d, exposure_s).mean_e();
    let full_well = if peak_e + 10.0 * peak_e.sqrt() + 10.0 < full_well_e {
        Verdict::Absent(Why::NotVisible(format!(
            "brightest mean at most {peak_e:.0} e-/px, full well {full_well_e} e-"
        )))
    } else {
        Verdict::Needed { bound: peak_e }
    };
    let kept = if d.blooming { "the excess runs along its column" } else { "clipped; the excess is lost" };
    let full_well = Row::new("detector.full_well", &full_well, kept);
    let rays = cosmic_rays::expected(d, exposure_s);
    let iris = only(ccd, shutter::iris_loss(d.shutter_s, exposure_s));
    let rolling = only(!ccd, d.shutter_s);
    let mut dark = row("dark", dark_e, "Poisson, doubling with temperature".into());
    dark.mean_e_px = dark_e;
    vec![
        row(
            "shutter",
            iris + rolling,
            match d.kind {
                Chip::Ccd => format!("an iris: the corners lose {:.3} % of the light", 100.0 * iris.min(1.0)),
                Chip::Cmos => format!("rolling: the last row opens {} s after the first", d.shutter_s),
            },
        ),
        row("prnu", d.prnu, "Gaussian, fixed by pattern_seed".into()),
        row("smear", only(ccd, d.frame_transfer_s), "each pixel passes under its column's light".into()),
        dark,
        row("dsnu", only(dark_e > 0.0, d.dsnu), "log-normal, fixed by pattern_seed".into()),
        row("hot_pixels", only(dark_e > 0.0, d.hot_pixel_fraction), "10 to 1000 times the dark current".into()),
        Row::new(
            "detector.shot",
            &Verdict::Needed { bound: peak_e },
            "one exact Poisson draw of the summed mean (its time holds all steps of the detector)",
        ),
        row("cosmic_rays", rays, format!("{rays:.1} straight tracks a frame")),
        full_well,
        row("blooming", only(d.blooming && ccd, 1.0), "columns that may be full are kept whole".into()),
        row("cti", only(ccd, d.cti), "binomial trails behind each packet, along columns and the register".into()),
        row("nonlinearity", d.nonlinearity, "quadratic, of the output".into()),
        row("read_noise", d.read_noise_e, "Gaussian, one draw a pixel".into()),
        row("bias_structure", d.bias_structure_adu, "columns and rows, fixed by pattern_seed".into()),
        row("overscan", d.overscan_px as f64, "columns without light".into()),
        row("convert", d.gain_e_per_adu, "gain, bias, rounding, clipping".into()),
    ]
}
