//! Words of many ticks in few bytes, bit for bit, in one pass and without a search: each field is foretold, and what is left is written
//! in as many bytes as it needs.
//!
//! A packed stretch, all numbers little-endian:
//! - 4 bytes: how many ticks;
//! - 4 bytes for each field, its [`Plan`]: kind of source, the two fields that it is of, order;
//! - 8 bytes for each field: its word in the first tick;
//! - tiles of [`TILE`] ticks, the last one of what is left: a byte for each field, how many bytes its numbers have; then the fields'
//!   numbers, one field after the other.
//!
//! Field `x` is foretold by its source `p`: kind 0 is nothing, that is 0; 1 another field of the same tick; 2 one of the tick before, in the
//! first tick of the same; 3 the sum and 4 the difference of two fields as numbers, which where it is no number is 0. Of the rest
//! `r = x - p`, as integers that wrap around, the differences of the plan's order are taken along time, as if `r` had always been what it
//! is in the first tick. A difference `d` is written as `2 d` where it is not negative, otherwise as `-2 d - 1`.

/// Ticks whose numbers are equally long.
const TILE: usize = 32;
/// The highest order of differences.
const MOST: usize = 3;
/// Ticks that a plan is chosen by.
const SAMPLES: usize = 2;
/// Plans to choose from.
const PLANS: usize = 5;
const WORD: usize = size_of::<u64>();

/// What foretells a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Source {
    Nothing,
    Same(usize),
    Before(usize),
    Sum(usize, usize),
    Difference(usize, usize),
}

/// How a field is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Plan {
    source: Source,
    order: usize,
}

impl Source {
    fn code(self) -> [u8; 3] {
        let (kind, first, second) = match self {
            Self::Nothing => (0, 0, 0),
            Self::Same(field) => (1, field, 0),
            Self::Before(field) => (2, field, 0),
            Self::Sum(first, second) => (3, first, second),
            Self::Difference(first, second) => (4, first, second),
        };
        [kind, first as u8, second as u8]
    }

    fn of([kind, first, second]: [u8; 3]) -> Option<Self> {
        let (first, second) = (usize::from(first), usize::from(second));
        Some(match kind {
            0 => Self::Nothing,
            1 => Self::Same(first),
            2 => Self::Before(first),
            3 => Self::Sum(first, second),
            4 => Self::Difference(first, second),
            _ => return None,
        })
    }

    /// The fields that it is of.
    pub fn fields(self) -> impl Iterator<Item = usize> {
        let fields = match self {
            Self::Nothing => [None, None],
            Self::Same(field) | Self::Before(field) => [Some(field), None],
            Self::Sum(first, second) | Self::Difference(first, second) => [Some(first), Some(second)],
        };
        fields.into_iter().flatten()
    }

    /// What it foretells of a tick, from the words of that tick and of the one before.
    #[inline(always)]
    fn foretold(self, now: impl Fn(usize) -> u64, before: impl Fn(usize) -> u64) -> u64 {
        match self {
            Self::Nothing => 0,
            Self::Same(field) => now(field),
            Self::Before(field) => before(field),
            Self::Sum(first, second) => number(f64::from_bits(now(first)) + f64::from_bits(now(second))),
            Self::Difference(first, second) => number(f64::from_bits(now(first)) - f64::from_bits(now(second))),
        }
    }
}

/// What is no number has other bits on other machines.
fn number(value: f64) -> u64 {
    if value.is_nan() { 0 } else { value.to_bits() }
}

/// Where the words of fields are in a row of words, and what foretells them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shape<const FIELDS: usize> {
    pub places: [usize; FIELDS],
    pub sources: [Source; FIELDS],
}

/// A field's words in the tick before a tile and in those of the tile.
type Column = [u64; 1 + TILE];

/// Writes what is left of a field.
#[inline(always)]
fn rest(columns: &[Column], field: usize, source: Source, ticks: usize, rest: &mut [u64]) {
    let now = |field: usize, at: usize| columns[field][1 + at];
    for (at, rest) in rest[..ticks].iter_mut().enumerate() {
        let foretold = source.foretold(|own| now(own, at), |own| columns[own][at]);
        *rest = now(field, at).wrapping_sub(foretold);
    }
}

/// The same without a choice in each tick.
fn rest_of(columns: &[Column], field: usize, source: Source, ticks: usize, own: &mut [u64]) {
    match source {
        Source::Nothing => rest(columns, field, Source::Nothing, ticks, own),
        Source::Same(a) => rest(columns, field, Source::Same(a), ticks, own),
        Source::Before(a) => rest(columns, field, Source::Before(a), ticks, own),
        Source::Sum(a, b) => rest(columns, field, Source::Sum(a, b), ticks, own),
        Source::Difference(a, b) => rest(columns, field, Source::Difference(a, b), ticks, own),
    }
}

impl<const FIELDS: usize> Shape<FIELDS> {
    /// Writes a row into columns.
    #[inline(always)]
    fn write<const ROW: usize>(&self, row: &[u64; ROW], at: usize, columns: &mut [Column; FIELDS]) {
        for (column, place) in columns.iter_mut().zip(self.places) {
            column[at] = row[place];
        }
    }
}

