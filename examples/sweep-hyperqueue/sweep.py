"""The shards of a sweep as tasks of a HyperQueue server, gathered when all of them are there.

    pip install hyperqueue==0.27.0
    python3 sweep.py SERVER_DIRECTORY SHARDS FOLDER anhyst sweep SCENARIO --vary … --seeds …

SERVER_DIRECTORY is that of a running server (`hq server start` makes ~/.hq-server), FOLDER one that all workers see. A task whose
worker dies is given to another one, where the shard goes on with the runs that it has not got; what failed is submitted again.
"""

import subprocess
import sys
from pathlib import Path

from hyperqueue import Client, Job

ROUNDS = 5


def submit(client, shards, folder, command):
    """Runs all shards; one that is complete ends at once."""
    job = Job(max_fails=None, default_workdir=Path.cwd(), name="sweep")
    for shard in range(1, shards + 1):
        part = [*command, "--shard", f"{shard}/{shards}", "--threads", "1", "--out", str(folder / f"part-{shard}")]
        log = str(folder / f"part-{shard}.log")
        job.program(part, stdout=log, stderr=log, crash_limit=10)
    return client.wait_for_jobs([client.submit(job)], raise_on_error=False)


def main():
    server, shards, folder, *command = sys.argv[1:]
    shards, folder = int(shards), Path(folder).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    gather = [command[0], "gather", *(str(folder / f"part-{shard}") for shard in range(1, shards + 1))]
    for _ in range(ROUNDS):
        submit(Client(server), shards, folder, command)
        if subprocess.run([*gather, "--out", str(folder / "whole")]).returncode == 0:
            return 0
    return 1


if __name__ == "__main__":
    sys.exit(main())
