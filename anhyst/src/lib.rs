//! The one executable: scenario files, the launcher, and the commands.

/// Prints a line for the user. A closed pipe (`| head`) or a full disk is no reason to panic.
#[macro_export]
macro_rules! say {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout(), $($text)*);
    }};
}

/// The same on standard error.
#[macro_export]
macro_rules! complain {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($text)*);
    }};
}

pub mod ablation;
pub mod across;
#[cfg(feature = "recorder")]
mod album;
mod any_number;
pub mod assemble;
mod claim;
pub mod cli;
pub mod commands;
pub mod control;
#[cfg(feature = "recorder")]
mod diagnosis_album;
pub mod error;
pub mod estimate;
pub mod external;
mod fit_picture;
pub mod folder;
pub mod interface;
pub mod judge;
pub mod launcher;
pub mod overheard;
pub mod paper;
pub mod parallel;
pub mod process;
pub mod realtime;
#[cfg(feature = "recorder")]
mod recording;
pub mod report;
pub mod resources;
mod sabotage;
mod safe_ending;
pub mod scenario;
pub mod scribe;
pub mod signals;
pub mod verify_amplifier;
