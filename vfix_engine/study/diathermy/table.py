"""Table IV of Kwok 2013 from a recorded run of a snake on a fixed base."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arrays import Array, BoolArray
from ...errors import InputError
from ...robots.snake import SnakeModel
from ...runtime.command import BUTTON_CUT
from ...runtime.run import Run
from .labels import Label
from .task import DiathermySample, DiathermyState, first_state, stepped, table_iv


@dataclass(frozen=True, eq=False)
class DiathermyRun:
    """A run of the task.

    state: at its end. beyond_bound_mm: how far a link was beyond its bound at most, 0 where none was.
    way: (n, 3) mm of the last link's far end; red: (n,) where the tool was cutting (fig. 10d).
    """

    state: DiathermyState
    beyond_bound_mm: float
    way: Array
    red: BoolArray

    def to_dict(self) -> dict[str, Any]:
        """JSON's types only."""
        return {
            "labels_traced": self.state.traced, "of": len(self.state.labels), "labels": table_iv(self.state),
            "beyond_bound_mm": self.beyond_bound_mm,
        }  # fmt: skip


def measured(run: Run, labels: Sequence[Label]) -> DiathermyRun:
    """Measure a run, by its rows and commands alone.

    Raises:
        InputError: no run of a snake, or one without steps.
    """
    if not len(run.ticks):
        raise InputError("the run has no steps to measure")
    state, red = first_state(labels), np.zeros(len(run.ticks), dtype=bool)
    for number, sample in enumerate(samples_of(run)):
        state = stepped(labels, state, sample)
        red[number] = state.cutting
    beyond = max(float(run.column("beyond_bound").max()), 0.0)
    way = np.column_stack([run.column(f"tip_{axis}") for axis in "xyz"])
    return DiathermyRun(state, beyond, way, red)


def samples_of(run: Run) -> Iterator[DiathermySample]:
    """What the task sees of each step of a run.

    Raises:
        InputError: no run of a snake.
    """
    try:
        snake = SnakeModel(**run.manifest["spec"]["snake"])
    except (KeyError, TypeError) as error:
        raise InputError("the run is none of a snake") from error
    base = np.column_stack([run.column(f"base_{row}{column}") for row in range(3) for column in range(4)])
    q = np.column_stack([run.column(f"q{joint}") for joint in range(snake.dof)])
    t, frame = run.column("t"), np.eye(4)
    for number in range(len(run.ticks)):
        frame[:3] = base[number].reshape(3, 4)
        pressed = bool(run.command(number).buttons & BUTTON_CUT)
        yield DiathermySample(float(t[number]), snake.camera(q[number], frame), pressed)
