//! Runs the package's own tests (`test_*.py`) on the extension that was built with this test: no wheel is made for that. They need a
//! Python with NumPy and pytest, named by `ANHYST_PYTHON`; without it they are skipped.

use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;

#[test]
fn the_package_keeps_its_promises() {
    let python = std::env::var("ANHYST_PYTHON").unwrap_or_else(|_| "python3".into());
    let probe = Command::new(&python).args(["-c", "import numpy, pytest"]).output();
    if !probe.is_ok_and(|output| output.status.success()) {
        eprintln!(
            "SKIPPED: {python} cannot import numpy and pytest; install them, and name the interpreter in ANHYST_PYTHON"
        );
        return;
    }
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let test = std::env::current_exe().unwrap();
    let deps = test.parent().unwrap();
    // As a wheel has it: the extension among the modules.
    let site = tempfile::tempdir().unwrap();
    let package = site.path().join("anhyst");
    std::fs::create_dir(&package).unwrap();
    for entry in std::fs::read_dir(crate_folder.join("anhyst")).unwrap() {
        let path = entry.unwrap().path();
        // What somebody put beside them is of another build.
        if path.extension().is_some_and(|ending| ending != "so") {
            symlink(&path, package.join(path.file_name().unwrap())).unwrap();
        }
    }
    symlink(deps.join("libanhyst_python.so"), package.join("_native.abi3.so")).unwrap();
    let told = Command::new(&python)
        .args(["-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider"])
        .arg(crate_folder.join("tests"))
        .current_dir(site.path())
        .env("PYTHONPATH", site.path())
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("ANHYST_EXECUTABLE", deps.with_file_name("anhyst"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&told.stdout);
    assert!(told.status.success(), "{said}{}", String::from_utf8_lossy(&told.stderr));
    println!("{said}");
}
