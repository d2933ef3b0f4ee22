"""Cases of the store: listed, made, renamed, deleted with recovery; their surfaces, volumes and trees, cached."""

from __future__ import annotations

import hashlib
import json
import logging
import secrets
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

from sqlalchemy import select
from sqlalchemy.exc import DBAPIError
from sqlalchemy.orm import Session

from app.cases.files import STORED, CaseFiles
from app.cases.model import (
    HEAD_PHANTOM,
    Case,
    CaseBead,
    CaseContent,
    CaseFrame,
    SurfaceInfo,
    VolumeInfo,
    anatomy_structure,
    extracted_from,
    own_surfaces,
)
from app.cases.reading import case_content_from_json
from app.cases.referenced_files import referred_files
from app.cases.structures import ANATOMY, CaseKind, Provenance, Structure, is_closed
from app.clock import utc_now
from app.kit.cache import Cache
from app.kit.errors import NotFound
from app.kit.names import check_name
from app.store import Store
from app.store.changes import CASES
from app.store.database_errors import is_of_reading
from app.store.errors import StoreDamaged
from app.store.models import CaseRow
from app.store.scratch import Scratch
from vfix_engine.anatomy.bone import SurfaceReport
from vfix_engine.error_places import error_places
from vfix_engine.errors import InputError
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree

__all__ = ["Case", "CaseBead", "CaseFrame", "CaseService", "Structure", "SurfaceInfo", "VolumeInfo"]

_LOG = logging.getLogger(__name__)
Info = TypeVar("Info", SurfaceInfo, VolumeInfo)


