"""Rehearsals that tabs share: one control process per plan, and the lease of its handle."""

from __future__ import annotations

import contextlib
import json
import logging
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
import numpy.typing as npt

from app.steps.rehearse.lease import Lease
from app.steps.rehearse.settings_exchange import SettingsExchange
from vfix_engine.control import ControlSettings
from vfix_engine.errors import ControlError, PlanError, VfixError
from vfix_engine.robots import PlacedRobot, RobotModel
from vfix_engine.simulation.realtime import RehearsalProcess, SceneSpec
from vfix_engine.simulation.snapshot import Snapshot

if TYPE_CHECKING:  # the scene is slow to load, and the address needs none of it
    from app.scene.plan import PlanItem

RoomState = Literal["absent", "starting", "ready", "silent", "failed"]
Position = tuple[float, float, float]
SILENT_S = 2.0  # a process that shows no new snapshot for so long hangs; one that rests shows several a second
_ENDED = "The control process ended. Start the rehearsal again."
_LOG = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scene that is ready to be handed to a control process.

    items: points and targets of the plan it was made of; curve: places (n, 3) along its path, LPS [mm].
    """

    spec: SceneSpec
    settings: ControlSettings
    items: tuple[PlanItem, ...] = ()
    curve: npt.NDArray[np.float64] | None = None

    def target_index(self, target_id: str) -> int:
        """Place of a target in the scene's list. Raises PlanError where the scene does not have it."""
        ids = [item.id for item in self.items if item.kind == "target"]
        if target_id not in ids:
            raise PlanError("that target is not part of this rehearsal; ‘Reset to entry’ takes the plan as it is now.")
        return ids.index(target_id)


