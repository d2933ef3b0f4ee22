"""The lumens that travel with vfix: two synthetic colons and a body cavity, and a route through each."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from app.cases.files import PHANTOM_SURFACES, CaseFiles, shipped_cavity, shipped_colon, surface_info
from app.cases.model import (
    CAVITY,
    CAVITY_PHANTOM,
    COLON_PHANTOM,
    HARD_COLON,
    CaseContent,
    CaseFrame,
    CaseLandmark,
    anatomy_structure,
    to_triple,
)
from app.cases.service import CaseService
from app.cases.structures import LUMEN, Provenance, is_closed
from app.kit.errors import NotFound
from app.lumen.document import Route
from app.lumen.service import RouteService
from app.store import Store
from app.store.errors import StoreDamaged
from app.store.models import DocumentRow
from vfix_engine.arrays import Array

SAMPLE_ROUTE = "colon-phantom-sample"
_SAME_MM = 1e-6  # between a vertex that this machine has made and another one: sines may be rounded otherwise


class ShippedLumen(NamedTuple):
    """A lumen of the engine as a case, and a route through it. version: of the surface that the engine makes."""

    case_id: str
    name: str
    source: str
    route_id: str
    route_name: str
    landmarks: Callable[[], Mapping[str, Array]]
    version: int = 1


def _cavity_ends() -> dict[str, Array]:
    centre = shipped_cavity().pathway.centre
    return {"pelvis": centre[0], "diaphragm": centre[-1]}


LUMENS = (
    ShippedLumen(
        COLON_PHANTOM, "Colon phantom", "phantom:colon", SAMPLE_ROUTE, "Whole colon",
        lambda: shipped_colon().course.landmarks,
    ),
    ShippedLumen(
        HARD_COLON, "Hard colon", "phantom:hardcolon", "colon-hard-sample", "Whole colon",
        lambda: shipped_colon(hard=True).course.landmarks,
    ),
    ShippedLumen(CAVITY_PHANTOM, "Body cavity", CAVITY, "cavity-phantom-sample", "Cavity", _cavity_ends),
)  # fmt: skip


def ensure_lumen_phantoms(store: Store, cases: CaseService, routes: RouteService) -> None:
    """Make the embedded lumens and their sample routes where they are missing, and follow a newer engine.

    What the user did to them stays: a new name, a deletion, edits of the route.
    """
    for lumen in LUMENS:
        _ensure(lumen, store, cases, routes)


def _ensure(lumen: ShippedLumen, store: Store, cases: CaseService, routes: RouteService) -> None:
    try:
        known = cases.get(lumen.case_id)
    except (NotFound, StoreDamaged):
        known = None
    if known is None or known.content_hash != shipped_hash(lumen):
        known = cases.put(lumen.case_id, lumen.name, _content(lumen), shipped_hash(lumen))
    with store.reading() as session:  # whether it is there: what is in it need not be readable to start
        missing = session.get(DocumentRow, lumen.route_id) is None
    if missing and known.deleted_at is None:
        places = [mark.position for mark in known.landmarks]
        sample = Route(entry=places[0], end=places[-1])
        routes.documents.create(lumen.case_id, lumen.route_name, sample, document_id=lumen.route_id)


def shipped_hash(lumen: ShippedLumen = LUMENS[0]) -> str:
    """The content hash of a lumen that travels with this vfix."""
    return hashlib.sha256(f"{lumen.source} {lumen.version}".encode()).hexdigest()


def is_shipped_hash(content_hash: str) -> bool:
    """Whether it is that of a lumen that travels with this vfix."""
    return content_hash in {shipped_hash(lumen) for lumen in LUMENS}


def restored_lumen(content: CaseContent, files: CaseFiles) -> tuple[CaseContent, str] | None:
    """A copy of a lumen that travels with vfix, out of an archive: with the surface of this vfix, and its content hash.

    The cavity's pathway and base belong to that surface. None for a case of another surface.
    """
    driven = next(one for one in content.structures if one.role == LUMEN)
    own = next(one for one in content.surfaces if one.name == driven.surface)
    mesh = files.surface(own.source)
    for lumen in LUMENS:
        shipped = PHANTOM_SURFACES[lumen.source]()
        if not np.array_equal(mesh.faces, shipped.faces) or mesh.vertices.shape != shipped.vertices.shape:
            continue
        if np.abs(mesh.vertices - shipped.vertices).max() > _SAME_MM:
            continue
        made = _content(lumen)
        others = tuple(one for one in content.surfaces if one is not own)
        structures = tuple(made.structures[0] if one is driven else one for one in content.structures)
        return replace(content, surfaces=(*made.surfaces, *others), structures=structures), shipped_hash(lumen)
    return None


@functools.cache
def _content(lumen: ShippedLumen) -> CaseContent:
    mesh = PHANTOM_SURFACES[lumen.source]()
    info = surface_info(LUMEN, mesh, lumen.source)
    digest = hashlib.sha256(mesh.vertices.tobytes() + mesh.faces.tobytes()).hexdigest()
    structure = anatomy_structure("lumen", info, f"sha256:{digest}", Provenance("shipped"), is_closed(mesh))
    places = lumen.landmarks()
    marks = tuple(CaseLandmark(name.replace("_", " ").capitalize(), to_triple(at)) for name, at in places.items())
    return CaseContent(CaseFrame("LPS", assumed=False), (info,), kind="lumen", structures=(structure,), landmarks=marks)
