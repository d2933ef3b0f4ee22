"""Bounding spheres of triangles."""

from __future__ import annotations

import numpy as np

from ...arrays import Array


def enclosing_spheres(triangles: Array) -> tuple[Array, Array]:
    """Smallest sphere around each triangle: centres (F, 3) and radii (F,), each containing its whole triangle.

    Li 2007 uses circumspheres. For an obtuse triangle the sphere over its longest edge also contains the third corner,
    is smaller, and stays finite for degenerate triangles. For acute triangles the two are the same.
    """
    edges = np.roll(triangles, -1, axis=1) - triangles  # corner i to i + 1
    size = np.einsum("fij,fij->fi", edges, edges)
    longest = size.argmax(axis=1)
    rows = np.arange(len(triangles))
    centres: Array = triangles[rows, longest] + 0.5 * edges[rows, longest]
    acute = 2.0 * size.max(axis=1) < size.sum(axis=1) * (1.0 - 1e-9)
    u, v = edges[acute, 0], -edges[acute, 2]
    normal = np.cross(u, v)
    uu, vv = size[acute, 0][:, None], size[acute, 2][:, None]
    twice = 2.0 * np.einsum("fi,fi->f", normal, normal)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        circum = triangles[acute, 0] + (uu * np.cross(v, normal) + vv * np.cross(normal, u)) / twice
    centres[acute] = np.where(np.isfinite(circum), circum, centres[acute])
    # Measured from the rounded centre, so that no corner lies outside.
    radii: Array = np.sqrt(((triangles - centres[:, None]) ** 2).sum(axis=2).max(axis=1)) * (1.0 + 1e-12)
    return centres, radii
