"""Study I without a clock: a lumen, its polyps, the operator that knows where they are, and the figures of its run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, BoolArray
from ...errors import InputError
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...pathway.pathway import TissueMotion
from ...robots.snake import SnakeModel
from ...runtime.run import Run, RunWriter
from ...snake.conform.conforming import driven_curve
from ...validate import point
from ...worlds.snake.lumen import Lumen, lumen_between
from ...worlds.snake.narrow import narrowest
from ...worlds.snake.offline.script import DriveSpec
from ...worlds.snake.offline.snake_drive import SnakeDrive
from ...worlds.snake.offline.wall_depth import UNMEASURED, WallDepth
from ...worlds.snake.settings import DriveSettings
from ...worlds.snake.stepping.constants import Start
from ...worlds.snake.viewable import Viewable, viewable_wall
from .operator import PolypOperator
from .placing import POLYPS, WallPlaces, placed
from .progress import PolypProgress
from .seen import seen_share
from .series import polyp_series, task_note
from .sight import LumenSight
from .table import beyond_bound_mm, polyp_table, table_iii, withdrawal_s
from .task import PolypTask

FIRST_MARK, LAST_MARK = "rectosigmoid", "ascending"  # where the paper's polyps begin, and where its task ends
ERROR_AT_MOST = 0.8  # of a planned view of a polyp, as of ``ViewLimits.error``
ASSUMED = (
    "7 s without a break, as the paper prints only that the polyp was viewed for 7 s",
    "the aiming frame touches the circle of 20°; its size is not printed",
    "a polyp stands out 2 mm from the wall",
    "the marker's colour is linear in the worse of the errors of distance and angle",
    "deviation of the distal links counts as one, not for each link",
)
_SAME_MM = 1e-6


@dataclass(frozen=True, eq=False)
class PolypWorld:
    """What a trial is driven in: one robot in one lumen with its polyps.

    views: for each polyp the tip's arc length in mm and the bends (n, 2L') rad from which the plan views it.
    """

    lumen: Lumen
    snake: SnakeModel
    settings: DriveSettings
    places: WallPlaces
    task: PolypTask
    views: tuple[tuple[float, Array], ...]

    @property
    def motion(self) -> TissueMotion | None:
        """Of the tissue; None: it is still."""
        return self.lumen.pathway.motion


def polyp_world(
    mesh: TriangleMesh,
    start: ArrayLike,
    end: ArrayLike,
    landmarks: Mapping[str, ArrayLike],
    model: SnakeModel,
    links: int | None,
    settings: DriveSettings,
    tissue: TissueMotion | None = None,
    *,
    seed: int = 0,
    count: int = POLYPS,
    anyway: bool = False,
    say: Callable[[str], None] = lambda words: None,
) -> PolypWorld:
    """Prepare a lumen, find what the robot can view of it, and place the polyps there.

    The polyps begin at the landmark 'rectosigmoid', or else where the links that bend are inside; the task ends at the
    landmark 'ascending', or else at the depth that the robot reaches.

    Args:
        mesh, start, end, tissue, anyway: as for ``drive_lumen``. model, links: the robot, None links: as many as it
            takes to the end. landmarks: places (3,) by name. seed: of the polyps; count: their number.

    Raises:
        InputError: as ``placed``. PathwayError, RobotError: as ``drive_lumen``.
    """
    say("centreline, followable curve and pathway")
    lumen = lumen_between(mesh, start, end, model, settings, tissue)
    curve, snake = driven_curve(lumen.pathway, lumen.curve), lumen.snake(model, links)
    reach = min(curve.length, snake.reach_mm())
    if not anyway:
        narrowest(lumen.pathway, snake, settings.bound_mm, reach).refuse(snake)
    say("what of the wall this robot can view")
    found = viewable_wall(mesh, lumen.pathway, snake, settings, lumen.curve, lumen.slack)
    depth = min(reach, found.depth_mm)
    from_mm, end_mm, end_name = _way(landmarks, curve, depth, settings.manipulated * snake.length_mm)
    places = WallPlaces.of(mesh, curve)
    viewable = _viewable(found, end_mm)
    task = placed(places, viewable, from_mm, end_mm, end_name, seed, count)
    return PolypWorld(lumen, snake, settings, places, task, tuple(_views(task, found, places)))


def _way(
    landmarks: Mapping[str, ArrayLike], curve: Curve, depth: float, bending_mm: float
) -> tuple[float, float, str | None]:
    """From and to which arc length in mm polyps are placed, and the landmark at the end, if it is reached."""
    at = {name: curve.closest(point(f"the landmark {name!r}", place)) for name, place in landmarks.items()}
    from_mm = at.get(FIRST_MARK, min(bending_mm, depth / 3.0))
    reached = LAST_MARK in at and at[LAST_MARK] <= depth + _SAME_MM
    end_mm = at[LAST_MARK] if reached else depth
    if not from_mm < end_mm:
        raise InputError(f"the robot reaches {depth:.0f} mm, and the first polyp is to be at {from_mm:.0f} mm or more")
    return from_mm, end_mm, LAST_MARK if reached else None


def _viewable(found: Viewable, end_mm: float) -> BoolArray:
    """(F,) triangles that are viewed well enough from before the end of the task."""
    tip_s = np.array([view.tip_s for view in found.views] or [np.inf])
    mask: BoolArray = found.mask & found.counted & (found.error <= ERROR_AT_MOST) & (tip_s[found.view] < end_mm)
    return mask


def _views(task: PolypTask, found: Viewable, places: WallPlaces) -> list[tuple[float, Array]]:
    """The planned view of each polyp."""
    kept = []
    for polyp in task.polyps:
        triangle = int(np.linalg.norm(places.wall.centre - np.array(polyp.wall), axis=1).argmin())
        view = found.views[int(found.view[triangle])]
        kept.append((view.tip_s, view.bends))
    return kept


def polyp_trial(
    mesh: TriangleMesh, world: PolypWorld, folder: Path, say: Callable[[str], None] = lambda words: None
) -> dict[str, Any]:
    """Do the task, record it as the run ``folder``, and compute its figures from that run; JSON's types.

    Raises:
        InputError: the folder exists, or the robot does not fit the lumen.
    """
    lumen, task, settings = world.lumen, world.task, world.settings
    drive = SnakeDrive(world.snake, lumen.pathway, settings, lumen.curve, lumen.slack)
    spec = DriveSpec.of(Start(drive.constants, drive.state), lumen)
    sight = LumenSight(mesh, task, world.motion)
    operator = PolypOperator(task, sight, world.motion, world.views)
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
        "seen_share": seen_share(series, world.places),
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
