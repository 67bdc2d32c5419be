//! Reading tables: ECSV 1.0 (Astropy Proposal for Enhancement 6) and CSV with one line of names.
//!
//! Cells stay text: who reads a column knows what it means. A cell may be in double quotes, inside which two of them
//! are one; a cell over several lines is refused. Blanks that delimit may be any number.

use super::yaml;
use serde_json::Value as Json;

/// A column of a table that was read.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TextColumn {
    /// Name.
    pub name: String,
    /// Unit, as the file spells it; empty if it has none.
    pub unit: String,
}

/// A table that was read.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct TextTable {
    /// Metadata in the file's order.
    pub meta: Vec<(String, Json)>,
    /// The columns.
    pub columns: Vec<TextColumn>,
    /// Number of the line, from 1, and the cells of each row: as many as there are columns.
    pub rows: Vec<(usize, Vec<String>)>,
}

/// What is wrong in a line, from 1.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TableFault {
    /// Number of the line.
    pub line: usize,
    /// What is there.
    pub value: String,
    /// What is allowed there.
    pub allowed: String,
}

fn fault<T>(line: usize, value: &str, allowed: impl Into<String>) -> Result<T, TableFault> {
    Err(TableFault { line, value: value.to_owned(), allowed: allowed.into() })
}

/// Whether a text is ECSV.
pub(crate) fn is_ecsv(text: &str) -> bool {
    text.starts_with("# %ECSV")
}

/// The table in an ECSV text.
pub(crate) fn parse_ecsv(text: &str) -> Result<TextTable, TableFault> {
    let header = text.lines().take_while(|l| l.starts_with('#')).collect::<Vec<_>>();
    if !header.first().is_some_and(|l| l.starts_with("# %ECSV 1.") || *l == "# %ECSV 0.9") {
        return fault(1, header.first().copied().unwrap_or(""), "# %ECSV 1.0");
    }
    let yaml_lines = header.iter().skip(1).map(|l| l.strip_prefix("# ").unwrap_or(&l[1..])).collect::<Vec<_>>();
    let document = match yaml::parse(&yaml_lines) {
        Ok(document) => document,
        // the first line is not YAML, and lines count from 1
        Err((line, why)) => return fault(line + 2, yaml_lines.get(line).copied().unwrap_or(""), why),
    };
    let delimiter = match document.get("delimiter").and_then(Json::as_str) {
        None | Some(" ") => ' ',
        Some(",") => ',',
        Some(other) => return fault(2, other, "delimiter: ' ' or ','"),
    };
    let declared = document.get("datatype").and_then(Json::as_array);
    let Some(columns) = declared.and_then(|list| list.iter().map(column).collect::<Option<Vec<_>>>()) else {
        return fault(2, "datatype", "a list of columns {name: ..., datatype: ...}");
    };
    let meta = match document.get("meta") {
        Some(Json::Array(pairs)) => pairs.iter().filter_map(Json::as_object).flatten().collect::<Vec<_>>(),
        Some(Json::Object(map)) => map.iter().collect(),
        _ => Vec::new(),
    };
    let meta = meta.into_iter().map(|(k, v)| (k.clone(), v.clone())).collect();
    let (names, rows) = body(text, header.len(), delimiter)?;
    if names != columns.iter().map(|c| c.name.as_str()).collect::<Vec<_>>() {
        return fault(header.len() + 1, &names.join(" "), "the names of the header, in its order");
    }
    Ok(TextTable { meta, columns, rows })
}

fn column(declared: &Json) -> Option<TextColumn> {
    let text = |key| declared.get(key).map(|v| v.as_str().map_or_else(|| v.to_string(), str::to_owned));
    Some(TextColumn { name: text("name")?, unit: text("unit").unwrap_or_default() })
}

/// The table in a CSV text whose first line, comments (`#`) apart, has the names; its columns have no units.
pub(crate) fn parse_csv(text: &str) -> Result<TextTable, TableFault> {
    let (names, rows) = body(text, 0, ',')?;
    let columns = names.into_iter().map(|name| TextColumn { name, unit: String::new() }).collect();
    Ok(TextTable { meta: Vec::new(), columns, rows })
}

type Body = (Vec<String>, Vec<(usize, Vec<String>)>);

