//! Errors over one value that varies, as curves or bars, and over two, as maps.

use crate::points::{Point, Points, Spread};
use crate::variation::Variation;
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role};
use anhyst_report::page::{Bar, Bars, HeatMap};

/// Values that differ by more than this factor are drawn by their logarithms.
const WIDE: f64 = 20.0;

fn is_wide(values: impl Iterator<Item = f64> + Clone) -> bool {
    let usable = values.filter(|value| value.is_finite() && *value > 0.0);
    let (low, high) = usable.fold((f64::INFINITY, 0.0_f64), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    high > WIDE * low
}

/// Rms, largest error and share of held runs over numbers.
pub fn curves(variation: &Variation, numbers: &[f64], points: &Points, tolerance_m: Option<f64>) -> Figure {
    let x = || {
        let axis = Axis::new(&variation.path, "");
        let positive = numbers.iter().all(|number| *number > 0.0);
        if variation.logarithmic && positive {
            axis.logarithmic()
        } else {
            axis
        }
    };
    // A band is drawn from left to right.
    let mut order: Vec<usize> = (0..numbers.len()).collect();
    order.sort_by(|one, other| numbers[*one].total_cmp(&numbers[*other]));
    let told = |of: fn(&Point) -> &Spread| -> Vec<(f64, [f64; 3])> {
        let of_place = order
            .iter()
            .map(|place| (numbers[*place], of(&points.all[*place]).told()));
        of_place.filter_map(|(at, told)| Some((at, told?))).collect()
    };
    let error = |title: &str, of: fn(&Point) -> &Spread| {
        let told = told(of);
        let wide = is_wide(told.iter().flat_map(|(_, told)| *told));
        let y = Axis::new(title, "m");
        Chart::new(title, x(), if wide { y.logarithmic() } else { y })
            .band(
                told.iter().map(|(at, [low, _, high])| (*at, *low, *high)).collect(),
                Role::Amended,
                Some("least to largest"),
            )
            .curve(Curve::new(told.iter().map(|(at, [_, mean, _])| [*at, *mean]), Role::Amended).named("mean"))
    };
    let rms = error("error rms", |point| &point.error_rms_m);
    let mut max = error("error max", |point| &point.error_max_m);
    if let Some(tolerance_m) = tolerance_m {
        max = max.horizontal(tolerance_m, Role::Limit, "tolerance");
    }
    let share = order.iter().map(|place| [numbers[*place], share(&points.all[*place])]);
    let held = Chart::new("held", x(), Axis::new("share of runs", "").between(0.0, 1.0))
        .curve(Curve::new(share, Role::Truth).named("held"));
    Figure::new("", vec![rms, max, held])
}

fn share(point: &Point) -> f64 {
    point.held as f64 / point.runs as f64
}

/// The mean of the largest error for values that are no numbers.
pub fn bars(variation: &Variation, points: &Points, tolerance_m: Option<f64>, spread: &str) -> Bars {
    let bar = |(name, point): (&String, &Point)| Bar {
        name: name.clone(),
        value: point.error_max_m.told().map(|told| told[1]),
        role: Role::Amended,
        note: format!("{} of {} held", point.held, point.runs),
    };
    let means = points.all.iter().filter_map(|point| point.error_max_m.told());
    Bars {
        caption: format!("Largest error, mean. {spread}"),
        unit: "m".to_owned(),
        logarithmic: is_wide(means.map(|told| told[1])),
        bars: variation.values.iter().zip(&points.all).map(bar).collect(),
        limit: tolerance_m.map(|tolerance_m| (tolerance_m, "the tolerance".to_owned())),
    }
}

/// Rms, largest error and share of held runs over two values; the first of them goes up.
pub fn maps([up, across]: [&Variation; 2], points: &Points, seeds: u64) -> Vec<HeatMap> {
    let map = |caption: String, unit: &str, values: Vec<Option<f64>>| HeatMap {
        caption,
        across: (across.path.clone(), across.values.clone()),
        up: (up.path.clone(), up.values.clone()),
        unit: unit.to_owned(),
        logarithmic: unit == "m" && is_wide(values.iter().flatten().copied()),
        values,
    };
    let of = |of: fn(&Point) -> &Spread| -> Vec<Option<f64>> {
        let told = points.all.iter().map(|point| of(point).told());
        told.map(|told| told.map(|told| told[1])).collect()
    };
    let held = points.all.iter().map(|point| Some(100.0 * share(point))).collect();
    let over = format!("mean over {seeds} seeds");
    vec![
        map(format!("Largest error, {over}."), "m", of(|point| &point.error_max_m)),
        map(format!("Error rms, {over}."), "m", of(|point| &point.error_rms_m)),
        map("Runs that held.".to_owned(), "%", held),
    ]
}
