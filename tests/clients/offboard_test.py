"""The example for PX4 (examples/px4_offboard.py), with perfect poses, an ideal vehicle and a stub of pymavlink."""
import contextlib
import io
import itertools
import math
import pathlib
import sys
import types
import unittest

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "config/examples/clients/python/examples"
sys.path[:0] = [str(EXAMPLES.parent), str(EXAMPLES)]
import px4_offboard as offboard  # noqa: E402
from crepes_client import Pose, Quaternion, Vector  # noqa: E402

STEP_S = 0.02
GOOD = tuple(1e-4 if row == column else 0.0 for row in range(6) for column in range(row, 6))
PLACE, TURNED = (-3.0, 1.5, 0.5), math.radians(30.0)


class Drone:
    """Place and velocity in north, east, down; yaw from north to east. Velocity lags behind its setpoint."""

    def __init__(self, p, yaw):
        self.p, self.v, self.yaw = list(p), [0.0, 0.0, 0.0], yaw

    def step(self, velocity, yaw_rate):
        share = STEP_S / 0.4
        self.v = [v + share * (want - v) for v, want in zip(self.v, velocity)]
        self.p = [p + STEP_S * v for p, v in zip(self.p, self.v)]
        self.yaw += STEP_S * yaw_rate


def pose_of(observer, neighbor, covariance=GOOD):
    """What a daemon without errors says: level bodies, forward, left, up."""
    half = -(neighbor.yaw - observer.yaw) / 2  # yaw is clockwise from above in NED, counterclockwise in our body's axes
    position = offboard.level_from_ned([n - o for n, o in zip(neighbor.p, observer.p)], observer.yaw)
    velocity = offboard.level_from_ned([n - o for n, o in zip(neighbor.v, observer.v)], observer.yaw)
    return Pose(t_ns=0, self_id=2, peer=1, name="r1", mode="direct", position=Vector(*position),
                orientation=Quaternion(math.cos(half), 0.0, 0.0, math.sin(half)), velocity=Vector(*velocity),
                up=Vector(0.0, 0.0, 1.0), covariance=covariance)


class SetpointsTest(unittest.TestCase):
    def test_forward_of_a_vehicle_that_faces_east_is_east_and_up_is_not_down(self):
        for ned, level in (((0.0, 1.0, 0.0), (1.0, 0.0, 0.0)), ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), ((0.0, 0.0, -1.0), (0.0, 0.0, 1.0))):
            for found, want in zip(offboard.level_from_ned(ned, math.pi / 2), level):
                self.assertAlmostEqual(found, want)
            for found, want in zip(offboard.ned_from_level(level, math.pi / 2), ned):
                self.assertAlmostEqual(found, want)

    def test_the_place_is_reached_and_kept_behind_a_neighbor_that_flies_any_way(self):
        for yaw, own_yaw in itertools.product((0.3, 2.5, -1.9), (0.0, 1.2, -2.8)):
            with self.subTest(leader=yaw, own=own_yaw):
                self.assertLess(self.worst_error(Drone((5.0, -2.0, -4.0), yaw), own_yaw, 0.0), 0.02)
                # The place then moves by 3.4 m * 0.05 rad/s, which a gain of 0.9 follows 0.19 m behind.
                self.assertLess(self.worst_error(Drone((5.0, -2.0, -4.0), yaw), own_yaw, 0.05), 0.2)

    def worst_error(self, leader, own_yaw, turn_rate):
        """In the last ten of forty seconds [m]."""
        setpoints = offboard.Setpoints(PLACE, TURNED)
        own = Drone((1.0, 0.0, -3.0), own_yaw)
        worst = 0.0
        for i in range(2000):
            now = i * STEP_S
            leader.step(offboard.ned_from_level((0.4, 0.0, 0.0), leader.yaw), turn_rate)
            setpoints.add(pose_of(own, leader), now)
            own.step(*setpoints.at(now, offboard.Vehicle(tuple(own.v), own.yaw)))
            if now > 30.0:
                want = [p + w for p, w in zip(leader.p, offboard.ned_from_level(PLACE, leader.yaw))]
                worst = max(worst, math.dist(own.p, want))
        self.assertAlmostEqual(math.remainder(leader.yaw - TURNED - own.yaw, 2 * math.pi), 0.0, delta=0.1)
        return worst

    def test_speed_and_turn_rate_are_limited(self):
        setpoints = offboard.Setpoints((100.0, 0.0, 0.0), math.pi * 0.9)
        setpoints.add(pose_of(Drone((0.0, 0.0, 0.0), 0.0), Drone((30.0, 10.0, -5.0), 1.0)), 0.0)
        velocity, yaw_rate = setpoints.at(0.0, offboard.Vehicle())
        self.assertLessEqual(math.sqrt(sum(v * v for v in velocity)), offboard.MAX_SPEED * 1.001)
        self.assertLessEqual(abs(yaw_rate), offboard.MAX_TURN_RATE)

    def test_without_a_good_pose_for_half_a_second_it_hovers(self):
        observer, neighbor = Drone((0.0, 0.0, 0.0), 0.0), Drone((9.0, 0.0, 0.0), 0.0)
        uncertain = tuple(0.3 if entry > 0.0 else 0.0 for entry in GOOD)  # 0.55 m
        slanted = tuple((0.24 if row == column else 0.23) if column < 3 else 1e-4 * (row == column)
                        for row in range(6) for column in range(row, 6))  # 0.49 m along each axis, 0.84 m between them
        for useless in (uncertain, slanted, None):
            setpoints = offboard.Setpoints(PLACE)
            self.assertEqual(setpoints.at(0.0, offboard.Vehicle()), offboard.Setpoints.HOVER)
            setpoints.add(pose_of(observer, neighbor), 1.0)
            self.assertNotEqual(setpoints.at(1.4, offboard.Vehicle()), offboard.Setpoints.HOVER)
            setpoints.add(pose_of(observer, neighbor, useless), 1.4)
            self.assertEqual(setpoints.at(1.6, offboard.Vehicle()), offboard.Setpoints.HOVER)


