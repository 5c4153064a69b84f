#!/usr/bin/env bash
# A real BATMAN mesh of four robots in a line, each in a user-mode Linux with the files of systemd/mesh, delay and
# loss on every hop, and crepesd with simulated sensors. A robot sees only the next one; it must estimate those two and
# three hops away through the others. A minute, or some on a busy machine. Exit code 77: this machine cannot run it.
#   tests/mesh/run.sh [BUILD_DIRECTORY] [--busy LOOPS]
set -euo pipefail
source=$(cd "$(dirname "$0")/../.." && pwd)
exec /usr/bin/python3 -u "$source/tests/mesh/mesh_test.py" "$source" "$(realpath "${1:-$source/build/release}")" "${@:2}"
