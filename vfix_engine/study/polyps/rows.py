"""Study I in the score of a run: Table III as rows that are shown, and the wall that was seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...geometry.mesh import TriangleMesh
from ...runtime.run import Run
from ...worlds.registry import spec_of
from ..lumen.task_rows import TaskRow, TaskScore
from .series import polyp_series, task_begun, task_of
from .sight import LumenSight
from .table import TableIII, table_iii


@dataclass(frozen=True)
class _Shown:
    """How a row of ``TableIII`` is shown."""

    key: str
    name: str
    unit: str = ""
    digits: int = 0


_ROWS = (
    _Shown("completion_time_s", "Completed in", "s", 1),
    _Shown("travelled_mm", "Tip's way per polyp", "mm"),
    _Shown("polyps_missed", "Polyps missed"),
    _Shown("distance_error_mm", "Distance error", "mm", 2),
    _Shown("angle_error_deg", "Angle error", "°", 1),
    _Shown("times_missed", "Views lost per polyp", "", 1),
    _Shown("deviations", "Deviations in the task"),
    _Shown("deviation_max_mm", "Deviation depth, largest", "mm", 1),
    _Shown("deviation_mean_mm", "Deviation depth, mean", "mm", 1),
    _Shown("deviation_time_mean_s", "Deviation time, mean", "s", 2),
    _Shown("deviation_time_max_s", "Deviation time, longest", "s", 1),
    _Shown("deviation_length_mm", "Tip's way deviated", "mm"),
)


def task_score(run: Run, wall: TriangleMesh | None) -> TaskScore | None:
    """The score of a run of study I; None for a run of none, or without the wall that lines of sight need.

    Raises InputError for a run whose task is damaged.
    """
    if wall is None or not task_begun(run):
        return None
    task, _ = task_of(run)
    spec: Any = spec_of(run)
    series = polyp_series(run, LumenSight(wall, task, spec.tissue))
    table = table_iii(series)
    count = len(task.polyps)
    result = f"{count - table.polyps_missed} of {count} polyps viewed"
    return TaskScore("Polyps", series.progress.completed, tuple(_row(table, shown) for shown in _ROWS), result)


def _row(table: TableIII, shown: _Shown) -> TaskRow:
    value = getattr(table, shown.key)
    missed = shown.key == "polyps_missed" and value > 0
    return TaskRow(shown.name, None if value is None else float(value), shown.unit, shown.digits, missed)
