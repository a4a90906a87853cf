//! Guards the estimation of several parameters at once: as accurate as the Cramér-Rao bound allows, honest about it,
//! and loud where the data cannot tell parameters apart. One simulated truth serves all seeds.

use anhyst_estimator::{
    EstimatedParameter, Information, MeasuredOutput, MultiParameterGaussNewton, MultiParameterReport,
    MultiParameterSettings, OutputStage, StrainLaw, estimate_parameters,
};
use anhyst_model::{
    Anhysteretic, DriveSignal, Hysteresis, HysteresisParameter, Material, Noise, SensitiveState, TwoPole,
};
use nalgebra::DMatrix;
use proptest::prelude::*;

const TICK_S: f64 = 1e-4;
const NOISE_M: f64 = 20e-9;

fn displacement() -> MeasuredOutput {
    let material = Material::terfenol_d();
    MeasuredOutput::Displacement {
        rod_per_strain: TwoPole {
            gain: 1.3724e-2 / material.strain_per_magnetization(),
            damping_per_s: 7.8899e3,
            stiffness_per_s2: 6.4251e7,
            force_gain_per_kg: 0.0,
        },
        strain: StrainLaw::of(&material),
    }
}

fn fields(signal: DriveSignal, duration_s: f64) -> Vec<f64> {
    let ticks = (duration_s / TICK_S).round() as u64;
    (0..ticks)
        .map(|tick| signal.field_a_per_m(tick as f64 * TICK_S))
        .collect()
}

/// Outputs without noise.
fn simulate(hysteresis: &Hysteresis, measured: MeasuredOutput, fields: &[f64]) -> Vec<f64> {
    let mut stage = OutputStage::new(measured, TICK_S).unwrap();
    let mut state = SensitiveState::default();
    fields
        .iter()
        .map(|field| {
            state = hysteresis.advance_with_sensitivities(state, *field);
            stage.advance(&state).value
        })
        .collect()
}

fn noisy(outputs: &[f64], noise: f64, seed: u64) -> Vec<f64> {
    let mut source = Noise::new(seed, 0);
    outputs.iter().map(|output| output + noise * source.normal()).collect()
}

/// Least standard deviations of `parameters` estimated together, all others being known.
fn cramer_rao_bounds(truth: &Hysteresis, parameters: &[HysteresisParameter], fields: &[f64]) -> Vec<f64> {
    let mut stage = OutputStage::new(displacement(), TICK_S).unwrap();
    let (mut state, mut information) = (SensitiveState::default(), Information::default());
    for field in fields {
        state = truth.advance_with_sensitivities(state, *field);
        information.add(&stage.advance(&state), NOISE_M);
    }
    let lengths: Vec<f64> = parameters
        .iter()
        .map(|one| information.about(*one, *one).sqrt())
        .collect();
    // Scaled to a diagonal of ones: the parameters' units differ by eight orders of magnitude.
    let scaled = DMatrix::from_fn(parameters.len(), parameters.len(), |i, j| {
        information.about(parameters[i], parameters[j]) / (lengths[i] * lengths[j])
    });
    let covariance = scaled.cholesky().unwrap().inverse();
    lengths
        .iter()
        .enumerate()
        .map(|(i, length)| covariance[(i, i)].sqrt() / length)
        .collect()
}

/// The truth with each of `parameters` off by `share`, up or down by the seed.
fn start(truth: Hysteresis, parameters: &[HysteresisParameter], share: f64, seed: u64) -> Hysteresis {
    let mut signs = Noise::new(seed, 1);
    parameters.iter().fold(truth, |material, parameter| {
        let factor = 1.0 + share * signs.normal().signum();
        parameter.with(material, parameter.of(&truth) * factor)
    })
}

/// Errors over their Cramér-Rao bounds and errors over their own deviations, by pass, then by parameter.
struct Judged {
    over_bound: Vec<Vec<f64>>,
    over_own: Vec<Vec<f64>>,
}

fn judge(report: &MultiParameterReport, truth: &Hysteresis, bounds: &[f64]) -> Judged {
    let errors = |divisors: fn(&anhyst_estimator::PassReport, &[f64]) -> Vec<f64>| {
        report
            .passes
            .iter()
            .map(|pass| {
                let uncertainty = &pass.uncertainty;
                let errors = uncertainty.parameters.iter().zip(&uncertainty.estimates);
                errors
                    .zip(divisors(pass, bounds))
                    .map(|((parameter, estimate), divisor)| (estimate - parameter.of(truth)).abs() / divisor)
                    .collect()
            })
            .collect()
    };
    Judged {
        over_bound: errors(|_, bounds| bounds.to_vec()),
        over_own: errors(|pass, _| pass.uncertainty.deviations.clone()),
    }
}

/// Some seeds, judged.
struct Campaign {
    seeds: Vec<Judged>,
}

