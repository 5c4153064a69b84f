"""Poses of a crepesd on this machine, as any program on a robot receives them."""
import json
import socket
import time


class Subscriber:
    def __init__(self, port=47475):
        self.asked = 0.0
        self.daemon = ("127.0.0.1", port)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(0.02)

    def _next(self, request, wanted, seconds):
        """The first object that meets the condition, and its arrival; requested ten times a second."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if time.monotonic() - self.asked > 0.1:
                self.asked = time.monotonic()
                try:
                    self.socket.sendto(json.dumps(request).encode(), self.daemon)
                except OSError:
                    pass  # not started yet
            try:
                message = json.loads(self.socket.recv(2000))
            except OSError:
                continue
            if wanted(message):
                return message, time.monotonic()
        return None, None

    def drain(self):
        """Discards what was received before now."""
        self.socket.setblocking(False)
        try:
            while True:
                self.socket.recv(2000)
        except OSError:
            pass
        self.socket.settimeout(0.02)

    def pose(self, peer, seconds=30.0, modes=("direct", "graph")):
        wanted = lambda m: m["class"] == "POSE" and m["peer"] == peer and m["mode"] in modes
        return self._next({"class": "WATCH", "enable": True}, wanted, seconds)

    def poses(self, end):
        """All poses with their arrivals, until the clock reads `end`."""
        while time.monotonic() < end:
            pose, came = self._next({"class": "WATCH", "enable": True}, lambda m: m["class"] == "POSE",
                                    end - time.monotonic())
            if pose:
                yield pose, came
