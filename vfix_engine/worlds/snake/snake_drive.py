"""A snake that a script drives step by step, without a clock; plans are made within a step."""

from __future__ import annotations

from time import perf_counter
from typing import Protocol, Self

from numpy.typing import ArrayLike

from ...arrays import Array
from ...errors import InputError
from ...geometry.curve import Curve
from ...geometry.mesh import TriangleMesh
from ...pathway.pathway import Pathway, TissueMotion
from ...robots.snake import SnakeModel
from ...snake.control.tip_control import DistalContext
from ...validate import positive
from .command import SnakeCommand
from .constants import DriveConstants, start_of
from .distal import bend_of, can_look, distal_context, ready_to_look
from .lumen import lumen_between
from .narrow import narrowest
from .settings import DriveSettings
from .state import SnakeState
from .step import step
from .tissue import lost

_TIMED = 10  # interval in steps at which one query of all links is timed


class Observer(Protocol):
    """Observer of a drive; its calls, in their order, repeat the drive."""

    def stepped(self, command: SnakeCommand, dt: float) -> None:
        """The drive has made a step of ``dt`` s with this command."""

    def planned_anew(self, waypoint_mm: float) -> None:
        """Plans are discarded; shapes are ``waypoint_mm`` apart from now on."""

    def made_ready(self) -> None:
        """The control of the distal links is made ready."""


class SnakeDrive:
    """A snake in a lumen: ``constants``, some of which are attributes, and the ``state``, which each step replaces.

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
        self._go_on(*start)

    def _go_on(self, constants: DriveConstants, state: SnakeState) -> None:
        self.constants, self.state = constants, state
        self.snake, self.distal, self.pathway = constants.snake, constants.distal, constants.pathway
        self.query, self.distal_limits, self.hand = constants.query, constants.distal_limits, constants.hand
        self.observer: Observer | None = None

    @classmethod
    def at(cls, constants: DriveConstants, state: SnakeState) -> Self:
        """A drive that continues from a state."""
        drive = cls.__new__(cls)
        drive._go_on(constants, state)
        return drive

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
            narrowest(lumen.pathway, robot, settings.bound_mm, robot.reach_mm()).refuse(robot)
        return cls(robot, lumen.pathway, settings, lumen.curve, lumen.slack, tip_s)

    def step(self, command: SnakeCommand, dt: float | None = None) -> SnakeState:
        """One step of ``dt`` s (None: the settings' step).

        Raises:
            InputError: a step that is not finite and positive, or no ``SnakeCommand``.
        """
        began = perf_counter()
        dt = self.settings.step_s if dt is None else positive("a step's time in s", dt)
        if not isinstance(command, SnakeCommand):
            raise InputError(f"{command!r:.60} is no command: give SnakeCommand(insert_mm_per_s=…, camera_mm_per_s=…)")
        if command.bend is not None and len(command.bend) != self.distal.dof:
            raise InputError(f"a bend of {len(command.bend)} joints: give {self.distal.dof}")
        timed = self.state.steps % _TIMED == 0
        state = step(self.constants, self.state, command, dt)
        query_s = self._query_s(state) if timed else state.query_s
        self.state = state._replace(query_s=query_s, step_s=perf_counter() - began)
        if self.observer is not None:
            self.observer.stepped(command, dt)
        return self.state

    def ready_to_look(self) -> None:
        """Make the control of the distal links ready here, if it is not; a camera command does this implicitly."""
        if self.observer is not None:
            self.observer.made_ready()
        self.state = ready_to_look(self.constants, self.state)

    def plan_anew(self, waypoint_mm: float) -> None:
        """Discard plans; from here on shapes are ``waypoint_mm`` apart."""
        if self.observer is not None:
            self.observer.planned_anew(waypoint_mm)
        self.state = planned_anew(self.state, waypoint_mm)

    def distal_context(self) -> DistalContext:
        """The present position of the distal links, for their control."""
        return distal_context(self.constants, self.state)

    def _query_s(self, state: SnakeState) -> float:
        """Duration of a query of all links, s."""
        frames, asked = self.snake.frames(state.q, state.base), perf_counter()
        self.query.deviations(state.packed, frames, state.windows)
        return perf_counter() - asked

    @property
    def settings(self) -> DriveSettings:
        """In force."""
        return self.state.settings

    @property
    def bound(self) -> Array:
        """(L,) mm, b_i at the links' positions."""
        return self.state.bound

    @property
    def q(self) -> Array:
        """(2L,) rad."""
        return self.state.q

    @property
    def tip_s(self) -> float:
        """Arc length of the tip, mm."""
        return self.state.tip_s

    @property
    def length_mm(self) -> float:
        """Of the curve that the robot conforms to."""
        return self.state.tissue.length_mm

    @property
    def can_look(self) -> bool:
        """Whether all the links that the camera command moves are inside."""
        return can_look(self.constants, self.state)

    @property
    def lost(self) -> str | None:
        """The reason why there is no valid pathway now; nothing moves until there is."""
        return lost(self.constants, self.state)

    @property
    def straight(self) -> bool:
        """Whether the distal links have the conforming shape."""
        return self.state.straight

    @property
    def tip(self) -> Array:
        """(3,) of the last link's far end, LPS mm."""
        tip: Array = self.snake.tip(self.q, self.state.base)[:3, 3]
        return tip

    @property
    def bend(self) -> Array:
        """(2L',) rad by which the distal joints differ from the conforming shape."""
        return bend_of(self.constants, self.state)

    @property
    def offset_mm(self) -> Array:
        """Distances of the joint centres that are inside to the curve, of the conforming shape."""
        shape = self.state.pose.shape
        inside: Array = shape.offset_mm[shape.joint_s >= 0.0]
        return inside


def planned_anew(state: SnakeState, spacing_mm: float) -> SnakeState:
    """Without plans; from here on shapes are ``spacing_mm`` apart."""
    state = state.restarted()
    return state._replace(ahead=state.ahead._replace(spacing_mm=spacing_mm))
