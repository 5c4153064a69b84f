#!/usr/bin/env bash
# Swarms with faults over many seeds, one process a core; at the end the table of all kinds.
#   tests/faults/run.sh [SEEDS] [FIRST] [BUILD_DIRECTORY] [OPTIONS OF fault_campaign...]
set -euo pipefail
source=$(cd "$(dirname "$0")/../.." && pwd)
seeds=${1:-200} first=${2:-1} build=${3:-$source/build/release}
options=("${@:4}")
cmake --build "$build" --target fault_campaign >/dev/null
cores=$(nproc)
logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT
pids=()
for ((core = 0; core < cores; core++)); do
  "$build/tests/fault_campaign" --first "$first" --seeds "$seeds" --part "$core" --parts "$cores" \
    --log "$logs/$core" "${options[@]}" &
  pids+=($!)
done
status=0
for pid in "${pids[@]}"; do wait "$pid" || status=1; done
"$build/tests/fault_campaign" --table "$logs"/*
exit $status
