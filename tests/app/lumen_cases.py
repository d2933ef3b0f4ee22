"""A straight and a winding tube as a lumen, whose pathway takes a moment."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray

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


def winding_line() -> NDArray[np.float64]:
    """(n, 3) a wave of 12 mm every 110 mm, 330 mm along z, LPS mm: what follows it is shorter than its middle."""
    z = np.linspace(0.0, 330.0, 200)
    return np.column_stack([12.0 * np.sin(z * 2.0 * np.pi / 110.0), np.zeros(200), z])


def winding_mesh() -> TriangleMesh:
    """A closed tube of the same radius about it."""
    middle, turn = winding_line(), np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    ahead = np.gradient(middle, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    across = np.cross(ahead, [0.0, 1.0, 0.0])
    rims = middle[:, None] + RADIUS_MM * (
        np.cos(turn)[:, None] * across[:, None] + np.sin(turn)[:, None] * np.eye(3)[1]
    )
    here = np.arange((len(middle) - 1) * 24).reshape(-1, 24)
    beside = np.roll(here, -1, axis=1)
    walls = [np.stack([here, beside, here + 24], axis=-1), np.stack([beside, beside + 24, here + 24], axis=-1)]
    last, count = 24 * (len(middle) - 1), 24 * len(middle)
    k = np.arange(24)
    caps = [np.column_stack([np.full(24, count), np.roll(k, -1), k])]
    caps += [np.column_stack([np.full(24, count + 1), last + k, last + np.roll(k, -1)])]
    faces = np.concatenate([*(wall.reshape(-1, 3) for wall in walls), *caps])
    return TriangleMesh(np.concatenate([rims.reshape(-1, 3), middle[[0, -1]]]), faces)


def tube(services: Services, mesh: TriangleMesh | None = None) -> Case:
    """A case of the straight tube, or of another mesh."""
    frame = CaseFrame("LPS", assumed=False)
    return services.cases.create("Tube", frame=frame, surfaces={"lumen": mesh or tube_mesh()}, kind="lumen")


def route_in(services: Services, case: Case, **fields: object) -> StoredRoute:
    """A route along it."""
    content = Route(**{"entry": ENTRY, "end": END, "links": 4, **fields})  # type: ignore[arg-type]
    return services.lumen_routes.documents.create(case.id, "Along", content)
