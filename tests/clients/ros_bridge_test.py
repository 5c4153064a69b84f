"""What POSE and STATUS become in ROS, without ROS: conversions by themselves, the node with a stub that has
the published interfaces. Run by ctest as `python3 -m unittest`."""
import contextlib
import importlib.util
import io
import json
import math
import pathlib
import random
import re
import subprocess
import sys
import unittest
import xml.etree.ElementTree
from unittest import mock

HERE = pathlib.Path(__file__).resolve().parent
CLIENTS = HERE.parents[1] / "config" / "examples" / "clients"
ROS2 = CLIENTS / "ros2"
for folder in (HERE / "fake_ros", CLIENTS / "python", ROS2):
    sys.path.insert(0, str(folder))
import crepes_client  # noqa: E402
import interfaces  # noqa: E402
import rclpy  # noqa: E402
from crepes_bridge import bridge, conversion, diagnostics  # noqa: E402
from crepes_bridge.parameters import PARAMETERS  # noqa: E402
from crepes_client import Clock, Neighbor, Pose, Quaternion, Sensor, Status, Vector  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402


def exp(v):
    """The unit quaternion (w, x, y, z) of a rotation vector."""
    angle = math.sqrt(sum(x * x for x in v))
    if angle < 1e-12:
        return (1.0, v[0] / 2, v[1] / 2, v[2] / 2)
    s = math.sin(angle / 2) / angle
    return (math.cos(angle / 2), s * v[0], s * v[1], s * v[2])


def log(q):
    w, v = q[0], q[1:]
    norm = math.sqrt(sum(x * x for x in v))
    if norm < 1e-12:
        return tuple(2 * x for x in v)
    angle = 2 * math.atan2(norm, w)
    return tuple(angle * x / norm for x in v)


def times(a, b):
    return (a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0])


def conjugate(q):
    return (q[0], -q[1], -q[2], -q[3])


def pose_of(**changes):
    """A neighbor ahead and to the left that is turned left by 90 degrees: its x axis is our y axis."""
    values = dict(t_ns=5_000_000_000, self_id=1, peer=2, name="r2", mode="direct", position=Vector(3.0, 1.0, 0.5),
                  orientation=Quaternion(*exp((0.0, 0.0, math.pi / 2))), velocity=Vector(1.0, 2.0, 3.0),
                  covariance=tuple(0.01 * (i + 1) for i in range(21)))
    return Pose(**{**values, **changes})


class Covariance(unittest.TestCase):
    def test_keeps_position_and_turns_the_rotation_into_the_parents_axes(self):
        # A neighbor that is turned left by 90 degrees: its x axis is our y axis.
        left = exp((0.0, 0.0, math.pi / 2))
        P = [[0.0] * 6 for _ in range(6)]
        for i, variance in enumerate((1.0, 2.0, 3.0, 0.1, 0.2, 0.3)):
            P[i][i] = variance
        P[0][3] = P[3][0] = 0.05  # our x with a rotation about its x axis, which is our y axis

        ros = conversion.ros_covariance(P, left)

        diagonal = [ros[7 * i] for i in range(6)]
        for value, expected in zip(diagonal, (1.0, 2.0, 3.0, 0.2, 0.1, 0.3)):
            self.assertAlmostEqual(value, expected)
        self.assertAlmostEqual(ros[0 * 6 + 4], 0.05)
        self.assertAlmostEqual(ros[4 * 6 + 0], 0.05)
        self.assertAlmostEqual(ros[0 * 6 + 3], 0.0)

    def test_is_what_samples_of_the_error_spread_like(self):
        source = random.Random(1)
        R = exp((0.4, -1.1, 0.7))
        # theta = L z with a small L: its covariance in the neighbor's axes is L L^T.
        L = [[0.02, 0.0, 0.0], [0.01, 0.03, 0.0], [-0.02, 0.005, 0.01]]
        theta_covariance = conversion.multiply(L, conversion.transpose(L))
        P = [[0.0] * 6 for _ in range(6)]
        for i in range(3):
            P[3 + i][3:] = theta_covariance[i]
        ros = conversion.ros_covariance(P, R)

        samples = 20000
        spread = [[0.0] * 3 for _ in range(3)]
        for _ in range(samples):
            z = [source.gauss(0, 1) for _ in range(3)]
            theta = [sum(l * x for l, x in zip(row, z)) for row in L]
            truth = times(R, exp(theta))  # R_true = R Exp(theta)
            phi = log(times(truth, conjugate(R)))  # R_true = Exp(phi) R: about the parent's axes
            for i in range(3):
                for j in range(3):
                    spread[i][j] += phi[i] * phi[j] / samples

        for i in range(3):
            for j in range(3):
                # 20000 samples determine a variance of at most 1.4e-3 to 1.4e-5 (one sigma); four of them.
                self.assertAlmostEqual(ros[6 * (3 + i) + 3 + j], spread[i][j], delta=6e-5)

    def test_is_symmetric_and_row_by_row(self):
        source = random.Random(2)
        entries = tuple(source.uniform(-1, 1) for _ in range(21))

        ros = conversion.ros_covariance(pose_of(covariance=entries).covariance_matrix(), exp((0.3, 0.2, -0.9)))

        self.assertEqual(len(ros), 36)
        for i in range(6):
            for j in range(6):
                self.assertAlmostEqual(ros[6 * i + j], ros[6 * j + i])
        for k, (i, j) in enumerate((i, j) for i in range(3) for j in range(i, 3)):
            self.assertAlmostEqual(ros[6 * i + j], entries[{0: 0, 1: 1, 2: 2, 3: 6, 4: 7, 5: 11}[k]])


