"""Prints the poses of a crepesd: one line a pose, t_ns peer mode x y z [m, in our body's axes]."""
from __future__ import annotations

import argparse
import contextlib
import itertools
import os
import signal
import socket
import sys

from crepes_client.blocking import ADDRESS, PORT, RefusedError, poses


def port(text: str) -> int:
    """getaddrinfo would take a larger number for another port."""
    if not 1 <= int(text) <= 65535:
        raise argparse.ArgumentTypeError(f"{text} is no port, 1 to 65535")
    return int(text)


def count(text: str) -> int:
    if int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} is not above 0")
    return int(text)


def main() -> int:
    """The exit code: 0 done, 1 no answer or refused."""
    options = argparse.ArgumentParser(prog="crepes-poses", description=__doc__)
    options.add_argument("--address", default=ADDRESS, help="of the daemon (%(default)s)")
    options.add_argument("--port", type=port, default=PORT, help="of the daemon (%(default)s)")
    options.add_argument("--rate", type=float, help="poses of each neighbor a second")
    options.add_argument("--count", type=count, help="stop after so many poses")
    asked = options.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # so that each end ends the subscription
    try:
        with contextlib.closing(poses(asked.address, asked.port, rate_hz=asked.rate)) as stream:
            for pose in itertools.islice(stream, asked.count):
                print(pose.t_ns, pose.peer, pose.mode, *pose.position, flush=True)
    except BrokenPipeError:  # nobody reads any more, nor what is still to be flushed
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except socket.gaierror as fault:
        print(f"{asked.address}: {fault.strerror}", file=sys.stderr)
        return 1
    except (OSError, RefusedError) as fault:
        print(fault, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        pass
    return 0


if __name__ == "__main__":
    sys.exit(main())
