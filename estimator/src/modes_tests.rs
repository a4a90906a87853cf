//! Guards the refusals of a modal system, each with its sentence, and the rod's partial fractions.

use super::*;
use anhyst_model::{RodConstants, RodElements};

fn mode(eigenvalue: (f64, f64), input: (f64, f64)) -> Mode {
    Mode {
        eigenvalue_per_s: Complex64::new(eigenvalue.0, eigenvalue.1),
        input: Complex64::new(input.0, input.1),
    }
}

fn refusal(modes: &[Mode]) -> String {
    Modes::new(modes).unwrap_err().to_string()
}

// Guards the sentences: which mode, its numbers, the limit.
#[test]
fn refusals_name_the_mode_and_the_limit() {
    assert!(refusal(&[]).contains("at least 1 mode"));
    let unstable = refusal(&[mode((-1.0, 0.0), (1.0, 0.0)), mode((0.0, 0.0), (1.0, 0.0))]);
    assert!(unstable.starts_with("mode 1 has the eigenvalue 0 1/s"), "{unstable}");
    assert!(refusal(&[mode((-1.0, 0.0), (f64::NAN, 0.0))]).contains("not finite"));
    assert!(refusal(&[mode((f64::NEG_INFINITY, 0.0), (1.0, 0.0))]).contains("not finite"));
    let equal = refusal(&[mode((-3.0, 0.0), (1.0, 0.0)), mode((-3.0, 0.0), (2.0, 0.0))]);
    assert!(
        equal.starts_with("modes 0 and 1 share the eigenvalue -3 1/s"),
        "{equal}"
    );
    let alone = refusal(&[mode((-1.0, 2.0), (1.0, 0.0))]);
    assert!(alone.contains("no conjugate partner"), "{alone}");
    let unequal = refusal(&[mode((-1.0, 2.0), (1.0, 0.5)), mode((-1.0, -2.0), (1.0, 0.5))]);
    assert!(unequal.contains("no conjugate partner"), "{unequal}");
    assert!(refusal(&[mode((-1.0, 0.0), (1.0, 0.5))]).contains("no conjugate partner"));
    let cancels = refusal(&[mode((-1.0, 0.0), (1.0, 0.0)), mode((-2.0, 0.0), (-1.0, 0.0))]);
    assert!(cancels.contains("add up to 0e0"), "{cancels}");
}

// Guards the erratum of (20)-(21) where it would cost the user: the paper's rod seen by its displacement is refused,
// with the reason.
#[test]
fn the_papers_rod_is_refused_and_its_rate_is_not() {
    let rod = RodElements::assemble(&RodConstants::paper(), 2).unwrap().two_pole(1.0);
    let refused = Modes::new(&rod_modes(&rod, |_| Complex64::new(1.0, 0.0))).unwrap_err();
    assert!(matches!(refused, EstimatorError::InputsCancel { .. }), "{refused}");
    println!("{refused}");
    let modes = Modes::of_rod(&rod, 3000.0).unwrap();
    // Σ B = ĉ/μ, counting both of the pair.
    let rate = modes.kept()[0].input.re;
    assert!(
        (rate / (rod.stiffness_per_s2 / 3000.0) - 1.0).abs() < 1e-12,
        "{modes:?}"
    );
}

// Guards rods of every damping: two real modes, a pair, and the one damping that has no modes.
#[test]
fn rods_of_every_damping() {
    let rod = |damping_per_s| TwoPole {
        gain: 1.0,
        damping_per_s,
        stiffness_per_s2: 4.0e6,
        force_gain_per_kg: 0.0,
    };
    assert_eq!(Modes::of_rod(&rod(1000.0), 500.0).unwrap().kept().len(), 1);
    assert_eq!(Modes::of_rod(&rod(5000.0), 500.0).unwrap().kept().len(), 2);
    let critical = Modes::of_rod(&rod(4000.0), 500.0).unwrap_err();
    assert!(matches!(critical, EstimatorError::EqualModes { .. }), "{critical}");
    let undamped = Modes::of_rod(&rod(0.0), 500.0).unwrap_err();
    assert!(matches!(undamped, EstimatorError::UnstableMode { .. }), "{undamped}");
}
