"""The control process of a drive: started in the background, monitored, and ended."""

from __future__ import annotations

import contextlib
import json
import logging
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor
from functools import partial
from typing import Any, Generic, Protocol, TypeVar

from app.drives.drive_record import HAND, ProcessStatus
from app.drives.prepared_drive import PreparedDrive
from app.drives.recorded_process import RecordedProcess
from app.drives.settings_exchange import SettingsExchange
from vfix_engine.error_places import error_places
from vfix_engine.errors import ControlError, VfixError
from vfix_engine.runtime.control_mode import FREEHAND, Control
from vfix_engine.runtime.process import ControlProcess
from vfix_engine.runtime.requests import Request, SetSettings
from vfix_engine.runtime.ring import RowReader
from vfix_engine.runtime.settings import WorldSettings
from vfix_engine.runtime.snapshot import Snapshot

P = TypeVar("P", bound=PreparedDrive[Any])
T = TypeVar("T", bound=Snapshot)


class Tell(Protocol):
    """Shows how far a start is; raises ControlError once nobody waits for it."""

    def __call__(self, words: str, fraction: float | None = None, /) -> None:
        """words: what is being done; fraction: of it, None where that is not known."""


SILENT_S = 2.0  # a process without a new snapshot for this long hangs; one at rest publishes several a second
_ENDED = "The control process ended. Start the rehearsal again."
_NOT_WANTED = "the start is not wanted any more"
_LOG = logging.getLogger(__name__)


