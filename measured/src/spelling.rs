//! What is likely meant by a name that nothing has.

/// So alike a known name must be to what was written to be meant by it.
const ALIKE: f64 = 0.8;

/// Of these the one most like what was written, if it is like it.
pub fn nearest<'a>(written: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let alike = names
        .into_iter()
        .map(|name| (strsim::jaro_winkler(name, written), name));
    let (alike, name) = alike.max_by(|one, other| one.0.total_cmp(&other.0))?;
    (alike >= ALIKE).then_some(name)
}
