//! `anhyst export --fmu`: a part of a scenario's loop as an FMI 3.0 co-simulation unit, in one file.

use super::Ending;
use anhyst_controller::TrajectorySettings;
use anhyst_fmu::{KIND_FILE, Kind, SCENARIO_FILE, description, refuse_unsteppable};
use anhyst_launch::error::RunError;
use anhyst_scenario::{Scenario, load};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Name of the library in an FMU, without its ending.
const IDENTIFIER: &str = "anhyst";
/// As cargo builds it.
const LIBRARY: &str = "libanhyst_fmu.so";

/// Writes the FMU.
///
/// # Errors
/// A scenario that cannot be one, a library that is not there, a file that cannot be written.
pub fn run(kind: Kind, file: &Path, library: Option<&Path>, out: &Path, json: bool) -> miette::Result<Ending> {
    let mut scenario = load(file, &[])?;
    let setup = |error: &dyn std::fmt::Display| RunError::Setup(error.to_string());
    refuse_unsteppable(&scenario).map_err(|error| setup(&error))?;
    let library = match library {
        Some(library) => library.to_owned(),
        None => found_library()?,
    };
    let read = |path: &Path| {
        std::fs::read(path).map_err(|cause| RunError::Setup(format!("{} cannot be read: {cause}", path.display())))
    };
    let mut files = vec![(
        format!("binaries/{}-linux/{IDENTIFIER}.so", std::env::consts::ARCH),
        read(&library)?,
    )];
    for path in files_of(&mut scenario) {
        // Read beside the scenario, wherever the FMU is unpacked.
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        files.push((format!("resources/{name}"), read(path)?));
        *path = PathBuf::from(name);
    }
    let text = scenario.to_ron().map_err(|error| setup(&error))?;
    let described = description(kind, &scenario, &text, IDENTIFIER);
    files.push(("modelDescription.xml".into(), described.into_bytes()));
    files.push((format!("resources/{SCENARIO_FILE}"), text.into_bytes()));
    files.push((format!("resources/{KIND_FILE}"), kind.name().into()));
    let size = write(out, &files)?;
    if json {
        let written = serde_json::json!({ "fmu": out, "kind": kind.name(), "tick_s": scenario.tick_s, "bytes": size });
        crate::say!("{written:#}");
    } else {
        crate::say!("{} ({} kB): {}", out.display(), size / 1000, kind.about());
        crate::say!("its steps are whole multiples of {} s", scenario.tick_s);
    }
    Ok(Ending::Held)
}

/// Other files that the scenario reads.
fn files_of(scenario: &mut Scenario) -> impl Iterator<Item = &mut PathBuf> {
    let table = match &mut scenario.controller.trajectory {
        TrajectorySettings::Table { file, .. } => Some(file),
        _ => None,
    };
    let learned = scenario.controller.learning.as_mut().and_then(|own| own.from.as_mut());
    table.into_iter().chain(learned)
}

/// Says where it is, for whoever calls from another executable; what is not there is looked for.
const LIBRARY_VARIABLE: &str = "ANHYST_FMU_LIBRARY";

/// The library that was built with this executable: beside it, or where cargo puts what an executable needs.
fn found_library() -> Result<PathBuf, RunError> {
    let told = std::env::var_os(LIBRARY_VARIABLE).map(PathBuf::from);
    if let Some(told) = told.filter(|told| told.is_file()) {
        return Ok(told);
    }
    let executable = std::env::current_exe().map_err(|error| RunError::Setup(error.to_string()))?;
    let folder = executable.parent().unwrap_or(Path::new("."));
    let found = [folder.join("deps").join(LIBRARY), folder.join(LIBRARY)]
        .into_iter()
        .filter_map(|file| Some((file.metadata().ok()?.modified().ok()?, file)))
        .max();
    found.map(|(_, file)| file).ok_or_else(|| {
        RunError::Setup(format!(
            "{LIBRARY} is not in {} nor in deps there: build it with `cargo build --release -p anhyst-fmu` and name it with --library",
            folder.display()
        ))
    })
}

/// The archive, in one go: a half-written one never bears the name. Its size.
fn write(out: &Path, files: &[(String, Vec<u8>)]) -> Result<usize, RunError> {
    let refused = |cause: std::io::Error| RunError::Write {
        path: out.to_owned(),
        cause,
    };
    let mut archive = ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in files {
        archive
            .start_file(name.as_str(), SimpleFileOptions::default())
            .map_err(|error| refused(error.into()))?;
        archive.write_all(bytes).map_err(refused)?;
    }
    let bytes = archive.finish().map_err(|error| refused(error.into()))?.into_inner();
    let partial = out.with_extension("fmu.part");
    std::fs::write(&partial, &bytes)
        .and_then(|()| std::fs::rename(&partial, out))
        .map_err(refused)?;
    Ok(bytes.len())
}
