"""Soft regions: solid tissue that pushes back like a spring and is hard beyond a greatest depth.

A ``SoftZone`` is a layer over a surface, which has no inside: a tool whose axis has crossed it is pushed further in. A
region is a solid, given by its signed distance d: the depth of the tool is δ = max over its axis of layer + r − d, and
the spring always points out of the solid, also deep inside. The spring is that of ``soft_zone.py``.

The greatest depth is enforced by hard rows and by a certificate over the whole motion. Between two poses every point of
the tool's axis is within C/8 of its chord (``sweep_kernel.acceleration_bound``), so poses sampled on the chord at
intervals h bound the excess during the motion: it exceeds that of the samples by at most STEEPEST · (h / 2 + C/8).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import field as made

import numpy as np

from ..arrays import Array, Float32Array
from ..errors import InputError, StartRefused
from ..geometry.checks import checked_points
from ..proximity.fields.distance_field import DistanceField
from .fixture import Rows, Situation
from .region_kernel import (
    COARSE,
    CONTACT,
    DEEPER,
    DEPTH,
    FINE,
    LAYER,
    LEAST_ADVANCE_MM,
    NUMBERS,
    STEEPEST,
    contact_rows,
    contacts,
    keeps_depth,
    largest_excess,
)
from .rows import Constraint
from .soft_zone import LOOK_AHEAD, MAX_ROWS, STIFFEST_N_PER_MM, THICKEST_MM
from .state import StepState
from .stopping import approach_bounds
from .zones import check_name, check_number, check_positive

DEEPEST_MM = 50.0  # largest allowed value of a greatest depth
ERROR_STEPS = 1.0  # error of a field in grid steps: √3/2 of interpolation, the rest of the samples' own values
EDGE_PER_MM = 0.5  # slope of the greatest depth at the edge of a deeper place
RESERVE_MM = 0.15  # subtracted from the greatest depth for the excess between sampled points and poses
_BETWEEN_MM = RESERVE_MM - 0.5 * STEEPEST * LEAST_ADVANCE_MM - 0.005  # of it, for the excess between poses
_BUFFER_MM = 0.02  # additional distance in the rows, so that the certificate rarely refuses a step
_MOST_POSES = 64  # samples of one motion; one that needs more is refused
_HARD_ROWS = 16
_CONTACTS = 512  # largest number of windows of the tool's axes


@dataclass(frozen=True, eq=False)
class DeeperPlace:
    """Part of a region with a greater allowed depth: within ``radius_mm`` of ``centre`` (3,), patient frame, mm.

    Around it the greatest depth decreases to the region's own by 0.5 mm per mm.
    Raises InputError for a centre that is not three finite numbers, or a radius or depth out of range.
    """

    centre: Array
    radius_mm: float
    max_depth_mm: float

    def __post_init__(self) -> None:
        centre = checked_points(np.reshape(np.asarray(self.centre, dtype=np.float64), (1, -1)))[0].copy()
        centre.setflags(write=False)
        object.__setattr__(self, "centre", centre)
        check_positive(self.radius_mm, "the radius of a deeper place in mm", 1e3)
        check_positive(self.max_depth_mm, "the greatest depth of a deeper place in mm", DEEPEST_MM)


@dataclass(frozen=True, eq=False)
class SoftRegion:
    """A solid with a stiffness in N/mm, and the greatest depth to which the tool's surface may be pressed into it.

    field: signed distance to the solid; where it is unknown, the tool is free. Its error is taken as one step of the
        grid that is used (``ERROR_STEPS``).
    max_depth_mm: below the border of the solid, or of the layer of ``layer_mm`` around it; None: unbounded. The tool is
        stopped earlier by that error and 0.15 mm, so that no part of it exceeds the depth, also between two poses.
    deeper: a part where the greatest depth is larger.

    Raises:
        InputError: the message names the region and the invalid value.
    """

    name: str
    field: DistanceField
    stiffness_n_per_mm: float
    max_depth_mm: float | None = None
    deeper: DeeperPlace | None = None
    layer_mm: float = 0.0
    numbers: Array = made(init=False, repr=False)
    _fine: Float32Array = made(init=False, repr=False)
    _coarse: Float32Array = made(init=False, repr=False)

    def __post_init__(self) -> None:
        check_name(self.name, "soft region")
        check_positive(self.stiffness_n_per_mm, f"{self.label}: the stiffness in N/mm", STIFFEST_N_PER_MM)
        if not isinstance(self.field, DistanceField) or len(self.field.grids) > 2:
            raise InputError(f"{self.label} needs a distance field of one or two grids")
        if not 0.0 <= check_number(self.layer_mm, f"{self.label}: the layer in mm") <= THICKEST_MM:
            raise InputError(f"{self.label}: the layer is {self.layer_mm:g} mm; allowed is 0 … {THICKEST_MM:g} mm")
        if self.max_depth_mm is None:
            if self.deeper is not None:
                raise InputError(f"{self.label} has a deeper place, but no greatest depth elsewhere")
        else:
            words = f"{self.label}: the greatest depth in mm"
            least = self.held_before_mm
            if not least < check_number(self.max_depth_mm, words) <= DEEPEST_MM:
                raise InputError(
                    f"{words} is {self.max_depth_mm:g}; it must be more than {least:.2f} mm, which the error of the "
                    f"field and the certificate take, and {DEEPEST_MM:g} mm at most"
                )
            if self.deeper is not None and self.deeper.max_depth_mm < self.max_depth_mm:
                raise InputError(f"{self.label}: its deeper place is less deep than the rest")
        object.__setattr__(self, "numbers", _numbers(self))
        object.__setattr__(self, "_fine", self.field.grids[0].values)
        object.__setattr__(self, "_coarse", self.field.grids[-1].values)

    @property
    def label(self) -> str:
        """\"soft region 'mucosa'\"."""
        return f"soft region '{self.name}'"

    @property
    def words(self) -> str:
        """Description of the region in a refusal."""
        return f"{self.name} at its greatest depth"

    @property
    def held_before_mm(self) -> float:
        """How far before the greatest depth the tool is stopped, if the first grid of the field is used."""
        return ERROR_STEPS * self.field.grids[0].step_mm + RESERVE_MM

    def penetration(self, state: StepState) -> float:
        """δ in mm, the depth of the tool according to the field; 0 outside."""
        found = self._contacts(state, 0.0, 0.0)
        return max(float(found[:, 4].max()), 0.0) if len(found) else 0.0

    def excess(self, state: StepState) -> float:
        """Largest depth beyond the allowed one in mm, including the error of the field; at least −50 mm."""
        return self._deepest(state)[0]

    def _deepest(self, state: StepState) -> tuple[float, int, float]:
        """The largest excess in mm, its segment, and the fraction along its axis; −50, −1 and 0 if it is less."""
        at = state.segments
        found: tuple[float, int, float] = largest_excess(
            self._fine, self._coarse, self.numbers, at.start, at.end, at.radius, 0.0, at.start, at.end, -DEEPEST_MM
        )
        return found

    def refuse_start(self, state: StepState, parts: Sequence[str]) -> None:
        """Refuse a start deeper than allowed (HAZ-04). Raises StartRefused."""
        if self.max_depth_mm is None:
            return
        excess, segment, share = self._deepest(state)
        if excess <= -RESERVE_MM:
            return
        at = state.segments
        place = at.start[segment] + share * (at.end[segment] - at.start[segment])
        allowed = self.allowed_mm(place)
        depth = self.layer_mm + at.radius[segment] - float(self.field.at(place[None])[0])
        raise StartRefused(
            f"the {parts[segment]} would start {max(depth, 0.0):.1f} mm deep in {self.name}, where "
            f"{allowed:g} mm are allowed less {self.held_before_mm:.2f} mm for errors; move the entry, tilt the robot, "
            "or allow a greater depth"
        )

    def warm_up(self, state: StepState) -> None:
        """Load the kernels; nothing moves."""
        self.excess(state)
        self.is_admissible(state, state)
        self._contacts(state, 0.0, 0.0)
        tip = state.tip
        row = np.zeros((1, tip.jacobian.shape[1] + 1))
        contact_rows(self.numbers, np.zeros((1, CONTACT)), True, tip.position, tip.jacobian, row)

    def allowed_mm(self, place: Array) -> float:
        """Greatest allowed depth at a point (3,), mm; ∞ without a bound."""
        if self.max_depth_mm is None:
            return math.inf
        if self.deeper is None:
            return self.max_depth_mm
        beyond = max(float(np.linalg.norm(place - self.deeper.centre)) - self.deeper.radius_mm, 0.0)
        return max(self.deeper.max_depth_mm - EDGE_PER_MM * beyond, self.max_depth_mm)

    def rows(self, now: Situation) -> Rows:
        """One soft constraint for the spring, and one hard one for the greatest depth."""
        ahead = LOOK_AHEAD * now.scale_mm
        found = self._contacts(now.state, ahead, -RESERVE_MM - _near_mm(now))
        if len(found):
            found = found[found[:, 6:].any(axis=1)]  # the very centre has no outward direction, and needs no row
        near = found[found[:, 5] > -RESERVE_MM - _near_mm(now)]
        constraints = []
        if len(found) and found[:, 4].max() > -ahead:
            constraints.append(self._spring(found, now))
        if self.max_depth_mm is not None and len(near):
            constraints.append(self._bound(near, now))
        return Rows((), tuple(constraints))

    def _spring(self, found: Array, now: Situation) -> Constraint:
        """δ − n·ΔP ≤ s for the deepest contacts, all with the same slack s, as in a soft zone."""
        found = found[np.argsort(-found[:, 4], kind="stable")[:MAX_ROWS]]
        depth = max(float(found[0, 4]), 0.0)
        least = max(depth - now.scale_mm, 0.0)  # lower bound of the slack: no faster outwards than the command
        penalty = now.compliance_mm_per_n * self.stiffness_n_per_mm
        worst = found[found[:, 5].argmax()]
        held = worst[5] > -RESERVE_MM - 2.0 * _BUFFER_MM  # then the hard bound stops the tool, not the spring
        text = self._bound_words(worst, now) if held else f"{self.name}, {depth:.1f} mm deep"
        index = np.arange(len(found))
        matrix = self._matrix(found, now, False)
        return Constraint(
            "soft", matrix, least - found[:, 4], index, (text,), penalty, price=penalty * least, shared=True
        )

    def _bound(self, found: Array, now: Situation) -> Constraint:
        """Bound every contact's excess by 0, approached only as fast as the tool can stop."""
        found = found[np.argsort(-found[:, 5], kind="stable")[:_HARD_ROWS]]
        change = now.deceleration_mm_per_s2 * now.dt_s**2
        bound = approach_bounds(-RESERVE_MM - _BUFFER_MM - found[:, 5], change)
        texts = tuple(self._bound_words(one, now) for one in found)
        return Constraint("depth", self._matrix(found, now, True), bound, np.arange(len(found)), texts)

    def _bound_words(self, contact: Array, now: Situation) -> str:
        part, allowed = now.tool.segment_names[int(contact[0])], self.allowed_mm(contact[1:4])
        return f"{self.name} on the {part}, at its greatest depth of {allowed:.1f} mm"

    def is_admissible(self, before: StepState, after: StepState) -> bool:
        """Whether the whole motion respects the greatest depth, or never gets deeper from a start beyond it."""
        if self.max_depth_mm is None:
            return True
        one, two = before.segments, after.segments
        sag = 0.0 if after.context is None else after.context.sag_mm(before, after)
        return keeps_depth(
            self._fine, self._coarse, self.numbers, one.start, one.end, one.radius, two.start, two.end,
            sag, -RESERVE_MM, _BETWEEN_MM, _MOST_POSES,
        )  # fmt: skip

    def _contacts(self, state: StepState, ahead: float, limit: float) -> Array:
        at, found = state.segments, np.empty((_CONTACTS, CONTACT))
        count = contacts(self._fine, self._coarse, self.numbers, at.start, at.end, at.radius, ahead, limit, found)
        return found[:count]

    def _matrix(self, chosen: Array, now: Situation, hard: bool) -> Array:
        tip = now.state.tip
        matrix = np.zeros((len(chosen), tip.jacobian.shape[1] + 1))
        contact_rows(self.numbers, np.ascontiguousarray(chosen), hard, tip.position, tip.jacobian, matrix)
        return matrix


def _near_mm(now: Situation) -> float:
    """Excess below its bound from which a row is needed, so that the tool can stop before the bound."""
    return max(1.0, 2.0 * LOOK_AHEAD * now.scale_mm)


def _numbers(region: SoftRegion) -> Array:
    """Pack the numbers of a region, see ``region_kernel``."""
    numbers = np.empty(NUMBERS)
    for first, grid in ((FINE, region.field.grids[0]), (COARSE, region.field.grids[-1])):
        numbers[first : first + 3], numbers[first + 3] = grid.origin, grid.step_mm
        numbers[first + 4] = ERROR_STEPS * grid.step_mm
    numbers[LAYER] = region.layer_mm
    numbers[DEPTH] = 1e3 if region.max_depth_mm is None else region.max_depth_mm
    numbers[DEEPER:] = (0.0, 0.0, 0.0, 0.0, numbers[DEPTH], 0.0)
    if region.deeper is not None:
        place = region.deeper
        numbers[DEEPER:] = (*place.centre, place.radius_mm, place.max_depth_mm, EDGE_PER_MM)
    numbers.setflags(write=False)
    return numbers
