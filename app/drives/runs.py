"""Runs of the store: the recordings of all drives, stored by hash, listed by case and plan, bounded in size.

A drive writes a folder, see `vfix_engine.runtime.run`: a manifest, the spec, the ticks, the events, the end.
Here the folder is split into files by hash, and restored for a reader. Nothing else of a drive is stored.
"""

from __future__ import annotations

import hashlib
import json
import logging
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from app.clock import utc_now
from app.drives.live_comments import beside, comments_beside
from app.drives.stored_run import COMMENTS, RunFile, RunOrigin, StoredRun, stored_run
from app.kit.errors import NotFound, TooLarge
from app.store import Store
from app.store.errors import StorageError
from app.store.models import CaseRow, DocumentRow, RunRow
from vfix_engine.error_places import error_kind
from vfix_engine.errors import InputError, VfixError
from vfix_engine.json_text import parse_json
from vfix_engine.runtime.run import END, EVENTS, MANIFEST, PART, SIDEWAYS, SPEC, TICKS

_LOG = logging.getLogger(__name__)

Measure = Callable[[Path], dict[str, Any] | None]

FILES = (MANIFEST, SPEC, TICKS, EVENTS, END, SIDEWAYS)
MAX_BYTES = 4 << 30  # of all runs of a data folder together; the oldest are deleted, but for a teacher's
MAX_JSON_BYTES = 4 << 20
_FORGOTTEN_S = 3600.0  # another planner may just be storing a file that no run has


