//! Where the documentation's commands are run. What stands in a block `sh run` runs in the gate (`what_is_marked_runs`), any other in
//! `.ci/nightly`, page by page in a folder of its own, unless `NOT_RUN` has it with the reason. A command is named by its page and its beginning.

const OPEN_LOOP: &str =
    "anhyst run scenarios/piezo/open_loop.ron --embedded --out runs/open && anhyst export runs/open";
const ROUGH: &str = "anhyst run scenarios/rough.ron --embedded --out runs/rough && anhyst export runs/rough";
const VENV: &str = "python3 -m venv venv && venv/bin/pip install -q -r examples/amplifier-python/requirements.txt";

/// What a page's commands need before them: what the reader has, or what the page says in words.
pub const BEFORE: [(&str, &[&str]); 11] = [
    (
        "README.md",
        &[OPEN_LOOP, "sed s/voltage_V/v_in_V/ runs/open/run.csv > MEASURED.csv"],
    ),
    ("docs/control.md", &[ROUGH, "cp runs/rough/run.csv run.csv"]),
    ("docs/diagnose.md", &[ROUGH, "cp runs/rough/run.csv RUN.csv"]),
    (
        "docs/fit.md",
        &[
            "cp $ANHYST_SHARED/data/*/{mnzn_ferrite_4amp,terfenol_d_H_B_strain}.csv .",
            "cp mnzn_ferrite_4amp.csv loops.csv",
        ],
    ),
    (
        "docs/hysteresis.md",
        &[
            OPEN_LOOP,
            "cp runs/open/model.ron law.ron",
            "for name in DATA OTHER run; do cp runs/open/run.csv $name.csv; done",
            "ln -s $ANHYST_SHARED/data FOLDER",
        ],
    ),
    (
        "docs/python.md",
        &[
            "python3 -m venv maker && maker/bin/pip install -q maturin",
            "cp $REPOSITORY/target/release/libanhyst_fmu.so $REPOSITORY/python/anhyst/",
            "maker/bin/maturin build --release --manifest-path $REPOSITORY/python/Cargo.toml --out wheels",
        ],
    ),
    ("docs/realtime.md", &[VENV]),
    (
        "docs/running.md",
        &["anhyst run scenarios/milling.ron --out runs/milling-20261121-210226"],
    ),
    (
        "docs/start/magnet.md",
        &["cp $ANHYST_SHARED/data/soft_magnetics_szewczyk/mnzn_ferrite_4amp.csv LOOPS.csv"],
    ),
    (
        "docs/start/piezo.md",
        &[
            OPEN_LOOP,
            "awk -F, 'NR == 1 {print \"t_s,v_in_V,disp_um\"} NR > 1 {print $1\",\"$2\",\"$3 * 1e6}' runs/open/run.csv > DATA.csv",
        ],
    ),
    (
        "docs/start/simulink.md",
        &[
            "cp examples/amplifier-python/*.py . && mv amplifier.py driver.py",
            VENV,
            ". venv/bin/activate",
        ],
    ),
];

/// What ends with another status than 0, as its page says; in real time how late the machine is decides.
pub const STATUS: [(&str, &str, &[i32]); 14] = [
    (
        "docs/control.md",
        "anhyst run scenarios/milling.ron --no-recording --set 'plant.effects",
        &[1],
    ),
    (
        "docs/control.md",
        "anhyst run scenarios/diagnosed.ron --embedded --no-recording --set 'plant.effects",
        &[1],
    ),
    // The same rig with the plant as it is believed to be is held.
    (
        "docs/control.md",
        "anhyst run scenarios/milling_rough.ron --set controller.learning=None --set 'plant.effects",
        &[0],
    ),
    (
        "docs/control.md",
        "anhyst run scenarios/milling_rough.ron --set controller.learning=None",
        &[1],
    ),
    (
        "docs/fit.md",
        "anhyst fit mnzn_ferrite_4amp.csv --column 'field=H_A_per_m*1000'",
        &[2],
    ),
    (
        "docs/paper-notes.md",
        "anhyst run scenarios/milling.ron --embedded --no-recording --set 'plant.shape=Ramp(",
        &[1],
    ),
    (
        "docs/safety.md",
        "anhyst run scenarios/milling.ron --embedded --set duration_s=0.4",
        &[1],
    ),
    (
        "docs/scenarios.md",
        "anhyst run scenarios/milling_parameters.ron --embedded --no-recording --set 'estimator.law=Folded()'",
        &[1],
    ),
    (
        "docs/scenarios.md",
        "anhyst run scenarios/milling.ron --embedded --no-recording --set 'estimator.field=Measured(",
        &[1],
    ),
    (
        "docs/scenarios.md",
        "anhyst run scenarios/milling_rough.ron --embedded --set expect.settling_s=0.2 --out runs/first",
        &[1],
    ),
    (
        "docs/scenarios.md",
        "anhyst run scenarios/milling_heavy.ron --embedded --no-recording --set controller.learning=None",
        &[1],
    ),
    (
        "docs/scenarios.md",
        "anhyst run scenarios/milling_rough.ron --embedded --no-recording --set 'controller.trajectory=Triangle(",
        &[1],
    ),
    (
        "docs/scenarios.md",
        "anhyst check scenarios/milling.ron --set controller.feedback.kp=3",
        &[2],
    ),
    ("docs/start/terfenol.md", "anhyst new more --stroke 300um", &[2]),
];

