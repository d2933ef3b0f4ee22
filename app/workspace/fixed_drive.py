"""What a trial of a study fixes of the drive of its plan."""

from __future__ import annotations

from dataclasses import dataclass

from vfix_engine.runtime.control_mode import Control

FIXED = "a trial of the study fixes mode, parameters, settings and limits; finish, skip or cancel it in Study."


@dataclass(frozen=True)
class FixedDrive:
    """preset: a paper's parameters, None for the plan's own."""

    plan_id: str
    control: Control
    preset: str | None
