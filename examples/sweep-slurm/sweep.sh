#!/bin/sh
# A sweep as a Slurm job array, gathered when all shards are there; what failed is submitted again, what is complete ends at once.
#
#     sweep.sh SHARDS FOLDER anhyst sweep SCENARIO --vary … --seeds …
set -eu
shards=$1 folder=$2
shift 2
mkdir -p "$folder"
here=$(cd "$(dirname "$0")" && pwd)
for round in 1 2 3 4 5; do
    sbatch --wait --quiet --array="1-$shards" --output="$folder/part-%a.log" "$here/sweep.sbatch" "$folder" "$@" || true
    if "$1" gather "$folder"/part-*/ --out "$folder/whole"; then exit 0; fi
done
exit 1
