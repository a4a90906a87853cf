//! Guards the laws beside the paper's: closed forms, inverses, what turning points do, and one fixed order of operations.

mod common;

use anhyst_model::{BoucWen, Density, HysteresisLaw, Law, LawModel, PlayGroup, PlaySum, Preisach, SlowLag, Warp};
use common::identity_error;
use proptest::prelude::*;

/// The inputs of all these laws go from −1 to 1 and a little beyond.
const LIMIT: f64 = 8.0;

fn warps() -> impl Strategy<Value = Warp> {
    prop_oneof![
        Just(Warp::Straight),
        (-0.45..0.45, -0.3..0.3).prop_map(|(bend, middle)| Warp::Quadratic {
            bend,
            middle,
            half_span: 1.0
        }),
        (0.2..3.0).prop_map(|scale| Warp::Tanh { scale }),
    ]
}

fn groups() -> impl Strategy<Value = PlayGroup> {
    (warps(), prop::collection::vec((0.0..0.9, 0.0..1.0), 1..12)).prop_map(|(warp, plays)| PlayGroup {
        warp,
        radii: plays.iter().map(|(radius, _)| *radius).collect(),
        weights: plays.iter().map(|(_, weight)| *weight).collect(),
    })
}

fn play_sums() -> impl Strategy<Value = PlaySum> {
    prop::collection::vec(groups(), 1..3).prop_map(|groups| PlaySum { groups })
}

fn preisach() -> impl Strategy<Value = Preisach> {
    let cells = (2_usize..9).prop_flat_map(|rows| {
        let weights = prop::collection::vec(0.0..1.0, rows * (rows + 1) / 2);
        weights.prop_map(move |weights| Density::Cells {
            levels: Density::even_levels([-1.0, 1.0], rows),
            weights,
        })
    });
    let lorentz = (0.0..0.5, 0.05..0.5, 3_usize..24).prop_map(|(coercivity, width, rows)| Density::Lorentz {
        amplitude: 3.0,
        coercivity,
        width,
        reach: 1.0,
        rows,
    });
    prop_oneof![cells, lorentz].prop_map(Preisach::from)
}

fn bouc_wen() -> impl Strategy<Value = BoucWen> {
    let yields = (0.1..2.0, 1.0..4.0, 0.5..1.0).prop_map(|(yield_input, exponent, loading_share)| BoucWen {
        amplitude: 2.0,
        yield_input,
        exponent,
        loading_share,
        stiffens: false,
    });
    let stiffens = (0.5..2.0, -3.0..0.5).prop_map(|(yield_input, loading_share)| BoucWen {
        amplitude: 0.5,
        yield_input,
        exponent: 1.0,
        loading_share,
        stiffens: true,
    });
    prop_oneof![yields, stiffens]
}

/// A law with a line and creep beside it: strictly rising, so that every demand has one input.
fn models() -> impl Strategy<Value = LawModel> {
    let laws = prop_oneof![
        play_sums().prop_map(Law::Plays),
        preisach().prop_map(Law::Preisach),
        bouc_wen().prop_map(Law::BoucWen),
    ];
    (prop::collection::vec(laws, 0..3), 0.05..1.0).prop_map(|(laws, slope)| LawModel {
        offset: -0.3,
        slope,
        laws,
        creep: vec![SlowLag {
            time_constant_s: 0.1,
            weight: 0.05,
        }],
    })
}

fn histories() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-1.5..1.5, 1..10)
}

fn after<L: HysteresisLaw>(law: &L, history: &[f64]) -> L::State {
    let mut state = law.rest();
    history.iter().for_each(|input| law.advance(&mut state, *input));
    state
}

/// Out and back inside what was wiped out last: the state is the one before, to the last bit.
fn returns<L: HysteresisLaw>(law: &L, history: &[f64], way: f64) -> bool {
    let before = after(law, history);
    let last = L::input(&before);
    // Inside the innermost loop there is nothing to wipe out but what the excursion made itself.
    let previous = history.len().checked_sub(2).map_or(0.0, |index| history[index]);
    let out = last + way * (previous - last);
    let mut state = before.clone();
    law.advance(&mut state, out);
    law.advance(&mut state, last);
    state == before
}

