"""A rehearsal whose run is kept when its process has ended."""

from __future__ import annotations

import threading

from app.drives.recordings import Recording
from vfix_engine.control import ControlSettings
from vfix_engine.worlds.rigid.realtime import RehearsalProcess, SceneSpec


class RecordedProcess(RehearsalProcess):
    """A RehearsalProcess with a recording, which is handed over once, by whoever closes the process first."""

    def __init__(self, scene: SceneSpec, settings: ControlSettings, recording: Recording) -> None:
        super().__init__(scene, settings, record=recording.folder)
        self._recording = recording
        self._one_keeper = threading.Lock()
        self._kept = False

    def close(self) -> None:
        """End the process, and hand its run over to be stored."""
        super().close()
        with self._one_keeper:
            kept, self._kept = self._kept, True
        if not kept:
            self._recording.keep()
