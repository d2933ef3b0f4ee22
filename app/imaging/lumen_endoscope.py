"""What an endoscope sees of a lumen: its wall from inside, made of the case's surface as a job."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from app.cases.model import Case
from app.cases.service import CaseService
from app.imaging.endoscope_file import EndoscopeFile, packed
from app.kit.cache import Cache
from app.kit.errors import NotFound
from app.kit.jobs import Job, Jobs, Progress
from vfix_engine.anatomy.endoscopy import mucosa
from vfix_engine.anatomy.endoscopy.wall_surface import wall_surface
from vfix_engine.errors import InputError

RAYS = 24  # from each vertex
REACH_MM = 14.0  # what is farther away takes no light
KEPT = 2  # walls in memory; making one takes seconds


class LumenEndoscope:
    """The walls of lumens as the renderer takes them. Thread-safe."""

    def __init__(self, cases: CaseService, jobs: Jobs) -> None:
        self._cases, self._jobs = cases, jobs
        self._known: Cache[str, EndoscopeFile] = Cache(KEPT)

    def key(self, case: Case) -> str:
        """Of the wall; lumens with equal keys look the same. Raises InputError for a case without a lumen."""
        if case.kind != "lumen":
            raise InputError(f"a {case.kind} has no wall of a lumen.")
        return case.content_hash

    def start(self, case_id: str) -> Job:
        """Make it as a job. Raises NotFound, and InputError for a case without a lumen."""
        case = self._cases.get(case_id)
        key = self.key(case)

        def work(progress: Progress) -> str:
            self._known.get(key, lambda: self._make(case, progress))
            return case_id

        return self._jobs.submit(
            work, kind="endoscope", lane="endoscope", case_id=case_id, subject=case.name, same=f"lumen {key}"
        )

    def known(self, case_id: str) -> EndoscopeFile:
        """The wall that was made. Raises NotFound where it was not made yet, and InputError as `start`."""
        found = self._known.peek(self.key(self._cases.get(case_id)))
        if found is None:
            raise NotFound("what an endoscope sees of this lumen is not made yet; POST makes it.")
        return found

    def forget(self, keys: Iterable[str]) -> None:
        """Drop from memory what may have been made of files that were deleted."""
        self._known = Cache(KEPT)

    def _make(self, case: Case, progress: Progress) -> EndoscopeFile:
        progress("Reading the wall", 0.05)
        surface = wall_surface(self._cases.case_surface(case.id))
        light = mucosa.openness(
            surface,
            rays=RAYS,
            reach_mm=REACH_MM,
            progress=lambda stage, share: progress(stage, 0.1 + 0.8 * share),
        )
        return packed(surface, mucosa.lumen_colours(surface), light, np.asarray(surface.mesh.bounds))
