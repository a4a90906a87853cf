//! A gap taken apart, as the sections of a page: measured = nominal + what was found + nuisance + remainder.
//!
//! Plain data in, sections out: how much each part explains, what each adds over time and over the field, and what else
//! was tried. All series of a run have one length.

use crate::chart::{Axis, Chart, Curve, Cycles, Figure, Role};
use crate::number::{Si, percent};
use crate::page::{Bar, Bars, Block, Section, Segment, Shares};
use crate::table::{Cell, Table};

/// A gap and what it is made of.
#[derive(Clone, Debug, Default)]
pub struct Decomposition<'a> {
    /// Of the output: m, A/m; m/m for strain.
    pub unit: &'a str,
    /// rms of measured minus nominal, of what is left, and of the noise, in the unit.
    pub gap_rms: f64,
    pub remainder_rms: f64,
    pub noise_rms: f64,
    /// In the order in which they are shown.
    pub parts: Vec<Part<'a>>,
    /// Share of the gap's energy that nothing explains, 0 to 1.
    pub remainder_share: f64,
    pub runs: Vec<Run<'a>>,
    pub candidates: Vec<Candidate<'a>>,
}

/// What a part belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A cause that the model lacks.
    Effect,
    /// Another value of something that the model has.
    Parameter,
    /// Of the measurement, not of the physics.
    Nuisance,
}

/// A cause of the gap.
#[derive(Clone, Debug)]
pub struct Part<'a> {
    pub name: &'a str,
    pub kind: Kind,
    /// Share of the gap's energy beside the others, 0 to 1.
    pub share: f64,
    /// The same without the others.
    pub share_alone: Option<f64>,
    /// What it adds is a loop over the field: shown over it, too.
    pub over_field: bool,
    pub values: Vec<Value<'a>>,
}

/// A fitted number of a part.
#[derive(Clone, Copy, Debug)]
pub struct Value<'a> {
    pub name: &'a str,
    pub unit: &'a str,
    pub value: f64,
    /// None where the data do not fix it.
    pub standard_deviation: Option<f64>,
    /// Of the model as given.
    pub nominal: Option<f64>,
}

/// A measured run and what the models make of it, in the output's unit.
#[derive(Clone, Debug, Default)]
pub struct Run<'a> {
    pub name: &'a str,
    /// None: over rows.
    pub tick_s: Option<f64>,
    /// Empty where there is none.
    pub field_a_per_m: &'a [f64],
    pub measured: &'a [f64],
    pub nominal: &'a [f64],
    /// With effects and parameters, without nuisance.
    pub amended: &'a [f64],
    pub nuisance: &'a [f64],
    /// What each part adds, in the order of [`Decomposition::parts`]; empty: not shown.
    pub contributions: Vec<&'a [f64]>,
}

/// An explanation that was tried.
#[derive(Clone, Copy, Debug)]
pub struct Candidate<'a> {
    pub name: &'a str,
    /// rms that it leaves, in the output's unit.
    pub left_rms: f64,
    /// It is part of the answer.
    pub chosen: bool,
    /// What speaks for or against it, in a few words.
    pub note: &'a str,
}

