//! Which numbers of the stacked spectra share a level.
//!
//! Noise has a level in each band of the frequency (`spectrum.rs`). A model that was itself fitted is wrong by more than noise wherever it
//! answers, and a level for each band would forgive it one harmonic for the sake of another: all numbers in which its answer stands out
//! of the noise have one level, that of its own error, and those slower than half its strongest line another.

use crate::channel::ChannelKind;
use crate::composition::Composition;
use crate::plant::{Plant, Steps};

/// A number of a spectrum in which a fitted model's answer is this many noises shows that model's error.
const STANDS_OUT: f64 = 3.0;
/// A model's errors hang together: few numbers or many, they count as so many independent ones, like a band of noise.
pub(crate) const ERRORS: f64 = 300.0;
/// Fewest numbers on which a level beside it stands: fewer hide a slow effect.
const MIN_LEVEL: usize = 60;

/// Bands by frequency; of a fitted model also one, by kind of channel, of the numbers in which its answer stands out, and how many those
/// are: the last.
pub(crate) fn bands(plant: &Plant) -> (Vec<Vec<usize>>, usize) {
    let bands: Vec<Vec<usize>> = plant.bands().into_iter().map(Iterator::collect).collect();
    let nominal = plant
        .fitted
        .then(|| plant.simulate(&Composition::default(), Steps::Made));
    let Some(answer) = nominal.flatten().and_then(|runs| plant.spectra(&runs)) else {
        return (bands, 0);
    };
    let mut errors: Vec<((ChannelKind, bool), Vec<usize>)> = Vec::new();
    let mut quiet: Vec<Vec<usize>> = Vec::new();
    for channel in &plant.channels {
        let mut out = Vec::new();
        let from = quiet.len();
        let mut gathered = Vec::new();
        for band in bands.iter().filter(|band| channel.places.contains(&band[0])) {
            let (stands_out, rest): (Vec<usize>, Vec<usize>) = band
                .iter()
                .copied()
                .partition(|place| answer[*place].abs() > STANDS_OUT * channel.noise_rms);
            out.extend(stands_out);
            gathered.extend(rest);
            if gathered.len() >= MIN_LEVEL {
                quiet.push(std::mem::take(&mut gathered));
            }
        }
        quiet[from..].last_mut().unwrap_or(&mut out).extend(gathered);
        // What is slower than the drive's own motion is not the shape of its loops.
        let strongest = channel
            .places
            .clone()
            .skip(1)
            .max_by(|one, other| answer[*one].abs().total_cmp(&answer[*other].abs()));
        let slow = channel.places.start + (strongest.unwrap_or(0) - channel.places.start) / 2;
        let (below, above): (Vec<usize>, Vec<usize>) = out.into_iter().partition(|place| *place < slow);
        let (below, above) = if below.len() < MIN_LEVEL {
            (Vec::new(), [below, above].concat())
        } else {
            (below, above)
        };
        for (is_slow, out) in [(true, below), (false, above)] {
            match errors.iter_mut().find(|(own, _)| *own == (channel.kind, is_slow)) {
                Some((_, all)) => all.extend(out),
                None => errors.push(((channel.kind, is_slow), out)),
            }
        }
    }
    let from = quiet.len();
    quiet.extend(errors.into_iter().map(|(_, all)| all).filter(|all| !all.is_empty()));
    let errors = quiet.len() - from;
    (quiet, errors)
}
