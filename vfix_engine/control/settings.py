"""Settings of the controller, each with its range, unit and label."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, fields, replace
from functools import cached_property
from typing import Any

from ..errors import InputError
from ..virtual_fixtures import stoppable_step

# Settings of plans from earlier versions that no longer have an effect; they are ignored when read.
RETIRED = frozenset({"group_flat_mm"})


@dataclass(frozen=True)
class Bound:
    """Closed range of a setting, its unit and its label."""

    low: float
    high: float
    unit: str
    label: str


@dataclass(frozen=True)
class ControlSettings:
    """Settings of the controller; immutable, validated on construction (InputError).

    Values from Li 2007: k_d = 0.2, k_tau = 0, joint weights 0.01.
    The other values are the package's own; docs/concepts.md gives the reasons.
    surface_error_mm is the distance by which the anatomy can extend beyond its surface: it is added to the margin.
    compliance_mm_per_n is that of a robot under a hand on its handle, which the controller then compensates; the
    deflection under the force cap is added to every margin.

    Example:
        >>> settings = ControlSettings(margin_mm=0.5)
        >>> settings.clamped(margin_mm=99.0).margin_mm == ControlSettings.bounds()["margin_mm"].high
        True
        >>> ControlSettings.from_dict(settings.to_dict()) == settings
        True
    """

    dt_s: float = 1e-3
    margin_mm: float = 0.3
    threshold_mm: float = 3.0
    stiffness_n_per_mm: float = 0.25
    force_cap_n: float = 5.0
    gain_mm_per_s_per_n: float = 2.0
    rotation_gain_rad_per_s_per_nmm: float = 4e-4
    k_d: float = 0.2
    k_tau: float = 0.0
    capture_mm: float = 0.05
    view_distance_mm: float = 15.0
    target_tolerance_mm: float = 0.015
    approach_deceleration_mm_per_s2: float = 300.0
    acceleration_mm_per_s2: float = 300.0
    turn_acceleration_rad_per_s2: float = 5.0
    master_scale: float = 0.5
    master_stiffness_n_per_mm: float = 5.0
    surface_error_mm: float = 0.0
    compliance_mm_per_n: float = 0.0

    def __post_init__(self) -> None:
        for name, bound in self.bounds().items():
            value = getattr(self, name)
            if not _is_finite(value) or not bound.low <= value <= bound.high:
                unit = f" {bound.unit}" if bound.unit else ""
                raise InputError(f"{bound.label} ({name}) is {value!r}; allowed is {bound.low} … {bound.high}{unit}")

    @cached_property
    def reach_mm(self) -> float:
        """Search distance of the boundary: the threshold, and at least a fixed distance beyond the margin."""
        return max(self.threshold_mm, self.kept_mm + 1.0)

    @property
    def kept_mm(self) -> float:
        """Enforced distance from the anatomy's surface: the margin, the surface error and the deflection."""
        return self.margin_mm + self.surface_error_mm + self.deflection_mm

    @property
    def deflection_mm(self) -> float:
        """Largest deflection of the robot under the hand that the controller knows of."""
        return self.compliance_mm_per_n * self.force_cap_n

    @cached_property
    def sight_speed_mm_per_s(self) -> float:
        """Largest requested speed of any part of the tool: from it, the tool stops before anatomy not yet in sight."""
        change = self.approach_deceleration_mm_per_s2 * self.dt_s**2
        return stoppable_step(self.reach_mm - self.kept_mm, change) / self.dt_s

    @staticmethod
    def bounds() -> dict[str, Bound]:
        """Return the allowed range of every setting, by field name."""
        return dict(_BOUNDS)

    def clamped(self, /, **changes: float) -> ControlSettings:
        """Return a copy with changes clipped to their ranges; a NaN or an unknown name raises InputError."""
        kept: dict[str, float] = {}
        for name, value in changes.items():
            if name not in _BOUNDS:
                raise InputError(f"no setting is called '{name}'")
            if not _is_finite(value):
                raise InputError(f"{_BOUNDS[name].label} ({name}) must be a finite number")
            kept[name] = float(min(max(value, _BOUNDS[name].low), _BOUNDS[name].high))
        return replace(self, **kept)

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> ControlSettings:
        """Create settings from a plan's mapping; names in ``RETIRED`` are ignored, unknown ones raise InputError."""
        known = {f.name for f in fields(cls)}
        unknown = sorted(set(data) - known - RETIRED)
        if unknown:
            raise InputError(f"unknown settings: {', '.join(unknown)}; known are {', '.join(sorted(known))}")
        return cls(**{name: value for name, value in data.items() if name not in RETIRED})

    def to_dict(self) -> dict[str, float]:
        """Return every field by name, in the unit of its suffix; the inverse of ``from_dict``."""
        return asdict(self)


def _is_finite(value: Any) -> bool:
    """Whether the value is a finite number; excludes booleans and integers too large for a float."""
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < math.inf


_BOUNDS = {
    "dt_s": Bound(1e-4, 4e-2, "s", "Control period"),
    "margin_mm": Bound(0.05, 3.0, "mm", "Safety margin"),
    "threshold_mm": Bound(0.5, 10.0, "mm", "Boundary threshold"),
    "stiffness_n_per_mm": Bound(0.01, 5.0, "N/mm", "Grip stiffness"),
    "force_cap_n": Bound(0.1, 20.0, "N", "Force cap"),
    "gain_mm_per_s_per_n": Bound(0.05, 10.0, "mm/s/N", "Admittance gain"),
    "rotation_gain_rad_per_s_per_nmm": Bound(1e-6, 5e-3, "rad/s/(N·mm)", "Rotation gain"),
    "k_d": Bound(0.0, 0.9, "", "Path blending k_d"),
    "k_tau": Bound(0.0, 1.0, "", "Compliance k_τ"),
    "capture_mm": Bound(0.005, 5.0, "mm", "Offset of full correction"),
    "view_distance_mm": Bound(0.0, 60.0, "mm", "View distance r"),
    "target_tolerance_mm": Bound(0.002, 1.0, "mm", "Target tolerance ε_t"),
    "approach_deceleration_mm_per_s2": Bound(10.0, 5000.0, "mm/s²", "Deceleration towards anatomy"),
    "acceleration_mm_per_s2": Bound(10.0, 5000.0, "mm/s²", "Acceleration of the wanted motion"),
    "turn_acceleration_rad_per_s2": Bound(0.1, 100.0, "rad/s²", "Acceleration of the wanted turn"),
    "master_scale": Bound(0.01, 5.0, "", "Scale from master to tool"),
    "master_stiffness_n_per_mm": Bound(0.1, 50.0, "N/mm", "Spring between master and tool"),
    "surface_error_mm": Bound(0.0, 5.0, "mm", "Error of the surface, added to the margin"),
    "compliance_mm_per_n": Bound(0.0, 1.0, "mm/N", "Compensated compliance under the hand"),
}
