import rclpy


class TransformBroadcaster:
    def __init__(self, node):
        assert isinstance(node, rclpy.Node)

    def sendTransform(self, transform):
        rclpy.tell("/tf", transform)
