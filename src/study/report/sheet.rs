//! Tables of a run: their cells as they were written, and the numbers in them.

use super::html::escaped;
use crate::io::ecsv_read::{is_ecsv, parse_csv, parse_ecsv};
use serde_json::{Value as Json, json};
use std::path::Path;

/// Columns that are texts even where they look like numbers: an object may be called 25544, or Inf.
pub(super) const TEXTS: [&str; 7] =
    ["target", "time_utc", "observable", "why", "approximation", "setting", "unit"];

/// A table that was read.
#[derive(Debug, Clone, Default)]
pub(super) struct Sheet {
    /// Names of the columns.
    pub names: Vec<String>,
    /// Their units; empty for none.
    pub units: Vec<String>,
    /// Metadata.
    pub meta: Vec<(String, Json)>,
    /// Cells by rows.
    pub rows: Vec<Vec<String>>,
}

impl Sheet {
    /// The table of a file; none if there is no such file.
    ///
    /// # Errors
    /// What is wrong with the file, and in which line.
    pub fn read(dir: &Path, name: &str) -> Result<Option<Self>, String> {
        let bytes = match std::fs::read(dir.join(name)) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(format!("{name} is left out: {e}")),
        };
        let text = String::from_utf8_lossy(&bytes);
        let read = if is_ecsv(&text) { parse_ecsv(&text) } else { parse_csv(&text) };
        let table = read.map_err(|f| {
            let value = f.value.chars().take(60).collect::<String>();
            format!("{name} is left out: line {} holds {value:?}, expected {}", f.line, f.allowed)
        })?;
        Ok(Some(Self {
            names: table.columns.iter().map(|c| c.name.clone()).collect(),
            units: table.columns.into_iter().map(|c| c.unit).collect(),
            meta: table.meta,
            rows: table.rows.into_iter().map(|(_, cells)| cells).collect(),
        }))
    }

    /// Number of a column.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|own| own == name)
    }

    /// A cell; empty if there is none.
    pub fn cell(&self, row: usize, name: &str) -> &str {
        let cell = self.column(name).and_then(|k| self.rows.get(row)?.get(k));
        cell.map_or("", String::as_str)
    }

    /// The number in a cell; NaN if there is none.
    pub fn number(&self, row: usize, name: &str) -> f64 {
        self.cell(row, name).parse().unwrap_or(f64::NAN)
    }

    /// True if a cell says so.
    pub fn flag(&self, row: usize, name: &str) -> bool {
        matches!(self.cell(row, name), "True" | "true" | "1")
    }

    /// Rows chosen evenly, `most` of them at most.
    pub fn thinned(&self, most: usize) -> Self {
        let rows = evenly(self.rows.len(), most).into_iter().map(|k| self.rows[k].clone()).collect();
        Self { rows, ..self.clone() }
    }

    /// Columns as JSON: numbers where all cells are some, else texts; NaN is null.
    pub fn json(&self, names: &[&str]) -> Json {
        let mut object = serde_json::Map::new();
        for name in names.iter().filter(|name| self.column(name).is_some()) {
            let cells = || (0..self.rows.len()).map(|row| self.cell(row, name));
            let numbers = cells().map(|c| c.parse::<f64>().ok()).collect::<Option<Vec<_>>>();
            let values = match numbers {
                Some(numbers) if !TEXTS.contains(name) => json!(numbers),
                _ => json!(cells().collect::<Vec<_>>()),
            };
            object.insert((*name).to_owned(), values);
        }
        Json::Object(object)
    }

    /// The table as HTML: numbers short, whole in their `value`.
    pub fn html(&self, caption: &str, names: &[&str], most: usize) -> String {
        let shown = names.iter().filter_map(|n| Some((self.column(n)?, *n))).collect::<Vec<_>>();
        let mut out = format!(
            "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{0}\"><table><caption>{0}",
            escaped(caption)
        );
        if self.rows.len() > most {
            out += &format!(" ({most} of {} rows, evenly chosen)", self.rows.len());
        }
        out += "</caption><thead><tr>";
        for (k, name) in &shown {
            let unit = self.units.get(*k).filter(|u| !u.is_empty());
            let unit = unit.map_or_else(String::new, |u| format!(" <small>{}</small>", escaped(u)));
            out += &format!("<th scope=\"col\">{}{unit}</th>", escaped(name));
        }
        out += "</tr></thead><tbody>";
        for row in evenly(self.rows.len(), most) {
            out += "<tr>";
            for (k, name) in &shown {
                out += &super::html::cell(self.rows[row].get(*k).map_or("", String::as_str), name);
            }
            out += "</tr>";
        }
        out + "</tbody></table></div>"
    }
}

/// Numbers of `most` of `count` things at most, evenly chosen, the first and the last among them.
pub(super) fn evenly(count: usize, most: usize) -> Vec<usize> {
    match most {
        0 => Vec::new(),
        _ if count <= most => (0..count).collect(),
        1 => vec![0],
        _ => (0..most).map(|k| k * (count - 1) / (most - 1)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_choices_keep_both_ends_and_repeat_nothing() {
        for (count, most) in [(0, 12), (1, 12), (12, 12), (13, 12), (200, 12), (1_000_000, 7), (5, 1), (5, 0)] {
            let chosen = evenly(count, most);
            assert_eq!(chosen.len(), count.min(most));
            assert!(chosen.windows(2).all(|w| w[0] < w[1]), "{chosen:?}");
            if most > 1 && count > 0 {
                assert_eq!((chosen[0], chosen[chosen.len() - 1]), (0, count - 1));
            }
        }
    }

    #[test]
    fn tables_keep_cells_and_escape_names() {
        let sheet = Sheet {
            names: vec!["<b>".into(), "mag_v".into()],
            units: vec![String::new(), "mag".into()],
            meta: Vec::new(),
            rows: vec![vec!["<script>".into(), "11.793044564109222".into()], vec!["é".into(), "nan".into()]],
        };
        let html = sheet.html("a & b", &["<b>", "mag_v"], 9);
        assert!(html.contains("&lt;script&gt;") && html.contains("a &amp; b") && !html.contains("<b>"));
        assert!(html.contains("<data value=\"11.793044564109222\">11.793</data>"), "{html}");
        assert_eq!(sheet.json(&["mag_v", "none"]).to_string(), "{\"mag_v\":[11.793044564109222,null]}");
    }
}
