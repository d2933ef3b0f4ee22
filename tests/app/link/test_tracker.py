"""The client of a tracking server: poses of one name, staleness, reconnection and averaged positions."""

import socket
import struct
import threading
import time
from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np
import pytest
from fastcrc import crc64

from app.link import LinkFault, LinkServer, Text, TrackedPose, TrackerClient, Transform
from app.link import tracker as module
from app.link.messages import HEADER_BYTES, pack, parse_header
from vfix_engine.registration import SimulatedTracker, calibrate_pivot
from vfix_engine.registration.tracker import TIP_MM

NAME = "StylusTipToReference"


def pose(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Transform:
    matrix = np.array([[0, -1, 0, x], [0, 0, -1, y], [1, 0, 0, z], [0, 0, 0, 1.0]])
    return Transform(NAME, matrix)


class FakeTracker:
    """A tracking server that sends poses at 100 Hz from the moment it is told to, through the server's own port."""

    def __init__(self, port: int = 0) -> None:
        self.server = LinkServer("127.0.0.1", port, lambda _: "", list)
        self.port = self.server.start()
        self.place = (0.0, 0.0, 0.0)
        self.noise_mm = 0.0
        self.swung: np.ndarray | None = None  # poses that are sent in turn, instead of one place
        self._random = np.random.default_rng(1)
        self._sends = threading.Event()
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def send(self, on: bool) -> None:
        (self._sends.set if on else self._sends.clear)()

    def _run(self) -> None:
        while not self._ended.wait(0.01):
            if self._sends.is_set():
                x, y, z = np.array(self.place) + self.noise_mm * self._random.standard_normal(3)
                told = pose(x, y, z)
                if self.swung is not None:
                    told = Transform(NAME, self.swung[0])
                    self.swung = np.roll(self.swung, -1, axis=0)
                self.server.broadcast([Transform("Other", np.eye(4)), told])

    def close(self) -> None:
        self._ended.set()
        self._thread.join()
        self.server.close()


@pytest.fixture
def fake() -> Iterator[FakeTracker]:
    made = FakeTracker()
    yield made
    made.close()


@pytest.fixture
def tracker(fake: FakeTracker, monkeypatch: pytest.MonkeyPatch) -> Iterator[TrackerClient]:
    monkeypatch.setattr(module, "_RETRY_S", 0.05)
    made = TrackerClient("127.0.0.1", fake.port, NAME)
    made.start()
    yield made
    made.close()


def wait_for_state(tracker: TrackerClient, state: str, seconds: float = 5.0) -> None:
    end = time.monotonic() + seconds
    while tracker.state != state:
        assert time.monotonic() < end, tracker.words
        time.sleep(0.01)


def test_poses_come_and_become_stale_and_come_again(fake: FakeTracker, tracker: TrackerClient) -> None:
    wait_for_state(tracker, "waiting")
    assert tracker.latest() is None
    assert tracker.age_s is None
    fake.place = (1.5, -2.25, 100.0)
    fake.send(True)
    wait_for_state(tracker, "fresh")
    newest = tracker.latest()
    assert newest is not None
    np.testing.assert_allclose(newest.position, fake.place, atol=1e-5)
    fake.send(False)
    wait_for_state(tracker, "stale")
    assert tracker.age_s is not None
    assert tracker.age_s > module.STALE_S
    assert "stale: no pose for" in tracker.words
    fake.send(True)
    wait_for_state(tracker, "fresh")


def test_a_lost_server_is_found_again(fake: FakeTracker, tracker: TrackerClient) -> None:
    fake.send(True)
    wait_for_state(tracker, "fresh")
    port = fake.port
    fake.close()
    wait_for_state(tracker, "connecting")
    assert "no connection" in tracker.words
    again = FakeTracker(port)
    try:
        again.send(True)
        wait_for_state(tracker, "fresh")
    finally:
        again.close()


def test_a_pointer_that_is_swung_tells_where_its_tip_is(fake: FakeTracker, tracker: TrackerClient) -> None:
    """The poses of a second calibrate the pointer; places are then averaged at the tip, which stood still."""
    where = np.array([10.0, -20.0, 900.0])
    fake.swung = SimulatedTracker(1, sigma_mm=0.0).pivot(where, 50)
    fake.send(True)
    wait_for_state(tracker, "fresh")
    poses = tracker.poses(1.0)
    assert poses.shape == (len(poses), 4, 4)
    found = calibrate_pivot(poses)
    np.testing.assert_allclose(found.tip_mm, TIP_MM, atol=1e-3)  # float32 on the way
    held = tracker.collect(0.5, found.tip_mm)
    np.testing.assert_allclose(held.position, where, atol=1e-3)
    assert held.largest_mm < 1e-2
    assert tracker.collect(0.5).largest_mm > 10.0  # the body, in whose frame the tip is, was swung


def test_a_pointer_that_goes_out_of_sight_while_it_is_swung_is_calibrated(
    fake: FakeTracker, tracker: TrackerClient
) -> None:
    """A place is not averaged then; what was seen of a swing is enough, and nothing at all is told."""
    fake.swung = SimulatedTracker(1, sigma_mm=0.0).pivot([10.0, -20.0, 900.0], 50)
    fake.send(True)
    wait_for_state(tracker, "fresh")
    hidden = threading.Timer(0.5, fake.send, [False])
    hidden.start()
    poses = tracker.poses(1.5)
    hidden.join()
    assert tracker.state == "stale"
    np.testing.assert_allclose(calibrate_pivot(poses).tip_mm, TIP_MM, atol=1e-2)
    with pytest.raises(LinkFault, match="stale"):
        tracker.collect(0.2)
    with pytest.raises(LinkFault, match="0 poses came"):
        tracker.poses(0.2)


def test_a_place_is_averaged_with_its_spread(fake: FakeTracker, tracker: TrackerClient) -> None:
    fake.place, fake.noise_mm = (10.0, 20.0, -30.0), 0.2
    fake.send(True)
    wait_for_state(tracker, "fresh")
    found = tracker.collect(1.0)
    assert found.count >= 5
    np.testing.assert_allclose(found.position, fake.place, atol=6 * 0.2 / np.sqrt(found.count))
    assert found.spread_mm == pytest.approx(0.2 * np.sqrt(3.0), rel=0.6)  # root mean square in three axes
    assert found.largest_mm >= found.spread_mm


def test_nothing_is_averaged_of_a_tool_out_of_sight(fake: FakeTracker, tracker: TrackerClient) -> None:
    wait_for_state(tracker, "waiting")
    with pytest.raises(LinkFault, match="no pose of"):
        tracker.collect(0.1)
    fake.send(True)
    wait_for_state(tracker, "fresh")
    fake.send(False)
    with pytest.raises(LinkFault, match="stale"):
        tracker.collect(0.8)


@pytest.mark.parametrize(("hidden_s", "taken"), [(0.45, True), (0.55, False)])
def test_nothing_is_averaged_of_a_tool_that_was_hidden_in_between(
    monkeypatch: pytest.MonkeyPatch, hidden_s: float, taken: bool
) -> None:
    """It is in sight at the end again, but where it was meanwhile nobody knows."""
    listener = TrackerClient("127.0.0.1", 1, "Tip")
    times = [100.0, 100.05, 100.1, *(100.1 + hidden_s + 0.05 * n for n in range(6))]
    poses = [TrackedPose(np.eye(4), at) for at in times]
    monkeypatch.setattr(listener, "_next", lambda seconds: (99.99, poses))
    monkeypatch.setattr(TrackerClient, "state", "fresh")
    if taken:
        assert listener.collect(1.0).count == len(poses)
    else:
        with pytest.raises(LinkFault, match="hold the tool where the tracker sees it"):
            listener.collect(1.0)


def test_a_tip_that_moved_while_nobody_saw_it_is_told_though_its_body_stood_still(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: 100.0))
    listener = TrackerClient("127.0.0.1", 1, "Tip")
    turned = np.diag([-1.0, -1.0, 1.0, 1.0])  # in place, by half a turn
    for number in range(40):
        at = 98.0 + 0.05 * number
        if not 98.9 < at < 99.5:
            listener._poses.append(TrackedPose(np.eye(4) if at < 99.0 else turned, at))
    assert len(listener.recorded(2.0)) > 20
    with pytest.raises(LinkFault, match=r"moved by 240 mm"):
        listener.recorded(2.0, (120.0, 0.0, 0.0))


