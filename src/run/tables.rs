//! Tables and the ledger of a run.

use super::{OutputDir, RunError};
use crate::base::ledger::{Ledger, Row};
use crate::base::table::Table;
use crate::io::atomic;
use crate::io::ecsv::to_ecsv;
use serde_json::{Value as Json, json};

/// Write a table into the directory.
///
/// # Errors
/// Whatever the file system says.
pub fn write(dir: &OutputDir, name: &str, table: &Table) -> Result<(), RunError> {
    Ok(atomic::write(&dir.file(name), to_ecsv(table).as_bytes())?)
}

/// One row of the ledger as JSON; an unknown bound is null.
pub fn ledger_row(row: &Row) -> Json {
    json!({
        "name": row.name, "verdict": row.verdict, "why": row.why,
        "bound": finite(row.bound), "mean_e_px": finite(row.mean_e_px),
        "gradient": finite(row.gradient), "uncertainty": finite(row.uncertainty), "ms": finite(row.ms), "bytes": row.bytes,
    })
}

fn finite(value: f64) -> Json {
    serde_json::Number::from_f64(value).map_or(Json::Null, Json::Number)
}

/// Write `ledger.json`.
///
/// # Errors
/// Whatever the file system says.
pub fn write_ledger(dir: &OutputDir, ledger: &Ledger, frames: &[usize]) -> Result<(), RunError> {
    let rows = ledger.rows().map(ledger_row).collect::<Vec<_>>();
    let whole = json!({ "command": "render", "frames": frames.len(), "rows": rows });
    Ok(atomic::write(&dir.file("ledger.json"), format!("{whole:#}\n").as_bytes())?)
}
