//! Runs the executable as a user does, with a time limit.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// The repository's root.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .map(Path::to_path_buf)
        .unwrap_or_default()
}

/// The executable that was built with the tests: beside the folder of the test's own binary.
pub fn anhyst() -> PathBuf {
    let test = std::env::current_exe().unwrap_or_default();
    test.ancestors()
        .nth(2)
        .map(|folder| folder.join("anhyst"))
        .unwrap_or_default()
}

/// What a command came to.
#[derive(Debug)]
pub struct Finished {
    /// Exit status; none if a signal ended it or the time limit did.
    pub code: Option<i32>,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
    /// How long it took.
    pub took: Duration,
}

/// Starts the executable in the repository's root.
pub fn start(arguments: &[&str]) -> Child {
    let executable = anhyst();
    assert!(
        executable.is_file(),
        "{} is missing: build the workspace first",
        executable.display()
    );
    Command::new(executable)
        .args(arguments)
        .current_dir(repository())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("anhyst does not start: {error}"))
}

impl Finished {
    /// Runs the executable to its end, at most `limit`.
    pub fn run(arguments: &[&str], limit: Duration) -> Self {
        Self::wait(start(arguments), limit)
    }

    /// Waits for a started executable, at most `limit`; then it is killed and the test fails.
    pub fn wait(mut child: Child, limit: Duration) -> Self {
        let start = Instant::now();
        // Output is small (no progress bar without a terminal), so the pipes cannot fill up while we wait.
        while child.try_wait().unwrap_or(None).is_none() {
            if start.elapsed() > limit {
                let _ = child.kill();
                let output = child.wait_with_output();
                panic!("not finished after {limit:?}: {output:?}");
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let took = start.elapsed();
        match child.wait_with_output() {
            Ok(output) => Self {
                code: output.status.code(),
                out: String::from_utf8_lossy(&output.stdout).into_owned(),
                err: String::from_utf8_lossy(&output.stderr).into_owned(),
                took,
            },
            Err(error) => panic!("its output cannot be read: {error}"),
        }
    }

    /// Fails unless the exit status is `code`.
    pub fn expect(self, code: i32) -> Self {
        assert_eq!(
            self.code,
            Some(code),
            "standard output:\n{}\nstandard error:\n{}",
            self.out,
            self.err
        );
        self
    }
}

/// The launcher's living children: process number and name.
pub fn children(launcher: u32) -> Vec<(u32, String)> {
    let processes = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    processes
        .filter_map(|entry| entry.file_name().to_string_lossy().parse::<u32>().ok())
        .filter(|pid| parent(*pid) == Some(launcher))
        .filter_map(|pid| {
            let command = std::fs::read_to_string(format!("/proc/{pid}/cmdline")).ok()?;
            let mut words = command.split('\0').skip(1);
            let name = words.find(|word| *word != "node")?;
            Some((pid, name.to_owned()))
        })
        .collect()
}

fn parent(pid: u32) -> Option<u32> {
    let status = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
    // The command's name, in brackets, may hold blanks: what follows its last bracket does not.
    status.rsplit(')').next()?.split_whitespace().nth(1)?.parse().ok()
}
