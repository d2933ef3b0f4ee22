"""Least-squares rigid fits of many sets of point pairs at once.

Source: Arun, Huang & Blostein 1987, *Least-squares fitting of two 3-D point sets*, with reflections excluded as in
Umeyama 1991. Arguments are validated in ``points.py``, not here.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array


def rigid_fits(fixed: Array, moving: Array, weights: Array) -> tuple[Array, Array]:
    """Rotations (k, 3, 3) and translations (k, 3) that minimise Σ w ‖fixed − R moving − t‖² for each of k sets.

    Args:
        fixed, moving: (k, n, 3) in mm; either may be (1, n, 3).
        weights: (k, n) or (n,), with a positive sum.
    """
    share = weights / weights.sum(axis=-1, keepdims=True)
    centre_fixed = np.einsum("...n,...ni->...i", share, fixed)
    centre_moving = np.einsum("...n,...ni->...i", share, moving)
    about_fixed, about_moving = fixed - centre_fixed[..., None, :], moving - centre_moving[..., None, :]
    u, _, vt = np.linalg.svd(np.einsum("...n,...ni,...nj->...ij", share, about_moving, about_fixed))
    v, ut = np.swapaxes(vt, -1, -2), np.swapaxes(u, -1, -2)
    guard = np.broadcast_to(np.eye(3), u.shape).copy()
    guard[..., 2, 2] = np.sign(np.linalg.det(v @ ut))  # excludes reflections, e.g. for coplanar points
    rotations = v @ guard @ ut
    return rotations, centre_fixed - np.einsum("...ij,...j->...i", rotations, centre_moving)


def residual_lengths(fixed: Array, moving: Array, rotations: Array, translations: Array) -> Array:
    """Lengths (k, n) in mm of fixed − R moving − t."""
    placed = np.einsum("...ij,...nj->...ni", rotations, moving) + translations[..., None, :]
    lengths: Array = np.linalg.norm(fixed - placed, axis=-1)
    return lengths
