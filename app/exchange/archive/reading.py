"""Import of the archive of a case into the store, completely or not at all."""

from __future__ import annotations

import re
import secrets
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from app.cases.files import STORED, surface_info, volume_info
from app.cases.model import Case, CaseContent, SurfaceInfo, VolumeInfo
from app.cases.reading import case_content_from_json, check_names
from app.cases.referenced_files import referred_files
from app.cases.service import CaseService
from app.exchange.archive.checking import CheckedArchive, ReportFraction
from app.exchange.archive.identity import checked_identity
from app.exchange.archive.kinds import KINDS, NUMBERED, contradiction
from app.exchange.archive.layout import CASE, FILE, file_entry, renamed
from app.kit.array_files import ArraysUnusable, check_arrays, is_zip
from app.kit.errors import TooLarge
from app.kit.names import check_name, unused_name
from app.kit.values import check_id
from app.store import Store
from app.store.errors import StorageError
from app.store.models import CaseRow, DocumentRow, DocumentStateRow
from vfix_engine.errors import InputError
from vfix_engine.progress import ProgressCallback, no_progress

MAX_UNPACKED_BYTES = 4 << 30  # of one NumPy archive among the files
_SAME_MM = 1e-3  # tolerance of bounds, whose last digits depend on the machine
MAX_REVISION = 1 << 53  # integers up to here are exact in every client
_TIME = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d{1,6})?(\+00:00|Z)")
_CASE = {"id": str, "name": str, "created": str, "content_hash": str, "content": dict}
_DOCUMENT = {
    "id": str, "kind": str, "case_hash": str, "name": str, "created": str, "modified": str, "locked": bool,
    "revision": int, "schema": str, "refs": list, "content": dict, "settings": dict,
}  # fmt: skip


@dataclass(frozen=True)
class _Found:
    """Content of an archive, read and checked: rows as JSON, and the stored files by their hash."""

    case: dict[str, Any]
    content: CaseContent
    documents: tuple[dict[str, Any], ...]
    files: tuple[str, ...]


class ArchiveReader:
    """Imports archives. A call takes seconds to minutes and may run in any thread."""

    def __init__(self, store: Store, cases: CaseService) -> None:
        self._store, self._cases = store, cases

    def read(self, path: Path, progress: ProgressCallback = no_progress) -> Case:
        """Import an archive as a new case.

        If the store already has the case or one of its documents, all of them get new identifiers.
        progress: called repeatedly; it may raise to cancel the import.
        Raises InputError for an archive that is damaged, modified, of a newer schema or not of vfix, TooLarge for one
        that unpacks to too much, and StorageError. Nothing is stored in these cases.
        """
        with CheckedArchive(path) as archive:
            archive.check(lambda fraction: progress("Comparing the checksums", 0.4 * fraction))
            found = _read(archive)
            added: list[str] = []
            try:
                for at, key in enumerate(found.files):
                    begin, part = 0.4 + 0.5 * at / len(found.files), 0.5 / len(found.files)

                    def file_progress(fraction: float, begin: float = begin, part: float = part) -> None:
                        progress("Storing files", begin + part * fraction)

                    self._put(archive, key, added, file_progress)
                progress("Examining the case", 0.9)
                content, content_hash = self._examined(found)
                progress("Storing the case", 0.95)
                case = self._stored(replace(found, content=content), content_hash)
            except BaseException:
                self._forget(added)
                raise
            if content is not found.content:
                self._forget(added)  # copies of a surface that travels with vfix
            return case

    def _put(self, archive: CheckedArchive, key: str, added: list[str], progress: ReportFraction) -> None:
        if self._store.files.has(key):
            return
        stored = self._store.files.put_with(lambda file: archive.copy(file_entry(key), file, progress))
        added.append(stored)
        if stored != key:
            raise InputError(f"the file {key[:12]} of the archive is not what its name says; the archive is damaged.")
        _check_packed(self._store.files.path(key), key)

    def _forget(self, added: list[str]) -> None:
        """Delete the stored files that nothing refers to."""
        if added:
            with self._store.writing() as session:
                for key in set(added) - referred_files(session):
                    self._store.files.remove(key)

    def _examined(self, found: _Found) -> tuple[CaseContent, str]:
        """Check each surface and volume of the case, and return its content and the hash of that. Raises InputError."""
        content = found.content
        volumes = (*content.volumes, *(one.volume for one in content.overlays))
        sources = {info.name: info.source for info in volumes} | {info.name: info.source for info in content.surfaces}
        for name, source in sources.items():
            if not source.startswith(STORED) or source.removeprefix(STORED) not in found.files:
                raise InputError(f"the archive has no file of {name!r:.40}; it is not whole.")
        try:
            for surface in content.surfaces:
                _compare(surface, surface_info(surface.name, self._cases.files.surface(surface.source), ""))
            for volume in volumes:
                _compare(volume, volume_info(volume.name, self._cases.files.volume(volume.source), ""))
            return checked_identity(found.case["content_hash"], content, self._cases.files)
        except StorageError as error:
            raise InputError(f"a file of the archive cannot be used: {error}") from None

    def _stored(self, found: _Found, content_hash: str) -> Case:
        """Store the case and all of its documents in one transaction."""
        with self._store.writing() as session:
            if not all(self._store.files.has(key) for key in found.files):
                raise InputError("a file of the archive was removed meanwhile by somebody else; import it again.")
            names = _new_ids(session, found) | {found.case["content_hash"]: content_hash}
            case = renamed(found.case, names)
            row = CaseRow(id=case["id"], name=_unused_name(session, case["name"]), created=case["created"])
            row.deleted_at, row.content_hash = None, case["content_hash"]
            row.document = found.content.to_json()
            session.add(row)
            session.flush()
            taken: dict[str, set[str]] = {kind: set() for kind in NUMBERED}
            for document in found.documents:
                _add_document(session, case["id"], renamed(document, names), taken.get(document["kind"], set()))
        return self._cases.get(case["id"])


