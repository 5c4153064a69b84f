#!/usr/bin/env python3
"""Poses of several daemons at once, with asyncio; one line a pose:
    two_robots.py [ADDRESS:PORT...]"""
import asyncio
import sys

from crepes_client import aio


async def show(place):
    address, port = place.rsplit(":", 1)
    async for pose in aio.poses(address.strip("[]"), int(port), rate_hz=10, patience_s=None):
        print(pose.self_id, pose.peer, pose.mode, *pose.position, flush=True)


async def main(places):
    await asyncio.gather(*(show(place) for place in places))


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1:] or ["127.0.0.1:47475", "[::1]:47475"]))
