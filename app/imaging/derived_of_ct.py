"""What is computed from the CT of a head: as a job when it is first asked for, stored beside the case, not in it.

So no plan refers to it and no export holds it; it is removed with the CT.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from pathlib import Path
from typing import BinaryIO, ClassVar, Generic, TypeVar

from app.cases.files import STORED
from app.cases.model import Case
from app.cases.referenced_files import referred_files
from app.cases.service import CaseService
from app.kit.array_files import ArraysUnusable
from app.kit.cache import Cache
from app.kit.errors import NotFound, TooLarge
from app.kit.jobs import Job, JobKind, Jobs, Progress
from app.store import Store
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume
from vfix_engine.progress import ProgressCallback, no_progress

Value = TypeVar("Value")


class DerivedOfCt(Generic[Value]):
    """One value a CT; of a case with several CTs that of the widest. Thread-safe.

    A subclass says what it is: job: kind of its jobs. file: suffix of its files, with a number that changes where the
    value is made in another way. no_ct: words for a case without a CT of a head.
    """

    job: ClassVar[JobKind]
    file: str
    no_ct: ClassVar[str]

    def __init__(self, store: Store, cases: CaseService, jobs: Jobs) -> None:
        self._store, self._cases, self._jobs = store, cases, jobs
        self._known: Cache[str, Value] = Cache(2)

    def find(self, volume: Volume, progress: ProgressCallback) -> Value:
        """The value of a CT. Raises ImageError where the CT does not show it."""
        raise NotImplementedError

    def volume(self, case: Case) -> Volume | None:
        """The CT that it is made of."""
        return self._cases.volume(case)

    def write(self, value: Value, file: BinaryIO) -> None:
        raise NotImplementedError

    def read(self, path: Path) -> Value:
        """Raises OSError, KeyError or InputError where the file is damaged."""
        raise NotImplementedError

    def start(self, case_id: str) -> Job:
        """Make it as a job, or read it where it was made before. Raises NotFound, and InputError as `make`."""
        case = self._cases.get(case_id)
        key = _key_of(case, self.no_ct)

        def work(progress: Progress) -> str:
            self.make(case_id, progress)
            return case_id

        return self._jobs.submit(
            work,
            kind=self.job,
            lane=self.lane(case_id),
            case_id=case_id,
            subject=case.name,
            same=f"{self.file} {key}",
        )

    def lane(self, case_id: str) -> str:
        """Of its jobs, one of which runs at a time."""
        return f"{self.job} {case_id}"

    def forget(self, keys: Iterable[str]) -> None:
        """Drop from memory what was made of files that were deleted."""
        for key in keys:
            self._known.drop(key)

    def make(self, case_id: str, progress: ProgressCallback = no_progress) -> Value:
        """Return it, made and stored where it is missing.

        Raises NotFound, InputError for a case without a CT of a head, and ImageError as `find`.
        """
        case = self._cases.get(case_id)
        key = _key_of(case, self.no_ct)
        return self._known.get(key, lambda: self._stored(key) or self._make(case, key, progress))

    def known(self, case: Case) -> Value | None:
        """What was made of a case before; None where it was not, or where that file is damaged. Never waits."""
        if not has_head_ct(case):
            return None
        key = _key_of(case)
        found = self._known.peek(key)
        if found is None and (stored := self._stored(key)) is not None:
            found = self._known.get(key, lambda: stored)
        return found

    def _make(self, case: Case, key: str, progress: ProgressCallback) -> Value:
        volume = self.volume(case)
        if volume is None:
            raise InputError(self.no_ct)
        value = self.find(volume, progress)
        if self._store.writable:
            self._store.derived.put(key, self.file, lambda file: self.write(value, file))
            if key not in _keys(self._store, self._cases):  # every case with this CT was removed for good meanwhile
                self._store.derived.remove([key])
                raise NotFound(f"there is no case {case.id!r:.80}.")
        return value

    def _stored(self, key: str) -> Value | None:
        """The value as stored; None where it is missing or damaged."""
        path = self._store.derived.path(key, self.file)
        if path is None:
            return None
        try:
            return self.read(path)
        except (OSError, KeyError, InputError, ArraysUnusable, TooLarge):
            return None


def has_head_ct(case: Case) -> bool:
    return case.kind == "head" and case.has_volume


def sweep_derived(store: Store, cases: CaseService) -> None:
    """Delete files of no case any more, which a planner that was killed while its case was removed has left."""
    if not store.writable:
        return
    made = store.derived.keys()  # before the cases: one that comes meanwhile keeps its files
    if left := made - _keys(store, cases):
        store.derived.remove(sorted(left))


def _keys(store: Store, cases: CaseService) -> set[str]:
    """The keys of all cases, deleted ones too, and all hashes that any row names."""
    with store.reading() as session:
        named = referred_files(session)
    return named | {_key_of(case) for case in cases.list(include_deleted=True) if has_head_ct(case)}


def _key_of(case: Case, no_ct: str = "") -> str:
    """The hash of what it is made of. Raises InputError without a CT of a head, with these words."""
    if not has_head_ct(case):
        raise InputError(no_ct)
    source = case.volumes[0].source
    if source.startswith(STORED):
        return source.removeprefix(STORED)
    return hashlib.sha256(f"{source} {case.content_hash}".encode()).hexdigest()
