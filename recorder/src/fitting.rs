//! What of a run the plots have to hold, and which lines may stand beside it: a limit far outside would squash what it limits.

use crate::axes::{Extent, nice};
use crate::row::{Presence, Row};
use crate::run::RunInfo;
use crate::spread::Spread;
use crate::views::Layout;

/// The share of errors that the error plot of a run that went well has to hold.
const USUAL: f64 = 0.9;
/// Lines are drawn if what they limit takes this part of the room between them.
const FILLED: f64 = 0.4;

/// Sizes seen so far.
#[derive(Debug, Default)]
pub(crate) struct Sizes {
    /// After settling.
    errors: Spread,
    field_peak_a_per_m: f64,
    shape: Extent,
    parameters: bool,
}

impl Sizes {
    /// Looks at one tick.
    pub fn note(&mut self, row: &Row, has: Presence, run: &RunInfo) {
        if row.tick as f64 * run.tick_s >= run.settling_time_s {
            self.errors.add(row.judged_error_m(has));
        }
        // Not-a-number is no peak.
        for field in [row.safe_field.field_a_per_m, row.coil_field.field_a_per_m] {
            self.field_peak_a_per_m = self.field_peak_a_per_m.max(field.abs());
        }
        self.parameters = has.parameters;
        self.shape.add(row.estimate.shape_a_per_m);
        if has.truth {
            self.shape.add(row.truth.shape_a_per_m);
        }
    }

    /// The largest error.
    pub fn largest_error_m(&self) -> f64 {
        self.errors.largest_m()
    }

    /// Lays out what is known now; of a run that failed the error plot holds all that there was.
    pub fn fit(&self, layout: &mut Layout, run: &RunInfo, failed: bool) {
        let failed = failed || self.errors.largest_m() > run.tolerance_m;
        layout.error_axis = layout.error_axis.or_else(|| {
            let height_m = if failed {
                1.1 * self.errors.largest_m()
            } else {
                2.0 * self.errors.quantile_m(USUAL)?
            };
            (height_m > 0.0).then(|| nice(run.scales.error.factor * height_m))
        });
        layout.shows_field_limit = self.field_peak_a_per_m >= FILLED * run.field_limit_a_per_m;
        let [low, high] = run.parameter_range;
        layout.shows_parameters = self.parameters;
        layout.shows_shape_range = self.shape.length() >= FILLED * (high - low);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::tests::run;
    use anhyst_ipc::{Demand, Estimate, SafeField};

    fn fitted(errors_m: impl Fn(u64) -> f64, field_a_per_m: f64, shape: impl Fn(u64) -> f64, failed: bool) -> Layout {
        let run = run();
        let mut sizes = Sizes::default();
        for tick in 0..1000 {
            let row = Row {
                tick,
                demand: Demand {
                    error_m: errors_m(tick),
                    ..Demand::default()
                },
                safe_field: SafeField {
                    field_a_per_m,
                    ..SafeField::default()
                },
                estimate: Estimate {
                    shape_a_per_m: shape(tick),
                    ..Estimate::default()
                },
                ..Row::default()
            };
            sizes.note(&row, Presence::of(&[]), &run);
        }
        let mut layout = Layout {
            zoom_s: 0.1,
            scales: crate::Scales::default(),
            error_axis: None,
            timed: false,
            tolerance: 100.0,
            shows_field_limit: true,
            shows_shape_range: true,
            shows_parameters: false,
        };
        sizes.fit(&mut layout, &run, failed);
        layout
    }

    /// Guards: one moment in which a run failed is inside its error plot; a run that held is not flattened by one spike.
    #[test]
    fn the_error_plot_of_a_run_that_failed_holds_what_failed() {
        let spike = |size_m: f64| move |tick: u64| if tick == 700 { size_m } else { 1e-8 };
        let still = |_| 6500.0;
        assert_eq!(fitted(spike(4e-5), 0.0, still, false).error_axis, Some(50_000.0));
        assert_eq!(fitted(spike(9e-8), 0.0, still, false).error_axis, Some(50.0));
        assert_eq!(fitted(spike(9e-8), 0.0, still, true).error_axis, Some(100.0));
    }

    /// Guards: a limit stands beside what fills its room, and nowhere else; what is no number fills nothing.
    #[test]
    fn no_limit_squashes_what_it_limits() {
        let quiet = |_| 1e-9;
        let still = |_| 6500.0;
        let moves = |tick: u64| 6200.0 + 0.6 * tick as f64;
        for (field, shown) in [(10e3, false), (-13e3, true), (30e3, true), (f64::NAN, false)] {
            assert_eq!(fitted(quiet, field, still, false).shows_field_limit, shown, "{field}");
        }
        assert!(!fitted(quiet, 0.0, still, false).shows_shape_range);
        assert!(fitted(quiet, 0.0, moves, false).shows_shape_range);
    }
}
