"""coal, the collision library that the engine's proximity queries are compared with, set up as fast as it goes.

One `BVHModelOBBRSS` answers both kinds of query, as our tree does: times, building and memory are compared with it. A
`BVHModelOBB` beside it is faster in `collide`, but has no `distance` (it prints "OBB distance not implemented"): with
both, coal would take half as much memory and time to build again; ratios to it are told as well.
Capsules, transforms, requests and results are made once, outside of what is timed.

Traps: `collide` with `security_margin` finds all triangles within the margin, but only as many as
`num_max_contacts`; a contact's positive `penetration_depth` is a gap; `distance` in penetration is not the deepest.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from vfix_engine.arrays import Array
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.mesh import TriangleMesh

MOST_CONTACTS = 1_000_000


def build(coal: ModuleType, mesh: TriangleMesh, kind: str = "BVHModelOBBRSS") -> tuple[Any, float]:
    """A bounding-volume model of the mesh and the seconds that it took."""
    vertices, faces = np.ascontiguousarray(mesh.vertices), mesh.faces.astype(np.int64)
    begin = time.perf_counter()
    model = getattr(coal, kind)()
    model.beginModel(len(faces), len(vertices))
    model.addVertices(vertices)
    model.addTriangles(faces)
    model.endModel()
    return model, time.perf_counter() - begin


@dataclass(frozen=True, eq=False)
class CoalTool:
    """The tool's capsules with their places."""

    parts: list[tuple[Any, Any]]


class CoalPeer:
    """Queries of one mesh by coal."""

    def __init__(self, coal: ModuleType, mesh: TriangleMesh):
        self._coal = coal
        self.model, self.build_s = build(coal, mesh)
        self.collide_model, _ = build(coal, mesh, "BVHModelOBB")
        self._still = coal.Transform3s.Identity()
        self._request, self._result = coal.DistanceRequest(), coal.DistanceResult()
        self._contacts = coal.CollisionResult()

    @property
    def nbytes(self) -> int:
        """Memory of the model that answers both kinds of query, in bytes."""
        return int(self.model.memUsage(0))

    def tool(self, segments: Segments) -> CoalTool:
        """The tool as coal's capsules; one without length is a ball."""
        coal, parts = self._coal, []
        for start, end, radius in zip(segments.start, segments.end, segments.radius, strict=True):
            length = float(np.linalg.norm(end - start))
            body = coal.Capsule(float(radius), length) if length > 0.0 else coal.Sphere(float(radius))
            turn = turning_z_to((end - start) / length) if length > 0.0 else np.eye(3)
            parts.append((body, coal.Transform3s(turn, (start + end) / 2)))
        return CoalTool(parts)

    def margin_request(self, threshold: float) -> Any:
        """A request for all triangles within ``threshold`` mm."""
        request = self._coal.CollisionRequest(self._coal.CollisionRequestFlag.CONTACT, MOST_CONTACTS)
        request.security_margin = threshold
        return request

    def collide(self, tool: CoalTool, request: Any, model: Any) -> int:
        """How many pairs of a capsule and a triangle are within the request's margin."""
        found = 0
        for body, place in tool.parts:
            self._contacts.clear()
            self._coal.collide(model, self._still, body, place, request, self._contacts)
            found += self._contacts.numContacts()
        return found

    def pairs(self, tool: CoalTool, request: Any) -> dict[tuple[int, int], float]:
        """Distance of each pair within the margin, by segment and triangle; of those in contact not the exact depth."""
        found = {}
        for s, (body, place) in enumerate(tool.parts):
            self._contacts.clear()
            self._coal.collide(self.collide_model, self._still, body, place, request, self._contacts)
            for contact in self._contacts.getContacts():
                found[s, int(contact.b1)] = float(contact.penetration_depth)
        return found

    def distance(self, tool: CoalTool) -> float:
        """Smallest distance of the whole tool; not positive means contact."""
        least = np.inf
        for body, place in tool.parts:
            self._result.clear()
            least = min(least, self._coal.distance(self.model, self._still, body, place, self._request, self._result))
        return float(least)


def turning_z_to(direction: Array) -> Array:
    """A rotation (3, 3) whose third column is ``direction``, a unit vector."""
    helper = np.eye(3)[int(np.abs(direction).argmin())]
    x = np.cross(helper, direction)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(direction, x), direction])
