#!/usr/bin/env python3
"""What one live crepesd with four neighbors costs, and how late its poses are.

    tests/bench/live_latency.py [--minutes 1] [--build build/release]

Five daemons run in the simulated world `occluded` (`crepesctl demo`), each with a 1280x1024 camera at 200 Hz,
an IMU at 100 Hz and UWB through pseudo-terminals. All figures are robot 1's. Measured are, on the same clock,
    spots   from the arrival of a frame (the driver hands it over) to its spots in the estimator's queue
    poses   from the estimator's tick, at which a pose takes up all that is in that queue, to the datagram in this
            program's hands: look-ahead of four filters, JSON, two thread changes and the kernel
Between the two lies nothing but the wait for the next tick: that is the configured output rate (20 ms).
"""
import argparse
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time


def quantile(values, share):
    ordered = sorted(values)
    return ordered[round(share * (len(ordered) - 1))] if ordered else float("nan")


class RobotClock:
    """Simulated clock of a kept configuration:  local = (monotonic - epoch) (1 + skew) + offset."""

    def __init__(self, text):
        number = lambda key: float(re.search(rf"\n *{key}: (\S+)", text).group(1))  # noqa: E731
        self.epoch, self.offset = number("epoch_s"), number("clock_offset_s")
        self.rate = 1.0 + number("clock_skew_ppm") * 1e-6

    def now_ns(self):
        elapsed_ns = time.monotonic_ns() - round(self.epoch * 1e9)
        return round(elapsed_ns * self.rate) + round(self.offset * 1e9)


class Robot:
    def __init__(self, port, clock):
        self.clock = clock
        self.line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.line.connect(("127.0.0.1", port))
        self.line.settimeout(0.1)
        self.pose_delays_ms, self.spot_p50_ms, self.spot_p99_ms, self.loads = [], [], [], []
        self.peers = set()

    def ask(self, **request):
        try:
            self.line.send(json.dumps(request).encode())
        except ConnectionRefusedError:
            pass

    def listen(self, end):
        while time.monotonic() < end:
            try:
                data = self.line.recv(2048)
            except (TimeoutError, ConnectionRefusedError):
                continue
            now_ns = self.clock.now_ns()
            message = json.loads(data)
            if message["class"] == "POSE":
                self.pose_delays_ms.append((now_ns - int(message["t_pub_ns"])) / 1e6)
                self.peers.add(message["peer"])
            elif message["class"] == "STATUS":
                self.take_status(message)

    def take_status(self, status):
        self.loads.append((status["uptime_s"], status["cpu_s"], status["rss_mb"]))
        for sensor in status["sensors"]:
            counts = sensor.get("counts", {})
            if sensor["name"].endswith(" spots") and "delay_p99_us" in counts:
                self.spot_p50_ms.append(counts["delay_p50_us"] / 1e3)
                self.spot_p99_ms.append(counts["delay_p99_us"] / 1e3)


class Threads:
    """CPU time and time spent waiting for a core of one daemon's threads, from /proc."""

    def __init__(self, demo, config):
        self.tasks = {}
        for pid in pathlib.Path(f"/proc/{demo.pid}/task/{demo.pid}/children").read_text().split():
            if config in pathlib.Path(f"/proc/{pid}/cmdline").read_text():
                for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
                    self.tasks[task] = (task / "comm").read_text().strip()

    def times_s(self, name):
        """(running, waiting) so far."""
        pairs = [(task / "schedstat").read_text().split() for task, comm in self.tasks.items() if comm == name]
        return [sum(int(pair[i]) for pair in pairs) / 1e9 for i in (0, 1)] if pairs else [float("nan")] * 2


def await_config(folder):
    """The demo writes it before it starts the daemon."""
    for _ in range(200):
        file = pathlib.Path(folder) / "r1.yaml"
        text = file.read_text() if file.exists() else ""
        if "level:" in text:
            return text
        time.sleep(0.05)
    sys.exit("the demo did not start")


