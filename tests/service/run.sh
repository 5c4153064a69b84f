#!/usr/bin/env bash
# Installs the package on a copy of this machine, boots the copy with a real systemd in a container, and tests the
# service: kills, hangs, reloads, faulty files, removal. About a minute; needs root.
#   tests/service/run.sh [PACKAGE.deb]
# The copy is an overlay over / in memory: this machine is not changed. Its only network is its own loopback.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
source=$(cd "$here/../.." && pwd)
package=$(realpath "${1:-$(ls "$source"/build/release/crepes_*.deb)}")

[ "$(id -u)" -eq 0 ] || { echo "tests/service/run.sh: needs root, for a container" >&2; exit 1; }
place=$(mktemp -d /tmp/crepes-service.XXXXXX)
clean_up() {
  umount "$place/tree" "$place/memory" 2>/dev/null || true
  rmdir "$place/tree" "$place/memory" "$place"
}
trap clean_up EXIT
mkdir "$place/memory" "$place/tree"
mount -t tmpfs -o size=2G tmpfs "$place/memory"
mkdir "$place"/memory/{upper,work}
mount -t overlay -o "lowerdir=/,upperdir=$place/memory/upper,workdir=$place/memory/work" overlay "$place/tree"

# No service of this machine may start there; packages may start theirs.
rm -rf "$place"/tree/etc/systemd/system/* "$place/tree/usr/sbin/policy-rc.d" "$place/tree/var/log/journal"
mkdir "$place/tree/crepes"
cp "$package" "$place/tree/crepes/crepes.deb"
cp "$here"/*.py "$here"/*.umockdev "$source"/config/examples/four-simulated/r[12].yaml "$source"/systemd/*.md "$place/tree/crepes/"
cat >"$place/tree/etc/systemd/system/service-test.service" <<'UNIT'
[Unit]
Description=What happens to services
After=basic.target dbus.socket
SuccessAction=exit-force
FailureAction=exit-force
[Service]
Type=exec
ExecStart=/usr/bin/python3 -u /crepes/service_test.py
StandardOutput=file:/crepes/output
StandardError=inherit
TimeoutStartSec=infinity
UNIT

status=0
timeout --kill-after=10 300 systemd-nspawn --quiet --boot --directory="$place/tree" --private-network --register=no \
  --system-call-filter=@memlock --keep-unit --console=read-only --kill-signal=SIGRTMIN+4 systemd.unit=service-test.service systemd.show_status=false \
  </dev/null >"$place/tree/crepes/console" 2>&1 || status=$?
cat "$place/tree/crepes/output" || { cat "$place/tree/crepes/console"; exit 1; }
exit "$status"
