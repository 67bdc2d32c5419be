//! Tables as ECSV 1.0 (Astropy Proposal for Enhancement 6), readable by astropy unhelped.
//!
//! Numbers are the shortest that read back the same; NaN is `nan`.

pub use crate::base::table::{Column, Table, Values};

use std::fmt::Write;

/// The table as ECSV.
pub fn to_ecsv(table: &Table) -> String {
    let mut text = String::from("# %ECSV 1.0\n# ---\n# datatype:\n");
    for Column { name, unit, values } in &table.columns {
        let unit = if unit.is_empty() { String::new() } else { format!("unit: {unit}, ") };
        let _ = writeln!(text, "# - {{name: {name}, {unit}datatype: {}}}", datatype(values));
    }
    if !table.meta.is_empty() {
        text.push_str("# meta: !!omap\n");
    }
    for (key, value) in &table.meta {
        let _ = writeln!(text, "# - {{{key}: {}}}", value);
    }
    text.push_str("# schema: astropy-2.0\n");
    let names = table.columns.iter().map(|c| &*c.name).collect::<Vec<_>>();
    text.push_str(&names.join(" "));
    text.push('\n');
    for row in 0..table.rows() {
        let cells = table.columns.iter().map(|c| cell(&c.values, row)).collect::<Vec<_>>();
        text.push_str(&cells.join(" "));
        text.push('\n');
    }
    text
}

fn datatype(values: &Values) -> &'static str {
    match values {
        Values::Float(_) => "float64",
        Values::Int(_) => "int64",
        Values::Text(_) => "string",
        Values::Bool(_) => "bool",
    }
}

fn cell(values: &Values, row: usize) -> String {
    match values {
        Values::Float(v) if v[row].is_nan() => "nan".to_owned(),
        Values::Float(v) => format!("{:?}", v[row]),
        Values::Int(v) => v[row].to_string(),
        Values::Bool(v) => if v[row] { "True" } else { "False" }.to_owned(),
        Values::Text(v) if v[row].is_empty() || v[row].contains([' ', '"', '\n', '\t', '#', '\'', ',']) => {
            format!("\"{}\"", v[row].replace('"', "\"\"").replace(['\n', '\t'], " "))
        }
        Values::Text(v) => v[row].clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_in_both_forms() {
        let mut table = Table::default();
        table.note("origin", "measured");
        table.floats("flux_e", "electron", [0.1, f64::NAN].into_iter());
        table.texts("target", ["GOES 14".to_owned(), String::new()].into_iter());
        let text = to_ecsv(&table);
        assert!(text.contains("# - {name: flux_e, unit: electron, datatype: float64}\n"));
        assert!(text.ends_with("flux_e target\n0.1 \"GOES 14\"\nnan \"\"\n"));
        assert_eq!(
            table.to_json_rows().to_string(),
            r#"[{"flux_e":0.1,"target":"GOES 14"},{"flux_e":null,"target":""}]"#
        );
    }
}
