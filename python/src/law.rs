//! Any hysteresis law with what it remembers, stepped and over arrays.

use crate::arrays::{Array, Given, array, finite, not_negative, row, same_length};
use crate::material::Material;
use crate::refusal::refused;
use anhyst_identify::laws::LawFile;
use anhyst_model::{
    BoucWen, Density, HysteresisLaw, Law as AnyLaw, LawModel, LawModelState, PlayGroup, PlaySum, Preisach,
    ScaledDomainWall, Warp,
};
use anhyst_scenario::{load_model, load_with, parse, to_ron};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// y = y₀ + b v + Σ h(v) + Σ d x: hysteresis laws in parallel, a line and creep, with the state that they are in.
///
/// Whatever goes in and comes out is in the law's own units. A new law is at rest at input 0.
#[pyclass(module = "anhyst")]
pub struct Law {
    model: Arc<LawModel>,
    state: LawModelState,
}

/// All that a law remembers. It can be given back to a law with the same numbers.
#[pyclass(frozen, from_py_object, module = "anhyst")]
#[derive(Clone)]
pub struct LawState {
    model: Arc<LawModel>,
    state: LawModelState,
}

#[pymethods]
impl LawState {
    fn __eq__(&self, other: &Self) -> bool {
        self.model == other.model && self.state == other.state
    }

    /// Where the input stands.
    #[getter]
    fn input(&self) -> f64 {
        LawModel::input(&self.state)
    }

    /// What comes out there.
    #[getter]
    fn output(&self) -> f64 {
        self.model.output(&self.state)
    }
}

impl Law {
    pub fn of(model: LawModel) -> PyResult<Self> {
        model.validate().map_err(refused)?;
        Ok(Self {
            state: model.rest(),
            model: Arc::new(model),
        })
    }

    fn moved(&mut self, x: f64, dt: f64) -> f64 {
        self.model.pass(&mut self.state, dt);
        self.model.advance(&mut self.state, x);
        self.model.output(&self.state)
    }
}

/// One law without anything beside it.
fn alone(law: AnyLaw) -> LawModel {
    LawModel {
        laws: vec![law],
        ..LawModel::default()
    }
}

/// Every number of a value in turn; what was not finite is null.
fn each_number(value: &mut Value, with: &mut dyn FnMut(&mut Value) -> PyResult<()>) -> PyResult<()> {
    match value {
        Value::Number(_) | Value::Null => with(value),
        Value::Array(values) => values.iter_mut().try_for_each(|own| each_number(own, with)),
        Value::Object(fields) => fields.values_mut().try_for_each(|own| each_number(own, with)),
        Value::Bool(_) | Value::String(_) => Ok(()),
    }
}

fn from_ron<T: DeserializeOwned>(text: &str) -> PyResult<T> {
    parse(Path::new("text"), text).map_err(refused)
}

#[pymethods]
impl Law {
    /// From a file: a law as `anhyst fit --law` writes it, a material, an actuator's model, or a hysteresis alone.
    #[staticmethod]
    pub fn load(path: PathBuf) -> PyResult<Self> {
        if let Some(file) = load_with::<LawFile>(&path, "input_extent").map_err(refused)? {
            return Self::of(file.model);
        }
        let material = load_model(&path).map_err(refused)?.material;
        Material(material).law()
    }

    /// From a RON text, as it stands in `law.ron` after `model:`.
    #[staticmethod]
    fn from_ron(text: &str) -> PyResult<Self> {
        Self::of(from_ron(text)?)
    }

    /// From a JSON text of the same.
    #[staticmethod]
    fn from_json(text: &str) -> PyResult<Self> {
        Self::of(serde_json::from_str(text).map_err(refused)?)
    }

    /// Prandtl-Ishlinskii: plays of these radii (unit of the input) and weights (output per input), shape (n,) each, and a line.
    #[staticmethod]
    #[pyo3(signature = (radii, weights, line = 0.0))]
    fn prandtl_ishlinskii(radii: Given<'_>, weights: Given<'_>, line: f64) -> PyResult<Self> {
        same_length(("radii", radii.len()?), ("weights", weights.len()?))?;
        let group = PlayGroup {
            warp: Warp::Straight,
            radii: row(&radii).into_owned(),
            weights: row(&weights).into_owned(),
        };
        let plays = AnyLaw::Plays(PlaySum { groups: vec![group] });
        Self::of(LawModel {
            slope: line,
            ..alone(plays)
        })
    }

    /// Preisach by cells: rising levels of the input, shape (n + 1,), and the cells' weights (unit of the output) row by row, row i with
    /// columns 0 to i, shape (n (n + 1)/2,).
    #[staticmethod]
    fn preisach(levels: Given<'_>, weights: Given<'_>) -> PyResult<Self> {
        let density = Density::Cells {
            levels: row(&levels).into_owned(),
            weights: row(&weights).into_owned(),
        };
        Self::of(alone(AnyLaw::Preisach(Preisach::from(density))))
    }

