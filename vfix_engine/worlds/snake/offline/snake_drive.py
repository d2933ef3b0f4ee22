"""A snake that a script drives step by step, without a clock; plans are made within a step."""

from __future__ import annotations

from time import perf_counter
from typing import Self

from numpy.typing import ArrayLike

from ....arrays import Array
from ....errors import InputError
from ....geometry.curve import Curve
from ....geometry.mesh import TriangleMesh
from ....pathway.pathway import Pathway, TissueMotion
from ....robots.snake import SnakeModel
from ....runtime.driver import Driver
from ....runtime.operator import Act
from ....runtime.requests import Request
from ....validate import positive
from ..lumen import lumen_between
from ..narrow import narrowest
from ..settings import DriveSettings
from ..stepping.command import SnakeCommand
from ..stepping.constants import start_of
from ..stepping.state import SnakeState
from .drive_view import DriveView
from .script import ScriptSystem, act_of

_TIMED = 10  # interval in steps at which one query of all links is timed


class SnakeDrive(DriveView):
    """A snake in a lumen; each step and each request replaces its ``state``.

    driver: steps it; with a ``log`` it records a run of ``DriveSpec``. step_s, query_s: what the last step and the last
    query of all links that was timed took on the clock, s.

    Args:
        snake: the whole robot.
        pathway: in which its links are measured, still or moving.
        curve: to which it conforms, None: the pathway's own; with a moving pathway always the pathway's own.
        slack: (N,) mm at the curve's points, how far the robot may leave the curve there.
        tip_s: initial arc length of the tip, mm; at 0 the robot is straight before the entrance.
        beyond_allowed: it may start with links beyond their bounds, which then move no deeper.
        longer_allowed: it may have more links than the path needs, some of which never enter.

    Raises:
        InputError: a link that starts beyond its bound; a robot longer than the path; slack without a curve or of
            another shape; a pathway with closed ends, which has no entrance.
    """

    system: ScriptSystem

    def __init__(
        self,
        snake: SnakeModel,
        pathway: Pathway,
        settings: DriveSettings | None = None,
        curve: Curve | None = None,
        slack: Array | None = None,
        tip_s: float = 0.0,
        *,
        beyond_allowed: bool = False,
        longer_allowed: bool = False,
    ) -> None:
        start = start_of(
            snake, pathway, settings or DriveSettings(), curve, slack, tip_s,
            plans_here=True, beyond_allowed=beyond_allowed, longer_allowed=longer_allowed,
        )  # fmt: skip
        system = ScriptSystem(start)
        super().__init__(system, start.state)
        self.driver: Driver[SnakeState] = Driver(system)
        self.step_s = self.query_s = 0.0

    @classmethod
    def in_lumen(
        cls,
        mesh: TriangleMesh,
        start: ArrayLike,
        end: ArrayLike,
        links: int | None = None,
        settings: DriveSettings | None = None,
        *,
        snake: SnakeModel | None = None,
        tissue: TissueMotion | None = None,
        tip_s: float = 0.0,
        anyway: bool = False,
    ) -> Self:
        """A snake before the entrance of your own lumen, with the pathway that is found through it.

        Args:
            mesh: the lumen's surface, mm; start, end: (3,) clicks in the patient frame.
            links: number of links; None: as many as the path to the end needs. snake: model of a link; None: the
                paper's.
            tissue: motion of the pathway; None: it is still. tip_s: initial arc length of the tip, mm.
            anyway: accept a pathway that is narrower than the robot within its range.

        Raises:
            PathwayError: clicks or a surface that give no path; a pathway that is narrower than the robot.
            InputError: as the class. RobotError: an invalid number of links.
        """
        settings, model = settings or DriveSettings(), snake or SnakeModel(1)
        lumen = lumen_between(mesh, start, end, model, settings, tissue)
        robot = lumen.snake(model, links)
        if not anyway:
            narrowest(
                lumen.pathway, robot, settings.bound_mm, robot.reach_mm(), lumen.curve, middle=lumen.centreline
            ).refuse(robot)
        return cls(robot, lumen.pathway, settings, lumen.curve, lumen.slack, tip_s)

    def step(self, command: SnakeCommand, dt: float | None = None) -> SnakeState:
        """One step of ``dt`` s (None: the settings' step).

        Raises:
            InputError: a step that is not finite and positive, or no ``SnakeCommand``.
        """
        dt = self.settings.step_s if dt is None else positive("a step's time in s", dt)
        if not isinstance(command, SnakeCommand):
            raise InputError(f"{command!r:.60} is no command: give SnakeCommand(insert_mm_per_s=…, camera_mm_per_s=…)")
        if command.bend is not None and len(command.bend) != self.distal.dof:
            raise InputError(f"a bend of {len(command.bend)} joints: give {self.distal.dof}")
        return self.act(act_of(command, dt, self.state))

    def act(self, act: Act) -> SnakeState:
        """Carry out what an operator does."""
        timed, began = self.state.steps % _TIMED == 0, perf_counter()
        self.state = state = self.driver.act(act)
        self.step_s = perf_counter() - began
        if timed:
            frames, asked = self.snake.frames(state.q, state.base), perf_counter()
            self.query.deviations(state.packed, frames, state.windows)
            self.query_s = perf_counter() - asked
        return state

    def ask(self, request: Request) -> None:
        """Carry out a request."""
        self.state = self.driver.apply(request)
