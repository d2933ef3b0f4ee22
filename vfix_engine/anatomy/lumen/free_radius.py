"""Free radius of a lumen along a curve, from its surface: the largest ball centred in each cross-section."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, IntArray
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...proximity.fields.side import SurfaceSide
from ...proximity.proximity import ProximityTree

_DIRECTIONS = 16  # in a cross-section
_MARCHES = 12  # steps of a ray (sphere tracing): each nearly as long as the radius of the ball at its start
_STEP = 0.95  # of the ball's radius
_CLOSE_MM = 0.02  # smallest step, at which a search ends
_ROUNDS = 40
_TURN = 2.399963  # rad, golden angle: successive rounds cover all directions
_REACH = 1.5  # of ``enough_mm``: a robot that follows the curve passes no point of the cross-section further away
_BACK_MM = 0.5  # distance in front of the wall at which the search starts for a centre behind it


def free_radius(mesh: TriangleMesh, curve: Curve, s: Array, enough_mm: float) -> Array:
    """Radius of the largest ball that fits into the lumen with its centre in the curve's cross-section.

    First the distance of the curve itself to the triangles is measured. Only if that is not enough, the cross-section
    is searched for a wider point: by rays from the curve, then by steps uphill from the best point on them. Every step
    stays within the ball around its start, so no wall is ever crossed. Wall behind the planes of the curve's ends is
    ignored: a robot enters through the one, and the lumen may be closed shortly behind the other.

    Args:
        mesh: the lumen's surface, mm. curve: through the lumen.
        s: (n,) arc lengths of the curve, mm. enough_mm: radius above which the exact value does not matter.

    Returns:
        (n,) mm, infinite from ``enough_mm`` on, 0 where the curve is behind the wall and cannot be moved back.
    """
    tree = ProximityTree(mesh)
    centre, tangent = curve.position(s), curve.tangent(s)
    distance, closest, _ = tree.point_distance(centre)
    short = np.flatnonzero(distance < enough_mm)
    found = np.full(len(s), np.inf)
    behind = _behind(tree, centre, short)
    # A curve can touch a soft wall: the search starts on the wall's inner side.
    start = centre.copy()
    back = closest[behind] - centre[behind]
    start[behind] += (1.0 + _BACK_MM / np.maximum(distance[behind], _CLOSE_MM))[:, None] * back
    found[behind] = 0.0
    lost = behind[np.isin(behind, _behind(tree, start, behind))] if len(behind) else behind
    short = np.setdiff1d(short, lost)
    begins, ends = s < enough_mm, curve.length - s < enough_mm
    for begin, end in ((False, False), (True, False), (False, True), (True, True)):
        rows = short[(begins[short] == begin) & (ends[short] == end)]
        if len(rows):
            ball = _opened(mesh, curve, begin, end) if begin or end else tree
            found[rows] = _largest(ball, start[rows], tangent[rows], enough_mm)
    return found


def _opened(mesh: TriangleMesh, curve: Curve, begin: bool, end: bool) -> ProximityTree:
    """Remove the part of the surface behind the planes of the curve's ends."""
    kept = np.ones(len(mesh.faces), dtype=bool)
    for wanted, place, inward in ((begin, 0, curve.tangents[0]), (end, -1, -curve.tangents[-1])):
        if wanted:
            kept &= ((mesh.vertices - curve.points[place]) @ inward >= 0.0)[mesh.faces].any(axis=1)
    return ProximityTree(TriangleMesh(mesh.vertices, mesh.faces[kept]))


def _largest(tree: ProximityTree, start: Array, tangent: Array, enough_mm: float) -> Array:
    """Radius (n,) in mm of the largest ball centred in each cross-section, infinite from ``enough_mm`` on."""
    first = np.cross(tangent, np.eye(3)[np.abs(tangent).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    plane = np.stack([first, np.cross(tangent, first)], axis=1)
    place, found = start.copy(), tree.point_distance(start)[0]
    _march(tree, plane, place, found, enough_mm)
    step = found.copy()
    for turn in range(_ROUNDS):
        open_ = np.flatnonzero((found < enough_mm) & (step > _CLOSE_MM))
        if not len(open_):
            break
        tried = place[open_, None] + step[open_, None, None] * _STEP * _around(plane[open_], turn * _TURN)
        ball = _balls(tree, tried, start[open_], _REACH * enough_mm)
        best = ball.argmax(axis=1)
        rows = np.arange(len(open_))
        better = ball[rows, best] > found[open_]
        up = open_[better]
        place[up], found[up] = tried[rows, best][better], ball[rows, best][better]
        step[up] = np.minimum(step[up], found[up])
        step[open_[~better]] *= 0.5
    return np.where(found >= enough_mm, np.inf, found)


def _march(tree: ProximityTree, plane: Array, place: Array, found: Array, enough_mm: float) -> None:
    """Trace rays from every point to the wall, ball by ball; replace each point by the one with the largest ball."""
    around, start = _around(plane, 0.0), place.copy()
    at, ball = np.repeat(place[:, None], _DIRECTIONS, axis=1), np.repeat(found[:, None], _DIRECTIONS, axis=1)
    for _ in range(_MARCHES):
        open_ = np.flatnonzero(found < enough_mm)
        if not len(open_):
            return
        at[open_] += _STEP * ball[open_, :, None] * around[open_]
        ball[open_] = _balls(tree, at[open_], start[open_], _REACH * enough_mm)
        best = ball[open_].argmax(axis=1)
        larger = ball[open_, best] > found[open_]
        up = open_[larger]
        place[up], found[up] = at[up, best[larger]], ball[up, best[larger]]


def _around(plane: Array, turn: float) -> Array:
    """Unit directions (n, _DIRECTIONS, 3) in planes (n, 2, 3)."""
    psi = turn + 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    directions: Array = np.cos(psi)[:, None] * plane[:, None, 0] + np.sin(psi)[:, None] * plane[:, None, 1]
    return directions


def _balls(tree: ProximityTree, places: Array, start: Array, reach_mm: float) -> Array:
    """Radii (n, m) of the balls at points (n, m, 3); 0 farther from the start (n, 3) than ``reach_mm``."""
    found = tree.point_distance(places.reshape(-1, 3))[0].reshape(places.shape[:-1])
    return np.where(np.linalg.norm(places - start[:, None], axis=2) <= reach_mm, found, 0.0)


def _behind(tree: ProximityTree, points: Array, rows: IntArray) -> IntArray:
    """Select rows whose points are behind the wall; most of a curve is not, which determines the orientation."""
    side = SurfaceSide(tree).outside(points)
    outside = side if side.mean() <= 0.5 else ~side
    return rows[outside[rows]]
