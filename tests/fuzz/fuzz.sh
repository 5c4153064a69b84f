#!/usr/bin/env bash
# Runs libFuzzer and keeps what it finds:  fuzz.sh [SECONDS [TARGET...]]  (default: a minute each of all)
# Needs clang (Debian: clang, libclang-rt-14-dev), which building and testing do not.
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-60}
targets=("${@:2}")

cmake --preset fuzz >/dev/null
cmake --build build/fuzz --target fuzz_corpus $(ninja -C build/fuzz -t targets all | sed -n 's/^\(fuzz_[a-z_]*\): phony$/\1/p')
programs=build/fuzz/tests/fuzz/libfuzzer
[ ${#targets[@]} -gt 0 ] ||
  mapfile -t targets < <(find "$programs" -maxdepth 1 -name 'fuzz_*' -type f -printf '%f\n' | sed 's/^fuzz_//' | grep -v '^corpus$' | sort)

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for target in "${targets[@]}"; do
  echo "== $target"
  "$programs"/fuzz_corpus unpack "$target" "$work/$target"
  "$programs/fuzz_$target" -max_total_time="$seconds" -timeout=5 -rss_limit_mb=1024 -use_value_profile=1 \
    -max_len=4096 -artifact_prefix="$work/" "$work/$target" 2>"$work/log" || {
    tail -40 "$work/log"
    cp "$work"/{crash,timeout,oom,leak}-* . 2>/dev/null || true
    exit 1
  }
  grep -E '^Done|^stat::' "$work/log" || tail -1 "$work/log"
  # As few inputs as reach the same places.
  mkdir -p "$work/$target-kept"
  "$programs/fuzz_$target" -merge=1 -max_len=300 "$work/$target-kept" "$work/$target" 2>/dev/null
  "$programs"/fuzz_corpus pack "$target" "$work/$target-kept"
  wc -lc "tests/fuzz/corpus/$target.hex"
done
