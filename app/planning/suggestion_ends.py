"""Checks of the entry and target of a path search before it starts; LPS mm."""

from __future__ import annotations

import numpy as np

from app.cases.model import Case
from app.kit.values import Position
from app.planning.distance_fields import OUTSIDE_MM
from vfix_engine.errors import PlanError
from vfix_engine.suggestion import LONGEST_MM

NEAREST_MM = 2.0  # least distance between the ends of a path


def check_ends(case: Case, entry: Position, target: Position) -> None:
    """Raise PlanError for ends too near to each other, too far apart, or outside of what is known of the head."""
    for what, place in (("entry", entry), ("target", target)):
        _check_known(case, what, place)
    apart = float(np.linalg.norm(np.subtract(target, entry)))
    if apart < NEAREST_MM:
        raise PlanError(
            f"entry and target are {apart:.1f} mm apart; a path needs {NEAREST_MM:g} mm at least. Put the entry into a "
            "nostril and the target where the tip is to go."
        )
    if apart > LONGEST_MM:
        raise PlanError(
            f"entry and target are {apart:.0f} mm apart; a way is up to {LONGEST_MM:g} mm long. Move them nearer to "
            "each other, and check that they are in mm."
        )


def _check_known(case: Case, what: str, place: Position) -> None:
    if case.has_volume:
        boxes, around, shown = [one.bounds_lps_mm for one in case.volumes], 0.0, "outside of the scan"
    else:
        boxes, around = [one.bounds_lps_mm for one in case.surfaces], OUTSIDE_MM
        shown = f"more than {OUTSIDE_MM:g} mm from the surface of the head"
    at = np.asarray(place)
    if not any((at >= np.array(low) - around).all() and (at <= np.array(high) + around).all() for low, high in boxes):
        low, high = np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)
        reach = "; ".join(f"{axis} {a:.0f} to {b:.0f}" for axis, a, b in zip("xyz", low, high, strict=True))
        raise PlanError(
            f"the {what} lies {shown}, which spans {reach} mm (LPS). Move it to a place that is seen there."
        )
