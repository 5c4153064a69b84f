import rclpy
from geometry_msgs.msg import TransformStamped


class TransformBroadcaster:
    def __init__(self, node):
        assert isinstance(node, rclpy.Node)

    def sendTransform(self, transform):
        assert isinstance(transform, TransformStamped)
        rclpy.record("/tf", transform)
