//! Running and supervising the processes of a scenario: from its blocks to their reports, and what a run comes to.

pub mod say;

pub mod across;
pub mod any_number;
pub mod assemble;
pub mod claim;
pub mod course;
pub mod disk;
pub mod embedded;
pub mod error;
pub mod error_between;
pub mod error_course;
pub mod error_spectrum;
pub mod external;
mod fault_injector;
pub mod folder;
pub mod history;
pub mod judge;
mod last_turns;
pub mod launcher;
pub mod loop_section;
pub mod measured_table;
mod noticed;
mod overheard;
pub mod own_command;
pub mod process;
pub mod realtime;
#[cfg(feature = "recorder")]
mod recording;
pub mod report;
pub mod resources;
pub mod run_again;
mod run_page;
mod safe_ending;
mod scribe;
pub mod signals;
pub mod summary;
mod summary_realtime;
pub mod supervisor;
pub mod tuning;
pub mod verdict;
mod windows;
