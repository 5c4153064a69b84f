#!/usr/bin/env bash
# Swarms with faults over many seeds, one process a core; about six seconds a seed and core.
#   tests/faults/run.sh [SEEDS] [FIRST] [BUILD_DIRECTORY]
set -euo pipefail
source=$(cd "$(dirname "$0")/../.." && pwd)
seeds=${1:-200} first=${2:-1} build=${3:-$source/build/release}
cmake --build "$build" --target fault_campaign >/dev/null
cores=$(nproc)
part=$(((seeds + cores - 1) / cores))
pids=()
for ((core = 0; core < cores; core++)); do
  "$build/tests/fault_campaign" --first $((first + core * part)) --seeds "$part" &
  pids+=($!)
done
status=0
for pid in "${pids[@]}"; do wait "$pid" || status=1; done
exit $status