class SharedDrive:
    """One plan's rehearsal. Methods that move the robot do nothing unless the tab holds the lease."""

    def __init__(self) -> None:
        self.lease = Lease()
        self._lock = threading.Lock()
        self._checking = threading.Lock()  # taken before _lock: one thread at a time hears what the process says
        self._process: RehearsalProcess | None = None
        self._coming: RehearsalProcess | None = None  # being started
        self._prepared: Prepared | None = None
        self._robot: PlacedRobot | None = None
        self._state: RoomState = "absent"
        self._words = ""
        self._plan_key: object = None
        self._generation = 0
        self._talk = SettingsExchange(ControlSettings())
        self._notes: list[str] = []  # of the process, until it is known whether they are about a setting
        self._words_for_holder: deque[str] = deque(maxlen=8)
        self._hand: str | None = None  # the tab whose hand holds the grip
        self._target_id: str | None = None
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
            return self._talk.in_force

    @property
    def settings_answered(self) -> int:
        """How many changes of the settings the process has answered, refusals included."""
        with self._lock:
            return self._talk.answered

    @property
    def settings_refusal(self) -> str:
        """Why the newest change of the settings was not taken; empty where it was."""
        with self._lock:
            return self._talk.refusal

    @property
    def target_id(self) -> str | None:
        """The target that was chosen last for inspection."""
        return self._target_id

    @property
    def robot(self) -> PlacedRobot | None:
        with self._lock:
            return self._robot

    @property
    def prepared(self) -> Prepared | None:
        """The scene that is driven; None while there is no robot."""
        with self._lock:
            return self._prepared

    def is_for(self, plan_key: object) -> bool:
        """Whether the robot that stands here, or comes, was placed for this revision of the plan."""
        with self._lock:
            return self._plan_key == plan_key and self._state in ("starting", "ready", "silent")

    def open(self, plan_key: object, prepare: Callable[[], Prepared], executor: Executor) -> None:
        """Place the robot and start its process in the background; a room that is open is closed first."""
        self.close()
        with self._lock:
            self._generation += 1
            generation = self._generation
            self._state, self._words, self._plan_key = "starting", "Placing the robot at the entry …", plan_key
            self._target_id = None
        executor.submit(self._start, generation, prepare)

    def _start(self, generation: int, prepare: Callable[[], Prepared]) -> None:
        process: RehearsalProcess | None = None
        try:
            prepared = prepare()
            process = RehearsalProcess(prepared.spec, prepared.settings)
            with self._lock:
                if generation != self._generation:
                    raise ControlError("the start is not wanted any more")
                self._coming = process
            process.start()
            process.wait_ready()
            named = prepared.spec.robot
            model = named if isinstance(named, RobotModel) else RobotModel.load(named)
            robot = model.placed(np.asarray(prepared.spec.base))
        except VfixError as error:
            self._not_started(generation, process, str(error))
            return
        except Exception:
            _LOG.exception("a rehearsal could not be started")
            self._not_started(generation, process, "The rehearsal could not be started; the planner's log says why.")
            return
        with self._checking, self._lock:  # not while another process is being heard
            if generation == self._generation:
                self._process, self._coming = process, None
                self._prepared, self._robot = prepared, robot
                self._talk = SettingsExchange(prepared.settings)
                self._notes.clear()
                self._words_for_holder.clear()
                self._state, self._words = "ready", ""
                return
        process.close()

    def _not_started(self, generation: int, process: RehearsalProcess | None, words: str) -> None:
        if process is not None:
            process.close()
        with self._lock:
            if generation == self._generation:
                self._coming = None
                self._state, self._words = "failed", words

    def close(self) -> None:
        """End the process, one that is only coming as well."""
        self._end("absent", "")

    def _end(self, state: RoomState, words: str, only: RehearsalProcess | None = None) -> None:
        """only: end nothing unless this process is here; somebody else may have ended it, and another one comes."""
        with self._lock:
            if only is not None and self._process is not only:
                return
            self._generation += 1
            self._hand = None
            processes = [process for process in (self._process, self._coming) if process is not None]
            self._process = self._coming = self._prepared = self._robot = None
            self._state, self._words, self._plan_key = state, words, None
        for process in processes:
            process.close()

    def snapshot(self) -> Snapshot | None:
        process = self._live()
        return None if process is None else process.snapshot()

    def check(self) -> None:
        """Hear what the process has said since the last call; notices when it has ended, and when it hangs.

        Every window that watches calls this, each on a thread of its own.
        """
        with self._checking:
            process = self._live()
            if process is not None:
                self._hear(process)

    def _hear(self, process: RehearsalProcess) -> None:
        words = ""
        for event in process.events():
            if event.kind == "note":
                self._notes.append(event.text)
            elif event.kind == "settings":
                self._settings_told(process, ControlSettings.from_dict(json.loads(event.text)))
            elif event.kind == "failed":
                words = words or event.text
        with self._lock:
            if not self._talk.open:
                self._words_for_holder.extend(self._notes)
                self._notes.clear()
        if words or not process.alive:
            self._end("failed", words or _ENDED, only=process)
        else:
            self._watch(process)

    def _watch(self, process: RehearsalProcess) -> None:
        """The age of the newest snapshot tells a process that hangs; one that wakes up again is shown again."""
        silent = process.silence_s
        with self._lock:
            if self._process is process and self._state in ("ready", "silent"):
                self._state, self._words = ("ready", "") if silent < SILENT_S else ("silent", _silence(silent))

    def _settings_told(self, process: RehearsalProcess, in_force: ControlSettings) -> None:
        """The answer to one change: what is in force now, the old settings where it was refused."""
        snapshot = process.snapshot()
        reason = self._notes[-1] if self._notes else ""
        with self._lock:
            following = self._talk.told(in_force, reason, None if snapshot is None else snapshot.clearance_mm)
            if self._talk.refusal and self._notes:
                self._notes.pop()  # it is said beside the slider
        if following is not None:
            with contextlib.suppress(ControlError):  # it has ended: said by the check that follows
                self._ask(process, following)

    def take_words(self, tab: str) -> list[str]:
        """What the process has said to the holder of the handle, once; nothing for other tabs."""
        if not self.lease.held_by(tab):
            return []
        with self._lock:
            words = list(self._words_for_holder)
            self._words_for_holder.clear()
        return words

    def accepted(self, tab: str) -> dict[str, float]:
        """Settings of the holder that came into force and that the plan has not kept yet."""
        if not self.lease.held_by(tab):
            return {}
        with self._lock:
            return self._talk.accepted

    def kept(self, values: dict[str, float]) -> None:
        """The plan has kept these settings, or never will."""
        with self._lock:
            self._talk.kept(values)

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
            self._hand = tab
            process.set_grip(position)

    def move_grip(self, tab: str, position: Position) -> None:
        """The hand moves on; a hand that was let go of has to take hold again first."""
        if self._hand == tab:
            self.set_grip(tab, position)

    def heartbeat(self, tab: str) -> None:
        """The button or key is still down. It never takes hold: a hand that was lost has to press or to move."""
        if (process := self._held(tab)) is not None:
            process.heartbeat()

    def release(self, tab: str) -> None:
        """The hand lets go of everything, keys included; it is forgotten also when there is no process just now."""
        if self._hand == tab:
            self._hand = None
        if (process := self._held(tab)) is not None:
            process.release()

    def release_grip(self, tab: str) -> None:
        """The pointer is up; keys that are down go on when there was no hand on the grip."""
        if self._hand == tab:
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

    def hand_lost(self, tab: str) -> bool:
        """Whether this window still presses, and was heard of too late for that to count."""
        process = self._held(tab)
        return process is not None and process.hand_lost

    def halt(self) -> None:
        """Whoever watches may stop the robot where it is; only the holder of the handle lets it go on."""
        if (process := self._live()) is not None:
            process.pause()

    def pause(self, tab: str) -> None:
        if (process := self._held(tab)) is not None:
            process.pause()

    def reset(self, tab: str) -> None:
        if (process := self._held(tab)) is not None:
            process.reset()

    def set_mode(self, tab: str, mode: str, target_id: str | None) -> None:
        """Another mode; target_id: what to inspect, a target of the scene that is driven. Raises PlanError."""
        prepared, process = self.prepared, self._held(tab)
        if process is None or prepared is None:
            return
        index = None if target_id is None else prepared.target_index(target_id)
        process.set_mode(mode, index)
        self._target_id = target_id or self._target_id

    def change_settings(self, tab: str, values: dict[str, float]) -> None:
        """Ask the process for other settings, clamped; raises InputError for an unknown name."""
        process = self._held(tab)
        if process is None:
            return
        with self._lock:
            settings = self._talk.wish(values)
        if settings is not None:
            self._ask(process, settings)

    def _ask(self, process: RehearsalProcess, settings: ControlSettings) -> None:
        try:
            process.set_settings(settings)
        except ControlError:  # it was not sent: no answer will come
            with self._lock:
                self._talk.forget()
            raise

    def leave(self, tab: str) -> None:
        """The tab's page is gone: whatever it held is let go of at once (HAZ-11)."""
        self.release(tab)
        self.lease.let_go(tab)


def _silence(seconds: float) -> str:
    return (
        f"The control process has not answered for {seconds:.0f} s: nobody knows where the robot is, "
        "and what was shown last is old. End it, and start the rehearsal again."
    )


class SharedDrives:
    """Rooms by plan; a room that nobody watches any more is closed and forgotten."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._rooms: dict[str, SharedDrive] = {}

    def enter(self, plan_id: str, tab: str) -> SharedDrive:
        """The room of a plan, with this tab as one of its watchers."""
        with self._lock:
            room = self._rooms.get(plan_id)
            if room is None:
                room = self._rooms[plan_id] = SharedDrive()
            room.watchers.add(tab)
            return room

    def leave(self, room: SharedDrive, tab: str) -> None:
        """A tab goes; the robot that nobody watches any more is sent home."""
        with self._lock:
            room.watchers.discard(tab)
            if room.watchers:
                return
            # Whoever enters from here on gets another room: this one closes after the lock is free.
            self._rooms = {plan_id: other for plan_id, other in self._rooms.items() if other is not room}
        room.close()

    def close(self) -> None:
        with self._lock:
            rooms = list(self._rooms.values())
            self._rooms.clear()
        for room in rooms:
            room.close()
