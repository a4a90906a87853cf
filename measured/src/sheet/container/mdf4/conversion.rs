//! What takes a raw number to its unit.

use super::super::Reason;
use super::block::Blocks;

/// How raw numbers become values.
pub(super) struct Conversion {
    formula: Formula,
    pub unit: Option<String>,
}

enum Formula {
    Identity,
    /// Offset, factor.
    Linear(f64, f64),
    /// (p1 x² + p2 x + p3) / (p4 x² + p5 x + p6)
    Rational([f64; 6]),
    /// Raw numbers and their values, rising; between two of them a straight line, or the nearer one.
    Table {
        pairs: Vec<(f64, f64)>,
        interpolated: bool,
    },
}

impl Conversion {
    /// None where values become text or follow a formula in text.
    pub fn of(blocks: &Blocks, at: u64) -> Result<Option<Self>, Reason> {
        if at == 0 {
            return Ok(Some(Conversion {
                formula: Formula::Identity,
                unit: None,
            }));
        }
        let block = blocks.at(at, b"##CC")?;
        let mut data = block.data();
        let kind = data.u8()?;
        data.take(5)?;
        let count = data.u16()?;
        data.take(16)?;
        let values = (0..count).map(|_| data.f64()).collect::<Result<Vec<f64>, Reason>>()?;
        let formula = match (kind, &values[..]) {
            (0, _) => Formula::Identity,
            (1, [offset, factor, ..]) => Formula::Linear(*offset, *factor),
            (2, [p1, p2, p3, p4, p5, p6, ..]) => Formula::Rational([*p1, *p2, *p3, *p4, *p5, *p6]),
            (4 | 5, [_, _, ..]) => Formula::Table {
                pairs: values.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect(),
                interpolated: kind == 4,
            },
            (1 | 2 | 4 | 5, _) => return Err(format!("the conversion at byte {at} has too few numbers")),
            _ => return Ok(None),
        };
        let unit = blocks.text(block.link(1))?;
        Ok(Some(Conversion { formula, unit }))
    }

    pub fn of_value(&self, raw: f64) -> f64 {
        match &self.formula {
            Formula::Identity => raw,
            Formula::Linear(offset, factor) => offset + factor * raw,
            Formula::Rational([p1, p2, p3, p4, p5, p6]) => {
                (p1 * raw * raw + p2 * raw + p3) / (p4 * raw * raw + p5 * raw + p6)
            }
            Formula::Table { pairs, interpolated } => looked_up(pairs, *interpolated, raw),
        }
    }
}

fn looked_up(pairs: &[(f64, f64)], interpolated: bool, raw: f64) -> f64 {
    let next = pairs.partition_point(|(key, _)| *key < raw);
    let (Some(before), Some(after)) = (next.checked_sub(1).map(|index| pairs[index]), pairs.get(next)) else {
        // Outside the table the nearest end holds.
        let end = if next == 0 { pairs.first() } else { pairs.last() };
        return end.map_or(f64::NAN, |(_, value)| *value);
    };
    let share = (raw - before.0) / (after.0 - before.0);
    match interpolated {
        true => before.1 + share * (after.1 - before.1),
        false if share <= 0.5 => before.1,
        false => after.1,
    }
}

#[cfg(test)]
mod tests {
    /// Guards both kinds of tables, inside, at and outside their ends.
    #[test]
    fn tables_hold_at_their_ends_and_between() {
        let pairs = [(0.0, 10.0), (2.0, 20.0)];
        let values =
            |interpolated| [-1.0, 0.0, 0.5, 1.5, 2.0, 3.0].map(|raw| super::looked_up(&pairs, interpolated, raw));
        assert_eq!(values(true), [10.0, 10.0, 12.5, 17.5, 20.0, 20.0]);
        assert_eq!(values(false), [10.0, 10.0, 10.0, 20.0, 20.0, 20.0]);
    }
}
