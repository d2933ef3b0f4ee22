"""The state of the rigid tool between two steps."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...arrays import Array
from ...control import ControlSettings, StepReport, StepState
from ...control.tasks import PathPoint
from ...runtime.driven_clock import FROM_START, DrivenClock

ZEROS = np.zeros(3)
ZEROS.setflags(write=False)


class LastStep(NamedTuple):
    """The step that led to a state: effective force (3,) in N and torque (3,) in N·mm.

    end: the end of the path that the hand pushes against, in words, or ''; teleoperated: by a master or a rate device.
    """

    report: StepReport
    force: Array
    torque: Array
    end: str
    teleoperated: bool


@dataclass(frozen=True)
class RehearsalState:
    """Everything that the next step needs; ``nearest`` is None without a path.

    nearest: point of the path nearest to the tip while it follows the path; in other modes the last one.
    emergencies: steps so far that exceeded an acceleration limit; lag: (3,) in mm that the tool is behind its master.
    deflection: (3,) in mm of the tip under a hand on the robot, compensated: ``nearest`` is of the deflected tip, and a
        target is inspected by the deflected view point.
    chosen: the path's point that is approached first, until the tip is there; None: none was chosen.
    fallbacks: steps so far in which the papers' demand of progress (14) had no solution.
    clock: of the driven time, which goes on where the period changes.
    settings: current; last: the step that led here, None after a start or a change of the task.
    """

    tool: StepState
    mode: str
    phase: str
    nearest: PathPoint | None
    target: int
    steps: int
    settings: ControlSettings
    emergencies: int = 0
    lag: Array = field(default_factory=lambda: ZEROS)
    chosen: PathPoint | None = None
    fallbacks: int = 0
    deflection: Array = field(default_factory=lambda: ZEROS)
    last: LastStep | None = field(default=None, repr=False, compare=False)
    clock: DrivenClock = FROM_START

    @property
    def t(self) -> float:
        """Driven time since the start in s."""
        return self.clock.read(self.steps, self.settings.dt_s)

    @property
    def believed_tip(self) -> Array:
        """(3,) where the controller believes the tip, with what it compensates."""
        tip: Array = self.tool.tip.position
        return tip + self.deflection if self.settings.compliance_mm_per_n else tip

    @property
    def q(self) -> Array:
        """Joints (n,) in mm and rad, in the order of ``RobotModel.joints``; ``tool`` has the rest of the pose."""
        return self.tool.q
