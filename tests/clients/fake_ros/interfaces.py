"""Message classes as rosidl generates them, from the published definitions of ros2/common_interfaces and
ros2/rcl_interfaces (Humble to Jazzy; comments left out): as strict in names, types and ranges."""

DEFINITIONS = {
    "builtin_interfaces/Time": "int32 sec; uint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp; string frame_id",
    "geometry_msgs/Point": "float64 x; float64 y; float64 z",
    "geometry_msgs/Vector3": "float64 x; float64 y; float64 z",
    "geometry_msgs/Quaternion": "float64 x; float64 y; float64 z; float64 w 1",
    "geometry_msgs/Pose": "geometry_msgs/Point position; geometry_msgs/Quaternion orientation",
    "geometry_msgs/PoseWithCovariance": "geometry_msgs/Pose pose; float64[36] covariance",
    "geometry_msgs/PoseWithCovarianceStamped": "std_msgs/Header header; geometry_msgs/PoseWithCovariance pose",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear; geometry_msgs/Vector3 angular",
    "geometry_msgs/TwistWithCovariance": "geometry_msgs/Twist twist; float64[36] covariance",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation; geometry_msgs/Quaternion rotation",
    "geometry_msgs/TransformStamped": "std_msgs/Header header; string child_frame_id; geometry_msgs/Transform transform",
    "nav_msgs/Odometry": "std_msgs/Header header; string child_frame_id; geometry_msgs/PoseWithCovariance pose;"
                         " geometry_msgs/TwistWithCovariance twist",
    "diagnostic_msgs/KeyValue": "string key; string value",
    "diagnostic_msgs/DiagnosticStatus": "byte level; string name; string message; string hardware_id;"
                                        " diagnostic_msgs/KeyValue[] values",
    "diagnostic_msgs/DiagnosticArray": "std_msgs/Header header; diagnostic_msgs/DiagnosticStatus[] status",
}
RANGES = {"int32": (-(2**31), 2**31), "uint32": (0, 2**32)}
DEFAULTS = {"int32": 0, "uint32": 0, "float64": 0.0, "string": "", "byte": b"\x00"}


def is_of(kind, value):
    """Whether rclpy would take the value for a field of this kind."""
    if kind.endswith("[]"):
        return isinstance(value, list) and all(is_of(kind[:-2], element) for element in value)
    if kind == "float64[36]":
        return len(value) == 36 and all(isinstance(number, float) for number in value)
    if kind in RANGES:
        low, high = RANGES[kind]
        return isinstance(value, int) and not isinstance(value, bool) and low <= value < high
    if kind == "float64":
        return isinstance(value, float)
    if kind == "string":
        return isinstance(value, str)
    if kind == "byte":
        return isinstance(value, bytes) and len(value) == 1
    return isinstance(value, CLASSES[kind])


def default_of(kind, words):
    if words:
        return float(words[0])
    if kind.endswith("[]"):
        return []
    if kind == "float64[36]":
        return [0.0] * 36
    return DEFAULTS[kind] if kind in DEFAULTS else CLASSES[kind]()


class Message:
    KINDS = {}

    def __init__(self):
        for name, (kind, default) in self.KINDS.items():
            setattr(self, name, default_of(kind, default))

    def __setattr__(self, name, value):
        kind, _ = self.KINDS[name]  # a misspelt field fails
        assert is_of(kind, value), f"{type(self).__name__}.{name} must be {kind}: {value!r}"
        self.__dict__[name] = value


def class_of(full_name, definition):
    kinds = {}
    for line in definition.split(";"):
        kind, name, *default = line.split()
        kinds[name] = (kind, default)
    return type(full_name.split("/")[1], (Message,), {"KINDS": kinds})


CLASSES = {name: class_of(name, definition) for name, definition in DEFINITIONS.items()}


def export(package, into):
    into.update({name.split("/")[1]: kind for name, kind in CLASSES.items() if name.split("/")[0] == package})
