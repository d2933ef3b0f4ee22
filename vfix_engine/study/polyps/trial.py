"""Study I without a clock: an operator, usually the one that knows the polyps, does the task; its run is measured."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any, Protocol

from ...geometry.mesh import TriangleMesh
from ...runtime.operator import Act
from ...runtime.run import Run, RunWriter
from ...snake.conform.conforming import driven_curve
from ...worlds.snake.offline.script import DriveSpec, ScriptSystem
from ...worlds.snake.offline.snake_drive import SnakeDrive
from ...worlds.snake.offline.wall_depth import UNMEASURED, WallDepth
from ...worlds.snake.stepping.constants import Start
from ...worlds.snake.stepping.state import SnakeState
from .figures import ASSUMED, polyp_figures
from .operator import Attempt, PolypOperator
from .progress import PolypProgress
from .series import polyp_series, task_note
from .sight import LumenSight
from .task import PolypTask
from .world import PolypWorld


class TaskOperator(Protocol):
    """An operator of the scripted drive that follows the task: its progress after the last step, and its attempts."""

    task: PolypTask
    progress: PolypProgress
    attempts: list[Attempt]

    def __call__(self, system: ScriptSystem, state: SnakeState) -> Act | None: ...


def polyp_trial(
    mesh: TriangleMesh,
    world: PolypWorld,
    folder: Path,
    say: Callable[[str], None] = lambda words: None,
    operator_of: Callable[[PolypTask, LumenSight], TaskOperator] | None = None,
) -> dict[str, Any]:
    """Do the task, record it as the run ``folder``, and compute its figures from that run; JSON's types.

    operator_of: makes another operator than the oracle.

    Raises:
        InputError: the folder exists, or the robot does not fit the lumen.
    """
    lumen, settings, (places, task, views) = world.lumen, world.settings, world.polyps
    drive = SnakeDrive(world.snake, lumen.pathway, settings, lumen.curve, lumen.slack)
    spec = DriveSpec.of(Start(drive.constants, drive.state), lumen)
    sight = LumenSight(mesh, task, world.motion)
    operator: TaskOperator = (
        PolypOperator(task, sight, world.motion, views) if operator_of is None else operator_of(task, sight)
    )
    behind = _behind(mesh, world)
    writer = RunWriter(folder, spec, spec.columns, task.seed)
    drive.driver.log = writer
    try:
        _drive(drive, operator, behind, say)
    except BaseException:
        writer.abandon()
        raise
    writer.close()
    found = polyp_figures(polyp_series(Run.read(folder), sight), places)
    wall = UNMEASURED if behind is None else behind.to_dict()
    return found | {
        "operator": "oracle",
        "arm": settings.arm,
        "control": settings.control,
        "behind_wall_mm": wall["mm"],
        "behind_wall": wall["words"],
        "stopped_by": None if found["completed"] else drive.state.held_by,
        "links": drive.snake.links,
        "attempts": [asdict(attempt) for attempt in operator.attempts],
        "assumed": [*ASSUMED, *drive.snake.assumed],
    }


def _behind(mesh: TriangleMesh, world: PolypWorld) -> WallDepth | None:
    """What measures links behind the triangles; None where the surface does not move with the tissue."""
    if world.motion is not None:
        return None
    pathway = world.lumen.pathway
    return WallDepth(mesh, pathway, driven_curve(pathway, world.lumen.curve), world.snake.links)


def _drive(drive: SnakeDrive, operator: TaskOperator, behind: WallDepth | None, say: Callable[[str], None]) -> None:
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