/// What was left in the last [`MOST`] ticks and is left in those of a tile.
type Rests = [u64; MOST + TILE];

/// The numbers that are written of a tile, and how many bytes they need.
fn numbers(rests: &Rests, order: usize, ticks: usize, numbers: &mut [u64; TILE]) -> usize {
    let own = &rests[MOST..MOST + ticks];
    let [a, b, c] = [1, 2, 3].map(|back| &rests[MOST - back..MOST - back + ticks]);
    let numbers = &mut numbers[..ticks];
    let alternate = |difference: u64| (difference << 1) ^ (((difference as i64) >> 63) as u64);
    match order {
        0 => (0..ticks).for_each(|at| numbers[at] = alternate(own[at])),
        1 => (0..ticks).for_each(|at| numbers[at] = alternate(own[at].wrapping_sub(a[at]))),
        2 => (0..ticks).for_each(|at| {
            let slope = a[at].wrapping_add(a[at]).wrapping_sub(b[at]);
            numbers[at] = alternate(own[at].wrapping_sub(slope));
        }),
        _ => (0..ticks).for_each(|at| {
            let bend = a[at].wrapping_sub(b[at]);
            let bend = bend.wrapping_add(bend).wrapping_add(bend).wrapping_add(c[at]);
            numbers[at] = alternate(own[at].wrapping_sub(bend));
        }),
    }
    let all = numbers.iter().fold(0, |all, number| all | number);
    WORD - all.leading_zeros() as usize / 8
}

/// Packs one stretch after the other.
pub(crate) struct Packer<const FIELDS: usize> {
    shape: Shape<FIELDS>,
    plans: [Plan; FIELDS],
    packed: Vec<u8>,
    /// Of the stretch, and of them those that are not packed yet.
    ticks: usize,
    held: usize,
    /// What was left in the last ticks that are.
    last: [[u64; MOST]; FIELDS],
    columns: Box<[Column; FIELDS]>,
    tile: Vec<u8>,
}

impl<const FIELDS: usize> Packer<FIELDS> {
    pub fn new(shape: Shape<FIELDS>) -> Self {
        let none = Plan {
            source: Source::Nothing,
            order: 0,
        };
        Self {
            shape,
            plans: [none; FIELDS],
            packed: Vec::new(),
            ticks: 0,
            held: 0,
            last: [[0; MOST]; FIELDS],
            columns: Box::new([[0; 1 + TILE]; FIELDS]),
            tile: vec![0; (FIELDS * TILE + 1) * WORD],
        }
    }

    /// Packs more ticks of a stretch; by the first ones its plans are chosen.
    pub fn add<const ROW: usize>(&mut self, rows: &[[u64; ROW]]) {
        if self.ticks == 0 && !rows.is_empty() {
            self.begin(rows);
        }
        for row in rows {
            self.ticks += 1;
            self.held += 1;
            self.shape.write(row, self.held, &mut self.columns);
            if self.held == TILE {
                self.pack_tile();
            }
        }
    }

    /// The packed stretch; the next one begins.
    pub fn take(&mut self) -> Vec<u8> {
        if self.held > 0 {
            self.pack_tile();
        }
        let room = self.packed.len() + self.packed.len() / 8;
        let mut packed = std::mem::replace(&mut self.packed, Vec::with_capacity(room));
        if let Some(ticks) = packed.first_chunk_mut() {
            *ticks = (self.ticks as u32).to_le_bytes();
        }
        self.ticks = 0;
        packed
    }

    fn begin<const ROW: usize>(&mut self, rows: &[[u64; ROW]]) {
        self.packed.extend([0; 4]);
        self.choose(rows);
        for plan in self.plans {
            self.packed.extend(plan.source.code());
            self.packed.push(plan.order as u8);
        }
        (0..2).for_each(|at| self.shape.write(&rows[0], at, &mut self.columns));
        for field in 0..FIELDS {
            self.packed.extend(self.columns[field][0].to_le_bytes());
            let mut first = [0];
            rest_of(&self.columns[..], field, self.plans[field].source, 1, &mut first);
            self.last[field] = [first[0]; MOST];
        }
    }

    /// Chooses the plans that need the fewest bytes in some tiles; of equal ones the simplest.
    fn choose<const ROW: usize>(&mut self, rows: &[[u64; ROW]]) {
        let mut bytes = [[0; PLANS]; FIELDS];
        let plans = |source: Source| {
            let nothing = Source::Nothing;
            [(source, 0), (source, 1), (nothing, 1), (nothing, 2), (nothing, MOST)]
                .map(|(source, order)| Plan { source, order })
        };
        for sample in 0..SAMPLES {
            let first = (sample * rows.len() / SAMPLES).min(rows.len().saturating_sub(TILE));
            let sampled = &rows[first..rows.len().min(first + TILE)];
            let before = &rows[first.saturating_sub(1)];
            for (at, row) in std::iter::once(before).chain(sampled).enumerate() {
                self.shape.write(row, at, &mut self.columns);
            }
            for (field, bytes) in bytes.iter_mut().enumerate() {
                for (plan, bytes) in plans(self.shape.sources[field]).iter().zip(bytes) {
                    let (mut rests, mut unused) = ([0; MOST + TILE], [0; TILE]);
                    rest_of(&self.columns[..], field, plan.source, sampled.len(), &mut rests);
                    *bytes += numbers(&rests, plan.order, sampled.len().saturating_sub(MOST), &mut unused);
                }
            }
        }
        for ((plan, source), bytes) in self.plans.iter_mut().zip(self.shape.sources).zip(bytes) {
            let least = (0..PLANS).min_by_key(|plan| bytes[*plan]).unwrap_or(0);
            *plan = plans(source)[least];
        }
    }

