"""A dry run: the controller itself drives the path, so that a plan shows the poses that would really be taken."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..control import ControlSettings
from .rehearsal import Command, Rehearsal
from .scene import Scene

Array = NDArray[np.float64]

STEP_MM = 0.1  # length of a dry step: ten times a rehearsal's, the certificate being the same
# Gives that step whatever the settings of the hand are.
PACE = {"dt_s": 0.01, "gain_mm_per_s_per_n": 2.0, "force_cap_n": 5.0}
DETOUR = 5.0  # a run that takes this many times the path's length in steps goes nowhere
PATIENCE = 40  # held steps after which the tool is stuck
STATION_MM = 0.5  # of arc length between the poses that `stations` picks


@dataclass(frozen=True)
class DryRun:
    """Poses along the path; lengths in mm, positions in LPS.

    s (n,): arc length; tip (n, 3); clearance (n,): bone clearance of the whole tool; q (n, 7): joints.
    segments_start, segments_end (n, S, 3): the tool's axis in each pose, from the tip on.
    completed: the end was reached; reason: what held the tool where it was not.
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

    @property
    def reached_mm(self) -> float:
        return float(self.s[-1])

    def stations(self) -> Iterator[tuple[float, Array, Array]]:
        """Arc length, starts (S, 3) and ends (S, 3) of the tool's axis in one pose for every 0.5 mm of the path."""
        for row in np.unique(np.rint(self.s / STATION_MM), return_index=True)[1]:
            yield float(self.s[row]), self.segments_start[row], self.segments_end[row]


def dry_run(scene: Scene, settings: ControlSettings, go_on: Callable[[], object] = bool) -> DryRun:
    """Drive the scene's path at full force in coarse steps.

    go_on: called before each step; what it raises ends the run.

    Raises:
        StartRefused: the start pose is outside a limit or inside the margin.
        ControlError: the scene has no path.
    """
    rehearsal = Rehearsal(scene, replace(settings, **PACE))
    state = rehearsal.start("path")
    length = 0.0 if scene.path is None else scene.path.length
    snapshot = rehearsal.snapshot(state)
    rows = [snapshot]
    stuck, best = 0, snapshot.progress_mm
    most = int(DETOUR * length / STEP_MM) + PATIENCE
    while snapshot.phase != "done" and stuck < PATIENCE and len(rows) <= most:
        go_on()
        state, snapshot = rehearsal.step(state, Command(np.zeros(3), drive=1))
        rows.append(snapshot)
        gained = snapshot.progress_mm > best + 0.02 * STEP_MM
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
    )
