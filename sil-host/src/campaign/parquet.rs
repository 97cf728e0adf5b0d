//! The table as `runs.parquet`: the same columns, typed, written from the rows in bounded memory.

use std::fs::{self, File};
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as PhysicalType};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{WriterProperties, WriterPropertiesPtr};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{ColumnPath, Type, TypePtr};
use serde_json::{Map, Value};

use super::error::CampaignError;
use super::plan::Campaign;
use super::row::Row;
use super::table::{CampaignResults, Column, columns};
use crate::log::description::{COMMIT, VERSION};

/// File of the table in a directory of results.
pub const TABLE: &str = "runs.parquet";
/// Rows held in memory at a time.
const GROUP: usize = 4096;

/// Writes the table beside `runs.csv`.
///
/// # Errors
/// When the rows cannot be read or the file not be written.
pub fn write(results: &CampaignResults) -> Result<(), CampaignError> {
    let path = results.directory().join(TABLE);
    let part = path.with_extension("part");
    let failed = |error: &ParquetError| CampaignError::Output(path.clone(), error.to_string());
    let file = File::create(&part).map_err(CampaignError::io(&part))?;
    let schema = schema(results.campaign()).map_err(|error| failed(&error))?;
    let mut writer = SerializedFileWriter::new(file, schema, properties(results.campaign()))
        .map_err(|error| failed(&error))?;
    let mut rows = results.rows()?;
    loop {
        let group = rows.by_ref().take(GROUP).collect::<Result<Vec<_>, _>>()?;
        if group.is_empty() {
            break;
        }
        write_group(&mut writer, results.campaign(), &group).map_err(|error| failed(&error))?;
    }
    writer.close().map_err(|error| failed(&error))?;
    fs::rename(&part, &path).map_err(CampaignError::io(&path))
}

/// Columns that hold words.
const TEXTS: [&str; 4] = ["variant", "outcome", "reason", "assumptions"];

/// Compression, encodings and what the file says about itself: the same definition leaves the same bytes.
///
/// Words and the levels of a grid repeat, so they have a dictionary; other numbers do not, and one would
/// double them.
fn properties(campaign: &Campaign) -> WriterPropertiesPtr {
    let mut properties = WriterProperties::builder()
        .set_created_by(format!("sil-host version {VERSION} (build {COMMIT})"))
        .set_compression(Compression::SNAPPY)
        .set_dictionary_enabled(false)
        .set_key_value_metadata(Some(metadata(campaign)));
    let levels = campaign
        .axes
        .iter()
        .flat_map(|axis| std::iter::repeat_n(axis.levels().is_some(), axis.dimensions()));
    let repeated = campaign.parameters().iter().zip(levels).filter(|(_, levels)| *levels);
    let repeated = repeated.map(|(parameter, _)| parameter.column());
    for name in TEXTS.map(str::to_owned).into_iter().chain(repeated) {
        // One part: the points in a name are its own.
        properties = properties.set_column_dictionary_enabled(ColumnPath::new(vec![name]), true);
    }
    Arc::new(properties.build())
}

/// What the file says about itself, key by key.
fn metadata(campaign: &Campaign) -> Vec<KeyValue> {
    let columns = columns(campaign);
    let of_columns = |value: fn(&Column) -> &String| {
        let known = columns.iter().filter(|column| !value(column).is_empty());
        let entries = known.map(|it| (it.name.clone(), Value::from(value(it).as_str())));
        Value::Object(entries.collect::<Map<_, _>>()).to_string()
    };
    [
        ("campaign", campaign.name().to_owned()),
        ("description", campaign.definition().description.clone()),
        ("definition", campaign.text()),
        ("version", VERSION.to_owned()),
        ("commit", COMMIT.to_owned()),
        ("units", of_columns(|column| &column.unit)),
        ("meanings", of_columns(|column| &column.meaning)),
    ]
    .map(|(key, value)| KeyValue::new(format!("gyrfalcon.{key}"), value))
    .to_vec()
}