def test_too_few_poses_are_no_place(fake: FakeTracker, tracker: TrackerClient) -> None:
    fake.send(True)
    wait_for_state(tracker, "fresh")
    with pytest.raises(LinkFault, match="are needed"):
        tracker.collect(0.001)


def extended(message: Transform, status: str) -> bytes:
    """The message with the extended header and a status, as PLUS sends it."""
    packed = pack(message)
    key, value = b"StylusTipToReferenceTransformStatus", status.encode()
    index = struct.pack(">HHHI", 1, len(key), 3, len(value))
    body = struct.pack(">HHII", 12, len(index), len(key + value), 0) + packed[58:] + index + key + value
    return b"\0\2" + packed[2:42] + struct.pack(">QQ", len(body), crc64.ecma_182(body)) + body


def test_what_is_no_pose_of_the_tool_is_passed_over() -> None:
    """A tool out of sight, another name, an image, a mirrored and a scaled matrix; then a pose."""
    image = b"\0\1IMAGE".ljust(14, b"\0") + b"Image".ljust(20, b"\0") + bytes(8) + struct.pack(">QQ", 300_000, 0)
    mirrored = Transform(NAME, np.diag([1.0, 1.0, -1.0, 1.0]))
    scaled = Transform(NAME, np.diag([1.1, 1.1, 1.1, 1.0]))
    listener = socket.create_server(("127.0.0.1", 0))
    tracker = TrackerClient("127.0.0.1", listener.getsockname()[1], NAME)
    tracker.start()
    try:
        opened, _ = listener.accept()
        with opened:
            opened.sendall(extended(pose(1.0), "OUT_OF_VIEW") + pack(Text(NAME, "no transform")))
            opened.sendall(image + bytes(300_000) + pack(mirrored) + pack(scaled))
            time.sleep(0.3)
            assert tracker.latest() is None
            opened.sendall(extended(pose(2.0), "OK"))
            wait_for_state(tracker, "fresh")
            newest = tracker.latest()
            assert newest is not None
            assert newest.position[0] == 2.0
    finally:
        tracker.close()
        listener.close()


