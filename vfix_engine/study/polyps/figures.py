"""The figures of a run of study I, for a score card or a command: Table III, and ours beside it."""

from __future__ import annotations

from typing import Any

from .placing import WallPlaces
from .seen import seen_share
from .series import PolypSeries
from .table import beyond_bound_mm, polyp_table, table_iii
from .task import LAST_MARK

ASSUMED = (
    "7 s without a break, as the paper prints only that the polyp was viewed for 7 s",
    "the aiming frame touches the circle of 20°; its size is not printed",
    "a polyp stands out 2 mm from the wall",
    "the marker's colour is linear in the worse of the errors of distance and angle",
    "deviation of the distal links counts as one, not for each link",
)


def polyp_figures(series: PolypSeries, places: WallPlaces) -> dict[str, Any]:
    """JSON's types; docs/lumen_tasks.md has the definitions.

    places: of the run's lumen, of which the share is counted that was seen.
    """
    task, progress = series.task, series.progress
    end = f"the landmark '{task.end_name}'" if task.end_name else f"the depth that the robot reaches; no '{LAST_MARK}'"
    return {
        "completed": progress.completed,
        "seed": task.seed,
        "polyps_cleared": progress.cleared,
        "of": len(task.polyps),
        "table_iii": table_iii(series).to_dict(),
        "beyond_bound_mm": beyond_bound_mm(series),
        "viewable_share": task.viewable_share,
        "seen_share": seen_share(series, places),
        "from_mm": task.from_mm,
        "end_mm": task.end_mm,
        "ends_at": end,
        "inserted_mm": float(series.tip_mm.max()),
        "polyps": polyp_table(series),
    }