impl Decomposition<'_> {
    /// The sections of a page, in this order: shares, runs, a chart a part, candidates.
    pub fn sections(&self) -> Vec<Section> {
        let mut sections = vec![self.shares(), self.series()];
        if !self.parts.is_empty() {
            sections.push(self.contributions());
        }
        if !self.candidates.is_empty() {
            sections.push(self.others());
        }
        sections
    }

    /// The colour of each part: effects and parameters in shades of the amended model's.
    fn roles(&self) -> Vec<Role> {
        let (mut found, mut nuisances) = (0.., 0..);
        let role = |part: &Part| match part.kind {
            Kind::Nuisance => nuisances.next().map(Role::Nuisance),
            Kind::Effect | Kind::Parameter => found.next().map(Role::Effect),
        };
        self.parts
            .iter()
            .map(role)
            .map(|role| role.unwrap_or(Role::Limit))
            .collect()
    }

    fn shares(&self) -> Section {
        let remainder = Segment::new("remainder", self.remainder_share, Role::Remainder);
        let of = |kinds: &[Kind]| -> f64 {
            let parts = self.parts.iter().filter(|part| kinds.contains(&part.kind));
            parts.map(|part| part.share).sum()
        };
        let parts = self.parts.iter().zip(self.roles());
        let parts = parts.map(|(part, role)| Segment::new(part.name, part.share, role));
        let whole = vec![
            Segment::new("amended model", of(&[Kind::Effect, Kind::Parameter]), Role::Amended),
            Segment::new("nuisance", of(&[Kind::Nuisance]), Role::Nuisance(0)),
            remainder.clone(),
        ];
        let shares = Shares {
            caption: "Shares of the energy of measured minus nominal.".to_owned(),
            rows: vec![
                (
                    format!("Gap of the nominal model: {} rms", Si(self.gap_rms, self.unit)),
                    whole,
                ),
                ("Part by part".to_owned(), parts.chain([remainder]).collect()),
            ],
        };
        Section::new("The gap, taken apart")
            .paragraph(&format!(
                "{} rms are left at a noise of {}.",
                Si(self.remainder_rms, self.unit),
                Si(self.noise_rms, self.unit)
            ))
            .block(Block::Shares(shares))
            .table(self.table())
    }

    /// Each part with its numbers.
    /// Every part with its share and its numbers, and what is left.
    pub fn table(&self) -> Table {
        let percent = |share: f64| Cell::Number(percent(share, 1));
        let mut table = Table::new([
            "part",
            "is",
            "share",
            "alone",
            "number",
            "value",
            "standard deviation",
            "nominal",
        ]);
        for part in &self.parts {
            let kind = match part.kind {
                Kind::Effect => "effect",
                Kind::Parameter => "parameter",
                Kind::Nuisance => "nuisance",
            };
            let mut head = vec![
                Cell::from(part.name),
                Cell::from(kind),
                percent(part.share),
                part.share_alone.map_or(Cell::from(""), percent),
            ];
            for value in &part.values {
                let amount = |amount: f64| Cell::from(Si(amount, value.unit).to_string());
                let fixed = value.standard_deviation.map_or(Cell::from("not fixed"), amount);
                let nominal = value.nominal.map_or(Cell::from(""), amount);
                let own = [Cell::from(value.name), amount(value.value), fixed, nominal];
                table.push(
                    std::mem::replace(&mut head, vec![Cell::from(""); 4])
                        .into_iter()
                        .chain(own),
                );
            }
            if part.values.is_empty() {
                table.push(head);
            }
        }
        table.push([
            Cell::from("what is left"),
            Cell::from("remainder"),
            percent(self.remainder_share),
            Cell::from(""),
            Cell::from("rms"),
            Cell::from(Si(self.remainder_rms, self.unit).to_string()),
        ]);
        table
    }

    fn output(&self, name: &str) -> Axis {
        Axis::new(name, self.unit)
    }

    fn series(&self) -> Section {
        let mut section = Section::new("Measured and modelled");
        for run in &self.runs {
            let x = run.abscissas();
            let along = |title: &str, name: &str| Chart::new(title, run.axis(), self.output(name));
            let models = along("Output", "output")
                .curve(Curve::over(&x, run.measured, Role::Measured).named("measured"))
                .curve(Curve::over(&x, run.nominal, Role::Nominal).named("nominal"))
                .curve(Curve::over(&x, run.amended, Role::Amended).named("amended"));
            let gap = along("Gap", "over the nominal model")
                .curve(Curve::over(&x, &less(run.measured, run.nominal), Role::Measured).named("measured − nominal"))
                .curve(Curve::over(&x, &less(run.amended, run.nominal), Role::Amended).named("amended − nominal"))
                .curve(Curve::over(&x, run.nuisance, Role::Nuisance(0)).named("nuisance"))
                .curve(Curve::over(&x, &run.remainder(), Role::Remainder).named("remainder"));
            section = section.figure(Figure::new(run.name, vec![models, gap]).columns(1), "The whole run.");
            if !run.field_a_per_m.is_empty() {
                let cycles = Cycles::of(run.field_a_per_m);
                let over = |title: &str, name: &str| Chart::new(title, "field, A/m", self.output(name));
                let loops = over("Loops", "output")
                    .curve(cycles.curve(run.measured, Role::Measured).named("measured"))
                    .curve(cycles.curve(run.nominal, Role::Nominal).named("nominal"))
                    .curve(cycles.curve(run.amended, Role::Amended).named("amended"));
                let left = over("What is left over the field", "over the nominal model")
                    .curve(
                        cycles
                            .curve(&less(run.measured, run.nominal), Role::Measured)
                            .named("measured − nominal"),
                    )
                    .curve(cycles.curve(&run.remainder(), Role::Remainder).named("remainder"));
                section = section.figure(Figure::new("", vec![loops, left]), &shown(&cycles));
            }
        }
        section
    }

    fn contributions(&self) -> Section {
        let mut section = Section::new("Part by part");
        for (index, (part, role)) in self.parts.iter().zip(self.roles()).enumerate() {
            for run in &self.runs {
                let Some(added) = run.contributions.get(index).filter(|added| !added.is_empty()) else {
                    continue;
                };
                let x = run.abscissas();
                let left = run.remainder();
                let name = self.output("adds to the output");
                let title = format!("{}: {} of the gap", part.name, percent(part.share, 1));
                let over_time = Chart::new(&title, run.axis(), name.clone())
                    .curve(Curve::over(&x, &sum(added, &left), Role::Remainder).named("with the remainder"))
                    .curve(Curve::over(&x, added, role).named(part.name));
                let mut charts = vec![over_time];
                let mut caption = run.name.to_owned();
                if part.over_field && !run.field_a_per_m.is_empty() {
                    let cycles = Cycles::of(run.field_a_per_m);
                    let over_field = Chart::new("over the field", "field, A/m", name)
                        .curve(cycles.curve(added, role).named(part.name));
                    charts.push(over_field);
                    caption = format!("{caption} {}", shown(&cycles));
                }
                section = section.figure(Figure::new("", charts), caption.trim());
            }
        }
        section
    }

    fn others(&self) -> Section {
        let bar = |candidate: &Candidate| Bar {
            name: candidate.name.to_owned(),
            value: Some(candidate.left_rms),
            role: if candidate.chosen { Role::Amended } else { Role::Limit },
            note: candidate.note.to_owned(),
        };
        let nominal = Bar {
            name: "nominal model".to_owned(),
            value: Some(self.gap_rms),
            role: Role::Nominal,
            note: String::new(),
        };
        let bars = Bars {
            caption: "rms that each explanation leaves, on a logarithmic scale.".to_owned(),
            unit: self.unit.to_owned(),
            logarithmic: true,
            bars: [nominal].into_iter().chain(self.candidates.iter().map(bar)).collect(),
            limit: Some((self.noise_rms, "noise".to_owned())),
        };
        Section::new("What was tried").block(Block::Bars(bars))
    }
}

impl Run<'_> {
    fn axis(&self) -> Axis {
        match self.tick_s {
            Some(_) => Axis::from(crate::chart::TIME),
            None => Axis::new("row", ""),
        }
    }

    fn abscissas(&self) -> Vec<f64> {
        let tick = self.tick_s.unwrap_or(1.0);
        (0..self.measured.len()).map(|row| row as f64 * tick).collect()
    }

    fn remainder(&self) -> Vec<f64> {
        let left = less(self.measured, self.amended);
        if self.nuisance.is_empty() {
            left
        } else {
            less(&left, self.nuisance)
        }
    }
}

fn less(one: &[f64], other: &[f64]) -> Vec<f64> {
    one.iter().zip(other).map(|(one, other)| one - other).collect()
}

fn sum(one: &[f64], other: &[f64]) -> Vec<f64> {
    one.iter().zip(other).map(|(one, other)| one + other).collect()
}

fn shown(cycles: &Cycles) -> String {
    match (cycles.shown(), cycles.all) {
        (shown, all) if shown == all => "All cycles.".to_owned(),
        (shown, all) => format!("{shown} of {all} cycles."),
    }
}