class RunService:
    """Runs, by id; may be used from any thread."""

    def __init__(self, store: Store, max_bytes: int = MAX_BYTES) -> None:
        self._store, self._max_bytes = store, max_bytes
        store.drives.rescue = self._rescue

    def new_folder(
        self,
        origin: RunOrigin | None = None,
        *,
        case_id: str | None = None,
        plan_id: str | None = None,
        plan_sha256: str | None = None,
        began: str = "",
    ) -> Path:
        """A new path where a drive can write its run. A run that is not stored is removed when the planner ends.

        With an origin, the next start stores the remains of a killed planner there, as `keep` does.
        Raises StorageError where the data folder is not writable.
        """
        if not self._store.writable:
            raise StorageError("the data folder is only read.")
        folder = self._store.drives.open() / f"run-{secrets.token_hex(8)}"  # no parent folder, which would remain
        if origin is not None:
            try:
                note = {"origin": origin, "case_id": case_id, "plan_id": plan_id, "plan_sha256": plan_sha256}
                beside(folder, "json").write_text(json.dumps(note | ({"began": began} if began else {})))
            except OSError as error:
                raise StorageError(f"the data folder takes no recording: {error.strerror or error}.") from error
        return folder

    @staticmethod
    def discard(folder: Path) -> None:
        """Delete the folder of a drive, complete or interrupted, that is not stored."""
        for kind in ("json", "comments"):
            beside(folder, kind).unlink(missing_ok=True)
        for path in (folder, folder.with_name(folder.name + PART)):
            shutil.rmtree(path, ignore_errors=True)

    def keep(
        self,
        folder: Path,
        *,
        origin: RunOrigin,
        case_id: str | None = None,
        plan_id: str | None = None,
        plan_sha256: str | None = None,
        began: str = "",
        measure: Measure | None = None,
    ) -> StoredRun:
        """Store the run in a folder, complete or interrupted, and delete the folder; the oldest runs are deleted if
        needed.

        measure: called with the folder of the run before it is stored, and may add `sideways.f64` to it; returns what
        the tool pierced, as `PiercedReport` has it, or None.

        Raises InputError for a folder without a run, TooLarge for one that alone exceeds the limit, NotFound for a
        case or plan that is not stored, and StorageError.
        """
        folder = _written(folder)
        try:
            pierced = None if measure is None else measure(folder)
        except OSError as error:
            raise StorageError(f"the run could not be measured: {error.strerror or error}.") from error
        there = [folder / name for name in FILES if (folder / name).is_file()]
        manifest, end = _manifest(folder / MANIFEST), None
        if folder / END in there:
            end = _manifest(folder / END)
        size = sum(path.stat().st_size for path in there)
        if size > self._max_bytes:
            raise TooLarge(f"the run has {size:,} bytes; all runs together may have {self._max_bytes:,}.")
        run_id, comments = f"run-{secrets.token_hex(6)}", comments_beside(folder)
        try:
            files = {path.name: self._put(path) for path in there}
        except OSError as error:
            raise StorageError(f"the run could not be stored: {error.strerror or error}.") from error
        with self._store.writing() as session:
            try:
                _check_there(session, case_id, plan_id)
            except NotFound:  # purged during the drive: nothing of the case may remain, and a run contains its bone
                self._remove({file.sha256 for file in files.values()} - _known(session))
                raise
            stored: dict[str, Any] = {"manifest": manifest, "end": end, "origin": origin, "pierced": pierced}
            if plan_sha256 is not None:
                stored["plan_sha256"] = plan_sha256
            if began:
                stored["began"] = began
            if comments:
                stored[COMMENTS] = [vars(one) for one in comments]
            listed = {name: {"sha256": file.sha256, "size_bytes": file.size_bytes} for name, file in files.items()}
            row = RunRow(id=run_id, case_id=case_id, plan_id=plan_id, recorded=utc_now(), size_bytes=size)
            row.manifest, row.files = stored, listed
            session.add(row)
            session.flush()
            self._remove(self._bound(session))
        for path in there:  # a file equal to one of another run may have been deleted with that run before the commit
            if not self._store.run_files.has(files[path.name].sha256):
                self._put(path)
        self.discard(folder)
        return self.get(run_id)

    def list(self, case_id: str | None = None, plan_id: str | None = None) -> tuple[StoredRun, ...]:
        """Runs of a case or plan, or all, newest first."""
        query = _oldest_first()
        if case_id is not None:
            query = query.where(RunRow.case_id == case_id)
        if plan_id is not None:
            query = query.where(RunRow.plan_id == plan_id)
        with self._store.reading() as session:
            return tuple(stored_run(row) for row in session.scalars(query))[::-1]

    def get(self, run_id: str) -> StoredRun:
        """The run. Raises NotFound."""
        with self._store.reading() as session:
            return stored_run(row_of(session, run_id))

    def file(self, run_id: str, name: str) -> Path:
        """Path of a file of a run, as it was written.

        Raises NotFound, StorageError when it is gone, and InputError where it has changed since it was recorded.
        """
        files = self.get(run_id).files
        if name not in files:
            raise NotFound(f"this run has no file {name!r:.40}; it has: {', '.join(files)}.")
        path = self._path(name, files[name].sha256)
        _check_unchanged(path, name, files[name].sha256)
        return path

    def _path(self, name: str, sha256: str) -> Path:
        try:
            return self._store.run_files.path(sha256)
        except StorageError as error:  # a run cannot be imported again, as a case can
            raise StorageError(f"{name} of the run is missing; delete the run.") from error

    @contextmanager
    def laid_out(self, run_id: str) -> Iterator[Path]:
        """The folder of a run as it was written, for a reader of runs; it is removed afterwards.

        Raises as `file`.
        """
        files = self.get(run_id).files
        place = self._store.scratch.new_place()
        try:
            for name, file in files.items():
                shutil.copyfile(self._path(name, file.sha256), place / name)
                _check_unchanged(place / name, name, file.sha256)
            yield place
        except OSError as error:
            raise StorageError(f"the run could not be laid out: {error.strerror or error}.") from error
        finally:
            shutil.rmtree(place, ignore_errors=True)

    def mark_teacher(self, run_id: str, on: bool = True) -> StoredRun:
        """Mark a run as the teacher's, in place of another one of its plan, or take the mark away.

        Raises NotFound, and InputError for a run of no plan, or of a snake.
        """
        with self._store.writing() as session:
            row = row_of(session, run_id)
            run = stored_run(row)
            if on and (run.plan_id is None or run.mode is None):
                raise InputError("only a plan's run of a rigid tool can be a teacher's.")
            if on:
                for other in session.scalars(select(RunRow).where(RunRow.plan_id == run.plan_id)):
                    _mark(other, other.id == run_id)
            else:
                _mark(row, False)
        return self.get(run_id)

    def delete(self, run_id: str) -> None:
        """Permanently delete a run and the files that no other one has. Raises NotFound."""
        with self._store.writing() as session:
            self._remove(_drop(session, row_of(session, run_id)))

    def sweep(self) -> None:
        """Delete files that belong to no run, of planners that ended while they stored or deleted one."""
        left = self._store.run_files.keys(older_than_s=_FORGOTTEN_S) if self._store.writable else ()
        if left:
            with self._store.writing() as session:
                self._remove(set(left) - _known(session))

    def _rescue(self, left: Path) -> bool:
        """Store the recordings that a planner left in its folder; False where the store is not writable at present."""
        for note in left.glob("run-*.json"):
            folder = note.with_suffix("")
            try:
                if has_ticks(folder):
                    self.keep(folder, **parse_json(note.read_text(encoding="utf-8")))
                    _LOG.warning("A drive was not stored when its planner ended; what was recorded of it is kept.")
            except (StorageError, OSError) as error:
                _LOG.warning("The recording of a drive is left for the next start: %s", error_kind(error))
                return False
            except (VfixError, TypeError, ValueError) as error:
                _LOG.warning("The recording of a drive cannot be kept: %s", error_kind(error))
        return True

    def _put(self, path: Path) -> RunFile:
        with path.open("rb") as source:
            key = self._store.run_files.put_with(lambda target: shutil.copyfileobj(source, target))
        return RunFile(key, path.stat().st_size)

    def _bound(self, session: Session) -> set[str]:
        """Delete the oldest runs until the rest is within the limit, never a teacher's; returns the files that no run
        has any more.
        """
        rows = list(session.scalars(_oldest_first()))
        total, freed = sum(row.size_bytes for row in rows), set[str]()
        for row in rows[:-1]:
            if total <= self._max_bytes:
                break
            if stored_run(row).teacher:
                continue
            total -= row.size_bytes
            freed |= _drop(session, row)
        return freed - _known(session)

    def _remove(self, keys: set[str]) -> None:
        """Delete files in a write transaction: a run that is stored meanwhile sees that they are gone."""
        for key in keys:
            self._store.run_files.remove(key)


