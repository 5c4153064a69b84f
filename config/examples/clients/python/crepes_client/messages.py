"""What a crepesd sends, as values. SI units; B is the observer's body (x forward, y left, z up), N the
neighbor's. None stands for a value that the daemon left out because it is not known."""
from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any, Mapping, NamedTuple, Union


class Vector(NamedTuple):
    x: float
    y: float
    z: float


class Quaternion(NamedTuple):
    """Hamilton, of unit length."""

    w: float
    x: float
    y: float
    z: float


@dataclass(frozen=True)
class Version:
    """The answer to the first request; the subscription lasts `lease_s` without a further one."""

    release: str
    proto_major: int
    proto_minor: int
    lease_s: float


@dataclass(frozen=True)
class Pose:
    """T_B_N: maps coordinates in the neighbor's body to coordinates in the observer's."""

    t_ns: int  #: time of the state, on the robot's monotonic clock
    self_id: int  #: the observer
    peer: int  #: the neighbor
    name: str  #: of the neighbor
    mode: str  #: "direct", "graph" or "predicted"
    position: Vector  #: of N's origin, in B's axes [m]
    orientation: Quaternion  #: rotates coordinates in N's axes into B's
    velocity: Vector | None = None  #: of N minus B over ground, in B's axes [m/s]
    up: Vector | None = None  #: against gravity, in B's axes
    #: Upper triangle, row by row, of the covariance of [dp, dtheta]: dp in B's axes [m],
    #: R_true = R Exp(dtheta) with dtheta in N's axes [rad].
    covariance: tuple[float, ...] | None = None
    seq: int | None = None
    t_pub_ns: int | None = None  #: when the pose left the estimator
    age_s: float | None = None
    reset_counter: int | None = None  #: increases when the estimate jumps
    sources: tuple[str, ...] = ()

    @property
    def timestamp(self) -> float:
        """`t_ns` in seconds."""
        return self.t_ns * 1e-9

    def covariance_matrix(self) -> list[list[float]] | None:
        """The whole 6x6 matrix, as rows."""
        if self.covariance is None:
            return None
        matrix = [[0.0] * 6 for _ in range(6)]
        entries = iter(self.covariance)
        for row in range(6):
            for column in range(row, 6):
                matrix[row][column] = matrix[column][row] = next(entries)
        return matrix


@dataclass(frozen=True)
class Sensor:
    name: str
    ok: bool
    rate_hz: float | None = None
    message: str | None = None  #: what is wrong, and what to do
    faults: Mapping[str, int] = field(default_factory=dict)
    counts: Mapping[str, int] = field(default_factory=dict)
    calibrated: bool = True  #: false: a camera whose lens is a guess


@dataclass(frozen=True)
class Neighbor:
    peer: int
    state: str | None = None  #: a mode, or "none"
    reason: str | None = None  #: why there is no pose
    name: str | None = None
    age_s: float | None = None
    faults: tuple[str, ...] = ()
    raw: Mapping[str, Any] = field(default_factory=dict)  #: the object as it came


@dataclass(frozen=True)
class Clock:
    """The neighbor's clock minus ours."""

    peer: int
    offset_s: float | None = None
    skew_ppm: float | None = None
    sigma_s: float | None = None


@dataclass(frozen=True)
class Status:
    self_id: int
    name: str | None = None
    uptime_s: float | None = None
    sensors: tuple[Sensor, ...] = ()
    neighbors: tuple[Neighbor, ...] = ()
    clocks: tuple[Clock, ...] = ()
    faults: tuple[str, ...] = ()  #: what contradicts the rest of the team, in words
    truncated: bool = False  #: parts are missing, because a datagram is short
    more: tuple[int, ...] = ()  #: neighbors that are missing
    raw: Mapping[str, Any] = field(default_factory=dict)  #: the object as it came


@dataclass(frozen=True)
class Error:
    """A request was refused."""

    message: str


@dataclass(frozen=True)
class Cookie:
    """Proves to the daemon that this address is ours; `Conversation` echoes it."""

    cookie: str


Message = Union[Version, Pose, Status, Error]


def parse(datagram: bytes) -> Message | Cookie | None:
    """None for what is not a message of this protocol, or of a later one."""
    try:
        content = json.loads(datagram)
        read = _READERS.get(content["class"])
        return read(content) if read else None
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError):
        return None


def _vector(content: Any) -> Vector:
    return Vector(float(content["x"]), float(content["y"]), float(content["z"]))


def _pose(content: dict[str, Any]) -> Pose:
    q = content["orientation"]
    covariance = tuple(float(entry) for entry in content["covariance"]) if "covariance" in content else None
    if covariance is not None and len(covariance) != 21:
        raise ValueError("covariance")
    return Pose(
        t_ns=int(content["t_ns"]),
        self_id=int(content["self"]),
        peer=int(content["peer"]),
        name=str(content.get("name", content["peer"])),
        mode=str(content["mode"]),
        position=_vector(content["position"]),
        orientation=Quaternion(float(q["w"]), float(q["x"]), float(q["y"]), float(q["z"])),
        velocity=_vector(content["velocity"]) if "velocity" in content else None,
        up=_vector(content["up"]) if "up" in content else None,
        covariance=covariance,
        seq=content.get("seq"),
        t_pub_ns=int(content["t_pub_ns"]) if "t_pub_ns" in content else None,
        age_s=content.get("age_s"),
        reset_counter=content.get("reset_counter"),
        sources=tuple(content.get("sources", ())),
    )


def _sensor(content: dict[str, Any]) -> Sensor:
    return Sensor(str(content["name"]), bool(content["ok"]), content.get("rate_hz"), content.get("message"),
                  content.get("faults", {}), content.get("counts", {}), bool(content.get("calibrated", True)))


def _neighbor(content: dict[str, Any]) -> Neighbor:
    return Neighbor(int(content["peer"]), content.get("state"), content.get("reason"), content.get("name"),
                    content.get("age_s"), tuple(content.get("faults", ())), content)


def _clock(content: dict[str, Any]) -> Clock:
    return Clock(int(content["peer"]), content.get("offset_s"), content.get("skew_ppm"), content.get("sigma_s"))


def _status(content: dict[str, Any]) -> Status:
    return Status(
        self_id=int(content["self"]),
        name=content.get("name"),
        uptime_s=content.get("uptime_s"),
        sensors=tuple(_sensor(entry) for entry in content.get("sensors", ())),
        neighbors=tuple(_neighbor(entry) for entry in content.get("neighbors", ())),
        clocks=tuple(_clock(entry) for entry in content.get("clocks", ())),
        faults=tuple(content.get("faults", ())),
        truncated=bool(content.get("truncated", False)),
        more=tuple(content.get("more", ())),
        raw=content,
    )


def _version(content: dict[str, Any]) -> Version:
    return Version(str(content["release"]), int(content["proto_major"]), int(content["proto_minor"]),
                   float(content["lease_s"]))


_READERS: dict[str, Any] = {
    "VERSION": _version,
    "POSE": _pose,
    "STATUS": _status,
    "ERROR": lambda content: Error(str(content["message"])),
    "COOKIE": lambda content: Cookie(str(content["cookie"])),
}
