"""Tests the package's service with a real systemd. Run by run.sh as a unit in a container."""
import os
import pathlib
import re
import signal
import subprocess
import sys
import time
import urllib.request

from subscriber import Subscriber

CONFIG = pathlib.Path("/etc/crepes/crepesd.yaml")
# With the default socket for recordings.
FIRST = re.sub(r"(?m)^recording:.*\n?", "", pathlib.Path("/crepes/r1.yaml").read_text())
NEIGHBOR = 2

failures = []


def check(claim, holds, measured=""):
    print(f"{'ok    ' if holds else 'FAILED'} {claim}{f': {measured}' if measured != '' else ''}")
    if not holds:
        failures.append(claim)


def run(*command):
    return subprocess.run(command, capture_output=True, text=True)


def shown(name):
    return run("systemctl", "show", "-P", name, "crepesd").stdout.strip()


def pid():
    return int(shown("MainPID"))


def awaited(holds, seconds=30.0):
    """Whether the condition becomes true, and after how many seconds."""
    begin = time.monotonic()
    while time.monotonic() - begin < seconds:
        if holds():
            return True, time.monotonic() - begin
        time.sleep(0.01)
    return False, seconds


def comes_back(subscriber, what, harm, limit_s):
    """Damages the daemon and measures the time until a new one publishes the neighbor's pose."""
    before = pid()
    subscriber.drain()
    begin = time.monotonic()
    harm(before)
    replaced, _ = awaited(lambda: pid() not in (0, before) and shown("ActiveState") == "active")
    subscriber.drain()  # poses of the old one
    _, came = subscriber.pose(NEIGHBOR)
    seconds = came - begin if came else float("inf")
    check(f"{what}, it is back with a pose within {limit_s} s", replaced and seconds < limit_s, f"{seconds:.2f} s")


def install():
    installed = run("dpkg", "-i", "/crepes/crepes.deb")
    check("the package installs", installed.returncode == 0, installed.stderr.strip())
    check("the user is there, and cannot log in", "nologin" in run("getent", "passwd", "crepes").stdout)
    check("systemd finds no fault with the unit", run("systemd-analyze", "verify", "--man=no", "crepesd.service").stderr == "")
    check("the service is enabled", run("systemctl", "is-enabled", "crepesd").stdout.strip() == "enabled")
    check("it waits for a configuration", shown("ActiveState") == "inactive" and shown("ConditionResult") == "no")


def udev_says(device, parent="pci0000:00/0000:00:14.0/usb1"):
    """The result of udev for a device of devices.umockdev that is connected."""
    path = f"/sys/devices/{parent}/{device}"
    return run("umockdev-run", "--device=/crepes/devices.umockdev", "--", "udevadm", "test", "--action=add", path)


def device_rules():
    module = udev_says("1-3/1-3:1.0/tty/ttyACM0")
    reported = module.stdout + module.stderr
    check("udev finds no fault with the rules", not re.search(r"70-crepes\.rules:\d+ (?!GROUP|MODE|ATTR|LINK|RUN)", reported))
    check("the UWB module has a name, and is the seat's", "DEVLINKS=/dev/crepes/uwb" in reported and ":uaccess:" in reported)
    named = pathlib.Path("/etc/udev/rules.d/69-crepes.rules")
    named.write_text('SUBSYSTEM=="tty", KERNEL=="ttyACM0", ENV{CREPES_NAMED}="1", SYMLINK+="crepes/imu"\n')
    check("an administrator's name is the only one", "DEVLINKS=/dev/crepes/imu\n" in udev_says("1-3/1-3:1.0/tty/ttyACM0").stdout)
    named.unlink()
    for device, kind in (("1-1", "MindVision"), ("1-2", "USB3 Vision")):
        camera = udev_says(device)
        check(f"a camera ({kind}) has a name, belongs to the group, and stays awake",
              "DEVLINKS=/dev/crepes/camera" in camera.stdout and re.search(r"70-crepes.rules:\d+ GROUP", camera.stderr)
              and "power/control' writing 'on'" in camera.stderr)
    imu = udev_says("iio:device0", "platform/spi0.0")
    check("the group may set up an IMU of the kernel, and no converter",
          re.search(r"70-crepes.rules:\d+ GROUP", imu.stderr) and "chgrp crepes" in imu.stdout
          and "chgrp" not in udev_says("iio:device1", "platform/adc0").stdout)
    check("an FTDI bridge does not hold bytes back", "latency_timer' writing '1'" in udev_says("1-4/1-4:1.0/ttyUSB0").stderr)


def follow(page, only=""):
    """Runs the commands of a document as they stand, of blocks with `only` in them. Returns what they print."""
    blocks = [block for block in re.findall(r"^```\n(.*?)^```", pathlib.Path(page).read_text(), re.MULTILINE | re.DOTALL) if only in block]
    done = run("bash", "-euc", 'sudo() { "$@"; }; cd /crepes\n' + "".join(blocks))
    check(f"the steps of {page} succeed", blocks and done.returncode == 0, done.stderr.strip())
    return done.stdout