def _read(archive: CheckedArchive) -> _Found:
    """Read the JSON of an archive and check that this version can read every document. Raises InputError."""
    case = _fields(archive.json(CASE), _CASE, CASE)
    check_name(case["name"], "case's name")
    check_id(case["id"], "a case")
    if case["id"].strip(".") == "" or not FILE.fullmatch(case["content_hash"]):
        raise InputError("the archive's case has no sound identifier or hash of its content; the archive was changed.")
    _check_time(case["created"])
    content = _content(case["content"])
    documents = []
    for name in archive.entries:
        if name.startswith("documents/"):
            document = _fields(archive.json(name), _DOCUMENT, name)
            _check_document(document, name)
            documents.append(document)
    if len({document["id"] for document in documents} | {case["id"]}) != len(documents) + 1:
        raise InputError("two documents of the archive have the same identifier.")
    files = tuple(name.rsplit("/", 1)[1] for name in archive.entries if name.startswith("files/"))
    named = {key for one in (case, *documents) for key in FILE.findall(str(one))}
    if left := set(files) - named:
        raise InputError(f"nothing in the archive names its file {min(left)[:12]}; the archive was changed.")
    return _Found(case, content, tuple(documents), files)


def _fields(data: dict[str, Any], kinds: Mapping[str, type], name: str) -> dict[str, Any]:
    if set(data) != set(kinds) or not all(type(data[key]) is kind for key, kind in kinds.items()):
        raise InputError(f"{name} of the archive does not hold what it should; a newer vfix may have made it.")
    return data


def _content(data: dict[str, Any]) -> CaseContent:
    """Read the content of the case from its JSON. Raises InputError."""
    try:
        content = case_content_from_json(data)
        check_names(content)
    except InputError as error:
        raise InputError(f"the case of the archive cannot be read: {error}") from None
    surfaces = {surface.name: surface.source for surface in content.surfaces}
    for one in content.structures:
        # A shipped structure names the asset that its surface was read from.
        if one.provenance.origin != "shipped" and one.geometry != surfaces[one.surface]:
            raise InputError(f"the structure {one.id} of the archive names another geometry than its surface's.")
    return content


