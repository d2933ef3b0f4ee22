"""The lumens that travel with vfix: two synthetic colons, and a route through each."""

from __future__ import annotations

import functools
import hashlib
from typing import NamedTuple

from app.cases.files import PHANTOM_SURFACES, shipped_colon, surface_info
from app.cases.model import (
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

SAMPLE_ROUTE = "colon-phantom-sample"


class ShippedColon(NamedTuple):
    """A colon of the engine as a case. version: of the surface that the engine makes."""

    case_id: str
    name: str
    source: str
    route_id: str
    hard: bool
    version: int = 1


COLONS = (
    ShippedColon(COLON_PHANTOM, "Colon phantom", "phantom:colon", SAMPLE_ROUTE, hard=False),
    ShippedColon(HARD_COLON, "Hard colon", "phantom:hardcolon", "colon-hard-sample", hard=True),
)


def ensure_colon_phantoms(store: Store, cases: CaseService, routes: RouteService) -> None:
    """Make the embedded colons and their sample routes where they are missing, and follow a newer engine.

    What the user did to them stays: a new name, a deletion, edits of the route.
    """
    for colon in COLONS:
        _ensure(colon, store, cases, routes)


def _ensure(colon: ShippedColon, store: Store, cases: CaseService, routes: RouteService) -> None:
    try:
        known = cases.get(colon.case_id)
    except (NotFound, StoreDamaged):
        known = None
    if known is None or known.content_hash != shipped_hash(colon):
        known = cases.put(colon.case_id, colon.name, _content(colon), shipped_hash(colon))
    with store.reading() as session:  # whether it is there: what is in it need not be readable to start
        missing = session.get(DocumentRow, colon.route_id) is None
    if missing and known.deleted_at is None:
        places = [mark.position for mark in known.landmarks]
        sample = Route(entry=places[0], end=places[-1])
        routes.documents.create(colon.case_id, "Whole colon", sample, document_id=colon.route_id)


def shipped_hash(colon: ShippedColon = COLONS[0]) -> str:
    """The content hash of a colon that travels with this vfix."""
    return hashlib.sha256(f"{colon.source} {colon.version}".encode()).hexdigest()


@functools.cache
def _content(colon: ShippedColon) -> CaseContent:
    mesh = PHANTOM_SURFACES[colon.source]()
    info = surface_info(LUMEN, mesh, colon.source)
    digest = hashlib.sha256(mesh.vertices.tobytes() + mesh.faces.tobytes()).hexdigest()
    structure = anatomy_structure("lumen", info, f"sha256:{digest}", Provenance("shipped"), is_closed(mesh))
    places = shipped_colon(colon.hard).course.landmarks
    marks = tuple(CaseLandmark(name.replace("_", " ").capitalize(), to_triple(at)) for name, at in places.items())
    return CaseContent(CaseFrame("LPS", assumed=False), (info,), kind="lumen", structures=(structure,), landmarks=marks)
