"""A client of an OpenIGTLink tracking server such as PLUS: the pose of one tracked tool."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from app.link.messages import (
    HEADER_BYTES,
    Header,
    LinkFault,
    ToolPoses,
    Transform,
    WrongChecksum,
    parse_header,
    unpack,
)
from vfix_engine.arrays import Array

TrackerState = Literal["connecting", "waiting", "fresh", "stale"]

STALE_S = 0.5
MAX_BODY_BYTES = 64 << 20  # of messages that are skipped, such as images of a tracking server
_READ_BYTES = 1 << 16  # of messages that are read
_RETRY_S = 1.0
_CONNECT_S = 2.0
_KEPT = 20_000  # poses kept for `recorded`
_FEWEST = 5  # least number of poses for an average
_UNSEEN_MM = 5.0  # how far a tool may move while it is out of sight in a recording
_OF_TOOLS = ("TDATA", "QTDATA")  # kinds of messages with the named poses of several tools
_OF_A_TOOL = ("TRANSFORM", "POSITION", "QTRANS")
_RIGID = 1e-4  # bound of RᵀR − I, for float32 and the rounding of a tracker


@dataclass(frozen=True, eq=False)
class TrackedPose:
    """A pose. transform (4, 4): from the tool to the tracker's frame, mm. received_s: time of `time.monotonic`."""

    transform: Array
    received_s: float

    @property
    def position(self) -> Array:
        """Position (3,) of the tool's origin in the tracker's frame, mm."""
        return self.transform[:3, 3]


@dataclass(frozen=True, eq=False)
class Collected:
    """A position averaged over `count` poses.

    position (3,): mean, mm. spread_mm: root mean square distance from it. largest_mm: largest distance from it.
    """

    position: Array
    spread_mm: float
    largest_mm: float
    count: int


