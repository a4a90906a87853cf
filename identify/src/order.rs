//! What is best first. The order is found on the numbers alone, so that a sort is compiled once and not for every kind of item.

/// Sorts by a number, the least first; what ties keeps its order.
pub fn ascending<T>(items: &mut [T], key: impl Fn(&T) -> f64) {
    arrange(items, order(items.iter().map(key).collect()));
}

/// Sorts by a number, the largest first; what ties keeps its order.
pub fn descending<T>(items: &mut [T], key: impl Fn(&T) -> f64) {
    let mirrored = |item: &T| -key(item);
    arrange(items, order(items.iter().map(mirrored).collect()));
}

/// Where what belongs at each place stands.
fn order(keys: Vec<f64>) -> Vec<usize> {
    let mut keys: Vec<(f64, usize)> = keys.into_iter().zip(0..).collect();
    keys.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    keys.into_iter().map(|(_, place)| place).collect()
}

fn arrange<T>(items: &mut [T], order: Vec<usize>) {
    for place in 0..items.len() {
        let mut from = order[place];
        // What stood there has since gone where that place's item was.
        while from < place {
            from = order[from];
        }
        items.swap(place, from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards every choice of the likeliest: order, ties and what is no number, against the library's stable sort.
    #[test]
    fn the_order_is_that_of_a_stable_sort() {
        let mut state = 1_u64;
        let mut draw = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) % 7
        };
        for length in 0..60 {
            let items: Vec<(f64, usize)> = (0..length)
                .map(|place| match draw() {
                    0 => (f64::NAN, place),
                    1 => (f64::NEG_INFINITY, place),
                    size => (size as f64 - 4.0, place),
                })
                .collect();
            let places = |items: &[(f64, usize)]| items.iter().map(|(_, place)| *place).collect::<Vec<_>>();
            let (mut own, mut theirs) = (items.clone(), items.clone());
            ascending(&mut own, |item| item.0);
            theirs.sort_by(|one, other| one.0.total_cmp(&other.0));
            assert_eq!(places(&own), places(&theirs));
            let (mut own, mut theirs) = (items.clone(), items);
            descending(&mut own, |item| item.0);
            theirs.sort_by(|one, other| other.0.total_cmp(&one.0));
            assert_eq!(places(&own), places(&theirs));
        }
    }
}
