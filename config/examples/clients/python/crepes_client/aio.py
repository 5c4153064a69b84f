"""Poses and status for programs with asyncio: as `crepes_client.poses` and `crepes_client.status`."""
from __future__ import annotations

import asyncio
import time
from typing import Any, AsyncIterator, Iterable

from crepes_client.blocking import ADDRESS, PATIENCE_S, PORT, RefusedError, poll_of
from crepes_client.conversation import Conversation
from crepes_client.messages import Error, Message, Pose, Status, Version

_MOST_WAITING = 256


class Connection:
    """As the blocking one, for `async with`. A program that does not keep up loses the oldest messages."""

    def __init__(self, address: str = ADDRESS, port: int = PORT, *, watch: bool = True,
                 rate_hz: float | None = None, peers: Iterable[int] | None = None,
                 poll_s: float | None = None, poll: dict[str, Any] | None = None) -> None:
        self._place = (address, port)
        self._conversation = Conversation(time.monotonic(), watch=watch, rate_hz=rate_hz, peers=peers,
                                          poll_s=poll_s, poll=poll)
        self._arrived: asyncio.Queue[bytes] = asyncio.Queue(_MOST_WAITING)
        self._transport: asyncio.DatagramTransport | None = None

    async def __aenter__(self) -> Connection:
        loop = asyncio.get_running_loop()
        self._transport, _ = await loop.create_datagram_endpoint(
            lambda: _Inbox(self._arrived), remote_addr=self._place)
        return self

    async def __aexit__(self, *_: object) -> None:
        self._send(self._conversation.farewell())
        if self._transport:
            self._transport.close()

    async def receive(self, timeout_s: float) -> Message | None:
        """The next message, or None if there is none within `timeout_s`."""
        end = time.monotonic() + timeout_s
        while True:
            now = time.monotonic()
            self._send(self._conversation.due(now))
            wait_s = min(max(0.0, end - now), self._conversation.wait_s(now))
            try:
                datagram = await asyncio.wait_for(self._arrived.get(), max(wait_s, 1e-3))
            except asyncio.TimeoutError:
                message = None
            else:
                message = self._conversation.take(datagram, time.monotonic())
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

    def _send(self, datagrams: Iterable[bytes]) -> None:
        for datagram in datagrams:
            if self._transport:
                self._transport.sendto(datagram)


class _Inbox(asyncio.DatagramProtocol):
    """Keeps the newest datagrams. That there is no daemon for now (error_received) is ignored."""

    def __init__(self, arrived: asyncio.Queue[bytes]) -> None:
        self._arrived = arrived

    def datagram_received(self, data: bytes, addr: Any) -> None:
        if self._arrived.full():
            self._arrived.get_nowait()
        self._arrived.put_nowait(data)


async def poses(address: str = ADDRESS, port: int = PORT, *, rate_hz: float | None = None,
                peers: Iterable[int] | None = None,
                patience_s: float | None = PATIENCE_S) -> AsyncIterator[Pose]:
    """Poses for ever; errors as of `crepes_client.poses`."""
    async with Connection(address, port, rate_hz=rate_hz, peers=peers) as connection:
        while True:
            message = await connection.receive(0.2)
            if isinstance(message, Pose):
                yield message
            elif isinstance(message, Error):
                raise RefusedError(message.message)
            elif patience_s is not None and connection.silent_s > patience_s:
                raise TimeoutError(f"no answer from {address} port {port}")


async def status(address: str = ADDRESS, port: int = PORT, *, peer: int | None = None,
                 about: str | None = None, patience_s: float = PATIENCE_S) -> Status:
    """As `crepes_client.status`."""
    end = time.monotonic() + patience_s
    async with Connection(address, port, watch=False, poll_s=0.25, poll=poll_of(peer, about)) as connection:
        while (left := end - time.monotonic()) > 0.0:
            message = await connection.receive(left)
            if isinstance(message, Status):
                return message
            if isinstance(message, Error):
                raise RefusedError(message.message)
    raise TimeoutError(f"no answer from {address} port {port}")