    fn pack_tile(&mut self) {
        let ticks = std::mem::take(&mut self.held);
        let mut written = FIELDS;
        let mut of_field = [0; TILE];
        let mut rests = [0; MOST + TILE];
        for field in 0..FIELDS {
            let (plan, last) = (self.plans[field], &mut self.last[field]);
            rests[..MOST].copy_from_slice(last);
            rest_of(&self.columns[..], field, plan.source, ticks, &mut rests[MOST..]);
            last.copy_from_slice(&rests[ticks..][..MOST]);
            let width = numbers(&rests, plan.order, ticks, &mut of_field);
            self.tile[field] = width as u8;
            if width == 0 {
                continue;
            }
            for number in &of_field[..ticks] {
                // What is too long here is written over by the next one.
                self.tile[written..written + WORD].copy_from_slice(&number.to_le_bytes());
                written += width;
            }
        }
        self.columns.iter_mut().for_each(|column| column[0] = column[ticks]);
        self.packed.extend_from_slice(&self.tile[..written]);
    }
}

/// The words of a packed stretch, those of one field after those of the other; none if it is none.
pub(crate) fn unpack(packed: &[u8], fields: usize) -> Option<Vec<u64>> {
    let (ticks, rest) = packed.split_first_chunk()?;
    let ticks = u32::from_le_bytes(*ticks) as usize;
    let (plans, rest) = rest.split_at_checked(4 * fields)?;
    let plan = |[kind, first, second, order]: [u8; 4]| {
        let source = Source::of([kind, first, second])?;
        let order = usize::from(order);
        let known = order <= MOST && source.fields().all(|own| own < fields);
        known.then_some(Plan { source, order })
    };
    let plans: Vec<Plan> = plans
        .as_chunks()
        .0
        .iter()
        .map(|bytes| plan(*bytes))
        .collect::<Option<_>>()?;
    let (first, mut rest) = rest.split_at_checked(WORD * fields)?;
    let first: Vec<u64> = first
        .as_chunks()
        .0
        .iter()
        .map(|word| u64::from_le_bytes(*word))
        .collect();
    // No more than what is there may ask for.
    if ticks == 0 || ticks.div_ceil(TILE).checked_mul(fields)? > rest.len() {
        return None;
    }
    let mut words = vec![0; fields * ticks];
    for begun in (0..ticks).step_by(TILE) {
        let length = TILE.min(ticks - begun);
        let (widths, numbers) = rest.split_at_checked(fields)?;
        rest = numbers;
        for (field, width) in widths.iter().enumerate() {
            let width = usize::from(*width);
            let (numbers, others) = rest.split_at_checked(width * length)?;
            rest = others;
            if width == 0 {
                continue;
            }
            let words = &mut words[field * ticks + begun..][..length];
            for (word, number) in words.iter_mut().zip(numbers.chunks_exact(width)) {
                let mut bytes = [0; WORD];
                bytes.get_mut(..width)?.copy_from_slice(number);
                let number = u64::from_le_bytes(bytes);
                *word = (number >> 1) ^ (number & 1).wrapping_neg();
            }
        }
    }
    let mut done = vec![false; fields];
    while let Some(field) =
        (0..fields).find(|field| !done[*field] && plans[*field].source.fields().all(|own| done[own]))
    {
        restore(&mut words, ticks, field, plans[field], first[field]);
        done[field] = true;
    }
    // Fields that foretell each other are of no packer.
    (rest.is_empty() && done.into_iter().all(|done| done)).then_some(words)
}

/// From a field's differences its words; those of its sources are there.
fn restore(words: &mut [u64], ticks: usize, field: usize, plan: Plan, first: u64) {
    let start = field * ticks;
    for _ in 0..plan.order {
        for at in start + 1..start + ticks {
            words[at] = words[at].wrapping_add(words[at - 1]);
        }
    }
    let foretold = |words: &[u64], tick: usize| {
        let of = |tick: usize| move |own: usize| words[own * ticks + tick];
        plan.source.foretold(of(tick), of(tick.saturating_sub(1)))
    };
    // Differences of order 0 are what is left, of others how it has changed.
    let begun = if plan.order == 0 {
        0
    } else {
        first.wrapping_sub(foretold(words, 0))
    };
    for tick in 0..ticks {
        words[start + tick] = words[start + tick]
            .wrapping_add(begun)
            .wrapping_add(foretold(words, tick));
    }
}

#[cfg(test)]
#[path = "pack_tests.rs"]
mod tests;