def test_a_server_of_another_protocol_is_told() -> None:
    listener = socket.create_server(("127.0.0.1", 0))
    tracker = TrackerClient("127.0.0.1", listener.getsockname()[1], NAME)
    tracker.start()
    try:
        opened, _ = listener.accept()
        with opened:
            opened.sendall(b"SSH-2.0-OpenSSH_9.6 with so many words that a header could be full of them\r\n")
            end = time.monotonic() + 5.0
            while "no OpenIGTLink message" not in tracker.words and time.monotonic() < end:
                time.sleep(0.01)
            assert "no OpenIGTLink message" in tracker.words
    finally:
        tracker.close()
        listener.close()


def test_a_recording_is_refused_where_the_tool_was_out_of_sight(monkeypatch: pytest.MonkeyPatch) -> None:
    """The poses of the last seconds; a tool that stood still while nobody saw it has missed nothing."""
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: 100.0))
    sent = [(98.0, 0.0), *((98.1 + 0.05 * n, 2.0 * n) for n in range(38))]

    def recorded(poses: list[tuple[float, float]], seconds: float) -> list[float]:
        listener = TrackerClient("127.0.0.1", 1, "Tip")
        for at, x in poses:
            transform = np.eye(4)
            transform[0, 3] = x
            listener._poses.append(TrackedPose(transform, at))
        return [float(pose.position[0]) for pose in listener.recorded(seconds)]

    assert recorded(sent, 2.0) == [x for _, x in sent]
    assert recorded(sent, 1.0) == [x for at, x in sent if at >= 99.0]
    with pytest.raises(LinkFault, match="began or ended"):
        recorded(sent, 5.0)
    with pytest.raises(LinkFault, match="began or ended"):
        recorded(sent[:-15], 2.0)
    with pytest.raises(LinkFault, match=r"moved by 28 mm while out of sight for 0\.7 s"):
        recorded(sent[:10] + sent[23:], 2.0)
    still = [(at, 0.0) for at, _ in sent]
    assert recorded(still[:10] + still[23:], 2.0) == [0.0] * 26
    with pytest.raises(LinkFault, match="are needed"):
        recorded(sent[:3], 2.0)