class Rotation(unittest.TestCase):
    def test_takes_the_neighbors_axes_to_ours(self):
        left = conversion.rotation_from_quaternion(exp((0.0, 0.0, math.pi / 2)))

        for row, expected in zip(left, ((0, -1, 0), (1, 0, 0), (0, 0, 1))):
            for value, wanted in zip(row, expected):
                self.assertAlmostEqual(value, wanted)


class TheOdometry(unittest.TestCase):
    def test_has_its_twist_in_the_neighbors_axes_and_calls_it_uncertain(self):
        twist = conversion.odometry_message(pose_of(), 0, "r{id}")["twist"]

        linear = twist["twist"]["linear"]
        for axis, expected in zip("xyz", (2.0, -1.0, 3.0)):  # our y is its x, our x is its -y
            self.assertAlmostEqual(linear[axis], expected)
        self.assertEqual([twist["covariance"][7 * i] for i in range(6)], [1e6] * 6)
        self.assertEqual(sum(twist["covariance"]), 6e6)

    def test_of_a_pose_that_moves_as_its_twist_says_stays_on_its_path(self):
        # The velocity in our axes, from Odometry as tf would turn it back: R twist.
        R = exp((0.3, -0.8, 1.2))
        pose = pose_of(orientation=Quaternion(*R))
        linear = conversion.odometry_message(pose, 0, "r{id}")["twist"]["twist"]["linear"]

        turned = times(times(R, (0.0, linear["x"], linear["y"], linear["z"])), conjugate(R))[1:]

        for value, expected in zip(turned, pose.velocity):
            self.assertAlmostEqual(value, expected)


class Messages(unittest.TestCase):
    """Every field is one that the published interface has, of its type: `fill` fails otherwise."""

    def test_hold_the_pose_in_the_frame_of_the_observer(self):
        fields = conversion.pose_message(pose_of(), 7_000_000_001, "robot_{id}/base_link")
        message = bridge.fill(bridge.PoseWithCovarianceStamped(), fields)

        self.assertEqual((message.header.stamp.sec, message.header.stamp.nanosec), (7, 1))
        self.assertEqual(message.header.frame_id, "robot_1/base_link")
        self.assertEqual((message.pose.pose.position.x, message.pose.pose.position.z), (3.0, 0.5))
        self.assertAlmostEqual(message.pose.pose.orientation.z, math.sqrt(0.5))
        self.assertAlmostEqual(message.pose.covariance[0], 0.01)

    def test_hold_odometry_and_transform_from_observer_to_neighbor(self):
        odometry = bridge.fill(Odometry(), conversion.odometry_message(pose_of(), 0, "r{id}"))
        transform = bridge.fill(bridge.TransformStamped(), conversion.transform_message(pose_of(), 0, "r{id}"))

        self.assertEqual((odometry.header.frame_id, odometry.child_frame_id), ("r1", "r2"))
        self.assertEqual((transform.header.frame_id, transform.child_frame_id), ("r1", "r2"))
        self.assertEqual(transform.transform.translation.x, 3.0)
        self.assertEqual(odometry.pose.pose.position.y, 1.0)

    def test_without_covariance_or_velocity_say_that_nothing_is_known(self):
        pose = pose_of(covariance=None, velocity=None)
        message = bridge.fill(Odometry(), conversion.odometry_message(pose, 0, "r{id}"))

        self.assertEqual(message.pose.covariance[0], 1e6)
        self.assertEqual(message.twist.twist.linear.x, 0.0)

    def test_of_the_stub_refuse_wrong_names_types_and_sizes(self):
        message = Odometry()
        for change in (lambda: setattr(message, "frame", ""), lambda: setattr(message, "child_frame_id", 3),
                       lambda: setattr(message.pose, "covariance", [0.0] * 21),
                       lambda: setattr(message.header.stamp, "nanosec", -1),
                       lambda: setattr(message.pose.pose.position, "x", 1)):
            with self.assertRaises((AssertionError, KeyError)):
                change()


