"""Where places of a route lie in its lumen: what an edit refuses, before anything is stored."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from app.kit.values import Position
from app.lumen.contours import RouteContour
from app.operations.operation import Context
from vfix_engine.arrays import Array
from vfix_engine.errors import InputError
from vfix_engine.proximity.fields.side import SurfaceSide
from vfix_engine.proximity.proximity import ProximityTree
from vfix_engine.validate import point_text

if TYPE_CHECKING:  # slow to load, as in `paths`
    from vfix_engine.pathway.hand_contours import EditedPathway

ENDS_OFF_MM = 6.0  # from the lumen: of an end; the search of the centreline takes 8 mm, less what a voxel hides
ENDS_APART_MM = 8.0  # at least: nearer ones lead to the same place of the centreline
CENTRE_OFF_MM = 1.0  # outside the wall: of a contour's centre
RIM_BEHIND_MM = 20.0  # the wall: of a contour's rim; a fold or a haustrum is not that deep
_SPOKES = 48  # of a circle


def wall_of(context: Context[Any, Any], case_id: str) -> ProximityTree:
    """The wall of a route's lumen; its first call takes up to seconds. Raises NotFound."""
    cases = context.service.cases
    found: ProximityTree = cases.tree(cases.get(case_id))
    return found


def check_end(name: str, place: Position, other: Position | None, wall: ProximityTree) -> None:
    """Refuse an end of a route that is not in the lumen, or where the other end is.

    Raises:
        InputError: it says how far off it is and what to do.
    """
    off = outside_mm(wall, np.array([place]), ENDS_OFF_MM)[0]
    if off > 0.0:
        raise InputError(
            f"the {name} {point_text(place)} lies {off:.0f} mm outside the lumen; at most {ENDS_OFF_MM:g} mm are "
            "possible. Click on its wall, or give a place in it, LPS mm."
        )
    if other is not None and (apart := math.dist(place, other)) < ENDS_APART_MM:
        raise InputError(
            f"entry and end would be {apart:.1f} mm apart, which is no way: set them at least {ENDS_APART_MM:g} mm "
            "apart. To go the other way, first put one of them at a third place."
        )


def check_contours(
    contours: Sequence[RouteContour], before: Sequence[RouteContour], edited: EditedPathway, wall: ProximityTree
) -> None:
    """Refuse contours by hand that are new since ``before`` and are not in the lumen.

    edited: the pathway with them; wall: of the lumen.

    Raises:
        InputError: the centre of one lies outside, or its rim far behind the wall; it says what to do.
    """
    for number, contour in enumerate(contours):
        here = np.flatnonzero(edited.of_hand == number)
        if len(here) and contour.radii_mm and contour not in before:
            _check_contour(contour, edited, int(here[0]), wall)


def _check_contour(contour: RouteContour, edited: EditedPathway, at: int, wall: ProximityTree) -> None:
    centre = edited.pathway.centre[at]
    off = outside_mm(wall, centre[None], CENTRE_OFF_MM)[0]
    if off > 0.0:
        raise InputError(
            f"the centre {point_text(centre)} of the contour lies {off:.0f} mm outside the lumen; put it inside its "
            "wall."
        )
    radii = np.resize(contour.radii_mm, _SPOKES) if len(contour.radii_mm) == 1 else np.array(contour.radii_mm)
    behind = outside_mm(wall, centre + radii[:, None] * _spokes(edited, at, len(radii)), RIM_BEHIND_MM)
    worst = int(behind.argmax())
    if behind[worst] > 0.0:
        to_wall = radii[worst] - behind[worst]
        do = f"About {to_wall:.0f} mm reach it." if to_wall >= 1.0 else "Its centre is at the wall: move it first."
        raise InputError(
            f"a radius of {radii[worst]:g} mm reaches {behind[worst]:.0f} mm behind the wall; at most "
            f"{RIM_BEHIND_MM:g} mm are possible. {do}"
        )


def _spokes(edited: EditedPathway, at: int, count: int) -> Array:
    """Unit vectors (count, 3) from a control contour's centre to its rim, at equal angles."""
    found = edited.pathway.contours()
    near = int(np.abs(found.s - edited.pathway.at_s[at]).argmin())
    first, second = found.first[near], np.cross(found.tangent[near], found.first[near])
    angle = 2.0 * np.pi * np.arange(count) / count
    spokes: Array = np.cos(angle)[:, None] * first + np.sin(angle)[:, None] * second
    return spokes


def outside_mm(wall: ProximityTree, places: Array, least_mm: float) -> Array:
    """How far places (n, 3) lie outside the wall, in mm; 0 within it, and for those that are no farther than so far."""
    distance: Array = wall.point_distance(places)[0]
    far = distance > least_mm
    found = np.zeros(len(places))
    if far.any():  # the normals of all corners take a while
        found[far] = np.where(SurfaceSide(wall).outside(places[far]), distance[far], 0.0)
    return found
