"""Models of refinements on a surface in the API."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from app.api.dependencies import Number, RequestBody
from app.registration.refining import DEFAULT_COUNT, KEEP
from app.registration.simulated_touch import DEFAULT_NOISE_MM
from app.registration.touched_surface import MAX_TOUCHED
from app.registration.tracked_tip import LONGEST_S

StructureId = Annotated[str | None, Field(min_length=1, max_length=64)]
Seconds = Annotated[float, Field(gt=0.0, le=LONGEST_S, allow_inf_nan=False, strict=True)]


class SurfaceTouchRequest(RequestBody):
    """Places that the simulated pointer touches. structure: null for that which the case is driven in.

    noise_mm: rms length of its error; seed: of places and errors, null for new ones.
    """

    structure: StructureId = None
    count: Annotated[int, Field(ge=1, le=MAX_TOUCHED, strict=True)] = DEFAULT_COUNT
    noise_mm: Number = DEFAULT_NOISE_MM
    seed: Annotated[int | None, Field(ge=0, lt=2**63, strict=True)] = None


class RefineRequest(RequestBody):
    """keep: share of the touched points that are fitted, 0.5 to 1; the others are taken for slips of the pointer."""

    keep: Number = KEEP
