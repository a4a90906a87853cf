//! The pictures of the report: Bode plot, small step, limits, latencies, recovery, the end.

use super::expectation::Expectation;
use super::judge::{Curves, Evidence, Response};
use super::program::{Part, Segment};
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role};
use num_complex::Complex64;

/// A picture and what it shows.
pub struct Picture {
    /// Heading.
    pub title: &'static str,
    /// What is drawn.
    pub figure: Figure,
    /// How to read it.
    pub caption: &'static str,
}

const LATENCY_CLASSES: usize = 80;

/// Those for which there is something to draw.
pub fn pictures(evidence: &Evidence, curves: &Curves) -> Vec<Picture> {
    let pictures = [
        bode(evidence.expected, &curves.response),
        step(evidence.expected, curves),
        limits(evidence),
        recovery(evidence),
        end(evidence),
        latency(evidence),
    ];
    pictures.into_iter().flatten().collect()
}

fn measured(points: Vec<(f64, f64)>) -> Curve {
    Curve::new(points, Role::Measured).named("this process")
}

fn expected(points: Vec<(f64, f64)>) -> Curve {
    Curve::new(points, Role::Nominal).named("expected").dashed()
}

fn bode(expectation: &Expectation, responses: &[Response]) -> Option<Picture> {
    let first = responses.first()?;
    let points = |of: &dyn Fn(&Response) -> f64| -> Vec<(f64, f64)> {
        responses
            .iter()
            .map(|response| (response.frequency_hz, of(response)))
            .collect()
    };
    let decibel = |value: Complex64, at_rest: Complex64| 20.0 * (value.norm() / at_rest.norm()).log10();
    let frequency = || Axis::new("frequency", "Hz").logarithmic();
    let (rest, model_rest) = (first.measured, first.expected);
    let mut gain = Chart::new("Gain", frequency(), Axis::new("gain", "dB"))
        .curve(measured(points(&|response| decibel(response.measured, rest))))
        .curve(expected(points(&|response| decibel(response.expected, model_rest))))
        .horizontal(-3.0103, Role::Limit, "−3 dB");
    if let Some(bandwidth_hz) = expectation.amplifier.bandwidth_hz {
        gain = gain.vertical(bandwidth_hz, Role::Limit, "stated");
    }
    let phase = Chart::new("Phase", frequency(), Axis::new("phase", "°"))
        .curve(measured(unwrapped(points(&|response| response.measured.arg()))))
        .curve(expected(unwrapped(points(&|response| response.expected.arg()))));
    Some(Picture {
        title: "Frequency response",
        figure: Figure::new("", vec![gain, phase]),
        caption: "Stepped sine, small signal. The phase holds the delay of computing and hold that every loop has.",
    })
}

/// Phases in degrees without jumps of a turn.
fn unwrapped(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let turn = 2.0 * core::f64::consts::PI;
    let mut last = 0.0;
    let unwrapped = points.into_iter().map(|(frequency_hz, phase)| {
        last = phase + turn * ((last - phase) / turn).round();
        (frequency_hz, f64::to_degrees(last))
    });
    unwrapped.collect()
}

fn step(expectation: &Expectation, curves: &Curves) -> Option<Picture> {
    let response = curves.step.as_ref()?;
    // The field of a token is that of the end of its tick.
    let points = |values: &[f64]| {
        let times = (1..).map(|tick| f64::from(tick) * expectation.tick_s);
        times.zip(values.iter().copied()).take(60).collect()
    };
    let panel = Chart::new(
        "",
        Axis::new("time since the step", "s"),
        Axis::new("field over step", ""),
    )
    .curve(measured(points(&response.measured)))
    .curve(expected(points(&response.expected)));
    Some(Picture {
        title: "Small step",
        figure: Figure::new("", vec![panel]),
        caption: "Mean of eight steps by a tenth of the range.",
    })
}

fn limits(evidence: &Evidence) -> Option<Picture> {
    let ticks = span(evidence.program.of(Part::Limit).chain(evidence.program.of(Part::Slew)))?;
    let mut panel = over_time(evidence, ticks)?;
    if let Some(limit) = evidence.expected.amplifier.field_limit_a_per_m {
        panel = panel
            .horizontal(limit, Role::Limit, "limit")
            .horizontal(-limit, Role::Limit, "limit");
    }
    Some(Picture {
        title: "Amplitude and slew",
        figure: Figure::new("", vec![panel]),
        caption: "Commands beyond the limit, then from one end of the range to the other.",
    })
}

