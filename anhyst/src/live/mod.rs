//! The tokens of a run that goes on, for other people's viewers: a message in JSON a token, thinned, over what they read.

pub mod foxglove;
mod websocket;

use anhyst_ipc::{Channel, FieldKind, RawToken};
use serde_json::{Map, Value, json};

/// A token for viewers.
#[derive(Debug)]
pub struct Heard {
    pub channel: Channel,
    /// Of the run: ticks times their length.
    pub time_ns: u64,
    pub json: String,
}

impl Heard {
    /// Numbers have all their digits, so that they are read back to the bit; one that is none is null.
    pub fn of(token: &RawToken, tick_s: f64) -> Self {
        let channel = token.channel();
        let time_s = token.tick() as f64 * tick_s;
        let mut message = Map::new();
        message.insert("tick".to_owned(), token.tick().into());
        message.insert("time_s".to_owned(), time_s.into());
        for (field, word) in channel.fields().iter().zip(token.fields()) {
            let value: Value = match field.kind {
                FieldKind::F64 => f64::from_bits(*word).into(),
                FieldKind::U64 => (*word).into(),
            };
            message.insert(field.name.to_owned(), value);
        }
        Heard {
            channel,
            time_ns: (1e9 * time_s).round() as u64,
            json: Value::Object(message).to_string(),
        }
    }

    /// For one who has a single stream: the channel's name around it, and the time under the name that PlotJuggler looks for.
    pub fn datagram(&self) -> String {
        let time_s = 1e-9 * self.time_ns as f64;
        format!("{{\"timestamp\":{time_s},\"{}\":{}}}", self.channel, self.json)
    }
}

/// What a channel's messages are, as a JSON schema: each field with its sentence and unit.
pub fn schema(channel: Channel) -> String {
    let mut properties = Map::new();
    properties.insert("tick".to_owned(), json!({ "type": "integer" }));
    properties.insert(
        "time_s".to_owned(),
        json!({ "type": "number", "description": "time of the run (s)" }),
    );
    for field in channel.fields() {
        let kind = match field.kind {
            FieldKind::F64 => "number",
            FieldKind::U64 => "integer",
        };
        let unit = if field.unit.is_empty() {
            String::new()
        } else {
            format!(" ({})", field.unit)
        };
        let described = json!({ "type": kind, "description": format!("{}{unit}", field.doc.trim()) });
        properties.insert(field.name.to_owned(), described);
    }
    json!({ "title": schema_name(channel), "type": "object", "properties": properties }).to_string()
}

/// Its name.
pub fn schema_name(channel: Channel) -> String {
    format!("anhyst.{channel}")
}

/// Every so manyeth tick, of all channels the same ones; and what was overwritten before it was fetched.
#[derive(Debug)]
pub struct Thinned {
    every: u64,
    /// Next tick of each channel.
    next: [Option<u64>; Channel::ALL.len()],
    pub passed: u64,
    pub missed: u64,
}

impl Thinned {
    /// At most `rate_hz` ticks for a second of the run.
    pub fn new(rate_hz: f64, tick_s: f64) -> Self {
        Thinned {
            every: (1.0 / (rate_hz * tick_s)).ceil().max(1.0) as u64,
            next: [None; Channel::ALL.len()],
            passed: 0,
            missed: 0,
        }
    }

    /// Whether a token is passed on.
    pub fn passes(&mut self, token: &RawToken) -> bool {
        if !token.tick().is_multiple_of(self.every) {
            return false;
        }
        let next = &mut self.next[token.channel().number()];
        if let Some(expected) = *next {
            self.missed += token.tick().saturating_sub(expected) / self.every;
        }
        *next = Some(token.tick() + self.every);
        self.passed += 1;
        true
    }
}

#[cfg(test)]
mod tests {
    //! Guards what others read: bits that survive, ticks that belong together, and losses that are counted.
    use super::*;
    use anhyst_ipc::{Measurement, Message as _};

    fn token(tick: u64, displacement_m: f64) -> RawToken {
        let mut token = Measurement {
            displacement_m,
            ..Measurement::default()
        };
        token.stamp(tick, 7);
        RawToken::of(&token)
    }

    #[test]
    fn numbers_are_read_back_to_the_bit() {
        for value in [1.0 / 3.0, -4.9e-324, 1.797e308, 0.1 + 0.2] {
            let heard = Heard::of(&token(3, value), 5e-5);
            let read: Value = serde_json::from_str(&heard.datagram()).unwrap();
            let own = read["measurement"]["displacement_m"].as_f64().unwrap();
            assert_eq!(own.to_bits(), value.to_bits());
            assert_eq!(
                (read["measurement"]["tick"].as_u64(), heard.time_ns),
                (Some(3), 150_000)
            );
        }
        let none: Value = serde_json::from_str(&Heard::of(&token(0, f64::NAN), 1.0).json).unwrap();
        assert!(none["displacement_m"].is_null());
        let schema: Value = serde_json::from_str(&schema(Channel::Measurement)).unwrap();
        assert_eq!(schema["properties"]["displacement_m"]["type"], "number");
    }

    #[test]
    fn every_tenth_tick_passes_and_gaps_are_counted() {
        let mut thinned = Thinned::new(2000.0, 5e-5);
        let passed: Vec<u64> = (3..35).filter(|tick| thinned.passes(&token(*tick, 0.0))).collect();
        assert_eq!((passed, thinned.missed), (vec![10, 20, 30], 0));
        assert!(thinned.passes(&token(80, 0.0)));
        assert_eq!((thinned.passed, thinned.missed), (4, 4));
        assert!(Thinned::new(1e9, 5e-5).passes(&token(1, 0.0)));
    }
}
