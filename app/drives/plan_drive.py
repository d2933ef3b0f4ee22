"""How a plan is driven: what a trial of a study fixes of it."""

from __future__ import annotations

from typing import NamedTuple

from vfix_engine.runtime.control_mode import Control


class PlanDrive(NamedTuple):
    """Mode and device; preset: a paper's parameters, None for the plan's own."""

    control: Control
    preset: str | None
