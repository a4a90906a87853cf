//! The forms that are tried: laws with unit weights, whose inner numbers lie in a unit cube.

use anhyst_model::{
    Anhysteretic, BoucWen, Density, Hysteresis, Law, LawModel, PlayGroup, PlaySum, Preisach, ScaledDomainWall, SlowLag,
    Warp,
};

use super::LawData;
use super::gram::Smoothness;

/// Plays of one group, and how much closer their radii lie at small ones.
const PLAYS: usize = 12;
const TANH_PLAYS: usize = 8;
/// Bend of a warp, either way.
const MOST_BENT: f64 = 0.4;
/// Rows of a density's plane.
const LORENTZ_ROWS: usize = 44;
const LOGISTIC_ROWS: usize = 60;
/// Of the data's largest input: as far goes its plane, so that larger motions find cells, too.
const LORENTZ_REACH: f64 = 2.0;
/// Fewer records than this do not cover the half plane.
const LEAST_OF_CELLS: usize = 5;
/// Of the input's extent: further goes none that is integrated.
const LONGEST_WAY: f64 = 1000.0;
/// A step that lasts shorter than so many samples is none.
const QUICKEST: f64 = 2.0;

/// One form.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Family {
    Linear,
    /// A rising curve without memory: what is no hysteresis.
    Curve,
    PrandtlIshlinskii,
    /// Prandtl-Ishlinskii behind a quadratic warp, with a line beside it.
    BentPlays,
    /// So many groups behind tanh curves, with a line beside them.
    TanhPlays(usize),
    /// So many rows of free cells.
    Preisach(usize),
    /// A product density, with a reversible tanh and a line.
    PreisachLorentz,
    /// A product density whose two sides lie anywhere, each with a width of its own, and its mirror image.
    PreisachLogistic,
    BoucWen,
    DomainWall,
}

impl Family {
    /// All, the simple ones first.
    pub const ALL: [Family; 13] = [
        Family::Linear,
        Family::Curve,
        Family::PrandtlIshlinskii,
        Family::BentPlays,
        Family::PreisachLorentz,
        Family::PreisachLogistic,
        Family::BoucWen,
        Family::DomainWall,
        Family::TanhPlays(2),
        Family::TanhPlays(3),
        Family::TanhPlays(4),
        Family::Preisach(8),
        Family::Preisach(24),
    ];

