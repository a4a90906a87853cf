//! Latencies of a link, in a histogram of fixed size.

use crate::message::{Channel, NodeId};
use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

/// Quantiles of a latency in µs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct LatencySummary {
    /// How many tokens.
    pub count: u64,
    /// Median.
    pub p50_us: f64,
    /// 99th percentile.
    pub p99_us: f64,
    /// 99.9th percentile.
    pub p999_us: f64,
    /// Largest.
    pub max_us: f64,
}

/// What a link reports at the end: sending to receiving, waiting of the reader included.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LinkReport {
    /// Channel.
    pub channel: Channel,
    /// Who read it.
    pub reader: NodeId,
    /// Sending to receiving; empty on a link within one process.
    pub latency: LatencySummary,
    /// Tokens that never came: 0 in lockstep, where a gap ends the run; in real time ticks left out by the sender count too.
    pub lost: u64,
    /// Ticks in which the token was not there in time, and an older one was taken; 0 in lockstep, which waits.
    #[serde(default)]
    pub late: u64,
}

/// A histogram of ns, 1 ns to 100 s, two digits; recording never allocates.
#[derive(Debug, Clone)]
pub struct Latency(Option<Histogram<u64>>);

impl Default for Latency {
    fn default() -> Self {
        Self::new()
    }
}

impl Latency {
    /// An empty histogram.
    pub fn new() -> Self {
        Self(Histogram::new_with_bounds(1, 100_000_000_000, 2).ok())
    }

    /// Notes one latency.
    pub fn record(&mut self, ns: u64) {
        if let Some(histogram) = &mut self.0 {
            histogram.saturating_record(ns.max(1));
        }
    }

    /// Quantiles.
    pub fn summary(&self) -> LatencySummary {
        let Some(histogram) = self.0.as_ref().filter(|h| !h.is_empty()) else {
            return LatencySummary::default();
        };
        let us = |quantile| histogram.value_at_quantile(quantile) as f64 * 1e-3;
        LatencySummary {
            count: histogram.len(),
            p50_us: us(0.5),
            p99_us: us(0.99),
            p999_us: us(0.999),
            max_us: histogram.max() as f64 * 1e-3,
        }
    }
}

/// How often a time fell between two bounds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bin {
    /// Largest time of the bin in µs; the smallest is that of the bin before.
    pub up_to_us: f64,
    /// How often.
    pub count: u64,
}

impl Latency {
    /// The histogram itself, three bins an octave from 1 µs on; bins that are empty are left out.
    pub fn bins(&self) -> Vec<Bin> {
        let third_of_an_octave = 2.0_f64.cbrt();
        let counted = self
            .0
            .iter()
            .flat_map(|histogram| histogram.iter_log(1000, third_of_an_octave));
        counted
            .map(|value| Bin {
                up_to_us: value.value_iterated_to() as f64 * 1e-3,
                count: value.count_since_last_iteration(),
            })
            .filter(|bin| bin.count > 0)
            .collect()
    }
}