def report(robot, settle_s, spent):
    loads = [load for load in robot.loads if load[0] > settle_s]
    if len(loads) < 2 or not robot.pose_delays_ms:
        sys.exit("not enough was heard of the daemon")
    (t0, cpu0, rss0), (t1, cpu1, _) = loads[0], loads[-1]
    quarter = max(1, len(loads) // 4)
    middle = lambda part: quantile([rss for _, _, rss in part], 0.5)  # noqa: E731
    spots = quantile(robot.spot_p50_ms, 0.5), quantile(robot.spot_p99_ms, 0.99)
    poses = quantile(robot.pose_delays_ms, 0.5), quantile(robot.pose_delays_ms, 0.99)
    print(f"neighbors with poses    {len(robot.peers)}, {len(robot.pose_delays_ms)} poses in {t1 - t0:.0f} s")
    print(f"frame to spots          p50 {spots[0]:.2f} ms   p99 {spots[1]:.2f} ms (of the seconds' p99s, the 99 % quantile)")
    print(f"tick to datagram        p50 {poses[0]:.2f} ms   p99 {poses[1]:.2f} ms")
    for name, (run0, wait0), (run1, wait1), seconds in spent:
        ticks = 50.0 * seconds
        print(f"  {name + ':':21s} {1e3 * (run1 - run0) / ticks:.2f} ms of CPU a tick, "
              f"{1e3 * (wait1 - wait0) / ticks:.2f} ms a tick waiting for a core")
    print(f"together                p50 {sum([spots[0], poses[0]]):.2f} ms   p99 at most {spots[1] + poses[1]:.2f} ms   (goal: 2)")
    print(f"CPU                     {100 * (cpu1 - cpu0) / (t1 - t0):.1f} % of a core, its simulation included   (goal: 25)")
    print(f"RSS                     {max(rss for _, _, rss in loads):.1f} MB   (goal: 80)")
    print(f"growth                  {middle(loads[-quarter:]) - middle(loads[:quarter]):+.2f} MB "
          f"from the first to the last quarter of {(t1 - t0) / 60:.1f} min   (goal: none)")


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--minutes", type=float, default=1.0, help="at most 9")
    options.add_argument("--build", default="build/release")
    options.add_argument("--port", type=int, default=47600)
    options.add_argument("--scenario", default="occluded", help="of the demo; occluded has five robots")
    asked = options.parse_args()
    run_s, settle_s = 60.0 * asked.minutes, min(5.0, 15.0 * asked.minutes)
    with tempfile.TemporaryDirectory() as folder:
        demo = subprocess.Popen(
            [os.path.join(asked.build, "daemon", "crepesctl"), "demo", "--scenario", asked.scenario, "--for",
             str(min(600.0, run_s + settle_s + 5.0)), "--port", str(asked.port), "--keep", folder],
            stdout=subprocess.DEVNULL)
        try:
            robot = Robot(asked.port, RobotClock(await_config(folder)))
            start = time.monotonic()
            end = start + run_s + settle_s
            threads, first = None, {}
            while (now := time.monotonic()) < end:
                if now - start < settle_s:
                    robot.pose_delays_ms.clear()
                elif threads is None:
                    threads, counted_from = Threads(demo, os.path.join(folder, "r1.yaml")), now
                    first = {name: threads.times_s(name) for name in ("estimator", "net")}
                robot.ask(**{"class": "WATCH", "enable": True})
                robot.ask(**{"class": "POLL", "about": "sensors"})
                robot.listen(min(now + 1.0, end))
            spent = [(name, begin, threads.times_s(name), time.monotonic() - counted_from)
                     for name, begin in first.items()]
        finally:
            demo.send_signal(signal.SIGINT)
            demo.wait(20)
    report(robot, settle_s, spent)


if __name__ == "__main__":
    main()
