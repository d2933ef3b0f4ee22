"""What a script sees of a driven snake."""

from __future__ import annotations

from ....arrays import Array
from ....runtime.requests import Request
from ....snake.control.tip_control import DistalContext
from ..requests import GetReady, PlanAnew
from ..settings import DriveSettings
from ..stepping.distal import bend_of, can_look, distal_context
from ..stepping.state import SnakeState
from ..stepping.tissue import lost
from ..system import SnakeSystem


class DriveView:
    """A system in a state: ``constants``, some of which are attributes, and the ``state``, with what follows from them.

    asked: requests that were made here; they change this state, and are for whoever steps the system to apply.
    """

    def __init__(self, system: SnakeSystem, state: SnakeState) -> None:
        self.system, self.state, self.constants = system, state, system.constants
        self.snake, self.distal, self.pathway = self.constants.snake, self.constants.distal, self.constants.pathway
        self.query, self.distal_limits = self.constants.query, self.constants.distal_limits
        self.hand = self.constants.hand
        self.asked: list[Request] = []

    def ask(self, request: Request) -> None:
        """Make a request."""
        self.state = self.system.apply(self.state, request)
        self.asked.append(request)

    def ready_to_look(self) -> None:
        """Let the control of the distal links get ready here, if it is not; a camera command does it by itself."""
        self.ask(GetReady())

    def plan_anew(self, waypoint_mm: float) -> None:
        """Forget what was planned ahead; from here on in shapes ``waypoint_mm`` apart."""
        self.ask(PlanAnew(waypoint_mm))

    def distal_context(self) -> DistalContext:
        """Where the distal links are now, for a control of them."""
        return distal_context(self.constants, self.state)

    @property
    def settings(self) -> DriveSettings:
        """In force."""
        return self.state.settings

    @property
    def bound(self) -> Array:
        """(L,) mm, b_i where the links are."""
        return self.state.bound

    @property
    def q(self) -> Array:
        """(2L,) rad."""
        return self.state.q

    @property
    def tip_s(self) -> float:
        """How far the tip is in, mm."""
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
        """In words, why the tissue leaves no pathway now; nothing moves until it does."""
        return lost(self.constants, self.state)

    @property
    def straight(self) -> bool:
        """Whether the distal links lie as the conforming shape has them."""
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