impl Campaign {
    /// The standard excitation for 5 s, all of `parameters` off by `share` at the start; β as given.
    fn run(parameters: &[HysteresisParameter], share: f64, annealing_samples: f64, seeds: u64) -> Self {
        let truth = Hysteresis::terfenol_d();
        let fields = fields(DriveSignal::standard(5.0), 5.0);
        let outputs = simulate(&truth, displacement(), &fields);
        let bounds = cramer_rao_bounds(&truth, parameters, &fields);
        for (parameter, bound) in parameters.iter().zip(&bounds) {
            println!(
                "{} bound {:.2e} of it",
                parameter.symbol(),
                bound / parameter.of(&truth).abs()
            );
        }
        let run = |seed: u64| {
            let nominal = start(truth, parameters, share, seed);
            let settings = MultiParameterSettings {
                annealing_samples,
                ..MultiParameterSettings::around(parameters, &nominal, share, NOISE_M)
            };
            let measured = noisy(&outputs, NOISE_M, seed);
            let report = estimate_parameters(&settings, nominal, displacement(), TICK_S, &fields, &measured).unwrap();
            judge(&report, &truth, &bounds)
        };
        let seeds = std::thread::scope(|scope| {
            let halves = [0, 1].map(|odd| scope.spawn(move || (odd..seeds).step_by(2).map(run).collect::<Vec<_>>()));
            halves.into_iter().flat_map(|half| half.join().unwrap()).collect()
        });
        let campaign = Self { seeds };
        campaign.print();
        campaign
    }

    fn mean(&self, of: impl Fn(&Judged) -> f64) -> f64 {
        self.seeds.iter().map(of).sum::<f64>() / self.seeds.len() as f64
    }

    /// The least of the parameters' shares within three bounds.
    fn within_three_bounds(&self, pass: usize) -> f64 {
        let parameters = self.seeds[0].over_bound[pass].len();
        (0..parameters)
            .map(|i| self.mean(|one| f64::from(one.over_bound[pass][i] <= 3.0)))
            .fold(1.0, f64::min)
    }

    /// Share of all errors within their own deviation: 0.68 where that is honest.
    fn honest(&self, pass: usize) -> f64 {
        self.mean(|one| {
            let own = &one.over_own[pass];
            own.iter().filter(|over| **over <= 1.0).count() as f64 / own.len() as f64
        })
    }

    /// Nine of ten seeds have all their errors within so many of their own deviations: 2.3 for five honest ones.
    fn worst_over_own(&self, pass: usize) -> f64 {
        let worst = |one: &Judged| one.over_own[pass].iter().fold(0.0, |most: f64, over| most.max(*over));
        let mut worst: Vec<f64> = self.seeds.iter().map(worst).collect();
        worst.sort_by(f64::total_cmp);
        worst[worst.len() * 9 / 10]
    }

    fn print(&self) {
        for pass in 0..2 {
            let parameters = self.seeds[0].over_bound[pass].len();
            let rms: Vec<f64> = (0..parameters)
                .map(|i| self.mean(|one| one.over_bound[pass][i].powi(2)).sqrt())
                .collect();
            println!(
                "pass {}: rms error over bound {rms:.2?}, within three bounds {:.2}, within one own deviation {:.2}, worst over own {:.1}",
                pass + 1,
                self.within_three_bounds(pass),
                self.honest(pass),
                self.worst_over_own(pass)
            );
        }
    }
}

const ANNEALING: f64 = 100.0;

// Guards the bar: five parameters from 5 % off, 5 s, 20 nm. One pass is enough for it.
#[test]
fn five_parameters_reach_the_bound() {
    let campaign = Campaign::run(&HysteresisParameter::ALL, 0.05, ANNEALING, 50);
    for pass in 0..2 {
        assert!(campaign.within_three_bounds(pass) >= 0.9);
        assert!((0.58..=0.78).contains(&campaign.honest(pass)));
    }
}

// Guards a poor start: 20 % off in each of five. The second pass repairs what the first could not.
#[test]
fn five_parameters_from_far_away() {
    let campaign = Campaign::run(&HysteresisParameter::ALL, 0.2, ANNEALING, 30);
    assert!(campaign.within_three_bounds(1) >= 0.9);
    assert!((0.58..=0.78).contains(&campaign.honest(1)) && campaign.worst_over_own(1) < 3.5);
}

// Guards the need for annealing: without it the first pass from there is far too sure of itself.
#[test]
fn without_annealing_the_first_pass_is_too_sure() {
    let campaign = Campaign::run(&HysteresisParameter::ALL, 0.2, 0.0, 20);
    assert!(campaign.worst_over_own(0) > 20.0);
}