/// Names and rows after the first `skip` lines.
fn body(text: &str, skip: usize, delimiter: char) -> Result<Body, TableFault> {
    let lines = text.lines().enumerate().skip(skip).map(|(k, l)| (k + 1, l));
    let mut lines = lines.filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
    let Some((number, first)) = lines.next() else {
        return fault(text.lines().count().max(1), "", "a line with the names of the columns");
    };
    let names = split(first.trim_start_matches('\u{feff}'), number, delimiter)?;
    if let Some(twice) = names.iter().enumerate().find(|(k, n)| names[..*k].contains(n)) {
        return fault(number, twice.1, "each name once");
    }
    let mut rows = Vec::new();
    for (number, line) in lines {
        let cells = split(line, number, delimiter)?;
        if cells.len() != names.len() {
            return fault(number, line, format!("{} cells, here are {}", names.len(), cells.len()));
        }
        rows.push((number, cells));
    }
    Ok((names, rows))
}

/// The cells of a line.
fn split(line: &str, number: usize, delimiter: char) -> Result<Vec<String>, TableFault> {
    let mut cells = Vec::new();
    let mut rest = line.trim_end_matches('\r');
    loop {
        rest = rest.trim_start_matches(' ');
        let after = if let Some(inside) = rest.strip_prefix('"') {
            let (cell, after) = unquote(inside).map_or_else(|| fault(number, rest, "a closed quotation"), Ok)?;
            cells.push(cell);
            after
        } else {
            let (cell, after) = rest.split_at(rest.find(delimiter).unwrap_or(rest.len()));
            cells.push(cell.trim_end().to_owned());
            after
        };
        // blanks at the end of a line delimit nothing
        let after = if delimiter == ' ' { after.trim_end() } else { after.trim_start_matches(' ') };
        match after.strip_prefix(delimiter) {
            Some(next) => rest = next,
            None if after.is_empty() => return Ok(cells),
            None => return fault(number, after, format!("{delimiter:?} after a quotation")),
        }
    }
}

/// The text up to the closing quotation mark, and what follows.
fn unquote(inside: &str) -> Option<(String, &str)> {
    let mut cell = String::new();
    let mut rest = inside;
    loop {
        let (part, after) = rest.split_once('"')?;
        cell.push_str(part);
        match after.strip_prefix('"') {
            Some(more) => {
                cell.push('"');
                rest = more;
            }
            None => return Some((cell, after)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::ecsv::{Table, to_ecsv};

    #[test]
    fn what_this_project_writes_reads_back() {
        let mut table = Table::default();
        table.note("origin", "a \"measured\": # one\nof two, é");
        table.note("attitude", serde_json::json!({"mode": "spin", "axis": [0.0, 1.5, null], "on": true}));
        table.floats("flux_e", "electron / pix", [0.1, f64::NAN, -1e-300].into_iter());
        let names = ["GOES 14", "", "a \"b\", c"];
        table.texts("target", names.iter().map(|n| (*n).to_owned()));
        let read = parse_ecsv(&to_ecsv(&table)).unwrap();
        assert_eq!(read.meta, table.meta);
        assert_eq!(read.columns[0].unit, "electron / pix");
        let cells = |k: usize| read.rows.iter().map(|(_, c)| c[k].as_str()).collect::<Vec<_>>();
        assert_eq!((cells(0), cells(1)), (vec!["0.1", "nan", "-1e-300"], names.to_vec()));
    }

    #[test]
    fn cells_with_quotes_and_blanks() {
        let cells = |line, delimiter| split(line, 1, delimiter).unwrap();
        assert_eq!(cells("a,\"b, \"\"c\"\"\" ,, d e ,", ','), ["a", "b, \"c\"", "", "d e", ""]);
        assert_eq!(cells("  a   \"b c\" \"\"  d  ", ' '), ["a", "b c", "", "d"]);
        assert_eq!(split("a \"b", 7, ' ').unwrap_err().line, 7);
        assert!(split("\"a\"b,c", 1, ',').is_err());
    }

    #[test]
    fn what_is_no_table_is_refused_with_its_line() {
        let head = "# %ECSV 1.0\n# ---\n# datatype:\n# - {name: a, datatype: int64}\n";
        let cases = [
            ("# %FITS", 1),
            ("# %ECSV 1.0\n# ---\n# datatype: [", 3),
            ("# %ECSV 1.0\n# ---\n# datatype: 7\na\n", 2),
            ("# %ECSV 1.0\n# delimiter: ';'\n# datatype: []\n", 2),
            (&format!("{head}b\n1\n"), 5),
            (&format!("{head}a\n1 2\n"), 6),
            (&format!("{head}a\n\n1\n\"2\n"), 8),
            (head, 4),
        ];
        for (text, line) in cases {
            assert_eq!(parse_ecsv(text).unwrap_err().line, line, "{text}");
        }
        assert_eq!(parse_csv("a,a\n").unwrap_err().line, 1);
        assert!(parse_csv("").is_err());
    }
}
