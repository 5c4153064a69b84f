#!/usr/bin/env bash
# Four crepesd processes localize each other live.  ./demo.sh [--for SECONDS] [...]
#   ./demo.sh --scenario formation     three robots hold a triangle by the poses that they get
set -euo pipefail
cd "$(dirname "$0")"
. .ci/setup.sh

install_packages
build release crepesd crepesctl
case " $* " in
  *" --run "*) ;;
  *" --scenario formation "* | *" --scenario=formation "*)
    export PYTHONPATH=$PWD/config/examples/clients/python
    set -- "$@" --run config/examples/clients/python/examples/formation.py
    ;;
esac
exec build/release/daemon/crepesctl demo "$@"
