"""Triangulated border of a convex solid, with every vertex on it: surfaces of revolution, and grids for a box."""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from ..errors import InputError
from .shapes import Box, CapsuleShape, Shape, Sphere

MOST_TRIANGLES = 200_000


def border_triangles(shape: Shape, edge_mm: float) -> Array:
    """Triangulate a shape's border, (n, 3, 3), with outward normals and edges of about `edge_mm`.

    Round borders are inscribed: no triangle extends beyond the shape. Edges are longer if there would be more than
    200,000 triangles.

    Raises:
        InputError: the shape is a half-space, whose border is unbounded.
    """
    if isinstance(shape, Sphere):
        return _lathe(shape.centre, shape.centre, shape.radius, edge_mm)
    if isinstance(shape, CapsuleShape):
        return _lathe(shape.start, shape.end, shape.radius, edge_mm)
    if isinstance(shape, Box):
        return _box(shape, edge_mm)
    raise InputError("a half-space has no border of a finite size; take a box")


def _edge(area_mm2: float, edge_mm: float) -> float:
    """Return the edge length, increased if an area with two triangles per square would have too many."""
    return max(edge_mm, float(np.sqrt(2.0 * area_mm2 / MOST_TRIANGLES)))


def _lathe(start: Array, end: Array, radius: float, edge_mm: float) -> Array:
    """Triangulate a capsule as a surface of revolution, from the pole behind its start to the one beyond its end."""
    along = end - start
    length = float(np.linalg.norm(along))
    axis = along / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    edge = _edge(2.0 * np.pi * radius * (length + 2.0 * radius), edge_mm)
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    across /= np.linalg.norm(across)
    quarter = np.linspace(0.0, np.pi / 2.0, max(3, int(np.ceil(np.pi / 2.0 * radius / edge))) + 1)
    straight = np.linspace(0.0, length, int(np.ceil(length / edge)) + 1)[1:-1] if length > 0.0 else np.zeros(0)
    height = np.concatenate([-radius * np.cos(quarter), straight, length + radius * np.sin(quarter)])
    wide = np.concatenate([radius * np.sin(quarter), np.full(len(straight), radius), radius * np.cos(quarter)])
    if length == 0.0:
        height, wide = np.delete(height, len(quarter)), np.delete(wide, len(quarter))
    wide[[0, -1]] = 0.0  # the poles
    turns = 2.0 * np.pi * np.arange(count := max(8, int(np.ceil(2.0 * np.pi * radius / edge)))) / count
    round_ = np.cos(turns)[:, None] * across + np.sin(turns)[:, None] * np.cross(axis, across)
    rings = start + height[:, None, None] * axis + wide[:, None, None] * round_[None]
    triangles = _of_grid(np.concatenate([rings, rings[:, :1]], axis=1))
    area = np.linalg.norm(np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]), axis=1)
    kept: Array = triangles[area > 0.0]
    return kept


def _box(box: Box, edge_mm: float) -> Array:
    a, b, c = 2.0 * box.half_size
    edge = _edge(2.0 * float(a * b + b * c + c * a), edge_mm)
    faces = []
    for axis in range(3):
        others = [(axis + 1) % 3, (axis + 2) % 3]
        steps = [np.linspace(-h, h, int(np.ceil(2.0 * h / edge)) + 1) for h in box.half_size[others]]
        for side in (-1.0, 1.0):
            first, second = np.meshgrid(*steps, indexing="ij")
            grid = np.empty((*first.shape, 3))
            grid[..., axis], grid[..., others[0]], grid[..., others[1]] = side * box.half_size[axis], first, second
            faces.append(_of_grid(grid if side < 0.0 else grid[::-1]))
    transform = box.transform_box_to_patient
    placed: Array = np.concatenate(faces) @ transform[:3, :3].T + transform[:3, 3]
    return placed


def _of_grid(places: Array) -> Array:
    """Return two triangles for each cell of a grid of points (m, n, 3)."""
    a, b, c, d = places[:-1, :-1], places[:-1, 1:], places[1:, 1:], places[1:, :-1]
    pairs = np.stack([np.stack([a, b, c], axis=-2), np.stack([a, c, d], axis=-2)], axis=2)
    return pairs.reshape(-1, 3, 3)
