"""Export of a case as an archive; equal cases give equal files."""

from __future__ import annotations

import hashlib
import json
import secrets
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from sqlalchemy import select

from app.cases.files import PHANTOM_CT, STORED, CaseFiles, surface_arrays, volume_arrays
from app.cases.model import Case
from app.cases.service import CaseService
from app.drives.runs import RunService
from app.drives.stored_run import StoredRun
from app.exchange.archive.kinds import KINDS, contradiction
from app.exchange.archive.layout import CASE, FILE, MANIFEST, SCHEMA, SUMS, file_entry, renamed
from app.exchange.plan_files import to_native_json
from app.plans.instruments import Instruments
from app.plans.model import NOTICE
from app.plans.service import PlanService
from app.store import Store
from app.store.errors import StorageError
from app.store.models import CaseRow, DocumentRow, DocumentStateRow
from vfix_engine.errors import InputError, VfixError
from vfix_engine.runtime.run import Run
from vfix_engine.runtime.versions import versions
from vfix_engine.study.lumen.task_rows import task_told

_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time of a zip entry; the archive must depend on its content only
_LEVEL = 4  # of deflate
_PIECE = 1 << 20
_MODE = 0o644 << 16

GoOn = Callable[[], object]


@dataclass
class _Package:
    """The zip that is being written, and the checksums of its entries."""

    zip: zipfile.ZipFile
    go_on: GoOn
    sums: dict[str, str] = field(default_factory=dict)

    def add(self, name: str, pieces: Iterator[bytes]) -> str:
        """Write an entry and return its SHA-256. `go_on` may raise between pieces to cancel."""
        info = zipfile.ZipInfo(name, _EPOCH)
        info.compress_type, info.external_attr, info.create_system = zipfile.ZIP_DEFLATED, _MODE, 3
        info._compresslevel = _LEVEL  # type: ignore[attr-defined]  # public as compress_level from Python 3.13
        digest = hashlib.sha256()
        with self.zip.open(info, "w", force_zip64=True) as entry:
            for piece in pieces:
                self.go_on()
                digest.update(piece)
                entry.write(piece)
        self.sums[name] = digest.hexdigest()
        return self.sums[name]

    def add_json(self, name: str, data: Any) -> None:
        self.add(name, iter([(json.dumps(data, indent=1, ensure_ascii=False, sort_keys=True) + "\n").encode()]))


