"""A daemon that answers as config/docs/formats.md says: robots on circles, in a thread of this process."""
import json
import math
import select
import socket
import threading
import time


FIT = 4  # neighbors in a datagram; the others are named
CAMERA, RING, ANTENNA = [0.1, 0.05, 0.0], [0.0, 0.0, 0.15], [0.0, -0.1, 0.05]


def position_of(robot, t):
    """Robot 2 is 2 m away, robot 3 is 2.5 m away, and so on; each on its circle."""
    radius, angle = 1.0 + 0.5 * robot, 0.3 * t + 1.3 * robot
    return {"x": radius * math.cos(angle), "y": radius * math.sin(angle), "z": 0.2 * robot}


class FakeDaemon:
    def __init__(self, neighbors=4, port=0, rate_hz=50):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", port))
        self.port = self.socket.getsockname()[1]
        self.neighbors = range(2, 2 + neighbors)
        self.rate_hz = rate_hz
        self.watchers = {}
        self.is_over = False
        self.lost = set()  # neighbors without a pose
        self.blind = set()  # neighbors that do not see us
        self.turned = {}  # by neighbor, how far to the left our camera shows it [rad]
        self.too_long = {}  # by neighbor, what its ranges read too much [m]
        self.broken = {}  # sensors by name, with what they say
        self.fixed = None  # where all neighbors stand instead of moving
        self.liars = {}  # by neighbor, what the team finds wrong with it
        self.config = {"generation": 1}
        self.resets = 1
        self.sent = 0
        self.newest_ns = 0  # the stamp of the newest poses
        self.start = time.monotonic()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def stop(self):
        self.is_over = True
        self.thread.join()
        self.socket.close()

    def run(self):
        due = time.monotonic()
        while not self.is_over:
            now = time.monotonic()
            if now >= due:
                due = max(due + 1 / self.rate_hz, now - 1)
                self.send_poses(now)
            while select.select([self.socket], [], [], max(0, due - time.monotonic()))[0]:
                data, client = self.socket.recvfrom(2000)
                self.answer(json.loads(data), client)

    def send_poses(self, now):
        self.watchers = {client: end for client, end in self.watchers.items() if end > now}
        self.newest_ns = int(now * 1e9)
        for robot in self.neighbors:
            if robot in self.lost or not self.watchers:
                continue
            variance = [1e-4, 0, 0, 0, 0, 0, 4e-4, 0, 0, 0, 0, 9e-4, 0, 0, 0, 1e-5, 0, 0, 1e-5, 0, 1e-5]
            pose = json.dumps({"class": "POSE", "seq": self.sent, "timestamp": now, "t_ns": str(int(now * 1e9)), "self": 1, "peer": robot,
                               "name": f"r{robot}", "mode": ("direct", "graph", "predicted")[robot % 3], "position": self.fixed or position_of(robot, now),
                               "orientation": {"w": 1, "x": 0, "y": 0, "z": 0}, "up": {"x": 0, "y": 0, "z": 1},
                               "covariance": variance, "age_s": 0.01, "reset_counter": self.resets, "sources": ["range"]}).encode()
            for client in self.watchers:
                self.socket.sendto(pose, client)
            self.sent += 1

    def answer(self, request, client):
        now = time.monotonic()
        if request["class"] == "WATCH":
            self.watchers[client] = now + 10 if request.get("enable", True) else now
            reply = {"class": "VERSION", "release": "fake", "proto_major": 1, "proto_minor": 0, "lease_s": 10}
        else:
            reply = self.status(request, now)
        self.socket.sendto(json.dumps(reply).encode(), client)

    def status(self, request, now):
        status = {"class": "STATUS", "self": 1, "name": "r1", "uptime_s": now - self.start, "cpu_s": 0.1 * (now - self.start), "rss_mb": 70,
                  "config": self.config}
        if request.get("about") == "pair":
            status["pair"] = self.pair(request["peer"])
            return status
        if request.get("about") == "team":
            status["team"] = {"age_s": 0.1, "robots": [
                {"robot": r, "name": f"r{r}", "trusted": r not in self.liars, "nis": {"bearing": 9.5 if r in self.liars else 0.9, "range": 1.1},
                 **({"faults": [self.liars[r]]} if r in self.liars else {})} for r in [1, *self.neighbors]]}
            return status
        if "about" not in request:
            wanted = [r for r in self.neighbors if request.get("peer", r) == r]
            if len(wanted) > FIT:
                status["more"], wanted = wanted[FIT:], wanted[:FIT]
            status["neighbors"] = [self.neighbor(r, now) for r in wanted]
            if "peer" in request:
                for each in status["neighbors"]:
                    each["ages_s"] = {"bearing": 0.01, "peer_bearing": 9.0 if each["peer"] in self.blind else 0.02, "range": 0.03, "imu": 0.01}
                    each.update(airtime=0.042, range_residual_m=-0.031, measured=self.measured(each["peer"], now))
            if "peer" in request:
                status["timestamp"] = now
            status["clocks"] = [{"peer": r, "offset_s": -10.0 * r, "skew_ppm": 3, "sigma_s": 2e-5} for r in wanted]
        if "peer" not in request:
            status["sensors"] = [{"name": name, "rate_hz": rate, "ok": name not in self.broken, **({"message": self.broken[name]} if name in self.broken else {})}
                                 for name, rate in (("imu", 100.0), ("uwb", 40.0), ("cam0", 200.0))]
        return status

    def pair(self, robot):
        three = {"value": [0.01, -0.02, 0.03], "sigma": [0.001] * 3}
        return {"peer": robot, "name": f"r{robot}", "residuals": {kind: {"nis": 0.1 * robot, "fused": 9, "refused": 1} for kind in ("bearing", "peer_bearing", "range")},
                "calibration": {**{f"{side}{key}": three for side in ("", "own_") for key in ("gyro_bias_radps", "accel_bias_mps2", "misalignment_deg")},
                                "range_bias_m": {"value": 0.05, "sigma": 0.01}}}

    def measured(self, robot, now):
        """As old as its ages say; cameras, lights and antennas have lever arms."""
        def between(age, start, end):
            p = list((self.fixed or position_of(robot, now - age)).values())
            return [x + theirs - ours for x, theirs, ours in zip(p, end, start)]

        def unit(v):
            return [round(x / math.hypot(*v), 4) for x in v]
        ours = unit(between(0.01, CAMERA, RING))
        turn = math.atan2(ours[1], ours[0]) + self.turned.get(robot, 0.0)
        across = math.hypot(ours[0], ours[1])
        ours = [round(across * math.cos(turn), 4), round(across * math.sin(turn), 4), ours[2]]
        theirs = unit([-x for x in between(0.02, RING, CAMERA)])
        distance = math.hypot(*between(0.03, ANTENNA, ANTENNA)) + self.too_long.get(robot, 0)
        return {"bearing": {"u": ours, "from": CAMERA, "to": RING}, "range": {"m": round(distance, 4), "from": ANTENNA, "to": ANTENNA},
                **({} if robot in self.blind else {"peer_bearing": {"u": theirs, "from": CAMERA, "to": RING}})}

    def neighbor(self, robot, now):
        count = int(20 * (now - self.start))
        state = {"state": "none", "reason": "not seen"} if robot in self.lost else {"state": "direct"}
        return {"peer": robot, "name": f"r{robot}", **state, "measurements": {"bearing": {"fused": count, "gated": count // 50}, "range": {"fused": count}},
                **({"faults": [self.liars[robot]]} if robot in self.liars else {}),
                "reports": {"received": count, "lost": count // 40, "restarts": 0, "age_s": 0.02, "loss": 0.25 if robot in self.blind else 0.0}}
