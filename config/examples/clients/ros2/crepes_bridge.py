#!/usr/bin/env python3
"""Poses of a crepesd as ROS 2 topics: geometry_msgs/PoseWithCovarianceStamped on
crepes/<name of the neighbor>/pose in the frame of this robot, and TF if asked for. Needs rclpy and no build:

    python3 crepes_bridge.py --ros-args -p rate_hz:=20.0 -p publish_tf:=true

Parameters: address ("127.0.0.1"), port (47475), rate_hz (0.0: every pose), publish_tf (false),
frame_format ("robot_{id}/base_link").
"""
import pathlib
import sys
import time

import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "python"))
import crepes_client  # noqa: E402
import crepes_ros  # noqa: E402


def set_header(header, pose, stamp_ns, frame_format):
    header.stamp.sec, header.stamp.nanosec = crepes_ros.split_ns(stamp_ns)
    header.frame_id = crepes_ros.frame_of(pose["self"], frame_format)


def set_fields(target, values, fields):
    for field in fields:
        setattr(target, field, float(values[field]))


def pose_message(pose, stamp_ns, frame_format):
    message = PoseWithCovarianceStamped()
    set_header(message.header, pose, stamp_ns, frame_format)
    set_fields(message.pose.pose.position, pose["position"], "xyz")
    set_fields(message.pose.pose.orientation, pose["orientation"], "wxyz")
    if "covariance" in pose:
        message.pose.covariance = crepes_ros.ros_covariance(pose["covariance"], pose["orientation"])
    return message


def transform_message(pose, stamp_ns, frame_format):
    message = TransformStamped()
    set_header(message.header, pose, stamp_ns, frame_format)
    message.child_frame_id = crepes_ros.frame_of(pose["peer"], frame_format)
    set_fields(message.transform.translation, pose["position"], "xyz")
    set_fields(message.transform.rotation, pose["orientation"], "wxyz")
    return message


class Bridge:
    def __init__(self, node):
        self.node = node
        parameter = lambda name, default: node.declare_parameter(name, default).value  # noqa: E731
        self.address = parameter("address", "127.0.0.1")
        self.port = parameter("port", 47475)
        self.rate_hz = parameter("rate_hz", 0.0) or None
        self.frame_format = parameter("frame_format", "robot_{id}/base_link")
        self.tf = self.make_tf() if parameter("publish_tf", False) else None
        self.publishers = {}
        self.stamps = crepes_ros.StampConverter()

    def make_tf(self):
        from tf2_ros import TransformBroadcaster

        return TransformBroadcaster(self.node)

    def publisher(self, name):
        if name not in self.publishers:
            self.publishers[name] = self.node.create_publisher(
                PoseWithCovarianceStamped, f"crepes/{name.replace('-', '_')}/pose", 10)
        return self.publishers[name]

    def take(self, pose):
        stamp_ns = self.stamps.to_system_ns(int(pose["t_ns"]), time.monotonic_ns(), time.time_ns())
        self.publisher(pose["name"]).publish(pose_message(pose, stamp_ns, self.frame_format))
        if self.tf:
            self.tf.sendTransform(transform_message(pose, stamp_ns, self.frame_format))

    def run(self):
        while rclpy.ok():
            try:
                for pose in crepes_client.poses(self.address, self.port, self.rate_hz):
                    self.take(pose)
                    if not rclpy.ok():
                        return
            except (TimeoutError, RuntimeError) as fault:  # the daemon restarts, or is full
                self.node.get_logger().warning(str(fault))
                time.sleep(1.0)


def main():
    rclpy.init()
    try:
        Bridge(rclpy.create_node("crepes_bridge")).run()
    except KeyboardInterrupt:
        pass
    finally:
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
