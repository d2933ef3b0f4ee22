"""Poses as rows of float64: for a small Python client, a slow one, and one that does not read."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from knocking import Planner, eventually, listening
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from app.drives import poses_route
from app.drives.poses import MAX_READERS
from app.drives.shared_drives import DriveKey, SharedDrives
from app.messages.client import Client
from app.messages.version import VERSION
from app.tabs.rehearse import routes
from vfix_engine.runtime.ring import Ring, RowReader, write_layout
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot

PLAN = "plan-1"
KEY = DriveKey("case-1", PLAN)
PATH = f"/api/v1/steps/rehearse/poses?plan={PLAN}"
WATCHER = Client("tab-one-0", "watches")


def _snapshot(steps: int, joints: int = 6) -> RigidSnapshot:
    values: dict[str, Any] = dict.fromkeys((field.name for field in dataclasses.fields(RigidSnapshot)), np.nan)
    places = {name: steps + np.arange(3.0) for name in ("tip", "grip", "virtual_point", "force")}
    pose = {"camera": np.eye(4), "capsules": np.array([[0.0, 0.0, -9.0, *places["tip"], 2.0]])}
    return RigidSnapshot(
        **values | places | pose | {"t": 1e-3 * steps, "steps": steps, "running": True, "q": np.ones(joints)}
    )


class _Mailbox:
    """Stands for a drive: has the newest snapshot, and rows where a test writes some."""

    def __init__(self) -> None:
        self.newest: RigidSnapshot | None = None
        self.reader: RowReader | None = None

    def rows(self) -> RowReader | None:
        return self.reader

    def snapshot(self) -> RigidSnapshot | None:
        return self.newest

    def close(self) -> None:
        pass


@pytest.fixture
def drives() -> SharedDrives:
    made = SharedDrives()
    made._drives[KEY] = _Mailbox()  # type: ignore[assignment]
    return made


@pytest.fixture
def planner(tmp_path: Path, drives: SharedDrives) -> Iterator[Planner]:
    with listening(tmp_path, [routes.router]) as running:
        running.app.state.sessions = SimpleNamespace(shared=lambda step: {"rehearse": drives}[step])
        yield running


def _open(planner: Planner, path: str = PATH) -> ClientConnection:
    """All that a program in Python needs to read poses."""
    headers = {"Authorization": f"Bearer {planner.settings.token}"}
    return connect(f"ws://{planner.host}{path}", additional_headers=headers, proxy=None)


def _bytes(reader: ClientConnection) -> bytes:
    message = reader.recv(timeout=60)
    assert isinstance(message, bytes)
    return message


def _end(reader: ClientConnection) -> int | None:
    """The code with which the planner ends a connection."""
    with contextlib.suppress(ConnectionClosed):
        while True:
            reader.recv(timeout=60)
    return reader.close_code


def test_a_reader_gets_the_newest_row_and_its_columns(planner: Planner, drives: SharedDrives) -> None:
    mailbox: Any = drives.find(None, PLAN)
    mailbox.newest = _snapshot(1)
    with _open(planner) as reader:
        hello = json.loads(reader.recv(timeout=60))
        assert (hello["type"], hello["version"]) == ("poses", VERSION)
        for steps in (1, 2, 3):
            mailbox.newest = _snapshot(steps)
            values: dict[str, float] = {}
            while values.get("steps") != steps:
                row = np.frombuffer(_bytes(reader), dtype="<f8")
                values = dict(zip(hello["fields"], row, strict=True))
            assert (values["t_s"], values["running"]) == (pytest.approx(1e-3 * steps), 1.0)
            assert [values[f"tip_{axis}"] for axis in "xyz"] == [steps, steps + 1, steps + 2]
            assert np.isnan(values["clearance_mm"])
            assert [values[f"q_{joint}"] for joint in range(6)] == [1.0] * 6


def test_a_reader_that_is_slow_gets_no_old_rows(
    planner: Planner, drives: SharedDrives, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between two rows that it takes a thousand are published; it is sent the last of them."""
    mailbox: Any = drives.find(None, PLAN)
    mailbox.newest = _snapshot(0)
    taken = threading.Event()
    send_bytes = poses_route.WebSocket.send_bytes

    async def slow(self: Any, data: bytes) -> None:
        await send_bytes(self, data)
        for steps in range(1, 1001):
            mailbox.newest = _snapshot(steps)
        taken.set()

    monkeypatch.setattr(poses_route.WebSocket, "send_bytes", slow)
    with _open(planner) as reader:
        columns = json.loads(reader.recv(timeout=60))["fields"]
        at = columns.index("steps")
        rows = [np.frombuffer(_bytes(reader), dtype="<f8")[at] for _ in range(2)]
    assert taken.is_set()
    assert rows == [0.0, 1000.0]


