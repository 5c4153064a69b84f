#!/usr/bin/env python3
"""A drone under PX4 (or ArduPilot) keeps its place beside a neighbor, by the poses of its own crepesd.
    px4_offboard.py --peer 1 --place -3 1.5 0 [--mavlink udpin:127.0.0.1:14540]

The place is in the neighbor's level axes: forward, left, up, in meters. Setpoints are velocities and a
yaw rate in the autopilot's own frame (SET_POSITION_TARGET_LOCAL_NED, frame MAV_FRAME_LOCAL_NED), 20 a
second. Nothing of the neighbor but its relative pose is known, so no common origin is needed.

This program never arms, never takes off and never changes the mode: fly to the place by hand, then
switch to OFFBOARD (ArduPilot: GUIDED); switch back to take over. Without a good pose for half a second
the setpoint is to hover. Needs `pip install pymavlink`.
"""
import argparse
import math
import time
from dataclasses import dataclass

from crepes_client import Connection, Pose
from formation import MAX_AGE_S, MAX_SPEED, Follower

SETPOINTS_HZ = 20.0  # PX4 leaves OFFBOARD below 2 a second
MAX_SIGMA_M = 0.5  # a pose that is less certain than this, in any direction, steers nobody
MAX_TURN_RATE = 0.8  # rad/s
LOCAL_NED = 1  # MAV_FRAME_LOCAL_NED
WANTED = ["LOCAL_POSITION_NED", "ATTITUDE"]  # velocity and yaw of the autopilot
# POSITION_TARGET_TYPEMASK: ignore position (bits 0 to 2), acceleration (6 to 8) and yaw (10).
VELOCITY_AND_YAW_RATE = 0b101_1100_0111


@dataclass
class Vehicle:
    """What the autopilot reports of itself: velocity [m/s] in its local NED axes, yaw [rad] from north to east."""

    velocity_ned: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw: float = 0.0


def level_from_ned(v, yaw):
    """North, east, down -> forward, left, up of a body that is level and has this yaw."""
    c, s = math.cos(yaw), math.sin(yaw)
    return c * v[0] + s * v[1], s * v[0] - c * v[1], -v[2]


def ned_from_level(v, yaw):
    """The inverse of `level_from_ned`."""
    c, s = math.cos(yaw), math.sin(yaw)
    return c * v[0] + s * v[1], s * v[0] - c * v[1], -v[2]


def is_good(pose: Pose) -> bool:
    """Whether the covariance allows to steer by this pose: limit I - P is positive definite, by its leading minors."""
    covariance = pose.covariance_matrix()
    if covariance is None:
        return False
    a, b, c = ([MAX_SIGMA_M**2 * (row == column) - covariance[row][column] for column in range(3)] for row in range(3))
    minor = a[0] * b[1] - a[1] * b[0]
    determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    return a[0] > 0.0 and minor > 0.0 and determinant > 0.0


class Setpoints:
    """From poses of the neighbor to (velocity in NED [m/s], yaw rate [rad/s], clockwise from above)."""

    HOVER = ((0.0, 0.0, 0.0), 0.0)

    def __init__(self, place, turned=0.0):
        """`place` in the neighbor's level axes; `turned`: our heading against the neighbor's [rad], left is positive."""
        self.follower = Follower(place, turned)
        self.pose = None
        self.since = 0.0

    def add(self, pose: Pose, now: float):
        if is_good(pose):
            self.pose, self.since = pose, now

    def at(self, now: float, vehicle: Vehicle):
        if self.pose is None or now - self.since > MAX_AGE_S:
            return self.HOVER
        # The autopilot knows our velocity; the follower adds it to the relative one, which gives the neighbor's.
        self.follower.own = list(level_from_ned(vehicle.velocity_ned, vehicle.yaw))
        velocity, turn_rate = self.follower.command(self.pose, 0.0)
        turn_rate = max(-MAX_TURN_RATE, min(MAX_TURN_RATE, turn_rate))
        return ned_from_level(velocity, vehicle.yaw), -turn_rate


class Autopilot:
    """A connection of pymavlink: reads velocity and yaw, sends setpoints."""

    def __init__(self, link):
        self.link = link
        self.vehicle = Vehicle()
        self.heard = dict.fromkeys(WANTED, -math.inf)  # when each came last
        self.begin = time.monotonic()

    def read(self):
        """All that waits."""
        while (message := self.link.recv_match(type=WANTED, blocking=False)) is not None:
            if message.get_type() == "ATTITUDE":
                self.vehicle.yaw = message.yaw
            else:
                self.vehicle.velocity_ned = (message.vx, message.vy, message.vz)
            self.heard[message.get_type()] = time.monotonic()

    def missing(self, now):
        """What did not come for half a second. Without the yaw a setpoint would point anywhere."""
        return [kind for kind in WANTED if now - self.heard[kind] > MAX_AGE_S]

    def send(self, velocity_ned, yaw_rate):
        since_begin_ms = int((time.monotonic() - self.begin) * 1e3)
        self.link.mav.set_position_target_local_ned_send(
            since_begin_ms, self.link.target_system, self.link.target_component, LOCAL_NED, VELOCITY_AND_YAW_RATE,
            0.0, 0.0, 0.0, *velocity_ned, 0.0, 0.0, 0.0, 0.0, yaw_rate)


def fly(autopilot: Autopilot, daemon: Connection, setpoints: Setpoints, clock=time.monotonic):
    """Never ends. An autopilot that is silent gets no setpoints, so it leaves OFFBOARD by itself."""
    due, missing = clock(), None
    while True:
        message = daemon.receive(max(0.0, due - clock()))
        now = clock()
        if isinstance(message, Pose):
            setpoints.add(message, now)
        if now < due:
            continue
        due = now + 1.0 / SETPOINTS_HZ
        autopilot.read()
        before, missing = missing, autopilot.missing(now)
        if missing != before:
            print(f"no setpoints: no {' and no '.join(missing)} from the autopilot" if missing else "sending setpoints", flush=True)
        if not missing:
            autopilot.send(*setpoints.at(now, autopilot.vehicle))


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--peer", type=int, required=True, help="the neighbor to stay with")
    options.add_argument("--place", type=float, nargs=3, default=(-3.0, 0.0, 0.0), metavar=("FORWARD", "LEFT", "UP"),
                         help="ours, in the neighbor's level axes [m] (3 m behind it)")
    options.add_argument("--turned", type=float, default=0.0, help="our heading against the neighbor's [deg], left is positive")
    options.add_argument("--mavlink", default="udpin:127.0.0.1:14540", help="as pymavlink names it (%(default)s)")
    options.add_argument("--daemon", default="127.0.0.1", help="address of our crepesd (%(default)s)")
    options.add_argument("--port", type=int, default=47475)
    asked = options.parse_args()
    from pymavlink import mavutil

    link = mavutil.mavlink_connection(asked.mavlink)
    print(f"waiting for an autopilot at {asked.mavlink}", flush=True)
    link.wait_heartbeat()
    print(f"steering towards {asked.place} m of robot {asked.peer}, at most {MAX_SPEED} m/s, in OFFBOARD or GUIDED", flush=True)
    setpoints = Setpoints(asked.place, math.radians(asked.turned))
    with Connection(asked.daemon, asked.port, rate_hz=SETPOINTS_HZ, peers=[asked.peer]) as daemon:
        fly(Autopilot(link), daemon, setpoints)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
