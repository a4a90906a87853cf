//! `anhyst data`: what a measured file holds, what each of its channels may be, and the options with which the other commands read it.

use super::{Ending, json};
use crate::arguments::{JsonArgument, MeasuredFile, TableArguments};
use anhyst_launch::error::RunError;
use anhyst_measured::survey::{Channel, Clock, Survey, SurveyedTable};
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role};
use anhyst_report::course::course;
use anhyst_report::number::{Digits, Si};
use anhyst_report::page::{Page, Section};
use anhyst_report::table::{Cell, Table};
use clap::Args;
use std::path::{Path, PathBuf};

/// Letters and lines of a channel's picture.
const PICTURE: (usize, usize) = (32, 2);
/// The most channels that are drawn in a file.
const MOST_CHARTS: usize = 24;

/// `data`
#[derive(Debug, Args)]
pub struct DataArguments {
    /// What is looked at.
    #[command(flatten)]
    pub data: MeasuredFile,
    /// What is known of it.
    #[command(flatten)]
    pub table: TableArguments,
    /// Draw the channels of the table that is read: an .svg, or a page to zoom into, .html.
    #[arg(long, value_name = "FILE")]
    pub plot: Option<PathBuf>,
    /// How it is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// Runs the command.
///
/// # Errors
/// A file that cannot be read or is no table, or a picture that cannot be written.
pub fn run(arguments: &DataArguments) -> miette::Result<Ending> {
    let survey =
        Survey::of(arguments.data.file(), &arguments.table.reading()).map_err(|error| miette::miette!("{error}"))?;
    if survey.tables.iter().all(|table| table.rows == 0) {
        return Err(miette::miette!("{}: there is no row below its header", survey.file));
    }
    if let Some(path) = &arguments.plot {
        plot(path, &survey)?;
    }
    if arguments.json.json {
        crate::say!("{}", json(&survey)?);
        return Ok(Ending::Held);
    }
    let several = survey.tables.len() > 1;
    for table in survey.tables.iter().filter(|table| table.read) {
        let of = if several { "the table that is read: " } else { "" };
        print(table, of, &survey.file);
    }
    for table in survey.tables.iter().filter(|table| !table.read) {
        let own = table.channels.iter().map(|own| own.header.as_str());
        let others: Vec<&str> = own.collect();
        crate::say!("\nanother table, {}: {}", sized(table), others.join(", "));
    }
    if let Some(path) = &arguments.plot {
        crate::say!("\npicture: {}", path.display());
    }
    Ok(Ending::Held)
}

/// "400 rows, 0 s to 39.90 ms at 10.00 kHz, no gap".
fn sized(table: &SurveyedTable) -> String {
    let clock = table.clock.as_ref().map_or_else(|| "no time".to_owned(), timed);
    format!("{} rows, {clock}", table.rows)
}

fn print(table: &SurveyedTable, of: &str, file: &str) {
    crate::say!("{of}{}", sized(table));
    let mut listed = Table::new(["channel", "is", "least", "mean", "largest", "noise", "unit", "course"]);
    for channel in &table.channels {
        listed.push(row(channel));
    }
    crate::say!("{}", listed.terminal());
    for gap in table.clock.iter().flat_map(|clock| &clock.listed) {
        let [from, to] = [gap.from_s, gap.to_s].map(|time_s| Si(time_s, "s").to_string());
        let between = if from == to {
            format!("at {from}")
        } else {
            format!("{from} to {to}")
        };
        crate::say!("gap before row {}: {between}, {} missing", gap.row, gap.missing);
    }
    let more = table.clock.as_ref().map_or(0, |clock| clock.gaps - clock.listed.len());
    if more > 0 {
        crate::say!("and {more} more");
    }
    for remark in &table.remarks {
        crate::say!("- {remark}");
    }
    let options = options(table);
    crate::say!("");
    for own in &table.uses {
        let mark = if own.reads { "" } else { "not read: " };
        crate::say!("{:<20}{mark}{}", own.commands, own.says);
    }
    let reading: Vec<&str> = table
        .uses
        .iter()
        .filter(|own| own.reads)
        .map(|own| own.commands)
        .collect();
    if !options.is_empty() {
        let to = if reading.is_empty() {
            "any of them".to_owned()
        } else {
            reading.join(", ")
        };
        crate::say!("\nto be given to {to}:\n  {}", options.join(" "));
    } else if !reading.is_empty() {
        crate::say!("\nits columns are known by their names: no --column is needed");
    }
    if reading.iter().any(|commands| commands.contains("--law")) {
        let words = ["anhyst fit".to_owned(), quoted(file), "--law auto".to_owned()];
        let line: Vec<String> = words.into_iter().chain(options).collect();
        crate::say!("for instance, which law describes it:\n  {}", line.join(" "));
    }
}

/// "0 s to 39.90 ms at 10.00 kHz, no gap".
fn timed(clock: &Clock) -> String {
    let (from, to) = (Si(clock.from_s, "s"), Si(clock.to_s, "s"));
    if clock.backward > 0 {
        let (s, stands) = if clock.backward == 1 { ("", "s") } else { ("s", "") };
        return format!(
            "time from {from} to {to}, standing still or running back at {} row{s} that stand{stands} there",
            clock.backward
        );
    }
    let gaps = match clock.gaps {
        0 => "no gap".to_owned(),
        1 => format!("one gap of {} rows", clock.missing),
        gaps => format!("{gaps} gaps, {} rows in all", clock.missing),
    };
    let [shortest, longest] = clock.steps_s;
    let uneven = match (longest - shortest) / clock.step_s {
        share if share > 0.01 => format!(", steps of {} to {}", Si(shortest, "s"), Si(longest, "s")),
        _ => String::new(),
    };
    format!("{from} to {to} at {}{uneven}, {gaps}", Si(clock.rate_hz(), "Hz"))
}

fn row(channel: &Channel) -> Vec<Cell> {
    let first = channel.first_not_number.unwrap_or_default();
    let cells = |count: usize| match count {
        1 => "1 cell is no number".to_owned(),
        count => format!("{count} cells are no number"),
    };
    let mut is = channel.quantity.unwrap_or_default().to_owned();
    if channel.left_out > 0 {
        let cells = cells(channel.left_out);
        is = format!("{is}\n{cells},\nfirst in row {first}: left out")
            .trim_start()
            .to_owned();
    } else if channel.quantity.is_none() && channel.not_numbers > 0 {
        is = format!("{},\nfirst in row {first}", cells(channel.not_numbers));
    }
    let because = channel.because.as_deref().unwrap_or_default();
    let because = if because.is_empty() {
        String::new()
    } else {
        format!("\n{because}")
    };
    let number = |value: f64| {
        if value.is_finite() {
            Digits(value, 4).to_string()
        } else {
            String::new()
        }
    };
    let counted = matches!(channel.quantity, Some("time" | "loop"));
    let noise = channel.noise.filter(|_| !counted);
    let noise = noise.map_or_else(String::new, |noise| Digits(noise.rms, 2).to_string());
    let to_si = if channel.unit.is_empty() || (channel.scale, channel.offset) == (1.0, 0.0) {
        channel.unit.to_owned()
    } else {
        let offset = if channel.offset == 0.0 {
            String::new()
        } else {
            format!(" + {}", channel.offset)
        };
        let scale = if channel.scale == 1.0 {
            String::new()
        } else {
            format!("·{:e}", channel.scale)
        };
        format!("{scale}{offset} {}", channel.unit).trim_start().to_owned()
    };
    let picture = course(&channel.values, PICTURE.0, PICTURE.1).join("\n");
    vec![
        Cell::Words(channel.header.clone()),
        Cell::Words(is + &because),
        Cell::Number(number(channel.least)),
        Cell::Number(number(channel.mean)),
        Cell::Number(number(channel.most)),
        Cell::Number(noise),
        Cell::Words(to_si),
        Cell::Words(picture),
    ]
}

/// What a table is read with.
pub(super) fn options(table: &SurveyedTable) -> Vec<String> {
    let columns = table.columns.iter().map(|own| format!("--column {}", quoted(own)));
    let dropped = table.drop_rows.iter().map(|own| format!("--drop-rows {own}"));
    columns.chain(dropped).collect()
}

/// As a shell reads it.
fn quoted(option: &str) -> String {
    let plain = |letter: char| letter.is_ascii_alphanumeric() || "_=.+-/".contains(letter);
    if option.chars().all(plain) {
        option.to_owned()
    } else {
        format!("'{}'", option.replace('\'', r"'\''"))
    }
}

fn plot(path: &Path, survey: &Survey) -> miette::Result<()> {
    let Some(table) = survey.tables.iter().find(|table| table.read) else {
        return Ok(());
    };
    let figure = figure(table);
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let text = match ending.as_str() {
        "svg" => figure.svg().map_err(|error| miette::miette!("{error}"))?,
        "html" => {
            let name = super::stem(Path::new(&survey.file));
            let section = Section::new("Channels").figure(figure, "");
            Page::new(&name, "")
                .section(section)
                .fact("file", &survey.file)
                .fact("data", &survey.data_hash)
                .html()
        }
        _ => {
            return Err(miette::miette!(
                "{}: a picture ends in .svg, or in .html for a page to zoom into",
                path.display()
            ));
        }
    };
    std::fs::write(path, text).map_err(|cause| {
        let path = path.to_owned();
        RunError::Write { path, cause }.into()
    })
}

/// Every channel over time, and what answers over what drives.
fn figure(table: &SurveyedTable) -> Figure {
    let time: Option<Vec<f64>> = channel_of(table, "time").map(|own| own.in_si().collect());
    let rows: Vec<f64> = (0..table.rows).map(|row| row as f64).collect();
    let along = time.as_ref().unwrap_or(&rows);
    let x = || {
        if time.is_some() {
            Axis::new("time", "s")
        } else {
            Axis::new("row", "")
        }
    };
    let drawn = table
        .channels
        .iter()
        .filter(|own| own.quantity != Some("time") && own.least < own.most);
    let mut charts: Vec<Chart> = drawn
        .take(MOST_CHARTS)
        .map(|own| {
            let values: Vec<f64> = own.in_si().collect();
            let axis = Axis::new(own.quantity.unwrap_or("as it stands"), own.unit);
            Chart::new(&own.header, x(), axis).curve(Curve::over(along, &values, Role::Measured))
        })
        .collect();
    let first = |names: &[&str]| names.iter().find_map(|name| channel_of(table, name));
    let sides = (
        first(&["input", "command", "field", "current", "voltage"]),
        first(&["output", "displacement", "magnetization", "flux", "strain", "force"]),
    );
    if let (Some(drive), Some(answer)) = sides {
        let axis = |own: &Channel| Axis::new(own.quantity.unwrap_or_default(), own.unit);
        let [one, other]: [Vec<f64>; 2] = [drive, answer].map(|own| own.in_si().collect());
        let curve = Curve::over(&one, &other, Role::Measured);
        let title = format!("{} over {}", answer.header, drive.header);
        charts.push(Chart::new(&title, axis(drive), axis(answer)).curve(curve));
    }
    Figure::new("", charts)
}

fn channel_of<'a>(table: &'a SurveyedTable, quantity: &str) -> Option<&'a Channel> {
    table.channels.iter().find(|own| own.quantity == Some(quantity))
}
