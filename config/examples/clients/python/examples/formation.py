#!/usr/bin/env python3
"""Three robots hold an equilateral triangle: one leads, two follow by the poses of their own daemons.
    formation.py [--port PORT_OF_THE_FIRST_DAEMON] [--commands PORT_OF_THE_SIMULATION]

Each follower knows nothing but what its own crepesd says about the leader: no map, no radio to the
leader, no ground truth. Commands are velocities in level body axes (forward, left, up), as an
autopilot in velocity mode takes them; here they go to the robots of `crepesctl demo --scenario
formation`, as {"robot": 2, "velocity": [vx, vy, vz], "turn_rate": w} over UDP.
"""
import argparse
import asyncio
import json
import math
import socket
import time

from crepes_client import Pose, Vector, aio

SIDE = 4.0  # m, of the triangle
# Where followers belong, in the leader's level axes (forward, left, up), and how far they are turned against it: all
# face the center.
PLACES = {
    2: ((SIDE * math.sqrt(0.75), SIDE / 2, 0.0), math.radians(-120.0)),
    3: ((SIDE * math.sqrt(0.75), -SIDE / 2, 0.0), math.radians(120.0)),
}
POSITION_GAIN = 0.9  # 1/s
TURN_GAIN = 0.8  # 1/s
MAX_SPEED = 0.8  # m/s
LAG_S = 0.6  # of a robot's velocity behind its command
CONTROL_HZ = 20.0
MAX_AGE_S = 0.5  # without a pose for longer, a follower stops
# The leader flies a circle about the pillar, so that the pillar passes through the triangle's sides.
RADIUS, PERIOD_S, WAIT_S = 1.4, 30.0, 10.0


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def rotated(q, v):
    """q v q*, with q = (w, x, y, z)."""
    w, x, y, z = q
    tx, ty, tz = 2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]), 2 * (x * v[1] - y * v[0])
    return (v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx)


class Level:
    """Our body's axes without roll and pitch: the direction up is part of each pose."""

    def __init__(self, up):
        forward = [(1.0 if axis == 0 else 0.0) - up[0] * up[axis] for axis in range(3)]
        length = math.sqrt(dot(forward, forward))
        self.x = [part / length for part in forward]
        self.z = up
        self.y = (up[1] * self.x[2] - up[2] * self.x[1], up[2] * self.x[0] - up[0] * self.x[2], up[0] * self.x[1] - up[1] * self.x[0])

    def __call__(self, v):
        return dot(self.x, v), dot(self.y, v), dot(self.z, v)


class Follower:
    """From poses of the leader to velocity commands."""

    def __init__(self, place, turned):
        self.place = place
        self.turned = turned
        self.own = [0.0, 0.0, 0.0]  # our velocity, as the commands so far make it

    def command(self, pose: Pose, dt: float):
        """(velocity, turn rate) for a pose of the leader, `dt` seconds after the last one."""
        level = Level(pose.up or Vector(0.0, 0.0, 1.0))
        to_leader = level(pose.position)
        ahead = level(rotated(pose.orientation, (1.0, 0.0, 0.0)))
        heading = math.atan2(ahead[1], ahead[0])  # of the leader, seen from us
        forward, left, up = self.place
        c, s = math.cos(heading), math.sin(heading)
        error = (to_leader[0] + c * forward - s * left, to_leader[1] + s * forward + c * left, to_leader[2] + up)
        # POSE has the difference of velocities; with our own it is the leader's, which we fly too.
        relative = level(pose.velocity or Vector(0.0, 0.0, 0.0))
        velocity = [POSITION_GAIN * e + v + own for e, v, own in zip(error, relative, self.own)]
        speed = math.sqrt(dot(velocity, velocity))
        velocity = [v * min(1.0, MAX_SPEED / max(speed, 1e-9)) for v in velocity]
        self.settle(velocity, dt)
        return velocity, TURN_GAIN * math.remainder(heading + self.turned, 2 * math.pi)

    def settle(self, velocity, dt):
        """Our velocity approaches the command."""
        share = 1.0 - math.exp(-dt / LAG_S)
        self.own = [own + share * (v - own) for own, v in zip(self.own, velocity)]


class Robots:
    """The robots' autopilots."""

    def __init__(self, port):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.place = ("127.0.0.1", port)

    def send(self, robot, velocity, turn_rate=0.0):
        self.socket.sendto(json.dumps({"robot": robot, "velocity": list(velocity), "turn_rate": turn_rate}).encode(), self.place)


async def follow(robot, port, robots):
    """Never ends: a daemon that restarts is asked again, and meanwhile the robot stands still."""
    follower = Follower(*PLACES[robot])
    last = time.monotonic()
    async with aio.Connection(port=port, rate_hz=CONTROL_HZ, peers=[1]) as daemon:
        while True:
            message = await daemon.receive(MAX_AGE_S)
            now = time.monotonic()
            if isinstance(message, Pose):
                robots.send(robot, *follower.command(message, min(now - last, MAX_AGE_S)))
                last = now
            elif now - last > MAX_AGE_S:
                robots.send(robot, (0.0, 0.0, 0.0))
                follower.own = [0.0, 0.0, 0.0]


async def lead(robots):
    begin = time.monotonic()
    while True:
        phase = 2 * math.pi * max(0.0, time.monotonic() - begin - WAIT_S) / PERIOD_S
        speed = RADIUS * 2 * math.pi / PERIOD_S if phase > 0.0 else 0.0
        robots.send(1, (-speed * math.sin(phase), speed * math.cos(phase), 0.0))
        await asyncio.sleep(1 / CONTROL_HZ)


async def main(port, commands):
    robots = Robots(commands)
    await asyncio.gather(lead(robots), *(follow(robot, port + robot - 1, robots) for robot in PLACES))


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--port", type=int, default=47481, help="of the first robot's daemon; the others follow (%(default)s)")
    options.add_argument("--commands", type=int, default=47484, help="UDP port of the simulated robots (%(default)s)")
    asked = options.parse_args()
    try:
        asyncio.run(main(asked.port, asked.commands))
    except KeyboardInterrupt:
        pass