class ArchiveWriter:
    """Writes archives of cases. A call takes seconds to minutes and may run in any thread."""

    def __init__(
        self, store: Store, cases: CaseService, plans: PlanService, instruments: Instruments, runs: RunService
    ) -> None:
        self._store, self._cases, self._plans = store, cases, plans
        self._instruments, self._runs = instruments, runs

    def write(
        self, case_id: str, target: BinaryIO, *, with_runs: bool = False, go_on: GoOn = bool
    ) -> list[dict[str, str]]:
        """Write the archive of a case.

        go_on: called repeatedly; it may raise to cancel the export, as when the client has disconnected.

        Returns the documents that are left out because they cannot be read, each with kind, id, name and reason.
        Raises NotFound, and StorageError if a file of the case is missing or damaged or the target cannot be written.
        """
        case = self._cases.get(case_id)
        shipped: dict[str, Path] = {}
        try:
            self._unpack(case, shipped)
            with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED, compresslevel=_LEVEL) as file:
                return self._fill(_Package(file, go_on), case, shipped, with_runs)
        except OSError as error:
            raise StorageError(f"the archive could not be written: {error.strerror or error}.") from error
        finally:
            for path in shipped.values():
                path.unlink(missing_ok=True)

    def _fill(self, package: _Package, case: Case, shipped: dict[str, Path], with_runs: bool) -> list[dict[str, str]]:
        keys = {source: _sum_of(path) for source, path in shipped.items()}
        of_case = self._case_json(case.id, {source: STORED + key for source, key in keys.items()})
        documents, left_out = self._documents(case.id)
        runs = self._runs.list(case.id)[::-1] if with_runs else ()
        paths = {keys[source]: path for source, path in shipped.items()}
        # A shipped structure names the hash of an asset, which is no stored file.
        named = FILE.findall(json.dumps([of_case, documents]))
        paths |= {key: self._store.files.path(key) for key in named if self._store.files.has(key)}
        package.add_json(MANIFEST, {
            "schema": SCHEMA, "notice": NOTICE, "versions": versions(),
            "case": {"id": case.id, "name": case.name, "content_hash": case.content_hash},
            "documents": [{name: one[name] for name in ("kind", "id", "name", "schema")} for one in documents],
            "left_out": left_out, "runs": [run.id for run in runs], "files": sorted(paths),
        })  # fmt: skip
        package.add_json(CASE, of_case)
        for one in documents:
            package.add_json(f"documents/{one['kind']}/{one['id']}.json", one)
        for one in documents:
            if one["kind"] == "plan":
                plan = self._plans.get(one["id"])
                urdf = self._instruments.carried(plan.content, "json")
                package.add(f"plans/{plan.id}.json", iter([to_native_json(plan, urdf).encode()]))
        for run in runs:
            package.add_json(f"runs/{run.id}.json", {"recorded": run.recorded, **self._of_lumen(run), **run.manifest})
        for key in sorted(paths):
            if package.add(file_entry(key), _pieces(paths[key])) != key:
                raise StorageError(f"the stored file {key[:12]} is damaged; import the case again.")
        sums = "".join(f"{digest}  {name}\n" for name, digest in package.sums.items())
        package.add(SUMS, iter([sums.encode()]))
        return left_out

    def _of_lumen(self, run: StoredRun) -> dict[str, Any]:
        """Arm and task of a run in a lumen, which its manifest does not have; of a damaged run the arm alone."""
        if run.arm is None:
            return {}
        try:
            with self._runs.laid_out(run.id) as folder:
                return {"arm": run.arm, "task": task_told(Run.read(folder))}
        except VfixError:
            return {"arm": run.arm, "task": None}

    def _case_json(self, case_id: str, sources: dict[str, str]) -> dict[str, Any]:
        """Return the stored case; shipped files are named by the hash of their copies in the archive."""
        with self._store.reading() as session:
            row = session.get_one(CaseRow, case_id)
            data = {"id": row.id, "name": row.name, "created": row.created, "content_hash": row.content_hash}
            return {**data, "content": renamed(row.document, sources)}

    def _documents(self, case_id: str) -> tuple[list[dict[str, Any]], list[dict[str, str]]]:
        """Return the documents in their current state, without history, and the unreadable ones with the reason."""
        query = select(DocumentRow).where(DocumentRow.case_id == case_id, DocumentRow.deleted_at.is_(None))
        found: list[dict[str, Any]] = []
        left_out: list[dict[str, str]] = []
        with self._store.reading() as session:
            for row in session.scalars(query.order_by(DocumentRow.kind, DocumentRow.created, DocumentRow.id)):
                kind = KINDS.get(row.kind)
                state = session.get(DocumentStateRow, (row.id, row.cursor))
                try:
                    if kind is None or state is None:
                        raise InputError("its kind is not known." if kind is None else "its content is missing.")
                    if why := contradiction(kind.content(state.schema, state.content, row.settings)):
                        raise InputError(why)
                except InputError as error:
                    left_out.append({"kind": row.kind, "id": row.id, "name": row.name, "why": str(error)})
                    continue
                found.append({
                    "id": row.id, "kind": row.kind, "case_hash": row.case_hash, "name": row.name,
                    "created": row.created, "modified": row.modified, "locked": row.locked, "revision": row.revision,
                    "schema": state.schema, "refs": state.refs, "content": state.content, "settings": row.settings,
                })  # fmt: skip
        return found, left_out

    def _unpack(self, case: Case, found: dict[str, Path]) -> None:
        """Write shipped surfaces and volumes, which are not in the store, into temporary files.

        found: filled with the paths by source, including a partly written file; the caller deletes them.
        """
        files: CaseFiles = self._cases.files
        surfaces = [one.source for one in case.surfaces if not one.source.startswith(STORED)]
        for source in [*surfaces, *(one.source for one in case.volumes if one.source in PHANTOM_CT)]:
            shipped = source in surfaces
            values = surface_arrays(files.surface(source)) if shipped else volume_arrays(files.volume(source))
            found[source] = self._store.exports.open() / secrets.token_hex(8)
            with found[source].open("xb") as target:
                np.savez(target, **values)


def _pieces(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        while piece := file.read(_PIECE):
            yield piece


def _sum_of(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
