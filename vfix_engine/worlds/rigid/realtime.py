"""The rigid tool in the control process: a rehearsal at a fixed rate, away from the page."""

from __future__ import annotations

from pathlib import Path

from ...control import ControlSettings
from ...runtime.process import ControlProcess
from ...runtime.requests import SetSettings, SetTask
from .snapshot import RigidSnapshot
from .spec import RigidSpec, SceneSpec

__all__ = ["RehearsalProcess", "SceneSpec"]


class RehearsalProcess(ControlProcess[RigidSnapshot]):
    """A rehearsal in a process of its own; see ``ControlProcess``."""

    def __init__(self, scene: SceneSpec, settings: ControlSettings, real_time: bool = True, record: Path | None = None):
        super().__init__(RigidSpec(scene, settings), real_time, record)

    def set_mode(self, mode: str, target_index: int | None = None) -> None:
        """Another of ``rehearsal.MODES``; ``target_index`` is the target of 'inspect', the first by default."""
        self.apply(SetTask(mode, 0 if target_index is None else int(target_index)))

    def set_settings(self, settings: ControlSettings) -> None:
        """Takes effect at once, including margin and rate."""
        self.apply(SetSettings(settings))
