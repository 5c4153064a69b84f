#!/usr/bin/env bash
# Four crepesd processes localize each other live.  ./demo.sh [--for SECONDS] [...]
set -euo pipefail
cd "$(dirname "$0")"
. .ci/setup.sh

install_packages
build release crepesd crepesctl
exec build/release/daemon/crepesctl demo "$@"
