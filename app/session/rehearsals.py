"""Rehearsals that tabs share: one control process per plan, and the lease of its handle."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Literal

import numpy as np

from app.session.lease import Lease
from vfix_engine.control import ControlSettings
from vfix_engine.errors import VfixError
from vfix_engine.robots import PlacedRobot, RobotModel
from vfix_engine.simulation.realtime import RehearsalProcess, SceneSpec
from vfix_engine.simulation.snapshot import Snapshot

RoomState = Literal["absent", "starting", "ready", "failed"]
MAX_ROOMS = 4
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Prepared:
    """A scene that is ready to be handed to a control process."""

    spec: SceneSpec
    settings: ControlSettings


class RehearsalRoom:
    """One plan's rehearsal. Methods that move the robot do nothing unless the tab holds the lease."""

    def __init__(self) -> None:
        self.lease = Lease()
        self._lock = threading.Lock()
        self._process: RehearsalProcess | None = None
        self._robot: PlacedRobot | None = None
        self._state: RoomState = "absent"
        self._words = ""
        self._plan_key: object = None
        self._generation = 0
        self._settings = ControlSettings()
        self._hand: tuple[float, float, float] | None = None  # where the hand holds the grip, LPS [mm]
        self.watchers: set[str] = set()

    @property
    def state(self) -> RoomState:
        with self._lock:
            return self._state

    @property
    def words(self) -> str:
        """What is going on while it starts, or why it failed."""
        with self._lock:
            return self._words

    @property
    def settings(self) -> ControlSettings:
        """What was asked for last, with the margin that is really kept."""
        with self._lock:
            process, settings = self._process, self._settings
        return _as_driven(settings, None if process is None else process.snapshot())

    @property
    def robot(self) -> PlacedRobot | None:
        with self._lock:
            return self._robot

    def is_for(self, plan_key: object) -> bool:
        """Whether the robot that stands here was placed for this revision of the plan."""
        with self._lock:
            return self._plan_key == plan_key and self._state in ("starting", "ready")

    def open(self, plan_key: object, prepare: Callable[[], Prepared], executor: Executor) -> None:
        """Place the robot and start its process in the background; a room that is open is closed first."""
        self.close()
        with self._lock:
            self._generation += 1
            generation = self._generation
            self._state, self._words, self._plan_key = "starting", "Placing the robot at the entry …", plan_key
        executor.submit(self._start, generation, prepare)

    def _start(self, generation: int, prepare: Callable[[], Prepared]) -> None:
        process: RehearsalProcess | None = None
        try:
            prepared = prepare()
            process = RehearsalProcess(prepared.spec, prepared.settings)
            process.start()
            process.wait_ready()
        except VfixError as error:
            if process is not None:
                process.close()
            self._settle(generation, "failed", str(error))
            return
        except Exception:
            _LOG.exception("a rehearsal could not be started")
            if process is not None:
                process.close()
            self._settle(generation, "failed", "The rehearsal could not be started; the planner's log says why.")
            return
        robot = RobotModel.load(prepared.spec.robot).placed(np.asarray(prepared.spec.base))
        with self._lock:
            if generation == self._generation:
                self._process, self._robot, self._settings = process, robot, prepared.settings
                self._state, self._words = "ready", ""
                return
        process.close()

    def _settle(self, generation: int, state: RoomState, words: str) -> None:
        with self._lock:
            if generation == self._generation:
                self._state, self._words = state, words

    def close(self) -> None:
        with self._lock:
            self._generation += 1
            process, self._process, self._robot = self._process, None, None
            self._state, self._words, self._plan_key = "absent", "", None
        if process is not None:
            process.close()

    def snapshot(self) -> Snapshot | None:
        process = self._live()
        return None if process is None else process.snapshot()

    def check(self) -> list[str]:
        """Words the process has said since the last call; notices when it has ended."""
        process = self._live()
        if process is None:
            return []
        words = [event.text for event in process.events() if event.kind == "note"]
        if not process.alive:
            self.close()
            with self._lock:
                self._state, self._words = "failed", "The control process ended. Start the rehearsal again."
        return words

    def _live(self) -> RehearsalProcess | None:
        with self._lock:
            return self._process

    def _held(self, tab: str) -> RehearsalProcess | None:
        return self._live() if self.lease.held_by(tab) else None

    # -- the hand; quick and from any thread

    def set_grip(self, tab: str, position: tuple[float, float, float]) -> None:
        if (process := self._held(tab)) is not None:
            self._hand = position
            process.set_grip(position)

    def heartbeat(self, tab: str) -> None:
        """The button or key is still down. A hand whose force faded while the line was slow takes hold again."""
        if (process := self._held(tab)) is not None:
            if (hand := self._hand) is None:
                process.heartbeat()
            else:
                process.set_grip(hand)

    def release(self, tab: str) -> None:
        """The hand lets go of everything, keys included."""
        if (process := self._held(tab)) is not None:
            self._hand = None
            process.release()

    def release_grip(self, tab: str) -> None:
        """The pointer is up; keys that are down go on when there was no hand on the grip."""
        if self._hand is not None:
            self.release(tab)

    def drive(self, tab: str, direction: int) -> None:
        if (process := self._held(tab)) is not None:
            process.drive(direction)

    def twist(self, tab: str, direction: int) -> None:
        if (process := self._held(tab)) is not None:
            process.twist(direction)

    # -- the wishes of the holder

    def run(self, tab: str) -> None:
        if (process := self._held(tab)) is not None:
            process.run()

    def pause(self, tab: str) -> None:
        if (process := self._held(tab)) is not None:
            process.pause()

    def reset(self, tab: str) -> None:
        if (process := self._held(tab)) is not None:
            process.reset()

    def set_mode(self, tab: str, mode: str, target_index: int | None) -> None:
        if (process := self._held(tab)) is not None:
            process.set_mode(mode, target_index)

    def change_settings(self, tab: str, values: dict[str, float]) -> ControlSettings | None:
        """Clamp the values, tell the process; the settings that hold now, None when this tab may not."""
        process = self._held(tab)
        if process is None:
            return None
        settings = self.settings.clamped(**values)
        process.set_settings(settings)
        with self._lock:
            self._settings = settings
        return settings

    def leave(self, tab: str) -> None:
        """The tab's page is gone: whatever it held is let go of at once (HAZ-11)."""
        self.release(tab)
        self.lease.let_go(tab)


def _as_driven(settings: ControlSettings, snapshot: Snapshot | None) -> ControlSettings:
    """The settings with the margin that is really kept: a margin that the pose cannot keep is refused by the loop."""
    return settings if snapshot is None else settings.clamped(margin_mm=snapshot.margin_mm)


class RehearsalRooms:
    """Rooms by plan; a room that nobody watches is closed when another one needs its place."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._rooms: dict[str, RehearsalRoom] = {}

    def room(self, plan_id: str) -> RehearsalRoom:
        with self._lock:
            room = self._rooms.get(plan_id)
            if room is None:
                room = self._rooms[plan_id] = RehearsalRoom()
            idle = [known for known, other in self._rooms.items() if not other.watchers and known != plan_id]
            closing = [self._rooms.pop(known) for known in idle[: max(0, len(self._rooms) - MAX_ROOMS)]]
        for other in closing:
            other.close()
        return room

    def close(self) -> None:
        with self._lock:
            rooms = list(self._rooms.values())
            self._rooms.clear()
        for room in rooms:
            room.close()
