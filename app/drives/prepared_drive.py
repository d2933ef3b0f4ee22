"""What a control process is started with: the spec of its world, the settings at the start, and the recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from app.drives.recordings import Recording
from vfix_engine.runtime.settings import WorldSettings
from vfix_engine.runtime.snapshot import Snapshot
from vfix_engine.runtime.system import SystemSpec

T = TypeVar("T", bound=Snapshot)


@dataclass(frozen=True, eq=False)
class PreparedDrive(Generic[T]):
    """A drive that can be started; a tab adds what it shows of it in a subclass.

    T is the type of the world's snapshots.
    settings: that the system starts with. recording: what keeps the run; None where nothing is kept.
    unrecorded: why the run cannot be kept; '' where it can.
    made_of: a key of what it was made of, where that was read anew for it; None: it is what was asked for.
    """

    spec: SystemSpec
    settings: WorldSettings
    recording: Recording | None = None
    unrecorded: str = ""
    made_of: Any = None

    def refusal(self, asked: Any, in_force: Any, snapshot: T | None) -> str:
        """Why the settings that were asked for are refused and what to do; '' to show the words of the process."""
        return ""
