"""The run of a drive on the command line: written beside it, kept by the store."""

from __future__ import annotations

from contextlib import suppress
from shutil import rmtree
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.commands.head_options import say_notes
from app.services import Services
from app.services.plan_model import Plan
from app.services.resolve import ResolvedCase
from vfix_engine.errors import VfixError
from vfix_engine.runtime.run import RunWriter
from vfix_engine.simulation.rehearsal import Rehearsal
from vfix_engine.simulation.rigid_spec import RigidSpec, SceneSpec

Array = NDArray[np.float64]


class RecordedRun:
    """Writes the run of one drive. A disk that does not take it ends the recording and is told; the drive goes on."""

    def __init__(self, services: Services, rehearsal: Rehearsal, seed: int | None) -> None:
        """Raises StorageError where nothing can be written."""
        self._services = services
        self._folder = services.runs.new_folder()
        spec = RigidSpec(SceneSpec.of(rehearsal.scene), rehearsal.settings)
        self._writer: RunWriter | None = RunWriter(self._folder, spec, rehearsal.system.row_layout, seed)

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
        """The drive has failed: what was written of it is removed."""
        writer, self._writer = self._writer, None
        if writer is not None:
            with suppress(OSError):
                writer.abandon()
        rmtree(self._folder.parent, ignore_errors=True)

    def keep(self, case: ResolvedCase, plan: Plan) -> str | None:
        """The drive has ended: the id of its run; None, told on stderr, where it could not be kept."""
        if self._writer is None:
            return None
        plan_id = plan.id if plan.revision else None  # one of a file has none
        try:
            self._writer.close()
            return self._services.runs.keep(self._folder, origin="command line", case_id=case.id, plan_id=plan_id).id
        except (OSError, VfixError) as error:
            say_notes([f"the run was not kept: {error}"])
            return None

    def _give_up(self, error: OSError) -> None:
        writer, self._writer = self._writer, None
        if writer is not None:
            with suppress(OSError):
                writer.abandon()
        say_notes([f"the run is not recorded any more: {error.strerror or error}"])