    /// Preisach by a product of two Lorentz distributions; `amplitude` in the unit of the output, the others in that of the input.
    #[staticmethod]
    #[pyo3(signature = (amplitude, coercivity, width, reach, rows = 40))]
    fn preisach_lorentz(amplitude: f64, coercivity: f64, width: f64, reach: f64, rows: usize) -> PyResult<Self> {
        let density = Density::Lorentz {
            amplitude,
            coercivity,
            width,
            reach,
            rows,
        };
        Self::of(alone(AnyLaw::Preisach(Preisach::from(density))))
    }

    /// Bouc-Wen: `amplitude` in the unit of the output, `yield_input` in that of the input, the others without unit.
    #[staticmethod]
    #[pyo3(signature = (amplitude, yield_input, exponent = 1.0, loading_share = 0.5, stiffens = false))]
    fn bouc_wen(amplitude: f64, yield_input: f64, exponent: f64, loading_share: f64, stiffens: bool) -> PyResult<Self> {
        Self::of(alone(AnyLaw::BoucWen(BoucWen {
            amplitude,
            yield_input,
            exponent,
            loading_share,
            stiffens,
        })))
    }

    /// The paper's: a material's magnetization times `gain`.
    #[staticmethod]
    #[pyo3(signature = (material, gain = 1.0))]
    pub fn domain_wall(material: &Material, gain: f64) -> PyResult<Self> {
        Self::of(alone(AnyLaw::DomainWall(ScaledDomainWall {
            gain,
            hysteresis: material.0.hysteresis,
        })))
    }

    /// Its numbers as a RON text.
    #[getter]
    fn ron(&self) -> PyResult<String> {
        to_ron(&*self.model).map_err(refused)
    }

    /// Its numbers as a JSON text.
    fn to_json(&self) -> PyResult<String> {
        serde_json::to_string(&*self.model).map_err(refused)
    }

    /// Lets `dt` seconds pass at the present input, then moves the input there; the output.
    #[pyo3(signature = (x, dt = 0.0))]
    fn step(&mut self, x: f64, dt: f64) -> PyResult<f64> {
        finite("x", &[x])?;
        not_negative("dt", dt)?;
        Ok(self.moved(x, dt))
    }

    /// Steps to one input after the other, shape (n,), `dt` seconds apart: the outputs, shape (n,).
    #[pyo3(signature = (x, dt = 0.0))]
    fn run<'py>(&mut self, py: Python<'py>, x: Given<'py>, dt: f64) -> PyResult<Array<'py>> {
        let inputs = row(&x);
        let inputs: &[f64] = &inputs;
        finite("x", inputs)?;
        not_negative("dt", dt)?;
        let outputs = py.detach(|| inputs.iter().map(|own| self.moved(*own, dt)).collect());
        Ok(array(py, outputs))
    }

