//! Guards `anhyst live`: what Foxglove's protocol and datagrams carry of a run that goes on is what its recording holds, to the bit, in the
//! same ticks of all channels; the run is none the wiser, and nothing is left behind.

use anhyst_tests::{Finished, LIMIT, anhyst, digest, files_with, folders, repository, start, summary};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpStream, UdpSocket};
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

/// Ticks between two that are passed on, at 20 kHz and 500 Hz.
const EVERY: u64 = 40;

/// A viewer, as short as one can be.
struct Viewer {
    stream: TcpStream,
}

impl Viewer {
    fn connect(address: &str) -> Self {
        let mut stream = TcpStream::connect(address).unwrap();
        let request = "GET / HTTP/1.1\r\nHost: here\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
             Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n\
             Sec-WebSocket-Protocol: other, foxglove.sdk.v1\r\n\r\n";
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = Vec::new();
        while !answer.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).unwrap();
            answer.push(byte[0]);
        }
        let answer = String::from_utf8(answer).unwrap();
        assert!(answer.starts_with("HTTP/1.1 101"), "{answer}");
        assert!(
            answer.contains("Sec-WebSocket-Accept: s3pPLMBiTxaQ9kYGzzhZRbK+xOo="),
            "{answer}"
        );
        assert!(answer.contains("Sec-WebSocket-Protocol: foxglove.sdk.v1"), "{answer}");
        Viewer { stream }
    }

    fn ask(&mut self, text: &str) {
        let mask = [7, 1, 200, 33];
        let mut frame = vec![0x81, 0x80 | 126];
        frame.extend((text.len() as u16).to_be_bytes());
        frame.extend(mask);
        frame.extend(text.bytes().zip(mask.iter().cycle()).map(|(byte, mask)| byte ^ mask));
        // In two halves: a message may come in pieces.
        let (one, other) = frame.split_at(frame.len() / 2);
        self.stream.write_all(one).unwrap();
        thread::sleep(Duration::from_millis(20));
        self.stream.write_all(other).unwrap();
    }

    fn message(&mut self) -> (u8, Vec<u8>) {
        let mut take = |count: usize| {
            let mut bytes = vec![0; count];
            self.stream.read_exact(&mut bytes).unwrap();
            bytes
        };
        let head = take(2);
        let length = match head[1] {
            126 => take(2).iter().fold(0, |length, byte| length << 8 | usize::from(*byte)),
            127 => take(8).iter().fold(0, |length, byte| length << 8 | usize::from(*byte)),
            short => usize::from(short),
        };
        (head[0], take(length))
    }

    fn told(&mut self) -> Value {
        let (kind, message) = self.message();
        assert_eq!(kind, 0x81);
        serde_json::from_slice(&message).unwrap()
    }
}

/// What was exported of the run, by tick.
fn exported(run: &Path) -> BTreeMap<u64, Vec<f64>> {
    Finished::run(&["export", &run.to_string_lossy()], LIMIT).expect(0);
    let text = std::fs::read_to_string(run.join("run.csv")).unwrap();
    assert!(
        text.starts_with("time_s,field_command_A_per_m,field_A_per_m,displacement_m"),
        "{text:.80}"
    );
    let rows = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|own| own.parse().unwrap()).collect::<Vec<f64>>());
    rows.enumerate().map(|(tick, row)| (tick as u64, row)).collect()
}

