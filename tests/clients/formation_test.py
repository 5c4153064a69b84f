"""The example that holds a formation (examples/formation.py), with perfect poses and ideal robots."""
import importlib.util
import math
import pathlib
import sys
import unittest

CLIENT = pathlib.Path(__file__).resolve().parents[2] / "config/examples/clients/python"
sys.path.insert(0, str(CLIENT))
SPEC = importlib.util.spec_from_file_location("formation", CLIENT / "examples/formation.py")
formation = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(formation)

from crepes_client import Pose, Quaternion, Vector  # noqa: E402

STEP_S = 0.01
SPEED = 2 * math.pi * formation.RADIUS / formation.PERIOD_S  # m/s, of the leader


def turned(yaw, v):
    c, s = math.cos(yaw), math.sin(yaw)
    return c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]


class Robot:
    """Its velocity follows commands through three lags, as in the simulated world."""

    def __init__(self, p, yaw):
        self.p, self.yaw, self.command, self.turn = list(p), yaw, (0.0, 0.0, 0.0), 0.0
        self.stages = [[0.0] * 3 for _ in range(3)]

    def step(self):
        before = turned(self.yaw, self.command)
        for stage in self.stages:
            for axis in range(3):
                stage[axis] += 6.0 * STEP_S * (before[axis] - stage[axis])
            before = stage
        self.p = [p + STEP_S * v for p, v in zip(self.p, self.stages[-1])]
        self.yaw += STEP_S * self.turn


def pose_of(observer, neighbor):
    """What a daemon without errors would say."""
    def level(v):
        return Vector(*turned(-observer.yaw, v))

    half = (neighbor.yaw - observer.yaw) / 2
    return Pose(t_ns=0, self_id=0, peer=1, name="r1", mode="direct",
                position=level([n - o for n, o in zip(neighbor.p, observer.p)]),
                orientation=Quaternion(math.cos(half), 0.0, 0.0, math.sin(half)),
                velocity=level([n - o for n, o in zip(neighbor.stages[-1], observer.stages[-1])]), up=Vector(0.0, 0.0, 1.0))


class FormationTest(unittest.TestCase):
    def test_followers_reach_their_places_and_keep_them_behind_a_leader_that_moves(self):
        leader = Robot((0.0, 0.0, 1.4), 0.3)
        for place, turn in formation.PLACES.values():
            with self.subTest(place=place):
                self.assertLess(self.worst_error(leader, place, turn, moves=False), 0.01)
                self.assertLess(self.worst_error(leader, place, turn, moves=True), 0.1)

    def worst_error(self, leader, place, turn, moves):
        """In the last twenty of sixty seconds [m]."""
        control = formation.Follower(place, turn)
        robot = Robot([leader.p[0] + 3.0, leader.p[1] + 0.5 * place[1], 1.0], place[2] + 0.4)
        worst = 0.0
        for i in range(6000):
            phase = 2 * math.pi * i * STEP_S / formation.PERIOD_S
            leader.command = (-SPEED * math.sin(phase), SPEED * math.cos(phase), 0.0) if moves else (0.0, 0.0, 0.0)
            if i % 5 == 0:
                robot.command, robot.turn = control.command(pose_of(robot, leader), 0.05)
            leader.step()
            robot.step()
            want = turned(leader.yaw, place)
            if i >= 4000:
                worst = max(worst, math.dist(robot.p, [p + w for p, w in zip(leader.p, want)]))
        return worst

    def test_a_tilted_body_flies_level(self):
        tilt = math.radians(20.0)
        level = formation.Level((math.sin(tilt), 0.0, math.cos(tilt)))  # nose up
        ahead = level((math.cos(tilt), 0.0, -math.sin(tilt)))
        self.assertAlmostEqual(ahead[0], 1.0)
        self.assertAlmostEqual(ahead[2], 0.0)


if __name__ == "__main__":
    unittest.main()
