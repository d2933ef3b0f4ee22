"""Lookup of cases and plans named on a command line by id, name or file.

Files are read without a store, so that an installation of the engine alone can use them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, TypeVar

from app.cases.structures import BONE, structure_name, within_a_sentence
from app.exchange.plan_files import read_plan, read_targets
from app.extras import need_app
from app.kit.errors import NotFound, OtherCase
from app.kit.text_tables import MAX_TEXT, decode, parse_json_object
from app.planning.protected_structures import engine_zones, with_surface_errors
from app.plans.document import PLAN
from app.plans.model import Plan, PlanPoint
from vfix_engine.anatomy.head_import import ControlHead, HeadRequest, control_head, is_head
from vfix_engine.anatomy.surface_uncertainty import SurfaceUncertainty
from vfix_engine.errors import FrameError, InputError
from vfix_engine.files.volume import Volume
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.virtual_fixtures.zone_file import ZoneSet, zones_from_dict

if TYPE_CHECKING:
    from app.cases.model import Case
    from app.cases.service import CaseService
    from app.imaging.importing import ImportService
    from app.plans.service import PlanService


class _Named(Protocol):
    @property
    def id(self) -> str: ...

    @property
    def name(self) -> str: ...


_Item = TypeVar("_Item", bound=_Named)


class ResolvingServices(Protocol):
    """The services used for the lookup."""

    @property
    def cases(self) -> CaseService: ...

    @property
    def plans(self) -> PlanService: ...

    @property
    def importing(self) -> ImportService: ...


@dataclass(frozen=True, eq=False)
class ResolvedCase:
    """A head to work in.

    id: of the stored case, None for a file. hash: hash of its content. grow: builds its proximity tree. scan: reads its
    CT, returns None without one. uncertainty: how far bone may lie off the surface. notes: remarks on assumptions
    about the file, in sentences.
    structures: surfaces of its structures by id. structure_names: their names within a sentence, by id.
    structure_errors: surface errors in mm of the structures that can be protected, by id.
    more_scans: reads all of its CTs, if there may be several.
    """

    id: str | None
    name: str
    hash: str
    mesh: TriangleMesh
    grow: Callable[[], ProximityTree]
    scan: Callable[[], Volume | None]
    uncertainty: SurfaceUncertainty
    notes: tuple[str, ...] = ()
    structures: Mapping[str, TriangleMesh] = field(default_factory=dict)
    structure_names: Mapping[str, str] = field(default_factory=dict)
    structure_errors: Mapping[str, float] = field(default_factory=dict)
    more_scans: Callable[[], tuple[Volume, ...]] = tuple

    @property
    def scans(self) -> tuple[Volume, ...]:
        """All CTs of the head, the widest first."""
        scan = self.scan()
        return self.more_scans() or (() if scan is None else (scan,))

    @cached_property
    def tree(self) -> ProximityTree:
        """The proximity tree, built on first access: the first one of an installation has to be compiled."""
        return self.grow()


class _Meshes(Mapping[str, TriangleMesh]):
    """The surfaces of a case's structures by id, each read on access, since there may be hundreds."""

    def __init__(self, cases: CaseService, case: Case) -> None:
        self._cases, self._case = cases, case

    def __getitem__(self, structure_id: str) -> TriangleMesh:
        if structure_id not in [item.id for item in self._case.structures]:
            raise KeyError(structure_id)
        return self._cases.structure_mesh(self._case.id, structure_id)

    def __iter__(self) -> Iterator[str]:
        return (item.id for item in self._case.structures)

    def __len__(self) -> int:
        return len(self._case.structures)


def resolve_case(services: ResolvingServices | None, text: str, request: HeadRequest | None = None) -> ResolvedCase:
    """Return a stored case by id or name, or the head in a surface or CT file, with the checks of an import.

    services: None without a store; then only files are found.
    request: the file with frame, unit and series stated by the user; without it, LPS mm is assumed for a file that does
        not state them, and noted.

    Raises NotFound, InputError for a file that cannot be used or a name of both a case and a file, or AppMissing.
    """
    path = Path(text)
    asked = request or HeadRequest(path, assume=True)
    if services is None:
        if not is_head(path):
            raise need_app(f"{text!r:.80} is no surface or CT file; a stored case")
        return _case_of_file(path, control_head(asked))
    stored = services.cases.list()
    if _is_path(stored, text, "case", is_head(path)):
        return _case_of_file(path, services.importing.control_head(asked))
    case = find(stored, text, "case")
    if request is not None and (request.frame or request.unit or request.series):
        raise InputError("--frame, --units and --series are said of a file; a stored case has its own.")
    mesh = services.cases.case_surface(case.id)
    tree, scan = partial(services.cases.tree, case), partial(services.cases.volume, case)
    structures = _Meshes(services.cases, case)
    return ResolvedCase(
        case.id, case.name, case.content_hash, mesh, tree, scan, case.uncertainty, case.notes,
        structures, case.structure_names(), case.structure_errors(), partial(services.cases.volumes, case),
    )  # fmt: skip