class CaseService:
    """Heads, by id; may be used from any thread."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self.files = CaseFiles(store.files)
        self._surfaces: Cache[str, TriangleMesh] = Cache(12)
        self._shown: Cache[tuple[str, tuple[int, ...]], Case] = Cache(8)
        self._volumes: Cache[str, Volume] = Cache(4)
        self._revisions: Cache[str, str] = Cache(16)
        self._trees: Cache[str, ProximityTree] = Cache(4)

    def list(self, include_deleted: bool = False) -> tuple[Case, ...]:
        """Cases, oldest first; one whose content cannot be read says why (`unreadable`).

        One of which nothing can be read is named in the log and left out.
        """
        query = select(CaseRow.id).order_by(CaseRow.created, CaseRow.id)
        if not include_deleted:
            query = query.where(CaseRow.deleted_at.is_(None))
        with self._store.reading() as session:
            return tuple(case for case_id in session.scalars(query) if (case := _listed(session, case_id)))

    def get(self, case_id: str) -> Case:
        """The case, deleted or not. Raises NotFound, and StoreDamaged when what is stored of it cannot be read."""
        with self._store.reading() as session:
            return _case(session, case_id)

    def shown(self, case_id: str) -> Case:
        """As `get`, for what is shown: not read again until a change of cases is counted, see `Store.changes`."""
        return self._shown.get((case_id, self._store.changes.of(CASES)), lambda: self.get(case_id))

    @property
    def scratch(self) -> Scratch:
        """Folder for temporary data of cases that are imported."""
        return self._store.scratch

    def embedded_case(self) -> Case:
        """The synthetic head that travels with vfix."""
        return self.get(HEAD_PHANTOM)

    def create(
        self,
        name: str,
        *,
        frame: CaseFrame,
        surfaces: Mapping[str, TriangleMesh],
        volume: Volume | None = None,
        beads: Sequence[CaseBead] = (),
        notes: Sequence[str] = (),
        reports: Mapping[str, SurfaceReport] | None = None,
        kind: CaseKind = "head",
        made_from: Provenance | None = None,
    ) -> Case:
        """Make a case; every file is durable before the case is listed.

        surfaces: by name; 'bone' of a head, 'lumen' of a lumen, is the one the controller uses and becomes a structure,
            the others are for display only.
        notes: what is doubtful about the file, in sentences.
        reports: what making a surface cost, by the same names, where that was measured.
        made_from: where that surface comes from; None: a CT at the threshold of bone, or without a CT a surface.
        Raises InputError when that surface is missing or the name cannot be used.
        """
        check_name(name, "case's name")
        driven = ANATOMY[kind]
        if driven not in surfaces:
            raise InputError(f"a case needs a {driven} surface.")
        known = reports or {}
        infos = tuple(self.files.put_surface(label, mesh, known.get(label)) for label, mesh in surfaces.items())
        volumes = () if volume is None else (self.files.put_volume("ct", volume),)
        surface = _named(infos, driven, "surface")
        origin, inside = made_from or extracted_from(volume is not None), is_closed(surfaces[driven])
        structure = anatomy_structure(kind, surface, surface.source, origin, inside)
        content = CaseContent(frame, infos, volumes, tuple(beads), tuple(notes), kind, (structure,))
        return self.put(f"case-{secrets.token_hex(6)}", name, content, hash_of(content))

    def put(self, case_id: str, name: str, content: CaseContent, content_hash: str) -> Case:
        """Store a case under an id, or give the one of that id another content; its name and fate stay then."""
        with self._store.writing() as session:
            row = session.get(CaseRow, case_id)
            if row is None:
                row = CaseRow(id=case_id, name=name, created=utc_now(), deleted_at=None)
                session.add(row)
            row.content_hash, row.document = content_hash, content.to_json()
        return self.get(case_id)

    def change_content(self, case_id: str, change: Callable[[CaseContent, Session], CaseContent]) -> Case:
        """Give a case another content, made of its present one in the same transaction; its hash stays.

        The hash is that of what the case was made of; imported structures have hashes of their own.
        Raises NotFound, and what `change` raises.
        """
        with self._store.writing() as session:
            row = _row(session, case_id)
            row.document = change(_content(row), session).to_json()
        return self.get(case_id)

    def remove_unused(self, source: str) -> None:
        """Delete the stored file of a surface that no row names any more."""
        key = source.removeprefix(STORED)
        with self._store.writing() as session:
            if source.startswith(STORED) and key not in referred_files(session):
                self._store.files.remove(key)

    def rename(self, case_id: str, name: str) -> Case:
        """Give a case another name."""
        return self.change(case_id, name=name)

    def delete(self, case_id: str) -> Case:
        """Take a case off the lists, its plans with it; `restore` brings it back."""
        return self.change(case_id, deleted=True)

    def restore(self, case_id: str) -> Case:
        """Bring a deleted case back."""
        return self.change(case_id, deleted=False)

    def change(self, case_id: str, *, name: str | None = None, deleted: bool | None = None) -> Case:
        """Rename a case, and take it off the lists or bring it back, in one transaction; None leaves it as it is."""
        if name is not None:
            check_name(name, "case's name")
        with self._store.writing() as session:
            row = _row(session, case_id)
            row.name = row.name if name is None else name
            if deleted is not None:
                row.deleted_at = utc_now() if deleted else None
            session.flush()
            return _listed(session, case_id) or _case(session, case_id)

    def case_surface(self, case_id: str, name: str | None = None) -> TriangleMesh:
        """A surface of a case, that of the structure it is driven in unless a name is given. Raises NotFound."""
        case = self.get(case_id)
        info = _named(case.surfaces, case.anatomy.surface if name is None else name, "surface")
        return self._surfaces.get(info.source, lambda: self.files.surface(info.source))

    def structure_mesh(self, case_id: str, structure_id: str) -> TriangleMesh:
        """The surface of a structure, by the structure's id. Raises NotFound."""
        return self.case_surface(case_id, self.get(case_id).structure(structure_id).surface)

    def display_meshes(self, case_id: str) -> dict[str, TriangleMesh]:
        """The surfaces to show, by name: all but the one that it is driven in, or that one where there is no other."""
        case = self.get(case_id)
        names = [info.name for info in case.own_surfaces]
        shown = [name for name in names if name != case.anatomy.surface] or names
        return {name: self.case_surface(case_id, name) for name in shown}

    def volume(self, case: Case, name: str | None = None) -> Volume | None:
        """A CT volume of a case, the widest unless a name is given; None for a case that was made of a surface.

        What is laid over the case is had by its id.
        """
        if not case.volumes and name is None:
            return None
        info = volume_named(case, name)
        return self._volumes.get(info.source, lambda: self.files.volume(info.source))

    def volumes(self, case: Case) -> tuple[Volume, ...]:
        """Every CT volume of a case, the widest first; none of a case that was made of a surface."""
        return tuple(
            self._volumes.get(info.source, lambda source=info.source: self.files.volume(source))  # type: ignore[misc]
            for info in case.volumes
        )

    def volume_revision(self, case: Case, name: str | None = None) -> str:
        """SHA-256 of a volume's grid and voxels, of the widest unless a name is given. Raises NotFound."""
        volume = self.volume(case, name)
        if volume is None:
            raise NotFound("this case was made of a surface; it has no CT.")
        info = volume_named(case, name)
        return self._revisions.get(info.source, lambda: volume.content_hash)

    def tree(self, case: Case, structure_id: str | None = None) -> ProximityTree:
        """The proximity tree of a structure, by default of that which a case is driven in; the first call builds it.

        Raises NotFound.
        """
        structure = case.anatomy if structure_id is None else case.structure(structure_id)
        # By the file that it is made of: what a structure of an archive says of its geometry is not that.
        source = _named(case.surfaces, structure.surface, "surface").source
        return self._trees.get(source, lambda: ProximityTree(self.case_surface(case.id, structure.surface)))


