"""Patches: parts of a surface as meshes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError
from ..kernels.compiled import compiled
from .mesh import TriangleMesh
from .triangle_kernels import segment_triangle


def patch_around(mesh: TriangleMesh, centre: ArrayLike, radius_mm: float) -> TriangleMesh:
    """Return the triangles with any point within ``radius_mm`` of ``centre`` (3,), mm; triangles are not cut.

    Raises:
        InputError: no triangle is that near, the centre or radius is not finite, or the radius is not positive.
    """
    try:
        middle = np.array(centre, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError("a patch's centre must be three numbers in mm") from error
    if middle.shape != (3,) or not np.isfinite(middle).all():
        raise InputError(f"a patch's centre must be three finite numbers in mm, not {middle.tolist()}")
    if not 0.0 < radius_mm < np.inf:
        raise InputError(f"a patch's radius is {radius_mm:g} mm; it must be positive")
    gap = _distances(mesh.triangles.reshape(-1, 9), middle)
    near = gap <= radius_mm
    if not near.any():
        raise InputError(
            f"no part of the surface is within {radius_mm:g} mm of the patch's centre, "
            f"the nearest is {gap.min():.1f} mm away"
        )
    return patch_of(mesh, near)


def patch_of(mesh: TriangleMesh, chosen: ArrayLike) -> TriangleMesh:
    """Return selected triangles of a mesh, by a boolean mask (F,) or indices (n,) of faces.

    Raises:
        InputError: the selection is empty, the mask has another length, or an index is out of range.
    """
    faces = np.asarray(chosen)
    if faces.dtype == np.bool_:
        if faces.shape != (len(mesh.faces),):
            raise InputError(f"a mask needs one value for each of {len(mesh.faces)} triangles, not {faces.shape}")
        faces = np.flatnonzero(faces)
    if faces.ndim != 1 or faces.dtype.kind not in "iu":
        raise InputError("triangles are chosen by a mask or by their indices")
    if len(faces) == 0:
        raise InputError("a patch has at least one triangle")
    if faces.min() < 0 or faces.max() >= len(mesh.faces):
        raise InputError(f"triangles {faces.min()} to {faces.max()} were chosen of {len(mesh.faces)}")
    used, corners = np.unique(mesh.faces[faces], return_inverse=True)
    return TriangleMesh(mesh.vertices[used], corners.reshape(-1, 3))


@compiled
def _distances(corners: Array, point: Array) -> Array:
    """Distance (F,) from one point to every triangle (F, 9)."""
    gap = np.empty(len(corners))
    for i in range(len(corners)):
        c = corners[i]
        gap[i] = np.sqrt(
            segment_triangle(
                point[0], point[1], point[2], 0.0, 0.0, 0.0, c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8]
            )[0]
        )
    return gap