    /// As the command line and reports say it.
    pub fn name(self) -> &'static str {
        match self {
            Family::Linear => "linear",
            Family::Curve => "curve",
            Family::PrandtlIshlinskii => "prandtl-ishlinskii",
            Family::BentPlays => "bent-plays",
            Family::TanhPlays(..=2) => "tanh-plays-2",
            Family::TanhPlays(3) => "tanh-plays-3",
            Family::TanhPlays(_) => "tanh-plays-4",
            Family::Preisach(..=8) => "preisach-8",
            Family::Preisach(_) => "preisach-24",
            Family::PreisachLorentz => "preisach-lorentz",
            Family::PreisachLogistic => "preisach-logistic",
            Family::BoucWen => "bouc-wen",
            Family::DomainWall => "domain-wall",
        }
    }

    /// The one of this name.
    pub fn named(name: &str) -> Option<Family> {
        Self::ALL.into_iter().find(|family| family.name() == name)
    }

    /// Whether these data can tell its numbers. Free cells describe the motions that they have seen best of all and others worst,
    /// unless there were many; laws that are integrated along the input's way take minutes where that is long.
    pub(super) fn suits(self, data: &LawData) -> bool {
        match self {
            Family::Preisach(_) => data.records.len() >= LEAST_OF_CELLS,
            Family::BoucWen | Family::DomainWall => data.input_way() <= LONGEST_WAY,
            _ => true,
        }
    }

    /// Inner numbers.
    pub fn dimensions(self) -> usize {
        match self {
            Family::Linear => 0,
            Family::PrandtlIshlinskii | Family::BentPlays | Family::Preisach(_) => 1,
            Family::Curve | Family::TanhPlays(_) => 2,
            Family::PreisachLorentz | Family::BoucWen => 3,
            Family::PreisachLogistic | Family::DomainWall => 4,
        }
    }

    /// How many times as many places must be drawn: where both sides must lie right, most places are far from any good one.
    pub(super) fn many(self) -> usize {
        if self == Family::PreisachLogistic { 4 } else { 1 }
    }

    /// A line stands beside the law: it has none in it.
    pub(super) fn has_line(self) -> bool {
        self != Family::PrandtlIshlinskii
    }

    /// The law at a place of the unit cube, its weights 1. Always one that is valid.
    pub(super) fn law(self, place: &[f64], data: &LawData) -> Option<Law> {
        let [low, high] = data.input_extent;
        let (span, reach) = (high - low, high.abs().max(low.abs()));
        let log = |share: f64, from: f64, to: f64| from * (to / from).powf(share);
        let bent = |bend: f64| Warp::Quadratic {
            bend,
            middle: 0.5 * (low + high),
            half_span: 0.5 * span,
        };
        match self {
            Family::Linear => None,
            Family::PrandtlIshlinskii => {
                let radii = radii(PLAYS, 0.5 * span, 0.7 + 2.3 * place[0]);
                Some(Law::Plays(plays(vec![(Warp::Straight, radii)])))
            }
            Family::Curve => {
                let tanh = |group: i32| Warp::Tanh {
                    scale: log(place[0], 0.02 * reach, 0.6 * reach) * log(place[1], 1.5, 6.0).powi(group),
                };
                let warps = [bent(-MOST_BENT), bent(MOST_BENT), tanh(0), tanh(1), tanh(2)];
                Some(Law::Plays(plays(warps.map(|warp| (warp, vec![0.0])).to_vec())))
            }
            Family::BentPlays => {
                let warp = bent(MOST_BENT * (2.0 * place[0] - 1.0));
                Some(Law::Plays(plays(vec![(warp, radii(PLAYS, 0.5 * span, 1.0))])))
            }
            Family::TanhPlays(groups) => {
                let first = log(place[0], 0.02 * reach, 0.6 * reach);
                let ratio = log(place[1], 1.5, 6.0);
                let of = |group: usize| {
                    let scale = first * ratio.powi(group as i32);
                    let warp = Warp::Tanh { scale };
                    (warp, radii(TANH_PLAYS, warp.value(reach), 2.0))
                };
                Some(Law::Plays(plays((0..groups).map(of).collect())))
            }
            Family::Preisach(rows) => Some(Law::Preisach(Preisach::from(Density::Cells {
                levels: Density::even_levels([low, high], rows),
                weights: vec![1.0; rows * (rows + 1) / 2],
            }))),
            Family::PreisachLorentz => Some(Law::Preisach(Preisach::from(Density::Lorentz {
                amplitude: 1.0,
                coercivity: log(place[0], 1e-3 * reach, reach),
                width: log(place[1], 3e-3 * reach, reach),
                reach: LORENTZ_REACH * reach,
                rows: LORENTZ_ROWS,
            }))),
            Family::PreisachLogistic => Some(logistic(place, data, 1.0)),
            Family::BoucWen => Some(Law::BoucWen(BoucWen {
                amplitude: 1.0,
                yield_input: log(place[0], 0.02 * span, 3.0 * span),
                exponent: log(place[1], 1.0, 6.0),
                loading_share: 0.5 + 0.5 * place[2],
                stiffens: false,
            })),
            Family::DomainWall => {
                let shape = log(place[0], 0.01 * reach, 2.0 * reach);
                Some(Law::DomainWall(ScaledDomainWall {
                    gain: 1.0,
                    hysteresis: Hysteresis {
                        anhysteretic: Anhysteretic::Langevin,
                        saturation_magnetization_a_per_m: 1.0,
                        shape_a_per_m: shape,
                        pinning_a_per_m: log(place[1], 0.003 * reach, 2.0 * reach),
                        // Of the magnetization's coupling to itself; at 3a the curve would stand upright.
                        coupling: shape * (-1.0 + 3.7 * place[3]),
                        reversibility: 0.95 * place[2],
                        cubic_coupling_m2_per_a2: 0.0,
                    },
                }))
            }
        }
    }

    /// What stands beside the law.
    pub(super) fn beside(self, place: &[f64], data: &LawData) -> Option<Law> {
        let [low, high] = data.input_extent;
        let reach = high.abs().max(low.abs());
        match self {
            Family::PreisachLorentz => {
                let scale = 0.02 * reach * 50_f64.powf(place[2]);
                Some(Law::Plays(plays(vec![(Warp::Tanh { scale }, vec![0.0])])))
            }
            Family::PreisachLogistic => Some(logistic(place, data, -1.0)),
            _ => None,
        }
    }

    /// Free cells are smoothed, as much as predicts best; of all else the place is that of the best fit.
    pub(super) fn is_smoothed(self) -> bool {
        matches!(self, Family::Preisach(_))
    }

    fn smoothness(self, place: &[f64]) -> Smoothness {
        let Family::Preisach(rows) = self else {
            return Smoothness::default();
        };
        let cell = |row: usize, column: usize| usize::from(self.has_line()) + row * (row + 1) / 2 + column;
        let cells = (0..rows).flat_map(|row| (0..=row).map(move |column| (row, column)));
        let neighbours = cells.flat_map(|(row, column)| {
            let below = (row + 1 < rows).then(|| (cell(row, column), cell(row + 1, column)));
            let beside = (column < row).then(|| (cell(row, column), cell(row, column + 1)));
            below.into_iter().chain(beside)
        });
        Smoothness {
            neighbours: neighbours.collect(),
            strength: 1e-12 * 1e12_f64.powf(place[0]),
        }
    }

    /// With unit weights, and creep where time is known.
    pub(super) fn skeleton(self, place: &[f64], data: &LawData) -> Skeleton {
        let laws: Vec<Law> = self
            .law(place, data)
            .into_iter()
            .chain(self.beside(place, data))
            .collect();
        let groups = if data.has_time() {
            creep_groups(data)
        } else {
            Vec::new()
        };
        let creep = groups.iter().flatten();
        let model = LawModel {
            offset: 0.0,
            slope: 1.0,
            creep: creep
                .map(|tau| SlowLag {
                    time_constant_s: *tau,
                    weight: 1.0,
                })
                .collect(),
            laws,
        };
        let mut tied = vec![self.has_line().then_some(0)];
        let mut next = usize::from(self.has_line());
        for _ in model.laws.iter().flat_map(Law::weights) {
            tied.push(Some(next));
            next += 1;
        }
        for group in &groups {
            tied.extend(group.iter().map(|_| Some(next)));
            next += 1;
        }
        Skeleton {
            model,
            tied,
            smoothness: self.smoothness(place),
        }
    }
}

