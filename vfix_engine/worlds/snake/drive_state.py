"""What goes into a step of the driven snake and what comes out of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ...arrays import Array, IntArray
from ...errors import InputError
from ...pathway.checks import MOST_ANGLES, MOST_CONTOURS, MOST_FITTED
from ...pathway.limits.link_bounds import BOUND_MM, LinkBounds
from ...pathway.packed import PackedPathway
from ...pathway.query.query import Deviations
from ...robots.snake import MOST_LINKS
from ...snake.haptics.haptics import Forces
from ...validate import positive, whole, within

Control = Literal["parameterised", "qp"]
LimitedBy = Literal["bound", "speed", "step", "bends", "bent", "end", "tissue", "insertion", "planning"]
MOST_MM_PER_S = 1000.0  # ten joints at 36°/s, each with all five links ahead of it, are slower
CONTROLS: tuple[Control, ...] = ("parameterised", "qp")
_FINEST_MM = 0.01  # of a step or a waypoint: with finer ones a drive takes hours
_FINEST_S = 1e-5  # of a step
_MOST_BENT = 0.5  # r: a tip that is bent more is not straight
_MOST_VERTICES = 100_000  # of a link


class Outcome(NamedTuple):
    """What a step came to, in words what shrank or held it, which limit that was, and where (3,) in LPS mm."""

    name: Literal["rest", "moved", "shrunk", "held"]
    words: str | None = None
    limit: LimitedBy | None = None
    at: Array | None = None


@dataclass(frozen=True)
class DriveSettings:
    """How a snake is driven; lengths in mm, times in s.

    step_s: one step while looking round; the paper's loop is faster than 1 kHz.
    insertion_mm_per_s, insertion_step_mm: the operator's speed, and the most that one step inserts.
    waypoint_mm: of insertion between two conforming shapes; an operator who is held draws back and comes with others.
        This and the step are 0.01 mm at least.
    manipulated: distal links that the camera command moves, L' of Kwok 2013, section III.B.
    bound_mm, tip_bound_mm: b_i of eq. 17, of all links and of the last one, everywhere as given. None: by place, at
        most 8 mm and 4 mm and half the lumen's radius (``link_bounds``); for the tip alone: half the others'.
    r_max: largest r, 1 at least; reoptimise_below: control bends are found anew, and the tip is inserted, only while
        r is not larger; from 0 to 0.5.
    bends: control configurations, 4 or 8.
    control: the paper's parameterised control, or the quadratic program.
    contours, interpolated, angles: of the pathway; angles 1 are circles. quantile: of the radii measured around a
        contour the one that a circle gets.
    vertices_per_link: of the surface that is measured.
    speed_max: rad/s of every joint, Table II.
    tissue_s: so often a pathway that moves is followed.
    look_aim_deg: so far a look-round turns the view to each side, if the bounds let it; look_least_deg: less than that
        to any side is no look-round.
    look_within_mm: so far before or behind a landmark a better place to look round from is looked for.

    Raises:
        InputError: a number out of its range.
    """

    step_s: float = 0.001
    insertion_mm_per_s: float = 20.0
    insertion_step_mm: float = 0.5
    waypoint_mm: float = 1.0
    manipulated: int = 5
    bound_mm: float | None = None
    tip_bound_mm: float | None = None
    r_max: float = 1.4
    reoptimise_below: float = 0.15
    bends: Literal[4, 8] = 8
    control: Control = "parameterised"
    contours: int = 50
    interpolated: int = 197
    angles: int = 1
    quantile: float = 0.3
    vertices_per_link: int = 100
    speed_max: float = math.radians(36.0)
    tissue_s: float = 0.02
    look_aim_deg: float = 45.0
    look_least_deg: float = 20.0
    look_within_mm: float = 10.0

    def __post_init__(self) -> None:
        for name in ("insertion_mm_per_s", "speed_max", "tissue_s"):
            positive(_called(name), getattr(self, name))
        for name in ("bound_mm", "tip_bound_mm"):
            if getattr(self, name) is not None:
                positive(_called(name), getattr(self, name))
        for name, low, high in (
            ("step_s", _FINEST_S, math.inf), ("insertion_step_mm", _FINEST_MM, math.inf),
            ("waypoint_mm", _FINEST_MM, math.inf), ("r_max", 1.0, math.inf), ("reoptimise_below", 0.0, _MOST_BENT),
            ("quantile", 0.0, 1.0),
        ):  # fmt: skip
            within(_called(name), getattr(self, name), low, high)
        for name, low, high in (
            ("manipulated", 1, MOST_LINKS), ("vertices_per_link", 1, _MOST_VERTICES), ("contours", 2, MOST_FITTED),
            ("interpolated", 2, MOST_CONTOURS), ("angles", 1, MOST_ANGLES),
        ):  # fmt: skip
            object.__setattr__(self, name, whole(_called(name), getattr(self, name), low, high))
        if self.angles == 2:
            raise InputError("drive setting angles: a contour has 1 radius, or at least 3 around its centre; not 2")
        within(_called("look_within_mm"), self.look_within_mm, 0.0, math.inf)
        within(_called("look_aim_deg"), self.look_aim_deg, 1.0, 90.0)
        within(_called("look_least_deg"), self.look_least_deg, 1.0, self.look_aim_deg)
        if self.control not in CONTROLS:
            raise InputError(f"control is one of {', '.join(CONTROLS)}, not {self.control!r}")
        if self.bends not in (4, 8):
            raise InputError(f"there are 4 or 8 control bends, not {self.bends}")

    def bounds(self, links: int) -> LinkBounds:
        """b_i of a robot of so many links."""
        return LinkBounds.of(self.bound_mm, self.tip_bound_mm, links)

    @property
    def body_bound(self) -> float:
        """The most that b_i of a link is, in mm."""
        return BOUND_MM if self.bound_mm is None else self.bound_mm

    @property
    def tip_bound(self) -> float:
        """The most that b_i of the last link is, in mm."""
        return float(self.bounds(1).most[-1])


def _called(name: str) -> str:
    return f"drive setting {name}"


@dataclass(frozen=True)
class Command:
    """What the operator asks for; what is not finite is left out, counts as nothing asked for, and is counted.

    Insertion comes first: in a step that inserts the tip is not bent, and the state says so.

    insert_mm_per_s: forwards, negative backwards.
    camera_mm_per_s: of the camera in its picture's plane, x to the right, y down.
    straighten: bring the manipulated links back to the shape that conforms.
    bend: (2L',) rad by which the manipulated joints are to differ from the conforming shape, as far as a step goes; it
        comes before a camera command. None: no such command.

    Raises:
        InputError: values that are no real numbers, or a camera command that is not two of them.
    """

    insert_mm_per_s: float = 0.0
    camera_mm_per_s: tuple[float, float] = (0.0, 0.0)
    straighten: bool = False
    bend: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "insert_mm_per_s", _real("insert_mm_per_s", self.insert_mm_per_s))
        camera: Any = self.camera_mm_per_s
        if isinstance(camera, str) or not hasattr(camera, "__len__") or len(camera) != 2:
            raise InputError(f"camera_mm_per_s is two numbers, x and y, not {camera!r}")
        object.__setattr__(self, "camera_mm_per_s", tuple(_real("camera_mm_per_s", value) for value in camera))
        if not isinstance(self.straighten, bool | np.bool_):
            raise InputError(f"straighten is true or false, not {self.straighten!r}")
        bend: Any = self.bend
        if bend is not None:
            if isinstance(bend, str) or not hasattr(bend, "__len__"):
                raise InputError(f"bend is two numbers for each manipulated link, not {bend!r}")
            object.__setattr__(self, "bend", tuple(_real("bend", value) for value in bend))

    @property
    def finite(self) -> bool:
        """Whether all its numbers are."""
        numbers = (self.insert_mm_per_s, *self.camera_mm_per_s, *(self.bend or ()))
        return all(math.isfinite(value) for value in numbers)

    @property
    def cleaned(self) -> Command:
        """Without what is not finite: the insertion, the whole camera command or the whole bend; the rest stays."""
        camera = self.camera_mm_per_s if all(map(math.isfinite, self.camera_mm_per_s)) else (0.0, 0.0)
        bend = self.bend if self.bend is not None and all(map(math.isfinite, self.bend)) else None
        insert = self.insert_mm_per_s if math.isfinite(self.insert_mm_per_s) else 0.0
        return Command(insert, camera, self.straighten, bend)

    @property
    def bends(self) -> bool:
        """Whether the manipulated links are to move."""
        return self.straighten or any(self.camera_mm_per_s) or self.bend is not None

    @property
    def camera(self) -> Array:
        """The camera command (2,) in mm/s, no faster than any camera on a snake goes."""
        x, y = self.camera_mm_per_s
        size = math.hypot(x, y)
        return np.array([x, y]) * min(1.0, MOST_MM_PER_S / size) if size > 0.0 else np.zeros(2)


def _real(name: str, value: Any) -> float:
    if not isinstance(value, bool) and isinstance(value, Real):
        try:
            return float(value)
        except OverflowError:
            return math.inf
    raise InputError(f"{name} takes real numbers, not {value!r}")


class Observer(Protocol):
    """Hears of everything that is done with a drive, in the order in which it is done again to repeat it."""

    def stepped(self, command: Command, dt: float) -> None:
        """The drive has made a step of ``dt`` s; the command as it was given."""

    def planned_anew(self, waypoint_mm: float) -> None:
        """What was planned ahead is forgotten; shapes are ``waypoint_mm`` apart from now on."""

    def made_ready(self) -> None:
        """The control of the distal links gets ready."""


@dataclass(frozen=True, eq=False)
class DriveState:
    """The driven snake after a step.

    t: s; mode: what the step was about.
    base: (4, 4) transform_base_to_patient; q: (2L,) rad; q_conformed: (2L,) q̃, without the operator's bend.
    tip_s: mm, how far the tip is in; joint_s: (L + 1,) arc lengths of the joints of the conforming shape.
    steering: (u, v) = r (cos ϑ, sin ϑ); (0, 0) under the quadratic program.
    packed: the pathway of this moment; windows: (L, 2); measured: (L,) links that are inside the pathway.
    bound: (L,) mm, b_i where each link is. deviation: (L,) eq. 9 against that pathway, 0 for links that are not
        measured.
    forces: on the operator's hand.
    outcome: 'rest' where nothing is asked for or it is so already, 'moved', 'shrunk' to a part of the wanted step, or
        'held'. 'shrunk' too where a command was carried out but the tissue's motion could not be followed, or where one
        to bend came with insertion. A bend and 'straighten' name a goal and no speed: on the way there is 'moved'.
    held_by: in words, what shrank or held it; limit: what that was, 'bound' of a link, 'speed' of the joints, 'step':
        the most that one inserts, 'bends': none moves the camera so, 'bent': the tip has to be straightened first,
        'end' of the path, 'tissue' without a pathway, 'insertion' before the camera, 'planning' of what is to come.
    held_at: (3,) LPS mm, the vertex that would be beyond its link's bound.
    query_s, step_s: what the last query of all links and this step took on the clock, s.
    """

    t: float
    mode: Literal["inserting", "looking"]
    base: Array
    q: Array
    q_conformed: Array
    tip_s: float
    joint_s: Array
    steering: tuple[float, float]
    packed: PackedPathway
    windows: IntArray
    measured: NDArray[np.bool_]
    bound: Array
    deviation: Deviations
    forces: Forces
    outcome: Literal["rest", "moved", "shrunk", "held"]
    held_by: str | None
    limit: LimitedBy | None
    held_at: Array | None
    query_s: float
    step_s: float


def both(tissue: Outcome, command: Outcome) -> Outcome:
    """Of following the tissue and a command; tissue that could not be followed is not passed over."""
    if tissue.name == "held" and command.name == "moved":
        return tissue._replace(name="shrunk")
    return command
