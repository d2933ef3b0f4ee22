"""Weighted sums of tasks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from ...errors import InputError
from ...virtual_fixtures import StepState
from ..step_request import StepRequest, Task, completed, joined


@dataclass(frozen=True, eq=False)
class WeightedTasks:
    """Several tasks as one: the objectives of task i are weighted by w_i (Li 2007, eq. 3); all hard constraints hold.

    Args:
        parts: pairs (task, weight), the leading task first.

    Raises:
        InputError: there is no part, or a weight is not a finite number above 0.
    """

    parts: Sequence[tuple[Task, float]]

    def __post_init__(self) -> None:
        if not self.parts:
            raise InputError("a weighted sum needs at least one task")
        for part in self.parts:
            if not isinstance(part, (tuple, list)) or len(part) != 2:
                raise InputError(f"a weighted sum is made of pairs (task, weight), not of a {type(part).__name__}")
            weight = part[1]
            if not 0.0 < weight < float("inf"):
                raise InputError(f"a task's weight is {weight!r}; it must be a finite number above 0")
        object.__setattr__(self, "parts", tuple(self.parts))

    def request(self, state: StepState, command: Any) -> StepRequest:
        """Return all rows of all parts, see ``joined``."""
        return joined([_weighted(completed(task.request(state, command)), weight) for task, weight in self.parts])


def _weighted(request: StepRequest, weight: float) -> StepRequest:
    objectives = tuple(replace(o, weight=weight * o.weight) for o in request.objectives)
    constraints = tuple(
        c if c.penalty is None else replace(c, penalty=weight * c.penalty, price=weight * c.price)
        for c in request.constraints
    )
    return replace(request, objectives=objectives, constraints=constraints)
