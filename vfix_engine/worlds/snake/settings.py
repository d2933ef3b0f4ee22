"""The settings of a driven snake: fixed for a whole drive, and those that may change during it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal, NamedTuple, get_args

from ...errors import InputError
from ...pathway.checks import MOST_ANGLES, MOST_CONTOURS, MOST_FITTED
from ...pathway.limits.link_bounds import BOUND_MM, LinkBounds
from ...robots.snake import MOST_LINKS
from ...snake.haptics.haptics import HapticSettings
from ...validate import positive, several, whole, within

Arm = Literal["manual", "guided", "certified"]
ARMS: tuple[Arm, ...] = get_args(Arm)
Control = Literal["parameterised", "qp", "view"]
CONTROLS: tuple[Control, ...] = get_args(Control)
FINEST_MM = 0.01  # of a step or between two shapes or depths: with smaller ones a drive takes hours
_FINEST_S = 1e-5  # of a step
_MOST_YIELD = 1000.0  # [mm/s per N]
_LEAST_BOUND_MM, _MOST_OF_LINK = 0.1, 50.0  # [mm] of one link's bound; mm or N/mm of any of its values
_MOST_BENT = 0.5  # r: beyond it a tip does not count as straight
_MOST_VERTICES = 100_000  # of a link


class Range(NamedTuple):
    """Closed range of one setting, its unit and a label that a person reads."""

    low: float
    high: float
    unit: str
    label: str


@dataclass(frozen=True)
class DriveSettings:
    """How a snake is driven; lengths in mm, times in s.

    step_s: one step while looking round; the paper's loop is faster than 1 kHz.
    insertion_mm_per_s, insertion_step_mm: the operator's speed, and the most that one step inserts.
    waypoint_mm: insertion between two conforming shapes; a held operator retracts and retries with other values.
        This and the step are 0.01 mm at least.
    manipulated: distal links that the camera command moves, L' of Kwok 2013, section III.B.
    bound_mm, tip_bound_mm: b_i of eq. 17, of all links and of the last one, the same everywhere. None: by position, at
        most 8 mm and 4 mm and half the lumen's radius (``link_bounds``); for the tip alone: half the others'.
    link_bounds_mm: b_i of each manipulated link, the last one's last; None, as a whole or of one: as above.
    springs_n_per_mm, thresholds_mm: k_i and a_i of (33), of each manipulated link; None: those of Table II.
    r_max: largest r, 1 at least; reoptimise_below: control bends are recomputed only while r is not larger; from 0 to
        0.5. lock_bend: a bent tip is inserted and drawn back with its bend, relative to the pathway (Kwok 2013, section
        IV.C.1); False: with a larger r it has to be straightened first.
    bends: control configurations, 4 or 8.
    arm: who keeps the links in the pathway. 'manual': the hand alone, which turns one of the last two universal joints
        at a time (Kwok 2013, section IV.C.1, the control experiment); 'guided': the hand, which feels (31)-(35);
        'certified': every motion is certified. In the first two nothing but joint range and speed is refused.
    yield_mm_per_s_per_n: admittance of a guided hand without a force device, by which the guidance (35) moves the
        camera while the hand pulls; 0 where a device exerts the force itself. Assumed: at 10 a pull of 20 mm/s is in
        balance with 2 N, the tip 4.4 mm outside.
    control: the paper's parameterised control, the quadratic program, or the program that also turns the view to the
        side to which the camera is pulled.
    contours, interpolated, angles: of the pathway; 1 angle gives circles. quantile: of the radii measured around a
        contour, which becomes a circle's radius.
    vertices_per_link: of the measured surface.
    speed_max: rad/s of every joint, Table II.
    tissue_s: period at which a moving pathway is followed.
    look_aim_deg: angle of a look-round in each direction, if the bounds permit; look_least_deg: with less than that
        in any direction a look-round is incomplete.
    look_within_mm: range before and behind a landmark in which a better position for a look-round is sought.

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
    link_bounds_mm: tuple[float | None, ...] | None = None
    springs_n_per_mm: tuple[float, ...] | None = None
    thresholds_mm: tuple[float, ...] | None = None
    r_max: float = 1.4
    reoptimise_below: float = 0.15
    lock_bend: bool = True
    bends: Literal[4, 8] = 8
    control: Control = "parameterised"
    arm: Arm = "certified"
    yield_mm_per_s_per_n: float = 10.0
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
            ("step_s", _FINEST_S, math.inf), ("insertion_step_mm", FINEST_MM, math.inf),
            ("waypoint_mm", FINEST_MM, math.inf), ("r_max", 1.0, math.inf), ("reoptimise_below", 0.0, _MOST_BENT),
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
        if self.arm not in ARMS:
            raise InputError(f"arm is one of {', '.join(ARMS)}, not {self.arm!r:.20}")
        within(_called("yield_mm_per_s_per_n"), self.yield_mm_per_s_per_n, 0.0, _MOST_YIELD)
        if not isinstance(self.lock_bend, bool):
            raise InputError(f"drive setting lock_bend is true or false, not {self.lock_bend!r:.20}")
        if not (self.lock_bend or self.arm == "certified"):
            raise InputError(f"the arm '{self.arm}' refuses no insertion of a bent tip: leave lock_bend on")
        if self.bends not in (4, 8):
            raise InputError(f"there are 4 or 8 control bends, not {self.bends}")

        self._check_links()

    def _check_links(self) -> None:
        """The values of single links, as tuples of finite numbers."""
        for name, low in (("link_bounds_mm", _LEAST_BOUND_MM), ("springs_n_per_mm", 0.0), ("thresholds_mm", 0.0)):
            given = getattr(self, name)
            if given is None:
                continue
            given = several(_called(name), given)
            if len(given) != self.manipulated:
                raise InputError(f"{_called(name)}: {self.manipulated} values, one for each link, not {len(given)}")
            for value in given:
                if value is not None or name != "link_bounds_mm":
                    within(_called(name), value, low, _MOST_OF_LINK)
            object.__setattr__(self, name, given)

    def bounds(self, links: int) -> LinkBounds:
        """b_i of a robot of ``links`` links."""
        bounds = LinkBounds.of(self.bound_mm, self.tip_bound_mm, links)
        return bounds if self.link_bounds_mm is None else bounds.with_last(self.link_bounds_mm)

    def haptics(self) -> HapticSettings:
        """The forces on the hand: Table II, with springs and thresholds of the links that are set."""
        usual = HapticSettings().for_links(self.manipulated)
        return replace(
            usual,
            spring=self.springs_n_per_mm or usual.spring,
            threshold=self.thresholds_mm or usual.threshold,
        )

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
class SnakeSettings:
    """Current settings; immutable, checked when made. ``DriveSettings`` has those fixed for a whole drive.

    step_s: the control period.
    insertion_mm_per_s, camera_mm_per_s: speeds of an axis that is fully deflected.
    bound_mm, tip_bound_mm: b_i of Kwok 2013, eq. 17, of all links and of the last one; None as in ``DriveSettings``.
    reoptimise_below: r up to which control bends are recomputed.

    Raises:
        InputError: a value that is not finite or out of its range.
    """

    step_s: float = 1e-3
    insertion_mm_per_s: float = 20.0
    camera_mm_per_s: float = 30.0
    bound_mm: float | None = None
    tip_bound_mm: float | None = None
    reoptimise_below: float = 0.15

    def __post_init__(self) -> None:
        for name, allowed in _RANGES.items():
            value = getattr(self, name)
            if value is None and name in _BY_PLACE:
                continue
            if not _is_finite(value) or not allowed.low <= value <= allowed.high:
                unit = f" {allowed.unit}" if allowed.unit else ""
                raise InputError(
                    f"{allowed.label} ({name}) is {value!r}; allowed is {allowed.low:g} … {allowed.high:g}{unit}"
                )
            object.__setattr__(self, name, float(value))

    @staticmethod
    def bounds() -> Mapping[str, Range]:
        """The range of every setting by its name."""
        return dict(_RANGES)

    def clamped(self, /, **changes: float) -> SnakeSettings:
        """The same with changes, each brought into its range.

        Raises:
            InputError: an unknown name, or a value that is not a finite number.
        """
        kept: dict[str, float] = {}
        for name, value in changes.items():
            if name not in _RANGES:
                raise InputError(f"no setting is called '{name}'; there are {', '.join(_RANGES)}")
            if not _is_finite(value):
                raise InputError(f"{_RANGES[name].label} ({name}) must be a finite number, not {value!r}")
            kept[name] = float(min(max(value, _RANGES[name].low), _RANGES[name].high))
        return replace(self, **kept)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON, in the unit that the name ends in."""
        return asdict(self)

    @classmethod
    def from_dict(cls, data: dict[str, Any], /) -> SnakeSettings:
        """The inverse. Raises InputError for an unknown name or a value out of its range."""
        known = {field.name for field in fields(cls)}
        unknown = sorted(set(data) - known)
        if unknown:
            raise InputError(f"unknown settings: {', '.join(unknown)}; known are {', '.join(sorted(known))}")
        return cls(**data)

    def of_drive(self, fixed: DriveSettings) -> DriveSettings:
        """The drive's settings: these, and the others from ``fixed``."""
        return replace(
            fixed,
            step_s=self.step_s,
            insertion_mm_per_s=self.insertion_mm_per_s,
            bound_mm=self.bound_mm,
            tip_bound_mm=self.tip_bound_mm,
            reoptimise_below=self.reoptimise_below,
        )


def _is_finite(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < math.inf


_BY_PLACE = ("bound_mm", "tip_bound_mm")  # None where nobody has set them
_RANGES = {
    "step_s": Range(1e-4, 2e-2, "s", "Control period"),
    "insertion_mm_per_s": Range(0.1, 100.0, "mm/s", "Insertion speed"),
    "camera_mm_per_s": Range(0.1, 200.0, "mm/s", "Camera speed"),
    "bound_mm": Range(0.1, 50.0, "mm", "Bound of a link's deviation"),
    "tip_bound_mm": Range(0.1, 50.0, "mm", "Bound of the last link's deviation"),
    "reoptimise_below": Range(0.0, 0.5, "", "Bend r up to which control bends are recomputed"),
}