def test_at_control_rate_every_step_comes(planner: Planner, drives: SharedDrives) -> None:
    """2,000 steps in two seconds, in batches; a reader that came too late is told what it has missed."""
    mailbox: Any = drives.find(None, PLAN)
    memory = Ring.memory()
    try:
        write_layout(memory, [("t", "s"), ("tip_x", "mm")])
        ring, step = Ring(memory, 2), iter(range(10**9))
        mailbox.reader = RowReader(memory.name)
        with _open(planner, f"{PATH}&rate=control") as reader:
            hello = json.loads(reader.recv(timeout=60))
            assert (hello["type"], hello["fields"]) == ("poses", ["t", "tip_x"])
            found = np.zeros((0, 2))
            for _ in range(200):
                for _ in range(10):
                    ring.write(np.array([next(step), 7.0]))
                time.sleep(0.005)
            while len(found) < 2000:
                found = np.concatenate([found, np.frombuffer(_bytes(reader), dtype="<f8").reshape(-1, 2)])
            assert np.array_equal(found[:, 0], np.arange(2000.0))
            mailbox.reader._ring.lost = 5  # as after seconds in which nobody read
            told: Any = b""
            while isinstance(told, bytes):
                told = reader.recv(timeout=60)
            assert json.loads(told) == {"type": "missed", "rows": 5}
            mailbox.reader.ended = True
            assert _end(reader) == 4409
    finally:
        mailbox.reader.close()
        memory.close()
        memory.unlink()


def test_what_a_reader_is_refused_for(planner: Planner, drives: SharedDrives) -> None:
    for plan in ("another", "../../etc", ""):
        with _open(planner, f"/api/v1/steps/rehearse/poses?plan={plan}") as reader:
            assert _end(reader) == 4404, plan
    with _open(planner) as talker:
        talker.send("hello")
        assert _end(talker) == 1003
    for _ in range(MAX_READERS):
        assert drives.readers.acquire(blocking=False)
    with _open(planner) as one_too_many:
        assert _end(one_too_many) == 4503
    assert planner.handshake(PATH).status == 401


def test_a_drive_that_ends_ends_the_channel(planner: Planner, drives: SharedDrives) -> None:
    mailbox: Any = drives.find(None, PLAN)
    mailbox.newest, mailbox.watchers = _snapshot(1), {WATCHER.id}
    with _open(planner) as reader:
        reader.recv(timeout=60)
        drives.leave(mailbox, WATCHER)
        assert _end(reader) == 4404


def test_another_robot_ends_the_channel(planner: Planner, drives: SharedDrives) -> None:
    """Its rows have other columns."""
    mailbox: Any = drives.find(None, PLAN)
    mailbox.newest = _snapshot(1)
    with _open(planner) as reader:
        reader.recv(timeout=60)
        mailbox.newest = _snapshot(2, joints=7)
        assert _end(reader) == 4409
    eventually(lambda: drives.readers._value == MAX_READERS)  # every reader has left its place
