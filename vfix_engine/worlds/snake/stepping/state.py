"""The state of the driven snake: everything that its next step needs, as immutable values.

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
    """Pose of the robot and depth of its links; each certified motion replaces it as a whole.

    shape: the conforming one, without the operator's bend; q: (2L,) rad, with it.
    windows: (L, 2) segments in which links are measured; measured: (L,) links that are inside the pathway.
    bound: (L,) mm, b_i at the links' positions; deviation: (L,) eq. 9, 0 for links that are not measured.
    """

    shape: ShapeSolution
    q: Array
    windows: IntArray
    measured: BoolArray
    bound: Array
    deviation: Deviations


class Tissue(NamedTuple):
    """The last sample of the pathway.

    packed: that pathway; curve: followed by shapes, length_mm: its present length.
    seen_t: s, time of the sample; due: s, time of the next one; lost: the reason why there is no valid pathway.
    rim: (S + 1,) mm/s, how fast the wall of each segment moved, and 0.
    goal: the shape that conforms to the moved tissue, until it is reached.
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
    """A conforming shape along an insertion, and the arc length of its tip in mm."""

    place_mm: float
    shape: ShapeSolution


class Ahead(NamedTuple):
    """The next shapes of an insertion.

    last: the shape that was reached last, or from which planning continues; planned: the one that was planned last,
        which may have been discarded. sign: of the insertion, 0 where nothing is planned; samples: shapes in that
        direction.
    """

    spacing_mm: float
    last: ShapeSolution
    planned: ShapeSolution
    sign: int = 0
    samples: tuple[ShapeSample, ...] = ()

    def left(self, sign: float) -> int:
        """Number of known shapes in that direction."""
        return len(self.samples) if self.sign == sign else 0

    @property
    def end(self) -> ShapeSolution:
        """The last known shape."""
        return self.samples[-1].shape if self.samples else self.last

    def passed(self) -> Ahead:
        """The next shape has been reached."""
        return self._replace(last=self.samples[0].shape, samples=self.samples[1:])

    def restarted(self, shape: ShapeSolution) -> Ahead:
        """Continue from another shape; plans are discarded."""
        return Ahead(self.spacing_mm, shape, shape)


class SnakeState(NamedTuple):
    """The driven snake after a step, with its settings and the request under way.

    t: s; steps: since the start; mode: of the step.
    settings: current; adjusted: those that may change during a drive, which a script's do not; bounds: of the
        links by place.
    tip_s: mm, arc length of the tip. began: (2L,) rad, joints at the beginning of the step.
    control: of the distal links, changed only in a copy; settled: it is ready here; carried: with bends of another
        position, taken along by an insertion with a bent tip; by_joints: the links are bent by
        commands to their joints; trail: bends that led here.
    result: of the step; refused: what the certificate refused last.
    inserting: the last command did; toward: the direction of the last insertion.
    following: the shape follows the tissue. hand_joint: universal joint that a manual hand turns, 1:
        the last. refused_commands: that were not finite.
    query_s, step_s: measured durations of the last query of all links and of this step in s.
    period_s: of the next step. doing: the active request; bend_goal: (2L',) rad, its goal, None: none; looking:
        progress of a look-round; looked_deg: angle of the view in each direction in the last one.
    obeyed_mm: what was carried out of the camera commands so far, to the right and down in the picture.
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
    carried: bool = False
    by_joints: bool = False
    trail: Trail = Trail()
    result: Outcome = Outcome("rest")
    refused: Refusal | None = None
    inserting: bool = False
    toward: int = 1
    following: bool = True
    hand_joint: int = 1
    refused_commands: int = 0
    doing: Literal["", "straighten", "bend", "look"] = ""
    bend_goal: tuple[float, ...] | None = None
    looking: Looking | None = None
    looked_deg: tuple[float, ...] = (0.0,) * SIDES
    obeyed_mm: tuple[float, float] = (0.0, 0.0)

    @property
    def certified(self) -> bool:
        """Whether every motion is certified; else bounds are measured and hold nothing."""
        return self.settings.arm == "certified"

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
        """The present pathway."""
        return self.tissue.packed

    @property
    def windows(self) -> IntArray:
        """(L, 2) segments in which links are measured."""
        return self.pose.windows

    @property
    def measured(self) -> BoolArray:
        """(L,) links that are inside the pathway."""
        return self.pose.measured

    @property
    def bound(self) -> Array:
        """(L,) mm, b_i at each link's position."""
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
        """The reason why it was scaled or held."""
        return self.result.words

    @property
    def limit(self) -> LimitedBy | None:
        """The limiting constraint."""
        return self.result.limit

    @property
    def held_at(self) -> Array | None:
        """(3,) LPS mm, the vertex that would be beyond its link's bound."""
        return self.result.at

    @property
    def straight(self) -> bool:
        """Whether the distal links have the conforming shape."""
        return bool(np.abs(self.pose.q - self.pose.shape.q).max() < STRAIGHT)

    def restarted(self) -> SnakeState:
        """Without plans beyond the robot's shape."""
        return self._replace(ahead=self.ahead.restarted(self.pose.shape))
