//! Where measurements and labelled runs are that the project does not carry: a folder `shared` beside it, or the one that
//! `ANHYST_SHARED` names.

use std::path::{Path, PathBuf};

/// A file or folder there. None, and said so in one line, where it is not: then there is nothing to test.
#[must_use]
pub fn shared(name: &str) -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let path = std::env::var_os("ANHYST_SHARED")
        .map_or_else(beside, PathBuf::from)
        .join(name);
    if !path.exists() {
        println!(
            "no {} (ANHYST_SHARED names the folder): nothing is tested",
            path.display()
        );
    }
    path.exists().then_some(path)
}
