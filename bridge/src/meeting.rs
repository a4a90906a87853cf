//! Before the loop: the bridges meet, compare what they were told, and measure the link.

use crate::error::BridgeError;
use crate::handshake::Handshake;
use crate::round_trip::{COUNT, Plain, WARM_UP};
use crate::round_trip::{Quantiles, RoundTrips};
use crate::session::{Incoming, Session, next};
use crate::settings::{BridgeSettings, End};
use anhyst_ipc::stop_requested;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

/// Between two introductions while nobody answers.
const AGAIN: Duration = Duration::from_millis(100);
const LOOK: Duration = Duration::from_millis(20);
/// How often a refusal is repeated, so that the other side refuses, too, instead of waiting.
const REPEATS: usize = 10;

/// Waits for what `wanted` takes from the other bridge, at most the start limit; `meanwhile` is done every 20 ms.
fn wait_for<T>(
    settings: &BridgeSettings,
    incoming: &Receiver<Incoming>,
    meanwhile: &mut dyn FnMut() -> Result<(), BridgeError>,
    wanted: &mut dyn FnMut(Incoming) -> Result<Option<T>, BridgeError>,
) -> Result<T, BridgeError> {
    let start = Instant::now();
    loop {
        if stop_requested() {
            return Err(BridgeError::Stopped);
        }
        if start.elapsed() > settings.start_limit {
            return Err(BridgeError::NoBridge {
                endpoint: settings.end.endpoint().into(),
                waited_s: start.elapsed().as_secs_f64(),
            });
        }
        meanwhile()?;
        if let Ok(message) = next(incoming, settings.yields, LOOK)
            && let Some(taken) = wanted(message)?
        {
            return Ok(taken);
        }
    }
}

/// Meets the other bridge and compares.
///
/// # Errors
/// If it does not come, or was told something else.
pub fn greet(
    settings: &BridgeSettings,
    session: &Session,
    incoming: &Receiver<Incoming>,
    mut own: Handshake,
) -> Result<Handshake, BridgeError> {
    let mut sent: Option<Instant> = None;
    let handshake = std::cell::RefCell::new(&mut own);
    let other = wait_for(
        settings,
        incoming,
        &mut || {
            if sent.is_none_or(|sent| sent.elapsed() > AGAIN) {
                session.handshake(&handshake.borrow())?;
                sent = Some(Instant::now());
            }
            Ok(())
        },
        &mut |message| {
            let Incoming::Handshake(other) = message else {
                return Ok(None);
            };
            // Once each side knows that the other has heard it, the link works both ways.
            handshake.borrow_mut().heard = true;
            session.handshake(&handshake.borrow())?;
            Ok(other.heard.then_some(*other))
        },
    )?;
    if let Err(refusal) = own.compare(&other) {
        for _ in 0..REPEATS {
            session.handshake(&own)?;
            std::thread::sleep(LOOK);
        }
        return Err(refusal);
    }
    Ok(other)
}

/// Measures the round trip (connecting side) or hears what it was (listening side).
///
/// # Errors
/// If an echo does not come.
pub fn measure(
    settings: &BridgeSettings,
    session: &Session,
    incoming: &Receiver<Incoming>,
    other: &Handshake,
) -> Result<RoundTrips, BridgeError> {
    let End::Connect(_) = settings.end else {
        let mut nothing = || Ok(());
        return wait_for(settings, incoming, &mut nothing, &mut |message| {
            // The echo takes the way of a token: from Zenoh's thread to the bridge's, and out again.
            if let Incoming::Echo = message {
                session.echo()?;
            }
            Ok(match message {
                Incoming::Measured(round_trips) => Some(round_trips),
                _ => None,
            })
        });
    };
    let host = settings.end.host().unwrap_or_default();
    let mut plain = Plain::connect(host, other.echo_port, settings.receive_limit)?;
    let mut zenoh_times = Vec::with_capacity(COUNT);
    let mut tcp_times = Vec::with_capacity(COUNT);
    for count in 0..WARM_UP + COUNT {
        if stop_requested() {
            return Err(BridgeError::Stopped);
        }
        let zenoh = ping(settings, session, incoming)?;
        let tcp = plain.round_trip()?;
        if count >= WARM_UP {
            zenoh_times.push(zenoh);
            tcp_times.push(tcp);
        }
    }
    let round_trips = RoundTrips {
        zenoh: Quantiles::of(zenoh_times),
        tcp: Quantiles::of(tcp_times),
    };
    session.measured(&round_trips)?;
    Ok(round_trips)
}

fn ping(settings: &BridgeSettings, session: &Session, incoming: &Receiver<Incoming>) -> Result<Duration, BridgeError> {
    let start = Instant::now();
    session.echo()?;
    loop {
        match next(incoming, settings.yields, settings.receive_limit) {
            Ok(Incoming::Echo) => return Ok(start.elapsed()),
            // The last introductions may still be on their way.
            Ok(_) => {}
            Err(_) => {
                return Err(BridgeError::Silent {
                    processes: "the other side".into(),
                    waited_s: start.elapsed().as_secs_f64(),
                    limit_s: settings.receive_limit.as_secs_f64(),
                });
            }
        }
    }
}
