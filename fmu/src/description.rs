//! `modelDescription.xml`: what an FMU says of itself.

use crate::kind::{Kind, instantiation_token};
use crate::si_units::exponents;
use crate::variables::{Causality, Variable, variables};
use anhyst_ipc::FieldKind;
use anhyst_scenario::Scenario;
use std::collections::BTreeSet;
use std::fmt::Write as _;

/// Text inside an attribute.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            _ => out.push(letter),
        }
    }
    out
}

/// The description of a part of `scenario`, whose text in the FMU's resources is `text`.
///
/// `identifier` is the name of the library without its ending.
pub fn description(kind: Kind, scenario: &Scenario, text: &str, identifier: &str) -> String {
    let all = variables(kind, scenario);
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write_all(&mut out, kind, scenario, text, identifier, &all);
    out
}

fn write_all(
    out: &mut String,
    kind: Kind,
    scenario: &Scenario,
    text: &str,
    identifier: &str,
    all: &[Variable],
) -> std::fmt::Result {
    let (tick_s, duration_s) = (scenario.tick_s, scenario.duration_s);
    writeln!(
        out,
        r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="anhyst.{kind}.{name}" instantiationToken="{token}"
    description="{about}, from the scenario {name}" version="{version}" license="MIT OR Apache-2.0"
    generationTool="anhyst {version}" variableNamingConvention="structured">
  <CoSimulation modelIdentifier="{identifier}" canGetAndSetFMUState="true" canSerializeFMUState="false"
      canHandleVariableCommunicationStepSize="false" fixedInternalStepSize="{tick_s:?}"/>"#,
        kind = kind.name(),
        name = escaped(&scenario.name),
        token = instantiation_token(kind, text),
        about = kind.about(),
        version = env!("CARGO_PKG_VERSION"),
    )?;
    write_units(out, all)?;
    writeln!(
        out,
        r#"  <LogCategories>
    <Category name="logStatusError" description="Calls that were refused, each with its reason"/>
    <Category name="logStatusFatal" description="Faults of the library"/>
  </LogCategories>
  <DefaultExperiment startTime="0" stopTime="{duration_s:?}" stepSize="{tick_s:?}"/>
  <ModelVariables>"#
    )?;
    all.iter().try_for_each(|variable| write_variable(out, variable))?;
    writeln!(out, "  </ModelVariables>\n  <ModelStructure>")?;
    for element in ["Output", "InitialUnknown"] {
        for variable in all.iter().filter(|own| own.causality == Causality::Output) {
            writeln!(out, r#"    <{element} valueReference="{}"/>"#, variable.reference)?;
        }
    }
    writeln!(out, "  </ModelStructure>\n</fmiModelDescription>")
}

fn write_units(out: &mut String, all: &[Variable]) -> std::fmt::Result {
    let units: BTreeSet<&str> = all
        .iter()
        .map(|own| &*own.unit)
        .filter(|unit| !unit.is_empty())
        .collect();
    writeln!(out, "  <UnitDefinitions>")?;
    for unit in units {
        writeln!(out, r#"    <Unit name="{unit}">"#)?;
        write!(out, "      <BaseUnit")?;
        for (base, exponent) in exponents(unit).into_iter().flatten().filter(|(_, own)| *own != 0) {
            write!(out, r#" {base}="{exponent}""#)?;
        }
        writeln!(out, "/>\n    </Unit>")?;
    }
    writeln!(out, "  </UnitDefinitions>")
}

fn write_variable(out: &mut String, variable: &Variable) -> std::fmt::Result {
    let element = match variable.kind {
        FieldKind::F64 => "Float64",
        FieldKind::U64 => "UInt64",
    };
    // Only numbers can be continuous.
    let signal = match variable.kind {
        FieldKind::F64 => "continuous",
        FieldKind::U64 => "discrete",
    };
    let (causality, variability) = match variable.causality {
        Causality::Independent => ("independent", "continuous"),
        Causality::Parameter { tunable: true } => ("parameter", "tunable"),
        Causality::Parameter { tunable: false } => ("parameter", "fixed"),
        Causality::Input => ("input", signal),
        Causality::Output => ("output", signal),
    };
    write!(
        out,
        r#"    <{element} name="{}" valueReference="{}" causality="{causality}" variability="{variability}" description="{}""#,
        escaped(&variable.name),
        variable.reference,
        escaped(&variable.doc),
    )?;
    match variable.causality {
        Causality::Output => write!(out, r#" initial="calculated""#)?,
        Causality::Parameter { .. } => write!(out, r#" initial="exact""#)?,
        _ => (),
    }
    if let Some(word) = variable.start {
        match variable.kind {
            FieldKind::F64 => write!(out, r#" start="{:?}""#, f64::from_bits(word))?,
            FieldKind::U64 => write!(out, r#" start="{word}""#)?,
        }
    }
    // An integer of FMI has no unit.
    if variable.kind == FieldKind::F64 && !variable.unit.is_empty() {
        write!(out, r#" unit="{}""#, variable.unit)?;
    }
    writeln!(out, "/>")
}
