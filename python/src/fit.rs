//! Hysteresis laws fitted to arrays, and run along others.

use crate::arrays::{Array, Given, array, finite, row, same_length};
use crate::interrupt::interruptible;
use crate::refusal::refused;
use anhyst_identify::laws::{Family, LawData, LawFile, LawOptions, LawRecord, fit_laws, predict};
use anhyst_measured::Quantity;
use anhyst_scenario::{parse, to_ron};
use pyo3::prelude::*;
use std::path::Path;

/// Of the chosen law: `law.ron`, `fit.json`, its numbers as JSON, and what it makes of each record.
type Fitted<'py> = (String, String, String, Vec<Array<'py>>);

/// The laws that can be fitted, by name.
#[pyfunction]
pub fn law_names() -> Vec<&'static str> {
    Family::ALL.map(Family::name).to_vec()
}

fn quantity(key: &str) -> PyResult<Quantity> {
    let named = Quantity::ALL.into_iter().find(|quantity| quantity.key() == key);
    named.ok_or_else(|| {
        let known = Quantity::ALL.map(Quantity::key).join(", ");
        refused(format!("there is no quantity {key:?}; there are {known}"))
    })
}

/// A record that a law can be run along; without an output nothing was measured of it.
fn record(
    number: usize,
    inputs: &Given<'_>,
    outputs: Option<&Given<'_>>,
    time_s: Option<&Given<'_>>,
) -> PyResult<LawRecord> {
    let input = row(inputs).into_owned();
    if input.is_empty() {
        return Err(refused(format!("record {number} has no samples")));
    }
    let output = outputs.map_or_else(|| vec![0.0; input.len()], |own| row(own).into_owned());
    let time_s = time_s.map(|own| row(own).into_owned());
    same_length(("the input", input.len()), ("the output", output.len()))?;
    finite("the input", &input)?;
    finite("the output", &output)?;
    if let Some(time_s) = &time_s {
        same_length(("the input", input.len()), ("the time", time_s.len()))?;
        finite("the time", time_s)?;
        if let Some(place) = time_s.windows(2).position(|pair| pair[1] <= pair[0]) {
            return Err(refused(format!(
                "the time[{}] is {} s and the one after it {} s: it must rise from sample to sample",
                place,
                time_s[place],
                time_s[place + 1]
            )));
        }
    }
    Ok(LawRecord {
        id: number.to_string(),
        input,
        output,
        time_s,
    })
}

/// Fits a law by its name, or of all the one that predicts best (`"auto"`), to records of input, output and time (s; none: a sweep).
/// `threads` 0: one a core.
#[pyfunction]
#[pyo3(signature = (records, law = "auto", input = "voltage", output = "displacement", threads = 0))]
pub fn fit_law<'py>(
    py: Python<'py>,
    records: Vec<(Given<'py>, Given<'py>, Option<Given<'py>>)>,
    law: &str,
    input: &str,
    output: &str,
    threads: usize,
) -> PyResult<Fitted<'py>> {
    let family = match law {
        "auto" => None,
        name => Some(Family::named(name).ok_or_else(|| {
            let known = Family::ALL.map(Family::name).join(", ");
            refused(format!("there is no law {name:?}; there are auto, {known}"))
        })?),
    };
    let each = records.iter().enumerate();
    let all = each.map(|(number, (inputs, outputs, time_s))| record(number, inputs, Some(outputs), time_s.as_ref()));
    let all = all.collect::<PyResult<Vec<LawRecord>>>()?;
    let (input, output) = (quantity(input)?, quantity(output)?);
    let threads = match threads {
        0 => anhyst_identify::parallel::available(),
        threads => threads,
    };
    let fitted = interruptible(py, || {
        LawData::of_records("arrays".into(), input, output, all)
            .and_then(|data| fit_laws(family, &data, &LawOptions::default(), threads, &|_, _| ()))
    });
    let fitted = fitted?.map_err(refused)?;
    Ok((
        to_ron(&fitted.file).map_err(refused)? + "\n",
        serde_json::to_string(&fitted.report).map_err(refused)?,
        serde_json::to_string(&fitted.file.model).map_err(refused)?,
        fitted.modelled.into_iter().map(|own| array(py, own)).collect(),
    ))
}

/// A free run of a law, given as `law.ron`, along records of input and time, each begun as the fit assumed.
#[pyfunction]
pub fn predict_law<'py>(
    py: Python<'py>,
    law: &str,
    records: Vec<(Given<'py>, Option<Given<'py>>)>,
) -> PyResult<Vec<Array<'py>>> {
    let file: LawFile = parse(Path::new("law.ron"), law).map_err(refused)?;
    file.validate().map_err(refused)?;
    let each = records.iter().enumerate();
    let all = each.map(|(number, (inputs, time_s))| record(number, inputs, None, time_s.as_ref()));
    let all = all.collect::<PyResult<Vec<LawRecord>>>()?;
    let inputs = all.iter().flat_map(|record| &record.input);
    let input_extent = inputs.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| {
        [low.min(*value), high.max(*value)]
    });
    let data = LawData {
        source: "arrays".into(),
        input: file.input,
        output: file.output,
        records: all,
        input_extent,
        output_extent: [0.0; 2],
        beneath: None,
        doubts: Vec::new(),
    };
    let modelled = py.detach(|| predict(&file, &data).modelled);
    Ok(modelled.into_iter().map(|own| array(py, own)).collect())
}