def _case_of_file(path: Path, head: ControlHead) -> ResolvedCase:
    mesh, tree = head.mesh, partial(ProximityTree, head.mesh)
    return ResolvedCase(
        None, path.name, mesh.content_hash, mesh, tree, lambda: head.scan, head.uncertainty, head.notes,
        {BONE: mesh}, {BONE: within_a_sentence(structure_name(BONE))},
    )  # fmt: skip


def _is_path(stored: Sequence[_Named], text: str, what: str, exists: bool) -> bool:
    """Return whether a word refers to the path of that name; an id never does.

    Raises InputError if the word is both the name of a stored item and a path.
    """
    if not exists or any(item.id == text for item in stored):
        return False
    ids = [item.id for item in stored if item.name == text]
    if ids:
        raise InputError(
            f"{text!r:.80} is a {what} and also a file or folder here; "
            f"say {ids[0]} for the {what}, or ./{text:.80} for the file."
        )
    return True


@dataclass(frozen=True)
class ResolvedPlan:
    """A plan to work with. urdf: that of its robot, where it is out of a file that carries one."""

    plan: Plan
    urdf: bytes | None = None


def resolve_plan(services: ResolvingServices | None, case: ResolvedCase, text: str) -> ResolvedPlan:
    """Return a stored plan of the case by id or name, or the plan in a file, which is not stored.

    services: as in `resolve_case`.

    Raises NotFound, InputError for a file that cannot be used, or AppMissing.
    """
    path = Path(text)
    stored = () if services is None or case.id is None else services.plans.titles(case.id)
    if _is_path(stored, text, "plan of this case", is_file(path)):
        return _plan_of_file(case, path)
    if services is None:
        raise need_app(f"{text!r:.80} is no file of a plan; a stored plan")
    if case.id is None:
        raise NotFound(f"{text!r:.80} is no file of a plan; a case from a file has no stored plans.")
    return ResolvedPlan(services.plans.get(find(stored, text, "plan of this case").id))


def _plan_of_file(case: ResolvedCase, path: Path) -> ResolvedPlan:
    try:
        file = read_plan(path.name, read_bytes(path), points_as="path")
    except FrameError as error:
        if not error.missing:
            raise
        words = f"{error} Write it into the file, or store the plan first: vfix plan import --frame."
        raise FrameError(words, error.missing) from error
    if case.id is not None and file.case_hash not in (None, case.hash):
        raise OtherCase("the plan was made for another case; its points may lie in other anatomy.")
    plan = PLAN.draft(case.id or case.name, case.hash, file.name, file.content, path.name)
    return ResolvedPlan(replace(plan, told=" ".join(file.notes)), file.urdf)


def resolve_targets(path: Path) -> tuple[PlanPoint, ...]:
    """Read targets from a Markups, plan or table file, in LPS mm. Raises InputError."""
    return read_targets(path.name, read_bytes(path))


def resolve_zones(path: Path, case: ResolvedCase) -> ZoneSet:
    """Read hard and soft zones from a file, in LPS mm; patches refer to structures of the case. Raises InputError."""
    return zones_from_dict(parse_json_object(decode(read_bytes(path), "the file of zones")), case.mesh, case.structures)


def resolve_plan_zones(plan: Plan, case: ResolvedCase) -> ZoneSet:
    """Return the zones of a plan's protected structures, in LPS mm.

    Raises PlanError, which names the structure that cannot be protected.
    """

    def surface(structure_id: str) -> TriangleMesh:
        if structure_id not in case.structures:
            raise NotFound(f"the case has no structure {structure_id!r:.60}; it has {', '.join(case.structures)}.")
        return case.structures[structure_id]

    return engine_zones(with_surface_errors(plan.content.zones, case.structure_errors), surface)


def find(items: Sequence[_Item], text: str, what: str) -> _Item:
    """Return the item with this id, or otherwise with this name.

    Raises NotFound, or InputError if several have the name.
    """
    matching = [item for item in items if item.id == text] or [item for item in items if item.name == text]
    if not matching:
        known = ", ".join(f"{item.id} ({item.name})" for item in items[:10]) or "none"
        raise NotFound(f"there is no {what} {text!r:.80}; there are: {known}.")
    if len(matching) > 1:
        ids = ", ".join(item.id for item in matching[:10])
        raise InputError(f"{len(matching)} items are called {text!r:.80}; name it by its id: {ids}.")
    return matching[0]


def read_bytes(path: Path) -> bytes:
    """Return the first `MAX_TEXT` + 1 bytes of a file, so that a file too large for a plan is recognised.

    Raises InputError if it cannot be read.
    """
    try:
        with path.open("rb") as file:
            return file.read(MAX_TEXT + 1)
    except OSError as error:
        raise InputError(f"{path.name} cannot be read: {error.strerror}.") from None


def is_file(path: Path) -> bool:
    """Return whether a file exists; False for text that cannot be a file name."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # too long, or with a null character
        return False
