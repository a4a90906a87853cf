#!/bin/bash
# Proves sweep.sh on this machine, as root: a Slurm of two virtual nodes, a killed task, one put back into the queue and a node
# that dies; then compares bytes with the sweep that one machine makes.
#
#     apt-get install --no-install-recommends slurm-wlm munge
#     prove.sh ANHYST [RUNS]
set -euo pipefail
anhyst=$(realpath "$1") runs=${2:-120} shards=6
here=$(cd "$(dirname "$0")" && pwd)
root=$(mktemp -d)
export SLURM_CONF=$root/slurm.conf
started=()
end() {
    for process in "${started[@]}"; do kill -9 "$process" 2>/dev/null || true; done
    rm -rf "$root"
}
trap end EXIT

# munge vouches for who submits; one that runs already is taken.
if ! munge -n >/dev/null 2>&1; then
    mkdir -p /run/munge && chown munge: /run/munge
    setpriv --reuid=munge --regid=munge --clear-groups /usr/sbin/munged --foreground >/dev/null 2>&1 & started+=($!)
    until munge -n >/dev/null 2>&1; do sleep 0.1; done
fi
host=$(hostname -s)
cat >"$SLURM_CONF" <<END
ClusterName=prove
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmUser=root
AuthType=auth/munge
StateSaveLocation=$root/state
SlurmdSpoolDir=$root/%n
SlurmctldPidFile=$root/slurmctld.pid
SlurmdPidFile=$root/%n.pid
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
SlurmdTimeout=10
ReturnToService=2
SchedulerParameters=batch_sched_delay=1,sched_interval=2
NodeName=one NodeHostname=$host NodeAddr=127.0.0.1 Port=16818 CPUs=1
NodeName=two NodeHostname=$host NodeAddr=127.0.0.1 Port=16819 CPUs=1
PartitionName=main Nodes=one,two Default=YES State=UP
END
mkdir "$root/state" "$root/one" "$root/two"
slurmctld -D -f "$SLURM_CONF" >"$root/slurmctld.log" 2>&1 & started+=($!)
node() { slurmd -D -N "$1" -f "$SLURM_CONF" >>"$root/$1.log" 2>&1 & started+=($!); }
node one
node two
two=$!
# Their ends are not worth a line.
disown -a
until [ "$(sinfo -h -t idle -o %D 2>/dev/null || true)" = 2 ]; do sleep 0.2; done

cd "$here/../.."
sweep=("$anhyst" sweep scenarios/milling.ron --set duration_s=1.0 --vary controller.feedback.kp=0.1..0.5:10 --seeds $((runs / 10)))
"${sweep[@]}" --out "$root/alone" >/dev/null
"$here/sweep.sh" $shards "$root/shared" "${sweep[@]}" & shared=$!
rows() { cat "$root"/shared/part-*/rows.jsonl 2>/dev/null | wc -l; }
reach() { until [ "$(rows)" -ge "$1" ]; do sleep 0.05; done; }
# The processes of this proof's shards, by their folder.
workers() { pgrep -f -- "--out $root/shared/part-"; }
running() { squeue -h -t running -o '%A %N' | awk -v node="$1" '$2 == node { print $1; exit }'; }

reach $((runs / 6))
task=$(running one)
scontrol requeue "$task"
echo "task $task put back into the queue with $(rows) of $runs runs"
reach $((runs / 3))
kill -9 "$(workers | head -1)"
echo "a task killed with $(rows) of $runs runs"
reach $((runs / 2))
kill -9 $two
workers | xargs -r kill -9
scontrol update nodename=two state=down reason=dead
echo "node two dead with $(rows) of $runs runs"
sleep 2
node two
disown %% 2>/dev/null || true
scontrol update nodename=two state=resume
wait $shared
for table in sweep.csv sweep.parquet; do cmp "$root/alone/$table" "$root/shared/whole/$table"; done
echo "$runs runs in $shards shards: sweep.csv and sweep.parquet are the bytes of the sweep that one machine made"
