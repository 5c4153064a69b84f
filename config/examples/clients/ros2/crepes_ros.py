"""What POSE means in ROS, as pure functions: no rclpy, no sockets.

Frames: our body is x forward, y left, z up, as REP 103's base_link; `position` and `orientation` are the
pose of the neighbor's base_link in the observer's.
"""


def matrix_from_upper_triangle(entries):
    """The 6x6 matrix (list of rows) of which POSE stores 21 entries, row by row."""
    matrix = [[0.0] * 6 for _ in range(6)]
    rest = iter(entries)
    for i in range(6):
        for j in range(i, 6):
            matrix[i][j] = matrix[j][i] = float(next(rest))
    return matrix


def rotation_from_quaternion(q):
    """The rotation matrix of {"w", "x", "y", "z"}, Hamilton, of unit length."""
    w, x, y, z = q["w"], q["x"], q["y"], q["z"]
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def multiply(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def transpose(a):
    return [list(column) for column in zip(*a)]


def ros_covariance(entries, orientation):
    """36 numbers, row by row, as PoseWithCovariance wants them.

    POSE: R_true = R Exp(theta), theta in the neighbor's axes. ROS: rotations about the fixed axes of the
    parent frame, R_true = Exp(phi) R. Since Exp(R theta) R = R Exp(theta), phi = R theta, and the
    covariance of [p, phi] is J P J^T with J = diag(I, R).
    """
    R = rotation_from_quaternion(orientation)
    J = [[float(i == j) for j in range(6)] for i in range(6)]
    for i in range(3):
        J[3 + i][3:] = R[i]
    P = matrix_from_upper_triangle(entries)
    return [number for row in multiply(multiply(J, P), transpose(J)) for number in row]


class StampConverter:
    """From the robot's monotonic clock to the system's (ROS) time [ns].

    On the robot itself both clocks can be read, so their difference is exact. Elsewhere, or where
    the daemon's clock is a simulated one, the fastest datagram so far is used: stamps then are late by
    the least delay on the way, some milliseconds.
    """

    PLAUSIBLE_NS = 1_000_000_000

    def __init__(self):
        self._least = None

    def to_system_ns(self, t_ns, monotonic_ns, system_ns):
        """`monotonic_ns` and `system_ns` are this machine's clocks when the datagram arrived."""
        if 0 <= monotonic_ns - t_ns < self.PLAUSIBLE_NS:
            return t_ns + system_ns - monotonic_ns
        delay = system_ns - t_ns
        self._least = delay if self._least is None else min(self._least, delay)
        return t_ns + self._least


def frame_of(robot_id, frame_format="robot_{id}/base_link"):
    return frame_format.format(id=robot_id)


def split_ns(ns):
    """Seconds and nanoseconds of builtin_interfaces/Time."""
    return divmod(ns, 1_000_000_000)
