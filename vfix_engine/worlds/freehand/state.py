"""The state of a free tool between two steps."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ...arrays import Array, IndexArray
from ...control import ControlSettings
from ...control.tasks import PathPoint
from ...geometry.capsules import Segments
from ...runtime.driven_clock import FROM_START, DrivenClock

ZEROS = np.zeros(3)
ZEROS.setflags(write=False)


@dataclass(frozen=True, eq=False)
class FreehandState:
    """Everything that the next step needs; patient frame, mm.

    position, rotation: (3,) and (3, 3), pose of the tip; segments: the tool there.
    distance: (B, S) from every structure to every segment; count, deepest: (B, S) contacts so far, and their depth.
    mode, phase, target, nearest: as in ``RehearsalState``; steps: so far.
    force, torque: (3,) in N and N·mm of the hand, after the cap; push: (3,) in N, sum of the contact forces.
    clock: of the driven time, which goes on where the period changes.
    outcome: of the last step: 'idle', 'moved', or 'held' where bone was too deep in the tool to go on.
    """

    position: Array
    rotation: Array
    segments: Segments
    distance: Array
    count: IndexArray
    deepest: Array
    mode: str
    phase: str
    nearest: PathPoint | None
    settings: ControlSettings
    target: int = 0
    steps: int = 0
    outcome: str = "idle"
    force: Array = field(default_factory=lambda: ZEROS)
    torque: Array = field(default_factory=lambda: ZEROS)
    push: Array = field(default_factory=lambda: ZEROS)
    clock: DrivenClock = FROM_START

    @property
    def t(self) -> float:
        """Driven time since the start in s."""
        return self.clock.read(self.steps, self.settings.dt_s)
