//! The comparison as a table for the terminal and a section of the report.

use super::{Control, Cut};
use anhyst_launch::table::plain_table;
use anhyst_report::page::{Block, Cell, Section, Table};
use comfy_table::CellAlignment;

const HEADER: [&str; 5] = [
    "the loop believes",
    "feedback",
    "error rms, nm",
    "error max, nm",
    "rms / old",
];

impl Control {
    /// For people at a terminal.
    pub fn table(&self) -> String {
        let mut table = plain_table();
        table.set_header(HEADER);
        for cut in &self.cuts {
            table.add_row(row(cut));
        }
        for column in table.column_iter_mut().skip(2) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        table.to_string()
    }

    /// Everything to be read beside the table.
    pub fn sentences(&self) -> Vec<String> {
        let refused = self.cuts.iter().filter_map(|cut| {
            let why = cut.refused.as_ref()?;
            Some(format!(
                "The cut with the model \"{}\" cannot be made: {why}",
                cut.believes
            ))
        });
        self.replaced
            .iter()
            .chain(&self.compensation)
            .cloned()
            .chain(refused)
            .collect()
    }
}

/// For `report.html`.
pub fn section(control: &Control) -> Section {
    let mut table = Table::new(&HEADER);
    for cut in &control.cuts {
        table
            .rows
            .push(row(cut).iter().map(|cell| Cell::from(cell.as_str())).collect());
    }
    Section::new("In the loop")
        .paragraph(&format!(
            "The cut of the scenario `{}` on a plant that is the amended model. Error: reference minus true displacement of the tip.",
            control.scenario
        ))
        .table(table)
        .block(Block::List(control.sentences()))
}

fn row(cut: &Cut) -> [String; 5] {
    let nanometres = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{:.2}", 1e9 * value));
    [
        cut.believes.clone(),
        if cut.feedback { "as the scenario has it" } else { "none" }.to_owned(),
        nanometres(cut.error_rms_m),
        nanometres(cut.error_max_m),
        cut.ratio.map_or_else(|| "-".to_owned(), |ratio| format!("{ratio:.3}")),
    ]
}
