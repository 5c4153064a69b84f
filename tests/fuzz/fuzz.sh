#!/usr/bin/env bash
# Runs libFuzzer and keeps what it finds:
#   fuzz.sh [SECONDS [TARGET...]]         a minute each of all targets, unless given
#   RUNS=10000000 fuzz.sh 0 [TARGET...]   so many executions of each (0: no limit of time)
# By seconds it explores: long inputs, and comparisons that nearly hold count as progress. By runs it
# stays below 300 bytes, like the kept inputs, so that executions are fast.
# Needs libclang-rt-19-dev, which building and testing do not.
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-60}
targets=("${@:2}")

cmake --preset fuzz >/dev/null
cmake --build build/fuzz --target fuzz_corpus fuzz_target
programs=build/fuzz/tests/fuzz/libfuzzer
[ ${#targets[@]} -gt 0 ] || mapfile -t targets < <("$programs"/fuzz_corpus list)

# More than an input allocates; 256 MB, the default, are always cold.
export ASAN_OPTIONS=quarantine_size_mb=1:thread_local_quarantine_size_kb=64
limits=(-use_value_profile=1 -max_len=4096)
[ -z "${RUNS:-}" ] || limits=(-max_len=300)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for target in "${targets[@]}"; do
  echo "== $target"
  export CREPES_FUZZ_TARGET=$target CREPES_FUZZ_HISTORY=$work/history
  # A pair that goes on from input to input keeps memory that looks like a leak of one input.
  leaks=1
  [ "$target" != mesh ] || leaks=0
  "$programs"/fuzz_corpus unpack "$target" "$work/$target"
  "$programs/fuzz_target" -max_total_time="$seconds" -runs="${RUNS:--1}" -timeout=30 -rss_limit_mb=1024 \
    "${limits[@]}" -detect_leaks=$leaks -print_final_stats=1 -artifact_prefix="$work/" "$work/$target" 2>"$work/log" || {
    tail -40 "$work/log"
    cp "$work"/{crash,timeout,oom,leak}-* "$work/history" . 2>/dev/null || true
    exit 1
  }
  grep -E '^Done|^stat::(number|average)' "$work/log" || tail -1 "$work/log"
  # As few inputs as reach the same places.
  mkdir -p "$work/$target-kept"
  "$programs/fuzz_target" -merge=1 -max_len=300 "$work/$target-kept" "$work/$target" 2>/dev/null
  "$programs"/fuzz_corpus pack "$target" "$work/$target-kept"
  wc -lc "tests/fuzz/corpus/$target.hex"
done
