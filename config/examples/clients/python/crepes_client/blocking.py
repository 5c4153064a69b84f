"""Poses and status for programs that wait."""
from __future__ import annotations

import socket
import time
from types import TracebackType
from typing import Any, Generator, Iterable

from crepes_client.conversation import Conversation
from crepes_client.messages import Error, Message, Pose, Status, Version

ADDRESS = "127.0.0.1"
PORT = 47475
PATIENCE_S = 3.0


class RefusedError(RuntimeError):
    """The daemon refused the request; the text says why."""


class Connection:
    """A socket that asks a daemon and hears nobody else. A daemon that restarts is asked again.

    `rate_hz` and `peers` limit the poses; `poll_s` asks for STATUS every so many seconds. Use it in a
    `with` statement: its end ends the subscription. OSError if the address is not one.
    """

    def __init__(self, address: str = ADDRESS, port: int = PORT, *, watch: bool = True,
                 rate_hz: float | None = None, peers: Iterable[int] | None = None,
                 poll_s: float | None = None, poll: dict[str, Any] | None = None) -> None:
        family, kind, protocol, _, place = socket.getaddrinfo(address, port, type=socket.SOCK_DGRAM)[0]
        self._socket = socket.socket(family, kind, protocol)
        self._socket.connect(place)
        self._conversation = Conversation(time.monotonic(), watch=watch, rate_hz=rate_hz, peers=peers,
                                          poll_s=poll_s, poll=poll)

    def receive(self, timeout_s: float) -> Message | None:
        """The next message, or None if there is none within `timeout_s`."""
        end = time.monotonic() + timeout_s
        while True:
            now = time.monotonic()
            self._send(self._conversation.due(now))
            wait_s = min(max(0.0, end - now), self._conversation.wait_s(now))
            message = self._read(wait_s)
            if message is not None or time.monotonic() >= end:
                return message

    @property
    def silent_s(self) -> float:
        """For how long the daemon has sent nothing."""
        return time.monotonic() - self._conversation.heard

    @property
    def version(self) -> Version | None:
        """The daemon's, once it has answered."""
        return self._conversation.version

    def close(self) -> None:
        self._send(self._conversation.farewell())
        self._socket.close()

    def __enter__(self) -> Connection:
        return self

    def __exit__(self, kind: type[BaseException] | None, fault: BaseException | None,
                 trace: TracebackType | None) -> None:
        self.close()

    def _send(self, datagrams: Iterable[bytes]) -> None:
        for datagram in datagrams:
            try:
                self._socket.send(datagram)
            except OSError:
                pass  # no daemon, or no network, for now: asked again in a second

    def _read(self, wait_s: float) -> Message | None:
        self._socket.settimeout(max(wait_s, 1e-3))  # zero would mean: do not wait at all
        try:
            datagram = self._socket.recv(2048)
        except TimeoutError:
            return None
        except OSError:  # no daemon for now; the error came at once
            time.sleep(min(wait_s, 0.05))
            return None
        return self._conversation.take(datagram, time.monotonic())


def poses(address: str = ADDRESS, port: int = PORT, *, rate_hz: float | None = None,
          peers: Iterable[int] | None = None, patience_s: float | None = PATIENCE_S) -> Generator[Pose, None, None]:
    """Poses for ever. TimeoutError if the daemon is silent for `patience_s` (None: never);
    RefusedError if it refuses the request."""
    with Connection(address, port, rate_hz=rate_hz, peers=peers) as connection:
        while True:
            message = connection.receive(0.2)
            if isinstance(message, Pose):
                yield message
            elif isinstance(message, Error):
                raise RefusedError(message.message)
            elif patience_s is not None and connection.silent_s > patience_s:
                raise TimeoutError(f"no answer from {address} port {port}")


def status(address: str = ADDRESS, port: int = PORT, *, peer: int | None = None, about: str | None = None,
           patience_s: float = PATIENCE_S) -> Status:
    """The daemon's STATUS: of everything, of one neighbor (`peer`), or "sensors" or "network" (`about`).
    Errors as of `poses`."""
    end = time.monotonic() + patience_s
    with Connection(address, port, watch=False, poll_s=0.25, poll=poll_of(peer, about)) as connection:
        while (left := end - time.monotonic()) > 0.0:
            message = connection.receive(left)
            if isinstance(message, Status):
                return message
            if isinstance(message, Error):
                raise RefusedError(message.message)
    raise TimeoutError(f"no answer from {address} port {port}")


def poll_of(peer: int | None, about: str | None) -> dict[str, Any]:
    """The keys of a POLL that are not None."""
    wanted = {"peer": peer, "about": about}
    return {key: value for key, value in wanted.items() if value is not None}
