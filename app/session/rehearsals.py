"""Rehearsals that tabs share: one control process per plan, and the lease of its handle."""

from __future__ import annotations

import json
import logging
import threading
from collections import deque
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
Position = tuple[float, float, float]
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
        self._settings = ControlSettings()  # in force, as the process says
        self._wished: ControlSettings | None = None  # asked for last, until the process has answered everything
        self._asked: deque[frozenset[str]] = deque()  # names of settings asked for, oldest first
        self._answered = 0
        self._accepted: dict[str, float] = {}
        self._words_for_holder: deque[str] = deque(maxlen=8)
        self._hand: tuple[str, Position] | None = None  # the tab whose hand holds the grip, and where, LPS [mm]
        self._target_index = 0
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
        """What is in force, as the control process has confirmed it."""
        with self._lock:
            return self._settings

    @property
    def settings_answered(self) -> int:
        """How many changes of the settings the process has answered, refusals included."""
        with self._lock:
            return self._answered

    @property
    def target_index(self) -> int:
        """The target that was chosen last for inspection."""
        return self._target_index

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
            self._target_index = 0
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
                self._wished = None
                self._asked.clear()
                self._accepted.clear()
                self._words_for_holder.clear()
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
            self._hand = None
            process, self._process, self._robot = self._process, None, None
            self._state, self._words, self._plan_key = "absent", "", None
        if process is not None:
            process.close()

    def snapshot(self) -> Snapshot | None:
        process = self._live()
        return None if process is None else process.snapshot()

    def check(self) -> None:
        """Hear what the process has said since the last call; notices when it has ended."""
        process = self._live()
        if process is None:
            return
        for event in process.events():
            if event.kind == "note":
                self._words_for_holder.append(event.text)
            elif event.kind == "settings":
                self._settings_told(ControlSettings.from_dict(json.loads(event.text)))
        if not process.alive:
            self.close()
            with self._lock:
                self._state, self._words = "failed", "The control process ended. Start the rehearsal again."

    def _settings_told(self, in_force: ControlSettings) -> None:
        """The answer to one change: what is in force now, the old settings where it was refused."""
        with self._lock:
            before, self._settings = self._settings.to_dict(), in_force
            self._answered += 1
            names = self._asked.popleft() if self._asked else frozenset()
            if not self._asked:
                self._wished = None
            now = in_force.to_dict()
            self._accepted |= {name: now[name] for name in names if now[name] != before[name]}

    def take_words(self, tab: str) -> list[str]:
        """What the process has said to the holder of the handle, once; nothing for other tabs."""
        words: list[str] = []
        while self._words_for_holder and self.lease.held_by(tab):
            words.append(self._words_for_holder.popleft())
        return words

    def take_accepted(self, tab: str) -> dict[str, float]:
        """Settings of the holder that came into force, once, so that the plan can keep them."""
        if not self.lease.held_by(tab):
            return {}
        with self._lock:
            accepted, self._accepted = self._accepted, {}
            return accepted

    def plan_changed(self, before: object, after: object) -> None:
        """The plan has changed in nothing but what this rehearsal has already: it is still the rehearsal of it."""
        with self._lock:
            if self._plan_key == before:
                self._plan_key = after

    def _live(self) -> RehearsalProcess | None:
        with self._lock:
            return self._process

    def _held(self, tab: str) -> RehearsalProcess | None:
        return self._live() if self.lease.held_by(tab) else None

    # -- the hand; quick and from any thread

    def set_grip(self, tab: str, position: Position) -> None:
        if (process := self._held(tab)) is not None:
            self._hand = (tab, position)
            process.set_grip(position)

    def move_grip(self, tab: str, position: Position) -> None:
        """The hand moves on; a hand that was let go of has to take hold again first."""
        if self._hand_of(tab) is not None:
            self.set_grip(tab, position)

    def heartbeat(self, tab: str) -> None:
        """The button or key is still down. A hand whose force faded while the line was slow takes hold again."""
        if (process := self._held(tab)) is not None:
            if (hand := self._hand_of(tab)) is None:
                process.heartbeat()
            else:
                process.set_grip(hand)

    def release(self, tab: str) -> None:
        """The hand lets go of everything, keys included; it is forgotten also when there is no process just now."""
        if self._hand_of(tab) is not None:
            self._hand = None
        if (process := self._held(tab)) is not None:
            process.release()

    def release_grip(self, tab: str) -> None:
        """The pointer is up; keys that are down go on when there was no hand on the grip."""
        if self._hand_of(tab) is not None:
            self.release(tab)

    def _hand_of(self, tab: str) -> Position | None:
        hand = self._hand
        return hand[1] if hand is not None and hand[0] == tab else None

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
            if target_index is not None:
                self._target_index = target_index
            process.set_mode(mode, target_index)

    def change_settings(self, tab: str, values: dict[str, float]) -> ControlSettings | None:
        """Clamp the values, ask the process; the settings that were asked for, None when this tab may not."""
        process = self._held(tab)
        if process is None:
            return None
        with self._lock:
            settings = (self._wished or self._settings).clamped(**values)
            self._wished = settings
            self._asked.append(frozenset(values))
        process.set_settings(settings)
        return settings

    def leave(self, tab: str) -> None:
        """The tab's page is gone: whatever it held is let go of at once (HAZ-11)."""
        self.release(tab)
        self.lease.let_go(tab)


class RehearsalRooms:
    """Rooms by plan; a room that nobody watches is closed when another one needs its place."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._rooms: dict[str, RehearsalRoom] = {}

    def enter(self, plan_id: str, tab: str) -> RehearsalRoom:
        """The room of a plan, with this tab as one of its watchers."""
        with self._lock:
            room = self._rooms.get(plan_id)
            if room is None:
                room = self._rooms[plan_id] = RehearsalRoom()
            room.watchers.add(tab)
            idle = [known for known, other in self._rooms.items() if not other.watchers and known != plan_id]
            closing = [self._rooms.pop(known) for known in idle[: max(0, len(self._rooms) - MAX_ROOMS)]]
        for other in closing:
            other.close()
        return room

    def leave(self, room: RehearsalRoom, tab: str) -> None:
        """A tab goes; the robot that nobody watches any more is sent home."""
        with self._lock:
            room.watchers.discard(tab)
            empty = not room.watchers
        if empty:
            room.close()

    def close(self) -> None:
        with self._lock:
            rooms = list(self._rooms.values())
            self._rooms.clear()
        for room in rooms:
            room.close()