def documented_steps():
    """Installs the example of two robots, without devices and mesh, and gives both robots of the test a key."""
    follow("/crepes/README.md")
    reported, _ = awaited(lambda: all(missing in shown("StatusText") for missing in ("/dev/crepes/imu", "/dev/crepes/uwb", "bat0: no such interface")), 5.0)
    check("the example runs without devices and names them", reported and shown("ActiveState") == "active", shown("StatusText"))
    printed = follow("/crepes/MESH.md", only="keygen")
    neighbor = pathlib.Path("/crepes/r2.d")
    neighbor.mkdir()
    (neighbor / "20-key.yaml").write_text(pathlib.Path("/etc/crepes/crepesd.d/20-key.yaml").read_text())
    run("systemctl", "stop", "crepesd")
    CONFIG.unlink()
    return printed.splitlines()[0].split()[-1]


def faulty_configuration():
    CONFIG.write_text(FIRST.replace("rate_hz:", "rate_herz:"))
    started = run("systemctl", "start", "crepesd")
    reported = run("systemctl", "status", "--full", "crepesd").stdout
    check("a faulty configuration fails the start", started.returncode != 0)
    check("`systemctl status` names file, line and key", re.search(r"crepesd\.yaml:\d+.*rate_herz", reported) is not None)
    time.sleep(1.0)  # ten times RestartSec
    check("and it is not tried again", shown("ActiveState") == "failed" and shown("NRestarts") == "0", shown("NRestarts"))


def start(subscriber, key):
    CONFIG.write_text(FIRST)
    begin = time.monotonic()
    started = run("systemctl", "start", "crepesd")
    check("it starts and says that it is ready within 2 s", started.returncode == 0 and time.monotonic() - begin < 2.0,
          f"{time.monotonic() - begin:.2f} s")
    _, came = subscriber.pose(NEIGHBOR)
    check("it finds its neighbor within 10 s", came is not None and came - begin < 10.0, f"{came - begin:.2f} s" if came else "")
    reported, _ = awaited(lambda: "1 of 3 neighbors located (r3: never heard" in shown("StatusText"), 5.0)
    check("it says in one line how it is", reported, shown("StatusText"))
    status = pathlib.Path(f"/proc/{pid()}/status").read_text()
    owner = run("id", "-u", "crepes").stdout.strip()
    check("it runs as user crepes without capabilities",
          f"Uid:\t{owner}\t{owner}" in status and re.search(r"CapEff:\s+0+\n", status) is not None)
    limits = pathlib.Path(f"/proc/{pid()}/limits").read_text()
    check("it writes no core file, which would have its keys", re.search(r"Max core file size\s+0\s+0\s", limits) is not None, limits)
    locked = re.search(r"VmLck:\s+(\d+) kB", status)
    check("its key is locked into memory", locked is not None and int(locked.group(1)) >= 4, locked)
    policies = {os.sched_getscheduler(int(thread)) for thread in os.listdir(f"/proc/{pid()}/task")}
    check("all its threads are real-time", policies == {os.SCHED_FIFO}, policies)
    journal = run("journalctl", "-o", "short", "-t", "crepesd").stdout
    check("its messages are in the journal", "running with" in journal)
    check("it seals what it sends its neighbor", f"sealed with the key {key}" in journal)
    score = run("systemd-analyze", "security", "--no-pager", "crepesd").stdout.strip().splitlines()
    check("systemd calls it well confined", run("systemd-analyze", "security", "--threshold=15", "crepesd").returncode == 0,
          score[-1].lstrip("→ ") if score else "")


def reloading(subscriber):
    before = pid()
    CONFIG.write_text(FIRST + "log: {level: debug}\n")
    done = run("systemctl", "reload", "crepesd")
    check("a reload is accepted", done.returncode == 0, done.stderr.strip())
    check("by the same process, which is ready again", awaited(lambda: shown("ActiveState") == "active")[0] and pid() == before)
    subscriber.drain()
    check("and it goes on with poses", subscriber.pose(NEIGHBOR, 2.0)[0] is not None)
    CONFIG.write_text(FIRST.replace("seed: 1", "seed: 2"))
    run("systemctl", "reload", "crepesd")
    reported, _ = awaited(lambda: "restart to apply: sim" in shown("StatusText"), 5.0)
    check("what needs a restart is reported", reported, shown("StatusText"))
    CONFIG.write_text(FIRST.replace("noise_m: 0.05", "noise_m: -1"))
    check("a faulty file fails the reload", run("systemctl", "reload", "crepesd").returncode != 0)
    run("systemctl", "kill", "--signal=HUP", "crepesd")  # past the check of the unit
    subscriber.drain()
    check("and changes nothing", subscriber.pose(NEIGHBOR, 2.0)[0] is not None and pid() == before)
    reported, _ = awaited(lambda: "reload refused" in shown("StatusText") and "noise_m" in shown("StatusText"), 5.0)
    check("but is reported", reported, shown("StatusText"))
    CONFIG.write_text(FIRST)
    run("systemctl", "reload", "crepesd")
    for _ in range(10):  # longer than WatchdogSec
        run("systemctl", "kill", "--signal=HUP", "crepesd")
        time.sleep(0.5)
    check("reloads one after the other do not end it", pid() == before, shown("Result"))


