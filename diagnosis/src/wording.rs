//! A diagnosis in sentences, with its amounts in units that suit them.

use crate::diagnosis::{Diagnosis, Verdict};
use crate::freeform::UnknownTerm;
use crate::locate::ChannelGap;
use crate::workbench::Fitted;

pub(crate) fn amplifier_sentences(channels: &[ChannelGap]) -> Vec<String> {
    let own = channels.iter().filter(|gap| gap.channel == "field").map(|gap| {
        let ratio = gap.rms / gap.noise_rms;
        if ratio < 1.05 {
            "the measured field follows the model's from the command within its noise: the gap is not in the amplifier".to_owned()
        } else {
            format!(
                "the measured field differs from the model's by {:.3} A/m rms, {ratio:.1} times its noise: the amplifier has a part in it",
                gap.rms
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

pub(crate) fn sentence(own: &Diagnosis) -> String {
    let names: Vec<&str> = own.effects.iter().map(|effect| effect.name.as_str()).collect();
    let gap = format!(
        "the held-out gap falls from {} to {} at a noise of {}",
        Amount(own.gap_before, &own.unit),
        Amount(own.gap_after, &own.unit),
        Amount(own.noise_rms, &own.unit)
    );
    let names = names.join(" + ");
    match own.verdict {
        Verdict::Ambiguous => {
            format!(
                "These data do not separate {names} from {}; with the first, {gap}.",
                own.ambiguous_with.join(" or ")
            )
        }
        Verdict::Parameter => format!("The model is complete, but {names} differs from its nominal value: {gap}."),
        Verdict::Sensor => format!("It is the sensor: with {names}, {gap}."),
        _ => format!("With {names}, {gap}."),
    }
}

pub(crate) fn unknown_sentence(own: &Diagnosis, nearest: Option<&Fitted>, term: Option<&UnknownTerm>) -> String {
    let mut sentence = format!(
        "Something is missing that the library does not hold: {} is left at a noise of {}",
        Amount(own.gap_before, &own.unit),
        Amount(own.noise_rms, &own.unit)
    );
    if let Some(nearest) = nearest {
        sentence += &format!(
            "; the nearest that it holds, {}, still leaves {}",
            short_name(nearest),
            Amount(nearest.held_out_rms, &own.unit)
        );
    }
    if let Some(term) = term {
        let over: Vec<String> = term.curves.iter().map(|curve| curve.over.name()).collect();
        sentence += &format!(
            "; a free-form term over {} leaves {}",
            over.join(", "),
            Amount(term.held_out_rms_after, &own.unit)
        );
    }
    sentence + "."
}

pub(crate) fn effect_names(fit: &Fitted) -> String {
    let effects = fit
        .settings
        .iter()
        .map(|own| own.term.name())
        .filter(|name| !name.starts_with("parameter_"));
    effects.collect::<Vec<_>>().join(" + ")
}

fn short_name(fit: &Fitted) -> String {
    let effects: Vec<&str> = fit
        .settings
        .iter()
        .map(|own| own.term.name())
        .filter(|name| !name.starts_with("parameter_"))
        .collect();
    if fit.settings.len() > 2 {
        let beside = if effects.is_empty() {
            String::new()
        } else {
            format!(" with {}", effects.join(" + "))
        };
        return format!("a calibration of all parameters{beside}");
    }
    fit.name()
}

/// A length in the unit that suits it; strain in parts per million.
pub(crate) struct Amount<'a>(pub f64, pub &'a str);

impl std::fmt::Display for Amount<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Amount(value, unit) = self;
        match *unit {
            "m" if value.abs() < 1e-6 => write!(formatter, "{:.2} nm", 1e9 * value),
            "m" => write!(formatter, "{:.3} µm", 1e6 * value),
            _ => write!(formatter, "{:.2} ppm", 1e6 * value),
        }
    }
}
