"""The settings of a driven snake that may change while it is driven."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, NamedTuple

from ...errors import InputError
from .drive_state import DriveSettings


class Range(NamedTuple):
    """Closed range of one setting, its unit and a label that a person reads."""

    low: float
    high: float
    unit: str
    label: str


@dataclass(frozen=True)
class SnakeSettings:
    """Settings in force; immutable, checked when made. ``DriveSettings`` has what is fixed for a whole drive.

    step_s: the control period.
    insertion_mm_per_s, camera_mm_per_s: speeds of an axis that is fully deflected.
    bound_mm, tip_bound_mm: b_i of Kwok 2013, eq. 17, of all links and of the last one; None as in ``DriveSettings``.
    reoptimise_below: r below which control bends are found anew and the tip is inserted.

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
        """The drive's settings: these, and from ``fixed`` whatever they do not name."""
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
    "reoptimise_below": Range(0.0, 0.5, "", "Bend r below which the tip is inserted"),
}
