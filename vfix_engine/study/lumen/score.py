"""The score of a run of a snake in a lumen; docs/metrics.md has the definitions and their sources."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from ...geometry.mesh import TriangleMesh
from ...runtime.run import Run
from ...runtime.system import SystemSpec
from ...worlds.registry import arm_of, is_certified, spec_of
from ...worlds.snake.row import LIMITS
from ...worlds.snake.spec import SnakeSystemSpec
from ..metrics.score import HeldTime, MeanMax
from .behind_wall import BehindWall, behind_wall_of
from .deviation import Deviation, deviation_of
from .samples import LumenSamples, lumen_samples_of
from .task_rows import TaskScore, task_score

END_MM = 2.0  # nearer to the end of the way than that is there: tissue that moves makes the way longer and shorter
OUT_MM = 10.0  # the tip is out again once it is no deeper


@dataclass(frozen=True)
class LumenScore:
    """The score of a run; lengths in mm, times in s, forces in N.

    arm: 'manual', 'guided' or 'certified'; certified: whether every motion was. completed: its task was done, or
    without one the tip came to the end of its way. depth_mm to withdrawal_s: None on a fixed base, from
    which nothing is inserted. depth_mm: its deepest place; length_mm, reach_mm: of the way that its tip follows,
    and how far along it this robot can come; share: of that length. insertion_s: until the deepest place; withdrawal_s:
    from then until the tip is out, None where it was not drawn back so far. deviation: None of a run whose rows do not
    have it. nearest_mm: deviation of the link nearest to its bound, over the samples with a link inside; None as there.
    beyond_bound_mm: the most that a link was beyond its bound, 0 for none. bound_mm: the largest bound of any link
    in that drive, anywhere in the pathway. behind_wall: what a certificate of the pathway does not speak of; None
    without the surface. force_n: on the hand. held_by: by constraint. task: what the run's task adds, None without one.
    """

    world: str
    arm: str | None
    certified: bool
    whole: bool
    lost: int
    completed: bool
    samples: int
    time_s: float
    depth_mm: float | None
    length_mm: float | None
    reach_mm: float | None
    share: float | None
    insertion_s: float | None
    withdrawal_s: float | None
    path_length_mm: float
    deviation: Deviation | None
    nearest_mm: MeanMax | None
    bound_mm: float
    beyond_bound_mm: float
    beyond_bound_s: float
    behind_wall: BehindWall | None
    force_n: MeanMax
    held_s: float
    held_by: tuple[HeldTime, ...]
    task: TaskScore | None

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return asdict(self)


def score_lumen_run(run: Run, spec: SystemSpec | None = None, wall: TriangleMesh | None = None) -> LumenScore:
    """Score a run of a snake in a lumen, from its last return to the start on.

    spec: that the run was driven with; None: made of its manifest. wall: of the lumen, for the score of its task and
    for what is behind it.

    Raises:
        InputError: as ``lumen_samples_of``. PathwayError: its lumen gives no pathway, or does not lie in that wall.
    """
    spec = spec_of(run) if spec is None else spec
    samples = lumen_samples_of(run, spec)
    assert isinstance(spec, SnakeSystemSpec)  # samples are of no other
    task = task_score(run, wall)
    way = _way(samples, spec) if spec.base is None else _NO_WAY
    tip_way, inside = _ways(samples), samples.link > 0
    over = np.maximum(samples.beyond, 0.0)
    return LumenScore(
        world=str(run.manifest["world"]),
        arm=arm_of(run.manifest),
        certified=is_certified(run.manifest),
        whole=run.whole,
        lost=run.lost,
        completed=way.completed if task is None else task.completed,
        samples=len(samples.t),
        time_s=float(samples.t[-1]),
        depth_mm=way.depth_mm,
        length_mm=way.length_mm,
        reach_mm=way.reach_mm,
        share=way.share,
        insertion_s=way.insertion_s,
        withdrawal_s=way.withdrawal_s,
        path_length_mm=float(tip_way.sum()),
        deviation=deviation_of(samples.outside, samples.period_s, tip_way) if samples.outside.shape[1] else None,
        nearest_mm=_mean_max(samples.deviation[inside]) if inside.any() else None,
        bound_mm=spec.drive.bounds(spec.snake.links).largest_mm(spec.way()[0]),
        beyond_bound_mm=float(over.max()),
        beyond_bound_s=float(samples.period_s[over > 0.0].sum()),
        behind_wall=None if wall is None else behind_wall_of(samples, spec, wall),
        force_n=_mean_max(np.linalg.norm(samples.force, axis=1)),
        held_s=float(samples.period_s[samples.held].sum()),
        held_by=_held_by(samples),
        task=task,
    )


class _Way(NamedTuple):
    """The figures of an insertion, as in ``LumenScore``."""

    completed: bool
    depth_mm: float | None
    length_mm: float | None
    reach_mm: float | None
    share: float | None
    insertion_s: float | None
    withdrawal_s: float | None


_NO_WAY = _Way(False, None, None, None, None, None, None)


def _way(samples: LumenSamples, spec: SnakeSystemSpec) -> _Way:
    length, reach = spec.way_mm()
    deepest = float(samples.depth.max())
    return _Way(deepest >= reach - END_MM, deepest, length, reach, deepest / length, *_there_and_back(samples))


def _there_and_back(samples: LumenSamples) -> tuple[float, float | None]:
    """Time until the deepest place was first reached, and from then until the tip was out."""
    there = int(samples.depth.argmax())
    out = np.flatnonzero(samples.depth[there:] <= OUT_MM)
    began = float(samples.t[there])
    if not len(out) or samples.depth[there] <= OUT_MM:
        return began, None
    return began, float(samples.t[there + int(out[0])]) - began


def _ways(samples: LumenSamples) -> np.ndarray[Any, np.dtype[np.float64]]:
    """(n,) mm that the tip went in each sample."""
    steps = np.linalg.norm(np.diff(samples.tip, axis=0), axis=1)
    return np.concatenate([[0.0], steps])


def _held_by(samples: LumenSamples) -> tuple[HeldTime, ...]:
    """Time by constraint, the longest first."""
    time: dict[tuple[str, str], float] = defaultdict(float)
    for row in np.flatnonzero(samples.held).tolist():
        link = int(samples.limit_link[row])
        time[LIMITS[samples.limit[row]] or "", f"link {link}" if link else ""] += float(samples.period_s[row])
    ordered = sorted(time.items(), key=lambda item: -item[1])
    return tuple(HeldTime(kind, "lumen" if part else "", part, seconds) for (kind, part), seconds in ordered)


def _mean_max(values: np.ndarray[Any, np.dtype[np.float64]]) -> MeanMax:
    return MeanMax(float(values.mean()), float(values.max()))
