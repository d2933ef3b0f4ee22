"""Study I in the score of a run: Table III as rows that are shown, and the wall that was seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...anatomy.lumen.colon_case import colon_case
from ...arrays import Array
from ...errors import InputError
from ...geometry.mesh import TriangleMesh
from ...runtime.run import Run
from ...worlds.registry import spec_of
from ..lumen.task_rows import TaskItem, TaskRow, TaskScore, begun_at
from .live import LiveProgress
from .series import NOTE, PolypSeries, polyp_series, task_begun, task_of
from .sight import LumenSight
from .table import TableIII, table_iii
from .task import PolypTask, surface_hash


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


_BY_SIGHT = ("polyps_missed", "distance_error_mm", "angle_error_deg", "times_missed")
_LACKING = "Views are not scored: the lumen's surface is missing."
_NO_WALL = "the lumen's surface is missing, so when a polyp was viewed is not known; open the case it was driven in"
_TITLE = "Polyps"


def task_told(run: Run) -> dict[str, Any] | None:
    """The task of a run of study I, as ``study.lumen.task_rows.task_told``; None for a run of none.

    Raises InputError for a run whose task is damaged.
    """
    if not task_begun(run):
        return None
    task, step = task_of(run)
    return {"study": NOTE, "title": _TITLE} | begun_at(run, step) | task.to_dict()


def task_score(run: Run, wall: TriangleMesh | None) -> TaskScore | None:
    """The score of a run of study I; None for a run of none.

    The rows of what was viewed need the lumen's surface: the given wall if it is the one that the task was in, or the
    synthetic colon that is, made again. Without either they are None. That the task was completed follows from the tip.

    Raises InputError for a run whose task is damaged.
    """
    if not task_begun(run):
        return None
    series, seen = _read(run, wall)
    table = table_iii(series)
    rows = tuple(_row(table, shown, seen or shown.key not in _BY_SIGHT) for shown in _ROWS)
    count = len(series.task.polyps)
    result = f"{count - table.polyps_missed} of {count} polyps viewed" if seen else ""
    lacking = "" if seen else _LACKING
    viewings = series.progress.viewings if seen else ()
    items = tuple(
        TaskItem(f"Polyp {number}", one.cleared_t, 0.0 if one.cleared_t is None else 1.0)
        for number, one in enumerate(viewings, start=1)
    )
    return TaskScore(_TITLE, series.progress.completed, rows, lacking=lacking, result=result, items=items)


def task_figures(run: Run, wall: TriangleMesh | None) -> dict[str, float | None] | None:
    """Table III of a run by name, without what was viewed where the surface is missing; None for a run of no polyps.

    Raises InputError for a run whose task is damaged.
    """
    if not task_begun(run):
        return None
    series, seen = _read(run, wall)
    figures = table_iii(series).to_dict()
    return {name: value if seen or name not in _BY_SIGHT else None for name, value in figures.items()}


def task_live(run: Run, wall: TriangleMesh | None) -> tuple[LiveProgress, int] | None:
    """The task of a run of study I before its first step, and the number of that step; None for a run of none.

    Raises InputError for a run whose task is damaged or has no steps, and where the lumen's surface is missing.
    """
    if not task_begun(run):
        return None
    task, first = task_of(run)
    spec: Any = spec_of(run)
    surface = _surface(task, wall)
    if first >= len(run.ticks) or getattr(spec, "snake", None) is None:
        raise InputError("the run has no steps of a snake that looks for polyps")
    if surface is None:
        raise InputError(_NO_WALL)
    sight = LumenSight(surface, task, spec.tissue)
    return LiveProgress(task, spec.snake, spec.tissue, run.tick_columns, sight), first


def _read(run: Run, wall: TriangleMesh | None) -> tuple[PolypSeries, bool]:
    """The series of a run, and whether its lines of sight are known."""
    task, _ = task_of(run)
    spec: Any = spec_of(run)
    surface = _surface(task, wall)
    sight = _unseen if surface is None else LumenSight(surface, task, spec.tissue)
    return polyp_series(run, sight), surface is not None


def _surface(task: PolypTask, wall: TriangleMesh | None) -> TriangleMesh | None:
    """The surface that the task was in."""
    if task.surface is None or (wall is not None and surface_hash(wall) == task.surface):
        return wall
    colons = (colon_case(hard=hard).mesh for hard in (False, True))
    return next((mesh for mesh in colons if surface_hash(mesh) == task.surface), None)


def _unseen(eye: Array, index: int, t: float) -> bool:
    return False


def _row(table: TableIII, shown: _Shown, known: bool) -> TaskRow:
    value: float | None = getattr(table, shown.key) if known else None
    missed = shown.key == "polyps_missed" and value is not None and value > 0
    return TaskRow(shown.name, None if value is None else float(value), shown.unit, shown.digits, missed)