const GATE: &str = "is the gate";
const PATTERN: &str = "is a pattern, for the reader to fill in";
const TWO_HOSTS: &str = "needs two hosts, or a build with the bridge, which has tests of its own";
const HARDWARE: &str = "needs a board";
const BY_HAND: &str = "is a script apart, for what it needs";
const WINDOW: &str = "opens a window, or waits for somebody";
const TERMINALS: &str = "needs a terminal each: tests start the processes";

/// What neither the gate nor the nightly script runs, and why.
pub const NOT_RUN: [(&str, &str, &str); 25] = [
    ("README.md", "cargo test --release --workspace", GATE),
    ("docs/bridge.md", "", TWO_HOSTS),
    (
        "docs/control.md",
        "anhyst commission scenarios/milling_rough.ron --out runs/rough-SEED",
        PATTERN,
    ),
    (
        "docs/data.md",
        "ANHYST_BROKEN_FILES=100000",
        "a part of `.ci/nightly` for itself",
    ),
    (
        "docs/drivers.md",
        "cargo build --release -p anhyst-amplifier-hardware",
        HARDWARE,
    ),
    ("docs/drivers.md", "anhyst run SCENARIO", HARDWARE),
    (
        "docs/drivers.md",
        "anhyst run scenarios/milling.ron --external amplifier",
        WINDOW,
    ),
    ("docs/drivers.md", "ANHYST_PROCESS=", PATTERN),
    ("docs/estimate.md", "anhyst estimate", PATTERN),
    ("docs/fit.md", "anhyst fit loops.csv", PATTERN),
    ("docs/gallery.md", "grep", "runs the page's commands, which are run"),
    (
        "docs/python.md",
        "cargo build --release -p anhyst-fmu",
        "runs before the page's other commands, which need the wheel",
    ),
    (
        "docs/python.md",
        "maturin build",
        "runs before the page's other commands, which need the wheel",
    ),
    ("docs/realtime.md", "anhyst replay", PATTERN),
    ("docs/running.md", "anhyst node", TERMINALS),
    ("docs/running.md", "anhyst view", WINDOW),
    (
        "docs/speed.md",
        "perf",
        "needs the kernel's counters, and somebody who reads",
    ),
    ("docs/speed.md", ".ci/aarch64", BY_HAND),
    ("docs/speed.md", "for i in", "keeps the cores busy for ever"),
    ("docs/study.md", "anhyst study blind --out", "takes a night of its own"),
    ("docs/sweep.md", "anhyst sweep S.ron", PATTERN),
    ("docs/sweep.md", "anhyst gather", PATTERN),
    ("docs/sweep.md", "examples/sweep-slurm", BY_HAND),
    ("docs/sweep.md", "python3 examples/sweep-hyperqueue", BY_HAND),
    (
        "docs/verify-amplifier.md",
        "anhyst verify-amplifier --out runs/my-amplifier",
        WINDOW,
    ),
];

pub fn before(page: &str) -> &'static [&'static str] {
    BEFORE.iter().find(|row| row.0 == page).map_or(&[], |row| row.1)
}

pub fn statuses(page: &str, command: &str) -> &'static [i32] {
    let row = STATUS.iter().find(|row| row.0 == page && command.starts_with(row.1));
    row.map_or(&[0], |row| row.2)
}

pub fn not_run(page: &str, command: &str) -> Option<&'static str> {
    let row = NOT_RUN.iter().find(|row| row.0 == page && command.starts_with(row.1));
    row.map(|row| row.2)
}
