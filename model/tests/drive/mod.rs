//! A command at 10 kHz that shows every effect: growing loops, a faster part with harmonics, steps with rests.
#![allow(dead_code)] // Each test file uses its own part of this.

use std::f64::consts::PI;

/// Parts are joined, and steps made, over so many ticks.
const JOINT: f64 = 20.0;

/// `count` samples from zero, in A/m.
pub fn loops(count: usize) -> Vec<f64> {
    joined(count, JOINT)
}

/// The same with its joints as jumps, within one tick.
pub fn jumping(count: usize) -> Vec<f64> {
    joined(count, 1.0)
}

fn joined(count: usize, joint_ticks: f64) -> Vec<f64> {
    let length = count as f64;
    let growing = |index: f64| 12e3 * (index / (0.4 * length)) * (2.0 * PI * 20.0 * 1e-4 * index).sin();
    let fast = |index: f64| {
        let angle = 2.0 * PI * 90.0 * 1e-4 * index;
        5e3 * angle.sin() + 2.5e3 * (2.7 * angle).sin() + 2e3
    };
    let (end_of_growing, end_of_fast) = (0.4 * length, 0.75 * length);
    let rest = (length - end_of_fast) / 4.0;
    let part = |index: f64| {
        if index < end_of_growing {
            growing(index)
        } else if index < end_of_fast {
            fast(index)
        } else {
            [4e3, -3e3, 7e3, 1e3][((index - end_of_fast) / rest).min(3.0) as usize]
        }
    };
    let mut commands: Vec<f64> = (0..count).map(|index| part(index as f64)).collect();
    // The joints: from where the part before ended to where the part behind begins.
    for joint in [
        end_of_growing,
        end_of_fast,
        end_of_fast + rest,
        end_of_fast + 2.0 * rest,
        end_of_fast + 3.0 * rest,
    ] {
        let begin = joint.ceil() as usize;
        let from = commands[begin - 1];
        for (offset, command) in commands[begin..].iter_mut().take(joint_ticks as usize).enumerate() {
            *command = from + (*command - from) * (offset + 1) as f64 / joint_ticks;
        }
    }
    commands
}

/// The same with each tick cut in `parts`: the field is a straight line between samples.
pub fn finer(commands: &[f64], parts: usize) -> Vec<f64> {
    let mut finer = vec![commands[0]];
    for pair in commands.windows(2) {
        finer.extend((1..=parts).map(|part| pair[0] + (pair[1] - pair[0]) * part as f64 / parts as f64));
    }
    finer
}