/// Column types by name: whole numbers for seeds, text, and numbers that may be absent.
fn schema(campaign: &Campaign) -> Result<TypePtr, ParquetError> {
    let required = 2 + campaign.parameters().len() + 3;
    let field = |(number, Column { name, .. }): (usize, &Column)| {
        let physical = match name.as_str() {
            "seed" => PhysicalType::INT64,
            name if TEXTS.contains(&name) => PhysicalType::BYTE_ARRAY,
            _ => PhysicalType::DOUBLE,
        };
        let logical = (physical == PhysicalType::BYTE_ARRAY).then_some(LogicalType::String);
        let repetition =
            if number < required { Repetition::REQUIRED } else { Repetition::OPTIONAL };
        Type::primitive_type_builder(name, physical)
            .with_repetition(repetition)
            .with_logical_type(logical)
            .build()
            .map(Arc::new)
    };
    let fields = columns(campaign).iter().enumerate().map(field).collect::<Result<_, _>>()?;
    Type::group_type_builder("runs").with_fields(fields).build().map(Arc::new)
}

/// Writes rows as one row group, column by column in the order of [`columns`].
fn write_group(
    writer: &mut SerializedFileWriter<File>,
    campaign: &Campaign,
    rows: &[Row],
) -> Result<(), ParquetError> {
    let mut group = Group { writer: writer.next_row_group()?, rows };
    group.integers(|row| row.seed.into())?;
    group.texts(|row| campaign.variants()[row.variant].name.as_str().into())?;
    for number in 0..campaign.parameters().len() {
        group.numbers(|row| row.parameters[number])?;
    }
    group.texts(|row| row.outcome.name().into())?;
    group.texts(|row| row.reason.as_str().into())?;
    group.texts(|row| row.assumptions().into())?;
    for number in 0..rows[0].measures.len() {
        group.optional(|row| row.measures[number])?;
    }
    for number in 0..rows[0].guarantees.len() {
        group.optional(|row| row.guarantees[number].observed)?;
        group.optional(|row| row.guarantees[number].margin)?;
    }
    group.writer.close().map(drop)
}

struct Group<'a> {
    writer: SerializedRowGroupWriter<'a, File>,
    rows: &'a [Row],
}

