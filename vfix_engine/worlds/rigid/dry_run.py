"""A dry run: the controller itself drives the path, so that a plan shows the poses of an actual drive."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Array
from ...control import ControlSettings
from ...runtime.snapshot import Blocker
from .rehearsal import Command, Rehearsal
from .scene import Scene

STEP_MM = 0.1  # length of a step of a dry run: ten times a rehearsal's, with the same certificate
DT_S = 0.01
LEAST_FORCE_N = 1.0  # lower limit of the force: with a smaller one steps would be shorter
DETOUR = 5.0  # a run that takes this many times the path's length in steps is stuck
PATIENCE = 40  # held steps after which the tool is stuck
STATION_MM = 0.5  # of arc length between the poses of `stations`
TIGHT_MM = 0.2  # above the margin: a clearance below that is tight


@dataclass(frozen=True)
class DryRun:
    """Poses along the path; lengths in mm, positions in LPS.

    s (n,): arc length; tip (n, 3); clearance (n,): bone clearance of the whole tool, exact up to exact_to_mm; q (n, 7):
    joints.
    segments_start, segments_end (n, S, 3): the tool's axis in each pose, from the tip on.
    completed: the end was reached; reason: why not; stopped_by: the constraint that the reason describes, if it
    describes one.
    """

    s: Array
    tip: Array
    clearance: Array
    q: Array
    segments_start: Array
    segments_end: Array
    completed: bool
    reason: str
    length_mm: float
    exact_to_mm: float
    stopped_by: Blocker | None = None

    @property
    def reached_mm(self) -> float:
        return float(self.s[-1])

    def stations(self) -> Iterator[tuple[float, Array, Array]]:
        """Arc length, starts and ends (S, 3) of the tool's axis in a pose for every 0.5 mm of the path, and the last.

        The last pose is often the tightest one and is always included.
        """
        rows = np.unique(np.rint(self.s / STATION_MM), return_index=True)[1]
        for row in np.union1d(rows, [len(self.s) - 1]):
            yield float(self.s[row]), self.segments_start[row], self.segments_end[row]


def paced(settings: ControlSettings, step_mm: float = STEP_MM) -> ControlSettings:
    """The same settings with this step under full force; the force is unchanged, since soft tissue yields to it."""
    force = max(settings.force_cap_n, LEAST_FORCE_N)
    dt_s = DT_S * step_mm / STEP_MM  # at one speed, so that the shaft rotates equally per mm of path
    return replace(settings, dt_s=dt_s, force_cap_n=force, gain_mm_per_s_per_n=step_mm / (dt_s * force))


def dry_run(
    scene: Scene,
    settings: ControlSettings,
    go_on: Callable[[], object] = bool,
    tell: Callable[[float], object] = bool,
    step_mm: float = STEP_MM,
) -> DryRun:
    """Drive the scene's path at full force in coarse steps.

    step_mm: length of a step; with 0.2 mm the least clearance differs by about 0.03 mm, in half the time.
    go_on: called before each step; an exception ends the run.
    tell: called before each step with the completed fraction of the path, 0 … 1.

    Raises:
        StartRefused: the start pose is outside a limit or inside the margin.
        ControlError: the scene has no path.
    """
    rehearsal = Rehearsal(scene, paced(settings, step_mm))
    state = rehearsal.start("path")
    length = 0.0 if scene.path is None else scene.path.length
    snapshot = rehearsal.snapshot(state)
    rows = [snapshot]
    stuck, best = 0, snapshot.progress_mm
    most = int(DETOUR * length / step_mm) + PATIENCE
    while snapshot.phase != "done" and stuck < PATIENCE and len(rows) <= most:
        go_on()
        tell(best / length)
        state, snapshot = rehearsal.step(state, Command(np.zeros(3), drive=1))
        rows.append(snapshot)
        gained = snapshot.progress_mm > best + 0.02 * step_mm
        best = max(best, snapshot.progress_mm)
        stuck = 0 if gained or (snapshot.phase == "approach" and not snapshot.held) else stuck + 1
    done = snapshot.phase == "done"
    return DryRun(
        s=np.array([r.progress_mm for r in rows]),
        tip=np.stack([r.tip for r in rows]),
        clearance=np.array([r.clearance_mm for r in rows]),
        q=np.stack([r.q for r in rows]),
        segments_start=np.stack([r.segments_start for r in rows]),
        segments_end=np.stack([r.segments_end for r in rows]),
        completed=done,
        reason="" if done else snapshot.reason or "the tool no longer moves along the path",
        length_mm=length,
        exact_to_mm=snapshot.threshold_mm,
        stopped_by=next((one for one in snapshot.blockers if not done and one.words == snapshot.reason), None),
    )
