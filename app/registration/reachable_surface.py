"""Places of a surface that a straight pointer reaches from outside."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from app.kit.values import Position
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.proximity.proximity import Proximity

_BESIDE_RAD = 0.9  # between the directions, seen from the middle of the surface, of a fiducial and of a place by it
_SPARE = 8  # directions that are tried for each place: some pass by, some are not near a fiducial
_NEAR_MM = 1e-3  # of the surface: the pointer touches it
_MOST_STEPS = 400


def reachable_places(
    tree: Proximity, near: Sequence[Position], count: int, seed: int | Sequence[int] | None = None
) -> Array:
    """Places (count, 3) on a surface, each the first that a pointer meets on its way to the middle of the surface.

    near: fiducials; the pointer comes from sides where some are, from all sides without one. seed: of the places, None
    for others each time.

    Raises InputError where the surface cannot be met at so many.
    """
    low, high = tree.mesh.bounds
    middle, random = (low + high) / 2.0, np.random.default_rng(seed)
    directions = random.standard_normal((_SPARE * count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    if near:
        sides = np.array(near, float) - middle
        sides /= np.maximum(np.linalg.norm(sides, axis=1, keepdims=True), 1e-12)
        directions = directions[(directions @ sides.T).max(axis=1) >= np.cos(_BESIDE_RAD)]
    begin = middle + directions * (np.linalg.norm(high - low) / 2.0 + 1.0)
    places = _met(tree, begin, -directions, float(np.linalg.norm(high - low)))
    if len(places) < count:
        raise InputError(f"the simulated pointer reaches {len(places)} places only, not {count}; ask for fewer.")
    return places[:count]


def _met(tree: Proximity, begin: Array, directions: Array, longest_mm: float) -> Array:
    """The first places of the surface along rays; a ray that has met nothing after so many mm is left out.

    Each ray goes on by the distance to the surface, which it cannot pass so.
    """
    at, gone, met = begin.copy(), np.zeros(len(begin)), list[tuple[int, Array]]()
    left = np.arange(len(begin))
    for _ in range(_MOST_STEPS):
        if not len(left):
            break
        distance, closest, _triangle = tree.point_distance(at[left])
        touches = distance < _NEAR_MM
        met += zip(left[touches].tolist(), closest[touches], strict=True)
        gone[left] += distance
        at[left] += distance[:, None] * directions[left]
        left = left[~touches & (gone[left] < longest_mm)]
    return np.array([place for _, place in sorted(met, key=lambda one: one[0])]).reshape(-1, 3)