class TrackerClient:
    """Receives the transform of one name from a tracking server; reconnects whenever the connection is lost.

    The poses have the frame of the server's transform: 'StylusTipToReference' of PLUS is the tip in the frame of the
    reference. Thread-safe.
    """

    def __init__(self, host: str, port: int, name: str) -> None:
        self.host, self.port, self.name = host, port, name
        self._lock = threading.Condition()
        self._poses: deque[TrackedPose] = deque(maxlen=_KEPT)
        self._connected = False
        self._trouble = ""
        self._wrong_checksums = 0  # messages with poses and a wrong checksum since the connection was made
        self._unread = ""  # why a message of the tool's name could not be read since then
        self._lost_s = -np.inf  # time at which the connection was last lost
        self._socket: socket.socket | None = None
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="tracker", daemon=True)

    def start(self) -> None:
        """Start to connect and receive."""
        self._thread.start()

    def close(self) -> None:
        """End the connection and the thread."""
        self._ended.set()
        with self._lock:
            held = self._socket
        if held is not None:
            with contextlib.suppress(OSError):
                held.shutdown(socket.SHUT_RDWR)
        if self._thread.is_alive():
            self._thread.join(_CONNECT_S + 1.0)

    def latest(self) -> TrackedPose | None:
        """Return the newest pose, of any age; None before the first one."""
        with self._lock:
            return self._poses[-1] if self._poses else None

    @property
    def age_s(self) -> float | None:
        """Age of the newest pose; None before the first one."""
        pose = self.latest()
        return None if pose is None else time.monotonic() - pose.received_s

    @property
    def state(self) -> TrackerState:
        """'fresh' if a pose arrived within the last 0.5 s, 'stale' if the newest is older.

        'connecting' without a connection, 'waiting' before the first pose.
        """
        age = self.age_s
        if age is not None and age <= STALE_S:
            return "fresh"
        if not self._connected:
            return "connecting"
        return "waiting" if age is None else "stale"

    @property
    def words(self) -> str:
        """Description of the state for the user."""
        match self.state:
            case "fresh":
                return f"{self.name} is tracked"
            case "stale":
                return f"{self.name} is stale: no pose for more than {STALE_S:g} s{self._why_unread}"
            case "waiting":
                return f"connected; no pose of {self.name} yet{self._why_unread}"
        return f"no connection to {self.host}, port {self.port}{self._trouble and ': ' + self._trouble}"

    @property
    def _why_unread(self) -> str:
        """What arrives instead of usable poses, as the end of a sentence; '' if nothing does."""
        if self._wrong_checksums:
            return (
                f": {self._wrong_checksums:,} poses arrive with a wrong checksum and are not used; let the server make "
                "checksums (CRC-64)"
            )
        return self._unread and f": {self._unread}"

    def collect(self, seconds: float, point: ArrayLike = (0.0, 0.0, 0.0)) -> Collected:
        """Average the position of a point (3,) in the tool's frame, mm, over the next seconds.

        Raises LinkFault if the tool is not tracked all the time.
        """
        begin, found = self._next(seconds)
        if self.state != "fresh" or _longest_gap_s(found, begin) > STALE_S:
            raise LinkFault(f"{self._why_unseen(begin)} and try again.")
        poses = self._enough(begin, found, seconds)
        places = poses[:, :3, :3] @ np.asarray(point, dtype=np.float64) + poses[:, :3, 3]
        mean = places.mean(axis=0)
        off = np.linalg.norm(places - mean, axis=1)
        return Collected(mean, float(np.sqrt((off**2).mean())), float(off.max()), len(poses))

    def poses(self, seconds: float) -> Array:
        """Return the poses (n, 4, 4) of the next seconds; the tool may go out of sight, as when it is swung.

        Raises LinkFault if there are too few.
        """
        return self._enough(*self._next(seconds), seconds)

    def _next(self, seconds: float) -> tuple[float, list[TrackedPose]]:
        """Wait for some seconds; return when they began, and the poses that arrived."""
        begin = time.monotonic()
        end = begin + seconds
        with self._lock:
            while (left := end - time.monotonic()) > 0 and not self._ended.is_set():
                self._lock.wait(min(left, STALE_S))
            return begin, [pose for pose in self._poses if pose.received_s >= begin]

    def _enough(self, begin: float, found: list[TrackedPose], seconds: float) -> Array:
        if len(found) < _FEWEST:
            raise LinkFault(
                f"{len(found)} poses came in {seconds:g} s; {_FEWEST} are needed. {self._why_unseen(begin)} and try "
                "again, or longer."
            )
        return np.array([pose.transform for pose in found])

    def _why_unseen(self, begin: float) -> str:
        """Describe why poses are missing since a time, and what to do, as the beginning of a sentence."""
        if self._lost_s >= begin and self.state == "fresh":  # reconnected meanwhile, so the state is no reason
            return f"The connection to {self.host}, port {self.port} was lost meanwhile; hold the tool still,"
        words = f"{self.name} was out of sight meanwhile" if self.state == "fresh" else self.words
        return f"{words}; hold the tool where the tracker sees it,"

    def recorded(self, seconds: float, point: ArrayLike = (0.0, 0.0, 0.0)) -> list[TrackedPose]:
        """Return the poses of the last seconds, oldest first.

        point: (3,) in the tool's frame, mm, whose motion is recorded.
        Raises LinkFault if there are too few poses or more than are kept, or the tool was out of sight at the
        beginning, at the end, or while the point moved.
        """
        of_tool = np.asarray(point, dtype=np.float64)
        end = time.monotonic()
        begin = end - seconds
        with self._lock:
            found = [pose for pose in self._poses if pose.received_s >= begin]
            full = len(found) == self._poses.maxlen
        if full:
            raise LinkFault(f"more than {_KEPT:,} poses came in {seconds:.0f} s, which are not kept; record less.")
        if len(found) < _FEWEST:
            why = self._why_unseen(begin).partition(";")[0]
            raise LinkFault(f"{len(found)} poses came in {seconds:.1f} s; {_FEWEST} are needed. {why}.")
        if self._lost_s >= begin:
            raise LinkFault(f"the connection to {self.host}, port {self.port} was lost meanwhile; record again.")
        if found[0].received_s - begin > STALE_S or end - found[-1].received_s > STALE_S:
            raise LinkFault(f"{self.name} was out of sight when the recording began or ended; hold it still there.")
        for one, other in pairwise(found):
            gap_s = other.received_s - one.received_s
            jump_mm = float(np.linalg.norm((other.transform - one.transform)[:3] @ [*of_tool, 1.0]))
            if gap_s > STALE_S and jump_mm > _UNSEEN_MM:
                raise LinkFault(
                    f"{self.name} moved by {jump_mm:.0f} mm while out of sight for {gap_s:.1f} s; record "
                    "again where the tracker sees it."
                )
        return found

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                with socket.create_connection((self.host, self.port), timeout=_CONNECT_S) as connection:
                    connection.settimeout(None)
                    _keep_alive(connection)
                    with self._lock:
                        self._socket, self._connected, self._trouble = connection, True, ""
                        self._wrong_checksums, self._unread = 0, ""
                    self._listen(connection)
            except LinkFault as error:
                self._trouble = str(error).rstrip(".")
            except OSError as error:
                self._trouble = error.strerror or str(error)
            with self._lock:
                if self._connected:
                    self._lost_s = time.monotonic()
                self._socket, self._connected = None, False
            self._ended.wait(_RETRY_S)

    def _listen(self, connection: socket.socket) -> None:
        """Read messages until the server or `close` ends the connection. Raises OSError and LinkFault."""
        with connection.makefile("rb") as stream:
            while not self._ended.is_set():
                data = stream.read(HEADER_BYTES)
                if len(data) < HEADER_BYTES:
                    self._trouble = "the server ended the connection"
                    return
                header = parse_header(data)
                if header.size > MAX_BODY_BYTES:
                    raise LinkFault(f"the server announced a body of {header.size:,} bytes.")
                if not self._is_read(header):
                    left = header.size
                    while left > 0 and (passed := len(stream.read(min(left, _READ_BYTES)))):
                        left -= passed
                    continue
                self._receive(header, stream.read(header.size))

    def _is_read(self, header: Header) -> bool:
        """Return whether a message may contain a pose of the tool; record the kind of one with its name that cannot."""
        if header.size > _READ_BYTES:
            return False
        if header.name == self.name and header.kind not in (*_OF_A_TOOL, *_OF_TOOLS):
            self._unread = f"it arrives as {header.kind}, which is not read; let the server send TRANSFORM"
        return header.kind in _OF_TOOLS or (header.name == self.name and header.kind in _OF_A_TOOL)

    def _receive(self, header: Header, body: bytes) -> None:
        """Take the pose of a message; a damaged one is skipped, and its reason or number recorded."""
        try:
            message = unpack(header, body)
        except WrongChecksum:
            self._wrong_checksums += 1
            return
        except LinkFault as error:
            self._unread = f"a {header.kind} cannot be read: {str(error).rstrip('.')}"
            return
        for one in message.poses if isinstance(message, ToolPoses) else (message,):
            if isinstance(one, Transform) and one.name == self.name:
                self._take(one)

    def _take(self, message: Transform) -> None:
        """Keep a valid pose; some servers send the last pose of a tool that is out of sight, marked by its status."""
        if np.array_equal(message.matrix, np.eye(4)):  # servers without a status send the identity for an unseen tool
            self._unread = "its pose is the identity: the tool is out of sight"
            return
        status = [text for key, text in message.metadata.items() if key.endswith("Status")]
        rotation = message.matrix[:3, :3]
        rigid = np.abs(rotation.T @ rotation - np.eye(3)).max() < _RIGID and np.linalg.det(rotation) > 0
        if not rigid or any(text.upper() != "OK" for text in status):
            return
        with self._lock:
            self._poses.append(TrackedPose(message.matrix, time.monotonic()))
            self._lock.notify_all()


def _keep_alive(connection: socket.socket) -> None:
    """Enable TCP keep-alive, so that a silently lost peer, as by a pulled cable, is noticed within some seconds."""
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, seconds in (("TCP_KEEPIDLE", 3), ("TCP_KEEPINTVL", 2), ("TCP_KEEPCNT", 3)):
        if hasattr(socket, option):
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), seconds)


def _longest_gap_s(poses: list[TrackedPose], begin: float) -> float:
    times = [begin, *(pose.received_s for pose in poses)]
    return max((later - earlier for earlier, later in pairwise(times)), default=0.0)
