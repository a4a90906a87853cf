//! MCAP: a message in JSON a row, with a JSON schema; the instant of its logging is the row's time.

use anhyst_launch::measured_table::MeasuredTable;
use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::io::Cursor;

const TOPIC: &str = "/measured";

pub(super) fn bytes(table: &MeasuredTable) -> Result<Vec<u8>, McapError> {
    let numbers = table
        .columns
        .iter()
        .map(|(name, _)| (name.clone(), json!({ "type": "number" })));
    let properties: Map<String, Value> = numbers.collect();
    let schema = json!({ "title": "anhyst.Measured", "type": "object", "properties": properties }).to_string();
    let options = WriteOptions::new().library("anhyst");
    let mut writer = options.create(Cursor::new(Vec::new()))?;
    let schema = writer.add_schema("anhyst.Measured", "jsonschema", schema.as_bytes())?;
    let channel_id = writer.add_channel(schema, TOPIC, "json", &BTreeMap::new())?;
    for row in 0..table.rows() {
        let message: Map<String, Value> = table
            .columns
            .iter()
            .map(|(name, values)| (name.clone(), values[row].into()))
            .collect();
        let time_ns = table
            .columns
            .first()
            .map_or(0, |(_, times_s)| (1e9 * times_s[row]).round() as u64);
        let header = MessageHeader {
            channel_id,
            sequence: row as u32,
            log_time: time_ns,
            publish_time: time_ns,
        };
        writer.write_to_known_channel(&header, Value::Object(message).to_string().as_bytes())?;
    }
    writer.finish()?;
    Ok(writer.into_inner().into_inner())
}
