//! `amended.ron`: the model with what was found, and in comments where it comes from and how sure it is.

use anhyst_model::ActuatorModel;
use anhyst_report::number::Si;
use ron::ser::PrettyConfig;

use crate::diagnosis::Diagnosis;
use crate::error::DiagnosisError;

/// The amended model as text for a file. Where no effect was named it holds the calibrated constants, and says so.
///
/// # Errors
/// A model that cannot be written as RON.
pub fn amended_text(diagnosis: &Diagnosis, amended: &ActuatorModel) -> Result<String, DiagnosisError> {
    let unit = if diagnosis.unit.is_empty() {
        "m/m"
    } else {
        &diagnosis.unit
    };
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
        Si(diagnosis.gap_before, unit),
        Si(diagnosis.gap_after, unit),
        Si(diagnosis.noise_rms, unit)
    ));
    // What was fitted and makes nothing smaller is not in the model.
    let parts = diagnosis.effects.iter().chain(&diagnosis.parameters);
    for effect in parts.filter(|_| diagnosis.explained > 0.0) {
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
    let shrinks = diagnosis.explained > 0.0;
    lines.push(if shrinks {
        format!(
            "Explained: {:.1} % of the gap's energy; left: {}",
            100.0 * diagnosis.explained,
            Si(diagnosis.remainder_rms, unit)
        )
    } else {
        "Nothing that was tried makes the gap smaller: the model is as it was given.".to_owned()
    });
    if shrinks && diagnosis.effects.is_empty() {
        lines.push("No effect was named: only constants are calibrated.".to_owned());
    }
    let header: String = lines
        .iter()
        .map(|line| format!("// {}\n", line.replace('\n', " ")))
        .collect();
    Ok(header + &ron::ser::to_string_pretty(amended, PrettyConfig::new().struct_names(false))? + "\n")
}
