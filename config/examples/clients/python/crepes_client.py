#!/usr/bin/env python3
"""Poses of a crepesd in Python, with nothing but the standard library.

As a program:  crepes_client.py [--address 127.0.0.1] [--port 47475] [--rate 10] [--count N]
prints one line a pose: t_ns peer mode x y z [m, in our body's axes].

As a module:
    for pose in crepes_client.poses(rate_hz=50):
        print(pose["peer"], pose["position"])
"""
import argparse
import json
import socket
import time


def poses(address="127.0.0.1", port=47475, rate_hz=None, peers=None):
    """Yields POSE objects for ever; TimeoutError if the daemon is silent for three seconds."""
    family = socket.AF_INET6 if ":" in address else socket.AF_INET
    with socket.socket(family, socket.SOCK_DGRAM) as line:
        line.connect((address, port))  # hears nobody else
        line.settimeout(0.2)
        watch = {"class": "WATCH", "enable": True}
        if rate_hz is not None:
            watch["rate_hz"] = rate_hz
        if peers is not None:
            watch["peers"] = peers
        cookie = {"pad": " " * 64}  # a daemon on another robot answers no shorter request
        renewal, heard = 0.0, time.monotonic()
        try:
            while True:
                now = time.monotonic()
                if now - heard > 3.0:
                    raise TimeoutError(f"no answer from {address} port {port}")
                if now >= renewal:
                    renewal = now + 1.0  # the lease is ten seconds: a lost datagram does not matter
                    send(line, {**watch, **cookie})
                message = receive(line)
                if message is None:
                    continue
                heard = now
                kind = message.get("class")
                if kind == "COOKIE":
                    cookie, renewal = {"cookie": message["cookie"]}, 0.0
                elif kind == "ERROR":
                    raise RuntimeError(message["message"])
                elif kind == "POSE":
                    yield message
        finally:
            send(line, {"class": "WATCH", "enable": False, **cookie})


def send(line, request):
    try:
        line.send(json.dumps(request).encode())
    except ConnectionRefusedError:
        pass  # no daemon there yet


def receive(line):
    """The next object, or None for now."""
    try:
        return json.loads(line.recv(2048))
    except (TimeoutError, ConnectionRefusedError, ValueError):
        return None


def main():
    options = argparse.ArgumentParser(description="Prints the poses of a crepesd.")
    options.add_argument("--address", default="127.0.0.1")
    options.add_argument("--port", type=int, default=47475)
    options.add_argument("--rate", type=float, help="poses of each neighbor a second")
    options.add_argument("--count", type=int, help="stop after so many poses")
    asked = options.parse_args()
    stream = poses(asked.address, asked.port, asked.rate)
    for number, pose in enumerate(stream, start=1):
        p = pose["position"]
        print(pose["t_ns"], pose["peer"], pose["mode"], p["x"], p["y"], p["z"], flush=True)
        if number == asked.count:
            break
    stream.close()


if __name__ == "__main__":
    main()
