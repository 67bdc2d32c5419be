//! Rows of a study, as a table and back.

use super::sweep::Sweep;
use crate::base::table::{Table, Values};
use crate::io::ecsv_read::parse_ecsv;
use serde_json::Value as Json;

/// Numbers of a row: column and unit. Those of the contract come first.
pub const COLUMNS: [(&str, &str); 34] = [
    ("mag_v", "mag"),
    ("snr", ""),
    ("snr_mc", ""),
    ("signal_e", "electron"),
    ("sky_e_px", "electron / pix"),
    ("dark_e_px", "electron / pix"),
    ("read_noise_e", "electron"),
    ("n_px", "pix"),
    ("limiting_mag_v", "mag"),
    ("snr_all", ""),
    ("snr_mc_err", ""),
    ("peak_e", "electron"),
    ("aperture_px", "pix"),
    ("n_background_px", "pix"),
    ("stars_e_px", "electron / pix"),
    ("airglow_e_px", "electron / pix"),
    ("pollution_e_px", "electron / pix"),
    ("twilight_e_px", "electron / pix"),
    ("starlight_e_px", "electron / pix"),
    ("moonlight_e_px", "electron / pix"),
    ("zodiacal_e_px", "electron / pix"),
    ("var_target_e2", "electron2"),
    ("var_sky_e2", "electron2"),
    ("var_stars_e2", "electron2"),
    ("var_dark_e2", "electron2"),
    ("var_read_e2", "electron2"),
    ("var_rounding_e2", "electron2"),
    ("var_background_e2", "electron2"),
    ("var_scintillation_e2", "electron2"),
    ("var_flat_e2", "electron2"),
    ("exposure_wanted_s", "s"),
    ("exposure_best_s", "s"),
    ("snr_hour", ""),
    ("saturation_s", "s"),
];

/// Columns of the variances in one frame, in the order of the model's terms.
pub const VARIANCES: [&str; 7] = [
    "var_target_e2",
    "var_sky_e2",
    "var_stars_e2",
    "var_dark_e2",
    "var_read_e2",
    "var_rounding_e2",
    "var_background_e2",
];

/// Column of a source of the sky by its name in the ledger.
pub fn sky_column(name: &str) -> Option<&'static str> {
    let own = name.strip_prefix("sky.")?;
    COLUMNS.iter().map(|(column, _)| *column).find(|column| column.strip_suffix("_e_px") == Some(own))
}

/// A point of a study and what came of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Values of the sweeps, in their order.
    pub values: Vec<f64>,
    pub(super) numbers: [f64; COLUMNS.len()],
    /// Whether the mean of a pixel reaches saturation.
    pub saturated: bool,
    /// Whether the trials agree with the model; empty without trials.
    pub agreement: String,
    /// Why there is no SNR; empty if there is one.
    pub why: String,
}

impl Default for Row {
    fn default() -> Self {
        Self {
            values: Vec::new(),
            numbers: [f64::NAN; COLUMNS.len()],
            saturated: false,
            agreement: String::new(),
            why: String::new(),
        }
    }
}

fn place(column: &str) -> Option<usize> {
    COLUMNS.iter().position(|(name, _)| *name == column)
}

impl Row {
    /// The number of a column; NaN if there is none.
    pub fn get(&self, column: &str) -> f64 {
        place(column).and_then(|k| self.numbers.get(k)).copied().unwrap_or(f64::NAN)
    }

    /// Sets the number of a column.
    pub fn set(&mut self, column: &str, value: f64) {
        if let Some(number) = place(column).and_then(|k| self.numbers.get_mut(k)) {
            *number = value;
        }
    }
}

/// The rows as a table: the swept keys, then [`COLUMNS`], then words. A swept `mag_v` is there once.
pub fn table(sweeps: &[Sweep], rows: &[Row]) -> Table {
    let mut table = Table::default();
    let swept = |name: &str| sweeps.iter().any(|sweep| sweep.key.name() == name);
    for (k, sweep) in sweeps.iter().enumerate() {
        let values = rows.iter().map(|row| row.values.get(k).copied().unwrap_or(f64::NAN));
        table.floats(sweep.key.name().to_owned(), sweep.key.unit(), values);
    }
    for (k, (name, unit)) in COLUMNS.iter().enumerate().filter(|(_, (name, _))| !swept(name)) {
        table.floats(*name, unit, rows.iter().map(|row| row.numbers[k]));
    }
    table.column("saturated", "", Values::Bool(rows.iter().map(|row| row.saturated).collect()));
    table.texts("agreement", rows.iter().map(|row| row.agreement.clone()));
    table.texts("why", rows.iter().map(|row| row.why.clone()));
    table
}

/// The rows in an ECSV text whose metadata are these; none if it is another study's, or no table of one.
pub fn rows_of(text: &str, sweeps: &[Sweep], meta: &[(String, Json)]) -> Option<Vec<Row>> {
    let found = parse_ecsv(text).ok()?;
    let same = |(key, value): &(String, Json)| found.meta.iter().any(|(k, v)| k == key && v == value);
    if !meta.iter().all(same) {
        return None;
    }
    let column = |name: &str| found.columns.iter().position(|c| c.name == name);
    let number = |cells: &[String], name: &str| cells.get(column(name)?)?.parse::<f64>().ok();
    let word = |cells: &[String], name: &str| Some(cells.get(column(name)?)?.clone());
    let row = |(_, cells): &(usize, Vec<String>)| {
        let mut row = Row::default();
        for sweep in sweeps {
            row.values.push(number(cells, sweep.key.name())?);
        }
        for (k, (name, _)) in COLUMNS.iter().enumerate() {
            row.numbers[k] = number(cells, name)?;
        }
        row.saturated = word(cells, "saturated")? == "True";
        (row.agreement, row.why) = (word(cells, "agreement")?, word(cells, "why")?);
        Some(row)
    };
    found.rows.iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::ecsv::to_ecsv;
    use crate::study::snr::sweep::parse_all;

    #[test]
    fn rows_come_back_from_their_file_to_the_last_bit() {
        let sweeps = parse_all(&["exposures.duration_s=0.1,3".into(), "mag_v=10,11".into()]).expect("good");
        let mut row = Row { values: vec![0.1, 10.0], why: "no \"light\", none".into(), ..Row::default() };
        row.set("mag_v", 10.0);
        row.set("snr", 0.1 + 0.2);
        row.saturated = true;
        let rows = vec![row.clone(), Row { values: vec![3.0, 11.0], agreement: "agrees".into(), ..row }];
        let mut first = table(&sweeps, &rows);
        first.note("sweep", "a");
        let text = to_ecsv(&first);
        let back = rows_of(&text, &sweeps, &first.meta).expect("the same study");
        assert_eq!(to_ecsv(&Table { meta: first.meta.clone(), ..table(&sweeps, &back) }), text);
        assert_eq!(rows_of(&text, &sweeps, &[("sweep".into(), "b".into())]), None);
        assert_eq!(rows_of("rubbish", &sweeps, &[]), None);
    }

    #[test]
    fn every_source_of_the_sky_has_a_column() {
        for name in crate::study::sky::NAMES {
            assert!(sky_column(&format!("sky.{name}")).is_some(), "{name}");
        }
        assert_eq!(sky_column("sky.peak"), None);
    }
}
