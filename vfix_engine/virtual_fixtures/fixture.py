"""The protocol of a virtual fixture: rows for one step, and a check of the predicted state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..proximity.pairs import Pairs
from ..proximity.proximity import Proximity
from ..robots import RobotModel, Tool
from .rows import Constraint, Objective
from .state import StepState
from .stopping import approach_bounds


@dataclass(frozen=True, eq=False)
class Situation:
    """The inputs of a fixture in one step; patient frame.

    state: joints, tip and segments before the step.
    pairs: N closest pairs of the tool and the obstacles that can be active in this step, nearest first.
    body: (N,) index of the obstacle of each pair: 0 the anatomy, then the zones.
    dt_s: control period in s.
    scale_mm: length of the step that the command asks for.
    compliance_mm_per_n: weight of a force in the task's objectives; a force F opposed to the motion adds
        −compliance · F · ΔP to them.
    anatomy: surface of obstacle 0, for fixtures that query distances themselves; the controller always sets it.
    deceleration_mm_per_s2: deceleration before a boundary, see ``stop_before``.
    """

    state: StepState
    pairs: Pairs
    body: NDArray[np.int32]
    robot: RobotModel
    tool: Tool
    dt_s: float
    scale_mm: float
    compliance_mm_per_n: float
    anatomy: Proximity | None = None
    deceleration_mm_per_s2: float = 300.0

    def stop_before(self, slack: ArrayLike) -> NDArray[np.float64]:
        """Return bounds (m,) in mm of rows that approach a limit, such that the tool can stop before it.

        A row a·Δq ≤ slack allows all of the slack in one step, after which the tool cannot stop in time. The bound
        returned here is the longest step after which it can (``stopping.approach_bound``).

        Args:
            slack: (m,) distance to each limit in mm; negative beyond it, where the bound asks for a retreat.
        """
        slacks = np.atleast_1d(np.asarray(slack, dtype=np.float64))
        return approach_bounds(slacks, self.deceleration_mm_per_s2 * self.dt_s**2)


@dataclass(frozen=True)
class Rows:
    """Contribution of a fixture to one program; either part may be empty."""

    objectives: tuple[Objective, ...] = ()
    constraints: tuple[Constraint, ...] = ()


class Fixture(Protocol):
    """A virtual fixture; any number of them act together in one program (Li 2007, eq. 1-5)."""

    def rows(self, now: Situation) -> Rows:
        """Objective and constraint rows over (Δq, λ) for this step."""

    def is_admissible(self, before: StepState, after: StepState) -> bool:
        """Whether the fixture allows the predicted state ``after``; False refuses the motion.

        A fixture that a start can violate has ``refuse_start(state, parts)``, which raises StartRefused; one with
        compiled code has ``warm_up``, which loads it.
        Soft fixtures always return True. A refusal is described by ``words`` if the fixture has them.
        """
