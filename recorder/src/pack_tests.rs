use super::*;

const FIELDS: usize = 8;
const ROW: usize = 10;

/// Fields stand in another order than in a row, and each source is tried.
const SHAPE: Shape<FIELDS> = Shape {
    places: [2, 3, 4, 9, 8, 7, 6, 5],
    sources: [
        Source::Nothing,
        Source::Nothing,
        Source::Same(0),
        Source::Before(2),
        Source::Sum(0, 1),
        Source::Difference(1, 0),
        Source::Difference(4, 5),
        Source::Before(4),
    ],
};

/// xorshift64*.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }
}

type Rows = Vec<[u64; ROW]>;

fn packed(pieces: &[&[[u64; ROW]]]) -> Vec<u8> {
    let mut packer = Packer::<FIELDS>::new(SHAPE);
    pieces.iter().for_each(|piece| packer.add(piece));
    packer.take()
}

fn assert_comes_back(rows: &Rows, packed: &[u8], what: &str) {
    let words = unpack(packed, FIELDS).unwrap();
    for (tick, row) in rows.iter().enumerate() {
        for field in 0..FIELDS {
            let got = words[field * rows.len() + tick];
            assert_eq!(
                got,
                row[SHAPE.places[field]],
                "{what}: field {field} of tick {tick} of {}",
                rows.len()
            );
        }
    }
}

fn rows(ticks: usize, mut word: impl FnMut(usize, usize) -> u64) -> Rows {
    (0..ticks)
        .map(|tick| std::array::from_fn(|place| word(tick, place)))
        .collect()
}

const HARD: [u64; 10] = [
    0x7FF8_0000_DEAD_BEEF,
    0xFFF0_0000_0000_0001,
    1 << 63,
    1,
    0,
    0x7FF0_0000_0000_0000,
    0xFFF0_0000_0000_0000,
    u64::MAX,
    i64::MAX as u64,
    0x3FF0_0000_0000_0000,
];

/// Guards every bit of whatever is recorded, and every length of a stretch: noise, constants, what is no number, jumps between the
/// ends of what a word can be, smooth curves, and curves that break off where the plan has been chosen.
#[test]
fn every_bit_comes_back() {
    let mut random = Random(7);
    for ticks in (1..70).chain([96, 97, 500, 4000]) {
        let curve = |tick: usize, place: usize| (1.3 + (0.01 * tick as f64 + place as f64).sin()).to_bits();
        let constant = rows(ticks, |_, place| HARD[place]);
        assert_comes_back(&constant, &packed(&[&constant]), "constants");
        let noise = rows(ticks, |_, _| random.next());
        assert_comes_back(&noise, &packed(&[&noise]), "noise");
        let hard = rows(ticks, |_, _| HARD[random.next() as usize % HARD.len()]);
        assert_comes_back(&hard, &packed(&[&hard]), "hard words");
        let jumps = rows(
            ticks,
            |tick, place| if (tick + place).is_multiple_of(2) { u64::MAX } else { 0 },
        );
        assert_comes_back(&jumps, &packed(&[&jumps]), "jumps");
        let smooth = rows(ticks, curve);
        assert_comes_back(&smooth, &packed(&[&smooth]), "a curve");
        let broken = rows(ticks, |tick, place| match tick {
            // Where nothing was sampled.
            tick if tick % 1000 > 400 && tick % 1000 < 900 => random.next(),
            _ => curve(tick, place),
        });
        assert_comes_back(&broken, &packed(&[&broken]), "a broken curve");
    }
}

/// Guards the way in pieces: what was packed piece by piece is what was packed at once, and nothing of one stretch is left in the next.
#[test]
fn pieces_make_a_whole() {
    let mut random = Random(3);
    let noise = rows(1000, |tick, _| (tick as u64) << 20 ^ random.next() >> 40);
    let mut packer = Packer::<FIELDS>::new(SHAPE);
    for _ in 0..2 {
        noise.chunks(250).for_each(|piece| packer.add(piece));
        assert_comes_back(&noise, &packer.take(), "pieces");
    }
}

/// Guards the size: what another field tells costs nothing, what is smooth little, and what is noise no more than itself.
#[test]
fn what_is_foretold_is_small() {
    let bytes = |rows: &Rows| packed(&[rows]).len() as f64 / (rows.len() * FIELDS) as f64;
    let copies = rows(4096, |tick, place| {
        let value = |tick: usize, seed: f64| 1.0 + (0.3 * tick as f64 * (tick as f64 + seed)).sin();
        let (a, b) = (value(tick, 0.0), value(tick, 1.0));
        let before = value(tick.saturating_sub(1), 0.0);
        match place {
            3 => b,
            9 => before,
            8 => a + b,
            7 => b - a,
            6 => (a + b) - (b - a),
            5 => {
                let tick = tick.saturating_sub(1);
                value(tick, 0.0) + value(tick, 1.0)
            }
            _ => a,
        }
        .to_bits()
    });
    assert!(bytes(&copies) < 2.2, "{}", bytes(&copies));
    let constants = rows(4096, |_, place| HARD[place]);
    assert!(bytes(&constants) < 0.04, "{}", bytes(&constants));
    let mut random = Random(5);
    let noise = rows(4096, |_, _| random.next());
    assert!(bytes(&noise) < 8.04, "{}", bytes(&noise));
}

/// Guards against files that are damaged: no panic, and no memory that the file does not have.
#[test]
fn what_was_not_packed_is_refused() {
    let mut random = Random(11);
    let some = rows(100, |_, _| random.next() >> 30);
    let whole = packed(&[&some]);
    for length in 0..whole.len() {
        assert_eq!(unpack(&whole[..length], FIELDS), None, "{length} bytes");
    }
    for at in 0..4 + 4 * FIELDS {
        let mut damaged = whole.clone();
        damaged[at] = 0xFF;
        let _ = unpack(&damaged, FIELDS);
    }
    let mut circle = whole;
    // Fields 0 and 1 foretell each other.
    circle[4..12].copy_from_slice(&[1, 1, 0, 0, 1, 0, 0, 0]);
    assert_eq!(unpack(&circle, FIELDS), None);
}
