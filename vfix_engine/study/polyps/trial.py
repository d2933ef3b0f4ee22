"""Study I without a clock: the operator that knows where the polyps are does the task, and its run is measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ...geometry.mesh import TriangleMesh
from ...runtime.run import Run, RunWriter
from ...snake.conform.conforming import driven_curve
from ...worlds.snake.offline.script import DriveSpec
from ...worlds.snake.offline.snake_drive import SnakeDrive
from ...worlds.snake.offline.wall_depth import UNMEASURED, WallDepth
from ...worlds.snake.stepping.constants import Start
from .operator import PolypOperator
from .progress import PolypProgress
from .seen import seen_share
from .series import polyp_series, task_note
from .sight import LumenSight
from .table import beyond_bound_mm, polyp_table, table_iii, withdrawal_s
from .world import LAST_MARK, PolypWorld

ASSUMED = (
    "7 s without a break, as the paper prints only that the polyp was viewed for 7 s",
    "the aiming frame touches the circle of 20°; its size is not printed",
    "a polyp stands out 2 mm from the wall",
    "the marker's colour is linear in the worse of the errors of distance and angle",
    "deviation of the distal links counts as one, not for each link",
)


def polyp_trial(
    mesh: TriangleMesh, world: PolypWorld, folder: Path, say: Callable[[str], None] = lambda words: None
) -> dict[str, Any]:
    """Do the task, record it as the run ``folder``, and compute its figures from that run; JSON's types.

    Raises:
        InputError: the folder exists, or the robot does not fit the lumen.
    """
    lumen, settings, (places, task, views) = world.lumen, world.settings, world.polyps
    drive = SnakeDrive(world.snake, lumen.pathway, settings, lumen.curve, lumen.slack)
    spec = DriveSpec.of(Start(drive.constants, drive.state), lumen)
    sight = LumenSight(mesh, task, world.motion)
    operator = PolypOperator(task, sight, world.motion, views)
    still = world.motion is None
    behind = (
        WallDepth(mesh, lumen.pathway, driven_curve(lumen.pathway, lumen.curve), drive.snake.links) if still else None
    )
    writer = RunWriter(folder, spec, spec.columns, task.seed)
    drive.driver.log = writer
    try:
        _drive(drive, operator, behind, say)
    except BaseException:
        writer.abandon()
        raise
    writer.close()
    series = polyp_series(Run.read(folder), sight)
    words = (
        f"the landmark '{task.end_name}'" if task.end_name else f"the depth that the robot reaches; no '{LAST_MARK}'"
    )
    return {
        "completed": series.progress.completed,
        "operator": "oracle",
        "arm": settings.arm,
        "control": settings.control,
        "seed": task.seed,
        "polyps_cleared": series.progress.cleared,
        "of": len(task.polyps),
        "table_iii": table_iii(series).to_dict(),
        "beyond_bound_mm": beyond_bound_mm(series),
        "behind_wall_mm": (behind.to_dict() if behind is not None else UNMEASURED)["mm"],
        "behind_wall": behind.words if behind is not None else UNMEASURED["words"],
        "viewable_share": task.viewable_share,
        "seen_share": seen_share(series, places),
        "withdrawal_s": withdrawal_s(series),
        "from_mm": task.from_mm,
        "end_mm": task.end_mm,
        "ends_at": words,
        "inserted_mm": float(series.tip_mm.max()),
        "stopped_by": None if series.progress.completed else drive.state.held_by,
        "links": drive.snake.links,
        "polyps": polyp_table(series),
        "attempts": [asdict(attempt) for attempt in operator.attempts],
        "assumed": [*ASSUMED, *drive.snake.assumed],
    }


def _drive(drive: SnakeDrive, operator: PolypOperator, behind: WallDepth | None, say: Callable[[str], None]) -> None:
    """Step until the operator has finished."""
    drive.ask(task_note(operator.task))
    told: PolypProgress = operator.progress
    while (act := operator(drive.system, drive.state)) is not None:
        drive.act(act)
        new = operator.progress.cleared > told.cleared
        if new:
            told = operator.progress
            say(f"polyp {told.cleared} of {len(told.viewings)} cleared, {drive.tip_s:.0f} mm in, {told.t:.0f} s")
        if behind is not None:
            behind.look(drive, new)
