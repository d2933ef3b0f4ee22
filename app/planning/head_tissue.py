"""The soft tissue of a head as a soft fixture: skin and mucosa of the CT, deeper at the nostril than behind it."""

from __future__ import annotations

import numpy as np

from app.planning.verdict import NOSTRIL_MM
from vfix_engine.errors import PlanError
from vfix_engine.geometry.path import SplinePath
from vfix_engine.proximity.fields.compact_field import compact_field
from vfix_engine.proximity.fields.distance_field import DistanceField
from vfix_engine.virtual_fixtures import DeeperPlace, SoftRegion

NAME = "soft tissue"
STIFFNESS_N_PER_MM = 0.5  # assumed
MAX_DEPTH_MM = 5.0  # of the tool's surface below that of skin or mucosa: assumed
NOSTRIL_DEPTH_MM = 8.0  # within 20 mm of the entry, where vestibule and rim of the nose give way: assumed
_AROUND_MM = 40.0  # how far around the fine grid the coarse one is kept
_LOWEST_MM, _HIGHEST_MM = -25.0, 12.0  # distances are clipped to this range: no tool is that thick


def tissue_region(field: DistanceField, path: SplinePath) -> SoftRegion:
    """Return the soft region of a plan's tissue along its path.

    field: distance to skin, mucosa and bone in mm, negative inside. Raises PlanError if it does not cover the path.
    """
    places = path.position(np.linspace(0.0, path.length, 200))
    if np.isnan(field.at(places)).all():
        raise PlanError(NOT_IN_SCAN)
    compact = compact_field(field, field.grids[0].bounds, _AROUND_MM, _LOWEST_MM, _HIGHEST_MM)
    deeper = DeeperPlace(path.position(0.0), NOSTRIL_MM, NOSTRIL_DEPTH_MM)
    return SoftRegion(NAME, compact, STIFFNESS_N_PER_MM, MAX_DEPTH_MM, deeper)


def tissue_words() -> str:
    """Return a description of the soft tissue fixture."""
    return f"soft tissue at most {MAX_DEPTH_MM:g} mm deep, {NOSTRIL_DEPTH_MM:g} mm at the nostril"


NOT_IN_SCAN = "the CT does not show the head along this path; switch the soft tissue off."
