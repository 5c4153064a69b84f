"""Starts the robots of run.sh, waits for the results of each, and checks them."""
import argparse
import json
import math
import os
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time

ROBOTS = 4
SECONDS = 20  # each robot watches its neighbors, of its own time
NEEDED_CPU = 2.0  # of all robots, to live as fast as the world
MOST_SLOWER = 12
BUSY = 0.8  # of a robot's processor; with more, it falls behind
FIRST_S = 15  # when it must know each, at the latest
SHARE = 0.8  # of the poses of a robot that is in sight `direct`, of a hidden one `graph`
RANGES_M = {1: 5.0, 2: 8.0, 3: 12.4}  # in the simulated line, where robots move 0.6 m about their places
SKIPPED = 77  # the exit code by which automake and Meson know it, too
parser = argparse.ArgumentParser()
parser.add_argument("source", type=pathlib.Path)
parser.add_argument("build", type=pathlib.Path)
parser.add_argument("--busy", type=int, default=0, help="loops that run beside the robots")
options = parser.parse_args()
source, build = options.source, options.build


def links_of(robot, wires):
    """The ends of the wires at a robot, first those towards the preceding robots."""
    ends = []
    if robot > 1:
        ends.append(wires[robot - 2][1])
    if robot < ROBOTS:
        ends.append(wires[robot - 1][0])
    return ends


def start(robot, wires, place):
    """One user-mode Linux; its root is ours, read-only; it can write to `place`."""
    ends = links_of(robot, wires)
    command = ["linux.uml", "mem=384M", "root=/dev/root", "rootfstype=hostfs", "rootflags=/", "ro", f"uml_dir={place}/",
               f"umid=robot{robot}", f"init={source}/tests/mesh/robot.sh", "con=null", "con0=fd:0,fd:1"]
    command += [f"vec{i}:transport=fd,fd={end.fileno()},depth=128,mtu=1600,mac=02:00:00:00:{robot:02x}:{i:02x}"
                for i, end in enumerate(ends)]
    command += [f"SOURCE={source}", f"BUILD={build}", f"PLACE={place}", f"ROBOT={robot}", f"LINKS={len(ends)}",
                f"SECONDS_TO_WATCH={SECONDS}"]
    log = open(place / f"robot{robot}.log", "w")
    return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT,
                            start_new_session=True, pass_fds=[end.fileno() for end in ends])


def new_keys(place):
    """The swarm's key and one of each robot; their public keys."""
    public = {}
    for robot in range(1, ROBOTS + 1):
        made = subprocess.run([build / "daemon/crepesctl", "keygen", place / "mesh.key", place / f"r{robot}.key", "--json"], check=True, capture_output=True)
        public[robot] = json.loads(made.stdout)["public_key"]
    return public


def write_configurations(place):
    """The examples' robots in one line, on the mesh, sealed and signed, in a world that begins when all have started.

    Their cameras have a quarter of the pixels, 50 times a second instead of 200, and LED boards blink as much slower."""
    public = new_keys(place)
    for robot in range(1, ROBOTS + 1):
        text = (source / f"config/examples/four-simulated/r{robot}.yaml").read_text()
        replaced = {
            "interface: lo": f"interface: bat0, key_file: {place}/mesh.key, robot_key_file: {place}/r{robot}.key",
            "scenario: four": "scenario: line, epoch_s: EPOCH",
            "slot_ms: 10.0": "slot_ms: 40.0",
            "rate_hz: 200.0": "rate_hz: 50.0",
            "resolution: [1280, 1024]": "resolution: [640, 512]",
            "316.76, 316.66, 637.63, 512.69": "158.38, 158.33, 318.82, 256.35",
        }
        for member, key in public.items():
            replaced[f"name: r{member},"] = f'name: r{member}, public_key: "{key}",'
        for old, new in replaced.items():
            assert old in text, old
            text = text.replace(old, new)
        # Robots do not start at the time at which the world begins.
        text = re.sub(r"clock_offset_s: ([-\d.]+)", lambda offset: f"clock_offset_s: {1000 + float(offset[1])}", text)
        (place / f"r{robot}.yaml").write_text(text)


def await_files(pattern, robots, place):
    end = time.monotonic() + 120
    while len(list(place.glob(pattern))) < ROBOTS:
        if time.monotonic() > end or any(robot.poll() is not None for robot in robots):
            raise SystemExit("not all robots came up")
        time.sleep(0.1)


def tell(robots_what, text, place):
    (place / "part").write_text(text)
    (place / "part").rename(place / robots_what)


def cpu_s(robots):
    """Seconds of the processor that all robots have had; each is a process group."""
    groups, total = {robot.pid for robot in robots}, 0
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue  # has ended
        if int(fields[2]) in groups:
            total += int(fields[11]) + int(fields[12])
    return total / os.sysconf("SC_CLK_TCK")


