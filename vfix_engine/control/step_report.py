"""What became of one step."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from ..virtual_fixtures import StepState
from .blockers import LimitingConstraint


class StepReport(NamedTuple):
    """What became of one step.

    outcome: 'idle' (nothing wanted), 'moved', 'shrunk' (part of the solution) or 'held'.
    share: part of the wanted motion that was made.
    blockers: what made it less, strongest first; known where the share is under 0.9.
    rows: inequality rows of its program; emergency: a joint, or a limit on acceleration, had to give way so that the
    tool keeps its distance.
    ramp_fraction: the wanted motion as a part of the hand's wish, see ``StepRequest``.
    """

    state: StepState
    outcome: str
    share: float
    blockers: tuple[LimitingConstraint, ...]
    rows: int
    emergency: bool = False
    explain: Callable[[], tuple[LimitingConstraint, ...]] = tuple
    ramp_fraction: float = 1.0

    def active_constraints(self) -> tuple[LimitingConstraint, ...]:
        """What acts on the step, strongest first: a tool that slides along bone loses no motion and still touches."""
        return self.blockers or self.explain()

    @property
    def held(self) -> bool:
        """Whether the hand pushes and the tool makes next to nothing of it."""
        return self.outcome == "held"
