"""The recording of a scripted drive of a snake, where there is a store."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.commands.head_options import say_notes
from app.extras import has_app
from app.settings import Settings
from vfix_engine.errors import VfixError
from vfix_engine.worlds.snake import DriveSpec

if TYPE_CHECKING:  # a drive without a store keeps no run
    from app.commands.recorded_run import RecordedRun


class RunRecording:
    """The run of the drive; none without a store, nor, told on stderr, with one that takes nothing."""

    def __init__(self, seed: int | None) -> None:
        self._seed = seed
        self._run: RecordedRun | None = None

    def begin(self, spec: DriveSpec) -> RecordedRun | None:
        """The destination of the run of a drive that is at its start."""
        if not has_app():
            return None
        from app.commands.recorded_run import RecordedRun
        from app.services import build_services

        try:
            services = build_services(Settings.from_environment())
            self._run = RecordedRun(services, spec, spec.columns, self._seed)
        except (OSError, VfixError) as error:
            say_notes([f"the run is not recorded: {error}"])
            return None
        return self._run

    def keep(self) -> str | None:
        """The drive has ended: the id of its run."""
        return None if self._run is None else self._run.keep()

    def drop(self) -> None:
        """The drive has failed, and what was written of it with it."""
        if self._run is not None:
            self._run.drop()
