"""The control process of a drive: started in the background, heard, watched, and ended."""

from __future__ import annotations

import contextlib
import json
import logging
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor

import numpy as np

from app.tabs.rehearse.drive_record import ProcessStatus
from app.tabs.rehearse.preparation import Prepared
from app.tabs.rehearse.recorded_process import RecordedProcess
from app.tabs.rehearse.settings_exchange import SettingsExchange
from vfix_engine.control import ControlSettings
from vfix_engine.error_places import error_places
from vfix_engine.errors import ControlError, VfixError
from vfix_engine.robots import PlacedRobot, RobotModel
from vfix_engine.runtime.ring import RowReader
from vfix_engine.worlds.rigid.realtime import RehearsalProcess
from vfix_engine.worlds.rigid.snapshot import RigidSnapshot

SILENT_S = 2.0  # a process that shows no new snapshot for so long hangs; one that rests shows several a second
_ENDED = "The control process ended. Start the rehearsal again."
_LOG = logging.getLogger(__name__)


class DriveProcess:
    """At most one control process at a time, and what is known of it. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._checking = threading.Lock()  # taken before _lock: one thread at a time hears what the process says
        self._process: RehearsalProcess | None = None
        self._coming: RehearsalProcess | None = None  # being started
        self._prepared: Prepared | None = None
        self._robot: PlacedRobot | None = None
        self._state: ProcessStatus = "absent"
        self._words = ""
        self._plan_key: object = None
        self._generation = 0
        self._talk = SettingsExchange(ControlSettings())
        self._notes: list[str] = []  # of the process, until it is known whether they are about a setting
        self._words_for_holder: deque[str] = deque(maxlen=8)
        self._unrecorded = ""  # why this drive is not recorded, or not to its end
        self._hand: str | None = None  # the tab whose hand holds the grip
        self._target_id: str | None = None

    @property
    def state(self) -> ProcessStatus:
        with self._lock:
            return self._state

    def is_for(self, plan_key: object) -> bool:
        """Whether the robot that stands here, or comes, was placed for this revision of the plan."""
        with self._lock:
            return self._plan_key == plan_key and self._state in ("starting", "ready", "silent")

    def open(self, plan_key: object, prepare: Callable[[], Prepared], executor: Executor) -> None:
        """Place the robot and start its process in the background; one that runs is closed first."""
        self.close()
        with self._lock:
            self._generation += 1
            generation = self._generation
            self._state, self._words, self._plan_key = "starting", "Placing the robot at the entry …", plan_key
            self._target_id = None
        executor.submit(self._start, generation, plan_key, prepare)

    def _start(self, generation: int, plan_key: object, prepare: Callable[[], Prepared]) -> None:
        process: RehearsalProcess | None = None
        try:
            prepared = prepare()
            process = _process(prepared)
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
        except Exception as error:
            _LOG.error("a rehearsal could not be started: %s", error_places(error))
            self._not_started(generation, process, "The rehearsal could not be started; the planner's log says why.")
            return
        with self._checking, self._lock:  # not while another process is being heard
            if generation == self._generation:
                self._process, self._coming = process, None
                self._prepared, self._robot = prepared, robot
                if prepared.plan_key not in (None, plan_key):  # the registration was changed before it was read
                    self._plan_key = prepared.plan_key
                self._talk = SettingsExchange(prepared.settings)
                self._notes.clear()
                self._words_for_holder.clear()
                self._state, self._words = "ready", ""
                self._unrecorded = prepared.unrecorded
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

    def _end(self, state: ProcessStatus, words: str, only: RehearsalProcess | None = None) -> None:
        """only: end nothing unless this process is here; somebody else may have ended it, and another one comes."""
        with self._lock:
            if only is not None and self._process is not only:
                return
            self._generation += 1
            self._hand = None
            processes = [process for process in (self._process, self._coming) if process is not None]
            self._process = self._coming = self._prepared = self._robot = None
            self._state, self._words, self._plan_key = state, words, None
            self._unrecorded = ""
        for process in processes:
            process.close()
            for event in process.events():  # the rest of the run is written when the process has ended
                if event.kind == "unrecorded":
                    self._not_recorded(event.text, "It ended before its run was whole.")

    def snapshot(self) -> RigidSnapshot | None:
        process = self._live()
        return None if process is None else process.snapshot()

    def rows(self) -> RowReader | None:
        """Every step's row from now on; None while there is no robot that can be driven."""
        process = self._live()
        try:
            return None if process is None else process.rows()
        except ControlError:
            return None

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
            elif event.kind == "unrecorded":
                with self._lock:
                    self._unrecorded = self._unrecorded or event.text
                self._not_recorded(event.text, "It can go on.")
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

    def _not_recorded(self, reason: str, what_now: str) -> None:
        _LOG.warning("the recording of a drive has ended before the drive; its window says why")
        with self._lock:
            self._words_for_holder.append(f"This drive is not recorded any more: {reason}. {what_now}")

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

    def plan_changed(self, before: object, after: object) -> None:
        """The plan has changed in nothing but what this rehearsal has already: it is still the rehearsal of it."""
        with self._lock:
            if self._plan_key == before:
                self._plan_key = after

    def _live(self) -> RehearsalProcess | None:
        with self._lock:
            return self._process

    def _ask(self, process: RehearsalProcess, settings: ControlSettings) -> None:
        try:
            process.set_settings(settings)
        except ControlError:  # it was not sent: no answer will come
            with self._lock:
                self._talk.forget()
            raise


def _process(prepared: Prepared) -> RehearsalProcess:
    """A process for a scene, not started; with a recording where there is one."""
    if prepared.recording is None:
        return RehearsalProcess(prepared.spec, prepared.settings)
    return RecordedProcess(prepared.spec, prepared.settings, prepared.recording)


def _silence(seconds: float) -> str:
    return (
        f"The control process has not answered for {seconds:.0f} s: nobody knows where the robot is, "
        "and what was shown last is old. End it, and start the rehearsal again."
    )