#[test]
fn viewers_get_what_the_recording_holds() {
    let (_root, [run, quiet]) = folders();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
    let to = socket.local_addr().unwrap().to_string();
    let mut live = Command::new(anhyst())
        .current_dir(repository())
        .args([
            "live",
            &run.to_string_lossy(),
            "--wait-s",
            "600",
            "--foxglove",
            "127.0.0.1:0",
            "--udp",
            &to,
        ])
        .args(["--rate-hz", "500", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut told = String::new();
    let mut said = BufReader::new(live.stderr.take().unwrap());
    said.read_line(&mut told).unwrap();
    let address = told
        .trim()
        .strip_prefix("Foxglove: ws://")
        .unwrap_or_else(|| panic!("{told}"));

    let mut viewer = Viewer::connect(address);
    assert_eq!(viewer.told()["op"], "serverInfo");
    let offered = viewer.told();
    let channels = offered["channels"].as_array().unwrap();
    let id = |topic: &str| {
        channels.iter().find(|own| own["topic"] == topic).unwrap()["id"]
            .as_u64()
            .unwrap()
    };
    let schema: Value = serde_json::from_str(channels[0]["schema"].as_str().unwrap()).unwrap();
    assert_eq!(schema["properties"]["displacement_m"]["type"], "number");
    viewer.ask(&format!(
        r#"{{"op":"subscribe","subscriptions":[{{"id":5,"channelId":{}}},{{"id":9,"channelId":{}}}]}}"#,
        id("/measurement"),
        id("/safe_field")
    ));
    let seen = thread::spawn(move || {
        let mut seen: Vec<(u32, u64, Value)> = Vec::new();
        loop {
            let (kind, bytes) = viewer.message();
            match kind {
                0x82 => {
                    assert_eq!(bytes[0], 1);
                    let subscription = u32::from_le_bytes(*bytes[1..].first_chunk().unwrap());
                    let time_ns = u64::from_le_bytes(*bytes[5..].first_chunk().unwrap());
                    seen.push((subscription, time_ns, serde_json::from_slice(&bytes[13..]).unwrap()));
                }
                _ => return (kind, seen),
            }
        }
    });
    let datagrams = thread::spawn(move || {
        let mut all: Vec<Value> = Vec::new();
        let (mut bytes, mut idle) = ([0; 8192], 0);
        // Until nothing more comes after something came.
        while idle < 25 || all.is_empty() && idle < 3000 {
            match socket.recv(&mut bytes) {
                Ok(count) => {
                    all.push(serde_json::from_slice(&bytes[..count]).unwrap());
                    idle = 0;
                }
                Err(_) => idle += 1,
            }
        }
        all
    });

    let shorter = ["--set", "duration_s=2.0"];
    let out = run.to_string_lossy();
    Finished::wait(
        start(&[&["run", "scenarios/milling.ron", "--out", &out], &shorter[..]].concat()),
        LIMIT,
    )
    .expect(0);
    let counted = live.wait_with_output().unwrap();
    assert!(counted.status.success());
    let counted: Value = serde_json::from_slice(&counted.stdout).unwrap();
    let mut left = String::new();
    said.read_to_string(&mut left).unwrap();
    assert_eq!(left, "", "it complains");

    let rows = exported(&run);
    let (kind, seen) = seen.join().unwrap();
    assert_eq!(kind, 0x88, "a good-bye");
    let of = |own: u32| seen.iter().filter(move |(subscription, ..)| *subscription == own);
    let ticks: Vec<u64> = of(5).map(|(_, _, message)| message["tick"].as_u64().unwrap()).collect();
    assert!(ticks.len() > 100, "{counted} {}", ticks.len());
    assert!(ticks.iter().all(|tick| tick % EVERY == 0));
    if counted["missed"] == 0 {
        assert!(ticks.windows(2).all(|pair| pair[1] == pair[0] + EVERY), "{ticks:?}");
    }
    let same = |message: &Value, field: &str, tick: u64, column: usize| {
        let (own, recorded) = (message[field].as_f64().unwrap(), rows[&tick][column]);
        assert_eq!(
            own.to_bits(),
            recorded.to_bits(),
            "{field} of tick {tick}: {own} and {recorded}"
        );
    };
    for (_, time_ns, message) in of(5) {
        let tick = message["tick"].as_u64().unwrap();
        assert_eq!(*time_ns, tick * 50_000);
        same(message, "coil_field_a_per_m", tick, 2);
        same(message, "displacement_m", tick, 3);
    }
    assert!(of(9).count() > 100);
    for (_, _, message) in of(9) {
        // What the guard lets through stands in the row of the instant that it is for.
        let tick = message["tick"].as_u64().unwrap();
        if rows.contains_key(&(tick + 2)) {
            same(message, "field_a_per_m", tick + 2, 1);
        }
    }
    let datagrams = datagrams.join().unwrap();
    let measured: Vec<&Value> = datagrams
        .iter()
        .map(|own| &own["measurement"])
        .filter(|own| !own.is_null())
        .collect();
    assert!(measured.len() > 100, "{}", measured.len());
    for message in measured {
        same(message, "displacement_m", message["tick"].as_u64().unwrap(), 3);
    }

    // Heard or not, it is the same run; and nothing is left of the listener.
    let (quiet_out, whole) = (quiet.to_string_lossy(), summary(&run));
    let again = [
        "run",
        "scenarios/milling.ron",
        "--embedded",
        "--no-recording",
        "--out",
        &quiet_out,
    ];
    Finished::run(&[&again, &shorter[..]].concat(), LIMIT).expect(0);
    assert_eq!(digest(&run), digest(&quiet));
    assert_eq!(whole["held"], true);
    let meeting: Value = serde_json::from_slice(&std::fs::read(run.join("processes/meeting.json")).unwrap()).unwrap();
    let prefix = meeting["prefix"].as_str().unwrap();
    assert!(files_with(prefix).is_empty(), "{:?}", files_with(prefix));
}

// Of Zenoh's own client library, as a lab's program would use it.
#[cfg(feature = "bridge")]
#[test]
fn zenoh_carries_what_the_recording_holds() {
    use zenoh::Wait as _;
    let (_root, [run, _]) = folders();
    let port = std::net::TcpListener::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap();
    let endpoint = format!("tcp/{port}");
    let out = run.to_string_lossy();
    let live = start(&["live", &out, "--wait-s", "600", "--zenoh", &endpoint, "--json"]);
    let mut config = zenoh::Config::default();
    for (key, value) in [
        ("mode", "\"client\"".to_owned()),
        ("scouting/multicast/enabled", "false".to_owned()),
        ("connect/endpoints", format!("[\"{endpoint}\"]")),
        ("connect/timeout_ms", "60000".to_owned()),
    ] {
        config.insert_json5(key, &value).unwrap();
    }
    let session = zenoh::open(config).wait().unwrap();
    let heard = session.declare_subscriber("anhyst/*/live/measurement").wait().unwrap();
    let schema = session.get("anhyst/*/live/measurement/schema").wait().unwrap();
    let schema = schema.recv_timeout(LIMIT).unwrap().unwrap();
    let schema = schema.result().unwrap().payload().try_to_string().unwrap().into_owned();
    let schema: Value = serde_json::from_str(&schema).unwrap();
    assert_eq!(schema["properties"]["displacement_m"]["type"], "number");

    let shorter = ["--set", "duration_s=1.0"];
    let cut = start(&[&["run", "scenarios/milling.ron", "--out", &out], &shorter[..]].concat());
    Finished::wait(cut, LIMIT).expect(0);
    Finished::wait(live, LIMIT).expect(0);
    let rows = exported(&run);
    let mut ticks = Vec::new();
    while let Ok(Some(sample)) = heard.recv_timeout(Duration::from_secs(1)) {
        assert_eq!(sample.encoding().to_string(), "application/json;anhyst.measurement");
        let message: Value = serde_json::from_slice(&sample.payload().to_bytes()).unwrap();
        let tick = message["tick"].as_u64().unwrap();
        let own = message["displacement_m"].as_f64().unwrap();
        assert_eq!(own.to_bits(), rows[&tick][3].to_bits(), "tick {tick}");
        ticks.push(tick);
    }
    assert!(ticks.len() > 100 && ticks.is_sorted(), "{ticks:?}");
}
