"""The snake as a system for scripts, without a clock, whose runs are recorded and driven again."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Self

from ....errors import ControlError
from ....runtime.command import BUTTON_STRAIGHTEN, Command, no_command
from ....runtime.operator import Act
from ....runtime.requests import Request
from ....runtime.system import Background, Column
from ..lumen import Lumen
from ..requests import BendTowards, ChooseJoint, GetReady, PlanAnew, SetPeriod
from ..row import SnakeRow
from ..settings import SnakeSettings
from ..spec import LumenContours, SnakeSystemSpec
from ..stepping.command import SnakeCommand
from ..stepping.constants import Start, start_of
from ..stepping.distal import ready_to_look
from ..stepping.state import SnakeState
from ..stepping.step import step
from ..system import SnakeSystem


def act_of(command: SnakeCommand, dt: float, state: SnakeState) -> Act:
    """What brings ``ScriptSystem`` from a state by a command for ``dt`` s: the command, and what else changes by it."""
    requests: list[Request] = []
    if dt != state.period_s:
        requests.append(SetPeriod(dt))
    if command.bend != state.bend_goal:
        requests.append(BendTowards(command.bend))
    axes = (*command.camera_mm_per_s, command.insert_mm_per_s)
    buttons = BUTTON_STRAIGHTEN if command.straighten else 0
    return Act(replace(no_command(), axes=axes, buttons=buttons), tuple(requests))


class ScriptSystem(SnakeSystem):
    """A snake that plans within its steps, which take as long as the script asks.

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
        """The state after one of a script's requests. Raises ControlError for others."""
        if isinstance(request, SetPeriod):
            return state._replace(period_s=request.dt)
        if isinstance(request, BendTowards):
            return state._replace(bend_goal=None if request.bend is None else tuple(request.bend))
        if isinstance(request, PlanAnew):
            state = state.restarted()
            return state._replace(ahead=state.ahead._replace(spacing_mm=request.waypoint_mm))
        if isinstance(request, ChooseJoint):
            return self._chosen(state, request)
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
    def of(cls, start: Start, lumen: Lumen) -> Self:
        """Of a drive that is at its start in a lumen."""
        (constants, state), contours = start, LumenContours.of(lumen)
        motion = constants.pathway.motion
        return cls(contours, constants.snake, drive=state.settings, tissue=motion, tip_s=state.tip_s)

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
        pathway, curve, slack, _ = self._parts()
        given = None if pathway.motion is not None else curve
        return ScriptSystem(
            start_of(
                self.snake, pathway, self.drive, given, slack, self.tip_s, plans_here=True, base=self.base,
                q_nominal=self.q_nominal,
            )
        )  # fmt: skip
