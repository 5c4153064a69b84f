"""Poses and status of a crepesd. Needs nothing but Python.

    import crepes_client

    for pose in crepes_client.poses(rate_hz=10):
        print(pose.peer, pose.mode, pose.position)

`poses` and `status` block; `crepes_client.aio` has the same with asyncio. `Connection` is for programs
with a loop of their own: it also returns VERSION, STATUS and ERROR.
"""
from crepes_client import aio
from crepes_client.blocking import Connection, RefusedError, poses, status
from crepes_client.messages import (Clock, Error, Message, Neighbor, Pose, Quaternion, Sensor, Status,
                                    Vector, Version)

__all__ = ["Clock", "Connection", "Error", "Message", "Neighbor", "Pose", "Quaternion", "RefusedError",
           "Sensor", "Status", "Vector", "Version", "aio", "poses", "status"]