/// The inverse of a sum of plays, itself plays, of demands: r'ᵢ = Σ_{j≤i} wⱼ(rᵢ − rⱼ), w'₀ = 1/w₀, w'ᵢ = −wᵢ/(WᵢWᵢ₋₁),
/// Wᵢ = w₀ + … + wᵢ, s'ᵢ = Wᵢsᵢ + Σ_{j>i} wⱼsⱼ. Kuhnen, European Journal of Control 9 (2003) 407.
struct KuhnensInverse {
    radii: Vec<f64>,
    weights: Vec<f64>,
    plays: Vec<f64>,
}

impl KuhnensInverse {
    fn of(radii: &[f64], weights: &[f64], plays: &[f64]) -> Self {
        let sum = |until: usize| weights[..until].iter().sum::<f64>();
        let all = 0..weights.len();
        let within = |i: usize| (0..=i).map(|j| weights[j] * (radii[i] - radii[j])).sum();
        let beyond = |i: usize| (i + 1..weights.len()).map(|j| weights[j] * plays[j]).sum::<f64>();
        let weight = |i: usize| {
            if i == 0 {
                1.0 / weights[0]
            } else {
                -weights[i] / (sum(i + 1) * sum(i))
            }
        };
        KuhnensInverse {
            radii: all.clone().map(within).collect(),
            weights: all.clone().map(weight).collect(),
            plays: all.map(|i| sum(i + 1) * plays[i] + beyond(i)).collect(),
        }
    }

    fn follow(&mut self, demanded: f64) -> f64 {
        for (play, radius) in self.plays.iter_mut().zip(&self.radii) {
            *play = play.max(demanded - radius).min(demanded + radius);
        }
        self.plays
            .iter()
            .zip(&self.weights)
            .map(|(play, weight)| play * weight)
            .sum()
    }
}

/// A turning point further out leaves nothing of those within.
fn wipes_out<L: HysteresisLaw>(law: &L, history: &[f64]) -> bool {
    let wiped = |history: &[f64]| after(law, &[history, &[2.0, -2.0, 0.25]].concat());
    wiped(history) == wiped(&[])
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    /// Of any law with its line and creep, to 1e-9 of its range at the least.
    #[test]
    fn inverse_then_forward_is_the_identity(model in models(), history in histories(), to in -2.0..2.0, pause in 0.0..1.0) {
        prop_assert!(model.validate().is_ok());
        let mut state = after(&model, &history);
        model.pass(&mut state, pause);
        let range = model.ahead(&state, 2.0).0 - model.ahead(&state, -2.0).0;
        let error = identity_error(&model, &state, to, LIMIT);
        prop_assert!(error <= 1e-12 * range, "{error:.1e} of {range}");
    }

    /// A second opinion on Newton's steps: the same input, to rounding.
    #[test]
    fn the_inverse_of_plays_is_that_in_closed_form(
        plays in prop::collection::vec((0.01..0.2, 0.0..1.0), 0..20),
        history in histories(),
        demands in prop::collection::vec(-0.9..0.9, 1..20),
    ) {
        let mut radii = vec![0.0];
        radii.extend(plays.iter().scan(0.0, |radius, (step, _)| { *radius += step; Some(*radius) }));
        let weights: Vec<f64> = std::iter::once(0.7).chain(plays.iter().map(|(_, weight)| *weight)).collect();
        let law = PlaySum::prandtl_ishlinskii(radii.clone(), weights.clone());
        let mut state = after(&law, &history);
        let mut inverse = KuhnensInverse::of(&radii, &weights, &state.plays);
        let reach = law.ahead(&state, LIMIT).0.min(-law.ahead(&state, -LIMIT).0);
        for share in demands {
            let demanded = share * reach;
            let input = inverse.follow(demanded);
            prop_assert!(law.advance_to_output(&mut state, demanded, LIMIT));
            prop_assert!((state.input - input).abs() <= 1e-12 * LIMIT, "{} and {input}", state.input);
            let error = (law.output(&state) - demanded).abs();
            prop_assert!(error <= 1e-14 * reach, "{error:.1e} of {reach}");
        }
    }

    #[test]
    fn turning_points_are_remembered_and_wiped_out(
        plays in play_sums(), preisach in preisach(), history in histories(), way in 0.0..1.0,
    ) {
        prop_assert!(returns(&plays, &history, way));
        prop_assert!(returns(&preisach, &history, way));
        prop_assert!(wipes_out(&plays, &history));
        prop_assert!(wipes_out(&preisach, &history));
    }

    /// What the law says of a step is what it does; the output never goes against the input.
    #[test]
    fn ahead_is_where_the_step_leads(model in models(), history in histories(), to in -2.0..2.0) {
        let before = after(&model, &history);
        let (ahead, slope) = model.ahead(&before, to);
        let mut there = before.clone();
        model.advance(&mut there, to);
        prop_assert!((model.output(&there) - ahead).abs() < 1e-12);
        let rises = to >= LawModel::input(&before);
        let sign = if rises { 1.0 } else { -1.0 };
        prop_assert!((model.output(&there) - model.output(&before)) * sign >= -1e-13);
        prop_assert!((slope - model.slope(&there, rises)).abs() <= 1e-9 * (1.0 + slope.abs()), "{slope}");
    }
}

