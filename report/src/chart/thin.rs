//! Less ink for the same picture: what falls on one pixel is drawn once.

/// Pieces of a path whose points are finite.
pub(crate) fn pieces(points: impl Iterator<Item = (f64, f64)>) -> Vec<Vec<(f64, f64)>> {
    let mut pieces = vec![Vec::new()];
    for point in points {
        if point.0.is_finite() && point.1.is_finite() {
            if let Some(piece) = pieces.last_mut() {
                piece.push(point);
            }
        } else {
            pieces.push(Vec::new());
        }
    }
    pieces.retain(|piece| !piece.is_empty());
    pieces
}

/// A path of fewer points that looks the same to within a third of a pixel.
pub(crate) fn path(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let rising = points.windows(2).all(|pair| pair[1].0 >= pair[0].0);
    let thinned = if rising { columns(points) } else { apart(points) };
    straightened(&thinned)
}

/// First, lowest, highest and last point of each column of pixels.
fn columns(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let column = |point: &(f64, f64)| point.0.floor() as i64;
    let mut thinned = Vec::new();
    for group in points.chunk_by(|one, other| column(one) == column(other)) {
        let index_by = |sign: f64| {
            let by = |one: &usize, other: &usize| (sign * group[*one].1).total_cmp(&(sign * group[*other].1));
            (0..group.len()).max_by(by).unwrap_or(0)
        };
        let mut kept = [0, index_by(-1.0), index_by(1.0), group.len() - 1];
        kept.sort_unstable();
        for (position, index) in kept.iter().enumerate() {
            if position == 0 || kept[position - 1] != *index {
                thinned.push(group[*index]);
            }
        }
    }
    thinned
}

/// Points at least half a pixel from the one before.
fn apart(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut thinned: Vec<(f64, f64)> = Vec::new();
    for (index, point) in points.iter().enumerate() {
        let far = thinned
            .last()
            .is_none_or(|last| (last.0 - point.0).hypot(last.1 - point.1) >= 0.5);
        if far || index + 1 == points.len() {
            thinned.push(*point);
        }
    }
    thinned
}

/// Points that lie on the straight line between their neighbours are left out (Douglas and Peucker 1973, in runs).
fn straightened(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    const RUN: usize = 256;
    const TOLERANCE: f64 = 0.3;
    let Some(last) = points.len().checked_sub(1) else {
        return Vec::new();
    };
    let mut keep = vec![false; points.len()];
    let mut open: Vec<(usize, usize)> = Vec::new();
    for first in (0..=last).step_by(RUN) {
        let end = (first + RUN).min(last);
        (keep[first], keep[end]) = (true, true);
        open.push((first, end));
    }
    while let Some((first, end)) = open.pop() {
        let farthest = (first + 1..end).map(|index| (index, distance(points[index], points[first], points[end])));
        let farthest = farthest.max_by(|one, other| one.1.total_cmp(&other.1));
        if let Some((index, off)) = farthest
            && off > TOLERANCE
        {
            keep[index] = true;
            open.extend([(first, index), (index, end)]);
        }
    }
    let kept = points.iter().zip(keep).filter(|(_, keep)| *keep);
    kept.map(|(point, _)| *point).collect()
}

/// From a point to the stretch between two others.
fn distance(point: (f64, f64), from: (f64, f64), to: (f64, f64)) -> f64 {
    let (along, off) = ((to.0 - from.0, to.1 - from.1), (point.0 - from.0, point.1 - from.1));
    let square = along.0 * along.0 + along.1 * along.1;
    let share = if square > 0.0 {
        (along.0 * off.0 + along.1 * off.1) / square
    } else {
        0.0
    };
    let share = share.clamp(0.0, 1.0);
    (off.0 - share * along.0).hypot(off.1 - share * along.1)
}

/// One point per pixel.
pub(crate) fn points(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mut taken = std::collections::BTreeSet::new();
    let pixel = |point: &(f64, f64)| (point.0.round() as i64, point.1.round() as i64);
    points
        .iter()
        .copied()
        .filter(|point| taken.insert(pixel(point)))
        .collect()
}

/// The part of a path within a rectangle, as pieces.
pub(crate) fn clipped(path: &[(f64, f64)], sides: [f64; 4]) -> Vec<Vec<(f64, f64)>> {
    let mut pieces: Vec<Vec<(f64, f64)>> = Vec::new();
    for pair in path.windows(2) {
        let Some((from, to)) = clipped_stretch(pair[0], pair[1], sides) else {
            continue;
        };
        match pieces.last_mut() {
            Some(piece) if piece.last() == Some(&from) => piece.push(to),
            _ => pieces.push(vec![from, to]),
        }
    }
    pieces
}

