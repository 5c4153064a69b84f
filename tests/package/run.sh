#!/usr/bin/env bash
# Installs the package in a Debian made from nothing, uses it, upgrades it, removes and purges it, and looks at what stays.
# As root; some minutes, most of them for the Debian: not a part of CI.
#   tests/package/run.sh [PACKAGE.deb [DEBIAN_DIRECTORY]]      a directory that is there is used as it is, and kept
set -euo pipefail
source=$(cd "$(dirname "$0")/../.." && pwd)
package=$(realpath "${1:-$(ls "$source"/build/release/crepes_*.deb)}")
scratch=$(mktemp -d /tmp/crepes-package.XXXXXX)
tree=${2:-$scratch/debian}
step() { printf '\n== %s  (%s s)\n' "$*" "$SECONDS"; }
inside() { chroot "$tree" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C DEBIAN_FRONTEND=noninteractive "$@"; }
# Every file with its owner and mode; not what dpkg and its like write of themselves.
listing() {
  inside find / -xdev \( -path /proc -o -path /dev -o -path /var/lib/dpkg -o -path /var/lib/apt -o -path /var/cache -o -path /var/log \
    -o -path /tmp -o -path '/etc/*shadow*' -o -path '/etc/passwd*' -o -path '/etc/group*' -o -path /etc/.pwd.lock \) \
    -prune -o -printf '%p %u %g %m\n' | sort
}

if [ ! -e "$tree/etc/debian_version" ]; then
  step "a Debian"
  debootstrap --variant=minbase --include=ca-certificates bookworm "$tree" http://deb.debian.org/debian >"$scratch/debootstrap.log"
fi
mountpoint -q "$tree/proc" || mount -t proc proc "$tree/proc"
trap 'umount "$tree/proc"; rm -rf "$scratch"' EXIT
printf '#!/bin/sh\nexit 101\n' >"$tree/usr/sbin/policy-rc.d" && chmod 755 "$tree/usr/sbin/policy-rc.d"
cp "$package" "$tree/tmp/crepes.deb"

step "what the package depends on"
inside apt-get update -qq
inside apt-get satisfy -y -qq --no-install-recommends "$(dpkg-deb -f "$package" Depends), man-db, bash-completion" >"$scratch/apt.log" 2>&1 ||
  { tail "$scratch/apt.log"; exit 1; }
inside dpkg --purge crepes >/dev/null 2>&1 || true
rm -rf "$tree/etc/crepes"
listing >"$scratch/before"

step "install"
inside dpkg -i /tmp/crepes.deb
step "use"
inside crepesd --version
inside crepesctl --help >/dev/null
inside sh -c 'find /usr/share/doc/crepes/examples -name "r*.yaml" -path "*-*" -print0 | xargs -0 -n1 crepesd --check-config'
inside crepesd --check-config /usr/share/doc/crepes/examples/crepesd.yaml
for page in crepesd.8 crepesctl.1 crepesd.yaml.5; do
  [ "$(inside man --warnings "${page##*.}" "${page%.*}" 2>&1 | tee "$scratch/$page" | wc -l)" -gt 20 ] ||
    { cat "$scratch/$page"; echo "$page: no manual"; exit 1; }
  ! grep -E '.{81}' "$scratch/$page" || { echo "$page: wider than 80 columns"; exit 1; }
done
inside bash -c '. /usr/share/bash-completion/bash_completion; _completion_loader crepesctl; complete -p crepesctl' | grep -v _minimal
inside test -s /usr/share/zsh/vendor-completions/_crepesctl -a -s /usr/share/fish/vendor_completions.d/crepesctl.fish
inside id crepes
inside test -s /usr/include/crepes/client.hpp
inside sh -c 'test -s /usr/lib/*/libcrepes-client.a -a -s /usr/lib/*/cmake/crepes-client/crepes-client-config.cmake'

step "upgrade, remove, install again, purge"
inside dpkg -i /tmp/crepes.deb
inside sh -c 'echo "robot: {id: 1}" >/etc/crepes/crepesd.yaml'
inside dpkg --remove crepes
inside dpkg -i /tmp/crepes.deb
inside test -L /etc/systemd/system/multi-user.target.wants/crepesd.service
inside dpkg --purge crepes 2>&1
listing >"$scratch/after"

step "what stays"
# The robot's own file, and the user as Debian's policy has it; nothing else.
changed=$(diff "$scratch/before" "$scratch/after" | grep '^[<>]' || true)
expected='> /etc/crepes root root 755
> /etc/crepes/crepesd.yaml root root 644'
echo "$changed"
[ "$changed" = "$expected" ] || { echo "not what should: $expected" >&2; exit 1; }
echo "only the robot's own configuration stays"