    /// Outputs and slopes (d output/d input, on the side from which the input comes) for each sample, shape (n,) each.
    #[pyo3(signature = (x, dt = 0.0))]
    fn run_with_slopes<'py>(&mut self, py: Python<'py>, x: Given<'py>, dt: f64) -> PyResult<(Array<'py>, Array<'py>)> {
        let inputs = row(&x);
        finite("x", &inputs)?;
        not_negative("dt", dt)?;
        let (mut outputs, mut slopes) = (Vec::with_capacity(inputs.len()), Vec::with_capacity(inputs.len()));
        for input in inputs.iter() {
            self.model.pass(&mut self.state, dt);
            slopes.push(self.model.ahead(&self.state, *input).1);
            self.model.advance(&mut self.state, *input);
            outputs.push(self.model.output(&self.state));
        }
        Ok((array(py, outputs), array(py, slopes)))
    }

    /// The inverse: moves the input so that the output follows `y`, the input not past ±`limit`, which is finite. Inputs, and whether
    /// each output was reached, shape (n,) each.
    #[pyo3(signature = (y, limit, dt = 0.0))]
    fn invert<'py>(
        &mut self,
        py: Python<'py>,
        y: Given<'py>,
        limit: f64,
        dt: f64,
    ) -> PyResult<(Array<'py>, Bound<'py, numpy::PyArray1<bool>>)> {
        let outputs = row(&y);
        let outputs: &[f64] = &outputs;
        finite("y", outputs)?;
        not_negative("limit", limit)?;
        not_negative("dt", dt)?;
        let (inputs, reached) = py.detach(|| {
            let each = outputs.iter().map(|output| {
                self.model.pass(&mut self.state, dt);
                let reached = self.model.advance_to_output(&mut self.state, *output, limit);
                (LawModel::input(&self.state), reached)
            });
            each.collect::<(Vec<f64>, Vec<bool>)>()
        });
        Ok((array(py, inputs), numpy::PyArray1::from_vec(py, reached)))
    }

    /// Where the input would have to go for the output to be `y`, not past ±`limit`, and whether it is then reached. Moves nothing.
    fn input_for(&self, y: f64, limit: f64) -> PyResult<(f64, bool)> {
        finite("y", &[y])?;
        not_negative("limit", limit)?;
        Ok(self.model.input_for(&self.state, y, limit))
    }

    /// Output and slope where a step to `x` would lead. Moves nothing.
    fn ahead(&self, x: f64) -> PyResult<(f64, f64)> {
        finite("x", &[x])?;
        Ok(self.model.ahead(&self.state, x))
    }

    /// d output/d input here, for a rising or a falling input.
    #[pyo3(signature = (rising = true))]
    fn slope(&self, rising: bool) -> f64 {
        self.model.slope(&self.state, rising)
    }

    /// Where the input stands.
    #[getter]
    fn input(&self) -> f64 {
        LawModel::input(&self.state)
    }

    /// What comes out there.
    #[getter]
    fn output(&self) -> f64 {
        self.model.output(&self.state)
    }

    /// All that it remembers.
    #[getter]
    fn state(&self) -> LawState {
        LawState {
            model: self.model.clone(),
            state: self.state.clone(),
        }
    }

    #[setter]
    fn set_state(&mut self, state: LawState) -> PyResult<()> {
        if !Arc::ptr_eq(&self.model, &state.model) && self.model != state.model {
            return Err(refused(
                "the state is of a law with other numbers: it can be set only where they are the same",
            ));
        }
        self.state = state.state;
        Ok(())
    }

    /// All that it remembers as numbers, shape (m,) with the same m for the law's whole life: for whoever keeps states as vectors.
    #[getter]
    fn state_vector<'py>(&self, py: Python<'py>) -> PyResult<Array<'py>> {
        let mut numbers = Vec::new();
        let mut state = serde_json::to_value(&self.state).map_err(refused)?;
        each_number(&mut state, &mut |number| {
            numbers.push(number.as_f64().unwrap_or(f64::NAN));
            Ok(())
        })?;
        Ok(array(py, numbers))
    }

    #[setter]
    fn set_state_vector(&mut self, numbers: Given<'_>) -> PyResult<()> {
        let numbers = row(&numbers);
        let mut left = numbers.iter();
        let mut state = serde_json::to_value(&self.state).map_err(refused)?;
        let refuse = || {
            refused(format!(
                "{} numbers are not the state of this law, which has others",
                numbers.len()
            ))
        };
        each_number(&mut state, &mut |number| {
            *number = (*left.next().ok_or_else(refuse)?).into();
            Ok(())
        })?;
        if left.next().is_some() {
            return Err(refuse());
        }
        self.state = serde_json::from_value(state).map_err(refused)?;
        Ok(())
    }

    /// Back to rest at input 0.
    fn reset(&mut self) {
        self.state = self.model.rest();
    }

    /// Every number that a fit chooses: name, value, the smallest and the largest that it may be.
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let each = self.model.parameters().into_iter().map(|own| {
            let told = PyDict::new(py);
            told.set_item("name", own.name)?;
            told.set_item("value", own.value)?;
            told.set_item("lower", own.lower)?;
            told.set_item("upper", own.upper)?;
            Ok(told)
        });
        each.collect()
    }

    /// What the output is linear in: offset, line, the weights of each law in turn, those of creep.
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> Array<'py> {
        array(py, self.model.weights())
    }

    /// d output/d weight of each of the weights, here.
    fn regressors<'py>(&self, py: Python<'py>) -> Array<'py> {
        let mut regressors = Vec::new();
        self.model.regressors(&self.state, &mut regressors);
        array(py, regressors)
    }

    /// A law that goes on as this one would.
    fn copy(&self) -> Self {
        Self {
            model: self.model.clone(),
            state: self.state.clone(),
        }
    }

    fn __copy__(&self) -> Self {
        self.copy()
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.copy()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.model == other.model && self.state == other.state
    }

    fn __reduce__(slf: &Bound<'_, Self>) -> PyResult<(Py<PyAny>, (String, String))> {
        let own = slf.borrow();
        let pickled = (own.ron()?, to_ron(&own.state).map_err(refused)?);
        Ok((slf.get_type().getattr("_unpickled")?.unbind(), pickled))
    }

    #[staticmethod]
    fn _unpickled(model: &str, state: &str) -> PyResult<Self> {
        let mut law = Self::from_ron(model)?;
        law.state = from_ron(state)?;
        Ok(law)
    }

    fn __repr__(&self) -> String {
        let numbers = self.model.parameters().len();
        format!(
            "<anhyst.Law of {numbers} numbers at input {}>",
            LawModel::input(&self.state)
        )
    }
}
