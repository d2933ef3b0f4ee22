"""A rehearsal whose run is kept when its process has ended."""

from __future__ import annotations

import threading

from app.drives.recordings import Recording
from app.kit.prompt_threads import PROMPT_THREADS
from vfix_engine.control import ControlSettings
from vfix_engine.worlds.rigid.realtime import RehearsalProcess, SceneSpec


class RecordedProcess(RehearsalProcess):
    """A RehearsalProcess with a recording, which is handed over once, by whoever closes the process first."""

    def __init__(self, scene: SceneSpec, settings: ControlSettings, recording: Recording) -> None:
        super().__init__(scene, settings, record=recording.folder)
        self._recording = recording
        self._one_keeper = threading.Lock()
        self._kept = False

    def start(self) -> None:
        """Start it; what writes its run does not hold up the hand that drives it."""
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