def _compare(stated: SurfaceInfo | VolumeInfo, found: SurfaceInfo | VolumeInfo) -> None:
    """Raise InputError for a surface or volume that does not match the metadata of the case."""
    near = np.allclose(stated.bounds_lps_mm, found.bounds_lps_mm, 0.0, _SAME_MM)
    if _measures(stated) != _measures(found) or not near:
        raise InputError(f"the file of {stated.name!r:.40} has another size or place than stated.")


def _measures(info: SurfaceInfo | VolumeInfo) -> tuple[Any, ...]:
    if isinstance(info, SurfaceInfo):
        return (info.triangles,)
    return (info.shape, info.spacing_mm, info.slice_thickness_mm, info.window)


def _check_time(text: str) -> None:
    try:
        if not _TIME.fullmatch(text):
            raise ValueError
        datetime.fromisoformat(text)
    except ValueError:
        raise InputError("a time of the archive is none; the archive was changed.") from None


def _check_document(document: dict[str, Any], name: str) -> None:
    kind = KINDS.get(document["kind"])
    if kind is None:
        raise InputError(f"{name} is of a kind that this vfix does not know; install a newer one.")
    if name != f"documents/{kind.name}/{document['id']}.json":
        raise InputError(f"{name} of the archive names itself otherwise; the archive was changed.")
    check_name(document["name"], f"{kind.noun}'s name")
    _check_time(document["created"])
    _check_time(document["modified"])
    if not FILE.fullmatch(document["case_hash"]) or not 0 < document["revision"] <= MAX_REVISION:
        raise InputError(f"the archive was changed; {name} has no sound revision or hash of its case.")
    try:
        content = kind.content(document["schema"], document["content"], document["settings"])
    except InputError as error:
        raise InputError(f"the {kind.noun} {document['name']!r:.80} of the archive cannot be read: {error}") from None
    if why := contradiction(content):
        raise InputError(f"the {kind.noun} {document['name']!r:.80} of the archive contradicts itself: {why}")
    # Taken from the checked content, since the list in the archive is untrusted.
    document["refs"] = [{"kind": ref.kind, "id": ref.id} for ref in kind.refs(content)]


def _new_ids(session: Session, found: _Found) -> dict[str, str]:
    """Return new identifiers by the old ones; {} if all of the old ones are free."""
    taken = session.get(CaseRow, found.case["id"]) is not None
    taken |= any(session.get(DocumentRow, document["id"]) is not None for document in found.documents)
    if not taken:
        return {}
    names = {document["id"]: f"{document['kind']}-{secrets.token_hex(6)}" for document in found.documents}
    return names | {found.case["id"]: f"case-{secrets.token_hex(6)}"}


def _unused_name(session: Session, name: str) -> str:
    """Return the name, with a number if another case has it."""
    return unused_name(name, {row.name for row in session.query(CaseRow.name).where(CaseRow.deleted_at.is_(None))})


def _add_document(session: Session, case_id: str, document: dict[str, Any], taken: set[str]) -> None:
    """Store a document of the archive. taken: names of other documents of its kind; its own name is added."""
    name = unused_name(document["name"], taken)
    taken.add(name)
    columns = {key: document[key] for key in ("id", "kind", "case_hash", "created", "modified", "revision")}
    row = DocumentRow(**columns, name=name, case_id=case_id, deleted_at=None, locked=document["locked"], cursor=0)
    row.settings = document["settings"]
    session.add(row)
    session.flush()
    state = {key: document[key] for key in ("schema", "refs", "content")}
    session.add(DocumentStateRow(document_id=row.id, position=0, **state))


def _check_packed(path: Path, key: str) -> None:
    """Raise TooLarge or ArraysUnusable for a stored NumPy archive (a zip) that is malformed or unpacks to too much."""
    try:
        if is_zip(path):  # otherwise a URDF, or a file that its reader refuses
            check_arrays(path, MAX_UNPACKED_BYTES)
    except (ArraysUnusable, TooLarge) as error:
        raise type(error)(f"the file {key[:12]} of the archive cannot be used: {error}") from None