STATUS = Status(
    self_id=1, name="r1", uptime_s=9.0, faults=("camera is turned by 20 deg",), clocks=(Clock(2, -3.5),),
    sensors=(Sensor("imu", True, 100.0), Sensor("uwb", False, 0.0, "silent: is it powered?", {"dropped": 4})),
    neighbors=(Neighbor(2, "direct", None, "r2", 0.01), Neighbor(3, "none", "no range", "r3"),
               Neighbor(4, "predicted"), Neighbor(5, "graph", name="r5", faults=("ranges 1.0 m too long",))))


class Diagnostics(unittest.TestCase):
    def entries(self):
        message = bridge.fill(bridge.DiagnosticArray(),
                              diagnostics.array(7_000_000_001, diagnostics.entries_of(STATUS)))
        return {entry.name: entry for entry in message.status}

    def values(self, entry):
        return {pair.key: pair.value for pair in entry.values}

    def test_name_each_sensor_with_what_to_do(self):
        uwb = self.entries()["crepes r1: sensor uwb"]

        self.assertEqual((uwb.level, uwb.message, uwb.hardware_id), (b"\x02", "silent: is it powered?", "robot_1"))
        self.assertEqual(self.values(uwb)["dropped"], "4")
        self.assertEqual(self.entries()["crepes r1: sensor imu"].level, b"\x00")

    def test_name_each_neighbors_mode_and_the_reason_where_there_is_no_pose(self):
        entries = self.entries()
        levels = {name[-2:]: entry.level for name, entry in entries.items() if "neighbor" in name}

        self.assertEqual(levels, {"r2": b"\x00", "r3": b"\x01", " 4": b"\x01", "r5": b"\x01"})
        self.assertEqual(entries["crepes r1: neighbor r3"].message, "no pose: no range")
        self.assertEqual(self.values(entries["crepes r1: neighbor r3"])["reason"], "no range")
        self.assertEqual(self.values(entries["crepes r1: neighbor r2"])["mode"], "direct")
        self.assertEqual(self.values(entries["crepes r1: neighbor r5"])["fault 1"], "ranges 1.0 m too long")

    def test_report_what_contradicts_the_team_and_the_clocks(self):
        robot = self.entries()["crepes r1: robot"]

        self.assertEqual((robot.level, robot.message), (b"\x01", "camera is turned by 20 deg"))
        self.assertEqual(self.values(robot)["clock of 2 minus ours [s]"], "-3.5")

    def test_state_the_offset_of_the_stamps_and_a_daemon_that_is_silent(self):
        stamps = conversion.StampConverter(True)
        stamps.to_ros_ns(5_000_000_000, 5_001_000_000, 1_700_000_000_000_000_000)

        fine = diagnostics.bridge_entry("here", 0.1, 3.0, None, stamps)
        silent = diagnostics.bridge_entry("here", 3.1, 3.0, None, stamps)

        values = {pair["key"]: pair["value"] for pair in fine["values"]}
        self.assertEqual(values["stamps"], "exact")
        self.assertEqual(values["ROS time minus daemon's clock [ns]"], "1699999994999000000")
        self.assertEqual((fine["level"], silent["level"]), (b"\x00", b"\x02"))
        self.assertEqual(silent["message"], "no answer from here")


