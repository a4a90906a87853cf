//! The loop's shape for people: a table of its margins, and L, S and T over frequency.

use anhyst_controller::{LoopShape, Margins};
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role};
use anhyst_report::number::{Digits, Si};
use anhyst_report::page::Section;
use anhyst_report::table::Table;
use anhyst_scenario::Scenario;

const FROM_HZ: f64 = 1.0;
const POINTS: u32 = 500;

/// The section of a page; none where there is no feedback, and so no loop.
pub fn loop_section(scenario: &Scenario) -> Option<Section> {
    scenario.controller.feedback.as_ref()?;
    let shape = scenario.loop_shape().ok()?;
    let caption = "The linear loop as the scenario believes it: PID, rod, hold, delays of computing, amplifier and known effects, the \
                   hysteresis inverted exactly. What adapts or learns is not in it.";
    Some(
        Section::new("Loop")
            .table(margins_table(&shape.margins()))
            .figure(figure(&shape), caption),
    )
}

/// The margins, as rows.
pub fn margins_table(margins: &Margins) -> Table {
    let digits = |value: f64| Digits(value, 3).to_string();
    let hertz = |value: f64| Si(value, "Hz").to_string();
    let mut table = Table::default();
    let mut row = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            table.push([name.to_owned(), value]);
        }
    };
    row("gain margin", margins.gain.map(|gain| format!("× {}", digits(gain))));
    let crossover = margins.crossover_hz.map(hertz).unwrap_or_default();
    row(
        "phase margin",
        margins
            .phase_rad
            .map(|phase| format!("{}° at {crossover}", digits(phase.to_degrees()))),
    );
    row("delay margin", margins.delay_s.map(|delay| Si(delay, "s").to_string()));
    let largest = |own: anhyst_controller::Largest| format!("{} at {}", digits(own.value), hertz(own.frequency_hz));
    row("largest sensitivity Ms", Some(largest(margins.sensitivity)));
    row("largest of T, Mt", Some(largest(margins.complementary)));
    row("errors made smaller below", margins.rejects_below_hz.map(hertz));
    table
}

fn figure(shape: &LoopShape) -> Figure {
    let points = shape.points(FROM_HZ, POINTS);
    let frequency = || Axis::new("frequency", "Hz").logarithmic();
    let curve = |name: &str, of: fn(&anhyst_controller::LoopPoint) -> f64| {
        Curve::of(name, points.iter().map(|own| [own.frequency_hz, of(own)]))
    };
    let sizes = Chart::new("magnitude", frequency(), Axis::new("magnitude", "").logarithmic()).series([
        curve("|L| open", |own| own.open),
        curve("|S| sensitivity", |own| own.sensitivity),
        curve("|T| complementary", |own| own.complementary),
    ]);
    let phase = Chart::new("phase of L", frequency(), Axis::new("phase", "°"))
        .series([curve("arg L", |own| own.phase_rad.to_degrees())])
        .horizontal(-180.0, Role::Limit, "−180°");
    Figure::new("Loop shape", vec![sizes, phase]).columns(2)
}
