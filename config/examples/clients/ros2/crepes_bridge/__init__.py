"""Poses and status of a crepesd as ROS 2 topics."""