class DriveProcess(Generic[P, T]):
    """At most one control process at a time, of any world, and its state. Thread-safe.

    P is the type of the prepared drive, T that of its snapshots.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._checking = threading.Lock()  # acquired before _lock: one thread at a time reads the process's events
        self._process: ControlProcess[T] | None = None
        self._coming: ControlProcess[T] | None = None  # being started
        self._prepared: P | None = None
        self._state: ProcessStatus = "absent"
        self._words = ""
        self._fraction: float | None = None  # of what the words say
        self._made_of: object = None  # key of the inputs that it was prepared from
        self._generation = 0
        self._exchange: SettingsExchange | None = None  # None until there is a process
        self._notes: list[str] = []  # messages of the process, until it is known whether they are about a setting
        self._words_for_holder: deque[str] = deque(maxlen=8)
        self._unrecorded = ""  # why this drive is not recorded, or not to its end
        self._hand: str | None = None  # the client whose hand holds the grip
        self._requested: Request | None = None
        self.control: Control = HAND  # of this drive and the next one, and so the preset
        self.preset: str | None = None
        self.options: Any = None  # what else the tab's drives are prepared with; None: as they come

    @property
    def state(self) -> ProcessStatus:
        with self._lock:
            return self._state

    def is_for(self, made_of: object) -> bool:
        """Whether the present or starting robot was prepared from these inputs."""
        with self._lock:
            return self._made_of == made_of and self._state in ("starting", "ready", "silent")

    def choose(self, control: Control, preset: str | None) -> None:
        """Mode, device and preset of the next drive and of one that is starting; who may is the tab's matter."""
        with self._lock:
            self.control, self.preset = control, preset

    def _tell(self, generation: int, words: str, fraction: float | None = None) -> None:
        """Show how far a start is, on its preparation's thread. Raises ControlError once nobody waits for it."""
        with self._lock:
            if generation != self._generation or self._state != "starting":
                raise ControlError(_NOT_WANTED)
            self._words, self._fraction = words, fraction

    def _compiling(self, generation: int, count: int) -> None:
        self._tell(generation, f"First start: compiling, {count} parts done.")

    def open(
        self, made_of: object, prepare: Callable[[Tell], P], executor: Executor, words: str = "Starting …"
    ) -> None:
        """Prepare the drive and start its process in the background; a running one is closed first.

        made_of: the inputs of the preparation, see :meth:`is_for`. prepare: gets what shows how far this start is.
        words: shown meanwhile.
        """
        self.close()
        with self._lock:
            self._generation += 1
            generation = self._generation
            self._state, self._words, self._made_of = "starting", words, made_of
            self._fraction = None
            self._requested = None
        executor.submit(self._start, generation, made_of, prepare)

    def _start(self, generation: int, made_of: object, prepare: Callable[[Tell], P]) -> None:
        process: ControlProcess[T] | None = None
        try:
            prepared = prepare(partial(self._tell, generation))
            process = _process(prepared)
            with self._lock:
                if generation != self._generation:
                    raise ControlError(_NOT_WANTED)
                self._coming = process
            process.start()
            process.wait_ready(heard=partial(self._compiling, generation))
            prepared.begin(process)
        except VfixError as error:
            self._not_started(generation, process, str(error))
            return
        except Exception as error:
            _LOG.error("a rehearsal could not be started: %s", error_places(error))
            self._not_started(generation, process, "The rehearsal could not be started; the planner's log says why.")
            return
        with self._checking, self._lock:  # not while events of another process are read
            if generation == self._generation:
                self._process, self._coming, self._prepared = process, None, prepared
                if prepared.made_of not in (None, made_of):  # it was changed before it was read
                    self._made_of = prepared.made_of
                self._exchange = SettingsExchange(prepared.settings)
                self._notes.clear()
                self._words_for_holder.clear()
                self._state, self._words = "ready", ""
                self._unrecorded = prepared.unrecorded
                self._tell_control(process, prepared)
                return
        process.close()

    def _tell_control(self, process: ControlProcess[T], prepared: P) -> None:
        """The mode may have been chosen anew while the process started with the one before; the caller has the lock.

        To or from a free hand, and for another preset, the tab opens another process.
        """
        begun, chosen = prepared.control, self.control
        if begun is None or chosen == begun or FREEHAND in (chosen.mode, begun.mode):
            return
        with contextlib.suppress(ControlError):  # it has ended: reported by the following check
            process.control(chosen)

    def _not_started(self, generation: int, process: ControlProcess[T] | None, words: str) -> None:
        if process is not None:
            process.close()
        with self._lock:
            if generation == self._generation:
                self._coming = None
                self._state, self._words = "failed", words

    def close(self) -> None:
        """End the process, also one that is still starting."""
        self._end("absent", "")

    def _end(self, state: ProcessStatus, words: str, only: ControlProcess[T] | None = None) -> None:
        """only: end nothing but this process; another thread may have ended it and started another one."""
        with self._lock:
            if only is not None and self._process is not only:
                return
            self._generation += 1
            self._hand = None
            processes = [process for process in (self._process, self._coming) if process is not None]
            self._process = self._coming = self._prepared = self._exchange = None
            self._state, self._words, self._made_of = state, words, None
            self._unrecorded = ""
        for process in processes:
            process.close()
            for event in process.events():  # the rest of the run is written when the process has ended
                if event.kind == "unrecorded":
                    self._not_recorded(event.text, "It ended before its run was whole.")

    def snapshot(self) -> T | None:
        """The newest snapshot; None while there is no robot."""
        process = self._live()
        return None if process is None else process.snapshot()

    def rows(self) -> RowReader | None:
        """A reader of every step's row from now on; None while there is no robot that can be driven."""
        process = self._live()
        try:
            return None if process is None else process.rows()
        except ControlError:
            return None

    def check(self) -> None:
        """Read the process's events since the last call; detect that it has ended, or hangs.

        Called for every watching client, each on its own thread.
        """
        with self._checking:
            process = self._live()
            if process is not None:
                self._hear(process)

    def _hear(self, process: ControlProcess[T]) -> None:
        words = ""
        for event in process.events():
            if event.kind == "note":
                self._notes.append(event.text)
            elif event.kind == "settings":
                self._settings_answered(process, event.text)
            elif event.kind == "unrecorded":
                with self._lock:
                    self._unrecorded = self._unrecorded or event.text
                self._not_recorded(event.text, "It can go on.")
            elif event.kind == "failed":
                words = words or event.text
        with self._lock:
            if self._exchange is None or not self._exchange.open:
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

    def _watch(self, process: ControlProcess[T]) -> None:
        """Detect by the age of the newest snapshot that the process hangs, or that it runs again."""
        silent = process.silence_s
        with self._lock:
            if self._process is process and self._state in ("ready", "silent"):
                self._state, self._words = ("ready", "") if silent < SILENT_S else ("silent", _silence(silent))

    def _settings_answered(self, process: ControlProcess[T], text: str) -> None:
        """The answer to one change: the present settings, unchanged if it was refused."""
        snapshot = process.snapshot()
        reason = self._notes[-1] if self._notes else ""
        with self._lock:
            exchange, prepared = self._exchange, self._prepared
            if exchange is None or prepared is None:
                return
            in_force = exchange.in_force.from_dict(json.loads(text))
            to_send = exchange.answer(in_force, reason, partial(prepared.refusal, snapshot=snapshot))
            if exchange.refusal and self._notes:
                self._notes.pop()  # it is shown beside the slider
        if to_send is not None:
            with contextlib.suppress(ControlError):  # it has ended: reported by the following check
                self._send_settings(process, to_send)

    def made_of_changed(self, before: object, after: object) -> None:
        """The inputs changed only in a way that this drive has adopted: it counts as prepared from them."""
        with self._lock:
            if self._made_of == before:
                self._made_of = after

    def _live(self) -> ControlProcess[T] | None:
        with self._lock:
            return self._process

    def _send_settings(self, process: ControlProcess[T], settings: WorldSettings) -> None:
        try:
            process.apply(SetSettings(settings))
        except ControlError:  # it was not sent: there will be no answer
            with self._lock:
                if self._exchange is not None:
                    self._exchange.forget()
            raise


def _process(prepared: PreparedDrive[T]) -> ControlProcess[T]:
    """A process for a world, not started; with a recording if there is one."""
    if prepared.recording is None:
        return ControlProcess(prepared.spec, control=prepared.control)
    return RecordedProcess(prepared.spec, prepared.recording, prepared.control, prepared.preset)


def _silence(seconds: float) -> str:
    return (
        f"The control process has not answered for {seconds:.0f} s: nobody knows where the robot is, "
        "and what was shown last is old. End it, and start the rehearsal again."
    )