class Stamps(unittest.TestCase):
    SECOND = 1_000_000_000

    def test_are_exact_where_both_clocks_can_be_read(self):
        stamps = conversion.StampConverter(same_machine=True)

        self.assertEqual(stamps.to_ros_ns(5_000_000_000, 5_003_000_000, 1_700_000_000_000_000_000),
                         1_699_999_999_997_000_000)
        self.assertEqual(stamps.method, "exact")

    def late_by(self, stamps, delays_ms, period_ns=20_000_000, skew=0.0):
        """How late the stamps of datagrams are that travelled for so long, from a robot of another clock."""
        other_clock, offset = 90_000 * self.SECOND, 1_700_000_000 * self.SECOND
        late = []
        for i, delay_ms in enumerate(delays_ms):
            t_ns = other_clock + i * period_ns
            true_ns = t_ns + offset + round(i * period_ns * skew)
            late.append(stamps.to_ros_ns(t_ns, t_ns + 7, true_ns + round(delay_ms * 1e6)) - true_ns)
        return late

    def test_follow_the_fastest_datagram_of_another_machine_even_if_its_clock_looks_like_ours(self):
        late = self.late_by(conversion.StampConverter(same_machine=False), (9, 4, 12, 4))

        self.assertEqual(late, [9_000_000, 4_000_000, 4_000_000, 4_000_000])

    def test_follow_the_drift_of_the_other_clock(self):
        # 100 ppm for ten minutes are 60 ms; within the window it is at most 6 ms.
        late = self.late_by(conversion.StampConverter(False), [2.0] * 6000, self.SECOND // 10, 1e-4)

        self.assertLess(max(abs(error - 2_000_000) for error in late), 6_100_000)

    def test_follow_a_robot_that_was_started_again(self):
        stamps = conversion.StampConverter(False)
        self.late_by(stamps, [2.0] * 10)

        self.assertEqual(stamps.to_ros_ns(self.SECOND, 0, 1_700_000_000 * self.SECOND), 1_700_000_000 * self.SECOND)

    def test_of_a_simulated_daemon_on_this_machine_follow_the_fastest_datagram(self):
        stamps = conversion.StampConverter(same_machine=True)

        self.assertEqual(stamps.to_ros_ns(77 * self.SECOND, self.SECOND, 5 * self.SECOND), 5 * self.SECOND)
        self.assertEqual(stamps.method, "fastest datagram")

    def test_split_into_seconds_and_nanoseconds(self):
        self.assertEqual(conversion.time_of(1_700_000_000_123_456_789),
                         {"sec": 1_700_000_000, "nanosec": 123_456_789})

    def test_are_read_from_this_machines_clock_at_its_own_addresses_only(self):
        self.assertTrue(all(map(conversion.is_this_machine, ("127.0.0.1", "127.1.2.3", "::1", "localhost"))))
        self.assertFalse(any(map(conversion.is_this_machine, ("192.168.1.7", "fe80::1", "robot7"))))


class Names(unittest.TestCase):
    def test_of_frames_are_by_robot(self):
        self.assertEqual(conversion.frame_of(3, "robot_{id}/base_link"), "robot_3/base_link")
        self.assertEqual(conversion.frame_of(3, "r{id}"), "r3")

    def test_of_topics_are_such_as_ros_allows(self):
        for name, expected in (("r2", "r2"), ("r-2.b", "r_2_b"), ("2nd", "robot_2nd"), ("", "robot_")):
            self.assertEqual(conversion.topic_part(name), expected)


class FakeConnection:
    """Delivers what it is given, then ends ROS."""

    def __init__(self, *messages, silent_s=0.0):
        self.messages, self.silent_s, self.version = list(messages), silent_s, None

    def __call__(self, *arguments, **options):
        self.arguments, self.options = arguments, options
        return self

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def receive(self, _timeout_s):
        message = self.messages.pop(0) if self.messages else None
        if not self.messages:
            rclpy._left = 0
        return message


class TheNode(unittest.TestCase):
    def published(self, connection, *parameters):
        """(topic, message) of all that the node publishes, and what it logs."""
        rclpy._left = 1000
        reported, logged = io.StringIO(), io.StringIO()
        with mock.patch.object(crepes_client, "Connection", connection), \
                mock.patch.object(sys, "argv", ["bridge", "--ros-args", *parameters]), \
                contextlib.redirect_stdout(reported), contextlib.redirect_stderr(logged):
            bridge.main()
        lines = [json.loads(line) for line in reported.getvalue().splitlines()]
        return [(line["topic"], line["message"]) for line in lines], logged.getvalue()

    def test_publishes_pose_odometry_transform_and_diagnostics(self):
        connection = FakeConnection(pose_of(), STATUS)

        published, _ = self.published(connection, "publish_tf:=true", "port:=48000", "rate_hz:=20.0")

        self.assertEqual([topic for topic, _ in published],
                         ["crepes/r2/pose", "crepes/r2/odometry", "/tf", "/diagnostics"])
        self.assertEqual(len(published[3][1]["status"]), 8)
        self.assertEqual(connection.arguments, ("127.0.0.1", 48000))
        self.assertEqual(connection.options, {"rate_hz": 20.0, "poll_s": 1.0})

    def test_takes_whole_numbers_for_rates_too(self):
        connection = FakeConnection(pose_of())

        self.published(connection, "rate_hz:=20", "diagnostics_period_s:=2")

        self.assertEqual(connection.options, {"rate_hz": 20.0, "poll_s": 2.0})
        self.assertIsInstance(connection.options["rate_hz"], float)

    def test_leaves_out_what_is_not_wanted(self):
        published, _ = self.published(FakeConnection(pose_of()), "publish_odometry:=false")

        self.assertEqual([topic for topic, _ in published], ["crepes/r2/pose"])

    def test_says_that_the_daemon_is_silent_and_goes_on(self):
        published, logged = self.published(FakeConnection(None, None, silent_s=4.0))

        self.assertEqual(published[0][1]["status"][0]["level"], "02")
        self.assertEqual(logged, "no answer from 127.0.0.1 port 47475\n")

    def test_logs_what_the_daemon_refuses(self):
        _, logged = self.published(FakeConnection(crepes_client.Error("too many")))

        self.assertEqual(logged, "too many\n")

    def test_refuses_a_period_that_would_never_end(self):
        with self.assertRaisesRegex(ValueError, "diagnostics_period_s"):
            self.published(FakeConnection(), "diagnostics_period_s:=0.0")


def loaded(file):
    spec = importlib.util.spec_from_file_location("loaded", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class ThePackage(unittest.TestCase):
    def test_depends_on_every_ros_package_that_it_imports(self):
        root = xml.etree.ElementTree.parse(ROS2 / "package.xml").getroot()
        declared = {element.text for element in root.findall("exec_depend")}
        sources = [*ROS2.glob("crepes_bridge/*.py"), *ROS2.glob("launch/*.py")]
        imported = {match for file in sources
                    for match in re.findall(r"^\s*(?:from|import) (\w+)", file.read_text(), re.MULTILINE)}

        ours = {"crepes_bridge", "crepes_client"}
        self.assertEqual(imported - set(sys.stdlib_module_names) - ours, declared)
        self.assertEqual(root.find("export/build_type").text, "ament_python")

    def test_installs_where_ros_looks(self):
        reported = subprocess.run([sys.executable, "-B", "-c", "import setuptools, json, runpy\n"
                               "kept = {}\nsetuptools.setup = lambda **words: kept.update(words)\n"
                               "runpy.run_path('setup.py')\nprint(json.dumps(kept))"],
                              cwd=ROS2, capture_output=True, text=True, check=True).stdout
        words = json.loads(reported)

        name = xml.etree.ElementTree.parse(ROS2 / "package.xml").find("name").text
        self.assertEqual(words["name"], name)
        files = [file for _, files in words["data_files"] for file in files]
        self.assertIn(f"resource/{name}", files)
        self.assertTrue(all((ROS2 / file).exists() for file in files))
        self.assertEqual(words["entry_points"]["console_scripts"], [f"bridge = {name}.bridge:main"])
        self.assertIn(f"/lib/{name}", (ROS2 / "setup.cfg").read_text())
        self.assertEqual(words["version"], xml.etree.ElementTree.parse(ROS2 / "package.xml").find("version").text)

    def test_launches_the_node_with_every_parameter_as_an_argument(self):
        *arguments, node = loaded(ROS2 / "launch" / "bridge.launch.py").generate_launch_description().entities

        self.assertEqual([argument.name for argument in arguments], [parameter.name for parameter in PARAMETERS])
        self.assertEqual({argument.name: argument.default_value for argument in arguments}["publish_tf"], "false")
        self.assertEqual((node.package, node.executable), ("crepes_bridge", "bridge"))
        self.assertEqual({name: value.value_type for name, value in node.parameters[0].items()},
                         {parameter.name: type(parameter.default) for parameter in PARAMETERS})

    def test_fills_only_lists_of_messages_that_the_interfaces_have(self):
        lists = {line.split()[1] for definition in interfaces.DEFINITIONS.values()
                 for line in definition.split(";") if line.split()[0].endswith("[]")}

        self.assertEqual(lists, set(bridge.ELEMENTS))


if __name__ == "__main__":
    unittest.main()
