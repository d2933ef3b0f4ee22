"""Upper bound of the distance of whole triangles to a surface (compiled).

The distance to one triangle is convex, so its maximum over another triangle is at one of that one's corners.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from vfix_engine.geometry.triangle_kernels import segment_triangle
from vfix_engine.kernels.compiled import compiled


@compiled
def _bounds(corners: Any, candidates: Any, vertices: Any, faces: Any, enough: float) -> Any:
    bounds = np.empty(corners.shape[0])
    for n in range(corners.shape[0]):
        least = np.inf
        for column in range(candidates.shape[1]):
            face = candidates[n, column]
            a, b, c = vertices[faces[face, 0]], vertices[faces[face, 1]], vertices[faces[face, 2]]
            farthest = 0.0
            for corner in range(3):
                p = corners[n, corner]
                squared = segment_triangle(
                    p[0], p[1], p[2], 0.0, 0.0, 0.0, a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]
                )[0]
                farthest = max(farthest, squared)
                if farthest >= least:
                    break
            least = min(least, farthest)
            if least <= enough * enough:
                break
        bounds[n] = np.sqrt(least)
    return bounds


def convex_bounds(
    corners: npt.NDArray[np.float64],
    candidates: npt.NDArray[np.int32],
    vertices: npt.NDArray[np.float64],
    faces: npt.NDArray[np.int32],
    enough_mm: float,
) -> npt.NDArray[np.float64]:
    """Upper bounds (n,) [mm] of the distance of every point of triangles to a mesh.

    Args:
        corners: (n, 3, 3) of the triangles. candidates: (n, m) faces of the mesh that may be nearest to each.
        vertices, faces: the mesh. enough_mm: a bound below this is not refined further.
    """
    found: npt.NDArray[np.float64] = _bounds(
        np.ascontiguousarray(corners), np.ascontiguousarray(candidates, dtype=np.int32), vertices, faces, enough_mm
    )
    return found
