"""coal, the collision library that the engine's proximity queries are compared with, configured for speed.

One `BVHModelOBBRSS` answers both kinds of query, as the engine's tree does: query times, build time and memory are
compared with it. A `BVHModelOBB` is faster in `collide`, but has no `distance` (it prints "OBB distance not
implemented"): with both, coal would need half as much memory and build time again; ratios to it are reported as well.
Capsules, transforms, requests and results are created once, outside of the timed part.

Pitfalls: `collide` with `security_margin` finds all triangles within the margin, but at most `num_max_contacts`; a
positive `penetration_depth` of a contact is a gap; in penetration `distance` is not the greatest depth.
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
    """Return a bounding-volume model of the mesh and its build time in s."""
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
    """The capsules of the tool with their transforms."""

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
        """Return the memory of the model that answers both kinds of query, in bytes."""
        return int(self.model.memUsage(0))

    def tool(self, segments: Segments) -> CoalTool:
        """Return the tool as capsules of coal; one without length is a ball."""
        coal, parts = self._coal, []
        for start, end, radius in zip(segments.start, segments.end, segments.radius, strict=True):
            length = float(np.linalg.norm(end - start))
            body = coal.Capsule(float(radius), length) if length > 0.0 else coal.Sphere(float(radius))
            turn = turning_z_to((end - start) / length) if length > 0.0 else np.eye(3)
            parts.append((body, coal.Transform3s(turn, (start + end) / 2)))
        return CoalTool(parts)

    def margin_request(self, threshold: float) -> Any:
        """Return a request for all triangles within ``threshold`` mm."""
        request = self._coal.CollisionRequest(self._coal.CollisionRequestFlag.CONTACT, MOST_CONTACTS)
        request.security_margin = threshold
        return request

    def collide(self, tool: CoalTool, request: Any, model: Any) -> int:
        """Return the number of pairs of a capsule and a triangle within the request's margin."""
        found = 0
        for body, place in tool.parts:
            self._contacts.clear()
            self._coal.collide(model, self._still, body, place, request, self._contacts)
            found += self._contacts.numContacts()
        return found

    def pairs(self, tool: CoalTool, request: Any) -> dict[tuple[int, int], float]:
        """Return the distance of each pair within the margin by segment and triangle; in contact it is not exact."""
        found = {}
        for s, (body, place) in enumerate(tool.parts):
            self._contacts.clear()
            self._coal.collide(self.collide_model, self._still, body, place, request, self._contacts)
            for contact in self._contacts.getContacts():
                found[s, int(contact.b1)] = float(contact.penetration_depth)
        return found

    def distance(self, tool: CoalTool) -> float:
        """Return the least distance of the whole tool; zero or negative in contact."""
        least = np.inf
        for body, place in tool.parts:
            self._result.clear()
            least = min(least, self._coal.distance(self.model, self._still, body, place, self._request, self._result))
        return float(least)


def turning_z_to(direction: Array) -> Array:
    """Return a rotation (3, 3) whose third column is ``direction``, a unit vector."""
    helper = np.eye(3)[int(np.abs(direction).argmin())]
    x = np.cross(helper, direction)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(direction, x), direction])
