//! Opens recordings in the Rerun viewer, an executable of its own.

use crate::RecorderError;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Names another viewer than the `rerun` on `PATH`. (`RERUN` is taken: Rerun's library reads it as on or off.)
const VIEWER_VARIABLE: &str = "RERUN_VIEWER";

/// Shows recordings, layouts (`.rbl`) and live runs (`rerun+http://127.0.0.1:PORT/proxy`), and returns when the viewer is
/// closed. The viewer is `viewer`, else `$RERUN_VIEWER`, else `rerun` on `PATH`.
///
/// # Errors
/// If a file is missing, there is no viewer, or it fails.
pub fn view(sources: &[impl AsRef<OsStr>], viewer: Option<&Path>) -> Result<(), RecorderError> {
    for source in sources.iter().map(AsRef::as_ref) {
        let is_address = source.to_string_lossy().contains("://");
        if !is_address && let Err(error) = std::fs::metadata(source) {
            return Err(RecorderError::Read {
                path: source.into(),
                cause: error.to_string(),
            });
        }
    }
    let variable = std::env::var_os(VIEWER_VARIABLE);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let viewer = find(viewer, variable.as_deref(), &path)?;
    let failed = |cause: String| RecorderError::Viewer {
        viewer: viewer.clone(),
        cause,
    };
    // A server on loopback only: by default the viewer listens on every interface.
    let mut command = Command::new(&viewer);
    command
        .args(["--bind", "127.0.0.1", "--port", "auto"])
        .args(sources.iter().map(AsRef::as_ref));
    let status = command.status().map_err(|error| failed(error.to_string()))?;
    if status.success() {
        Ok(())
    } else {
        Err(failed(status.to_string()))
    }
}

/// The first viewer that is named; a named one that does not exist is an error, not a reason to take another.
fn find(given: Option<&Path>, variable: Option<&OsStr>, path: &OsStr) -> Result<PathBuf, RecorderError> {
    let named = given.map(|path| (path.to_owned(), "as given".to_owned()));
    let named = named.or_else(|| variable.map(|path| (path.into(), format!("from {VIEWER_VARIABLE}"))));
    if let Some((viewer, origin)) = named {
        let exists = viewer.is_file();
        let looked = format!("{} {origin} is no file", viewer.display());
        return if exists {
            Ok(viewer)
        } else {
            Err(RecorderError::NoViewer { looked })
        };
    }
    let name = format!("rerun{}", std::env::consts::EXE_SUFFIX);
    let found = std::env::split_paths(path)
        .map(|folder| folder.join(&name))
        .find(|viewer| viewer.is_file());
    found.ok_or_else(|| RecorderError::NoViewer {
        looked: format!("no `{name}` on PATH, {VIEWER_VARIABLE} not set"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards: without a viewer the user is told how to get one.
    #[test]
    fn a_missing_viewer_is_explained() {
        let error = find(None, None, OsStr::new("")).unwrap_err().to_string();
        assert!(error.contains("pip install rerun-sdk==0.36.3"), "{error}");
        let error = find(Some(Path::new("/no/such/viewer")), None, OsStr::new(""))
            .unwrap_err()
            .to_string();
        assert!(error.contains("/no/such/viewer"), "{error}");
    }

    /// Guards: what is given rules over the variable, the variable over `PATH`.
    #[test]
    fn the_nearest_viewer_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let make = |name: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, "").unwrap();
            path
        };
        let (given, variable, on_path) = (make("given"), make("variable"), make("rerun"));
        let path = folder.path().as_os_str();
        assert_eq!(find(Some(&given), Some(variable.as_os_str()), path).unwrap(), given);
        assert_eq!(find(None, Some(variable.as_os_str()), path).unwrap(), variable);
        assert_eq!(find(None, None, path).unwrap(), on_path);
    }
}
