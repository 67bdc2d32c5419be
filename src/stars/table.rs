//! Tables of stars that a user brings: delimited text, ECSV, FITS binary tables.
//!
//! Text: lines starting with `#` are comments (of ECSV, and of VizieR's exports); the first other line has the names of
//! the columns. Cells are parted by tab, comma, semicolon or bar, whichever the names' line has most of, else by blanks;
//! they may stand in double quotes. Lines of units and of dashes below the names, as VizieR writes them, are told apart
//! by the dashes. A blank cell, NaN, null, None, NA or dashes mean "not known".

use super::error::CatalogueError;
use fitsy::hdu::{BinValue, Hdu};
use fitsy::{FitsError, FitsFile};
use std::path::Path;

/// Words for "not known", in lower case, besides blanks and dashes.
const UNKNOWN: [&str; 7] = ["nan", "null", "none", "na", "n/a", "masked", "\\n"];

/// A table whose rows are read on demand.
pub struct Table {
    path: String,
    /// Names of its columns.
    pub names: Vec<String>,
    /// Units of its columns, as the file spells them; blank: not told.
    pub units: Vec<String>,
    body: Body,
}

enum Body {
    /// The text, what parts its cells, and its first line with values.
    Text { text: String, delimiter: Option<char>, first: usize },
    /// The file and the number of the table in it.
    Fits { file: Box<FitsFile>, hdu: usize },
}

impl Table {
    /// The table in a file.
    ///
    /// # Errors
    /// [`CatalogueError`] if the file cannot be read or holds no table.
    pub fn open(path: &Path) -> Result<Self, CatalogueError> {
        let name = path.display().to_string();
        let bytes = super::error::read_file(path)?;
        let begins = |with: &[u8]| bytes.trim_ascii_start().starts_with(with);
        if bytes.starts_with(b"SIMPLE  =") {
            return Self::of_fits(name, bytes);
        }
        for (with, reason) in [
            (&b"\x1f\x8b"[..], "compressed; unpack it with gunzip"),
            (b"PK\x03\x04", "compressed; unpack it with unzip"),
            (b"<?xml", "XML; a VOTable is not read, export it as ECSV, CSV or FITS"),
            (b"<VOTABLE", "a VOTable is not read, export it as ECSV, CSV or FITS"),
        ] {
            if begins(with) {
                return Err(CatalogueError::Format { path: name, reason: reason.into() });
            }
        }
        Self::of_text(name, &bytes)
    }

    /// The table in a text.
    ///
    /// # Errors
    /// [`CatalogueError::Format`] if it has no line with names.
    pub fn of_text(path: String, bytes: &[u8]) -> Result<Self, CatalogueError> {
        let text = String::from_utf8_lossy(bytes).trim_start_matches('\u{feff}').to_owned();
        let filled = |line: &&str| !line.starts_with('#') && !line.trim().is_empty();
        let mut below = text.lines().enumerate().filter(|(_, line)| filled(line));
        let Some((at, heading)) = below.next() else {
            return Err(CatalogueError::Format { path, reason: "no line with the names of columns".into() });
        };
        let count = |c: &char| heading.matches(*c).count();
        let delimiter = ['\t', ',', ';', '|'].into_iter().max_by_key(count).filter(|c| count(c) > 0);
        let names = cells(heading, delimiter);
        let mut units = names.iter().map(|name| ecsv_unit(&text, name)).collect::<Vec<_>>();
        let two = [below.next(), below.next()];
        let ruled = |line: &str| {
            line.contains("--") && line.chars().all(|c| c == '-' || c.is_whitespace() || Some(c) == delimiter)
        };
        let first = match two.iter().position(|l| l.is_some_and(|(_, line)| ruled(line))) {
            Some(k) => {
                if let (1, Some((_, line))) = (k, two[0]) {
                    units.iter_mut().zip(cells(line, delimiter)).for_each(|(unit, told)| *unit = told);
                }
                two[k].map_or(at + 1, |(line, _)| line + 1)
            }
            None => at + 1,
        };
        Ok(Self { path, names, units, body: Body::Text { text, delimiter, first } })
    }

