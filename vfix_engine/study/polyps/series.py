"""A run of study I as arrays, and the progress of its task: computed from the run's rows, its spec and its note.

The pose from camera to target is not recorded. It follows from the joints and the base of each row by the robot's
kinematics, from the time by the motion of the spec's tissue, and from the task that the run's note has; a replay that
is equal bit by bit has the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arrays import Array, BoolArray, IntArray
from ...errors import InputError
from ...pathway.pathway import TissueMotion
from ...robots.snake import SnakeModel
from ...robots.snake_kernel import snake_frames
from ...runtime.requests import Note, Reset
from ...runtime.run import Run
from ...worlds.registry import spec_of
from .many_steps import Steps, after_steps
from .progress import PolypProgress, Sight
from .task import PolypTask

NOTE = "kwok1"  # kind of the note with which the task begins


def task_note(task: PolypTask) -> Note:
    """The request that records the beginning of a task in a run, whose time counts from then on."""
    return Note(NOTE, task.to_dict(), timed=True)


@dataclass(frozen=True, eq=False)
class PolypSeries:
    """A run from the beginning of its task on, n steps; LPS mm.

    start_t: s, when it began; t: (n,) s after each step. tip_mm: (n,) arc length of the tip; tip: (n, 3).
    camera: (n, 4, 4) transform_camera_to_patient. deviation: (n, L') mm, the distal links outside the pathway (eq. 9).
    beyond_bound: (n,) mm, the most that any link is beyond its bound; −inf where none is inside.
    target: (n,) index of the polyp that is aimed at, −1: none. viewed: (n,); marker: (n,) colour value.
    progress: after the last step.
    """

    task: PolypTask
    start_t: float
    t: Array
    tip_mm: Array
    tip: Array
    camera: Array
    deviation: Array
    beyond_bound: Array
    target: IntArray
    viewed: BoolArray
    marker: Array
    progress: PolypProgress
    motion: TissueMotion | None

    @property
    def dt(self) -> Array:
        """(n,) s, duration of each step."""
        return np.diff(self.t, prepend=self.start_t)

    @property
    def tip_step(self) -> Array:
        """(n,) mm, way of the tip in each step; 0 in the first, before which nothing is known."""
        return np.append(0.0, np.linalg.norm(np.diff(self.tip, axis=0), axis=1))


def task_begun(run: Run) -> bool:
    """Whether a task of polyps began in a run."""
    return any(isinstance(event.content, Note) and event.content.kind == NOTE for event in run.events)


def task_of(run: Run) -> tuple[PolypTask, int]:
    """The task that a run was driven for last, and the number of the step before which it began.

    Raises:
        InputError: the run has none, or one that is damaged.
    """
    found = [event for event in run.events if isinstance(event.content, Note) and event.content.kind == NOTE]
    if not found:
        raise InputError("no polyps were looked for in this run")
    note: Any = found[-1].content
    starts = [event.at for event in run.events if isinstance(event.content, Reset) and event.at < len(run.ticks)]
    return PolypTask.from_dict(note.content), max(found[-1].at, *starts, 0)


def polyp_series(run: Run, sight: Sight, steps: Sequence[PolypProgress] | None = None) -> PolypSeries:
    """Read a run of study I up to the end of its task.

    Args:
        sight: lines of sight in the lumen of the run, as ``LumenSight`` has them.
        steps: the progress after each step to the end of the task or of the run, which a drive of it computed; None:
            computed here, which takes as long as the drive's own.

    Raises:
        InputError: the run has no such task, no steps in it, or is none of a snake; ``steps`` are those of another run.
    """
    task, first = task_of(run)
    spec: Any = spec_of(run)
    snake: SnakeModel | None = getattr(spec, "snake", None)
    rows = run.rows[first:]
    if snake is None or not len(rows):
        raise InputError("the run has no steps of a snake that looks for polyps")
    at = {column.name: place for place, column in enumerate(run.columns)}
    reset = any(isinstance(event.content, Reset) and event.at == first for event in run.events)
    start_t = 0.0 if first == 0 or reset else float(run.rows[first - 1, at["t"]])
    camera = cameras(snake, rows, at)
    links = [place for name, place in at.items() if name.startswith("outside_link")]
    t, tip_mm = rows[:, at["t"]], rows[:, at["tip_s"]]
    if steps is None:
        made = after_steps(PolypProgress.at_start(task, start_t), task, spec.tissue, camera, tip_mm, t, sight)
    else:
        made = _given(steps, t)
    count = len(made.target)
    return PolypSeries(
        task, start_t, t[:count], tip_mm[:count], rows[:count, [at[f"tip_{axis}"] for axis in "xyz"]], camera[:count],
        rows[:count][:, links], rows[:count, at["beyond_bound"]], *made, spec.tissue,
    )  # fmt: skip


def cameras(snake: SnakeModel, rows: Array, at: Mapping[str, int]) -> Array:
    """(n, 4, 4) transform_camera_to_patient of rows, as ``SnakeModel.camera`` has it. at: place of each column."""
    joints = np.ascontiguousarray(rows[:, at["q0"] : at["q0"] + snake.dof])
    bases = np.zeros((len(rows), 4, 4))
    bases[:, :3] = rows[:, at["base_00"] : at["base_00"] + 12].reshape(-1, 3, 4)
    bases[:, 3, 3] = 1.0
    camera, frames = bases.copy(), np.empty((snake.links, 3, 4))
    for k, (q, base) in enumerate(zip(joints, bases, strict=True)):
        snake_frames(q, base, snake.length_mm, frames)
        camera[k, :3] = frames[-1]
    camera[:, :3, 3] += snake.camera_offset_mm * camera[:, :3, 2]
    return camera


def _given(steps: Sequence[PolypProgress], t: Array) -> Steps:
    """Steps that a drive computed, of a run with times t (n,) s; raises InputError for those of another one."""
    count, last = len(steps), steps[-1] if steps else None
    if last is None or count > len(t) or last.t != t[count - 1] or (count < len(t) and not last.completed):
        raise InputError("the steps of the task are not those of the run")
    target = np.array([-1 if step.target is None else step.target for step in steps], dtype=np.int64)
    viewed, marker = np.array([step.viewed for step in steps]), np.array([step.marker for step in steps])
    return Steps(target, viewed, marker, last)
