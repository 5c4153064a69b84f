"""Which request is due when, and what the answers change: neither socket nor clock. `now` is any
monotonic time in seconds."""
from __future__ import annotations

import json
from typing import Any, Iterable

from crepes_client.messages import Cookie, Message, Version, parse

RENEWAL_S = 1.0  #: far below the lease of ten seconds: a lost datagram does not matter


class Conversation:
    """Poses are asked for with `watch`, STATUS every `poll_s` seconds."""

    def __init__(self, now: float, *, watch: bool = True, rate_hz: float | None = None,
                 peers: Iterable[int] | None = None, poll_s: float | None = None,
                 poll: dict[str, Any] | None = None) -> None:
        self.version: Version | None = None
        self.heard = now  #: when anything was received; at first, the beginning
        # A daemon on another robot answers no request that is shorter than its answer.
        self._proof: dict[str, str] = {"pad": " " * 64}
        self._requests: list[dict[str, Any]] = []
        self._periods: list[float] = []
        self._due: list[float] = []
        if watch:
            request: dict[str, Any] = {"class": "WATCH", "enable": True}
            if rate_hz is not None:
                request["rate_hz"] = rate_hz
            if peers is not None:
                request["peers"] = list(peers)
            self._add(request, RENEWAL_S, now)
        if poll_s is not None:
            self._add({"class": "POLL", **(poll or {})}, poll_s, now)

    def due(self, now: float) -> list[bytes]:
        """The datagrams to send now."""
        datagrams = []
        for i, request in enumerate(self._requests):
            if now >= self._due[i]:
                self._due[i] = now + self._periods[i]
                datagrams.append(self._datagram(request))
        return datagrams

    def wait_s(self, now: float) -> float:
        """Until the next request is due."""
        return max(0.0, min(self._due, default=now + RENEWAL_S) - now)

    def take(self, datagram: bytes, now: float) -> Message | None:
        """The message in a datagram from the daemon, if it is one for the program."""
        message = parse(datagram)
        if message is None:
            return None
        self.heard = now
        if isinstance(message, Cookie):
            self._echo(message.cookie, now)
            return None
        if isinstance(message, Version):
            self._renew_within(message.lease_s)
            self.version = message
        return message

    def farewell(self) -> list[bytes]:
        """Ends the subscription."""
        return [self._datagram({"class": "WATCH", "enable": False})
                for request in self._requests if request["class"] == "WATCH"]

    def _add(self, request: dict[str, Any], period: float, now: float) -> None:
        self._requests.append(request)
        self._periods.append(period)
        self._due.append(now)

    def _datagram(self, request: dict[str, Any]) -> bytes:
        return json.dumps({**request, **self._proof}).encode()

    def _echo(self, cookie: str, now: float) -> None:
        if self._proof.get("cookie") == cookie:
            return  # already echoed: the next renewal suffices
        self._proof["cookie"] = cookie
        self._due = [now] * len(self._due)

    def _renew_within(self, lease_s: float) -> None:
        for i, request in enumerate(self._requests):
            if request["class"] == "WATCH":
                self._periods[i] = min(RENEWAL_S, lease_s / 4)
                self._due[i] = min(self._due[i], self.heard + self._periods[i])
