"""The node: poses and status of a crepesd as ROS 2 topics. What is published is decided in `conversion`
and `diagnostics`; parameters are in `parameters`."""
import threading
import time
from types import SimpleNamespace

import crepes_client
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from crepes_bridge import conversion, diagnostics
from crepes_bridge.parameters import PARAMETERS

PATIENCE_S = 3.0
# Reliable serves subscribers that want best effort, too. A pose that is five poses late is dropped.
QOS = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=5, reliability=ReliabilityPolicy.RELIABLE,
                 durability=DurabilityPolicy.VOLATILE)
ELEMENTS = {"status": DiagnosticStatus, "values": KeyValue}  # of fields that are lists of messages


def fill(message, fields):
    """Copies nested dicts into a message."""
    for name, value in fields.items():
        if isinstance(value, dict):
            fill(getattr(message, name), value)
        elif name in ELEMENTS:
            setattr(message, name, [fill(ELEMENTS[name](), element) for element in value])
        else:
            setattr(message, name, value)
    return message


def settings_of(node):
    """The parameters, which stay as they are at the start."""
    values = {}
    for parameter in PARAMETERS:
        is_number = isinstance(parameter.default, float)  # ROS refuses `rate_hz:=20` for a double, unless its type is free
        description = ParameterDescriptor(description=parameter.meaning, read_only=True, dynamic_typing=is_number)
        value = node.declare_parameter(parameter.name, parameter.default, description).value
        values[parameter.name] = float(value) if is_number else value
    if values["diagnostics_period_s"] <= 0.0:
        raise ValueError("diagnostics_period_s must be above 0")
    return SimpleNamespace(**values)


class Bridge:
    def __init__(self, node):
        self.node = node
        self.settings = settings_of(node)
        self.place = f"{self.settings.address} port {self.settings.port}"
        self.stamps = conversion.StampConverter(conversion.is_this_machine(self.settings.address))
        self.tf = self.make_tf() if self.settings.publish_tf else None
        self.diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.publishers = {}
        self.is_silent, self.next_complaint = False, 0.0

    def make_tf(self):
        from tf2_ros import TransformBroadcaster

        return TransformBroadcaster(self.node)

    def run(self):
        """Until ROS ends. A daemon that restarts is asked again, every second."""
        settings = self.settings
        with crepes_client.Connection(settings.address, settings.port, rate_hz=settings.rate_hz or None,
                                      poll_s=settings.diagnostics_period_s) as connection:
            while rclpy.ok():
                message = connection.receive(0.1)
                if isinstance(message, crepes_client.Pose):
                    self.take_pose(message)
                elif isinstance(message, crepes_client.Status):
                    self.publish_diagnostics(connection, diagnostics.entries_of(message))
                elif isinstance(message, crepes_client.Error):
                    self.node.get_logger().warning(message.message)
                self.watch_silence(connection)

    def ros_ns(self):
        return self.node.get_clock().now().nanoseconds

    def take_pose(self, pose):
        stamp_ns = self.stamps.to_ros_ns(pose.t_ns, time.monotonic_ns(), self.ros_ns())
        where = (pose, stamp_ns, self.settings.frame_format)
        self.publish(PoseWithCovarianceStamped, pose.name, "pose", conversion.pose_message(*where))
        if self.settings.publish_odometry:
            self.publish(Odometry, pose.name, "odometry", conversion.odometry_message(*where))
        if self.tf:
            self.tf.sendTransform(fill(TransformStamped(), conversion.transform_message(*where)))

    def publish(self, kind, neighbor, what, fields):
        topic = f"crepes/{conversion.topic_part(neighbor)}/{what}"
        if topic not in self.publishers:
            self.publishers[topic] = self.node.create_publisher(kind, topic, QOS)
        self.publishers[topic].publish(fill(kind(), fields))

    def publish_diagnostics(self, connection, entries):
        own = diagnostics.bridge_entry(self.place, connection.silent_s, PATIENCE_S, connection.version, self.stamps)
        self.diagnostics.publish(fill(DiagnosticArray(), diagnostics.array(self.ros_ns(), [own, *entries])))

    def watch_silence(self, connection):
        """Logs when the daemon falls silent and when it is back; in between, diagnostics say so."""
        was_silent, self.is_silent = self.is_silent, connection.silent_s > PATIENCE_S
        if self.is_silent and time.monotonic() >= self.next_complaint:
            self.next_complaint = time.monotonic() + self.settings.diagnostics_period_s
            self.publish_diagnostics(connection, [])
        if self.is_silent and not was_silent:
            self.node.get_logger().warning(f"no answer from {self.place}")
        elif was_silent and not self.is_silent:
            self.node.get_logger().info(f"connected to {self.place}")


def spin(node):
    """Parameters, services and simulated time are served beside the poses."""
    try:
        rclpy.spin(node)
    except ExternalShutdownException:
        pass


def main():
    rclpy.init()
    node = rclpy.create_node("crepes_bridge")
    try:
        bridge = Bridge(node)
        threading.Thread(target=spin, args=(node,), daemon=True).start()
        bridge.run()
    except KeyboardInterrupt:
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
