//! What the recorder has to know about a scenario.

use crate::error::RunError;
use crate::folder::RunFolder;
use crate::scribe::Scribe;
use anhyst_controller::TrajectorySettings;
use anhyst_estimator::LawSettings;
use anhyst_guard::Event;
use anhyst_recorder::{EventName, Level, Recorder, RecorderSettings, RunInfo, Scales};
use anhyst_scenario::Scenario;

/// Adds a recorder to the scribe; one that takes the place of a dead one (`rejoins`) leaves that one's recording alone.
///
/// # Errors
/// If the recording cannot be created.
pub fn add(scribe: Scribe, scenario: &Scenario, folder: &RunFolder, rejoins: bool) -> Result<Scribe, RunError> {
    let recording = scenario.recording;
    let settings = RecorderSettings {
        block_ticks: recording.block_ticks,
        plot_rate_hz: recording.plot_rate_hz,
        part_mb: recording.part_mb,
        part_s: recording.part_s,
        ring_s: recording.ring_s,
        error_axis_nm: recording.error_axis_nm,
        live: recording.live_port,
        ..RecorderSettings::default()
    };
    Ok(scribe.with_recorder(Recorder::create(&settings, run_info(scenario, folder, rejoins)?)?))
}

fn run_info(scenario: &Scenario, folder: &RunFolder, rejoins: bool) -> Result<RunInfo, RunError> {
    let hysteresis = scenario.believed_model()?.material.hysteresis;
    let shape = hysteresis.shape_a_per_m;
    let parameter_range = match scenario.estimator.law {
        LawSettings::FixedShape { .. } | LawSettings::Weights(_) | LawSettings::FixedWeights => {
            [0.9 * shape, 1.1 * shape]
        }
        adaptive => adaptive.range_a_per_m().into(),
    };
    let [lowest_field_a_per_m, field_limit_a_per_m] = scenario.guard.field_ends_a_per_m();
    Ok(RunInfo {
        path: if rejoins {
            folder.next_recording()
        } else {
            folder.recording()
        },
        run_id: format!("{}-{:x}", scenario.name, anhyst_ipc::monotonic_ns()),
        name: scenario.name.clone(),
        notes: String::new(),
        tick_s: scenario.tick_s,
        // A band that is no number is not drawn.
        tolerance_m: scenario.expect.tolerance_m.unwrap_or(f64::NAN),
        settling_time_s: scenario.expect.settling_s,
        period_s: period_s(&scenario.controller.trajectory),
        parameter_range,
        material: [
            hysteresis.saturation_magnetization_a_per_m,
            hysteresis.pinning_a_per_m,
            hysteresis.reversibility,
        ],
        realtime: scenario.clock.realtime().is_some(),
        scales: match &scenario.units() {
            units if units.shape => Scales::default(),
            units => Scales::of_law(&units.input, &units.output),
        },
        lowest_field_a_per_m,
        field_limit_a_per_m,
        events: Event::ALL
            .into_iter()
            .map(|event| EventName {
                number: event.number(),
                text: event.name().replace('_', " "),
                level: if !event.is_fault() {
                    Level::Warning
                } else {
                    Level::Error
                },
            })
            .collect(),
    })
}

/// Period of the slowest part of a reference that repeats.
fn period_s(trajectory: &TrajectorySettings) -> Option<f64> {
    let slowest = |frequencies: &mut dyn Iterator<Item = f64>| frequencies.min_by(f64::total_cmp);
    let frequency_hz = match trajectory {
        TrajectorySettings::Harmonics { terms, .. } => slowest(&mut terms.iter().map(|(_, hz, _)| *hz)),
        TrajectorySettings::Profile { spindle_rpm, lobes, .. } => {
            slowest(&mut lobes.iter().map(|(lobe, _, _)| f64::from(*lobe) * spindle_rpm / 60.0))
        }
        TrajectorySettings::Triangle(own) => Some(own.frequency_hz),
        TrajectorySettings::Sawtooth(own) => Some(own.frequency_hz),
        _ => None,
    };
    frequency_hz.map(|hz| 1.0 / hz)
}
