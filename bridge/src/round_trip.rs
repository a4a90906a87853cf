//! Round trips over the link: how they are summed up, and the plain TCP connection that Zenoh is compared with.

use crate::error::BridgeError;
use serde::{Deserialize, Serialize};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

/// How many round trips are measured after the warm-up.
pub const COUNT: usize = 1000;
/// Round trips that are not counted: connections and caches warm up.
pub const WARM_UP: usize = 100;
/// What travels: as long as the longest usual token.
pub const BYTES: usize = 128;

/// Quantiles of round trips in µs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Quantiles {
    /// Median.
    pub p50_us: f64,
    /// 99th percentile.
    pub p99_us: f64,
    /// Largest.
    pub max_us: f64,
}

impl Quantiles {
    /// Of these times; all zero of none.
    pub fn of(mut times: Vec<Duration>) -> Self {
        times.sort_unstable();
        let at = |share: f64| {
            let index = (times.len() as f64 * share) as usize;
            let time = times.get(index.min(times.len().saturating_sub(1)));
            time.map_or(0.0, |time| time.as_secs_f64() * 1e6)
        };
        Self {
            p50_us: at(0.5),
            p99_us: at(0.99),
            max_us: at(1.0),
        }
    }
}

impl std::fmt::Display for Quantiles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { p50_us, p99_us, max_us } = self;
        write!(f, "p50 {p50_us:.0} µs, p99 {p99_us:.0} µs, max {max_us:.0} µs")
    }
}

/// What was measured before the loop started, by the connecting side, in turns.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct RoundTrips {
    /// Bridge to bridge and back over Zenoh.
    pub zenoh: Quantiles,
    /// The same bytes over plain TCP (no delay) on the same link.
    pub tcp: Quantiles,
}

impl RoundTrips {
    /// The median over Zenoh in medians over plain TCP.
    pub fn ratio(&self) -> f64 {
        self.zenoh.p50_us / self.tcp.p50_us
    }

    /// Refuses a link that is too slow.
    ///
    /// # Errors
    /// If the 99th percentile over Zenoh exceeds the budget.
    pub fn check(&self, budget_us: f64) -> Result<(), BridgeError> {
        if self.zenoh.p99_us > budget_us {
            return Err(BridgeError::Budget {
                p99_us: self.zenoh.p99_us,
                budget_us,
            });
        }
        Ok(())
    }
}

fn tcp(error: std::io::Error) -> BridgeError {
    BridgeError::Tcp {
        cause: error.to_string(),
    }
}

/// Echoes what comes on one connection to a free port of `host`, in its own thread; returns the port.
///
/// # Errors
/// If the port cannot be opened.
pub fn echo(host: &str) -> Result<u16, BridgeError> {
    let listener = TcpListener::bind((host, 0)).map_err(tcp)?;
    let port = listener.local_addr().map_err(tcp)?.port();
    std::thread::spawn(move || {
        // Whoever measures notices an echo that fails; the thread ends with the connection or with the process.
        let Ok((mut stream, _)) = listener.accept() else { return };
        let mut buffer = [0; BYTES];
        let _ = stream.set_nodelay(true);
        while stream.read_exact(&mut buffer).is_ok() && stream.write_all(&buffer).is_ok() {}
    });
    Ok(port)
}

/// The measuring end of the plain connection.
pub struct Plain(TcpStream);

impl Plain {
    /// Connects to an [`echo`].
    ///
    /// # Errors
    /// If nobody listens there.
    pub fn connect(host: &str, port: u16, limit: Duration) -> Result<Self, BridgeError> {
        let stream = TcpStream::connect((host, port)).map_err(tcp)?;
        stream.set_nodelay(true).map_err(tcp)?;
        stream.set_read_timeout(Some(limit)).map_err(tcp)?;
        Ok(Self(stream))
    }

    /// One round trip.
    ///
    /// # Errors
    /// If the echo does not come within the limit.
    pub fn round_trip(&mut self) -> Result<Duration, BridgeError> {
        let mut buffer = [0; BYTES];
        let start = Instant::now();
        self.0.write_all(&buffer).map_err(tcp)?;
        self.0.read_exact(&mut buffer).map_err(tcp)?;
        Ok(start.elapsed())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards the quantiles that the budget is compared with.
    #[test]
    fn quantiles_are_of_the_sorted_times() {
        let times = (1..=1000).rev().map(Duration::from_micros).collect();
        let quantiles = Quantiles::of(times);
        assert_eq!(quantiles.p50_us.round(), 501.0);
        assert_eq!(quantiles.p99_us.round(), 991.0);
        assert_eq!(quantiles.max_us.round(), 1000.0);
        assert_eq!(Quantiles::of(Vec::new()), Quantiles::default());
    }

    // Guards the refusal of a link that the loop cannot be closed over.
    #[test]
    fn a_slow_link_is_refused() {
        let slow = RoundTrips {
            zenoh: Quantiles {
                p50_us: 100.0,
                p99_us: 300.0,
                max_us: 900.0,
            },
            tcp: Quantiles {
                p50_us: 40.0,
                ..Quantiles::default()
            },
        };
        slow.check(300.0).unwrap();
        let sentence = slow.check(250.0).unwrap_err().to_string();
        assert!(sentence.contains("300 µs") && sentence.contains("250 µs"), "{sentence}");
        assert_eq!(slow.ratio(), 2.5);
    }

    // Guards the yardstick: what is sent comes back.
    #[test]
    fn plain_tcp_echoes() {
        let port = echo("127.0.0.1").unwrap();
        let mut plain = Plain::connect("127.0.0.1", port, Duration::from_secs(5)).unwrap();
        for _ in 0..3 {
            plain.round_trip().unwrap();
        }
    }
}