fn recovery(evidence: &Evidence) -> Option<Picture> {
    let ticks = span(
        evidence
            .program
            .of(Part::Nonsense)
            .chain(evidence.program.of(Part::Back)),
    )?;
    let mut panel = over_time(evidence, ticks)?;
    let range = evidence.expected.range_a_per_m;
    panel.y = panel.y.between(-1.2 * range, 1.2 * range);
    for segment in evidence.program.of(Part::Nonsense) {
        let at = segment.ticks.start as f64 * evidence.expected.tick_s;
        let command = evidence.program.commands[segment.ticks.start];
        panel = panel.vertical(at, Role::Limit, &format!("{command:e}").replace("inf", "∞"));
    }
    Some(Picture {
        title: "Commands that are no numbers",
        figure: Figure::new("", vec![panel]),
        caption: "Between them the command is a fifth of the range; each marker is a broken command, five ticks long.",
    })
}

fn span<'a>(segments: impl Iterator<Item = &'a Segment>) -> Option<std::ops::Range<usize>> {
    segments
        .map(|segment| segment.ticks.clone())
        .reduce(|one, other| one.start.min(other.start)..one.end.max(other.end))
}

fn over_time(evidence: &Evidence, ticks: std::ops::Range<usize>) -> Option<Chart> {
    let fields = evidence.transcript.fields(&ticks)?;
    let times: Vec<f64> = ticks
        .clone()
        .map(|tick| tick as f64 * evidence.expected.tick_s)
        .collect();
    let model: Vec<f64> = evidence.model[ticks.clone()]
        .iter()
        .map(|output| output.field_a_per_m)
        .collect();
    let points = |values: &[f64]| times.iter().copied().zip(values.iter().copied()).collect::<Vec<_>>();
    // A command of 1e300 A/m is far outside of every picture; a drawing has no room for the way there.
    let most = 3.0 * evidence.expected.range_a_per_m;
    let commands: Vec<f64> = evidence.program.commands[ticks]
        .iter()
        .map(|command| command.clamp(-most, most))
        .collect();
    let commands = Curve::new(points(&commands), Role::Limit).named("command");
    let panel = Chart::new("", Axis::new("time in the loop", "s"), Axis::new("field", "A/m"))
        .curve(commands)
        .curve(measured(points(&fields)))
        .curve(expected(points(&model)));
    Some(panel)
}

fn end(evidence: &Evidence) -> Option<Picture> {
    let aftermath = evidence.aftermath?;
    let last = evidence.program.of(Part::Last).next()?;
    let before = evidence
        .transcript
        .fields(&last.judged)
        .and_then(|fields| fields.last().copied())?;
    let points: Vec<(f64, f64)> = std::iter::once((0.0, before))
        .chain(aftermath.answers.iter().copied())
        .collect();
    let panel = Chart::new(
        "",
        Axis::new("time since the last command", "s"),
        Axis::new("field", "A/m"),
    )
    .curve(
        Curve::new(points.clone(), Role::Measured)
            .named("this process")
            .as_points(),
    )
    .curve(Curve::new(points, Role::Measured))
    .horizontal(evidence.expected.safe_field_a_per_m, Role::Limit, "safe field")
    .vertical(evidence.expected.silence_s, Role::Limit, "silence");
    Some(Picture {
        title: "When the controller dies",
        figure: Figure::new("", vec![panel]),
        caption: "Answers by the wall clock, after the commands have ended. A simulated amplifier goes the whole way at once.",
    })
}

fn latency(evidence: &Evidence) -> Option<Picture> {
    let latencies_s = &evidence.transcript.latencies_s;
    let shortest = latencies_s.iter().copied().fold(f64::INFINITY, f64::min).max(1e-8);
    let longest = latencies_s.iter().copied().fold(0.0, f64::max).max(1.01 * shortest);
    if latencies_s.is_empty() {
        return None;
    }
    let mut counts = vec![0_u32; LATENCY_CLASSES];
    let width = (longest / shortest).ln() / LATENCY_CLASSES as f64;
    for latency in latencies_s {
        let class = ((latency / shortest).ln() / width).max(0.0) as usize;
        counts[class.min(LATENCY_CLASSES - 1)] += 1;
    }
    // A staircase: each class from its left to its right edge.
    let edge = |class: usize| shortest * (width * class as f64).exp();
    let points = counts.iter().enumerate().flat_map(|(class, count)| {
        let height = f64::from(*count);
        [(edge(class), height), (edge(class + 1), height)]
    });
    let axis = Axis::new("from command to answer", "s").logarithmic();
    let panel = Chart::new("", axis, Axis::new("answers", ""))
        .curve(measured(points.collect()))
        .vertical(evidence.expected.tick_s, Role::Limit, "one tick");
    Some(Picture {
        title: "Latency",
        figure: Figure::new("", vec![panel]),
        caption: "Wall clock, on this machine as it was loaded during the run.",
    })
}
