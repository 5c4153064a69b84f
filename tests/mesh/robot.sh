#!/bin/sh
# init of one robot in mesh_test.py: mounts, kernel modules, the mesh by systemd-networkd, netem, then robot.py.
# Environment, from the kernel's command line: SOURCE BUILD PLACE ROBOT LINKS SECONDS_TO_WATCH
export PATH=/usr/sbin:/usr/bin:/sbin:/bin
mount -t proc proc /proc && mount -t sysfs sysfs /sys && mount -t tmpfs tmpfs /run
mkdir -p /dev/pts /run/place /run/modules/lib /run/systemd/network
mount -t devpts devpts /dev/pts && mount -t hostfs none /run/place -o "$PLACE"

ln -s /usr/lib/uml/modules /run/modules/lib/modules
modprobe -d /run/modules batman-adv && modprobe -d /run/modules sch_netem

# Differs on real robots, too; the address of bat0 is derived from it.
printf '%032x\n' "$((0x1000 + ROBOT))" >/run/machine-id
mount --bind /run/machine-id /etc/machine-id

# The files as shipped; a second radio needs a file like the first.
cp /run/place/50-* /run/systemd/network/
sed 's/wlan0/wlan1/' /run/place/50-mesh-wlan0.network >/run/systemd/network/50-mesh-wlan1.network
link=0
while [ "$link" -lt "$LINKS" ]; do
  ip link set "vec$link" name "wlan$link"
  tc qdisc add dev "wlan$link" root netem delay 2ms 1ms loss 10%
  link=$((link + 1))
done
ip link set lo up
mount -o remount,ro /sys  # so that networkd does not wait for udev
/lib/systemd/systemd-networkd &

/usr/bin/python3 -u "$SOURCE/tests/mesh/robot.py"
poweroff -f
