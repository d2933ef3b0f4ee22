"""How wide a lumen is along a curve, from its surface itself: the largest ball about a place of each cross-section."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, IntArray
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...proximity.fields.side import SurfaceSide
from ...proximity.proximity import ProximityTree

_DIRECTIONS = 16  # in a cross-section
_MARCHES = 12  # steps of a ray: each nearly as long as the ball about its place, which lies in the lumen
_STEP = 0.95  # of the ball's radius
_CLOSE_MM = 0.02  # a search ends when its steps are no longer
_ROUNDS = 40
_TURN = 2.399963  # rad, golden angle: no direction is left out round after round
_REACH = 1.5  # of what is enough: no farther from the curve is a wider place one that a robot along it comes through
_BACK_MM = 0.5  # a centre behind the wall starts that far before it


def free_radius(mesh: TriangleMesh, curve: Curve, s: Array, enough_mm: float) -> Array:
    """The radius of the largest ball that fits into the lumen about a place of the curve's cross-section.

    First the distance of the curve itself to the triangles. Only where that is less than enough, the cross-section is
    searched for a wider place: rays from the curve, then steps uphill from the best place on them. Every step stays
    within the ball about its start, so no wall is ever crossed. Wall behind the planes of the curve's ends does not
    count: a robot comes in through the one, and the lumen may be closed close behind the other.

    Args:
        mesh: the lumen's surface, mm. curve: through the lumen.
        s: (n,) arc lengths of the curve, mm. enough_mm: from which on nobody asks.

    Returns:
        (n,) mm, infinite where it is ``enough_mm`` or more, 0 where the curve is behind the wall with no way back.
    """
    tree = ProximityTree(mesh)
    centre, tangent = curve.position(s), curve.tangent(s)
    distance, closest, _ = tree.point_distance(centre)
    short = np.flatnonzero(distance < enough_mm)
    found = np.full(len(s), np.inf)
    behind = _behind(tree, centre, short)
    # A curve may touch a soft wall: the search starts on the wall's inner side.
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
    """The surface without what lies behind the planes of the curve's ends."""
    kept = np.ones(len(mesh.faces), dtype=bool)
    for wanted, place, inward in ((begin, 0, curve.tangents[0]), (end, -1, -curve.tangents[-1])):
        if wanted:
            kept &= ((mesh.vertices - curve.points[place]) @ inward >= 0.0)[mesh.faces].any(axis=1)
    return ProximityTree(TriangleMesh(mesh.vertices, mesh.faces[kept]))


def _largest(tree: ProximityTree, start: Array, tangent: Array, enough_mm: float) -> Array:
    """(n,) mm, the largest ball about a place of each cross-section, infinite from ``enough_mm`` on."""
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
    """Rays from every place to the wall, ball by ball: each place becomes the one with the largest ball on its rays."""
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
    """The balls' radii (n, m) at places (n, m, 3); 0 farther from the start (n, 3) than ``reach_mm``."""
    found = tree.point_distance(places.reshape(-1, 3))[0].reshape(places.shape[:-1])
    return np.where(np.linalg.norm(places - start[:, None], axis=2) <= reach_mm, found, 0.0)


def _behind(tree: ProximityTree, points: Array, rows: IntArray) -> IntArray:
    """Those of the rows whose points are behind the wall; most of a curve is not, whichever way triangles are wound."""
    side = SurfaceSide(tree).outside(points)
    outside = side if side.mean() <= 0.5 else ~side
    return rows[outside[rows]]
