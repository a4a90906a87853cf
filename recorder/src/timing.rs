//! How the nodes of a real-time run keep time, by the moments at which they send: histograms of the time from one token of a
//! node to its next one, and of the time from the measurement of a tick to the node's answer to it.
//!
//! Bars are a twentieth of a tick wide and reach from 0 to four ticks; the last one holds whatever took longer. They grow with
//! the run: the cursor shows what had come together until then.

use crate::RecorderError;
use crate::error::Writing as _;
use crate::row::Row;
use crate::run::RunInfo;
use crate::tokens::TIMELINE;
use anhyst_ipc::{Latency, Message, NodeId};
use rerun::RecordingStream;
use rerun_types::archetypes::{BarChart, TextDocument};
use rerun_types::components::Color;

/// Where the histograms of periods are.
pub(crate) const PERIODS: &str = "timing/period";
/// Where those of answers are.
pub(crate) const ANSWERS: &str = "timing/answer";
/// Where their quantiles are.
pub(crate) const QUANTILES: &str = "timing/quantiles";

const BARS_A_TICK: f64 = 20.0;
const BARS: usize = 81;
/// Between two writings, in seconds of the run.
const PAUSE_S: f64 = 1.0;

/// One distribution: the bars for the eye, the quantiles for the table.
struct Times {
    bars: [u64; BARS],
    exact: Latency,
}

impl Times {
    fn new() -> Self {
        Self {
            bars: [0; BARS],
            exact: Latency::new(),
        }
    }

    fn note(&mut self, ns: u64, tick_s: f64) {
        self.exact.record(ns);
        let bar = (ns as f64 * 1e-9 / tick_s * BARS_A_TICK) as usize;
        self.bars[bar.min(BARS - 1)] += 1;
    }

    fn chart(&self, tick_s: f64, color: u32) -> BarChart {
        let width_us = tick_s / BARS_A_TICK * 1e6;
        let middles: Vec<f64> = (0..BARS).map(|bar| (bar as f64 + 0.5) * width_us).collect();
        BarChart::new(self.bars.as_slice())
            .with_abscissa(middles)
            .with_widths([width_us as f32; BARS])
            .with_color(Color::from_u32(color))
    }
}

/// What is known of one node.
struct Clocked {
    node: NodeId,
    color: u32,
    last: Option<(u64, u64)>,
    period: Times,
    answer: Times,
}

/// The times of all nodes that send.
pub(crate) struct Timing {
    nodes: Vec<Clocked>,
    written_s: f64,
}

impl Timing {
    pub fn new() -> Self {
        let nodes = [
            (NodeId::Plant, 0x9CA3_AFC0),
            (NodeId::Estimator, 0x22C5_5EC0),
            (NodeId::Controller, 0xA78B_FAC0),
            (NodeId::Inverse, 0x93C5_FDC0),
            (NodeId::Guard, 0xEF44_44C0),
            (NodeId::Amplifier, 0xF59E_0BC0),
        ];
        Self {
            nodes: nodes
                .map(|(node, color)| Clocked {
                    node,
                    color,
                    last: None,
                    period: Times::new(),
                    answer: Times::new(),
                })
                .into(),
            written_s: 0.0,
        }
    }

    /// Notes the times of one tick's tokens. A token that did not come is an old one: it counts once.
    pub fn row(&mut self, row: &Row, run: &RunInfo) {
        let measured = (row.measurement.tick, row.measurement.sent_ns);
        for clocked in &mut self.nodes {
            let sent = match clocked.node {
                NodeId::Plant => measured,
                NodeId::Estimator => of(&row.estimate),
                NodeId::Controller => of(&row.demand),
                NodeId::Inverse => of(&row.field_command),
                NodeId::Guard => of(&row.safe_field),
                NodeId::Amplifier => of(&row.coil_field),
                NodeId::Recorder => continue,
            };
            clocked.note(sent, measured, run.tick_s);
        }
    }

    /// Writes the histograms, if some time has passed since the last writing or `always`.
    pub fn send(
        &mut self,
        streams: &[&RecordingStream],
        run: &RunInfo,
        tick: u64,
        always: bool,
    ) -> Result<(), RecorderError> {
        let now_s = tick as f64 * run.tick_s;
        if now_s - self.written_s < PAUSE_S && !always {
            return Ok(());
        }
        self.written_s = now_s;
        let table = TextDocument::from_markdown(self.table());
        for stream in streams {
            stream.set_time(
                TIMELINE,
                std::time::Duration::from_nanos(run.time_ns(tick).max(0) as u64),
            );
            for clocked in &self.nodes {
                let name = clocked.node.name();
                let charts = [(PERIODS, &clocked.period), (ANSWERS, &clocked.answer)];
                for (place, times) in charts.into_iter().filter(|(_, times)| times.exact.summary().count > 0) {
                    let entity = format!("{place}/{name}");
                    let chart = times.chart(run.tick_s, clocked.color);
                    stream.log(entity.as_str(), &chart).writing("a histogram")?;
                }
            }
            stream.log(QUANTILES, &table).writing("the quantiles")?;
            stream.reset_time();
        }
        Ok(())
    }

