"""Recorded runs named on a command line: by the id of a stored one, or by the folder of another."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from app.extras import has_app, need_app
from app.services import Services, build_services
from app.settings import Settings
from vfix_engine.runtime.run import Run

if TYPE_CHECKING:  # a folder is read without a store
    from app.drives.stored_run import StoredRun


@dataclass(frozen=True, eq=False)
class FoundRun:
    """A run by the name that it was asked for by; stored: None for a folder."""

    name: str
    run: Run
    stored: StoredRun | None

    @property
    def origin(self) -> dict[str, str | None]:
        """What it is of, for JSON: `run`, and `case`, `plan` and `recorded`, which are null for a folder."""
        if self.stored is None:
            return {"run": self.name, "case": None, "plan": None, "recorded": None}
        stored = self.stored
        return {"run": self.name, "case": stored.case_id, "plan": stored.plan_id, "recorded": stored.recorded}


def optional_services() -> Services | None:
    """The services of the data folder; None where only the engine is installed."""
    return build_services(Settings.from_environment()) if has_app() else None


def find_run(services: Services | None, name: str) -> FoundRun:
    """Read a run. services: None without a store, where only folders are found.

    Raises NotFound, InputError for a folder without a readable run, StorageError, or AppMissing.
    """
    folder = Path(name)
    if folder.is_dir():
        return FoundRun(name, Run.read(folder), None)
    if services is None:
        raise need_app("A stored run")
    stored = services.runs.get(name)
    with services.runs.laid_out(name) as place:
        return FoundRun(name, Run.read(place), stored)
