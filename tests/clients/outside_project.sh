#!/usr/bin/env bash
# Installs the client library from a build directory, and builds a project of users against what was installed.
#   outside_project.sh BUILD_DIRECTORY PROJECT INTO COMPILER [SANITIZERS [TOOLCHAIN_FILE]]
set -euo pipefail
build=$1 project=$2 into=$3 compiler=$4 sanitize=${5:-} toolchain=${6:-}
stage=$into/installed
# A copy: nothing of the project's own tree may be in reach.
rm -rf "$stage" "$into/project"
mkdir -p "$into"
cp -r "$project" "$into/project"
cmake --install "$build" --prefix "$stage" --component client >"$into/log"
options=(-DCMAKE_PREFIX_PATH="$stage" -DCMAKE_CXX_FLAGS="-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Werror${sanitize:+ -fsanitize=$sanitize}")
if [ -n "$toolchain" ]; then options+=(-DCMAKE_TOOLCHAIN_FILE="$toolchain" -DCMAKE_FIND_ROOT_PATH_MODE_PACKAGE=BOTH)
else options+=(-DCMAKE_CXX_COMPILER="$compiler"); fi
{ cmake -S "$into/project" -B "$into" "${options[@]}" && cmake --build "$into"; } >>"$into/log" 2>&1 ||
  { cat "$into/log"; exit 1; }
grep -q "crepes-client_DIR:PATH=$stage" "$into/CMakeCache.txt" || { echo "found another crepes-client than the installed one"; exit 1; }
