"""Removal of a case for good: its rows, what belongs to them, and the files that nothing else uses.

Deleting a case only takes it off the lists. This leaves no byte of it in the data folder: freed pages of the database
are overwritten, its log is emptied, and copies of the database from before an upgrade are deleted with it.

What is to be removed is written down first, as hashes, so that a planner that is killed meanwhile leaves nothing half
there: the next start goes on with it.
"""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import delete, select, text
from sqlalchemy.orm import Session

from app.cases.model import SHIPPED
from app.cases.referenced_files import referred_files
from app.kit.errors import NotFound
from app.store import Store
from app.store.errors import StorageError
from app.store.models import CaseRow, DocumentRow, DocumentStateRow, RunRow
from app.store.private import private_file, private_folder
from vfix_engine.error_places import error_kind
from vfix_engine.errors import InputError

_LOG = logging.getLogger(__name__)
_FORGOTTEN_S = 3600.0  # a file that no row names may be one that another planner is just importing

_LEFT_S = 86400.0  # at every start there are more of those, and nobody asked for it


@dataclass(frozen=True)
class Purged:
    """What was removed: how many plans and other documents, runs and files, and which copies of the database."""

    case_id: str
    documents: int
    runs: int
    files: int
    copies: tuple[str, ...]


class Purge:
    """Removes cases for good; to be used while no page shows the case."""

    def __init__(self, store: Store, *forget: Callable[[set[str]], None]) -> None:
        """forget: each is called with the hashes of deleted files, to drop what was made of them from memory."""
        self._store, self._forget = store, forget

    def preview(self, case_id: str) -> Purged:
        """What `run` would remove, as far as it can be counted before. Raises NotFound and InputError."""
        with self._store.reading() as session:
            _check(session, case_id)
            documents, runs = _documents(session, case_id), _runs(session, case_id)
            return Purged(
                case_id, len(documents), len(runs), 0, tuple(path.name for path in self._store.copies(case_id))
            )

    def run(self, case_id: str) -> Purged:
        """Remove a case, deleted before or not.

        Raises NotFound, InputError for the case that travels with vfix, and StorageError: StoreBusy where another
        planner keeps the database from being cleaned, before anything is removed.
        """
        self._store.scrub()  # told before rather than after, where it cannot be done
        begun = self._begun(case_id)
        try:
            counted, gone = self._remove_rows(case_id, begun)
        except Exception:
            begun.unlink(missing_ok=True)  # nothing was removed
            raise
        removed, copies = self._remove_rest(case_id, gone, begun)
        return Purged(case_id, *counted, removed, copies)

    def drop_forgotten(self) -> int:
        """Delete files that no row has named for a day: of imports that were killed. Returns how many.

        Rows and files are compared while nobody else writes; one that is just being imported is younger.
        """
        files = self._store.files
        if not self._store.writable or not files.keys(older_than_s=_LEFT_S):
            return 0
        try:
            with self._store.writing() as session:
                left = sorted(set(files.keys(older_than_s=_LEFT_S)) - referred_files(session))
                for key in left:
                    files.remove(key)
        except StorageError as error:
            _LOG.warning("what killed imports have left stays until the next start: %s", error_kind(error))
            return 0
        if left:
            _LOG.warning("%d files that an import had left are removed.", len(left))
        return len(left)

    def finish(self) -> None:
        """Go on with what planners were killed at; what cannot be done now is for the next start."""
        if not self._store.writable:
            return
        for begun in sorted(self._folder.glob("case-*.json")):
            try:
                self._go_on(begun)
            except (InputError, StorageError) as error:
                _LOG.warning("a case could not be removed for good: %s", error_kind(error))

    def _go_on(self, begun: Path) -> None:
        try:
            self.run(begun.stem)
        except NotFound:  # its rows are gone already
            try:
                gone = {str(key) for key in json.loads(begun.read_text(encoding="utf-8"))}
            except (OSError, ValueError, TypeError):
                gone = set()
            self._remove_rest(begun.stem, gone, begun)

    @property
    def _folder(self) -> Path:
        return self._store.home / "purges"

    def _begun(self, case_id: str) -> Path:
        """The note of a purge: named after the case, with the hashes of what its files are."""
        with self._store.reading() as session:
            _check(session, case_id)
        private_folder(self._folder)
        return self._folder / f"{case_id}.json"

    def _remove_rows(self, case_id: str, begun: Path) -> tuple[tuple[int, int], set[str]]:
        """Delete the rows; returns how many documents and runs, and the hashes that nothing names any more."""
        with self._store.writing() as session:
            _check(session, case_id)
            session.execute(text("PRAGMA secure_delete = ON"))
            documents, runs = _documents(session, case_id), _runs(session, case_id)
            before = referred_files(session)
            session.execute(delete(RunRow).where(RunRow.id.in_(runs)))
            session.execute(delete(DocumentStateRow).where(DocumentStateRow.document_id.in_(documents)))
            session.execute(delete(DocumentRow).where(DocumentRow.id.in_(documents)))
            session.execute(delete(CaseRow).where(CaseRow.id == case_id))
            gone = before - referred_files(session)
            private_file(begun)
            with begun.open("w", encoding="utf-8") as file:
                json.dump(sorted(gone), file)
                file.flush()
                os.fsync(file.fileno())
        return (len(documents), len(runs)), gone

    def _remove_rest(self, case_id: str, gone: set[str], begun: Path) -> tuple[int, tuple[str, ...]]:
        """Delete the files and the copies of the database, and clean that; returns how many files, and which copies.

        Nobody else writes meanwhile: an import that counts on a file which is there already either has named it in a
        row by now, or looks for it once it is gone.
        """
        with self._store.writing() as session:
            used = referred_files(session)
            removed = self._remove_files(gone - used, used)
        copies = self._remove_copies(case_id)
        self._store.scrub()
        begun.unlink(missing_ok=True)
        return removed, copies

    def _remove_files(self, gone: set[str], used: set[str]) -> int:
        """Delete what only the case had, and what no row has named for long: of imports that were cut off."""
        removed = 0
        for files in (self._store.files, self._store.run_files):
            forgotten = set(files.keys(older_than_s=_FORGOTTEN_S)) - used
            for key in sorted((gone & set(files.keys())) | forgotten):
                files.remove(key)
                removed += 1
        for forget in self._forget:
            forget(gone)
        return removed + self._store.derived.remove(sorted(gone))

    def _remove_copies(self, case_id: str) -> tuple[str, ...]:
        copies = self._store.copies(case_id)
        for path in copies:
            path.unlink(missing_ok=True)
        return tuple(path.name for path in copies)


def _check(session: Session, case_id: str) -> None:
    if session.get(CaseRow, case_id) is None:
        raise NotFound(f"there is no case {case_id!r:.80}.")
    if case_id in SHIPPED:
        raise InputError("this phantom travels with vfix and holds nobody's data; delete it instead.")


def _documents(session: Session, case_id: str) -> list[str]:
    return list(session.scalars(select(DocumentRow.id).where(DocumentRow.case_id == case_id)))


def _runs(session: Session, case_id: str) -> list[str]:
    """Those of the case, and those of its plans wherever they were driven."""
    of_plans = RunRow.plan_id.in_(_documents(session, case_id))
    return list(session.scalars(select(RunRow.id).where((RunRow.case_id == case_id) | of_plans)))
