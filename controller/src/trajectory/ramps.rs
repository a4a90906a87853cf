//! r(t) = pᵢ + (pᵢ₊₁ − pᵢ)·S((t − tᵢ)/(tᵢ₊₁ − tᵢ)) on [tᵢ, tᵢ₊₁], with S the blend of `blend.rs`; constant before and after.
//!
//! p in m, t in s. Four derivatives are continuous, and zero in every point.

use super::blend::Blend;
use super::jet::Jet;
use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Points and the smooth ways between them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct SmoothRamps {
    /// Time (s), position (m).
    points: Vec<(f64, f64)>,
}

impl SmoothRamps {
    pub fn new(points: &[(f64, f64)]) -> Self {
        Self {
            points: points.to_vec(),
        }
    }

    pub fn at(&self, time_s: f64) -> Jet {
        let next = self.points.partition_point(|&(point_s, _)| point_s <= time_s);
        let before = next.checked_sub(1).and_then(|index| self.points.get(index));
        match (before, self.points.get(next)) {
            (Some(&(from_s, from_m)), Some(&(to_s, to_m))) => Jet::constant(from_m).plus(
                Blend {
                    from_s,
                    length_s: to_s - from_s,
                }
                .at(time_s)
                .scaled(to_m - from_m),
            ),
            (Some(&(_, position_m)), None) | (None, Some(&(_, position_m))) => Jet::constant(position_m),
            (None, None) => Jet::default(),
        }
    }
}

/// Refuses no points, times that do not rise by a tick at least, and what is not finite.
pub(crate) fn validate(points: &[(f64, f64)], tick_s: f64) -> Result<(), Invalid> {
    if points.is_empty() {
        return Err(Invalid::new(
            "points",
            "0 points make no ramp: give at least 1, or the trajectory Rest",
        ));
    }
    for (index, &(time_s, position_m)) in points.iter().enumerate() {
        let path = format!("points.{index}");
        if !time_s.is_finite() || !position_m.is_finite() {
            return Err(Invalid::new(
                path,
                format!("time {time_s} s and position {position_m} m must be finite"),
            ));
        }
        let before_s = index.checked_sub(1).map(|before| points[before].0);
        if let Some(before_s) = before_s.filter(|before_s| time_s - before_s < tick_s) {
            let sentence =
                format!("time {time_s} s must be at least one tick of {tick_s} s after the point before, {before_s} s");
            return Err(Invalid::new(path, sentence));
        }
    }
    Ok(())
}
