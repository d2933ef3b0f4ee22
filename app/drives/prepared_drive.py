"""The inputs of a control process: the spec of its world, the settings at the start, and the recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from app.drives.live_comments import RunComment
from app.drives.recordings import Recording
from vfix_engine.runtime.control_mode import Control
from vfix_engine.runtime.process import ControlProcess
from vfix_engine.runtime.settings import WorldSettings
from vfix_engine.runtime.snapshot import Snapshot
from vfix_engine.runtime.system import SystemSpec

T = TypeVar("T", bound=Snapshot)


@dataclass(frozen=True, eq=False)
class PreparedDrive(Generic[T]):
    """A drive that can be started; a tab adds the values that it displays in a subclass.

    T is the type of the world's snapshots.
    settings: at the start. recording: stores the run; None where it is not stored.
    unrecorded: why the run cannot be stored; '' where it can.
    made_of: a key of its inputs, where they were read again for it; None: the requested key.
    control: mode and device at the start; None: those of the world. preset: its name, None for the default.
    """

    spec: SystemSpec
    settings: WorldSettings
    recording: Recording | None = None
    unrecorded: str = ""
    made_of: Any = None
    control: Control | None = None
    preset: str | None = None

    @property
    def comments(self) -> tuple[RunComment, ...]:
        """Those of this drive so far."""
        return () if self.recording is None else self.recording.comments.all

    def begin(self, process: ControlProcess[T]) -> None:
        """What the drive begins with, called once when the process is ready, before its first step.

        Raises VfixError where it cannot be driven.
        """

    def refusal(self, asked: Any, in_force: Any, snapshot: T | None) -> str:
        """Why the requested settings are refused and what to do; '' to show the words of the process."""
        return ""
