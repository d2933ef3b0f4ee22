"""Meshes for the tests, friendly and unfriendly."""

from __future__ import annotations

import numpy as np
import trimesh

from vfix_engine.geometry.capsules import Segments
from vfix_engine.geometry.mesh import TriangleMesh


def ball(level: int = 3, radius: float = 10.0) -> TriangleMesh:
    made = trimesh.creation.icosphere(subdivisions=level, radius=radius)
    return TriangleMesh(made.vertices, made.faces)


def soup(random: np.random.Generator, count: int = 300) -> TriangleMesh:
    """Unconnected triangles of very different sizes."""
    centre = random.uniform(-10, 10, (count, 1, 3))
    size = 10.0 ** random.uniform(-3, 1, (count, 1, 1))
    return TriangleMesh((centre + size * random.normal(size=(count, 3, 3))).reshape(-1, 3), _own_corners(count))


def slivers(random: np.random.Generator, count: int = 200) -> TriangleMesh:
    """Needles, triangles without area and triangles that are points, some twice."""
    a, b = random.uniform(-10, 10, (2, count, 3))
    c = a + random.uniform(0, 1, (count, 1)) * (b - a) + random.choice([0, 1e-12, 1e-6], (count, 1))
    corners = np.stack([a, b, c], axis=1)
    corners[::5] = corners[::5, :1]
    corners[1::7] = corners[1]
    return TriangleMesh(corners.reshape(-1, 3), _own_corners(count))


def coinciding(count: int = 500) -> TriangleMesh:
    """The same triangle many times: nothing to split by."""
    return TriangleMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.tile([0, 1, 2], (count, 1)))


def _own_corners(count: int) -> np.ndarray:
    return np.arange(3 * count).reshape(-1, 3)


def all_meshes() -> dict[str, TriangleMesh]:
    random = np.random.default_rng(7)
    far = ball(2)
    return {
        "ball": ball(2),
        "soup": soup(random),
        "slivers": slivers(random),
        "coinciding": coinciding(),
        "far": TriangleMesh(far.vertices + 5000.0, far.faces),
        "single": TriangleMesh([[0, 0, 0], [3, 0, 0], [0, 2, 0]], [[0, 1, 2]]),
    }


def random_tool(random: np.random.Generator, mesh: TriangleMesh) -> Segments:
    """Three segments about the mesh: one long, one short, one of no length."""
    low, high = mesh.bounds
    start, end = random.uniform(low - 3.0, high + 3.0, (2, 3, 3))
    end[1] = start[1] + 1e-3 * random.normal(size=3)
    end[2] = start[2]
    return Segments(start, end, random.uniform(0.0, 1.5, 3))


def bent_tools(random: np.random.Generator, mesh: TriangleMesh, count: int) -> list[Segments]:
    """Bent tools of 15 and 150 mm with 1.5 mm radius about the mesh, free and penetrating."""
    low, high = mesh.bounds
    tools = []
    for _ in range(count):
        tip = random.uniform(low, high)
        one, two = random.normal(size=(2, 3))
        bend = tip + 15.0 * one / np.linalg.norm(one)
        tools.append(Segments([tip, bend], [bend, bend + 150.0 * two / np.linalg.norm(two)], [1.5, 1.5]))
    return tools
