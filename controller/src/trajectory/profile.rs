//! r(t) = mean + Σ A·sin(n·θ(t) + φ),  θ(t) = 2π·(rpm/60)·t: the radius of a turning non-circular workpiece at the tool.
//!
//! n lobes per revolution, A in m, φ in rad. At a constant speed this is a sum of harmonics of the spindle, and built as one;
//! where the speed changes, see `spindle.rs`.

use super::harmonics::{Harmonics, unless_sampled};
use super::spindle::SpeedChange;
use anhyst_ipc::Invalid;

fn frequency_hz(spindle_rpm: f64, lobe: u32) -> f64 {
    spindle_rpm / 60.0 * f64::from(lobe)
}

/// The same motion in harmonics of time.
pub(crate) fn harmonics(spindle_rpm: f64, mean_m: f64, lobes: &[(u32, f64, f64)]) -> Harmonics {
    let terms: Vec<_> = lobes
        .iter()
        .map(|&(lobe, amplitude_m, phase)| (amplitude_m, frequency_hz(spindle_rpm, lobe), phase))
        .collect();
    Harmonics::new(mean_m, &terms)
}

/// Refuses a workpiece that does not turn, a lobe of number 0 (that is the mean), and what cannot be sampled.
pub(crate) fn validate(
    spindle_rpm: f64,
    mean_m: f64,
    lobes: &[(u32, f64, f64)],
    changes: &[SpeedChange],
    tick_s: f64,
) -> Result<(), Invalid> {
    Invalid::unless_positive("spindle_rpm", spindle_rpm, "rpm")?;
    let mut from_s = 0.0;
    let mut fastest_rpm = spindle_rpm;
    for (index, change) in changes.iter().enumerate() {
        let within = |own: Invalid| own.within(&format!("speed_changes.{index}"));
        Invalid::unless_positive("rpm", change.rpm, "rpm").map_err(within)?;
        Invalid::unless_positive("over_s", change.over_s, "s").map_err(within)?;
        Invalid::unless_between("at_s", change.at_s, from_s, 1e9, "s").map_err(within)?;
        from_s = change.at_s + change.over_s;
        fastest_rpm = fastest_rpm.max(change.rpm);
    }
    if !mean_m.is_finite() {
        return Err(Invalid::new("mean_m", format!("{mean_m} m must be finite")));
    }
    for (index, &(lobe, amplitude_m, phase)) in lobes.iter().enumerate() {
        let path = format!("lobes.{index}");
        if lobe == 0 {
            return Err(Invalid::new(path, "lobe number 0 does not turn: write it as mean_m"));
        }
        if !amplitude_m.is_finite() || !phase.is_finite() {
            return Err(Invalid::new(
                path,
                format!("amplitude {amplitude_m} m and phase {phase} rad must be finite"),
            ));
        }
        unless_sampled(&path, frequency_hz(fastest_rpm, lobe), tick_s)?;
    }
    Ok(())
}