/// A demand out of reach stops at the limit; none at all moves nothing.
#[test]
fn a_demand_out_of_reach_is_reported() {
    let law = PlaySum::prandtl_ishlinskii(vec![0.0, 0.5], vec![1.0, 1.0]);
    let mut state = after(&law, &[0.3]);
    assert!(!law.advance_to_output(&mut state, 50.0, 2.0));
    assert_eq!(state.input, 2.0);
    assert!(!law.advance_to_output(&mut state, f64::NAN, 2.0));
    assert_eq!(state.input, 2.0);
    assert!(!law.advance_to_output(&mut state, 0.0, 1.0));
    assert_eq!(state.input, 1.0);
}

/// Prandtl's loading curve from rest, Σ w max(v − r, 0), and Masing's rule back from it: twice the curve of half the way.
#[test]
fn plays_load_and_unload_as_prandtl_says() {
    let (radii, weights) = (vec![0.1, 0.3, 0.6], vec![1.0, 0.5, 2.0]);
    let loading = |v: f64| -> f64 { radii.iter().zip(&weights).map(|(r, w)| w * (v - r).max(0.0)).sum() };
    let law = PlaySum::prandtl_ishlinskii(radii.clone(), weights.clone());
    for to in [0.05, 0.2, 0.5, 1.0] {
        let top = after(&law, &[to]);
        assert!((law.output(&top) - loading(to)).abs() < 1e-15);
        for back in [0.1, 0.4, 1.2] {
            let state = after(&law, &[to, to - back]);
            let masing = 2.0 * loading(0.5 * back).min(loading(to) + loading(back - to).max(0.0));
            if back <= 2.0 * to {
                assert!((loading(to) - law.output(&state) - masing).abs() < 1e-14, "{to} {back}");
            }
        }
    }
}

/// 1 − e^−ν for n = 1 and tanh ν for n = 2, loading from rest with σ = 1; both saturate.
#[test]
fn bouc_wen_loads_in_closed_form() {
    for (exponent, curve) in [(1.0, (|v| 1.0 - f64::exp(-v)) as fn(f64) -> f64), (2.0, f64::tanh)] {
        let law = BoucWen {
            amplitude: 3.0,
            yield_input: 0.4,
            exponent,
            loading_share: 1.0,
            stiffens: false,
        };
        for to in [0.01, 0.1, 0.4, 1.0, 4.0] {
            let output = law.output(&after(&law, &[to]));
            assert!(
                (output - 3.0 * curve(to / 0.4)).abs() < 1e-7,
                "{exponent} {to}: {output}"
            );
        }
        assert!((law.output(&after(&law, &[1e9])) - 3.0).abs() < 1e-12);
    }
}

