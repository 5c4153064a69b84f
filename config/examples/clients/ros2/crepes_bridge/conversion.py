"""What POSE means in ROS, as pure functions: no rclpy, no sockets, no clocks.

Messages are nested dicts of their fields; the node copies them into the real ones.

Frames: our body is x forward, y left, z up, as REP 103's base_link. `position` and `orientation` are the
pose of the neighbor's base_link in the observer's.
"""
import ipaddress
import re

UNKNOWN_VARIANCE = 1e6  #: so large that no filter uses the value


def rotation_from_quaternion(q):
    """The rotation matrix of (w, x, y, z), Hamilton, of unit length."""
    w, x, y, z = q
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def multiply(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def transpose(a):
    return [list(column) for column in zip(*a)]


def ros_covariance(P, orientation):
    """36 numbers, row by row, as PoseWithCovariance wants them; P are the six rows of POSE's covariance.

    POSE: R_true = R Exp(theta), theta in the neighbor's axes. ROS: rotations about the fixed axes of the
    parent frame, R_true = Exp(phi) R. Since Exp(R theta) R = R Exp(theta), phi = R theta, and the
    covariance of [p, phi] is J P J^T with J = diag(I, R).
    """
    R = rotation_from_quaternion(orientation)
    J = [[float(i == j) for j in range(6)] for i in range(6)]
    for i in range(3):
        J[3 + i][3:] = R[i]
    return [number for row in multiply(multiply(J, P), transpose(J)) for number in row]


def unknown_covariance():
    return [UNKNOWN_VARIANCE * (i % 7 == 0) for i in range(36)]


def child_velocity(velocity, orientation):
    """From the observer's axes to the neighbor's, as Odometry wants its twist: R^T v."""
    R = rotation_from_quaternion(orientation)
    return [sum(R[i][j] * velocity[i] for i in range(3)) for j in range(3)]


def frame_of(robot_id, frame_format):
    return frame_format.format(id=robot_id)


def topic_part(name):
    """A name that ROS allows in a topic."""
    part = re.sub(r"[^A-Za-z0-9_]", "_", name)
    return part if re.match(r"[A-Za-z_]", part) else "robot_" + part


def time_of(ns):
    """builtin_interfaces/Time."""
    sec, nanosec = divmod(ns, 1_000_000_000)
    return {"sec": sec, "nanosec": nanosec}


def header(pose, stamp_ns, frame_format):
    return {"stamp": time_of(stamp_ns), "frame_id": frame_of(pose.self_id, frame_format)}


def xyz(vector):
    return dict(zip("xyz", vector))


def pose_with_covariance(pose):
    P = pose.covariance_matrix()
    return {
        "pose": {"position": xyz(pose.position), "orientation": pose.orientation._asdict()},
        "covariance": ros_covariance(P, pose.orientation) if P else unknown_covariance(),
    }


def pose_message(pose, stamp_ns, frame_format):
    """geometry_msgs/PoseWithCovarianceStamped."""
    return {"header": header(pose, stamp_ns, frame_format), "pose": pose_with_covariance(pose)}


def odometry_message(pose, stamp_ns, frame_format):
    """nav_msgs/Odometry. The twist is the difference of both robots' velocities over ground, in the
    neighbor's axes; the daemon states neither its covariance nor a rate of turn."""
    velocity = child_velocity(pose.velocity or (0.0, 0.0, 0.0), pose.orientation)
    return {
        "header": header(pose, stamp_ns, frame_format),
        "child_frame_id": frame_of(pose.peer, frame_format),
        "pose": pose_with_covariance(pose),
        "twist": {"twist": {"linear": xyz(velocity), "angular": xyz((0.0, 0.0, 0.0))},
                  "covariance": unknown_covariance()},
    }


def transform_message(pose, stamp_ns, frame_format):
    """geometry_msgs/TransformStamped."""
    return {
        "header": header(pose, stamp_ns, frame_format),
        "child_frame_id": frame_of(pose.peer, frame_format),
        "transform": {"translation": xyz(pose.position), "rotation": pose.orientation._asdict()},
    }


def is_this_machine(address):
    """Whether the daemon's monotonic clock is also ours."""
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return address == "localhost"


class StampConverter:
    """From the robot's monotonic clock to ROS time [ns].

    On the robot itself both clocks can be read, so their difference is exact (`method` "exact").
    Elsewhere, or where the daemon's clock is a simulated one, the fastest datagram of the last half to
    one minute counts ("fastest datagram"): stamps then are late by the least delay on the way, some
    milliseconds. A longer memory would let the drift of the clocks in.
    """

    PLAUSIBLE_AGE_NS = 1_000_000_000
    WINDOW_NS = 30_000_000_000

    def __init__(self, same_machine):
        self._same_machine = same_machine
        self._window_end = self._before = self._current = None
        self.offset_ns = self.method = None  #: of the last stamp: ROS time minus the daemon's clock

    def to_ros_ns(self, t_ns, monotonic_ns, ros_ns):
        """`monotonic_ns` and `ros_ns` are this machine's clocks when the datagram arrived."""
        if self._same_machine and 0 <= monotonic_ns - t_ns < self.PLAUSIBLE_AGE_NS:
            self.offset_ns, self.method = ros_ns - monotonic_ns, "exact"
        else:
            self.offset_ns, self.method = self._least(ros_ns - t_ns, ros_ns), "fastest datagram"
        return t_ns + self.offset_ns

    def _least(self, delay, ros_ns):
        has_jumped = self._current is not None and abs(delay - self._current) > self.PLAUSIBLE_AGE_NS
        if self._window_end is None or has_jumped:
            self._window_end, self._before, self._current = ros_ns + self.WINDOW_NS, delay, delay
        if ros_ns >= self._window_end:
            self._window_end, self._before, self._current = ros_ns + self.WINDOW_NS, self._current, delay
        self._current = min(self._current, delay)
        return min(self._before, self._current)
