//! Panels that a command draws a second time, as a page of a Rerun recording.

use crate::figure::{Curve, Panel, TIME};
use anhyst_recorder::{AlbumPage, Chart, ChartLine};

/// Panels that are seen together, as a page of a recording.
pub fn album_page(title: &str, notes: &str, panels: &[Panel]) -> AlbumPage {
    let chart = |panel: &Panel| {
        let line = |curve: &Curve| ChartLine {
            name: curve.name.clone(),
            points: curve.points.clone(),
        };
        let lines = panel.curves.iter().map(line).collect();
        if panel.abscissa == TIME {
            Chart::OverTime {
                title: format!("{}: {}", panel.title, panel.ordinate),
                lines,
            }
        } else {
            Chart::Plane {
                title: panel.title.clone(),
                axes: [panel.abscissa.clone(), panel.ordinate.clone()],
                lines,
            }
        }
    };
    AlbumPage {
        title: title.into(),
        notes: notes.into(),
        charts: panels.iter().map(chart).collect(),
    }
}
