"""What an endoscope sees of a head: the surface of its air, made of the CT about a path as a job, once for each box."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np

from app.cases.model import Case, VolumeInfo
from app.cases.service import CaseService
from app.imaging.derived_of_ct import DerivedOfCt
from app.imaging.endoscope_file import EndoscopeFile, packed
from app.kit.array_files import read_arrays
from app.kit.cache import Cache
from app.kit.jobs import Jobs
from app.kit.values import Position
from app.store import Store
from vfix_engine.anatomy.endoscopy import mucosa
from vfix_engine.anatomy.endoscopy.air_surface import air_surface, box_about
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.shapes import Shape, shape_table
from vfix_engine.progress import ProgressCallback

AROUND_MM = 10.0  # of a path and its targets, that a finer CT of a case must hold to be used
KEPT = 6  # files of a CT: one for each box and each bone removal, those that were used last
_MAKING = threading.Lock()  # one surface at a time: each takes up to a gigabyte
_SURFACE, _LIT = 0.2, 0.9  # fractions of the time until each stage, on the nose of the synthetic head


class EndoscopeSurface(DerivedOfCt[EndoscopeFile]):
    """The surface in one box. Thread-safe."""

    job = "endoscope"
    no_ct = "this head has no CT, so an endoscope's picture cannot be made."

    def __init__(
        self,
        store: Store,
        cases: CaseService,
        jobs: Jobs,
        box: Array,
        volume: VolumeInfo | None,
        removed: Sequence[Shape] = (),
    ) -> None:
        """box: corners (2, 3) in LPS mm. volume: the case's CT, None for a case without one. removed: with its bone."""
        super().__init__(store, cases, jobs)
        self._box, self._volume, self._removed = box, volume, removed
        self.file = f"endoscope-1-{hashlib.sha256(_made_of(box, volume, removed).encode()).hexdigest()[:16]}.npz"

    def volume(self, case: Case) -> Volume | None:
        return None if self._volume is None else self._cases.volume(case, self._volume.name)

    def lane(self, case_id: str) -> str:
        """One for all cases: a job that waits for another surface would keep a thread from other work."""
        return self.job

    def find(self, volume: Volume, progress: ProgressCallback) -> EndoscopeFile:
        with _MAKING:
            return self._found(volume, progress)

    def _found(self, volume: Volume, progress: ProgressCallback) -> EndoscopeFile:
        surface = air_surface(
            volume, self._box, removed=self._removed, progress=lambda stage, share: progress(stage, _SURFACE * share)
        )
        light = mucosa.openness(
            surface, progress=lambda stage, share: progress(stage, _SURFACE + (_LIT - _SURFACE) * share)
        )
        progress("Colouring by what the CT shows below", _LIT)
        return packed(surface, mucosa.colours(volume, surface), light, self._box)

    def write(self, value: EndoscopeFile, file: BinaryIO) -> None:
        np.savez(file, packed=np.frombuffer(value.data, np.uint8))

    def read(self, path: Path) -> EndoscopeFile:
        found = EndoscopeFile(read_arrays(path)["packed"].tobytes())
        if self._store.writable:
            path.touch()  # used now
        return found

    def _make(self, case: Case, key: str, progress: ProgressCallback) -> EndoscopeFile:
        made = super()._make(case, key, progress)
        if self._store.writable:
            self._store.derived.trim(key, "endoscope-*", KEPT)
        return made


class EndoscopeSurfaces:
    """The surfaces of all cases by their boxes. Thread-safe."""

    def __init__(self, store: Store, cases: CaseService, jobs: Jobs) -> None:
        self._of = store, cases, jobs
        self._cases = cases
        self._recent: Cache[tuple[str, str], EndoscopeSurface] = Cache(2)

    def about(self, case_id: str, places: Sequence[Position], removed: Sequence[Shape] = ()) -> EndoscopeSurface:
        """The surface about a path and its targets, in the finest CT that holds them, with air where bone is removed.

        Raises NotFound, and InputError without a place.
        """
        if not places:
            raise InputError("the picture of an endoscope is made about a path; this plan has none.")
        case = self._cases.get(case_id)
        box, volume = box_about(places), self._finest(case, np.asarray(places, dtype=np.float64))
        key = case_id, _made_of(box, volume, removed)
        return self._recent.get(key, lambda: EndoscopeSurface(*self._of, box, volume, removed))

    def forget(self, keys: Iterable[str]) -> None:
        """Drop from memory what may have been made of files that were deleted."""
        self._recent = Cache(2)

    def _finest(self, case: Case, places: Array) -> VolumeInfo | None:
        """The finest CT that holds places (n, 3), else the widest; None for a case without a CT."""
        for info in case.volumes[:0:-1]:
            volume = self._cases.volume(case, info.name)
            if volume is not None and _holds(volume, places):
                return info
        return case.volumes[0] if case.volumes else None


def _made_of(box: Array, volume: VolumeInfo | None, removed: Sequence[Shape]) -> str:
    kinds, numbers = shape_table(removed)
    without = f" {kinds.tolist()} {numbers.tolist()}" if removed else ""
    return f"{'' if volume is None else volume.source} {box.tolist()}{without}"


def _holds(volume: Volume, places: Array) -> bool:
    low, high = volume.bounds
    return bool((places >= low + AROUND_MM).all() and (places <= high - AROUND_MM).all())
