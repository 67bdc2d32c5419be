//! Tables as Apache Parquet, for tools that read columns: pandas, Polars, DuckDB, astropy.
//!
//! One row group, not compressed: floats as DOUBLE, integers as INT64, texts as UTF-8, logical values as BOOLEAN, none
//! of them optional; NaN stays NaN. The file's key-value metadata hold the table's own (texts as they are, the rest as
//! JSON), the unit of each column that has one as `unit.NAME`, and as `table_meta_yaml` the header of the ECSV form,
//! from which (with `table::len::NAME`, lengths of texts) astropy restores units and metadata. The same table gives the same bytes.

use super::ecsv::to_ecsv;
use crate::base::table::{Column, Table, Values};
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::Type;
use std::sync::Arc;

/// The table as the bytes of a Parquet file.
///
/// # Errors
/// [`ParquetError`] of the writer, for a table that Parquet cannot hold, such as one with a column's name twice.
pub fn to_parquet(table: &Table) -> Result<Vec<u8>, ParquetError> {
    let fields = table.columns.iter().map(field).collect::<Result<Vec<_>, _>>()?;
    let schema = Type::group_type_builder("schema").with_fields(fields).build()?;
    let properties = WriterProperties::builder()
        .set_created_by(concat!("nightglass ", env!("CARGO_PKG_VERSION")).to_owned())
        .set_key_value_metadata(Some(metadata(table)))
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
    if !table.columns.is_empty() {
        let mut group = writer.next_row_group()?;
        for column in &table.columns {
            if let Some(mut cells) = group.next_column()? {
                write(&mut cells, &column.values, table.rows())?;
                cells.close()?;
            }
        }
        group.close()?;
    }
    writer.into_inner()
}

fn field(column: &Column) -> Result<Arc<Type>, ParquetError> {
    let (physical, logical) = match &column.values {
        Values::Float(_) => (Physical::DOUBLE, None),
        Values::Int(_) => (Physical::INT64, None),
        Values::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
        Values::Bool(_) => (Physical::BOOLEAN, None),
    };
    let builder = Type::primitive_type_builder(&column.name, physical).with_repetition(Repetition::REQUIRED);
    builder.with_logical_type(logical).build().map(Arc::new)
}

fn write(cells: &mut SerializedColumnWriter, values: &Values, rows: usize) -> Result<(), ParquetError> {
    match values {
        Values::Float(v) => cells.typed::<DoubleType>().write_batch(first(v, rows), None, None),
        Values::Int(v) => cells.typed::<Int64Type>().write_batch(first(v, rows), None, None),
        Values::Bool(v) => cells.typed::<BoolType>().write_batch(first(v, rows), None, None),
        Values::Text(v) => {
            let texts = first(v, rows).iter().map(|t| ByteArray::from(t.as_str())).collect::<Vec<_>>();
            cells.typed::<ByteArrayType>().write_batch(&texts, None, None)
        }
    }?;
    Ok(())
}

fn first<T>(values: &[T], rows: usize) -> &[T] {
    values.get(..rows).unwrap_or(values)
}

fn metadata(table: &Table) -> Vec<KeyValue> {
    let pair = |key: String, value: String| KeyValue { key, value: Some(value) };
    let own = table
        .meta
        .iter()
        .map(|(key, value)| pair(key.clone(), value.as_str().map_or_else(|| value.to_string(), str::to_owned)));
    let units = table.columns.iter().filter(|c| !c.unit.is_empty());
    let units = units.map(|c| pair(format!("unit.{}", c.name), c.unit.to_owned()));
    let text = to_ecsv(table);
    // the first two lines name the format and begin the document
    let header = text.lines().take_while(|l| l.starts_with('#')).skip(2).filter_map(|l| l.strip_prefix("# "));
    let yaml = pair("table_meta_yaml".to_owned(), header.collect::<Vec<_>>().join("\n"));
    own.chain(units).chain(table.columns.iter().filter_map(longest)).chain([yaml]).collect()
}

/// Length of the longest text of a column of texts \[characters\], which astropy asks for.
fn longest(column: &Column) -> Option<KeyValue> {
    let Values::Text(texts) = &column.values else { return None };
    let longest = texts.iter().map(|t| t.chars().count()).max().unwrap_or(0).max(1);
    Some(KeyValue { key: format!("table::len::{}", column.name), value: Some(longest.to_string()) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    fn table() -> Table {
        let mut table = Table::default();
        table.note("origin", "measured");
        table.note("attitude", serde_json::json!({"spin": 1.5}));
        table.floats("flux_e", "electron", [0.1, f64::NAN, -1e300].into_iter());
        table.ints("flags", [i64::MIN, 0, 64].into_iter());
        table.texts("target", ["Ñu \"7\"", "", "b\nc"].iter().map(|t| (*t).to_owned()));
        table.column("sunlit", "", Values::Bool(vec![true, false, true]));
        table
    }

    #[test]
    fn values_units_and_metadata_read_back() {
        let bytes = to_parquet(&table()).unwrap();
        assert_eq!(bytes, to_parquet(&table()).unwrap(), "the same table gives the same bytes");
        let reader = SerializedFileReader::new(bytes::Bytes::from(bytes)).unwrap();
        let rows = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect::<Vec<_>>();
        assert_eq!(rows.len(), 3);
        assert_eq!(rows[0].get_double(0).unwrap().to_bits(), 0.1f64.to_bits());
        assert!(rows[1].get_double(0).unwrap().is_nan());
        assert_eq!((rows[0].get_long(1).unwrap(), rows[2].get_double(0).unwrap()), (i64::MIN, -1e300));
        assert_eq!(
            (rows[0].get_string(2).unwrap().as_str(), rows[2].get_string(2).unwrap().as_str()),
            ("Ñu \"7\"", "b\nc")
        );
        assert!(rows[0].get_bool(3).unwrap() && !rows[1].get_bool(3).unwrap());
        let pairs = reader.metadata().file_metadata().key_value_metadata().unwrap();
        let value = |key: &str| pairs.iter().find(|p| p.key == key).and_then(|p| p.value.as_deref());
        assert_eq!((value("origin"), value("unit.flux_e")), (Some("measured"), Some("electron")));
        assert_eq!((value("attitude"), value("unit.flags")), (Some("{\"spin\":1.5}"), None));
        assert!(value("table_meta_yaml").unwrap().starts_with("datatype:\n- {name: flux_e, unit: electron,"));
    }

    #[test]
    fn tables_without_rows_or_columns_are_files_too() {
        let mut empty = Table::default();
        empty.floats("a", "s", std::iter::empty());
        for table in [empty, Table::default()] {
            let reader = SerializedFileReader::new(bytes::Bytes::from(to_parquet(&table).unwrap())).unwrap();
            assert_eq!(reader.metadata().file_metadata().num_rows(), 0);
        }
    }

    #[test]
    fn the_shortest_column_ends_the_table() {
        let mut uneven = Table::default();
        uneven.ints("a", [1, 2, 3].into_iter());
        uneven.ints("b", [1].into_iter());
        let reader = SerializedFileReader::new(bytes::Bytes::from(to_parquet(&uneven).unwrap())).unwrap();
        assert_eq!(reader.metadata().file_metadata().num_rows(), 1);
    }
}
