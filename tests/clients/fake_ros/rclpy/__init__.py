"""As much of rclpy as the bridge uses: parameters from the command line, messages to standard output as
lines of JSON, and an end after FAKE_ROS_COUNT of them."""
import json
import os
import sys

_left = int(os.environ.get("FAKE_ROS_COUNT", "10"))


def tell(topic, message):
    global _left
    _left -= 1
    print(json.dumps({"topic": topic, "message": message}, default=vars), flush=True)


def init():
    pass


def ok():
    return _left > 0


def try_shutdown():
    pass


class Parameter:
    def __init__(self, value):
        self.value = value


class Publisher:
    def __init__(self, kind, topic):
        self.kind, self.topic = kind, topic

    def publish(self, message):
        assert isinstance(message, self.kind)
        tell(self.topic, message)


class Node:
    def declare_parameter(self, name, default):
        for word in sys.argv:
            if word.startswith(name + ":="):
                text = word.split(":=", 1)[1]
                return Parameter(text == "true" if isinstance(default, bool) else type(default)(text))
        return Parameter(default)

    def create_publisher(self, kind, topic, depth):
        assert depth > 0
        return Publisher(kind, topic)

    def get_logger(self):
        return self

    def warning(self, text):
        print(text, file=sys.stderr)


def create_node(_name):
    return Node()
