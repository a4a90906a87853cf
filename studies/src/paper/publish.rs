//! The figures as one page, as pictures, and as a recording.

use super::{Figure, refused};
use anhyst_launch::error::RunError;
use anhyst_report::figure::drawing;
use anhyst_report::page::{Page, Section, Table};
use std::path::Path;

/// Writes `index.html`, `figure-N.svg`, `figure-N.png` and `paper.rrd` into a folder.
///
/// # Errors
/// If something cannot be drawn or written.
pub fn publish(figures: &[Figure], out: &Path) -> Result<(), RunError> {
    let save = |file: String, bytes: &[u8]| {
        let path = out.join(file);
        std::fs::write(&path, bytes).map_err(|cause| RunError::Write { path, cause })
    };
    for figure in figures {
        let (drawn, (width, height)) = drawing(&heading(figure), &figure.panels);
        save(
            format!("figure-{}.svg", figure.number),
            drawn.svg(width, height).map_err(refused)?.as_bytes(),
        )?;
        save(
            format!("figure-{}.png", figure.number),
            &drawn.png(width, height).map_err(refused)?,
        )?;
    }
    save("index.html".into(), page(figures)?.html().as_bytes())?;
    #[cfg(feature = "recorder")]
    record(figures, &out.join("paper.rrd"))?;
    Ok(())
}

fn heading(figure: &Figure) -> String {
    format!("Fig. {}: {}", figure.number, figure.title)
}

fn page(figures: &[Figure]) -> Result<Page, RunError> {
    let lead = "Figures 2, 4, 5, 6 and 7 of Nealis and Smith, Nonlinear Adaptive Parameter Estimation Algorithms for Hysteresis Models of \
                Magnetostrictive Actuators, computed with the derived equations; beside them what the printed errata cost. The errata \
                themselves are in `docs/paper-notes.md`.";
    let mut page = Page::new("The paper, computed", lead).command("anhyst study paper");
    for figure in figures {
        page = page.section(section(figure)?);
    }
    Ok(page)
}

fn section(figure: &Figure) -> Result<Section, RunError> {
    let (drawn, size) = drawing("", &figure.panels);
    let mut table = Table::new(&["what", "the paper", "found", "with the printed erratum"]);
    for finding in &figure.findings {
        let cells = [&finding.what, &finding.paper, &finding.found, &finding.as_printed];
        table = table.row(cells.map(|cell| cell.as_str().into()));
    }
    let section = Section::new(&heading(figure)).beside(
        ("The paper says", figure.paper_says.as_str()),
        ("We get", figure.we_get.as_str()),
        None,
    );
    Ok(section
        .figure(&drawn, size, &heading(figure))
        .map_err(refused)?
        .table(table))
}

#[cfg(feature = "recorder")]
fn record(figures: &[Figure], path: &Path) -> Result<(), RunError> {
    let page = |figure: &Figure| {
        let mut notes = format!(
            "# {}\n\n**The paper:** {}\n\n**We get:** {}\n\n| | paper | found | as printed |\n|---|---|---|---|\n",
            heading(figure),
            figure.paper_says,
            figure.we_get
        );
        for finding in &figure.findings {
            let cells = [&finding.what, &finding.paper, &finding.found, &finding.as_printed];
            notes += &format!("| {} |\n", cells.map(|cell| cell.replace('|', "/")).join(" | "));
        }
        anhyst_report::album::album_page(&format!("Fig. {}", figure.number), &notes, &figure.panels)
    };
    let album = anhyst_recorder::Album {
        name: "Nealis and Smith".into(),
        pages: figures.iter().map(page).collect(),
    };
    Ok(album.save(path)?)
}