#[test]
fn the_shape_alone_and_pairs_reach_the_bound() {
    use HysteresisParameter::*;
    let pairs: [&[HysteresisParameter]; 4] = [
        &[Shape],
        &[Shape, SaturationMagnetization],
        &[Coupling, Reversibility],
        &[Pinning, Shape],
    ];
    for parameters in pairs {
        let campaign = Campaign::run(parameters, 0.05, ANNEALING, 20);
        assert!(campaign.within_three_bounds(1) >= 0.9, "{parameters:?}");
        assert!((0.5..=0.84).contains(&campaign.honest(1)), "{parameters:?}");
    }
}

fn loop_30_ka_per_m() -> Vec<f64> {
    let signal = DriveSignal::Triangle {
        amplitude_a_per_m: 30e3,
        period_s: 0.8,
    };
    fields(signal, 1.0)
}

// Guards the warning: on one quasi-static major loop a and α trade and it says so, with what they fix together; after
// the standard excitation no pair is suspicious.
#[test]
fn one_loop_cannot_tell_a_from_alpha_but_the_standard_excitation_can() {
    let truth = Hysteresis::terfenol_d();
    let strain = MeasuredOutput::Strain(StrainLaw::of(&Material::terfenol_d()));
    let fields_of_loop = loop_30_ka_per_m();
    let warnings = |measured: MeasuredOutput, fields: &[f64], noise: f64| {
        let nominal = start(truth, &HysteresisParameter::ALL, 0.05, 3);
        let settings = MultiParameterSettings::around(&HysteresisParameter::ALL, &nominal, 0.05, noise);
        let outputs = noisy(&simulate(&truth, measured, fields), noise, 3);
        let report = estimate_parameters(&settings, nominal, measured, TICK_S, fields, &outputs).unwrap();
        report.passes[1].uncertainty.warnings.clone()
    };
    let of_loop = warnings(strain, &fields_of_loop, 4e-7);
    assert!(
        of_loop
            .iter()
            .any(|one| one.starts_with("a and alpha cannot be told apart") && one.contains("a - alpha*Ms/3 = 95")),
        "{of_loop:#?}"
    );
    let of_standard = warnings(displacement(), &fields(DriveSignal::standard(5.0), 5.0), NOISE_M);
    assert!(of_standard.is_empty(), "{of_standard:#?}");
}

// Guards the outputs without a rod, on a quasi-static loop and on both curves: within five deviations of the truth, and
// close.
#[test]
fn strain_and_magnetization_serve_as_well() {
    use HysteresisParameter::*;
    let fields = loop_30_ka_per_m();
    for anhysteretic in [Anhysteretic::Langevin, Anhysteretic::Ising] {
        let truth = Hysteresis {
            anhysteretic,
            ..Hysteresis::terfenol_d()
        };
        for (measured, noise) in [
            (MeasuredOutput::Strain(StrainLaw::of(&Material::terfenol_d())), 4e-7),
            (MeasuredOutput::Magnetization, 300.0),
        ] {
            let parameters = [SaturationMagnetization, Shape, Pinning];
            let nominal = start(truth, &parameters, 0.05, 1);
            let settings = MultiParameterSettings::around(&parameters, &nominal, 0.05, noise);
            let outputs = noisy(&simulate(&truth, measured, &fields), noise, 1);
            let report = estimate_parameters(&settings, nominal, measured, TICK_S, &fields, &outputs).unwrap();
            let last = &report.passes[1];
            for (i, parameter) in parameters.iter().enumerate() {
                let (error, own) = (
                    last.uncertainty.estimates[i] - parameter.of(&truth),
                    last.uncertainty.deviations[i],
                );
                assert!(
                    error.abs() < 5.0 * own && own < 2e-3 * parameter.of(&truth),
                    "{parameter:?} {error} {own}"
                );
            }
            assert!(
                (last.residual_rms / noise - 1.0).abs() < 0.05,
                "{}",
                last.residual_rms / noise
            );
        }
    }
}

// Guards the sentences about data that say nothing and about a range that is too narrow.
#[test]
fn rest_and_narrow_ranges_are_reported() {
    let truth = Hysteresis::terfenol_d();
    let settings = MultiParameterSettings::around(&HysteresisParameter::ALL, &truth, 0.05, NOISE_M);
    let at_rest = estimate_parameters(&settings, truth, displacement(), TICK_S, &[0.0; 100], &[0.0; 100]).unwrap();
    let warnings = &at_rest.passes[0].uncertainty.warnings;
    assert_eq!(warnings.len(), 5);
    assert!(
        warnings
            .iter()
            .all(|one| one.starts_with("the data say next to nothing about")),
        "{warnings:#?}"
    );
    assert_eq!(at_rest.passes[0].hysteresis, truth);
    let fields = fields(DriveSignal::standard(1.0), 1.0);
    let outputs = simulate(&truth.with_shape(7300.0), displacement(), &fields);
    let settings = MultiParameterSettings {
        parameters: vec![EstimatedParameter {
            parameter: HysteresisParameter::Shape,
            start_deviation: 50.0,
            range: (6900.0, 7100.0),
        }],
        ..settings
    };
    let stuck = estimate_parameters(&settings, truth, displacement(), TICK_S, &fields, &outputs).unwrap();
    let last = &stuck.passes[1];
    assert_eq!(last.hysteresis.shape_a_per_m, 7100.0);
    assert!(last.uncertainty.warnings[0].starts_with("a stands at the edge of its range, 7100 A/m"));
    assert!(last.residual_rms > 10.0 * NOISE_M);
}