    fn table(&self) -> String {
        let mut table = String::from(
            "| µs | period p50 | p99 | longest | answer p50 | p99 | longest |\n|---|---|---|---|---|---|---|\n",
        );
        for clocked in &self.nodes {
            table.push_str(&format!("| {} |", clocked.node.name()));
            for summary in [clocked.period.exact.summary(), clocked.answer.exact.summary()] {
                let figures = [summary.p50_us, summary.p99_us, summary.max_us];
                table.extend(figures.map(|us| match summary.count {
                    0 => " – |".to_owned(),
                    _ => format!(" {us:.0} |"),
                }));
            }
            table.push('\n');
        }
        table
    }
}

fn of<M: Message>(token: &M) -> (u64, u64) {
    (token.tick(), token.sent_ns())
}

impl Clocked {
    fn note(&mut self, (tick, sent_ns): (u64, u64), measured: (u64, u64), tick_s: f64) {
        // A token that was never sent has no time.
        if sent_ns == 0 || self.last.is_some_and(|(last, _)| tick <= last) {
            return;
        }
        if let Some((_, last_ns)) = self.last {
            self.period.note(sent_ns.saturating_sub(last_ns), tick_s);
        }
        if self.node != NodeId::Plant && tick == measured.0 && measured.1 != 0 {
            self.answer.note(sent_ns.saturating_sub(measured.1), tick_s);
        }
        self.last = Some((tick, sent_ns));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anhyst_ipc::{CoilField, Measurement};
    use rerun::RecordingStreamBuilder;
    use rerun::log::{Chunk, LogMsg};

    const TICK_S: f64 = 5e-4;

    fn run() -> RunInfo {
        RunInfo {
            path: "unused.rrd".into(),
            realtime: true,
            run_id: "timing".into(),
            name: "timing".into(),
            notes: String::new(),
            tick_s: TICK_S,
            tolerance_m: 1e-6,
            settling_time_s: 0.0,
            period_s: None,
            parameter_range: [6300.0, 7300.0],
            material: [7.65e5, 4000.0, 0.18],
            scales: crate::Scales::default(),
            field_limit_a_per_m: 1e4,
            lowest_field_a_per_m: -1e4,
            events: Vec::new(),
        }
    }

    /// Ticks of half a millisecond; the amplifier answers after 130 µs, is missing at tick 6, and late by 3 ms at tick 7.
    fn rows() -> impl Iterator<Item = Row> {
        (0..10).map(|tick| {
            let sent_ns = 1_000_000 + tick * 500_000;
            let mut row = Row { tick, ..Row::default() };
            Measurement::stamp(&mut row.measurement, tick, sent_ns);
            let (answered, after_ns) = match tick {
                6 => (5, 130_000 - 500_000),
                7 => (7, 3_000_000),
                _ => (tick, 130_000),
            };
            CoilField::stamp(&mut row.coil_field, answered, (sent_ns as i64 + after_ns) as u64);
            row
        })
    }

    // Guards that each answer counts once, in the bar of its time, and that what took long is not cut off.
    #[test]
    fn every_answer_is_in_its_bar() {
        let (mut timing, run) = (Timing::new(), run());
        rows().for_each(|row| timing.row(&row, &run));
        let of = |node| timing.nodes.iter().find(|clocked| clocked.node == node).unwrap();
        let (plant, amplifier) = (of(NodeId::Plant), of(NodeId::Amplifier));
        assert_eq!(plant.period.bars[20], 9);
        assert_eq!(plant.answer.bars.iter().sum::<u64>(), 0);
        // 130 µs of 25 µs each.
        assert_eq!(amplifier.answer.bars[5], 8);
        assert_eq!(amplifier.answer.bars[BARS - 1], 1);
        assert_eq!(amplifier.period.bars.iter().sum::<u64>(), 8);
        let table = timing.table();
        let line = table.lines().find(|line| line.starts_with("| amplifier")).unwrap();
        let figures: Vec<f64> = line.split('|').filter_map(|cell| cell.trim().parse().ok()).collect();
        let [_, _, _, median, _, longest] = figures[..] else {
            panic!("{line}")
        };
        // Two digits are kept.
        assert!(
            (median / 130.0 - 1.0).abs() < 0.01 && (longest / 3000.0 - 1.0).abs() < 0.01,
            "{line}"
        );
        assert!(table.contains("| guard | – |"), "{table}");
    }

    // Guards that the histograms are written for the nodes that sent, and for no others.
    #[test]
    fn histograms_are_recorded() {
        let (mut timing, run) = (Timing::new(), run());
        rows().for_each(|row| timing.row(&row, &run));
        let (stream, storage) = RecordingStreamBuilder::new("test").enabled(true).memory().unwrap();
        let written = || {
            stream.flush_blocking().unwrap();
            let mut entities: Vec<String> = storage
                .take()
                .iter()
                .filter_map(|message| match message {
                    LogMsg::ArrowMsg(_, arrow) => Some(Chunk::from_arrow_msg(arrow).unwrap().entity_path().to_string()),
                    _ => None,
                })
                .filter(|entity| entity.contains("timing"))
                .collect();
            entities.sort();
            entities.dedup();
            entities
        };
        timing.send(&[&stream], &run, 9, false).unwrap();
        assert_eq!(written(), Vec::<String>::new());
        timing.send(&[&stream], &run, 9, true).unwrap();
        let expected = ["answer/amplifier", "period/amplifier", "period/plant-sim", "quantiles"];
        assert_eq!(written(), expected.map(|entity| format!("/timing/{entity}")));
    }
}
