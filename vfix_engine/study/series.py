"""The series of a run: what is plotted over its time, and where tool and hand were, as arrays."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from ..arrays import Array, BoolArray, IndexArray
from ..errors import InputError
from ..runtime.run import Run
from ..runtime.system import Column, SystemSpec
from ..worlds.registry import spec_of
from ..worlds.rigid.row import PHASES
from ..worlds.rigid.snapshot import view_axes
from .metrics.held import HELD
from .metrics.samples import Samples, samples_of
from .path_plane import PathPlane

_ON_TARGET = PHASES.index("inspect_hold")
_PATH = [PHASES.index(name) for name in ("approach", "follow", "done")]


@dataclass(frozen=True, eq=False)
class RunSeries:
    """A run from its last return to the start on, n samples; patient frame, LPS mm.

    t: (n,) in s, driven time at the end of each control period.
    tip, rotation: (n, 3) and (n, 3, 3), pose of the tip; grip: (n, 3), the point on the shaft that the hand holds.
    start, end: (n, S, 3) axes of the tool's parts from the tip on; radius: (S,) of them.
    side: (n, 3) unit vector across the tool's first part, to which its bend or an angled lens points.
    q, speed: (n, J) joints and their speeds, whose names and units are ``joints``; J = 0 in a free hand.
    clearance: (n, B) distance of the whole tool to each of ``structures``, the anatomy first; negative where it was
        entered, cut at ``reach``, (n,). nearest: (n,) number of the nearest structure, -1 where none is within reach.
    force: (n, 3) in N, of the hand.
    error: (n,) distance of the tip to the path where the task is the path, of the target to the point that is held
        on it where a target is inspected, NaN elsewhere. progress: (n,) arc length along the path, NaN without one.
    flat: (n, 2) in mm, the tip in the plane of the path, as the controller believes it to be; across: (n, 2) in mm, its
        error within that plane and off it, NaN where ``error`` is not that of the path. plane: None without a path.
    phase: (n,) numbers of ``worlds.rigid.row.PHASES``; held: (n,) whether the hand pushed and the tool stood.
    """

    t: Array
    tip: Array
    rotation: Array
    grip: Array
    start: Array
    end: Array
    side: Array
    q: Array
    speed: Array
    clearance: Array
    reach: Array
    nearest: IndexArray
    force: Array
    error: Array
    progress: Array
    flat: Array
    across: Array
    phase: IndexArray
    held: BoolArray
    radius: Array
    structures: tuple[str, ...]
    joints: tuple[Column, ...]
    plane: PathPlane | None

    def thinned(self, rate_hz: float) -> RunSeries:
        """The series at no more than ``rate_hz``: the last sample of every interval, with the extremes within it.

        Clearance is the least of the interval, error the largest, across that of the largest, held whether any sample
        was; the last sample of the run is always there. Raises InputError for a rate that is not positive.
        """
        if not rate_hz > 0.0:
            raise InputError(f"series are thinned to a positive rate in Hz, not to {rate_hz!r:.40}")
        interval = np.floor(self.t * rate_hz * (1.0 - 1e-9)).astype(np.int64)
        first = np.flatnonzero(np.diff(interval, prepend=-1))
        last = np.append(first[1:], len(self.t)) - 1
        short: dict[str, object] = {
            one.name: getattr(self, one.name)[last] for one in fields(self) if one.name not in _WHOLE
        }
        least = np.minimum.reduceat(self.clearance, first)
        short["clearance"], short["nearest"] = least, nearest_of(least, self.reach[last])
        worst = np.lexsort((np.nan_to_num(self.error, nan=-1.0), interval))[last]
        short["error"], short["across"] = self.error[worst], self.across[worst]
        short["held"] = np.logical_or.reduceat(self.held, first)
        return replace(self, **short)  # type: ignore[arg-type]


_WHOLE = ("radius", "structures", "joints", "plane")  # fields that are no series


def series_of(run: Run, spec: SystemSpec | None = None) -> RunSeries:
    """The series of a run of a rigid tool, on a robot or in a free hand; at the rate at which it was driven.

    spec: that the run was driven with; None: made of its manifest.

    Raises:
        InputError: the run has no samples or no rigid tool, or its spec is not in the manifest.
    """
    spec = spec_of(run) if spec is None else spec
    samples = samples_of(run, spec)
    parts, columns = len(samples.tool.radius), run.columns
    at = {column.name: place for place, column in enumerate(columns)}
    rows = run.rows[samples.first :]
    joints = tuple(column for column in columns if column.name[0] == "q" and column.name[1:].isdigit())

    def axes(end: str) -> Array:
        names = [[f"s{part}_{end}{axis}" for axis in "xyz"] for part in range(parts)]
        return np.asarray(rows[:, [[at[name] for name in three] for three in names]])

    start, end = axes("a"), axes("b")
    plane = None if samples.path is None else PathPlane.of(samples.path)
    clearance = samples.distance.min(axis=2)
    reach = np.array([one.reach_mm for one in samples.settings])
    progress = np.where(samples.path_s < 0.0, np.nan, samples.path_s)
    error, across = _errors(samples, plane)
    return RunSeries(
        t=np.cumsum(samples.period_s),
        tip=samples.tip,
        rotation=samples.rotation,
        grip=samples.rotation @ samples.tool.grip(np.eye(3), np.zeros(3)) + samples.tip,
        start=start,
        end=end,
        side=_sides(samples, end[:, 0] - start[:, 0]),
        q=rows[:, [at[one.name] for one in joints]],
        speed=rows[:, [at[f"v{one.name[1:]}"] for one in joints]],
        clearance=clearance,
        reach=reach,
        nearest=nearest_of(clearance, reach),
        force=samples.force,
        error=error,
        progress=progress,
        flat=np.full((len(rows), 2), np.nan) if plane is None else plane.flat(samples.believed),
        across=across,
        phase=samples.phase,
        held=samples.outcome == HELD,
        radius=samples.tool.radius,
        structures=samples.structures,
        joints=joints,
        plane=plane,
    )


def _sides(samples: Samples, shaft: Array) -> Array:
    """The side (n, 3) of every pose, as ``ToolOfSnapshot.side`` says it; shaft: (n, 3) along the first part."""
    view = view_axes(samples.tool)
    along: Array = shaft / np.linalg.norm(shaft, axis=1, keepdims=True)
    towards: Array = samples.rotation @ (view[:, 2] - view[:, 1])
    across: Array = towards - (towards * along).sum(axis=1, keepdims=True) * along
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return across


def _errors(samples: Samples, plane: PathPlane | None) -> tuple[Array, Array]:
    """Error (n,) of the path or the target, and that of the path across it (n, 2); NaN where there is none."""
    error, across = np.full(len(samples.tip), np.nan), np.full((len(samples.tip), 2), np.nan)
    if samples.path is not None and plane is not None:
        following = np.isin(samples.phase, _PATH) & (samples.path_s >= 0.0)
        s, tips = samples.path_s[following], samples.believed[following]
        error[following] = _apart(samples.path.position(s), tips)
        across[following] = plane.across(samples.path, s, tips)
    inspecting = samples.phase == _ON_TARGET
    if inspecting.any():
        error[inspecting] = _apart(samples.view_point[inspecting], samples.targets[samples.target[inspecting]])
    return error, across


def nearest_of(clearance: Array, reach: Array) -> IndexArray:
    """Number (n,) of the structure with the least clearance (n, B), -1 where all are beyond ``reach`` (n,)."""
    return np.where(clearance.min(axis=1) < reach, clearance.argmin(axis=1), -1).astype(np.int64)


def _apart(a: Array, b: Array) -> Array:
    return np.asarray(np.linalg.norm(a - b, axis=1))
