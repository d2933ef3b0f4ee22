"""The lumen that travels with vfix: a synthetic colon, and a route through it."""

from __future__ import annotations

import functools
import hashlib

from app.cases.files import PHANTOM_SURFACES, shipped_colon, surface_info
from app.cases.model import (
    COLON_PHANTOM,
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
_NAME = "Colon phantom"
_SOURCE = "phantom:colon"
_VERSION = 1  # of the surface that the engine makes


def ensure_colon_phantom(store: Store, cases: CaseService, routes: RouteService) -> None:
    """Make the embedded colon and its sample route where they are missing, and follow a newer engine.

    What the user did to them stays: a new name, a deletion, edits of the route.
    """
    try:
        known = cases.get(COLON_PHANTOM)
    except (NotFound, StoreDamaged):
        known = None
    if known is None or known.content_hash != shipped_hash():
        known = cases.put(COLON_PHANTOM, _NAME, _content(), shipped_hash())
    with store.reading() as session:  # whether it is there: what is in it need not be readable to start
        missing = session.get(DocumentRow, SAMPLE_ROUTE) is None
    if missing and known.deleted_at is None:
        places = [mark.position for mark in known.landmarks]
        sample = Route(entry=places[0], end=places[-1])
        routes.documents.create(COLON_PHANTOM, "Whole colon", sample, document_id=SAMPLE_ROUTE)


def shipped_hash() -> str:
    """The content hash of the colon that travels with this vfix."""
    return hashlib.sha256(f"{_SOURCE} {_VERSION}".encode()).hexdigest()


@functools.cache
def _content() -> CaseContent:
    mesh = PHANTOM_SURFACES[_SOURCE]()
    info = surface_info(LUMEN, mesh, _SOURCE)
    digest = hashlib.sha256(mesh.vertices.tobytes() + mesh.faces.tobytes()).hexdigest()
    structure = anatomy_structure("lumen", info, f"sha256:{digest}", Provenance("shipped"), is_closed(mesh))
    places = shipped_colon().course.landmarks
    marks = tuple(CaseLandmark(name.replace("_", " ").capitalize(), to_triple(at)) for name, at in places.items())
    return CaseContent(CaseFrame("LPS", assumed=False), (info,), kind="lumen", structures=(structure,), landmarks=marks)
