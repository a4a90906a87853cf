//! Guards docs/safety.md against the code: its table of monitors says what the guard does unless told otherwise.

mod common;

use anhyst_guard::{Event, GuardSettings, Reaction, WayBack};
use common::TICK_S;
use std::path::Path;

#[test]
fn the_table_of_monitors_is_what_the_guard_does() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/safety.md");
    let text = std::fs::read_to_string(path).unwrap();
    let settings: GuardSettings = serde_json::from_str("{\"field_limit_a_per_m\": 30e3}").unwrap();
    settings.validate(TICK_S).unwrap();
    for event in Event::ALL.into_iter().filter(|event| event.is_fault()) {
        let detected = match settings.detection_ticks(event, TICK_S) {
            Some(1) => "1 tick".to_owned(),
            Some(ticks) => format!("{ticks} ticks"),
            None => "off".to_owned(),
        };
        let response = settings.reactions.to(event);
        let (reaction, ticks) = match response.reaction {
            Reaction::Hold => ("`Hold`", settings.reaction_ticks(event, TICK_S)),
            Reaction::FallBack => ("`FallBack`", settings.reaction_ticks(event, TICK_S)),
            Reaction::RampToSafe => ("`RampToSafe`", settings.reaction_ticks(event, TICK_S)),
        };
        let way_back = match response.way_back {
            WayBack::Reset => "reset".to_owned(),
            WayBack::AfterHealth { for_s } => format!("after {for_s} s of health"),
        };
        let row = format!(
            "| {} | `{event}` | {detected} | {reaction} | {ticks} | {way_back} |",
            event.number()
        );
        assert!(text.contains(&row), "docs/safety.md lacks\n{row}");
    }
}
