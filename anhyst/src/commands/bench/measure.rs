//! Measurements that take turns, and what comes of them.

use anhyst_launch::error::RunError;
use anhyst_launch::realtime::cpu_s;
use serde::Serialize;

/// A measurement takes at least so long.
const LEAST_S: f64 = 3e-3;

/// The unit.
pub const TANH: &str = "tanh";

/// Something to measure.
pub struct Timed<'a> {
    pub name: String,
    /// What the time is of.
    pub of: &'static str,
    /// Measures once: nanoseconds of each.
    pub once: Box<dyn FnMut() -> Result<f64, RunError> + 'a>,
    /// What it is made of at least: how often which other measurement.
    pub parts: Vec<(f64, String)>,
    pub floor_is: &'static str,
    /// Of a loop: the length of a tick.
    pub tick_s: Option<f64>,
}

impl<'a> Timed<'a> {
    /// CPU time of `count` of what `work` does at once, again until it has taken long enough to be told.
    pub fn new(name: impl Into<String>, of: &'static str, count: usize, mut work: impl FnMut() + 'a) -> Self {
        Self::failing(name, of, move || {
            let (begun_s, mut rounds) = (cpu_s(), 0.0);
            loop {
                work();
                rounds += 1.0;
                let spent_s = cpu_s() - begun_s;
                if spent_s >= LEAST_S {
                    return Ok(1e9 * spent_s / (rounds * count as f64));
                }
            }
        })
    }

    /// What measures itself.
    pub fn failing(
        name: impl Into<String>,
        of: &'static str,
        once: impl FnMut() -> Result<f64, RunError> + 'a,
    ) -> Self {
        Self {
            name: name.into(),
            of,
            once: Box::new(once),
            parts: Vec::new(),
            floor_is: "",
            tick_s: None,
        }
    }

    /// Cannot be cheaper than so many of these together.
    #[must_use]
    pub fn at_least<Name: Into<String>>(
        mut self,
        floor_is: &'static str,
        parts: impl IntoIterator<Item = (f64, Name)>,
    ) -> Self {
        self.parts = parts.into_iter().map(|(times, name)| (times, name.into())).collect();
        self.floor_is = floor_is;
        self
    }
}

/// What was measured.
#[derive(Debug, Serialize)]
pub struct Row {
    pub name: String,
    pub of: &'static str,
    pub median_ns: f64,
    pub least_ns: f64,
    /// Median over the turns of the ratio to the turn's `tanh`.
    pub tanh: f64,
    /// Ratio of the least times.
    pub least_tanh: f64,
    /// Width of the middle half of the ratios, as a share of their median.
    pub spread: f64,
    /// The sum of what it is made of; null: not known.
    pub floor_tanh: Option<f64>,
    pub floor_is: &'static str,
    /// Of a loop: simulated over spent time.
    pub times_real_time: Option<f64>,
}

/// Everything once a turn; `done` hears each.
///
/// # Errors
/// The first that failed.
pub fn in_turns(mut all: Vec<Timed<'_>>, turns: u32, done: &mut dyn FnMut()) -> Result<Vec<Row>, RunError> {
    let mut times_ns = vec![Vec::new(); all.len()];
    for _ in 0..turns {
        for (timed, times_ns) in all.iter_mut().zip(&mut times_ns) {
            times_ns.push((timed.once)()?);
            done();
        }
    }
    let unit = all.iter().position(|timed| timed.name == TANH).unwrap_or_default();
    let unit_ns = times_ns[unit].clone();
    let mut rows: Vec<Row> = all
        .iter()
        .zip(&times_ns)
        .map(|(timed, times_ns)| {
            let ratios = sorted(times_ns.iter().zip(&unit_ns).map(|(own, unit)| own / unit));
            let (median_ns, least_ns) = (at(&sorted(times_ns.iter().copied()), 0.5), least(times_ns));
            Row {
                name: timed.name.clone(),
                of: timed.of,
                median_ns,
                least_ns,
                tanh: at(&ratios, 0.5),
                least_tanh: least_ns / least(&unit_ns),
                spread: (at(&ratios, 0.75) - at(&ratios, 0.25)) / at(&ratios, 0.5),
                floor_tanh: None,
                floor_is: timed.floor_is,
                times_real_time: timed.tick_s.map(|tick_s| 1e9 * tick_s / median_ns),
            }
        })
        .collect();
    for (place, timed) in all.iter().enumerate().filter(|(_, timed)| !timed.parts.is_empty()) {
        let of = |name: &String| rows.iter().find(|row| row.name == *name).map(|row| row.tanh);
        let sum = timed.parts.iter().map(|(times, name)| Some(times * of(name)?)).sum();
        rows[place].floor_tanh = sum;
    }
    Ok(rows)
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

fn least(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Of sorted values, the one so far along.
fn at(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}
