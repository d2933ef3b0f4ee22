"""Result of one step."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from ..virtual_fixtures import StepState
from .blockers import LimitingConstraint


class StepReport(NamedTuple):
    """Result of one step.

    outcome: 'idle' (no wanted motion), 'moved', 'shrunk' (a fraction of the solution) or 'held'.
    share: achieved fraction of the wanted motion.
    blockers: constraints that reduced it, strongest first; computed if the fraction is below 0.9.
    rows: inequality rows of the program; emergency: a joint limit or an acceleration limit was relaxed so that the tool
        keeps its distance.
    ramp_fraction: the wanted motion as a fraction of the hand's request, see ``StepRequest``.
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
        """Constraints active in the step, strongest first; a tool can slide along bone without loss of motion."""
        return self.blockers or self.explain()

    @property
    def held(self) -> bool:
        """Whether the hand pushes and the tool achieves almost none of the wanted motion."""
        return self.outcome == "held"
