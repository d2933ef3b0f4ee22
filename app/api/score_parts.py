"""Parts of the answers on what a run is worth."""

from __future__ import annotations

from pydantic import BaseModel

Triple = tuple[float, float, float]
Numbers = list[float | None]


class MeanMaxPublic(BaseModel):
    """Over the samples."""

    mean: float
    max: float


class HeldPublic(BaseModel):
    """How long a constraint held the tool."""

    kind: str
    structure: str
    part: str
    time_s: float


class HoldPublic(BaseModel):
    """A time in which something held the tool, or touched it in a free hand (kind 'contact'); place in LPS mm.

    held_s: of duration_s without interruptions, which are up to 0.3 s each.
    """

    t_s: float
    duration_s: float
    held_s: float
    kind: str
    structure: str
    part: str
    reason: str
    place: Triple
    depth_mm: float
