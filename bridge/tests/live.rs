//! Guards the live keys: a subscriber gets what was put, byte by byte, under the key of its channel. Needs the cargo feature `zenoh`.
#![cfg(feature = "zenoh")]

use anhyst_bridge::{End, LiveKeys};
use anhyst_ipc::Channel;
use std::net::TcpListener;
use std::time::Duration;
use zenoh::Wait as _;

#[test]
fn a_subscriber_gets_what_was_put() {
    // A port that is free now.
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let endpoint = format!("tcp/127.0.0.1:{port}");
    let keys = LiveKeys::open(&End::Listen(endpoint.clone()), "cut").unwrap();
    let mut config = zenoh::Config::default();
    config
        .insert_json5("connect/endpoints", &format!("[\"{endpoint}\"]"))
        .unwrap();
    config.insert_json5("scouting/multicast/enabled", "false").unwrap();
    let session = zenoh::open(config).wait().unwrap();
    let subscriber = session.declare_subscriber("anhyst/live/cut/*").wait().unwrap();
    let mut heard = None;
    // The subscription takes a moment to reach the publisher; nobody waits for that.
    for tick in 0..200 {
        keys.put(
            Channel::Measurement,
            &format!("{{\"tick\":{tick},\"displacement_m\":0.30000000000000004}}"),
        )
        .unwrap();
        if let Ok(Some(sample)) = subscriber.recv_timeout(Duration::from_millis(50)) {
            let text = sample.payload().try_to_string().unwrap().into_owned();
            heard = Some((sample.key_expr().to_string(), text));
            break;
        }
    }
    let (key, text) = heard.expect("nothing was heard");
    assert_eq!(key, "anhyst/live/cut/measurement");
    let read: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(read["displacement_m"].as_f64(), Some(0.1 + 0.2));
}