/// Liang and Barsky (1984); sides are left, right, top, bottom.
fn clipped_stretch(from: (f64, f64), to: (f64, f64), sides: [f64; 4]) -> Option<((f64, f64), (f64, f64))> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    let [left, right, top, bottom] = sides;
    for (pace, room) in [
        (-dx, from.0 - left),
        (dx, right - from.0),
        (-dy, from.1 - top),
        (dy, bottom - from.1),
    ] {
        if pace == 0.0 {
            if room < 0.0 {
                return None;
            }
        } else if pace < 0.0 {
            enter = enter.max(room / pace);
        } else {
            leave = leave.min(room / pace);
        }
    }
    let at = |share: f64| (from.0 + share * dx, from.1 + share * dy);
    let ends = (
        if enter > 0.0 { at(enter) } else { from },
        if leave < 1.0 { at(leave) } else { to },
    );
    (enter <= leave).then_some(ends)
}

/// How long a path is, pixels.
pub(crate) fn length(path: &[(f64, f64)]) -> f64 {
    path.windows(2)
        .map(|pair| (pair[1].0 - pair[0].0).hypot(pair[1].1 - pair[0].1))
        .sum()
}

/// A path cut into dashes of 6 pixels with gaps of 4.
pub(crate) fn dashes(path: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    const LENGTHS: [f64; 2] = [6.0, 4.0];
    let mut all = Vec::new();
    let (mut gap, mut left) = (0, LENGTHS[0]);
    let mut dash: Vec<(f64, f64)> = path.first().copied().into_iter().collect();
    for pair in path.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let length = (to.0 - from.0).hypot(to.1 - from.1);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let at = (
                from.0 + (to.0 - from.0) * done / length,
                from.1 + (to.1 - from.1) * done / length,
            );
            if gap == 0 {
                dash.push(at);
                all.push(std::mem::take(&mut dash));
            } else {
                dash = vec![at];
            }
            gap = 1 - gap;
            left = LENGTHS[gap];
        }
        left -= length - done;
        if gap == 0 {
            dash.push(to);
        }
    }
    if gap == 0 && dash.len() > 1 {
        all.push(dash);
    }
    all
}

#[cfg(test)]
mod tests {
    //! Guards the pictures' honesty: thinning must lose no extreme, no dash and no piece.
    use super::*;

    #[test]
    fn a_long_noisy_series_keeps_every_extreme() {
        let points: Vec<(f64, f64)> = (0..40_000)
            .map(|i| {
                let x = f64::from(i) * 0.02;
                (
                    x,
                    100.0 + 50.0 * (x * 0.05).sin() + if i == 31_415 { -80.0 } else { f64::from(i % 7) },
                )
            })
            .collect();
        let thinned = path(&points);
        assert!(thinned.len() < 3300, "{}", thinned.len());
        assert!(thinned.contains(&points[31_415]));
        assert_eq!((thinned.first(), thinned.last()), (points.first(), points.last()));
    }

    #[test]
    fn a_loop_stays_where_it_was() {
        let of = |phase: f64| (300.0 + 250.0 * phase.cos(), 200.0 + 150.0 * (phase - 0.5).sin());
        let points: Vec<(f64, f64)> = (0..20_000)
            .map(|i| of(f64::from(i) * std::f64::consts::TAU / 20_000.0))
            .collect();
        let thinned = path(&points);
        assert!(thinned.len() < 200, "{}", thinned.len());
        let off = |point: &(f64, f64)| {
            let stretches = thinned.windows(2).map(|pair| distance(*point, pair[0], pair[1]));
            stretches.fold(f64::INFINITY, f64::min)
        };
        let worst = points.iter().map(off).fold(0.0, f64::max);
        assert!(worst < 0.8, "{worst} pixels");
    }

    #[test]
    fn gaps_break_and_edges_cut_a_line() {
        let broken = pieces([(0.0, 1.0), (1.0, 1.0), (f64::NAN, 2.0), (3.0, 1.0)].into_iter());
        assert_eq!(broken.iter().map(Vec::len).collect::<Vec<_>>(), [2, 1]);
        let cut = clipped(
            &[(-10.0, 5.0), (5.0, 5.0), (5.0, 50.0), (20.0, 50.0)],
            [0.0, 10.0, 0.0, 10.0],
        );
        assert_eq!(cut, [[(0.0, 5.0), (5.0, 5.0), (5.0, 10.0)]]);
        let drawn: f64 = dashes(&[(0.0, 0.0), (103.0, 0.0)])
            .iter()
            .map(|dash| dash[dash.len() - 1].0 - dash[0].0)
            .sum();
        assert!((drawn - 63.0).abs() < 1e-9, "{drawn}");
    }
}
