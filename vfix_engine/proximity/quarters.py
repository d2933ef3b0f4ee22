"""Subdivision of triangles."""

from __future__ import annotations

import numpy as np

from ..arrays import Array


def quarters(triangles: Array) -> Array:
    """Divide triangles (n, 3, 3) at the midpoints of their edges into (4 n, 3, 3)."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    ab, bc, ca = (a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0
    parts = [np.stack(part, axis=1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    return np.stack(parts, axis=1).reshape(-1, 3, 3)