def has_ticks(folder: Path) -> bool:
    """Whether a drive has written a step there, to its end or not."""
    ticks = _written(folder) / TICKS
    return ticks.is_file() and ticks.stat().st_size > 0


def _written(folder: Path) -> Path:
    """The folder under its name, or under that of an interrupted recording."""
    part = folder.with_name(folder.name + PART)
    return part if not folder.is_dir() and part.is_dir() else folder


def _manifest(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > MAX_JSON_BYTES:
            raise TooLarge(f"{path.name} of the run has more than {MAX_JSON_BYTES:,} bytes.")
        data = parse_json(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"the folder holds no run that can be read: {path.name}: {error}.") from None
    if not isinstance(data, dict):
        raise InputError(f"{path.name} of the run is no object.")
    return data


def _check_there(session: Session, case_id: str | None, plan_id: str | None) -> None:
    if case_id is not None and session.get(CaseRow, case_id) is None:
        raise NotFound(f"there is no case {case_id!r:.80}.")
    if plan_id is not None and session.get(DocumentRow, plan_id) is None:
        raise NotFound(f"there is no plan {plan_id!r:.80}.")


def _oldest_first() -> Select[RunRow]:
    return select(RunRow).order_by(RunRow.recorded, RunRow.id)


def row_of(session: Session, run_id: str) -> RunRow:
    """The row of a run. Raises NotFound."""
    row = session.get(RunRow, run_id)
    if row is None:
        raise NotFound(f"there is no run {run_id!r:.80}.")
    return row


def _check_unchanged(path: Path, name: str, sha256: str) -> None:
    """Raises InputError."""
    with path.open("rb") as file:
        if hashlib.file_digest(file, "sha256").hexdigest() != sha256:
            raise InputError(f"{name} of the run has changed since it was recorded; delete the run.")


def _mark(row: RunRow, on: bool) -> None:
    """Store whether a run is the teacher's; a run without the mark has no word of it."""
    rest = {name: value for name, value in row.manifest.items() if name != "teacher"}
    if on != ("teacher" in row.manifest):
        row.manifest = {**rest, "teacher": True} if on else rest


def _drop(session: Session, row: RunRow) -> set[str]:
    """Delete a row; returns the hashes of its files that no other row has."""
    own = {file["sha256"] for file in row.files.values()}
    session.delete(row)
    session.flush()
    return own - _known(session)


def _known(session: Session) -> set[str]:
    """The hashes of all files of runs."""
    return {file["sha256"] for files in session.scalars(select(RunRow.files)) for file in files.values()}
