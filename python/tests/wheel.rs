//! Runs the package's own tests (`test_*.py`) on the extension that was built with this test: no wheel is made for that. They need a
//! Python with NumPy and pytest, named by `ANHYST_PYTHON`; without it they are skipped. What laws give here is told to them, to compare.

use anhyst_model::{BoucWen, HysteresisLaw, Law, Material, PlayGroup, PlaySum, Preisach, ScaledDomainWall, Warp};
use std::fmt::Write as _;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;

/// A thousand steps of each law, as columns: the input, then the output of each.
fn thousand_steps() -> String {
    let inputs: Vec<f64> = (0..1000)
        .map(|step| 12e3 * (0.02 * f64::from(step)).sin() * (1.0 - 8e-4 * f64::from(step)))
        .collect();
    let density = anhyst_model::Density::Lorentz {
        amplitude: 1.0,
        coercivity: 1e3,
        width: 2e3,
        reach: 15e3,
        rows: 40,
    };
    let plays = PlayGroup {
        warp: Warp::Straight,
        radii: vec![0.0, 500.0, 2e3],
        weights: vec![1.0, 0.5, 0.25],
    };
    let laws = [
        Law::Plays(PlaySum { groups: vec![plays] }),
        Law::Preisach(Preisach::from(density)),
        Law::BoucWen(BoucWen {
            amplitude: 1e-5,
            yield_input: 3e3,
            exponent: 1.5,
            loading_share: 0.8,
            stiffens: false,
        }),
        Law::DomainWall(ScaledDomainWall {
            gain: 2.0,
            hysteresis: Material::terfenol_d().hysteresis,
        }),
    ];
    let mut states = laws.each_ref().map(HysteresisLaw::rest);
    let mut text = String::new();
    for input in inputs {
        write!(text, "{input}").unwrap();
        for (law, state) in laws.iter().zip(&mut states) {
            law.advance(state, input);
            write!(text, ",{}", law.output(state)).unwrap();
        }
        text.push('\n');
    }
    text
}

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
    let steps = site.path().join("thousand_steps.csv");
    std::fs::write(&steps, thousand_steps()).unwrap();
    let told = Command::new(&python)
        .args(["-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider"])
        .arg(crate_folder.join("tests"))
        .current_dir(site.path())
        .env("PYTHONPATH", site.path())
        .env("ANHYST_THOUSAND_STEPS", steps)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("ANHYST_EXECUTABLE", deps.with_file_name("anhyst"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&told.stdout);
    assert!(told.status.success(), "{said}{}", String::from_utf8_lossy(&told.stderr));
    println!("{said}");
}