def measured_slowness(robots, place):
    """How much slower than the world the robots must live on a machine that gives them so much of its processors."""
    await_files("*.up", robots, place)
    begin, before = time.monotonic(), cpu_s(robots)
    tell("work", "", place)
    await_files("*.worked", robots, place)
    given = (cpu_s(robots) - before) / (time.monotonic() - begin)
    print(f"the robots get {given:.2f} processors of the machine")
    return min(MOST_SLOWER, max(1, math.ceil(NEEDED_CPU / given)))


def begin_together(slower, place):
    """Sends the robots the time at which their world began, and how slowly it passes."""
    tell("begin", json.dumps({"at": time.time(), "slower": slower}), place)


def judge(robot, peer, found):
    """Whether a robot estimated another as expected: most of the time, in the right mode, near the truth.

    How many poses a second there are is compared with the ticks that the robot's processor gave it."""
    hops = abs(robot - peer)
    way = "direct" if hops == 1 else "graph"
    pair = found["peers"][str(peer)]
    poses = sum(pair["modes"].values())
    share = pair["modes"].get(way, 0) / poses
    rate_hz = poses / (SECONDS - pair["first_s"])
    best_hz = max(sum(each["modes"].values()) / (SECONDS - each["first_s"]) for each in found["peers"].values())
    good = (pair["first_s"] < FIRST_S and share > SHARE and rate_hz > 0.5 * best_hz
            and abs(pair["median_range_m"] - RANGES_M[hops]) < 1.5)
    print(f"{'ok    ' if good else 'FAILED'} robot {robot} knows robot {peer}, {hops} hop{'s' * (hops > 1)} away: first pose after "
          f"{pair['first_s']} s, then {rate_hz:.0f} a second, {100 * share:.0f} % {way}, {pair['median_range_m']} m away")
    return good


def can_run():
    """False where user-mode Linux cannot start any program, which its kernel shows by a panic."""
    with tempfile.TemporaryDirectory(prefix="crepes-mesh.") as place:
        tried = subprocess.run(["linux.uml", "mem=64M", "root=/dev/root", "rootfstype=hostfs", "rootflags=/", "ro", f"uml_dir={place}/",
                                "init=/bin/true", "con=null", "con0=null,fd:1"], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60)
    # Its init may not end, so that it panics in any case. The first line says why.
    return "ptrace set fp regs failed" not in tried.stdout


def fly(place, at_least):
    """What each robot found, and how much slower than the world it lived: at least so much."""
    wires = [socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM) for _ in range(ROBOTS - 1)]
    robots = [start(robot, wires, place) for robot in range(1, ROBOTS + 1)]
    try:
        slower = max(at_least, measured_slowness(robots, place))
        print(f"their time passes {slower} times slower")
        begin_together(slower, place)
        for robot in robots:
            robot.wait(SECONDS * slower + 60)
        return [json.loads((place / f"r{robot}.json").read_text()) for robot in range(1, ROBOTS + 1)], slower
    finally:
        for robot in robots:
            robot.kill()
        for end in (end for wire in wires for end in wire):
            end.close()


def failures_of(robot, found):
    """How much of what a robot found is not as expected."""
    print(f"robot {robot}: {found['originators']} others in the mesh, lost of what it sent {found['loss']}, "
          f"{found['cpu']:.2f} of a processor, {'all signed' if found['is_protected'] else 'FAILED: not all signed'}")
    failures = ROBOTS - 1 - len(found["peers"]) + (not found["is_protected"])
    failures += sum(not judge(robot, int(peer), found) for peer in sorted(found["peers"]))
    if found["exit"] != 0:
        print(f"FAILED crepesd of robot {robot} ended with {found['exit']}")
        failures += 1
    return failures


def new_place():
    """A folder with what the robots share."""
    place = pathlib.Path(tempfile.mkdtemp(prefix="crepes-mesh."))
    write_configurations(place)
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", source / "tests/mesh/slow_clock.c", "-o", place / "slow_clock.so", "-ldl"], check=True)
    for member in source.glob("systemd/mesh/50-*"):
        shutil.copy(member, place)
    return place


def attempt(at_least):
    """The failures of one flight, whether its robots had enough of the machine, and how slowly they lived."""
    place, failures = new_place(), None
    try:
        found, slower = fly(place, at_least)
        failures = sum(failures_of(robot, each) for robot, each in enumerate(found, start=1))
        return failures, max(each["cpu"] for each in found) < BUSY, slower
    finally:
        if failures != 0:
            for log in sorted(place.glob("*.log")):
                print(f"--- {log.name}\n{log.read_text()[-3000:]}")
        shutil.rmtree(place)


def main():
    if not can_run():
        print("SKIPPED: this processor has more registers than user-mode Linux can save (AMX); nothing was tested")
        sys.exit(SKIPPED)
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(options.busy)]
    try:
        failures, had_enough, slower = attempt(1)
        while failures and not had_enough and slower < MOST_SLOWER:
            print("the machine gave the robots too little: again, more slowly")
            failures, had_enough, slower = attempt(min(MOST_SLOWER, 2 * slower))
    finally:
        for loop in busy:
            loop.kill()
    print(f"{failures} failed" if failures else "robots two and three hops apart know each other")
    sys.exit(bool(failures))


main()