/// e^ν − 1 loading from rest, and (z₀ + 1/u)e^−uν − 1/u on the way back, u = 1 − 2σ.
#[test]
fn bouc_wen_stiffens_in_closed_form() {
    let law = BoucWen {
        amplitude: 3.0,
        yield_input: 0.4,
        exponent: 1.0,
        loading_share: -1.5,
        stiffens: true,
    };
    let there = f64::exp(0.5 / 0.4) - 1.0;
    assert!((law.output(&after(&law, &[0.5])) - 3.0 * there).abs() < 1e-7);
    let (u, back) = (4.0, 0.06 / 0.4);
    let back = (there + 1.0 / u) * f64::exp(-u * back) - 1.0 / u;
    assert!((law.output(&after(&law, &[0.5, 0.44])) - 3.0 * back).abs() < 1e-6);
    assert!(BoucWen { exponent: 2.0, ..law }.validate().is_err());
    // At its end it stands still, and says so: an inverse that believed otherwise would crawl beside another part.
    let end = after(&law, &[9.0]);
    assert_eq!((law.output(&end), law.slope(&end, true)), (3e3, 0.0));
    assert!(law.slope(&end, false) > 0.0);
}

/// Counted relay by relay on a grid that the law does not use: switch up at α, down at β, one after the other.
#[test]
fn preisach_is_the_count_of_its_relays() {
    const FINE: usize = 400;
    let rows = 40;
    let (coercivity, width) = (0.2, 0.15);
    let law = Preisach::from(Density::Cells {
        levels: Density::even_levels([-1.0, 1.0], rows),
        weights: {
            let at = |level: usize| (2 * level + 1) as f64 / rows as f64 - 1.0;
            let density = |about: f64| (-(about / width).powi(2)).exp();
            let cell = |row: usize, column: usize| {
                let half = if row == column { 0.5 } else { 1.0 };
                half * density(at(row) - coercivity) * density(at(column) + coercivity) * (2.0 / rows as f64).powi(2)
            };
            (0..rows)
                .flat_map(|row| (0..=row).map(move |column| cell(row, column)))
                .collect()
        },
    });
    let history = [0.9, -0.4, 0.5, -0.15, 0.3, -1.0, 0.1];
    let fine = |index: usize| (2 * index + 1) as f64 / FINE as f64 - 1.0;
    let mut relays: Vec<(f64, f64, bool)> = (0..FINE)
        .flat_map(|up| (0..=up).map(move |down| (fine(up), fine(down))))
        .map(|(up, down)| (up, down, up + down < 0.0))
        .collect();
    let mut state = law.rest();
    for to in history {
        law.advance(&mut state, to);
        let mut counted = 0.0;
        for (up, down, is_up) in &mut relays {
            *is_up = if to >= *up {
                true
            } else if to <= *down {
                false
            } else {
                *is_up
            };
            if *is_up {
                let density = |about: f64| (-(about / width).powi(2)).exp();
                counted += density(*up - coercivity) * density(*down + coercivity) * (2.0 / FINE as f64).powi(2);
            }
        }
        let output = law.output(&state);
        assert!((output - counted).abs() < 0.01 * 0.07, "{to}: {output} and {counted}");
    }
}

/// A file says a law in full, and a law that cannot be is refused by name.
#[test]
fn a_law_is_what_its_file_says() {
    let model = LawModel {
        offset: 1.0,
        slope: 0.5,
        laws: vec![Law::Preisach(Preisach::from(Density::Lorentz {
            amplitude: 2.0,
            coercivity: 0.1,
            width: 0.2,
            reach: 1.0,
            rows: 12,
        }))],
        creep: Vec::new(),
    };
    let text = ron::to_string(&model).unwrap();
    assert_eq!(ron::from_str::<LawModel>(&text).unwrap(), model);
    let refused = PlaySum::prandtl_ishlinskii(vec![0.1], vec![-1.0])
        .validate()
        .unwrap_err();
    assert_eq!(
        refused.to_string(),
        "weight of a play is -1 (output per input), but must be finite and not below 0"
    );
    let no_levels = Preisach::from(Density::Cells {
        levels: vec![0.0, 0.0],
        weights: vec![1.0],
    });
    assert!(no_levels.validate().is_err());
}
