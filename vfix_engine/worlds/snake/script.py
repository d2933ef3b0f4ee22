"""A scripted drive as a system: what ``drive_lumen`` does with its drive is recorded as a run and driven again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from ...errors import ControlError
from ...runtime.command import BUTTON_STRAIGHTEN, COMMAND_SIZE, Command, command_to_row, no_command
from ...runtime.driver import Log
from ...runtime.requests import Request
from ...runtime.system import Background, Column
from .command import SnakeCommand
from .constants import Start, start_of
from .distal import ready_to_look
from .lumen import Lumen
from .requests import BendTowards, GetReady, PlanAnew, SetPeriod
from .row import SnakeRow
from .settings import SnakeSettings
from .snake_drive import SnakeDrive, planned_anew
from .spec import LumenContours, SnakeSystemSpec
from .state import SnakeState
from .step import step
from .system import SnakeSystem


class DriveRecorder:
    """Observes a drive and writes its run to a log; made before the drive's first step."""

    def __init__(self, drive: SnakeDrive, log: Log) -> None:
        self._drive, self._log = drive, log
        self._row = SnakeRow(drive.snake, drive.settings.manipulated)
        self._line = np.zeros(COMMAND_SIZE + len(self._row.layout))
        self._dt = drive.settings.step_s
        self._bend: tuple[float, ...] | None = None

    def stepped(self, command: SnakeCommand, dt: float) -> None:
        """One tick, and before it what is different about it."""
        if dt != self._dt:
            self._dt = dt
            self._log.event("request", SetPeriod(dt))
        if command.bend != self._bend:
            self._bend = command.bend
            self._log.event("request", BendTowards(command.bend))
        axes = (*command.camera_mm_per_s, command.insert_mm_per_s)
        buttons = BUTTON_STRAIGHTEN if command.straighten else 0
        command_to_row(replace(no_command(), axes=axes, buttons=buttons), self._line)
        self._row.write(self._drive.state, 0.0, self._line[COMMAND_SIZE:])
        self._log.tick(self._line)

    def planned_anew(self, waypoint_mm: float) -> None:
        """Between two ticks."""
        self._log.event("request", PlanAnew(waypoint_mm))

    def made_ready(self) -> None:
        """Between two ticks."""
        self._log.event("request", GetReady())


class ScriptSystem(SnakeSystem):
    """A drive of a script, driven again: it plans within its steps, which take as long as the script's orders say.

    ``Command.axes`` are mm/s: of the camera to the right and down, and of the insertion.
    """

    def __init__(self, start: Start) -> None:
        super().__init__(start, _nobody)

    def prepare(self) -> None:
        """Nothing: no step of it has to be in time."""

    def step(self, state: SnakeState, command: Command) -> SnakeState:
        """One step of the drive."""
        x, y, insert = command.axes
        straighten = bool(command.buttons & BUTTON_STRAIGHTEN)
        return step(self.constants, state, SnakeCommand(insert, (x, y), straighten, state.bend_goal), state.period_s)

    def apply(self, state: SnakeState, request: Request) -> SnakeState:
        """The state after what ``DriveRecorder`` writes. Raises ControlError for other requests."""
        if isinstance(request, SetPeriod):
            return state._replace(period_s=request.dt)
        if isinstance(request, BendTowards):
            return state._replace(bend_goal=None if request.bend is None else tuple(request.bend))
        if isinstance(request, PlanAnew):
            return planned_anew(state, request.waypoint_mm)
        if isinstance(request, GetReady):
            return ready_to_look(self.constants, state)
        raise ControlError(f"a scripted drive does not know the request {type(request).__name__}")

    def settings(self, state: SnakeState) -> SnakeSettings:
        """Those of its settings that a driven snake has."""
        fixed = state.settings
        return SnakeSettings(
            state.period_s, fixed.insertion_mm_per_s, bound_mm=fixed.bound_mm, tip_bound_mm=fixed.tip_bound_mm
        )

    def at_rest(self, state: SnakeState, running: bool) -> bool:
        """True: it moves by orders only."""
        return True

    def background(self, state: SnakeState) -> Background | None:
        """None: what is planned is planned within a step."""
        return None


def _nobody(wanted: Any) -> Any:
    raise ControlError("a scripted drive asks nobody for plans")


@dataclass(frozen=True, eq=False)
class DriveSpec(SnakeSystemSpec):
    """A scripted drive of a snake: ``drive`` has all of its settings, the others are not used."""

    @classmethod
    def of(cls, drive: SnakeDrive, lumen: Lumen) -> Self:
        """Of a drive that is at its start in a lumen."""
        contours = LumenContours.of(lumen)
        return cls(contours, drive.snake, drive=drive.settings, tissue=drive.pathway.motion, tip_s=drive.tip_s)

    @property
    def columns(self) -> tuple[Column, ...]:
        """Of the rows of its runs."""
        return SnakeRow(self.snake, self.drive.manipulated).layout

    @property
    def world(self) -> str:
        """'snake drive'."""
        return "snake drive"

    @property
    def has_worker(self) -> bool:
        """False."""
        return False

    def build(self) -> ScriptSystem:
        """The drive at its start. Raises as ``SnakeSystemSpec.build``."""
        pathway, curve, slack = self._parts()
        given = None if pathway.motion is not None else curve
        return ScriptSystem(start_of(self.snake, pathway, self.drive, given, slack, self.tip_s, plans_here=True))
