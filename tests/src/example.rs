//! The amplifiers of `examples/`, made ready to be started. What needs a tool that is not there is skipped, with the reason.

use crate::{anhyst, repository};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicI16, Ordering};

/// The interpreter that has iceoryx2: `ANHYST_PYTHON`, or `python3`.
pub fn python() -> Option<String> {
    let python = std::env::var("ANHYST_PYTHON").unwrap_or_else(|_| "python3".into());
    let probe = Command::new(&python).args(["-c", "import iceoryx2"]).output();
    match probe {
        Ok(output) if output.status.success() => Some(python),
        _ => {
            eprintln!(
                "SKIPPED: {python} cannot import iceoryx2; pip install -r examples/amplifier-python/requirements.txt, and name the interpreter in ANHYST_PYTHON"
            );
            None
        }
    }
}

/// Compiles the C amplifier into `out`, against the library that was built with the tests.
///
/// # Panics
/// Without that library, or if it does not compile.
pub fn c_amplifier(out: &Path) -> Option<PathBuf> {
    for tool in ["make", "cc"] {
        if Command::new(tool).arg("--version").output().is_err() {
            eprintln!("SKIPPED: no {tool} on this machine");
            return None;
        }
    }
    let executable = anhyst();
    let release = executable.parent().expect("the executable lies in a folder");
    // `cargo build` puts it into the first, `cargo test` into the second; the older one may be of another day.
    let (_, library) = [release.to_owned(), release.join("deps")]
        .into_iter()
        .filter_map(|folder| {
            let file = folder.join("libanhyst_driver.so").metadata().ok()?;
            Some((file.modified().ok()?, folder))
        })
        .max()
        .expect("libanhyst_driver.so was built with the tests");
    let made = Command::new("make")
        .arg("-C")
        .arg(repository().join("examples/amplifier-c"))
        .arg(format!("DRIVER={}", library.display()))
        .arg(format!("OUT={}", out.display()))
        .output()
        .expect("make starts");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    Some(out.join("amplifier"))
}

/// Files of a converter of 16 bits and ±10 V in `root`, as Linux' Industrial I/O has them: at zero, its monitor tied to its output.
///
/// # Errors
/// What the system says.
pub fn iio_device(root: &Path) -> std::io::Result<PathBuf> {
    let device = root.join("iio:device0");
    std::fs::create_dir(&device)?;
    for direction in ["out", "in"] {
        std::fs::write(device.join(format!("{direction}_voltage0_scale")), "0.305175781\n")?;
        std::fs::write(device.join(format!("{direction}_voltage0_offset")), "-32768\n")?;
    }
    std::fs::write(device.join("out_voltage0_raw"), "32768\n")?;
    std::os::unix::fs::symlink("out_voltage0_raw", device.join("in_voltage0_raw"))?;
    Ok(device)
}

/// A board that is none.
#[derive(Debug)]
pub struct Board {
    /// Folder of its streams.
    pub streams: PathBuf,
    /// What was put out last.
    pub last: Arc<AtomicI16>,
}

/// Two devices of Linux' Industrial I/O with buffers, 16 bits and ±10 V, pipes in `root/streams` in the place of their character devices: what is put out
/// comes in. `dac` and `adc` are their folders in `root`.
///
/// # Errors
/// What the system says.
///
/// # Panics
/// Without `mkfifo`.
pub fn iio_buffers(root: &Path) -> std::io::Result<Board> {
    let streams = root.join("streams");
    std::fs::create_dir(&streams)?;
    let device = |name: &str, channel: &str| -> std::io::Result<std::fs::File> {
        let folder = root.join(name);
        for part in ["scan_elements", "buffer"] {
            std::fs::create_dir_all(folder.join(part))?;
        }
        let files = [
            (format!("{channel}_scale"), "0.305175781"),
            (format!("scan_elements/{channel}_en"), "0"),
            (format!("scan_elements/{channel}_type"), "le:s16/16>>0"),
            ("buffer/enable".to_owned(), "0"),
            ("buffer/length".to_owned(), "128"),
        ];
        for (file, text) in files {
            std::fs::write(folder.join(file), text)?;
        }
        let pipe = streams.join(name);
        let made = Command::new("mkfifo").arg(&pipe).status()?;
        assert!(made.success(), "mkfifo");
        // To read and to write, so that opening waits for nobody.
        std::fs::OpenOptions::new().read(true).write(true).open(pipe)
    };
    let (mut from, mut to) = (device("dac", "out_voltage0")?, device("adc", "in_voltage0")?);
    let last = Arc::new(AtomicI16::new(i16::MAX));
    let said = last.clone();
    // It ends with the test's process.
    std::thread::spawn(move || {
        let mut sample = [0; 2];
        while from.read_exact(&mut sample).is_ok() && to.write_all(&sample).is_ok() {
            said.store(i16::from_le_bytes(sample), Ordering::Relaxed);
        }
    });
    Ok(Board { streams, last })
}
