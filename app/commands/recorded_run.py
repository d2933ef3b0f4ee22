"""The run of a drive on the command line: recorded during the drive, then stored."""

from __future__ import annotations

import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any

from app.commands.head_options import say_notes
from app.exchange.runs.export import export_run
from app.planning.run_sideways import add_sideways
from app.services import Services
from vfix_engine.anatomy.piercing import Ways
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError, VfixError
from vfix_engine.runtime.control_mode import Control
from vfix_engine.runtime.run import Run, RunWriter
from vfix_engine.runtime.system import Column, SystemSpec


class RecordedRun:
    """Records the run of one drive. A disk error ends the recording with a message; the drive continues."""

    def __init__(
        self,
        services: Services | None,
        spec: SystemSpec,
        columns: tuple[Column, ...],
        seed: int | None,
        control: Control | None = None,
        preset: str | None = None,
    ) -> None:
        """services: None to store nothing. control, preset: as of ``RunWriter``.

        Raises StorageError where the folder is not writable.
        """
        self._services = services
        self._place: tempfile.TemporaryDirectory[str] | None = None
        if services is None:
            self._place = tempfile.TemporaryDirectory(prefix="vfix-run-")
            self._folder = Path(self._place.name) / "run"
        else:
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
        self._discard()

    def keep(
        self,
        case_id: str | None = None,
        plan_id: str | None = None,
        ways: Ways | None = None,
        export: Path | None = None,
    ) -> str | None:
        """Store the run and return its id; None, with a message on stderr, on failure, and where nothing is stored.

        ways: round tissue. export: a file that the run is written to as well, see `export_run`; raises InputError on
        failure.
        """
        writer, self._writer = self._writer, None
        if writer is None:
            if export is not None:
                raise InputError(f"the recording {export} cannot be written: the run was not recorded to its end")
            return None
        try:
            writer.close()
            pierced = None if ways is None else add_sideways(self._folder, ways)
            if export is not None:
                export_run(Run.read(self._folder), export)
            return self._store(case_id, plan_id, pierced)
        except OSError as error:
            say_notes([f"the run was not kept: {error}"])
            return None
        finally:
            self._discard()

    def _store(self, case_id: str | None, plan_id: str | None, pierced: dict[str, Any] | None) -> str | None:
        if self._services is None:
            return None
        try:
            run = self._services.runs.keep(
                self._folder, origin="command line", case_id=case_id, plan_id=plan_id, measure=lambda _: pierced
            )
            return run.id
        except VfixError as error:
            say_notes([f"the run was not kept: {error}"])
            return None

    def _discard(self) -> None:
        if self._place is not None:
            self._place.cleanup()
        if self._services is not None:
            self._services.runs.discard(self._folder)

    def _give_up(self, error: OSError) -> None:
        writer, self._writer = self._writer, None
        if writer is not None:
            with suppress(OSError):
                writer.abandon()
        say_notes([f"the run is not recorded any more: {error.strerror or error}"])
