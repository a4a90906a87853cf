//! `amended.ron`: the model with what was found, and in comments where it comes from and how sure it is.

use anhyst_model::ActuatorModel;
use ron::ser::PrettyConfig;

use crate::diagnosis::{Diagnosis, Verdict};
use crate::error::DiagnosisError;
use crate::wording::Amount;

/// The amended model as text for a file. Without anything named it is the model as given, and says so.
///
/// # Errors
/// A model that cannot be written as RON.
pub fn amended_text(diagnosis: &Diagnosis, amended: &ActuatorModel) -> Result<String, DiagnosisError> {
    let mut lines = vec![
        format!(
            "{}, amended by `anhyst diagnose`: verdict {}.",
            diagnosis.model,
            diagnosis.verdict.name()
        ),
        diagnosis.sentence.clone(),
    ];
    for data in &diagnosis.data {
        lines.push(format!(
            "Data: {}, {} rows, XXH3 of the file {}",
            data.source, data.rows, data.data_hash
        ));
    }
    lines.push(format!(
        "Held-out gap before {}, after {}, noise {}",
        Amount(diagnosis.gap_before, &diagnosis.unit),
        Amount(diagnosis.gap_after, &diagnosis.unit),
        Amount(diagnosis.noise_rms, &diagnosis.unit)
    ));
    for effect in diagnosis.effects.iter().chain(&diagnosis.calibrated) {
        for value in &effect.values {
            let known = value
                .standard_deviation
                .map_or("not fixed by these data".to_owned(), |deviation| {
                    format!("standard deviation {deviation:.2e}")
                });
            let line = format!("{}: {} = {:.7e} {}", effect.name, value.name, value.value, value.unit);
            lines.push(format!("{}, {known}", line.trim_end()));
        }
    }
    for other in &diagnosis.ambiguous_with {
        lines.push(format!("These data allow {other} as well."));
    }
    if matches!(
        diagnosis.verdict,
        Verdict::None | Verdict::NotExcited | Verdict::Unknown
    ) {
        lines.push("Nothing was named: this is the model as it was given.".to_owned());
    }
    let header: String = lines
        .iter()
        .map(|line| format!("// {}\n", line.replace('\n', " ")))
        .collect();
    Ok(header + &ron::ser::to_string_pretty(amended, PrettyConfig::new().struct_names(false))? + "\n")
}
