"""Study II in the score of a run: the labels that were traced, and the means of Table IV over them."""

from __future__ import annotations

from typing import Any

from ...anatomy.lumen.wall import Wall
from ...arrays import Array
from ...errors import InputError
from ...geometry.mesh import TriangleMesh
from ...runtime.run import Run
from ...worlds.registry import spec_of
from ...worlds.snake.cavity import cavity_case
from ..lumen.task_rows import TaskItem, TaskRow, TaskScore, begun_at
from ..polyps.task import surface_hash
from .labels import HALF_MM
from .live import LiveLabels
from .table import NOTE, measured, seed_of, surface_of, task_begun, task_of
from .task import DiathermyState, Sight, table_iv

_MEANS = (
    ("time_s", "Time per label", "s", 1),
    ("angle_error_deg", "Angle error", "°", 2),
    ("line_error_mm", "Distance from the arrow", "mm", 2),
    ("distance_mm", "Way to a label", "mm", 0),
)


_LACKING = "Labels are not scored: the cavity's surface is missing."
_NO_WALL = "the cavity's surface is missing, so when a label was traced is not known; open the case it was driven in"
_TITLE = "Labels"


def task_told(run: Run) -> dict[str, Any] | None:
    """The task of a run of study II, as ``study.lumen.task_rows.task_told``; None for a run of none.

    Raises InputError for a run whose task is damaged.
    """
    if not task_begun(run):
        return None
    labels, step = task_of(run)
    told = {"labels": [label.to_dict() for label in labels], "seed": seed_of(run), "surface": surface_of(run)}
    return {"study": NOTE, "title": _TITLE} | begun_at(run, step) | told


def task_score(run: Run, wall: TriangleMesh | None) -> TaskScore | None:
    """The score of a run of study II; None for a run of none.

    It needs the cavity's surface: the given wall if it is the one that the task was in, or the cavity that comes along
    if that is. Without either nothing is scored.

    Raises InputError for a run whose task is damaged, or has no steps.
    """
    if not task_begun(run):
        return None
    state, scored = _read(run, wall)
    missed = len(state.labels) - state.traced
    rows = [
        TaskRow("Labels traced", float(state.traced) if scored else None),
        TaskRow("Labels missed", float(missed) if scored else None, worse=scored and missed > 0),
    ]
    rows += [TaskRow(name, _mean(state, key), unit, digits) for key, name, unit, digits in _MEANS]
    result = f"{state.traced} of {len(state.labels)} labels traced" if scored else ""
    labels = state.labels if scored else ()
    items = tuple(
        TaskItem(f"Label {number}", one.done_s, 0.5 + 0.5 * one.end_mm / HALF_MM)
        for number, one in enumerate(labels, start=1)
    )
    return TaskScore(_TITLE, state.done, tuple(rows), lacking="" if scored else _LACKING, result=result, items=items)


def task_figures(run: Run, wall: TriangleMesh | None) -> dict[str, float | None] | None:
    """The labels that were traced and missed, and the means of Table IV over those traced, as ``label_…``; None for a
    run of no labels. Without the cavity's surface all of them are None.

    Raises InputError for a run whose task is damaged, or has no steps.
    """
    if not task_begun(run):
        return None
    state, scored = _read(run, wall)
    counts = {"labels_traced": state.traced, "labels_missed": len(state.labels) - state.traced}
    means = {f"label_{key}": _mean(state, key) for key, *_ in _MEANS}
    return {name: float(count) if scored else None for name, count in counts.items()} | means


def task_live(run: Run, wall: TriangleMesh | None) -> tuple[LiveLabels, int] | None:
    """The task of a run of study II before its first step, and the number of that step; None for a run of none.

    Raises InputError for a run whose task is damaged or has no steps, and where the cavity's surface is missing.
    """
    if not task_begun(run):
        return None
    labels, first = task_of(run)
    spec: Any = spec_of(run)
    sight = _sight(surface_of(run), wall)
    if first >= len(run.ticks) or getattr(spec, "snake", None) is None:
        raise InputError("the run has no steps of a snake that traces labels")
    if sight is None:
        raise InputError(_NO_WALL)
    return LiveLabels(labels, spec.snake, run.tick_columns, sight), first


def _read(run: Run, wall: TriangleMesh | None) -> tuple[DiathermyState, bool]:
    """The task at the end of a run, and whether its lines of sight are known."""
    sight = _sight(surface_of(run), wall)
    return measured(run, _nothing_seen if sight is None else sight).state, sight is not None


def _mean(state: DiathermyState, key: str) -> float | None:
    """Of a column of Table IV over the labels that have it."""
    known = [row[key] for row in table_iv(state) if row[key] is not None]
    return float(sum(known)) / len(known) if known else None


def _sight(surface: str | None, wall: TriangleMesh | None) -> Sight | None:
    """Lines of sight in the cavity with that hash; None where it is not at hand."""
    if surface is None:  # a run of before they were asked for
        return _all_seen
    if wall is None or surface_hash(wall) != surface:
        wall = cavity_case().mesh
    return Wall(wall).free if surface_hash(wall) == surface else None


def _all_seen(eye: Array, point: Array) -> bool:
    return True


def _nothing_seen(eye: Array, point: Array) -> bool:
    return False
