//! `croissant.json`: the dataset in Croissant 1.1, a JSON-LD vocabulary that data loaders and search engines read.
//!
//! # Source
//!
//! <https://docs.mlcommons.org/croissant/docs/croissant-spec-1.1.html>. Parquet is named `application/x-parquet` and
//! not by its registered name, because `mlcroissant` 1.1 reads records of the former alone.

use serde_json::{Map, Value, json};

use crate::artifact::FileEntry;
use crate::publish::tables::{ColumnFacts, TableFacts};
use crate::publish::{Facts, Publication};
use crate::table::{ColumnKind, Form, Value as CellValue};
use crate::words::counted;

const CONTEXT: &str = include_str!("croissant_context.json");
const PARQUET: &str = "application/x-parquet";

/// The whole document.
pub(super) fn render(facts: &Facts, publication: &Publication, files: &[FileEntry]) -> Result<Vec<u8>, String> {
    let context: Value = serde_json::from_str(CONTEXT).map_err(|error| error.to_string())?;
    let mut document = json!({
        "@context": context,
        "@type": "sc:Dataset",
        "conformsTo": "http://mlcommons.org/croissant/1.1",
        "name": publication.name,
        "description": facts.description,
        "license": publication.license.url(),
        "creator": facts.creators.iter().map(|name| json!({ "@type": "sc:Organization", "name": name })).collect::<Vec<_>>(),
        "datePublished": publication.date.to_string(),
        "version": publication.release.to_string(),
        "inLanguage": "en",
        "keywords": facts.tags,
        "citeAs": facts.cite_as,
        "isLiveDataset": false,
        "distribution": distribution(facts, files),
        "recordSet": facts.tables.iter().map(record_set).chain([splits(facts)]).collect::<Vec<_>>(),
    });
    // Of a dataset that was written elsewhere nothing tells what made it.
    if let Some(version) = &facts.summary.ntp_version {
        document["prov:wasGeneratedBy"] = json!({
            "@type": "prov:Activity",
            "name": facts.command,
            "description": format!("ntp {version}"),
        });
    }
    if let Some(url) = &publication.url {
        document["url"] = json!(url);
    }
    let mut text = serde_json::to_vec_pretty(&document).map_err(|error| error.to_string())?;
    text.push(b'\n');
    Ok(text)
}

/// Every file with its hash, and a set of files for each table.
fn distribution(facts: &Facts, files: &[FileEntry]) -> Vec<Value> {
    let sets = facts.tables.iter().map(|table| {
        json!({
            "@type": "cr:FileSet",
            "@id": format!("{}-files", table.name),
            "name": format!("{}-files", table.name),
            "description": format!("Parquet files; a row is {}.", table.row),
            "encodingFormat": PARQUET,
            "includes": table.pattern,
        })
    });
    sets.chain(files.iter().map(file_object)).collect()
}

fn file_object(file: &FileEntry) -> Value {
    json!({
        "@type": "cr:FileObject",
        "@id": file.path,
        "name": file.path,
        "contentUrl": file.path,
        "contentSize": format!("{} B", file.bytes),
        "encodingFormat": encoding(&file.path),
        "sha256": file.sha256,
    })
}

fn encoding(path: &str) -> &'static str {
    match path.rsplit_once('.').map(|(_, extension)| extension) {
        Some("parquet") => PARQUET,
        Some("json") => "application/json",
        Some("mp4") => "video/mp4",
        _ => "text/plain",
    }
}

fn record_set(table: &TableFacts) -> Value {
    let key: Vec<Value> = table.key.iter().map(|column| json!({ "@id": format!("{}/{column}", table.name) })).collect();
    json!({
        "@type": "cr:RecordSet",
        "@id": table.name,
        "name": table.name,
        "description": format!("{}; each is {}.", counted(table.rows, "row"), table.row),
        "key": key,
        "field": table.columns.iter().filter_map(|column| field(table, column)).collect::<Vec<_>>(),
    })
}

/// A column, if it is of a kind that Croissant has a name for.
fn field(table: &TableFacts, column: &ColumnFacts) -> Option<Value> {
    let kind = column.column?;
    let data_type = match kind.value {
        CellValue::Int64 => "cr:Int64",
        CellValue::Float32 => "cr:Float32",
        CellValue::Float64 | CellValue::Channels => "cr:Float64",
        CellValue::Boolean => "sc:Boolean",
        CellValue::Text => "sc:Text",
        CellValue::Picture => "sc:ImageObject",
    };
    let mut field = Map::new();
    let id = format!("{}/{}", table.name, column.name);
    field.insert("@type".to_owned(), json!("cr:Field"));
    field.insert("@id".to_owned(), json!(id));
    field.insert("name".to_owned(), json!(id));
    field.insert("description".to_owned(), json!(column.meaning));
    field.insert("dataType".to_owned(), json!(data_type));
    let source = json!({
        "fileSet": { "@id": format!("{}-files", table.name) },
        "extract": { "column": column.name },
    });
    field.insert("source".to_owned(), source);
    let shape = match kind {
        ColumnKind { form: Form::List, .. } => Some("-1"),
        ColumnKind { value: CellValue::Channels, .. } => Some("3,1,1"),
        _ => None,
    };
    if let Some(shape) = shape {
        field.insert("isArray".to_owned(), json!(true));
        field.insert("arrayShape".to_owned(), json!(shape));
    }
    Some(Value::Object(field))
}

/// The splits, as Croissant wants them: a small record set of its own.
fn splits(facts: &Facts) -> Value {
    let url = |split: &str| match split {
        "seen" | "train" => "cr:TrainingSplit",
        "val" | "validation" | "dev" => "cr:ValidationSplit",
        _ => "cr:TestSplit",
    };
    let rows: Vec<Value> =
        facts.summary.splits.keys().map(|split| json!({ "splits/name": split, "splits/url": url(split) })).collect();
    json!({
        "@type": "cr:RecordSet",
        "@id": "splits",
        "name": "splits",
        "description": if facts.summary.declared.is_some() { "The splits of `meta/info.json`." } else { "Values of the column `split` of `episodes`." },
        "dataType": "cr:Split",
        "key": { "@id": "splits/name" },
        "field": [
            { "@type": "cr:Field", "@id": "splits/name", "name": "splits/name", "dataType": "sc:Text" },
            { "@type": "cr:Field", "@id": "splits/url", "name": "splits/url", "dataType": "sc:URL" },
        ],
        "data": rows,
    })
}