// Guards the loop from silence: a missing measurement moves the model on and teaches nothing.
#[test]
fn a_missing_measurement_teaches_nothing() {
    let truth = Hysteresis::terfenol_d();
    let settings = MultiParameterSettings::around(&HysteresisParameter::ALL, &truth, 0.05, NOISE_M);
    let mut law = MultiParameterGaussNewton::new(&settings, truth, displacement(), TICK_S).unwrap();
    let before = law.uncertainty();
    let fields = fields(DriveSignal::tracking(), 0.1);
    let outputs = simulate(&truth, displacement(), &fields);
    for (field, output) in fields.iter().zip(outputs) {
        let found = law.step(*field, f64::NAN);
        assert!(found.held && found.hysteresis == truth && found.predicted_output == output);
    }
    assert_eq!(law.uncertainty(), before);
    assert_eq!(law.deviations().as_slice(), before.deviations);
}

#[test]
fn settings_are_refused_with_their_reason() {
    let nominal = Hysteresis::terfenol_d();
    let good = MultiParameterSettings::around(&HysteresisParameter::ALL, &nominal, 0.05, NOISE_M);
    let refusal = |settings: MultiParameterSettings| settings.validate(&nominal).unwrap_err().to_string();
    assert!(good.validate(&nominal).is_ok());
    let mut twice = good.clone();
    twice.parameters[1] = twice.parameters[0];
    assert_eq!(refusal(twice), "parameters: Ms is listed twice");
    let mut outside = good.clone();
    outside.parameters[1].range = (8000.0, 9000.0);
    assert_eq!(
        refusal(outside),
        "parameters.a.range: 7012 A/m is outside [8000, 9000] A/m"
    );
    let mut wide = good.clone();
    wide.parameters[4].range.1 = 1.5;
    assert_eq!(refusal(wide), "parameters.c.range: the upper edge 1.5 must be below 1");
    assert!(
        refusal(MultiParameterSettings {
            noise: 0.0,
            ..good.clone()
        })
        .starts_with("noise: 0")
    );
    assert!(
        refusal(MultiParameterSettings {
            parameters: Vec::new(),
            ..good.clone()
        })
        .starts_with("parameters: at least one")
    );
    let error = estimate_parameters(&good, nominal, displacement(), TICK_S, &[0.0], &[])
        .unwrap_err()
        .to_string();
    assert_eq!(
        error,
        "outputs: 0 outputs do not fit 1 fields: each tick needs one of both"
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    // Guards against broken sensors and poor materials: whatever is measured, the material stays valid and inside its
    // ranges.
    #[test]
    fn any_measurement_leaves_a_valid_material(
        words in prop::collection::vec(any::<u64>(), 1..40), coupling in -0.02..0.025_f64, ising in any::<bool>(), scale in 1e3..1e5_f64,
    ) {
        let anhysteretic = if ising { Anhysteretic::Ising } else { Anhysteretic::Langevin };
        let nominal = Hysteresis { anhysteretic, coupling, ..Hysteresis::terfenol_d() };
        prop_assume!(nominal.validate().is_ok() && coupling != 0.0);
        let settings = MultiParameterSettings::around(&HysteresisParameter::ALL, &nominal, 0.1, NOISE_M);
        let mut law = MultiParameterGaussNewton::new(&settings, nominal, displacement(), TICK_S).unwrap();
        for word in words {
            let field = scale * ((word % 1000) as f64 / 500.0 - 1.0);
            let found = *law.step(field, f64::from_bits(word));
            prop_assert!(found.hysteresis.validate().is_ok());
            prop_assert!(found.state.magnetization_a_per_m.is_finite() && found.state.derivatives.iter().all(|one| one.is_finite()));
            for estimated in &settings.parameters {
                let value = estimated.parameter.of(&found.hysteresis);
                prop_assert!((estimated.range.0..=estimated.range.1).contains(&value), "{:?} {}", estimated, value);
            }
        }
        let uncertainty = law.uncertainty();
        prop_assert!(uncertainty.deviations.iter().all(|one| one.is_finite() && *one > 0.0));
    }
}
