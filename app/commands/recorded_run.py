"""The run of a drive on the command line: recorded during the drive, then stored."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

from app.commands.head_options import say_notes
from app.planning.run_sideways import measure_sideways
from app.services import Services
from vfix_engine.anatomy.piercing import Ways
from vfix_engine.arrays import Array
from vfix_engine.errors import VfixError
from vfix_engine.runtime.control_mode import Control
from vfix_engine.runtime.run import RunWriter
from vfix_engine.runtime.system import Column, SystemSpec


class RecordedRun:
    """Records the run of one drive. A disk error ends the recording with a message; the drive continues."""

    def __init__(
        self,
        services: Services,
        spec: SystemSpec,
        columns: tuple[Column, ...],
        seed: int | None,
        control: Control | None = None,
        preset: str | None = None,
    ) -> None:
        """control, preset: as of ``RunWriter``. Raises StorageError where the folder is not writable."""
        self._services = services
        self._folder = services.runs.new_folder()
        self._writer: RunWriter | None = RunWriter(self._folder, spec, columns, seed, control, preset)

    def tick(self, line: Array) -> None:
        if self._writer is not None:
            try:
                self._writer.tick(line)
            except OSError as error:
                self._give_up(error)

    def event(self, kind: str, content: Any) -> None:
        if self._writer is not None:
            try:
                self._writer.event(kind, content)
            except OSError as error:
                self._give_up(error)

    def drop(self) -> None:
        """Remove the recording of a failed drive."""
        writer, self._writer = self._writer, None
        if writer is not None:
            with suppress(OSError):
                writer.abandon()
        self._services.runs.discard(self._folder)

    def keep(self, case_id: str | None = None, plan_id: str | None = None, ways: Ways | None = None) -> str | None:
        """Store the run and return its id; None, with a message on stderr, on failure. ways: round tissue."""
        if self._writer is None:
            return None
        try:
            self._writer.close()
            measure = measure_sideways(ways)
            run = self._services.runs.keep(
                self._folder, origin="command line", case_id=case_id, plan_id=plan_id, measure=measure
            )
            return run.id
        except (OSError, VfixError) as error:
            say_notes([f"the run was not kept: {error}"])
            return None

    def _give_up(self, error: OSError) -> None:
        writer, self._writer = self._writer, None
        if writer is not None:
            with suppress(OSError):
                writer.abandon()
        say_notes([f"the run is not recorded any more: {error.strerror or error}"])
