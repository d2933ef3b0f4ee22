"""Points that were touched on a surface of the anatomy, as a registration keeps them, and what a refinement did."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Literal

from msgspec import Meta

from app.operations.fields import Place, StoredId
from app.registration.calibration_records import AtLeast0
from vfix_engine.errors import InputError

TouchedFrom = Literal["file", "simulated", "tracker"]
MAX_TOUCHED = 2_000


@dataclass(frozen=True)
class Refinement:
    """What a refinement on the touched points did, see `vfix_engine.registration.SurfaceRefinement`; mm.

    residual_mm: of the points that were kept; it is never the accuracy. kept: how many they were. moved_mm: largest
    displacement of a point by it. stability: 0 to 1, how much the surface resists the motion it resists least.
    """

    residual_mm: AtLeast0
    kept: Annotated[int, Meta(gt=0)]
    moved_mm: AtLeast0
    stability: AtLeast0


@dataclass(frozen=True)
class TouchedSurface:
    """Points touched on a structure of the case; in the frame that the registration is to, mm.

    structure: its id. refinement: None while the registration was not refined on them.
    """

    structure: StoredId
    points: Annotated[tuple[Place, ...], Meta(min_length=1, max_length=MAX_TOUCHED)]
    measured_from: TouchedFrom
    refinement: Refinement | None = None


def check_surface(surface: TouchedSurface | None) -> None:
    """Raises InputError for a refinement that kept more points than were touched."""
    if surface is not None and surface.refinement is not None and surface.refinement.kept > len(surface.points):
        raise InputError("a refinement keeps a number of the touched points, at most all.")


def unrefined(surface: TouchedSurface | None) -> TouchedSurface | None:
    """The touched points without what a refinement on them did, whose transform is not in use any more."""
    return None if surface is None else replace(surface, refinement=None)
