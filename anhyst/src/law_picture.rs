//! A law on measured data as a picture (SVG text): output over input, measured and modelled, and what is left.

use anhyst_identify::laws::LawData;
use anhyst_report::ReportError;
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role};

/// `modelled`: one series a record.
pub fn picture(title: &str, data: &LawData, modelled: &[Vec<f64>]) -> Result<String, ReportError> {
    let timed = data.has_time();
    let input = || Axis::new(data.input.name(), data.input.unit());
    let along = || if timed { Axis::new("time", "s") } else { input() };
    let mut curves = Chart::new(title, input(), Axis::new(data.output.name(), data.output.unit()));
    let mut left = Chart::new(
        "what is left",
        along(),
        Axis::new("model − measured", data.output.unit()),
    );
    for (index, (record, made)) in data.records.iter().zip(modelled).enumerate() {
        // One entry in the legend speaks for all records.
        let named = |line: Curve, name: &str| if index == 0 { line.named(name) } else { line };
        curves.curves.extend([
            named(Curve::over(&record.input, &record.output, Role::Measured), "measured"),
            named(Curve::over(&record.input, made, Role::Nominal), "model"),
        ]);
        let differences: Vec<f64> = made
            .iter()
            .zip(&record.output)
            .map(|(made, seen)| made - seen)
            .collect();
        let over = record.time_s.as_ref().filter(|_| timed).unwrap_or(&record.input);
        left.curves.push(Curve::over(over, &differences, Role::Remainder));
    }
    Figure::new("", vec![curves, left]).svg()
}
