"""What one step of control is asked to do, and what became of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..fixtures import Constraint, Objective, ToolState
from .explain import Blocker

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Task:
    """What one step is asked to do.

    objectives, constraints: rows of the task itself, without boundary and joints.
    scale: length L of the wanted step in mm; 0 means nothing is wanted.
    along: (n,) part of the wanted motion that each joint's motion makes; None: there is nothing to make a part of.
    accepts: further verdict on the predicted state, or None.
    compliance: in mm/N, see ``Situation``; None: gain · dt, where the objectives weigh the tip's motion with 1.
    begun: the wanted motion as a part of what the hand wishes, which it approaches with a bounded acceleration.
    """

    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    scale: float
    along: Array | None
    accepts: Callable[[ToolState], bool] | None = None
    compliance: float | None = None
    begun: float = 1.0

    def achieved(self, step: Array) -> float:
        """The part of the wanted motion that a joint step (n,) makes."""
        return 1.0 if self.along is None else float(self.along @ step)


class StepReport(NamedTuple):
    """What became of one step.

    outcome: 'idle' (nothing wanted), 'moved', 'shrunk' or 'held'; share: part of the wanted motion that was made.
    blockers: what made it less, strongest first; told where the share is under 0.9.
    emergency: a joint had to exceed its acceleration limit so that the tool keeps its distance.
    begun: the wanted motion as a part of the hand's wish, see ``Task``.
    told: gives every constraint that acts on the step, also where it costs little; to be asked before the next step.
    """

    state: ToolState
    outcome: str
    share: float
    blockers: tuple[Blocker, ...]
    rows: int
    emergency: bool = False
    told: Callable[[], tuple[Blocker, ...]] = tuple
    begun: float = 1.0

    def acting(self) -> tuple[Blocker, ...]:
        """What acts on the step, strongest first: a tool that slides along bone loses no motion and still touches."""
        return self.blockers or self.told()

    @property
    def held(self) -> bool:
        return self.outcome == "held"