/// A density on one side of the middle of the input's extent, or on the other: both together are what has a dead band.
fn logistic(place: &[f64], data: &LawData, side: f64) -> Law {
    let [low, high] = data.input_extent;
    let span = high - low;
    let log = |share: f64, from: f64, to: f64| from * (to / from).powf(share);
    let middle = 0.5 * (low + high) + side * span * (1.2 * place[0] - 0.6);
    let half = log(place[1], 0.005 * span, 0.6 * span);
    let widths = [place[2], place[3]].map(|share| log(share, 0.003 * span, 0.6 * span));
    // The mirror image of switching up is switching down.
    let [up, down] = if side > 0.0 { widths } else { [widths[1], widths[0]] };
    Law::Preisach(Preisach::from(Density::Logistic {
        amplitude: 1.0,
        up: [middle + half, up],
        down: [middle - half, down],
        between: [low - 0.25 * span, high + 0.25 * span],
        rows: LOGISTIC_ROWS,
    }))
}

/// A form at one place.
pub(super) struct Skeleton {
    pub model: LawModel,
    /// Of each of [`LawModel::weights`] after the offset: which free weight it is; none where it is held at 0.
    pub tied: Vec<Option<usize>>,
    pub smoothness: Smoothness,
}

/// From 0 to nearly the end, closer together about 0 if the power is above 1.
fn radii(count: usize, end: f64, power: f64) -> Vec<f64> {
    (0..count)
        .map(|i| end * (i as f64 / count as f64).powf(power))
        .collect()
}

fn plays(groups: Vec<(Warp, Vec<f64>)>) -> PlaySum {
    let group = |(warp, radii): (Warp, Vec<f64>)| PlayGroup {
        weights: vec![1.0; radii.len()],
        warp,
        radii,
    };
    PlaySum {
        groups: groups.into_iter().map(group).collect(),
    }
}

/// Time constants, s, two a decade, in a quick and a slow group of one weight each; from two samples to far beyond the record.
fn creep_groups(data: &LawData) -> Vec<Vec<f64>> {
    let of = |record: &super::LawRecord| match &record.time_s {
        Some(time_s) => (time_s[time_s.len() - 1] - time_s[0], time_s.len()),
        None => (0.0, 1),
    };
    let (longest, samples) = data
        .records
        .iter()
        .map(of)
        .fold((0.0, 1), |a, b| if b.0 > a.0 { b } else { a });
    let tick_s = longest / samples as f64;
    let fits = |tau: &f64| *tau >= QUICKEST * tick_s && *tau <= 100.0 * longest;
    let quick = [0.1, 0.3].into_iter().filter(fits).collect::<Vec<_>>();
    let slow = [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0]
        .into_iter()
        .filter(fits)
        .collect::<Vec<_>>();
    [quick, slow].into_iter().filter(|group| !group.is_empty()).collect()
}
