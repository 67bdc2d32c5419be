//! Tables: named columns with units, and metadata. `io/ecsv` writes them.

use serde_json::{Map, Value as Json};
use std::borrow::Cow;

/// Values of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Floating point numbers.
    Float(Vec<f64>),
    /// Integers.
    Int(Vec<i64>),
    /// Strings.
    Text(Vec<String>),
    /// Logical values.
    Bool(Vec<bool>),
}

impl Values {
    fn len(&self) -> usize {
        match self {
            Self::Float(v) => v.len(),
            Self::Int(v) => v.len(),
            Self::Text(v) => v.len(),
            Self::Bool(v) => v.len(),
        }
    }

    fn json(&self, row: usize) -> Json {
        match self {
            Self::Float(v) => serde_json::Number::from_f64(v[row]).map_or(Json::Null, Json::Number),
            Self::Int(v) => v[row].into(),
            Self::Bool(v) => v[row].into(),
            Self::Text(v) => v[row].clone().into(),
        }
    }
}

/// A column: name, unit, values.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name, as in the file.
    pub name: Cow<'static, str>,
    /// Unit as astropy spells it; empty for none.
    pub unit: &'static str,
    /// Values, one a row.
    pub values: Values,
}

/// A table with metadata.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// Metadata: keys and values.
    pub meta: Vec<(String, Json)>,
    /// The columns, in order.
    pub columns: Vec<Column>,
}

impl Table {
    /// Add a line of metadata.
    pub fn note(&mut self, key: &str, value: impl Into<Json>) {
        self.meta.push((key.to_owned(), value.into()));
    }

    /// Add a column; `unit` as astropy spells it, empty for none.
    pub fn column(&mut self, name: impl Into<Cow<'static, str>>, unit: &'static str, values: Values) {
        self.columns.push(Column { name: name.into(), unit, values });
    }

    /// Add a column of floating point numbers.
    pub fn floats(
        &mut self,
        name: impl Into<Cow<'static, str>>,
        unit: &'static str,
        values: impl Iterator<Item = f64>,
    ) {
        self.column(name, unit, Values::Float(values.collect()));
    }

    /// Add a column of integers.
    pub fn ints(&mut self, name: &'static str, values: impl Iterator<Item = i64>) {
        self.column(name, "", Values::Int(values.collect()));
    }

    /// Add a column of strings.
    pub fn texts(&mut self, name: &'static str, values: impl Iterator<Item = String>) {
        self.column(name, "", Values::Text(values.collect()));
    }

    /// Number of rows: that of the shortest column.
    pub fn rows(&self) -> usize {
        self.columns.iter().map(|c| c.values.len()).min().unwrap_or(0)
    }

    /// The rows as JSON objects, columns as keys.
    pub fn to_json_rows(&self) -> Json {
        let row = |i| self.columns.iter().map(|c| (c.name.to_string(), c.values.json(i))).collect::<Map<_, _>>();
        (0..self.rows()).map(|i| Json::Object(row(i))).collect()
    }
}
