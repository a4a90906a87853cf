//! The fitted material as the text of a RON file, opening with where the numbers come from and how good they are.

use anhyst_model::Material;
use ron::ser::PrettyConfig;

use crate::error::IdentifyError;
use crate::fit::Fit;

/// Text for `scenarios/materials/NAME.ron`; the first lines are comments with source, data hash and figures of the fit.
///
/// A fit without strain is refused: a material without a strain law moves nothing.
pub fn material_text(fit: &Fit, name: &str) -> Result<String, IdentifyError> {
    let report = &fit.report;
    let material: Material = fit.material(name).ok_or_else(|| IdentifyError::NoStrain {
        source_of_data: report.source.clone(),
    })?;
    let mut lines = vec![
        format!("{name}: fitted by `anhyst fit` to measured loops."),
        format!("Source: {}, XXH3 of the file {}", report.source, report.data_hash),
        format!(
            "NRMSE (rms/range) from field alone: magnetization {:.3} %{}, {} loop(s), {:?} curve",
            100.0 * report.magnetization_nrmse,
            report
                .strain_nrmse
                .map_or(String::new(), |nrmse| format!(", strain {:.3} %", 100.0 * nrmse)),
            report.loops.len(),
            report.anhysteretic
        ),
    ];
    for fitted in &report.parameters {
        let quantity = format!("{} = {:.5e} {}", fitted.symbol, fitted.value, fitted.unit);
        let known = match fitted.standard_deviation {
            Some(deviation) => format!("standard deviation {deviation:.1e}"),
            None => "held by the user".to_owned(),
        };
        lines.push(format!("{}, {known}", quantity.trim_end()));
    }
    if let Some(strain) = report.strain {
        lines.push(format!(
            "strain = gamma M^2, gamma = {:.4e} m^2/A^2, standard deviation {:.1e}; lambda_s = 2 gamma Ms^2 / 3",
            strain.gamma_m2_per_a2.value, strain.gamma_m2_per_a2.standard_deviation
        ));
    }
    lines.extend(
        report
            .assumptions
            .iter()
            .map(|sentence| format!("Assumed: {sentence}.")),
    );
    lines.extend(report.warnings.iter().map(|sentence| format!("Warning: {sentence}.")));
    let header: String = lines
        .iter()
        .map(|line| format!("// {}\n", line.trim_end().replace('\n', " ")))
        .collect();
    Ok(header + &ron::ser::to_string_pretty(&material, PrettyConfig::new().struct_names(false))? + "\n")
}
