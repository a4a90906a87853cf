//! Runs the executable as a user does, with a time limit.

use crate::LIMIT;
use serde_json::Value;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;
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
    spawn(Command::new(anhyst()).args(arguments))
}

/// Starts any command there, its output to be read.
pub fn spawn(command: &mut Command) -> Child {
    command
        .current_dir(repository())
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap_or_else(|error| panic!("{command:?} does not start, is the workspace built? {error}"))
}

/// Asks a run that is at work until there is an answer; it must not end before, nor take for ever.
pub fn wait_for<T>(launcher: &mut Child, mut answer: impl FnMut() -> Option<T>) -> T {
    let begin = Instant::now();
    loop {
        if let Ok(Some(status)) = launcher.try_wait() {
            let mut told = String::new();
            let _ = launcher.stderr.take().map(|mut own| own.read_to_string(&mut told));
            panic!("the run ended before it was disturbed, {status}: {told}");
        }
        assert!(begin.elapsed() < LIMIT, "the loop does not start");
        std::thread::sleep(Duration::from_millis(5));
        if let Some(found) = answer() {
            return found;
        }
    }
}

/// Folders for runs, in one that goes with them.
pub fn folders<const N: usize>() -> (tempfile::TempDir, [PathBuf; N]) {
    let root = tempfile::tempdir().unwrap_or_else(|error| panic!("no temporary folder: {error}"));
    let folders = std::array::from_fn(|i| root.path().join(format!("run{i}")));
    (root, folders)
}

/// What a run in this folder came to, none of its tokens lost and none slept on.
pub fn summary(run: &Path) -> Value {
    let text = std::fs::read(run.join("summary.json")).unwrap_or_default();
    let summary: Value = serde_json::from_slice(&text).unwrap_or_default();
    for count in ["lost_tokens", "lost_notifications"] {
        assert_eq!(summary[count], 0, "{count}, {}: {summary}", run.display());
    }
    summary
}

/// Its digest.
pub fn digest(run: &Path) -> String {
    summary(run)["digest"].as_str().unwrap_or_default().to_owned()
}

impl Finished {
    /// Runs the executable to its end, at most `limit`.
    pub fn run(arguments: &[&str], limit: Duration) -> Self {
        Self::wait(start(arguments), limit)
    }

    /// Waits for a started executable, at most `limit`; then it is killed and the test fails.
    pub fn wait(mut child: Child, limit: Duration) -> Self {
        let start = Instant::now();
        // Read while it runs: a pipe holds 64 kB, and who writes more than that waits for its reader.
        let out = read_on(child.stdout.take());
        let err = read_on(child.stderr.take());
        let mut late = false;
        let code = loop {
            match child.try_wait() {
                Ok(Some(status)) => break status.code(),
                Ok(None) if start.elapsed() > limit => {
                    late = true;
                    let _ = child.kill();
                }
                Ok(None) => std::thread::sleep(Duration::from_millis(5)),
                Err(error) => panic!("its end cannot be waited for: {error}"),
            }
        };
        let took = start.elapsed();
        let [out, err] = [out, err].map(|reader| reader.join().unwrap_or_default());
        assert!(
            !late,
            "not finished after {limit:?}\nstandard output:\n{out}\nstandard error:\n{err}"
        );
        Self { code, out, err, took }
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

/// A thread that reads a stream to its end.
fn read_on(stream: Option<impl Read + Send + 'static>) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut stream) = stream {
            let _ = stream.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
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