def recording():
    done = run("crepesctl", "record", "/tmp/recording", "--duration", "1")
    rows = sum(path.read_text().count("\n") for path in pathlib.Path("/tmp/recording").rglob("*.csv"))
    check("what it measures can be recorded", done.returncode == 0 and rows > 200, f"{rows} rows {done.stderr.strip()}")


def page():
    """The page's service: off after installation, and when it is started it shows what the daemon sends."""
    check("the page is not served by default", run("systemctl", "is-enabled", "crepes-view").stdout.strip() == "disabled")
    run("systemctl", "start", "crepes-view")

    def frame_comes():
        try:
            with urllib.request.urlopen("http://127.0.0.1:8080/events?robot=0", timeout=5) as stream:
                return any(stream.readline() == b"event: frame\n" for _ in range(200))
        except OSError:
            return False
    served, seconds = awaited(frame_comes, 15.0)
    state = run("systemctl", "status", "--no-pager", "crepes-view").stdout
    check("when started, it shows the neighbor", served, f"{seconds:.2f} s" if served else state)


def page_with_camera():
    """Pictures come, and the sliders write through the daemon's reload, though the page's service may write nowhere else."""
    CONFIG.write_text(CONFIG.read_text() + "view: {control: true}\n")
    run("systemctl", "reload", "crepesd")
    address = "http://127.0.0.1:8080"
    light = urllib.request.Request(f"{address}/light?robot=0&camera=0&exposure_us=321", method="POST", headers={"Origin": address})
    try:
        with urllib.request.urlopen(f"{address}/camera?robot=0&camera=0", timeout=10) as stream:
            pictured = any(stream.readline() == b"event: picture\n" for _ in range(200))
            check("its camera panel shows pictures", pictured)
            changed = urllib.request.urlopen(light, timeout=10).status
            in_force = any(b'"exposure_us":321' in stream.readline() for _ in range(400))
            check("its sliders change the light", changed == 200 and in_force)
    except OSError as error:
        check("its sliders change the light", False, f"{error} {getattr(error, 'read', lambda: b'')()}")
    check("by a fragment", "321" in pathlib.Path("/etc/crepes/crepesd.d/90-exposure.yaml").read_text())
    mode = os.stat("/run/crepes").st_mode & 0o777
    check("the group may show the page a calibration's coverage", mode == 0o770, oct(mode))


def stop():
    begin = time.monotonic()
    run("systemctl", "stop", "crepesd")
    seconds = time.monotonic() - begin
    check("it stops within 1 s, by itself", seconds < 1.0 and shown("Result") == "success", f"{seconds:.2f} s")


def remove():
    run("systemctl", "start", "crepesd")
    run("systemctl", "enable", "crepes-view")
    check("the package is removed from under the running service", run("dpkg", "--purge", "crepes").returncode == 0)
    check("which stops", not awaited(lambda: shown("ActiveState") == "active", 0.1)[0])
    left = [path for path in ("/lib/systemd/system/crepesd.service", "/lib/systemd/system/crepes-view.service", "/etc/systemd/system/crepesd.service",
                              "/etc/systemd/system/multi-user.target.wants/crepesd.service",
                              "/etc/systemd/system/multi-user.target.wants/crepes-view.service", "/usr/bin/crepesd")
            if os.path.lexists(path)]
    check("and leaves nothing but the robot's own file", not left and CONFIG.exists(), left)


def main():
    install()
    device_rules()
    key = documented_steps()
    neighbor = subprocess.Popen(["/usr/bin/crepesd", "--config", "/crepes/r2.yaml"], stderr=subprocess.DEVNULL)
    subscriber = Subscriber()
    faulty_configuration()
    start(subscriber, key)
    comes_back(subscriber, "killed", lambda process: os.kill(process, signal.SIGKILL), 3.0)
    comes_back(subscriber, "hung", lambda process: os.kill(process, signal.SIGSTOP), 3.0 + 3.0)  # WatchdogSec and as above
    reloading(subscriber)
    recording()
    page()
    page_with_camera()
    stop()
    neighbor.terminate()
    neighbor.wait()
    journal = run("journalctl", "--no-pager", "-o", "short-monotonic", "-u", "crepesd", "-n", "80").stdout
    remove()
    if failures:
        print(journal)
    print(f"{len(failures)} failed" if failures else "the service does what it should")
    sys.exit(bool(failures))


main()
