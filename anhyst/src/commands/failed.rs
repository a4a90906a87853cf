//! What is said, to people or to programs, of what was not done.

use super::Ending;
use std::fmt::Display;

/// Says on standard error what is wrong: to people, or as `json` to programs.
pub fn complain(report: &miette::Report, json: bool) {
    if json {
        crate::complain!("{}", as_json(report));
    } else {
        crate::complain!("{report:?}");
    }
}

/// Says why something begun did not come to its end, and what is `left` of it.
pub fn failed(error: &dyn Display, left: &str, json: bool) -> Ending {
    if json {
        complain(&miette::miette!(help = left, "{error}"), true);
    } else {
        crate::complain!("{error}\n{left}");
    }
    Ending::ProcessFailed
}

/// For programs: `{"message": …}`, with file and place where it has them.
fn as_json(report: &miette::Report) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = miette::JSONReportHandler::new().render_report(&mut text, report.as_ref());
    text
}
