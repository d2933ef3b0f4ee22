"""The skin of a head for display, made of its widest CT when it is first asked for.

It is a face (HAZ-34): derived from the CT and stored beside it, not in the case, so that no plan refers to it and no
export holds it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable

import numpy as np

from app.cases.files import STORED, surface_arrays
from app.cases.model import Case
from app.cases.referenced_files import referred_files
from app.cases.service import CaseService
from app.kit.array_files import ArraysUnusable, read_arrays
from app.kit.cache import Cache
from app.kit.errors import NotFound, TooLarge
from app.kit.jobs import Job, Jobs, Progress
from app.store import Store
from vfix_engine.anatomy.skin import skin_of_volume
from vfix_engine.errors import InputError
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.progress import ProgressCallback, no_progress

KIND = "skin-1.npz"  # another number where a skin is made in another way


class Skins:
    """Makes, stores and reads the skins of cases. Thread-safe."""

    def __init__(self, store: Store, cases: CaseService, jobs: Jobs) -> None:
        self._store, self._cases, self._jobs = store, cases, jobs
        self._known: Cache[str, TriangleMesh] = Cache(2)

    def start(self, case_id: str) -> Job:
        """Make the skin as a job, or read it where it was made before. Raises NotFound, and InputError as `make`."""
        case = self._cases.get(case_id)
        key = _key(case)

        def work(progress: Progress) -> str:
            self.make(case_id, progress)
            return case_id

        lane = f"skin {case_id}"
        return self._jobs.submit(work, kind="skin", lane=lane, case_id=case_id, subject=case.name, same=f"skin {key}")

    def forget(self, keys: Iterable[str]) -> None:
        """Drop from memory the skins made of files that were deleted."""
        for key in keys:
            self._known.drop(key)

    def sweep(self) -> None:
        """Delete files of no case any more, which a planner that was killed while its case was removed has left."""
        if not self._store.writable:
            return
        made = self._store.derived.keys()  # before the cases: one that comes meanwhile keeps its skin
        if left := made - self._keys():
            self._store.derived.remove(sorted(left))

    def _keys(self) -> set[str]:
        """The keys of all cases, deleted ones too, and all hashes that any row names."""
        with self._store.reading() as session:
            named = referred_files(session)
        return named | {_key(case) for case in self._cases.list(include_deleted=True) if has_skin(case)}

    def make(self, case_id: str, progress: ProgressCallback = no_progress) -> TriangleMesh:
        """Return the skin, made and stored where it is missing.

        Raises NotFound, InputError for a case without a CT of a head, and ImageError where the CT shows no skin.
        """
        case = self._cases.get(case_id)
        key = _key(case)
        return self._known.get(key, lambda: self._stored(key) or self._make(case, key, progress))

    def _make(self, case: Case, key: str, progress: ProgressCallback) -> TriangleMesh:
        volume = self._cases.volume(case)
        if volume is None:
            raise InputError("this case was made of a surface; only a CT shows skin.")
        skin = skin_of_volume(volume, progress=progress).mesh
        if self._store.writable:
            self._store.derived.put(key, KIND, lambda file: np.savez(file, **surface_arrays(skin)))
            if key not in self._keys():  # every case with this scan was removed for good meanwhile
                self._store.derived.remove([key])
                raise NotFound(f"there is no case {case.id!r:.80}.")
        return skin

    def _stored(self, key: str) -> TriangleMesh | None:
        """The skin as stored; None where it is missing or damaged."""
        path = self._store.derived.path(key, KIND)
        if path is None:
            return None
        try:
            arrays = read_arrays(path)
            return TriangleMesh(arrays["vertices"], arrays["faces"])
        except (OSError, KeyError, InputError, ArraysUnusable, TooLarge):
            return None


def has_skin(case: Case) -> bool:
    """Whether a skin can be made of a case."""
    return case.kind == "head" and case.has_volume


def _key(case: Case) -> str:
    """The hash of what the skin is made of. Raises InputError without a CT of a head."""
    if not has_skin(case):
        raise InputError("only the CT of a head shows skin.")
    source = case.volumes[0].source
    if source.startswith(STORED):
        return source.removeprefix(STORED)
    return hashlib.sha256(f"{source} {case.content_hash}".encode()).hexdigest()
