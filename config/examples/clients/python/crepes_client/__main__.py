"""Prints the poses of a crepesd: one line a pose, t_ns peer mode x y z [m, in our body's axes]."""
from __future__ import annotations

import argparse
import itertools
import sys

from crepes_client.blocking import ADDRESS, PORT, RefusedError, poses


def main() -> int:
    """The exit code: 0 done, 1 no answer or refused."""
    options = argparse.ArgumentParser(prog="crepes-poses", description=__doc__)
    options.add_argument("--address", default=ADDRESS, help="of the daemon (%(default)s)")
    options.add_argument("--port", type=int, default=PORT, help="of the daemon (%(default)s)")
    options.add_argument("--rate", type=float, help="poses of each neighbor a second")
    options.add_argument("--count", type=int, help="stop after so many poses")
    asked = options.parse_args()
    try:
        for pose in itertools.islice(poses(asked.address, asked.port, rate_hz=asked.rate), asked.count):
            print(pose.t_ns, pose.peer, pose.mode, *pose.position, flush=True)
    except (OSError, RefusedError) as fault:
        print(fault, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        pass
    return 0


if __name__ == "__main__":
    sys.exit(main())
