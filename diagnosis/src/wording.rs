//! A diagnosis in sentences, with its amounts in units that suit them.

use anhyst_report::number::Si;

use crate::diagnosis::{Diagnosis, Verdict};
use crate::locate::ChannelGap;

pub(crate) fn amplifier_sentences(channels: &[ChannelGap]) -> Vec<String> {
    let own = channels.iter().filter(|gap| gap.channel == "field").map(|gap| {
        let ratio = gap.rms / gap.noise_rms;
        if ratio < 1.05 {
            "the measured field follows the model's from the command within its noise: the gap is not in the amplifier".to_owned()
        } else {
            format!(
                "the measured field differs from the model's by {:.3} {} rms, {ratio:.1} times its noise: the amplifier has a part in it",
                gap.rms, gap.unit
            )
        }
    });
    let mut sentences: Vec<String> = own.collect();
    sentences.dedup();
    if sentences.is_empty() {
        sentences.push(
            "command and measured field are not both there: amplifier and actuator cannot be told apart by the field"
                .to_owned(),
        );
    }
    sentences
}

/// The verdict as a sentence.
pub(crate) fn sentence(own: &Diagnosis) -> String {
    let amount = |value: f64| Si(value, if own.unit.is_empty() { "m/m" } else { &own.unit }).to_string();
    let names: Vec<String> = own
        .effects
        .iter()
        .map(|effect| format!("{} ({:.0} % of the gap)", effect.name, 100.0 * effect.share))
        .collect();
    let names = names.join(" + ");
    let (before, after) = (amount(own.gap_before), amount(own.gap_after));
    let held_out = if own.gap_after <= own.gap_before {
        format!("{after} is left of {before} held out")
    } else {
        format!("the held-out gap grows from {before} to {after}")
    };
    let left = format!(
        "{held_out}, {} within the fit, at a noise of {}",
        amount(own.remainder_rms),
        amount(own.noise_rms)
    );
    let mut sentence = match own.verdict {
        Verdict::None => format!("No effect is missing: beside calibration and nuisance {left}."),
        Verdict::Columns | Verdict::NotExcited => {
            "The output hardly moves out of its noise, so these data could not have shown any effect.".to_owned()
        }
        Verdict::Unknown if !own.effects.is_empty() => {
            format!(
                "Something is missing that the library does not hold: with {names}, {left}, which is too much, or what was tried in their place is believed more."
            )
        }
        Verdict::Unknown => {
            let nearest = own.candidates.iter().find(|own| own.terms > 0);
            let nearest = nearest.map_or(String::new(), |own| {
                format!(
                    "; the nearest that the library holds, {}, leaves {}",
                    own.name,
                    amount(own.gap_after)
                )
            });
            format!("Something is missing that the library does not hold: {left}{nearest}.")
        }
        Verdict::Ambiguous => {
            let others = own.ambiguous_with.join(" or ");
            format!("These data do not separate {names} from {others}; with the first, {left}.")
        }
        Verdict::Parameter => format!("The model is complete, but {names} differs from its nominal value: {left}."),
        Verdict::Sensor => format!("It is the sensor: with {names}, {left}."),
        Verdict::Named => format!("With {names}, {left}."),
    };
    if let Some(curve) = own.unknown_term.as_ref().and_then(|term| term.curves.first()) {
        sentence += &format!(
            " A free curve over the {} would take {} more of it: a description, not physics.",
            curve.over.name(),
            amount(curve.rms)
        );
    }
    sentence
}
