//! Latencies of a link, in a histogram of fixed size.

use crate::{Channel, NodeId};
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
    /// Tokens that never came (always 0 in lockstep: a gap ends the run).
    pub lost: u64,
}

/// A histogram of ns, 1 ns to 100 s, two digits; recording never allocates.
#[derive(Debug, Clone)]
pub struct Latency(Option<Histogram<u64>>);

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
