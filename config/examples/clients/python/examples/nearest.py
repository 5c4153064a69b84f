#!/usr/bin/env python3
"""Prints, whenever it changes, which neighbor is nearest, and where there is no pose, why:
    nearest.py [ADDRESS [PORT]]"""
import math
import sys

import crepes_client


def main(address="127.0.0.1", port="47475"):
    distances, last = {}, None
    with crepes_client.Connection(address, int(port), rate_hz=10, poll_s=5.0) as connection:
        while True:
            message = connection.receive(1.0)
            if isinstance(message, crepes_client.Pose):
                distances[message.name] = math.hypot(*message.position)
            elif isinstance(message, crepes_client.Status):
                for neighbor in message.neighbors:
                    if neighbor.state == "none":
                        distances.pop(neighbor.name, None)
                        print(f"{neighbor.name}: no pose: {neighbor.reason}", flush=True)
            elif connection.silent_s > 3.0:
                print("no answer", flush=True)
            nearest = min(distances, key=distances.get, default=None)
            if nearest != last:
                print(f"nearest: {nearest}", flush=True)
                last = nearest


if __name__ == "__main__":
    main(*sys.argv[1:])