def test_a_connection_that_drops_while_a_place_is_measured_is_the_reason(
    fake: FakeTracker, tracker: TrackerClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is back at once, and the tool was in sight all the time: only the connection was not."""
    monkeypatch.setattr(module, "_RETRY_S", module.STALE_S + 0.3)
    fake.send(True)
    wait_for_state(tracker, "fresh")
    held = tracker._socket
    assert held is not None
    threading.Timer(0.3, lambda: held.shutdown(socket.SHUT_RDWR)).start()
    with pytest.raises(LinkFault, match=r"The connection to 127\.0\.0\.1, port \d+ was lost meanwhile.*try again"):
        tracker.collect(2.0)
    with pytest.raises(LinkFault, match="was lost meanwhile; record again"):
        tracker.recorded(2.0)
    assert tracker.collect(0.2).count >= 5


def test_a_tool_that_was_out_of_sight_and_is_back_is_told_so(fake: FakeTracker, tracker: TrackerClient) -> None:
    fake.send(True)
    wait_for_state(tracker, "fresh")
    for after, on in ((0.1, False), (1.0, True)):
        threading.Timer(after, fake.send, (on,)).start()
    with pytest.raises(LinkFault, match=f"{NAME} was out of sight meanwhile"):
        tracker.collect(1.5)


def hear(tracker: TrackerClient, data: bytes) -> None:
    """A message as it arrives, without a socket."""
    header = parse_header(data[:HEADER_BYTES])
    if tracker._is_read(header):
        tracker._receive(header, data[HEADER_BYTES:])


def raw(kind: bytes, name: str, body: bytes, checksum: int | None = None) -> bytes:
    head = struct.pack(
        ">H12s20sQQQ", 1, kind, name.encode(), 0, len(body), crc64.ecma_182(body) if checksum is None else checksum
    )
    return head + body


def tool(name: str, body: bytes) -> bytes:
    """An entry of TDATA or QTDATA, with its type and a reserved byte."""
    return struct.pack(">20sBB", name.encode(), 1, 0) + body


TURN = struct.pack(">3f4f", 1.0, 2.0, 3.0, 0.5, 0.5, 0.5, 0.5)  # x to y, y to z, z to x
MATRIX = struct.pack(">12f", 0, 1, 0, 0, 0, 1, 1, 0, 0, 1, 2, 3)


@pytest.mark.parametrize(
    "data",
    [
        raw(b"POSITION", NAME, TURN),
        raw(b"QTRANS", NAME, TURN),
        raw(b"TDATA", "Tracker", tool("Other", bytes(48)[:12] + bytes(36)) + tool(NAME, MATRIX)),
        raw(b"QTDATA", "Tracker", tool(NAME, TURN) + tool("Other", TURN)),
        raw(b"TRANSFORM", NAME, MATRIX),
    ],
)
def test_every_message_that_holds_a_pose_is_read(data: bytes) -> None:
    tracker = TrackerClient("127.0.0.1", 1, NAME)
    hear(tracker, data)
    newest = tracker.latest()
    assert newest is not None
    np.testing.assert_allclose(newest.transform, [[0, 0, 1, 1], [1, 0, 0, 2], [0, 1, 0, 3], [0, 0, 0, 1]], atol=1e-6)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (raw(b"TRANSFORM", NAME, MATRIX, 0), "2 poses arrive with a wrong checksum"),
        (raw(b"POSITION", NAME, TURN, 1), "2 poses arrive with a wrong checksum"),
        (raw(b"TDATA", "Tracker", tool(NAME, MATRIX), 0), "2 poses arrive with a wrong checksum"),
        (raw(b"NDARRAY", NAME, MATRIX), "it arrives as NDARRAY, which is not read"),
        (raw(b"POSITION", NAME, TURN[:12]), "a POSITION cannot be read"),
        (raw(b"TDATA", "Tracker", MATRIX), "a TDATA cannot be read"),
        (pack(Transform(NAME, np.eye(4))), "the identity: the tool is out of sight"),
        (raw(b"TRANSFORM", "Other", MATRIX), f"no pose of {NAME} yet"),
    ],
)
def test_what_arrives_instead_of_a_pose_is_said(data: bytes, words: str) -> None:
    tracker = TrackerClient("127.0.0.1", 1, NAME)
    tracker._connected = True
    for _ in range(2):
        hear(tracker, data)
    assert tracker.latest() is None
    assert tracker.state == "waiting"
    assert words in tracker.words
    assert tracker.words.endswith(" yet") == words.endswith(" yet")
