"""The driven snake at one moment: all that its next step needs, as immutable values.

Arrays are replaced by a step and never written to, so states share them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from ....arrays import Array, BoolArray, IntArray
from ....geometry.curve import Curve
from ....pathway.limits.link_bounds import LinkBounds
from ....pathway.packed import PackedPathway
from ....pathway.query.query import Deviations
from ....snake.conform.conformance import ShapeSolution
from ....snake.control.tip_control import TipControl
from ....snake.haptics.hand_forces import Felt
from ....snake.haptics.haptics import Forces
from ..requests import SIDES
from ..settings import DriveSettings, SnakeSettings
from .outcome import LimitedBy, Outcome
from .refusal import Refusal
from .trail import Trail

if TYPE_CHECKING:
    from ..plans.look_progress import Looking

STRAIGHT = 1e-9  # [rad] off the conforming shape


class Pose(NamedTuple):
    """Where the robot is, and how deep its links are: each certified motion replaces it as a whole.

    shape: that conforms, without the operator's bend; q: (2L,) rad, with it.
    windows: (L, 2) segments that links are measured against; measured: (L,) links that are inside the pathway.
    bound: (L,) mm, b_i where the links are; deviation: (L,) eq. 9, 0 for links that are not measured.
    """

    shape: ShapeSolution
    q: Array
    windows: IntArray
    measured: BoolArray
    bound: Array
    deviation: Deviations


class Tissue(NamedTuple):
    """The pathway as it was seen last.

    packed: that pathway; curve: what shapes conform to, length_mm: of what it has become.
    seen_t: s, when; due: s, when it is seen next; lost: in words, why there is no pathway.
    rim: (S + 1,) mm/s, how fast the wall of each segment moved, and 0.
    goal: the shape that the tissue's motion asks for, while it is not reached.
    """

    packed: PackedPathway
    curve: Curve
    length_mm: float
    rim: Array
    seen_t: float = 0.0
    due: float = 0.0
    lost: str | None = None
    goal: ShapeSolution | None = None


class ShapeSample(NamedTuple):
    """A conforming shape on the way of an insertion, and the place of its tip in mm."""

    place_mm: float
    shape: ShapeSolution


class Ahead(NamedTuple):
    """Where an insertion goes next.

    last: the shape that was taken last, or that planning goes on from; planned: the one that was planned last, which
        may have been let go. sign: of the insertion, 0 where nothing is planned; samples: shapes in that direction.
    """

    spacing_mm: float
    last: ShapeSolution
    planned: ShapeSolution
    sign: int = 0
    samples: tuple[ShapeSample, ...] = ()

    def left(self, sign: float) -> int:
        """How many shapes are known in that direction."""
        return len(self.samples) if self.sign == sign else 0

    @property
    def end(self) -> ShapeSolution:
        """The last shape that is known."""
        return self.samples[-1].shape if self.samples else self.last

    def passed(self) -> Ahead:
        """The next shape has been taken."""
        return self._replace(last=self.samples[0].shape, samples=self.samples[1:])

    def restarted(self, shape: ShapeSolution) -> Ahead:
        """Go on from another shape; what was planned is let go."""
        return Ahead(self.spacing_mm, shape, shape)


class SnakeState(NamedTuple):
    """The driven snake after a step, with its settings and the request under way.

    t: s; steps: since the start; mode: what the step was about.
    settings: in force; adjusted: those that may change while it is driven, which a script's do not; bounds: of the
        links by place.
    tip_s: mm, how far the tip is in. began: (2L,) rad, joints at the beginning of the step.
    control: of the distal links, changed only in a copy; settled: it is ready here; by_joints: the links are bent by
        commands to their joints; trail: bends that led here.
    result: of the step; refused: what the certificate refused last.
    inserting: the last command did; toward: the direction of the last insertion.
    following: the shape follows the tissue. refused_commands: that were not finite.
    period_s: of the next step. doing: the request under way; bend_goal: (2L',) rad that it is for, None: none; looking:
        where a look-round is; looked_deg: how far the last one turned the view to each side.
    """

    settings: DriveSettings
    adjusted: SnakeSettings
    bounds: LinkBounds
    pose: Pose
    tip_s: float
    began: Array
    tissue: Tissue
    ahead: Ahead
    control: TipControl
    felt: Felt
    period_s: float
    t: float = 0.0
    steps: int = 0
    mode: Literal["inserting", "looking"] = "inserting"
    settled: bool = False
    by_joints: bool = False
    trail: Trail = Trail()
    result: Outcome = Outcome("rest")
    refused: Refusal | None = None
    inserting: bool = False
    toward: int = 1
    following: bool = True
    refused_commands: int = 0
    doing: Literal["", "straighten", "bend", "look"] = ""
    bend_goal: tuple[float, ...] | None = None
    looking: Looking | None = None
    looked_deg: tuple[float, ...] = (0.0,) * SIDES

    @property
    def base(self) -> Array:
        """(4, 4) transform_base_to_patient."""
        return self.pose.shape.base

    @property
    def q(self) -> Array:
        """(2L,) rad."""
        return self.pose.q

    @property
    def q_nominal(self) -> Array:
        """(2L,) q̃, without the operator's bend."""
        return self.pose.shape.q

    @property
    def joint_s(self) -> Array:
        """(L + 1,) arc lengths of the joints of the conforming shape, mm."""
        return self.pose.shape.joint_s

    @property
    def steering(self) -> tuple[float, float]:
        """(u, v) = r (cos ϑ, sin ϑ); (0, 0) under the quadratic program."""
        return self.control.steering

    @property
    def packed(self) -> PackedPathway:
        """The pathway of this moment."""
        return self.tissue.packed

    @property
    def windows(self) -> IntArray:
        """(L, 2) segments that links are measured against."""
        return self.pose.windows

    @property
    def measured(self) -> BoolArray:
        """(L,) links that are inside the pathway."""
        return self.pose.measured

    @property
    def bound(self) -> Array:
        """(L,) mm, b_i where each link is."""
        return self.pose.bound

    @property
    def deviation(self) -> Deviations:
        """(L,) eq. 9 against that pathway, 0 for links that are not measured."""
        return self.pose.deviation

    @property
    def forces(self) -> Forces:
        """On the operator's hand."""
        return self.felt.forces

    @property
    def outcome(self) -> str:
        """Of the step: 'rest', 'moved', 'shrunk' or 'held'."""
        return self.result.name

    @property
    def held_by(self) -> str | None:
        """In words, what shrank or held it."""
        return self.result.words

    @property
    def limit(self) -> LimitedBy | None:
        """What that was."""
        return self.result.limit

    @property
    def held_at(self) -> Array | None:
        """(3,) LPS mm, the vertex that would be beyond its link's bound."""
        return self.result.at

    @property
    def straight(self) -> bool:
        """Whether the distal links lie as the conforming shape has them."""
        return bool(np.abs(self.pose.q - self.pose.shape.q).max() < STRAIGHT)

    def restarted(self) -> SnakeState:
        """With nothing planned beyond the shape that the robot has."""
        return self._replace(ahead=self.ahead.restarted(self.pose.shape))