class StubLink:
    """What is used of a pymavlink connection; `waiting` are the autopilot's messages."""

    target_system, target_component = 1, 1

    def __init__(self):
        self.waiting, self.sent = [], []
        self.mav = types.SimpleNamespace(set_position_target_local_ned_send=lambda *fields: self.sent.append(fields))

    def recv_match(self, type, blocking):  # noqa: A002: pymavlink's own name
        assert not blocking
        return self.waiting.pop(0) if self.waiting else None


def mavlink(kind, **fields):
    return types.SimpleNamespace(get_type=lambda: kind, **fields)


class Over(Exception):
    pass


class FlyTest(unittest.TestCase):
    def fly(self, link, seconds, silent_after=math.inf, kinds=("ATTITUDE", "LOCAL_POSITION_NED")):
        """Runs the loop on a clock of its own; poses come at 20 Hz, the autopilot's messages with them."""
        says = {"ATTITUDE": {"yaw": math.pi / 2}, "LOCAL_POSITION_NED": {"vx": 0.0, "vy": 0.0, "vz": 0.0}}
        now = [100.0]

        def receive(timeout_s):
            now[0] += 0.05
            if now[0] > 100.0 + seconds:
                raise Over
            if now[0] < 100.0 + silent_after:
                link.waiting += [mavlink(kind, **says[kind]) for kind in kinds]
            return pose_of(Drone((0.0, 0.0, 0.0), math.pi / 2), Drone((0.0, 9.0, 0.0), math.pi / 2))

        autopilot = offboard.Autopilot(link)
        real, offboard.time.monotonic = offboard.time.monotonic, lambda: now[0]
        try:
            with contextlib.redirect_stdout(io.StringIO()) as printed:
                offboard.fly(autopilot, types.SimpleNamespace(receive=receive), offboard.Setpoints((-3.0, 0.0, 0.0)), lambda: now[0])
        except Over:
            pass
        finally:
            offboard.time.monotonic = real
        return printed.getvalue()

    def test_setpoints_are_velocities_in_local_ned_and_come_often_enough(self):
        link = StubLink()
        self.fly(link, 2.0)

        self.assertGreater(len(link.sent), 2 * 2 * 4)  # PX4 asks for more than two a second
        _, system, component, frame, mask, *fields = link.sent[-1]
        self.assertEqual((system, component, frame, len(fields)), (1, 1, 1, 11))
        ignored = {bit for bit in range(12) if mask >> bit & 1}
        self.assertEqual(ignored, {0, 1, 2, 6, 7, 8, 10})  # position, acceleration, yaw; velocity and yaw rate are used
        north, east, down = fields[3:6]
        self.assertAlmostEqual(north, 0.0, places=6)
        self.assertAlmostEqual(east, offboard.MAX_SPEED, places=6)  # the neighbor is 9 m to the east
        self.assertAlmostEqual(down, 0.0, places=6)

    def test_an_autopilot_that_is_silent_gets_no_setpoints(self):
        link = StubLink()
        self.fly(link, 0.5)
        before = len(link.sent)
        self.assertGreater(before, 5)

        link = StubLink()
        self.fly(link, 5.0, silent_after=0.5)
        self.assertLess(len(link.sent), before + 12)  # for half a second more

    def test_an_autopilot_whose_yaw_is_unknown_gets_no_setpoints_and_the_pilot_is_told(self):
        for kind, other in (("ATTITUDE", "LOCAL_POSITION_NED"), ("LOCAL_POSITION_NED", "ATTITUDE")):
            link = StubLink()

            printed = self.fly(link, 2.0, kinds=(other,))

            self.assertEqual(link.sent, [])
            self.assertIn(f"no setpoints: no {kind} from the autopilot\n", printed)


if __name__ == "__main__":
    unittest.main()
