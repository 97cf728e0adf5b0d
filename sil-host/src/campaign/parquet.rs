//! The table as `runs.parquet`: the same columns, typed, written from the rows in bounded memory.

use std::fs::{self, File};
use std::sync::Arc;

use parquet::basic::{LogicalType, Repetition, Type as PhysicalType};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};

use super::error::CampaignError;
use super::plan::Campaign;
use super::row::Row;
use super::table::{CampaignResults, columns};

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
    let properties = WriterProperties::builder().set_created_by("sil-host".to_owned()).build();
    let schema = schema(results.campaign()).map_err(|error| failed(&error))?;
    let mut writer = SerializedFileWriter::new(file, schema, Arc::new(properties))
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

/// Column types by name: whole numbers for seeds, text, and numbers that may be absent.
fn schema(campaign: &Campaign) -> Result<TypePtr, ParquetError> {
    let text = ["variant", "outcome", "reason", "assumptions"];
    let required = 2 + campaign.parameters().len() + 3;
    let field = |(number, name): (usize, &String)| {
        let physical = match name.as_str() {
            "seed" => PhysicalType::INT64,
            name if text.contains(&name) => PhysicalType::BYTE_ARRAY,
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
        let directory = std::env::temp_dir().join(format!("parquet-{}", std::process::id()));
        fs::create_dir_all(&directory).unwrap();
        fs::write(directory.join("campaign.toml"), campaign.text()).unwrap();
        let rows = (0..2).flat_map(|index| crate::campaign::fly_run(&campaign, index).rows);
        let text: String = rows.map(|row| line(&campaign, &row)).collect();
        fs::write(directory.join("runs.csv"), header(&campaign) + &text).unwrap();
        write(&CampaignResults::open(&directory).unwrap()).unwrap();

        let mut expected = csv::Reader::from_path(directory.join("runs.csv")).unwrap();
        let file = File::open(directory.join(TABLE)).unwrap();
        let table = SerializedFileReader::new(file).unwrap();
        let names = table.metadata().file_metadata().schema_descr().columns();
        assert!(names.iter().map(|it| it.name()).eq(expected.headers().unwrap()));
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
        fs::remove_dir_all(&directory).unwrap();
    }
}
