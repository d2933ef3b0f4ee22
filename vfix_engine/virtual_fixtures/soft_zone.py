"""Soft (compliant) zones: a layer of tissue that acts like a spring, such as mucosa over bone.

The energy of the zone is U = ½ k δ², with δ = max(0, thickness − c) and c the distance from the tool to the structure
under the layer. The admittance law moves the tip by compliance · force. With the spring's force −∂U/∂P beside the
hand's force f this is ΔP = compliance · (f − ∂U/∂P). With the spring force at the end of the step (implicit Euler,
stable for every k and dt) ΔP is the minimiser of

    ½ ‖ΔP − compliance · f‖² + ½ · compliance · k · δ(ΔP)²

which is a soft constraint δ(ΔP) ≤ s with the cost ½ · compliance · k · s².
In equilibrium a constant force f straight into the layer gives δ = f / k.
All pairs share one slack because U depends on the deepest penetration only: more pairs are not more springs.

Without a command the controller is idle. With one, the tissue moves the tool outwards no faster than the command asks
for: the slack is at least δ − (length of the desired step), so that leaving faster has no lower cost.
docs/concepts.md derives both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..geometry.capsules import Segments
from ..geometry.shape_kernels import shape_rows
from ..geometry.shapes import Shape, shape_table
from ..proximity.pairs import Pairs, pairs_from_rows, reduce_pairs
from ..proximity.proximity import Proximity
from .boundary import boundary
from .fixture import Rows, Situation
from .rows import Constraint
from .state import StepState
from .zones import SHAPES, check_name, check_number, check_positive

STIFFEST_N_PER_MM = 100.0  # stiffer than tissue: use a no-fly zone instead
THICKEST_MM = 20.0
MAX_ROWS = 12  # rows of one zone
LOOK_AHEAD = 4.0  # in lengths of the desired step: other parts of the tool move faster than its tip


@dataclass(frozen=True, eq=False)
class SoftZone:
    """A layer of ``thickness_mm`` with a stiffness of ``stiffness_n_per_mm``.

    over: structure under the layer: a shape, the tree of a surface (a layer on both of its sides), or None for the
        anatomy. With thickness 0 the shape itself is soft.

    A soft zone refuses no motion; bone and no-fly zones under it keep their margins.

    Raises:
        InputError: the message names the zone and the invalid value.
    """

    name: str
    thickness_mm: float
    stiffness_n_per_mm: float
    over: Shape | Proximity | None = None

    def __post_init__(self) -> None:
        check_name(self.name, "soft zone")
        check_positive(self.stiffness_n_per_mm, f"{self.label}: the stiffness in N/mm", STIFFEST_N_PER_MM)
        shape = isinstance(self.over, SHAPES)
        words = f"{self.label}: the thickness in mm"
        if not (shape and check_number(self.thickness_mm, words) == 0.0):
            check_positive(self.thickness_mm, words, THICKEST_MM)
        if not (shape or self.over is None or hasattr(self.over, "pairs_within")):
            raise InputError(f"{self.label} is over a {type(self.over).__name__}; it needs a shape or a surface's tree")

    @property
    def label(self) -> str:
        """\"soft zone 'mucosa'\"."""
        return f"soft zone '{self.name}'"

    def penetration(self, state: StepState, anatomy: Proximity | None = None) -> float:
        """δ in mm, the depth of the tool in the layer; 0 outside. ``anatomy`` is required where ``over`` is None."""
        pairs = self._pairs(state.segments, anatomy, 0.0)
        return max(self.thickness_mm - float(pairs.distance.min()), 0.0) if len(pairs) else 0.0

    def rows(self, now: Situation) -> Rows:
        """One soft constraint: δ − n·ΔP_k ≤ s for the deepest pairs, all with the same s."""
        pairs = self._pairs(now.state.segments, now.anatomy, LOOK_AHEAD * now.scale_mm)
        if len(pairs) == 0:
            return Rows()
        depth = max(self.thickness_mm - float(pairs.distance.min()), 0.0)
        least = max(depth - now.scale_mm, 0.0)  # lower bound of the slack: no faster outwards than the command
        penalty = now.compliance_mm_per_n * self.stiffness_n_per_mm
        wall = boundary(pairs, now.state.tip, self.thickness_mm)
        text = f"{self.name}, {depth:.1f} mm deep"
        index = np.arange(len(pairs))
        constraint = Constraint(
            "soft", wall.matrix, wall.bound + least, index, (text,), penalty, price=penalty * least, shared=True
        )
        return Rows((), (constraint,))

    def is_admissible(self, before: StepState, after: StepState) -> bool:
        """Always True: a soft zone refuses no pose. The certificate checks the structures under it."""
        return True

    def _pairs(self, segments: Segments, anatomy: Proximity | None, further: float) -> Pairs:
        """Exact pairs of the tool and the structure under the layer, within its thickness and ``further`` mm."""
        within = self.thickness_mm + further
        if isinstance(self.over, SHAPES):
            return _shape_pairs(self.over, segments, within)
        surface = anatomy if self.over is None else self.over
        if surface is None:
            raise InputError(f"{self.label} covers the anatomy, which is not given")
        return reduce_pairs(surface.pairs_within(segments, within), MAX_ROWS)


def _shape_pairs(shape: Shape, segments: Segments, within: float) -> Pairs:
    table = shape_table([shape])
    rows, labels, found = np.empty((3 * len(segments), 10)), np.zeros((3 * len(segments), 2), np.int32), 0
    for s in range(len(segments)):
        start, first = segments.start[s], found
        along, radius = segments.end[s] - start, float(segments.radius[s])
        found, _ = shape_rows(table.kind[0], table.data[0], start, along, radius, within, rows, found)
        labels[first:found] = s, -1
    return pairs_from_rows(rows[:found], labels[:found])
