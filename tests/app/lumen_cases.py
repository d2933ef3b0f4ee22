"""A straight tube as a lumen, whose pathway takes a moment."""

from __future__ import annotations

import numpy as np
import trimesh

from app.cases.model import Case, CaseFrame
from app.lumen.document import Route, StoredRoute
from app.services import Services
from vfix_engine.geometry.mesh import TriangleMesh

TUBE_MM, RADIUS_MM = 160.0, 15.0
ENTRY, END = (0.0, 0.0, 10.0), (0.0, 0.0, 150.0)


def tube_mesh() -> TriangleMesh:
    """A closed cylinder along z from the origin."""
    solid = trimesh.creation.cylinder(RADIUS_MM, segment=[[0.0, 0.0, 0.0], [0.0, 0.0, TUBE_MM]], sections=24)
    fine = solid.subdivide_to_size(12.0)
    return TriangleMesh(np.asarray(fine.vertices), np.asarray(fine.faces))


def tube(services: Services) -> Case:
    """A case of it."""
    frame = CaseFrame("LPS", assumed=False)
    return services.cases.create("Tube", frame=frame, surfaces={"lumen": tube_mesh()}, kind="lumen")


def route_in(services: Services, case: Case, **fields: object) -> StoredRoute:
    """A route along it."""
    content = Route(**{"entry": ENTRY, "end": END, "links": 4, **fields})  # type: ignore[arg-type]
    return services.lumen_routes.documents.create(case.id, "Along", content)
