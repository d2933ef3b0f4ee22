"""The judge of the attack: brute force over all relevant triangles, and coal for comparison.

It shares no code with the engine: triangles are read from the mesh, kinematics are a product of exponentials, and
closest points are found by independent kernels (``exact.py``). The engine only defines the robot, by its Jacobian at
q = 0, from which the screws are derived.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.coal_peer import turning_z_to
from vfix_engine.arrays import Array, IntArray
from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.mesh import TriangleMesh
from vfix_engine.robots import PlacedRobot, Tool

from .exact import furthest, gather, least_distance, place, replay

WIDE_MM = 2.0  # how far the tool may move before all triangles are searched again
CLOSE_MM = 0.3  # the same for the triangles near it


@dataclass(frozen=True, eq=False)
class Screws:
    """A serial robot with its tool as screws at q = 0 in the patient frame; ``home``: ends of the axes (2 S, 3)."""

    revolute: Array
    axis: Array
    point: Array
    home: Array
    radius: Array

    @classmethod
    def of(cls, robot: PlacedRobot, tool: Tool) -> Screws:
        """Return the screws derived from the engine's Jacobian at q = 0."""
        tip = robot.tip(np.zeros(robot.dof))
        revolute = np.array(robot.robot.revolute, dtype=float)
        turn, shift = tip.jacobian[3:].T, tip.jacobian[:3].T
        axis = np.where(revolute[:, None] > 0.0, turn, shift)
        # v = ω × (tip − o), hence o = tip + ω × v for the point of the axis that is nearest to the tip
        point = np.where(revolute[:, None] > 0.0, tip.position + np.cross(turn, shift), 0.0)
        home = ends(tool.segments(tip.rotation, tip.position))
        radius = np.array(tool.radius, dtype=float)
        return cls(revolute, np.ascontiguousarray(axis), np.ascontiguousarray(point), home, radius)

    def places(self, q: Array) -> Array:
        """Return the ends of the axes (2 S, 3) at joints q (n,)."""
        out = np.empty_like(self.home)
        place(self.revolute, self.axis, self.point, self.home, np.asarray(q, dtype=float), out)
        return out


class Anatomy:
    """All triangles of one mesh, each with a ball around its corners' mean."""

    def __init__(self, mesh: TriangleMesh):
        corners = np.asarray(mesh.vertices)[np.asarray(mesh.faces)]
        centre = corners.mean(axis=1)
        reach = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1)
        size = 1.0 + np.abs(corners).max()
        self.mesh = mesh
        self.corners = np.ascontiguousarray(corners.reshape(-1, 9))
        self.spheres = np.ascontiguousarray(np.column_stack([centre, reach + 1e-12 * size]))
        self.all = np.arange(len(corners), dtype=np.int64)


class Local:
    """The triangles near a moving tool, in two shells; every result equals that of brute force over all triangles.

    A shell contains each triangle whose ball is within its reach of the tool at its anchor. The distance from the
    tool's surface to anything decreases by at most the largest displacement of an end of its axes, so a shell is valid
    for ``cap`` as long as that displacement plus ``cap`` is at most its reach.
    """

    def __init__(self, anatomy: Anatomy, radius: Array):
        self.anatomy, self.radius = anatomy, radius
        self._outer: IntArray = anatomy.all[:0]
        self._outer_reach = self._reach = -1.0
        self._outer_anchor = self._anchor = np.zeros((2 * len(radius), 3))
        self._corners, self._spheres = anatomy.corners[:0], anatomy.spheres[:0]
        self._least, self._nearest = np.empty(len(radius)), np.empty(len(radius), np.int64)

    def clearance(self, places: Array, cap: float) -> Array:
        """Return the least distance (S,) of each capsule to the mesh, at most ``cap``."""
        self._see(places, cap)
        least_distance(self._corners, self._spheres, places, self.radius, cap, self._least, self._nearest)
        return self._least.copy()

    def between(self, screws: Screws, before: Array, after: Array, parts: int, cap: float) -> Array:
        """Return the least distance (S,) of each capsule over ``parts`` − 1 poses between two states, at most cap."""
        worst = np.full(len(self.radius), cap)
        part = 1
        while True:
            part = replay(
                screws.revolute, screws.axis, screws.point, screws.home, before, after, parts,
                self._corners, self._spheres, self.radius, self._anchor, self._reach, cap,
                part, self._least, self._nearest, worst,
            )  # fmt: skip
            if part == parts:
                return worst
            self._see(screws.places(before + part / parts * (after - before)), cap)

    def _see(self, places: Array, cap: float) -> None:
        if furthest(self._anchor, places) + cap <= self._reach - 1e-6:
            return
        anatomy, reach = self.anatomy, cap + CLOSE_MM
        if not furthest(self._outer_anchor, places) + reach <= self._outer_reach - 1e-6:
            self._outer_reach, self._outer_anchor = reach + WIDE_MM, places.copy()
            self._outer = gather(anatomy.corners, anatomy.spheres, anatomy.all, places, self.radius, self._outer_reach)
        near = gather(anatomy.corners, anatomy.spheres, self._outer, places, self.radius, reach)
        self._reach, self._anchor = reach, places.copy()
        self._corners, self._spheres = anatomy.corners[near], anatomy.spheres[near]


class Peer:
    """Clearance by coal, with a different tree and different arithmetic."""

    def __init__(self, coal: ModuleType, mesh: TriangleMesh):
        self._coal = coal
        self._model: Any = coal.BVHModelOBBRSS()
        self._model.beginModel(len(mesh.faces), len(mesh.vertices))
        points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
        for vertex in mesh.vertices:
            points.append(vertex)
        for a, b, c in mesh.faces:
            triangles.append(coal.Triangle(int(a), int(b), int(c)))
        self._model.addSubModel(points, triangles)
        self._model.endModel()
        self._still = coal.Transform3s.Identity()

    def clearance(self, places: Array, radius: Array) -> float:
        """Return the least distance of the whole tool; zero or negative in contact, where it is not the depth."""
        coal, least = self._coal, np.inf
        for s in range(len(radius)):
            start, end = places[2 * s], places[2 * s + 1]
            body, where = capsule(coal, start, end, float(radius[s]))
            request, result = coal.DistanceRequest(), coal.DistanceResult()
            least = min(least, coal.distance(self._model, self._still, body, where, request, result))
        return float(least)


def capsule(coal: ModuleType, start: Array, end: Array, radius: float) -> tuple[Any, Any]:
    """Return coal's capsule around an axis, or a ball for an axis without length, and its transform."""
    length = float(np.linalg.norm(end - start))
    if length == 0.0:
        return coal.Sphere(radius), coal.Transform3s(np.eye(3), start)
    turn = turning_z_to((end - start) / length)
    return coal.Capsule(radius, length), coal.Transform3s(turn, (start + end) / 2)


def ends(segments: Segments) -> Array:
    """Return start and end of every axis in turn (2 S, 3)."""
    out = np.empty((2 * len(segments), 3))
    out[0::2], out[1::2] = segments.start, segments.end
    return out
