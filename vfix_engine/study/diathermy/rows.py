"""Study II in the score of a run: the labels that were traced, and the means of Table IV over them."""

from __future__ import annotations

from ...geometry.mesh import TriangleMesh
from ...runtime.run import Run
from ..lumen.task_rows import TaskRow, TaskScore
from .table import measured, task_begun
from .task import table_iv

_MEANS = (
    ("time_s", "Time per label", "s", 1),
    ("angle_error_deg", "Angle error", "°", 2),
    ("line_error_mm", "Distance from the arrow", "mm", 2),
    ("distance_mm", "Way to a label", "mm", 0),
)


def task_score(run: Run, wall: TriangleMesh | None) -> TaskScore | None:
    """The score of a run of study II; None for a run of none. The task has no lines of sight, so no wall is needed.

    Raises InputError for a run whose task is damaged, or has no steps.
    """
    if not task_begun(run):
        return None
    state = measured(run).state
    missed = len(state.labels) - state.traced
    rows = [TaskRow("Labels traced", float(state.traced)), TaskRow("Labels missed", float(missed), worse=missed > 0)]
    for key, name, unit, digits in _MEANS:
        known = [row[key] for row in table_iv(state) if row[key] is not None]
        rows.append(TaskRow(name, float(sum(known)) / len(known) if known else None, unit, digits))
    result = f"{state.traced} of {len(state.labels)} labels traced"
    return TaskScore("Labels", state.done, tuple(rows), result=result)
