"""The state of robot and tool before a step: input of every task and fixture, output of every certificate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..arrays import Array, Int32Array
from ..geometry.capsules import Segments
from ..proximity.pairs import Pairs
from ..robots import TipState
from .state_kernel import BODY, BROKEN_COUNT, PAIR_COUNT, SEGMENT, STATE, TRIANGLE


@dataclass(frozen=True, eq=False)
class Layout:
    """Layout of a packed state: n joints, S segments with radius (S,) in mm, B obstacles; ``size`` is its length."""

    dof: int
    radius: Array
    bodies: int
    size: int = field(init=False)
    places: dict[str, tuple[int, int, tuple[int, ...]]] = field(init=False)
    broken_place: int = field(init=False)

    def __post_init__(self) -> None:
        sizes = self.dof, len(self.radius), self.bodies
        object.__setattr__(self, "size", STATE.size(*sizes))
        object.__setattr__(self, "places", STATE.places(*sizes))
        object.__setattr__(self, "broken_place", self.places["counts"][0] + BROKEN_COUNT)

    def part(self, numbers: Array, name: str) -> Array:
        """View of a field of ``StateViews`` in a packed state."""
        first, last, shape = self.places[name]
        return numbers[first:last].reshape(shape)


@dataclass(frozen=True, eq=False)
class StepState:
    """Robot and tool before a step; immutable; patient frame, mm and rad.

    q: joints (n,).
    velocity: joint velocity (n,) in mm/s or rad/s of the previous step; 0 at a start.
    tip: pose and Jacobian of the tip; segments: the S axis segments of the tool.
    distance: (B, S) from every obstacle to the surface of every segment, exact below the boundary threshold and capped
        there. Obstacle 0 is the anatomy; the zones follow in the order of ``zones.ordered``.
    context: the ``ControlContext`` that measured the state; None for a state made by hand.

    A measured state has, as read-only views:
    pairs: (N, 13), the pairs that can be active in the next step, nearest to their margin first, see ``state_kernel``.
    box: (2, n), lower and upper bounds of Δq in the next step from all joint limits, see ``joint_limits.step_box``.
    position: (3,) of the tip, as in ``tip``.
    broken: number of joints that must exceed their acceleration limit in the next step.
    """

    q: Array
    velocity: Array
    tip: TipState
    segments: Segments
    distance: Array
    context: Any = field(default=None, repr=False)

    @property
    def clearance(self) -> float:
        """Smallest distance from the whole tool to the anatomy in mm."""
        return float(self.distance[0].min())

    @property
    def body(self) -> Int32Array:
        """(N,) obstacle of each pair."""
        body: Int32Array = self.pairs[:, BODY].astype(np.int32)
        return body

    def named_pairs(self) -> Pairs:
        """The pairs as ``Pairs``, whose columns have names."""
        p = self.pairs
        segment, triangle = p[:, SEGMENT].astype(np.int32), p[:, TRIANGLE].astype(np.int32)
        return Pairs(p[:, 0], p[:, 1:4], p[:, 4:7], p[:, 7:10], segment, triangle)

    def measured_by(self, context: object) -> bool:
        """Whether this context has measured the state, so that a step can start from it."""
        own = self.__dict__
        return own["context"] is context and "numbers" in own

    @classmethod
    def measured(cls, context: Any, layout: Layout, numbers: Array) -> StepState:
        """Return the state of packed numbers, which it then owns; views are created on first access."""
        state = object.__new__(cls)
        own = state.__dict__
        own["context"], own["layout"], own["numbers"] = context, layout, numbers
        return state

    def __getattr__(self, name: str) -> Any:
        """Create a view of a measured state on first access."""
        own = self.__dict__
        make = _PARTS.get(name)
        if make is None or "numbers" not in own:
            raise AttributeError(f"a step state has no '{name}'")
        fixed = own.get("_fixed")
        if fixed is None:
            fixed = own["_fixed"] = own["numbers"].view()
            fixed.setflags(write=False)
        value = own[name] = make(fixed, own["layout"])
        return value


def _tip(numbers: Array, layout: Layout) -> TipState:
    return TipState(*(layout.part(numbers, name) for name in ("rotation", "position", "jacobian")))


def _segments(numbers: Array, layout: Layout) -> Segments:
    # Bypasses the checks of ``Segments``: these are read-only copies of measured numbers.
    segments, count = object.__new__(Segments), len(layout.radius)
    first, last = layout.places["start"][0], layout.places["end"][1]
    packed = np.concatenate((numbers[first:last], layout.radius))
    packed.setflags(write=False)
    start, end = packed[: 3 * count].reshape(count, 3), packed[3 * count : 6 * count].reshape(count, 3)
    segments.__dict__.update(packed=packed, start=start, end=end, radius=layout.radius)
    return segments


def _pairs(numbers: Array, layout: Layout) -> Array:
    return layout.part(numbers, "pairs")[: int(layout.part(numbers, "counts")[PAIR_COUNT])]


_PARTS: dict[str, Callable[[Array, Layout], Any]] = {
    "q": lambda numbers, layout: layout.part(numbers, "q"),
    "velocity": lambda numbers, layout: layout.part(numbers, "velocity"),
    "tip": _tip,
    "position": lambda numbers, layout: layout.part(numbers, "position"),
    "segments": _segments,
    "distance": lambda numbers, layout: layout.part(numbers, "distance"),
    "pairs": _pairs,
    "box": lambda numbers, layout: layout.part(numbers, "box"),
    "broken": lambda numbers, layout: int(numbers[layout.broken_place]),
}


ToolState = StepState  # the name in earlier versions
