"""Requests that only the rigid tool has."""

from __future__ import annotations

from dataclasses import dataclass

from ...runtime.requests import Request


@dataclass(frozen=True)
class ApproachPoint(Request):
    """Follow the path, and first approach its point at the arc length ``at_mm``, on a straight line (Li 2004, V).

    Without it the path's point nearest to the tip is approached, and only by a tip that is off the path.
    """

    at_mm: float
