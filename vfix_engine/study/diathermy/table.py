"""Table IV of Kwok 2013 from a recorded run of a snake on a fixed base."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arrays import Array, BoolArray
from ...errors import InputError
from ...robots.snake import SnakeModel
from ...runtime.command import BUTTON_CUT
from ...runtime.requests import Note, Reset
from ...runtime.run import Run
from .labels import Label
from .task import DiathermySample, DiathermyState, Sight, first_state, stepped, table_iv

NOTE = "kwok2"  # kind of the note with which the task begins


def task_begun(run: Run) -> bool:
    """Whether a task of study II began in a run."""
    return any(isinstance(event.content, Note) and event.content.kind == NOTE for event in run.events)


def task_note(labels: Sequence[Label], seed: int | None, surface: str) -> Note:
    """The request that records the beginning of the task in a run. surface: ``surface_hash`` of the cavity."""
    return Note(NOTE, {"seed": seed, "labels": [label.to_dict() for label in labels], "surface": surface})


@dataclass(frozen=True, eq=False)
class DiathermyRun:
    """A run from the beginning of its task on, n steps.

    labels: of the task; state: at its end. beyond_bound_mm: how far a link was beyond its bound at most, 0 for none.
    way: (n, 3) mm of the last link's far end; red: (n,) where the tool was cutting (fig. 10d).
    """

    labels: tuple[Label, ...]
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


def measured(run: Run, sight: Sight) -> DiathermyRun:
    """Measure a run from its last note of the task, or the last reset after it that steps follow.

    sight: in the cavity of the run.

    Raises:
        InputError: no run of a snake, one without the task, or without steps in it.
    """
    labels, start = task_of(run)
    if start >= len(run.ticks):
        raise InputError("the run has no steps to measure")
    state, red = first_state(labels), np.zeros(len(run.ticks) - start, dtype=bool)
    for number, sample in enumerate(samples_of(run, start)):
        state = stepped(labels, state, sample, sight)
        red[number] = state.cutting
    beyond = max(float(run.column("beyond_bound")[start:].max()), 0.0)
    way = np.column_stack([run.column(f"tip_{axis}")[start:] for axis in "xyz"])
    return DiathermyRun(labels, state, beyond, way, red)


def surface_of(run: Run) -> str | None:
    """``surface_hash`` of the cavity that a run's last task was in; None in a run of before it was kept."""
    surface = _noted(run).get("surface")
    return None if surface is None else str(surface)


def seed_of(run: Run) -> int | None:
    """By which the labels of a run's last task were drawn; None where they were not."""
    seed = _noted(run).get("seed")
    return seed if isinstance(seed, int) else None


def _noted(run: Run) -> Mapping[str, Any]:
    """What the note of a run's last task says; nothing of a run without one."""
    notes = [event.content for event in run.events if isinstance(event.content, Note) and event.content.kind == NOTE]
    return notes[-1].content if notes else {}


def task_of(run: Run) -> tuple[tuple[Label, ...], int]:
    """The labels of a run, and the number of steps before its task.

    Raises:
        InputError: the run has no such task, or one that is damaged.
    """
    labels: tuple[Label, ...] | None = None
    start = 0
    for event in run.events:
        content = event.content
        if isinstance(content, Note) and content.kind == NOTE:
            labels, start = _labels(content.content), event.at
        elif isinstance(content, Reset) and event.at < len(run.ticks):  # steps follow it
            start = event.at
    if labels is None:
        raise InputError("the run has no task of study II: it has no note of its labels")
    return labels, start


def _labels(content: Mapping[str, Any]) -> tuple[Label, ...]:
    try:
        return tuple(Label.from_dict(one) for one in content["labels"])
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"the labels of the run cannot be read: {error}") from error


def samples_of(run: Run, start: int = 0) -> Iterator[DiathermySample]:
    """What the task sees of each step of a run from ``start`` on.

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
    for number in range(start, len(run.ticks)):
        frame[:3] = base[number].reshape(3, 4)
        pressed = bool(run.command(number).buttons & BUTTON_CUT)
        yield DiathermySample(float(t[number]), snake.camera(q[number], frame), pressed)
