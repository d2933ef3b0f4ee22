"""A control process whose run is stored when it has ended."""

from __future__ import annotations

import threading
from typing import TypeVar

from app.drives.recordings import Recording
from app.kit.prompt_threads import PROMPT_THREADS
from vfix_engine.runtime.control_mode import Control
from vfix_engine.runtime.process import ControlProcess
from vfix_engine.runtime.snapshot import Snapshot
from vfix_engine.runtime.system import SystemSpec

T = TypeVar("T", bound=Snapshot)


class RecordedProcess(ControlProcess[T]):
    """A ControlProcess with a recording, which is handed over once, by the first call that closes the process."""

    def __init__(
        self, spec: SystemSpec, recording: Recording, control: Control | None = None, preset: str | None = None
    ) -> None:
        super().__init__(spec, record=recording.folder, control=control, preset=preset)
        self._recording = recording
        self._one_keeper = threading.Lock()
        self._kept = False

    def start(self) -> None:
        """Start it; writing its run does not delay the hand's input."""
        super().start()
        if self.recording_thread is not None:
            PROMPT_THREADS.enrol(self.recording_thread)

    def close(self) -> None:
        """End the process, and hand its run over to be stored."""
        super().close()
        with self._one_keeper:
            kept, self._kept = self._kept, True
        if not kept:
            self._recording.keep()