    /// The first binary table of a FITS file.
    ///
    /// # Errors
    /// [`CatalogueError::Format`] if it is damaged or has no such table.
    pub fn of_fits(path: String, bytes: Vec<u8>) -> Result<Self, CatalogueError> {
        let told = |e: FitsError| CatalogueError::Format { path: path.clone(), reason: e.to_string() };
        let file = FitsFile::from_bytes(bytes).map_err(told)?;
        for hdu in 0..file.len() {
            if let Hdu::BinTable(table) = file.hdu(hdu).map_err(told)? {
                let names = table.columns().iter().map(|c| c.name.clone()).collect();
                let units = table.columns().iter().map(|c| c.unit.clone()).collect();
                return Ok(Self { path, names, units, body: Body::Fits { file: Box::new(file), hdu } });
            }
        }
        Err(CatalogueError::Format { path, reason: "a FITS file without a binary table".into() })
    }

    /// A fault of this table.
    pub fn fault(&self, reason: String) -> CatalogueError {
        CatalogueError::Format { path: self.path.clone(), reason }
    }

    /// What a row is called in messages: "line 7" of a text, "row 7" of a FITS table.
    pub fn place(&self, row: usize) -> String {
        match self.body {
            Body::Text { .. } => format!("line {row}"),
            Body::Fits { .. } => format!("row {row}"),
        }
    }

    /// Call `each` with the number of every row and its values by column: of `columns`, NaN where not known.
    ///
    /// # Errors
    /// [`CatalogueError::Format`] at a row with other than the announced cells, or a cell that is no number.
    pub fn rows(&self, columns: &[usize], mut each: impl FnMut(usize, &[f64])) -> Result<(), CatalogueError> {
        let no_number = |row: usize, column: usize, found: &str| {
            let (place, name) = (self.place(row), &self.names[column]);
            self.fault(format!("{place}, column {name}: {found:?} is no number"))
        };
        let mut values = vec![f64::NAN; self.names.len()];
        match &self.body {
            Body::Text { text, delimiter, first } => {
                for (i, line) in text.lines().enumerate().skip(*first) {
                    if line.starts_with('#') || line.trim().is_empty() {
                        continue;
                    }
                    let found = cells(line, *delimiter);
                    let spare = found.len() == self.names.len() + 1 && found[found.len() - 1].is_empty();
                    if found.len() != self.names.len() && !spare {
                        let (found, names) = (found.len(), self.names.len());
                        return Err(self.fault(format!("line {}: {found} cells under {names} names", i + 1)));
                    }
                    for column in columns {
                        let cell = &found[*column];
                        values[*column] = number(cell).ok_or_else(|| no_number(i + 1, *column, cell))?;
                    }
                    each(i + 1, &values);
                }
            }
            Body::Fits { file, hdu } => {
                let told = |e: FitsError| self.fault(e.to_string());
                let Hdu::BinTable(table) = file.hdu(*hdu).map_err(told)? else { return Ok(()) };
                for row in 0..table.n_rows() {
                    for column in columns {
                        let cell = table.cell_value(row, &table.columns()[*column]).map_err(told)?;
                        let found = || no_number(row + 1, *column, &format!("{cell:?}"));
                        values[*column] = fits_number(&cell).ok_or_else(found)?;
                    }
                    each(row + 1, &values);
                }
            }
        }
        Ok(())
    }
}

/// The cells of a line, without blanks and quotes about them.
fn cells(line: &str, delimiter: Option<char>) -> Vec<String> {
    let mut found = vec![String::new()];
    let mut quoted = false;
    let parts = |c: char| delimiter.map_or(c.is_whitespace(), |d| d == c);
    for c in line.trim_matches(|c| delimiter != Some(c) && char::is_whitespace(c)).chars() {
        let last = found.len() - 1;
        if c == '"' {
            quoted = !quoted;
            // two quotes without anything between them are a blank cell among blanks
            found[last].push('\u{0}');
        } else if !quoted && parts(c) {
            if delimiter.is_some() || !found[last].is_empty() {
                found.push(String::new());
            }
        } else {
            found[last].push(c);
        }
    }
    found.iter().map(|cell| cell.replace('\u{0}', "").trim().to_owned()).collect()
}

/// The number in a cell, NaN where it says "not known"; none if it is no number.
fn number(cell: &str) -> Option<f64> {
    let blank = cell.chars().all(|c| c == '-');
    if blank || UNKNOWN.contains(&cell.to_ascii_lowercase().as_str()) { Some(f64::NAN) } else { cell.parse().ok() }
}

/// The first number of a cell of a FITS table, NaN where it is undefined; none if it holds no number.
fn fits_number(cell: &BinValue) -> Option<f64> {
    match cell {
        BinValue::Int(v) => v.first().map(|x| x.map_or(f64::NAN, |x| x as f64)),
        BinValue::Uint(v) => v.first().map(|x| x.map_or(f64::NAN, |x| x as f64)),
        BinValue::Float(v) | BinValue::F64(v) => v.first().copied(),
        BinValue::F32(v) => v.first().map(|x| f64::from(*x)),
        BinValue::Str(text) => number(text.trim()),
        _ => None,
    }
}

