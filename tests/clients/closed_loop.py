#!/usr/bin/env python3
"""Real daemons, simulated robots and the example that steers them by the poses of these daemons:
    closed_loop.py SOURCE crepesctl
Fails where the triangle is not held, or was never hidden by the pillar; and where the robots, left to themselves,
are as good."""
import contextlib
import json
import os
import pathlib
import socket
import subprocess
import sys

SOURCE, CREPESCTL = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
CLIENT = SOURCE / "config/examples/clients/python"
MAX_RMS_M = 0.3  # four seeds of 60 s: at most half of it, on a busy machine (config/examples/clients/README.md)


def free_ports():
    """The first of four that follow one another: three daemons, and the commands."""
    while True:
        with contextlib.ExitStack() as stack:
            probes = [stack.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) for _ in range(4)]
            probes[0].bind(("127.0.0.1", 0))
            first = probes[0].getsockname()[1]
            with contextlib.suppress(OSError, OverflowError):
                for further, probe in enumerate(probes[1:], start=1):
                    probe.bind(("127.0.0.1", first + further))
                return first


def formation(seconds, *more):
    words = [CREPESCTL, "demo", "--scenario", "formation", "--for", str(seconds), "--port", str(free_ports()), "--json", *more]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False, env={**os.environ, "PYTHONPATH": str(CLIENT)})
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)["formation"]


held = formation(26, "--run", str(CLIENT / "examples/formation.py"))
print("held:", held)
assert held["rms_m"] < MAX_RMS_M, f"the triangle was not held: {held}"
assert held["hidden"] > 0.02, f"the pillar hid nobody: {held}"
alone = formation(6)
print("alone:", alone)
assert alone["rms_m"] > 1.5 * held["rms_m"], "not better than robots that are not steered"
