"""One robot of mesh_test.py, inside its own Linux: waits for the mesh, runs crepesd, records the results."""
import collections
import json
import os
import pathlib
import re
import statistics
import subprocess
import sys
import time

source, build, place = (pathlib.Path(os.environ[name]) for name in ("SOURCE", "BUILD", "PLACE"))
robot, links, seconds = (int(os.environ[name]) for name in ("ROBOT", "LINKS", "SECONDS_TO_WATCH"))
here = pathlib.Path("/run/place")
sys.path.insert(0, str(source / "tests/service"))
from subscriber import Subscriber


def output_of(*command):
    return subprocess.run(command, capture_output=True, text=True).stdout


def others():
    """Robots that batman-adv has a route to; the fifth byte of an address is the robot's id."""
    known = output_of("batctl", "meshif", "bat0", "originators", "-H")
    return set(re.findall(r"^ \* 02:00:00:00:(\S\S)", known, re.MULTILINE))


def wait_for(holds):
    while not holds():
        time.sleep(0.1)


def lost(link):
    sent, dropped = map(int, re.search(r"(\d+) pkt \(dropped (\d+)", output_of("tc", "-s", "qdisc", "show", "dev", link)).groups())
    return f"{100 * dropped / max(sent + dropped, 1):.0f} %"


wait_for(lambda: "inet 169.254." in output_of("ip", "address", "show", "bat0") and len(others()) == 3)
(here / f"{robot}.up").touch()
wait_for((here / "work").exists)
end = time.monotonic() + 2
while time.monotonic() < end:
    pass  # shows the machine how much of it this robot gets
(here / f"{robot}.worked").touch()
wait_for((here / "begin").exists)
world = json.loads((here / "begin").read_text())
slower = world["slower"]
epoch = (time.monotonic() - (time.time() - world["at"])) / slower
for link in range(links):
    output_of("tc", "qdisc", "change", "dev", f"wlan{link}", "root", "netem", "delay", f"{2 * slower}ms", f"{slower}ms", "loss", "10%")
config = pathlib.Path("/run/crepesd.yaml")
config.write_text((here / f"r{robot}.yaml").read_text().replace("EPOCH", repr(epoch)))
begin = time.monotonic()
daemon = subprocess.Popen([build / "daemon/crepesd", "--config", config],
                          env=os.environ | {"LD_PRELOAD": str(here / "slow_clock.so"), "SLOWER": str(slower)})

subscriber = Subscriber(47474 + robot)  # the port in the examples
peers = {}
for pose, came in subscriber.poses(begin + slower * seconds):
    pair = peers.setdefault(pose["peer"], {"first_s": round((came - begin) / slower, 2), "modes": collections.Counter(), "ranges": []})
    pair["modes"][pose["mode"]] += 1
    pair["ranges"].append(sum(pose["position"][axis] ** 2 for axis in "xyz") ** 0.5)
for pair in peers.values():
    pair["median_range_m"] = round(statistics.median(pair.pop("ranges")), 2)
status, _ = subscriber._next({"class": "POLL", "about": "network"}, lambda message: message["class"] == "STATUS", 5.0)
is_protected = status["mesh"]["sealed"] and status["mesh"]["signed"] and "warning" not in status["mesh"]
daemon.terminate()
found = {"is_protected": is_protected, "cpu": status.get("cpu_s", 0.0) / status["uptime_s"] / slower,
         "originators": len(others()), "loss": [lost(f"wlan{link}") for link in range(links)], "peers": peers,
         "exit": daemon.wait()}
(here / f"r{robot}.json").write_text(json.dumps(found))