/// The unit that a head of ECSV gives a column, in one line, `# - {name: ra, unit: deg, datatype: float64}`, or a key a line.
fn ecsv_unit(text: &str, name: &str) -> String {
    let mut entries: Vec<String> = Vec::new();
    for line in text.lines().take_while(|line| line.starts_with('#')) {
        let line = line.trim_start_matches('#').trim();
        match (line.strip_prefix('-').filter(|rest| rest.is_empty() || rest.starts_with(' ')), entries.last_mut())
        {
            (Some(first), _) => entries.push(first.to_owned()),
            (None, Some(entry)) => {
                entry.push(',');
                entry.push_str(line);
            }
            (None, None) => {}
        }
    }
    let told = |entry: &String, key: &str| {
        let mut parts =
            entry.split(',').map(|part| part.trim().trim_start_matches('{').trim_end_matches('}').trim());
        parts.find_map(|part| Some(part.strip_prefix(key)?.trim().trim_matches(['"', '\'']).to_owned()))
    };
    let own = entries.iter().find(|entry| told(entry, "name:").as_deref() == Some(name));
    own.and_then(|entry| told(entry, "unit:")).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, columns: &[usize]) -> Result<Vec<(usize, Vec<f64>)>, CatalogueError> {
        let table = Table::of_text("t".into(), text.as_bytes())?;
        let mut rows = Vec::new();
        table.rows(columns, |row, values| rows.push((row, values.to_vec())))?;
        Ok(rows)
    }

    #[test]
    fn cells_are_parted_by_what_the_names_are_parted_by() {
        for text in
            ["a,b,c\r\n1,2,3\r\n", "a;b;c\n1;2;3", "a\tb\tc\n1\t2\t3\n", " a  b c\n\n 1 2   3\n", "a|b|c\n1|2|3|"]
        {
            let rows = read(text, &[2, 0]).expect(text);
            assert_eq!(rows.len(), 1, "{text}");
            assert_eq!((rows[0].1[0], rows[0].1[2]), (1.0, 3.0), "{text}");
        }
    }

    #[test]
    fn blanks_and_words_for_nothing_are_not_known() {
        let rows = read("a,b\n,1\nNaN,2\nnull,3\n--,4\n\"\",5\n# 6\n7,6\n", &[0, 1]).expect("a table");
        assert_eq!(rows.iter().map(|r| r.0).collect::<Vec<_>>(), [2, 3, 4, 5, 6, 8]);
        assert!(rows[..5].iter().all(|(_, v)| v[0].is_nan()) && rows[5].1 == [7.0, 6.0]);
        let blanks = read("a b \"c d\"\n1 \"\" 3\n", &[1, 2]).expect("a table");
        assert!(blanks[0].1[1].is_nan() && blanks[0].1[2] == 3.0);
    }

    #[test]
    fn units_come_from_ecsv_and_from_vizier() {
        let ecsv = "# %ECSV 1.0\n# ---\n# datatype:\n# - {name: ra, unit: deg, datatype: float64}\n\
                    # - {name: pmra, unit: mas / yr, datatype: float64}\nra pmra\n1 2\n";
        assert_eq!(Table::of_text("t".into(), ecsv.as_bytes()).expect("a table").units, ["deg", "mas / yr"]);
        let vizier = "#RESOURCE=yCat\nra\tdec\ndeg\tdeg\n-----\t----\n1.5\t2\n";
        assert_eq!(Table::of_text("t".into(), vizier.as_bytes()).expect("a table").units, ["deg", "deg"]);
        assert_eq!(read(vizier, &[0, 1]).expect("a table"), [(5, vec![1.5, 2.0])]);
    }

    #[test]
    fn faults_name_line_and_column() {
        for (text, part) in [
            ("ra,dec\n1,2\n1:02,3\n", "line 3, column ra: \"1:02\" is no number"),
            ("ra,dec\n1\n", "line 2: 1 cells under 2 names"),
            ("# nothing\n", "no line with the names"),
        ] {
            let told = read(text, &[0]).expect_err(text).to_string();
            assert!(told.contains(part), "{told}");
        }
        assert!(Table::of_fits("t".into(), b"SIMPLE  = ".to_vec()).is_err());
    }
}
