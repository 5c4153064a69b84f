"""As much of rclpy as the bridge uses: parameters from the command line, messages to standard output as
lines of JSON, and an end after FAKE_ROS_COUNT of them."""
import json
import os
import sys
import time

from rclpy.executors import ExternalShutdownException
from rclpy.qos import QoSProfile

_left = int(os.environ.get("FAKE_ROS_COUNT", "10"))


def plain(value):
    return value.hex() if isinstance(value, bytes) else vars(value)


def record(topic, message):
    global _left
    _left -= 1
    print(json.dumps({"topic": topic, "message": message}, default=plain), flush=True)


def init():
    pass


def ok():
    return _left > 0


def spin(node):
    node.was_spun = True
    raise ExternalShutdownException


def try_shutdown():
    pass


def scalar(text):
    """As YAML, which ROS reads overrides with."""
    if text in ("true", "false"):
        return text == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return text


class Parameter:
    def __init__(self, value):
        self.value = value


class Publisher:
    def __init__(self, kind, topic):
        self.kind, self.topic = kind, topic

    def publish(self, message):
        assert isinstance(message, self.kind)
        record(self.topic, message)


class Time:
    def __init__(self, nanoseconds):
        self.nanoseconds = nanoseconds


class Clock:
    def now(self):
        return Time(time.time_ns())


class Node:
    def declare_parameter(self, name, value=None, descriptor=None, ignore_override=False):
        assert descriptor.description
        for word in sys.argv:
            if word.startswith(name + ":="):
                given = scalar(word.split(":=", 1)[1])
                assert descriptor.dynamic_typing or type(given) is type(value), f"InvalidParameterTypeException: {word}"
                return Parameter(given)
        return Parameter(value)

    def create_publisher(self, msg_type, topic, qos_profile):
        assert isinstance(qos_profile, (int, QoSProfile))
        return Publisher(msg_type, topic)

    def get_clock(self):
        return Clock()

    def get_logger(self):
        return self

    def warning(self, text):
        print(text, file=sys.stderr)

    info = warning


def create_node(_name):
    return Node()
