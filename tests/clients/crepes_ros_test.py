"""What POSE becomes in ROS, without ROS: run by ctest as `python3 -m unittest`."""
import math
import pathlib
import random
import sys
import unittest

CLIENTS = pathlib.Path(__file__).resolve().parents[2] / "config" / "examples" / "clients"
sys.path.insert(0, str(CLIENTS / "ros2"))
import crepes_ros  # noqa: E402


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


def named(q):
    return dict(zip("wxyz", q))


def upper_triangle(P):
    return [P[i][j] for i in range(6) for j in range(i, 6)]


class Covariance(unittest.TestCase):
    def test_keeps_position_and_turns_the_rotation_into_the_parents_axes(self):
        # A neighbor that is turned left by 90 degrees: its x axis is our y axis.
        left = named(exp((0.0, 0.0, math.pi / 2)))
        P = [[0.0] * 6 for _ in range(6)]
        for i, variance in enumerate((1.0, 2.0, 3.0, 0.1, 0.2, 0.3)):
            P[i][i] = variance
        P[0][3] = P[3][0] = 0.05  # our x with a rotation about its x axis, which is our y axis

        ros = crepes_ros.ros_covariance(upper_triangle(P), left)

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
        theta_covariance = crepes_ros.multiply(L, crepes_ros.transpose(L))
        P = [[0.0] * 6 for _ in range(6)]
        for i in range(3):
            P[3 + i][3:] = theta_covariance[i]
        ros = crepes_ros.ros_covariance(upper_triangle(P), named(R))

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
                # 20000 samples tell a variance of at most 1.4e-3 to 1.4e-5 (one sigma); four of them.
                self.assertAlmostEqual(ros[6 * (3 + i) + 3 + j], spread[i][j], delta=6e-5)

    def test_is_symmetric_and_row_by_row(self):
        source = random.Random(2)
        entries = [source.uniform(-1, 1) for _ in range(21)]

        ros = crepes_ros.ros_covariance(entries, named(exp((0.3, 0.2, -0.9))))

        self.assertEqual(len(ros), 36)
        for i in range(6):
            for j in range(6):
                self.assertAlmostEqual(ros[6 * i + j], ros[6 * j + i])
        for k, (i, j) in enumerate((i, j) for i in range(3) for j in range(i, 3)):
            self.assertAlmostEqual(ros[6 * i + j], entries[{0: 0, 1: 1, 2: 2, 3: 6, 4: 7, 5: 11}[k]])


class Rotation(unittest.TestCase):
    def test_takes_the_neighbors_axes_to_ours(self):
        left = crepes_ros.rotation_from_quaternion(named(exp((0.0, 0.0, math.pi / 2))))

        for row, expected in zip(left, ((0, -1, 0), (1, 0, 0), (0, 0, 1))):
            for value, wanted in zip(row, expected):
                self.assertAlmostEqual(value, wanted)


class Stamps(unittest.TestCase):
    def test_are_exact_where_both_clocks_can_be_read(self):
        stamps = crepes_ros.StampConverter()

        self.assertEqual(stamps.to_system_ns(5_000_000_000, 5_003_000_000, 1_700_000_000_000_000_000),
                         1_699_999_999_997_000_000)

    def test_follow_the_fastest_datagram_elsewhere(self):
        stamps = crepes_ros.StampConverter()
        other_clock, offset = 90_000_000_000_000, 1_700_000_000_000_000_000
        results = []
        for i, delay_ms in enumerate((9, 4, 12, 4)):
            t_ns = other_clock + i * 20_000_000
            arrival = t_ns + offset + delay_ms * 1_000_000
            results.append(stamps.to_system_ns(t_ns, 7, arrival) - t_ns - offset)

        self.assertEqual(results, [9_000_000, 4_000_000, 4_000_000, 4_000_000])

    def test_split_into_seconds_and_nanoseconds(self):
        self.assertEqual(crepes_ros.split_ns(1_700_000_000_123_456_789), (1_700_000_000, 123_456_789))


class Frames(unittest.TestCase):
    def test_are_named_by_robot(self):
        self.assertEqual(crepes_ros.frame_of(3), "robot_3/base_link")
        self.assertEqual(crepes_ros.frame_of(3, "r{id}"), "r3")


if __name__ == "__main__":
    unittest.main()
