//! Logs as MCAP files, for viewers of recordings (Foxglove, PlotJuggler, rerun): one channel `/rig`, a JSON message a
//! sample, with the schema of its columns. Written only; the metadata of the log come along.

use std::collections::BTreeMap;
use std::io::Cursor;

use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, WriteOptions};
use serde_json::{Map, Value, json};

use super::log::{Cells, Log};
use crate::input_error::InputError;

/// The log as the bytes of an MCAP file.
pub(super) fn write(log: &Log) -> Result<Vec<u8>, InputError> {
    encode(log).map_err(|e| InputError::new(format!("cannot be written as MCAP: {e}")))
}

fn encode(log: &Log) -> Result<Vec<u8>, McapError> {
    let mut writer =
        WriteOptions::new().compression(None).profile("").library("rig").create(Cursor::new(Vec::new()))?;
    let properties: Map<String, Value> = log
        .columns
        .iter()
        .map(|column| {
            let kind = if matches!(column.cells, Cells::Numbers(_)) { "number" } else { "string" };
            (column.name.clone(), json!({ "type": kind }))
        })
        .collect();
    let schema = json!({ "type": "object", "properties": properties }).to_string();
    let schema = writer.add_schema("rig.Log", "jsonschema", schema.as_bytes())?;
    let channel = writer.add_channel(schema, "/rig", "json", &BTreeMap::new())?;
    for (sample, time_s) in log.time_s().iter().enumerate() {
        let message: Map<String, Value> = log
            .columns
            .iter()
            .map(|column| {
                let value = match &column.cells {
                    Cells::Numbers(values) => json!(values[sample]),
                    Cells::Text(values) => json!(values[sample]),
                };
                (column.name.clone(), value)
            })
            .collect();
        // The cast saturates: what comes before zero (a capture before its trigger) is taken to its beginning.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let log_time = ((time_s - log.time_s()[0].min(0.0)) * 1e9).round() as u64;
        #[allow(clippy::cast_possible_truncation)]
        let sequence = sample as u32;
        let header = MessageHeader { channel_id: channel, sequence, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, Value::from(message).to_string().as_bytes())?;
    }
    let metadata = log.metadata.iter().filter(|(key, _)| !key.is_empty()).cloned().collect();
    writer.write_metadata(&Metadata { name: "log".into(), metadata })?;
    writer.finish()?;
    Ok(writer.into_inner().into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reader_of_the_format_finds_every_sample_and_the_metadata() {
        let mut log = Log::default();
        log.set_numbers("time_s", vec![-0.001, 0.0, 0.001]);
        log.set_numbers("normal_force_n", vec![1.0, 2.0, 3.5]);
        log.metadata.push(("experiment".into(), "fig20".into()));
        let bytes = write(&log).unwrap();
        let messages: Vec<_> = mcap::MessageStream::new(&bytes).unwrap().map(Result::unwrap).collect();
        let times: Vec<u64> = messages.iter().map(|message| message.log_time).collect();
        assert_eq!(times, [0, 1_000_000, 2_000_000]);
        let last: Value = serde_json::from_slice(&messages[2].data).unwrap();
        assert_eq!(last, json!({ "time_s": 0.001, "normal_force_n": 3.5 }));
        assert_eq!(messages[0].channel.topic, "/rig");
        assert_eq!(bytes, write(&log).unwrap(), "equal logs give equal bytes");
    }
}
