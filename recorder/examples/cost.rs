//! What recording costs, with the tokens of a recorded run over and over, as fast as the recorder takes them:
//!
//!     anhyst run scenarios/milling.ron --embedded --out runs/milling
//!     cargo run --release -p anhyst-recorder --example cost -- runs/milling /tmp/cost 3600 [drop]
//!
//! Values are the fields of tokens that change in the run, no others: of a law that is not used they are 0 throughout. CPU time
//! is that of all threads. With `drop` a part is removed once the next one has begun, so that an hour fits on any disk.

use anhyst_ipc::{
    Block, CoilField, Demand, Estimate, FieldCommand, MAX_FIELDS, Measurement, Message, Now, SafeField, Truth,
};
use anhyst_recorder::{Recorder, RecorderError, RecorderSettings, Recording, RunInfo};
use std::path::Path;
use std::time::Instant;

type Tick = <Recorder as Block>::Inputs;

/// Lines that tell how memory goes; its least and most count from the second on.
const LINES: u64 = 12;
/// Looks at it.
const LOOKS: u64 = 3000;

fn channel<M: Message>(recording: &Recording) -> Result<(Vec<M>, usize), RecorderError> {
    let tokens: Vec<M> = recording.tokens()?;
    let words = tokens.iter().map(|token| {
        let mut words = [0; MAX_FIELDS];
        token.write_words(&mut words);
        words
    });
    let mut changes = [false; MAX_FIELDS];
    let first = words.clone().next().unwrap_or([0; MAX_FIELDS]);
    for words in words {
        (0..MAX_FIELDS).for_each(|field| changes[field] |= words[field] != first[field]);
    }
    Ok((tokens, changes.into_iter().filter(|changes| *changes).count()))
}

fn read(path: &Path) -> Result<(Vec<Tick>, usize), RecorderError> {
    let recording = Recording::open(path)?;
    let (measurement, a) = channel::<Measurement>(&recording)?;
    let (truth, b) = channel::<Truth>(&recording)?;
    let (estimate, c) = channel::<Estimate>(&recording)?;
    let (demand, d) = channel::<Demand>(&recording)?;
    let (field_command, e) = channel::<FieldCommand>(&recording)?;
    let (safe_field, f) = channel::<SafeField>(&recording)?;
    let (coil_field, g) = channel::<CoilField>(&recording)?;
    let ticks = (0..measurement.len()).map(|at| {
        (
            Now(measurement[at]),
            Now(truth[at]),
            Now(estimate[at]),
            Now(demand[at]),
            Now(field_command[at]),
            Now(safe_field[at]),
            Now(coil_field[at]),
        )
    });
    Ok((ticks.collect(), a + b + c + d + e + f + g))
}

/// CPU seconds of this process, all threads, and its memory, MB.
fn used() -> Option<(f64, f64)> {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: writes the time into what is given.
    unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &raw mut time) };
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<_> = stat.rsplit(')').next()?.split_whitespace().collect();
    let cpu_s = time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64;
    Some((cpu_s, fields.get(21)?.parse::<f64>().ok()? * 4096e-6))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [run, out, seconds, options @ ..] = &arguments[..] else {
        return Err("give the folder of a run, one to write to, and how many seconds".into());
    };
    let seconds: f64 = seconds.parse()?;
    let (source, out) = (Path::new(run).join("recording.rrd"), Path::new(out));
    std::fs::create_dir_all(out)?;
    let (tokens, values) = read(&source)?;
    let tick_s = Recording::open(&source)?.tick_s();
    let ticks = (seconds / tick_s) as u64;
    let info = RunInfo {
        path: out.join("recording.rrd"),
        realtime: false,
        run_id: format!("cost-{}", std::process::id()),
        name: "cost".into(),
        notes: String::new(),
        tick_s,
        tolerance_m: 1e-6,
        settling_time_s: 0.5,
        period_s: Some(0.02),
        parameter_range: [6300.0, 7300.0],
        material: [7.65e5, 4000.0, 0.18],
        scales: anhyst_recorder::Scales::default(),
        field_limit_a_per_m: 30e3,
        lowest_field_a_per_m: -30e3,
        events: Vec::new(),
    };
    let drops = options.iter().any(|option| option == "drop");
    let (start, (cpu_before, _)) = (Instant::now(), used().unwrap_or_default());
    let mut recorder = Recorder::create(&RecorderSettings::default(), info)?;
    let begun = used().unwrap_or_default().0 - cpu_before;
    let (mut bytes, mut least, mut most) = (0, f64::INFINITY, 0f64);
    for tick in 0..ticks {
        if tick % (ticks / LINES).max(1) == 0 {
            println!("{:.0} s: {:.1} MB", tick as f64 * tick_s, used().unwrap_or_default().1);
        }
        if tick % (ticks / LOOKS).max(1) == 0 && tick > ticks / LINES {
            let now = used().unwrap_or_default().1;
            (least, most) = (least.min(now), most.max(now));
        }
        if drops && tick % 1_000_000 == 0 {
            bytes += remove_finished(out)?;
        }
        let mut inputs = tokens[tick as usize % tokens.len()];
        inputs.0.0.stamp(tick, 0);
        recorder.step(tick, inputs);
    }
    let ended = used().unwrap_or_default().0;
    let report = recorder.finish()?;
    let ended = used().unwrap_or_default().0 - ended;
    let (wall, cpu) = (start.elapsed().as_secs_f64(), used().unwrap_or_default().0 - cpu_before);
    bytes += sizes(out)?.iter().map(|(_, size)| size).sum::<u64>();
    let recorded = report.rows as f64 * values as f64;
    println!(
        "memory between {least:.1} and {most:.1} MB from {:.0} s on",
        seconds / LINES as f64
    );
    println!("{report:?}");
    println!(
        "{:.1} ms of CPU before the first tick, {:.1} ms after the last one",
        1e3 * begun,
        1e3 * ended
    );
    println!(
        "{values} values a tick: {:.2} Mvalue/s of CPU time, {:.2} bytes a value, {:.0} bytes a tick; {cpu:.2} s of CPU in {wall:.2} s",
        recorded * 1e-6 / cpu,
        bytes as f64 / recorded,
        bytes as f64 / report.rows as f64,
    );
    Ok(())
}

/// Recordings in the folder, in the order in which they were written.
fn sizes(out: &Path) -> std::io::Result<Vec<(std::path::PathBuf, u64)>> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(out)? {
        let (path, data) = (
            entry.as_ref().map(std::fs::DirEntry::path),
            entry.as_ref().map(std::fs::DirEntry::metadata),
        );
        if let (Ok(path), Ok(data)) = (path, data)
            && path.extension().is_some_and(|extension| extension == "rrd")
        {
            let data = data?;
            files.push((data.modified()?, path, data.len()));
        }
    }
    files.sort();
    Ok(files.into_iter().map(|(_, path, size)| (path, size)).collect())
}

/// Removes all but the two newest; the bytes that they had.
fn remove_finished(out: &Path) -> std::io::Result<u64> {
    let mut files = sizes(out)?;
    files.truncate(files.len().saturating_sub(2));
    files.iter().try_for_each(|(path, _)| std::fs::remove_file(path))?;
    Ok(files.iter().map(|(_, size)| size).sum())
}