impl Group<'_> {
    fn integers(&mut self, value: impl Fn(&Row) -> i64) -> Result<(), ParquetError> {
        let values: Vec<_> = self.rows.iter().map(value).collect();
        self.column::<Int64Type>(&values, None)
    }

    fn texts(&mut self, value: impl Fn(&Row) -> ByteArray) -> Result<(), ParquetError> {
        let values: Vec<_> = self.rows.iter().map(value).collect();
        self.column::<ByteArrayType>(&values, None)
    }

    fn numbers(&mut self, value: impl Fn(&Row) -> f64) -> Result<(), ParquetError> {
        let values: Vec<_> = self.rows.iter().map(value).collect();
        self.column::<DoubleType>(&values, None)
    }

    fn optional(&mut self, value: impl Fn(&Row) -> Option<f64>) -> Result<(), ParquetError> {
        let present: Vec<_> = self.rows.iter().map(|row| i16::from(value(row).is_some())).collect();
        let values: Vec<_> = self.rows.iter().filter_map(value).collect();
        self.column::<DoubleType>(&values, Some(&present))
    }

    fn column<T: parquet::data_type::DataType>(
        &mut self,
        values: &[T::T],
        present: Option<&[i16]>,
    ) -> Result<(), ParquetError> {
        let Some(mut column) = self.writer.next_column()? else { return Ok(()) };
        column.typed::<T>().write_batch(values, present, None)?;
        column.close()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    use super::*;
    use crate::campaign::{header, line};

    const REFUSED: &str = r#"
name = "refused"
description = "Some tilts are refused."
sampling = "grid"
scenario = "paper-saturated"
set = ["duration=0.002"]
[[vary]]
path = "initial.tilt_deg"
values = [0.5, 190.5]
"#;

    fn cell(field: &Field) -> String {
        match field {
            Field::Null => String::new(),
            Field::Double(x) => zmij::Buffer::new().format(*x).to_owned(),
            Field::Long(x) => x.to_string(),
            Field::Str(text) => text.clone(),
            other => panic!("{other:?}"),
        }
    }

    /// Metadata, compression and dictionaries.
    fn assert_says_what_it_holds(table: &SerializedFileReader<File>, campaign: &Campaign) {
        let file = table.metadata().file_metadata();
        let said = file.key_value_metadata().unwrap();
        let of = |key: &str| {
            let entry = said.iter().find(|entry| entry.key == format!("gyrfalcon.{key}"));
            entry.unwrap_or_else(|| panic!("{key}")).value.clone().unwrap()
        };
        assert_eq!((of("campaign"), of("version")), ("refused".to_owned(), VERSION.to_owned()));
        assert_eq!(of("definition"), campaign.text());
        let units: Value = serde_json::from_str(&of("units")).unwrap();
        assert_eq!(units["position_error_peak"], "m");
        assert_eq!(units["thrust_highest_against_m_f.margin"], "N");
        assert_eq!(units.get("outcome"), None);
        let meanings: Value = serde_json::from_str(&of("meanings")).unwrap();
        let columns = file.schema_descr().columns();
        assert!(columns.iter().all(|column| meanings[column.name()].is_string()), "{meanings}");
        let with_dictionary: Vec<_> = table.metadata().row_groups()[0]
            .columns()
            .iter()
            .inspect(|column| assert_eq!(column.compression(), Compression::SNAPPY))
            .filter(|column| column.dictionary_page_offset().is_some())
            .map(|column| column.column_descr().name().to_owned())
            .collect();
        let expected = ["variant", "initial.tilt_deg", "outcome", "reason", "assumptions"];
        assert_eq!(with_dictionary, expected);
    }

    #[test]
    fn it_holds_what_the_text_holds() {
        let campaign = Campaign::parse(
            "a",
            REFUSED,
            Path::new(""),
            &crate::campaign::CampaignOverrides::default(),
            &[],
        )
        .unwrap();
        let folder = tempfile::tempdir().unwrap();
        let directory = folder.path();
        fs::write(directory.join("campaign.toml"), campaign.text()).unwrap();
        let rows = (0..2).flat_map(|index| crate::campaign::fly_run(&campaign, index).rows);
        let text: String = rows.map(|row| line(&campaign, &row)).collect();
        fs::write(directory.join("runs.csv"), header(&campaign) + &text).unwrap();
        write(&CampaignResults::open(directory).unwrap()).unwrap();

        let mut expected = csv::Reader::from_path(directory.join("runs.csv")).unwrap();
        let file = File::open(directory.join(TABLE)).unwrap();
        let table = SerializedFileReader::new(file).unwrap();
        let names = table.metadata().file_metadata().schema_descr().columns();
        assert!(names.iter().map(|it| it.name()).eq(expected.headers().unwrap()));
        assert_says_what_it_holds(&table, &campaign);
        let rows: Vec<Vec<_>> = table
            .get_row_iter(None)
            .unwrap()
            .map(|row| row.unwrap().get_column_iter().map(|(_, field)| cell(field)).collect())
            .collect();
        let expected: Vec<csv::StringRecord> = expected.records().map(Result::unwrap).collect();
        assert_eq!(rows.len(), 2);
        for (row, expected) in rows.iter().zip(&expected) {
            assert!(row.iter().eq(expected), "{row:?} is not {expected:?}");
        }
        assert!(rows[1].iter().any(|cell| cell.contains("tilt_deg: 190.5 must be in [0, 180]")));
    }
}
