"""Proves sweep.py on this machine: a server with two workers, killed while it works, and a second one; then compares bytes.

    python3 prove.py ANHYST [RUNS]
"""

import filecmp
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
SERVER = "import sys, time; from hyperqueue.cluster import LocalCluster, WorkerConfig; " \
    "cluster = LocalCluster(sys.argv[1], WorkerConfig(cores=1)); cluster.start_worker(WorkerConfig(cores=1)); time.sleep(3600)"
SHARDS = 6


def server(directory):
    """A server with its workers, in a group of its own."""
    directory.mkdir()
    started = subprocess.Popen([sys.executable, "-c", SERVER, directory], start_new_session=True, stdout=subprocess.DEVNULL)
    while not any(directory.rglob("access.json")):
        time.sleep(0.1)
    time.sleep(1)
    return started


def rows(folder):
    """Runs that are there."""
    return sum(path.read_bytes().count(b"\n") for path in folder.glob("part-*/rows.jsonl"))


def main():
    anhyst = str(Path(sys.argv[1]).resolve())
    runs = int(sys.argv[2]) if len(sys.argv) > 2 else 120
    os.chdir(HERE.parent.parent)
    # An even number of gains and seeds.
    command = [anhyst, "sweep", "scenarios/milling.ron", "--set", "duration_s=1.0",
               "--vary", "controller.feedback.kp=0.1..0.5:10", "--seeds", str(runs // 10)]
    with tempfile.TemporaryDirectory() as root:
        root = Path(root)
        subprocess.run([*command, "--out", root / "alone"], check=True, stdout=subprocess.DEVNULL)
        sweep = [sys.executable, HERE / "sweep.py"]
        out = root / "shared"
        first = server(root / "first")
        killed = subprocess.Popen([*sweep, root / "first", str(SHARDS), out, *command], start_new_session=True,
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while rows(out) < runs // 4:
            time.sleep(0.05)
        for process in (first, killed):
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        print(f"server and workers killed with {rows(out)} of {runs} runs")
        second = server(root / "second")
        try:
            subprocess.run([*sweep, root / "second", str(SHARDS), out, *command], check=True)
        finally:
            os.killpg(second.pid, signal.SIGKILL)
            second.wait()
        for table in ("sweep.csv", "sweep.parquet"):
            assert filecmp.cmp(root / "alone" / table, out / "whole" / table, shallow=False), f"{table} differs"
        print(f"{runs} runs in {SHARDS} shards: sweep.csv and sweep.parquet are the bytes of the sweep that one machine made")


if __name__ == "__main__":
    main()