def _row(session: Session, case_id: str) -> CaseRow:
    row = session.get(CaseRow, case_id)
    if row is None:
        raise NotFound(f"there is no case {case_id!r:.80}.")
    return row


def _listed(session: Session, case_id: str) -> Case | None:
    """A case for a list: one whose content cannot be read says why; None where nothing of its row can be read."""
    try:
        row = _readable_row(session, case_id)
    except StoreDamaged as error:
        _LOG.error("the case %s is left out: %s", case_id, error_places(error))
        return None
    try:
        return _case_of(row, _content(row))
    except StoreDamaged as error:
        _LOG.error("the case %s cannot be read: %s", case_id, error_places(error))
        return _case_of(row, CaseContent(CaseFrame("LPS", assumed=False), ()), unreadable=str(error))


def _case(session: Session, case_id: str) -> Case:
    row = _readable_row(session, case_id)
    return _case_of(row, _content(row))


def _readable_row(session: Session, case_id: str) -> CaseRow:
    try:
        return _row(session, case_id)
    except DBAPIError as error:
        if not is_of_reading(error):
            raise
        raise _damaged(case_id, "") from error


def _case_of(row: CaseRow, content: CaseContent, unreadable: str = "") -> Case:
    return Case(
        id=row.id,
        name=row.name,
        created=row.created,
        deleted_at=row.deleted_at,
        frame=content.frame,
        spacing_mm=content.volumes[0].spacing_mm if content.volumes else None,
        content_hash=row.content_hash,
        surfaces=content.surfaces,
        volumes=content.volumes,
        beads=content.beads,
        notes=content.notes,
        kind=content.kind,
        structures=content.structures,
        overlays=content.overlays,
        unreadable=unreadable,
        landmarks=content.landmarks,
    )


def _content(row: CaseRow) -> CaseContent:
    try:
        return case_content_from_json(row.document)
    except InputError as error:
        raise _damaged(row.id, f" ({str(error).rstrip('.')})") from error
    except (DBAPIError, TypeError, ValueError, RecursionError) as error:  # of its JSON
        if isinstance(error, DBAPIError) and not is_of_reading(error):
            raise
        raise _damaged(row.id, "") from error


def _damaged(case_id: str, why: str) -> StoreDamaged:
    return StoreDamaged(f"the stored case {case_id:.80} is damaged{why}; import it again.")


def volume_named(case: Case, name: str | None) -> VolumeInfo:
    """A CT volume of a case, or one that is laid over it; the widest CT without a name. Raises NotFound."""
    overlays = tuple(item.volume for item in case.overlays)
    return case.volumes[0] if name is None else _named((*case.volumes, *overlays), name, "volume")


def _named(items: Sequence[Info], name: str, what: str) -> Info:
    for item in items:
        if item.name == name:
            return item
    known = ", ".join(item.name for item in items) or "none"
    raise NotFound(f"this case has no {what} {name!r:.40}; it has: {known}.")


def hash_of(content: CaseContent | Case) -> str:
    """A case is the files it was made of: the hash of what they are called and hold, without imported structures."""
    surfaces = {item.name: item.source for item in own_surfaces(content)}
    sources = {"surfaces": surfaces, "volumes": {item.name: item.source for item in content.volumes}}
    return hashlib.sha256(json.dumps(sources, sort_keys=True).encode()).hexdigest()
