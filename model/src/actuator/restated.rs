//! Effects that are the nominal model with other numbers: a quadratic part of the strain law, another load.
//!
//! λ(M) + q λ′ M²/Ms is again a law of [`crate::Magnetostriction`]; a load changes w, k̂ and ĉ. Whoever computes with
//! material and rod computes with these effects by taking both from here.
//! w is per magnetization in a model; per strain it is w/λ′, λ′ the law's slope at M = 0, or at Ms/2 for an even law.

use crate::effects::load_change::loaded;
use crate::effects::quadratic_magnetostriction::{reference_slope, square_term};
use crate::{Effect, EffectKind, Material, TwoPole};

/// A rod whose gain is per magnetization, with its gain per unit of free strain.
pub fn rod_per_strain(rod: TwoPole, material: &Material) -> TwoPole {
    TwoPole {
        gain: rod.gain / reference_slope(material),
        ..rod
    }
}

/// Material and rod (whatever its gain is per) with those effects that change nothing but their numbers.
pub fn with_known_effects(material: &Material, rod: TwoPole, effects: &[Effect]) -> (Material, TwoPole) {
    let (mut own, mut own_rod) = (material.clone(), rod);
    for effect in effects {
        match effect.kind() {
            EffectKind::QuadraticMagnetostriction => {
                let saturation = material.hysteresis.saturation_magnetization_a_per_m;
                let more = square_term(effect.values(), material);
                own.magnetostriction = own.magnetostriction.with_more_square(more, saturation);
            }
            EffectKind::LoadChange => own_rod = loaded(rod, effect.values()),
            _ => {}
        }
    }
    (own, own_rod)
}
