//! The figures as one page, as pictures, and as a recording.

use super::figure::{Figure, refused, table};
use anhyst_launch::error::RunError;
use anhyst_report::chart;
use anhyst_report::page::{Page, Section};
use std::path::Path;

/// Writes `index.html`, `figure-N.svg` and `paper.rrd` into a folder.
///
/// # Errors
/// If something cannot be drawn or written.
pub fn publish(figures: &[Figure], out: &Path) -> Result<(), RunError> {
    let save = |file: String, bytes: &[u8]| {
        let path = out.join(file);
        std::fs::write(&path, bytes).map_err(|cause| RunError::Write { path, cause })
    };
    for figure in figures {
        let drawn = chart::Figure::new(&heading(figure), figure.charts.clone());
        save(
            format!("figure-{}.svg", figure.number),
            drawn.svg().map_err(refused)?.as_bytes(),
        )?;
    }
    save("index.html".into(), page(figures).html().as_bytes())?;
    #[cfg(feature = "recorder")]
    record(figures, &out.join("paper.rrd"))?;
    Ok(())
}

fn heading(figure: &Figure) -> String {
    format!("Fig. {}: {}", figure.number, figure.title)
}

fn page(figures: &[Figure]) -> Page {
    let lead = "Figures 2, 4, 5, 6 and 7 of Nealis and Smith, Nonlinear Adaptive Parameter Estimation Algorithms for Hysteresis Models of \
                Magnetostrictive Actuators, computed with the derived equations; beside them what the printed errata cost. The errata \
                themselves are in `docs/paper-notes.md`.";
    let page = Page::new("The paper, computed", lead).command("anhyst study paper");
    figures.iter().map(section).fold(page, Page::section)
}

fn section(figure: &Figure) -> Section {
    Section::new(&heading(figure))
        .beside(
            ("The paper says", figure.paper_says.as_str()),
            ("We get", figure.we_get.as_str()),
            None,
        )
        .figure(chart::Figure::new("", figure.charts.clone()), &heading(figure))
        .table(table(&figure.findings))
}

#[cfg(feature = "recorder")]
fn record(figures: &[Figure], path: &Path) -> Result<(), RunError> {
    let page = |figure: &Figure| anhyst_recorder::AlbumPage {
        title: format!("Fig. {}", figure.number),
        notes: format!(
            "# {}\n\n**The paper:** {}\n\n**We get:** {}\n\n{}",
            heading(figure),
            figure.paper_says,
            figure.we_get,
            table(&figure.findings).markdown()
        ),
        charts: figure.charts.clone(),
    };
    let album = anhyst_recorder::Album {
        name: "Nealis and Smith".into(),
        pages: figures.iter().map(page).collect(),
    };
    Ok(album.save(path)?)
}
