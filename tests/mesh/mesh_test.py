"""Starts the robots of run.sh, waits for the results of each, and checks them."""
import json
import pathlib
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time

ROBOTS = 4
SECONDS = 20  # each robot watches its neighbors
RANGES_M = {1: 5.0, 2: 8.0, 3: 12.4}  # in the simulated line, where robots move 0.6 m about their places
source, build = map(pathlib.Path, sys.argv[1:])


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
                            pass_fds=[end.fileno() for end in ends])


def write_configurations(place):
    """The examples' robots in one line, on the mesh, sealed, in a world that begins when all have started."""
    subprocess.run([build / "daemon/crepesctl", "keygen", place / "mesh.key"], check=True)
    for robot in range(1, ROBOTS + 1):
        text = (source / f"config/examples/four-simulated/r{robot}.yaml").read_text()
        assert "interface: lo" in text and "scenario: four" in text
        # Robots do not start at the time at which the world begins.
        text = re.sub(r"clock_offset_s: ([-\d.]+)", lambda offset: f"clock_offset_s: {1000 + float(offset[1])}", text)
        text = text.replace("interface: lo", f"interface: bat0, key_file: {place}/mesh.key").replace("scenario: four", "scenario: line, epoch_s: EPOCH")
        (place / f"r{robot}.yaml").write_text(text)


def begin_together(robots, place):
    """Sends the robots the time at which their world began, when all have joined the mesh."""
    end = time.monotonic() + 120
    while len(list(place.glob("*.up"))) < ROBOTS:
        if time.monotonic() > end or any(robot.poll() is not None for robot in robots):
            raise SystemExit("not all robots came up")
        time.sleep(0.1)
    (place / "begin.part").write_text(repr(time.time()))
    (place / "begin.part").rename(place / "begin")


def judge(robot, peer, pair):
    """Whether a robot estimated another as expected: most of the time, in the right mode, near the truth."""
    hops = abs(robot - peer)
    way = "direct" if hops == 1 else "graph"
    share = pair["modes"].get(way, 0) / sum(pair["modes"].values())
    rate_hz = sum(pair["modes"].values()) / (SECONDS - pair["first_s"])  # 50, all in the expected mode, if the machine is fast enough
    good = (pair["first_s"] < 15 and share > 0.5 and rate_hz > 10
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


def main():
    if not can_run():
        print("SKIPPED: this processor has more registers than user-mode Linux can save (AMX); nothing was tested")
        return
    place = pathlib.Path(tempfile.mkdtemp(prefix="crepes-mesh."))
    robots, failures = [], 0
    try:
        write_configurations(place)
        for member in source.glob("systemd/mesh/50-*"):
            shutil.copy(member, place)
        wires = [socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM) for _ in range(ROBOTS - 1)]
        robots = [start(robot, wires, place) for robot in range(1, ROBOTS + 1)]
        begin_together(robots, place)
        for robot in robots:
            robot.wait(SECONDS + 60)
        for robot in range(1, ROBOTS + 1):
            found = json.loads((place / f"r{robot}.json").read_text())
            print(f"robot {robot}: {found['originators']} others in the mesh, lost of what it sent {found['loss']}")
            for peer, pair in sorted(found["peers"].items()):
                failures += not judge(robot, int(peer), pair)
            failures += ROBOTS - 1 - len(found["peers"])
            if found["exit"] != 0:
                print(f"FAILED crepesd of robot {robot} ended with {found['exit']}")
                failures += 1
    finally:
        for robot in robots:
            robot.kill()
        if failures or sys.exc_info()[0]:
            for log in sorted(place.glob("*.log")):
                print(f"--- {log.name}\n{log.read_text()[-3000:]}")
        shutil.rmtree(place)
    print(f"{failures} failed" if failures else "robots two and three hops apart know each other")
    sys.exit(bool(failures))


main()
