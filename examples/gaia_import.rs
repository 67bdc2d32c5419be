//! How do the stars of Gaia come into a frame? A table with the columns of the Gaia archive becomes a catalogue, a scene names it, and the frame has
//! its stars.
//!
//! `cargo run --release --example gaia_import [GAIA.csv RA_DEG DEC_DEG]`
//!
//! From the archive: `SELECT ra, dec, pmra, pmdec, ref_epoch, phot_g_mean_mag, phot_bp_mean_mag, phot_rp_mean_mag FROM gaiadr3.gaia_source WHERE
//! DISTANCE(ra, dec, 60.0, 50.0) < 1 AND phot_g_mean_mag < 17`. Without a table the program writes one in this form, of the built-in catalogue's stars.
//! On the command line: `nightglass catalog import GAIA.csv -o gaia.cat`, then `[stars] catalog = "gaia.cat"`.

use nightglass::astro::{angles, direction};
use nightglass::scene::{Options, load};
use nightglass::stars::catalogue::Catalogue;
use nightglass::stars::columns::Choice;
use nightglass::stars::import::{Request, import};
use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    let own = std::env::args().skip(1).collect::<Vec<_>>();
    match own.as_slice() {
        [file, ra, dec] => run(Some(Path::new(file)), [ra.parse()?, dec.parse()?]),
        _ => run(None, [60.0, 50.0]),
    }
}

/// A frame of the stars in a table, about a place.
pub fn run(table: Option<&Path>, [ra_deg, dec_deg]: [f64; 2]) -> Result<(), Box<dyn Error>> {
    let folder = std::env::temp_dir().join(format!("nightglass-gaia-{}", std::process::id()));
    std::fs::create_dir_all(&folder)?;
    let table = match table {
        Some(path) => path.to_owned(),
        None => made_up(&folder, ra_deg, dec_deg)?,
    };
    let request = Request {
        file: table,
        name: Some("gaia".into()),
        choice: Choice::default(),
        epoch: None,
        complete_to: None,
        supplement: None,
    };
    let made = import(&request)?;
    made.notes.iter().for_each(|note| println!("{note}"));
    let file = folder.join("gaia.cat");
    std::fs::write(&file, &made.bytes)?;
    println!("{} stars of epoch J{} in {} bytes", made.stars, made.epoch, made.bytes.len());
    let sets = [
        ("stars.catalog", file.display().to_string()),
        ("stars.synthetic", "false".into()),
        ("pointing", format!("{{ at = \"radec\", ra_deg = {ra_deg:?}, dec_deg = {dec_deg:?} }}")),
        ("exposures.track", "sidereal".into()),
        ("exposures.count", "1".into()),
        ("detector.size_px", "1024".into()),
        ("telescope.plate_scale_arcsec", "2.0".into()),
    ];
    let sets = sets.map(|(key, value)| (key.to_owned(), value));
    let scene = load("pogs-geo", &Options { sets: &sets, seed: None })?;
    let frame = nightglass::simulate(&scene)?.next().ok_or("the scene has no exposure")??;
    for row in frame.ledger.iter().filter(|row| row.name.starts_with("stars")) {
        println!("{:20} {:7} {}", row.name, row.verdict, row.why);
    }
    let brightest = frame.adu.iter().max().copied().unwrap_or_default();
    println!("brightest pixel {brightest} adu");
    Ok(std::fs::remove_dir_all(&folder)?)
}

/// The built-in catalogue's stars within a degree as the Gaia archive would give them. G follows from V at BP - RP = 0.8 (Gaia EDR3
/// documentation, table 5.9: G - V = -0.02704 + 0.01424 x - 0.2156 x^2 + 0.01426 x^3).
fn made_up(folder: &Path, ra_deg: f64, dec_deg: f64) -> Result<PathBuf, Box<dyn Error>> {
    let colour: f64 = 0.8;
    let g_v = -0.02704 + colour * (0.01424 + colour * (-0.2156 + colour * 0.01426));
    let centre = direction(ra_deg.to_radians(), dec_deg.to_radians());
    let mut text = "ra,dec,pmra,pmdec,ref_epoch,phot_g_mean_mag,phot_bp_mean_mag,phot_rp_mean_mag\n".to_owned();
    for star in Catalogue::built_in().cone(centre, 1f64.to_radians(), 20.0) {
        let (ra, dec) = angles(star.direction);
        let g = star.mag_v + g_v;
        let (bp, rp) = (g + 0.4 * colour, g - 0.6 * colour);
        let (ra, dec) = (ra.to_degrees(), dec.to_degrees());
        writeln!(text, "{ra:.7},{dec:.7},0.0,0.0,2016.0,{g:.4},{bp:.4},{rp:.4}")?;
    }
    let path = folder.join("gaia.csv");
    std::fs::write(&path, text)?;
    Ok(path)
}
