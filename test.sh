#!/usr/bin/env bash
# Installs what is missing, builds, and runs all tests.  ./test.sh [arguments for ctest]
set -euo pipefail
cd "$(dirname "$0")"
. .ci/setup.sh

install_packages
build release
step "test"
ctest --preset release -j2 "$@"
