//! What every law's bank must keep to.

use anhyst_ipc::Invalid;

/// Largest bank: a member costs about 20 ns a tick, and beyond some hundred members interpolation is not the error any more.
const MAX_MEMBERS: usize = 512;

/// A range that can be spanned, a start inside it, and a bank of at least `least` and not too many members.
pub(super) fn validate_bank(
    (lower, upper): (f64, f64),
    start: f64,
    members: usize,
    least: usize,
) -> Result<(), Invalid> {
    Invalid::unless_positive("range_a_per_m", lower, "A/m")?;
    Invalid::unless_positive("range_a_per_m", upper, "A/m")?;
    if lower >= upper {
        return Err(Invalid::new(
            "range_a_per_m",
            format!("the lower edge {lower} A/m must be below the upper edge {upper} A/m"),
        ));
    }
    if !(lower..=upper).contains(&start) {
        let [lower, upper] = [lower, upper].map(|edge| (1e3 * edge).round() / 1e3);
        return Err(Invalid::new(
            "start_a_per_m",
            format!("{start} A/m is outside the range [{lower}, {upper}] A/m, which the estimate may not leave"),
        ));
    }
    if !(least..=MAX_MEMBERS).contains(&members) {
        return Err(Invalid::new(
            "members",
            format!("{members} models cannot span a range; {least} to {MAX_MEMBERS} are possible"),
        ));
    }
    Ok(())
}
