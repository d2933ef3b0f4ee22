"""The obstacles of a scene with their margins, as measured by the attack's judges."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np

from vfix_engine.arrays import Array
from vfix_engine.geometry.shapes import Box, CapsuleShape, HalfSpace, Shape, Sphere
from vfix_engine.virtual_fixtures.zones import SHAPES, Zone, ordered
from vfix_engine.worlds.rigid.scene import Scene

from .exact import shape_distance, shape_replay
from .oracle import Anatomy, Local, Peer, Screws, capsule


class Solid:
    """One analytic shape, measured by independent formulas; 0 where the axis has entered it."""

    def __init__(self, shape: Shape, radius: Array):
        self.radius = radius
        self.kind, numbers = _numbers(shape)
        self.numbers = np.zeros(16)
        self.numbers[: len(numbers)] = numbers

    def clearance(self, places: Array, cap: float) -> Array:
        """Return the least distance (S,) of each capsule to the shape, at most ``cap``."""
        gaps = [
            shape_distance(self.kind, self.numbers, places[2 * s], places[2 * s + 1]) for s in range(len(self.radius))
        ]
        return np.minimum(np.array(gaps) - self.radius, cap)

    def between(self, screws: Screws, before: Array, after: Array, parts: int, cap: float) -> Array:
        """Return the same over the poses between two joint states."""
        worst = np.full(len(self.radius), cap)
        shape_replay(
            screws.revolute, screws.axis, screws.point, screws.home, before, after, parts,
            self.kind, self.numbers, self.radius, worst,
        )  # fmt: skip
        return worst


class ShapePeer:
    """One analytic shape in coal."""

    def __init__(self, coal: ModuleType, shape: Shape):
        self._coal = coal
        self._body, self._where = _in_coal(coal, shape)

    def clearance(self, places: Array, radius: Array) -> float:
        """Return the least distance of the whole tool to the shape."""
        coal, least = self._coal, np.inf
        for s in range(len(radius)):
            body, where = capsule(coal, places[2 * s], places[2 * s + 1], float(radius[s]))
            request, result = coal.DistanceRequest(), coal.DistanceResult()
            least = min(least, coal.distance(self._body, self._where, body, where, request, result))
        return float(least)


class Judges:
    """All bodies of one scene in the engine's order."""

    def __init__(self, scene: Scene, coal: ModuleType | None):
        self._coal = coal
        self.screws = Screws.of(scene.placed_robot(), scene.tool)
        self.zones: tuple[Zone, ...] = ordered(scene.zones)
        self.mesh = scene.tree.mesh
        radius = self.screws.radius
        self._solids: list[Any] = [zone.solid for zone in self.zones]
        self.bodies: list[Local | Solid] = [Local(Anatomy(self.mesh), radius)]
        for solid in self._solids:
            shape = isinstance(solid, SHAPES)
            self.bodies.append(Solid(solid, radius) if shape else Local(Anatomy(solid.mesh), radius))
        self.scale = 1.0 + float(np.abs(self.mesh.bounds).max())
        self._peers: list[Peer | ShapePeer] | None = None

    def margins(self, margin_mm: float) -> Array:
        """Return the margin (B,) of every body, from the margin of the settings."""
        return np.array([margin_mm, *(zone.margin_mm for zone in self.zones)])

    def clearance(self, places: Array, caps: Array) -> Array:
        """Return the least distance (B, S) of every body to every capsule, at most caps (B,)."""
        return np.stack([body.clearance(places, cap) for body, cap in zip(self.bodies, caps, strict=True)])

    def between(self, before: Array, after: Array, parts: int, caps: Array) -> Array:
        """Return the same (B, S) over the poses between two joint states."""
        found = [b.between(self.screws, before, after, parts, cap) for b, cap in zip(self.bodies, caps, strict=True)]
        return np.stack(found)

    def by_coal(self, places: Array) -> Array | None:
        """Return the least distance (B,) of the whole tool to every body by coal; None without coal."""
        if self._coal is None:
            return None
        if self._peers is None:
            coal = self._coal
            self._peers = [Peer(coal, self.mesh)]
            for solid in self._solids:
                self._peers.append(ShapePeer(coal, solid) if isinstance(solid, SHAPES) else Peer(coal, solid.mesh))
        return np.array([peer.clearance(places, self.screws.radius) for peer in self._peers])


def _numbers(shape: Shape) -> tuple[int, Array]:
    """Return kind and numbers of a shape for ``shape_distance``."""
    if isinstance(shape, Sphere):
        return 0, np.array([*shape.centre, shape.radius])
    if isinstance(shape, CapsuleShape):
        return 1, np.array([*shape.start, *shape.end, shape.radius])
    if isinstance(shape, Box):
        turn, centre = shape.transform_box_to_patient[:3, :3], shape.transform_box_to_patient[:3, 3]
        return 2, np.concatenate([centre, turn.T.ravel(), shape.half_size])
    return 3, np.array([*shape.point, *shape.normal])


def _in_coal(coal: ModuleType, shape: Shape) -> tuple[Any, Any]:
    if isinstance(shape, Sphere):
        return coal.Sphere(float(shape.radius)), coal.Transform3s(np.eye(3), shape.centre)
    if isinstance(shape, CapsuleShape):
        return capsule(coal, shape.start, shape.end, float(shape.radius))
    if isinstance(shape, Box):
        turn, centre = shape.transform_box_to_patient[:3, :3], shape.transform_box_to_patient[:3, 3]
        return coal.Box(*(2.0 * float(v) for v in shape.half_size)), coal.Transform3s(turn, centre)
    assert isinstance(shape, HalfSpace)
    # coal's half-space is n·x < d about its own origin.
    return coal.Halfspace(np.array(shape.normal), float(shape.normal @ shape.point)), coal.Transform3s.Identity()
