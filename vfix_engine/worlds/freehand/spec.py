"""A tool in a free hand as plain values and arrays: a rigid tool's scene, and the stiffness of bone."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

from numpy.typing import NDArray

from ...control import ControlSettings
from ...errors import InputError
from ...runtime.system import Worker
from ...validate import within
from ..rigid.spec import RigidSpec, SceneSpec
from .snapshot import FreehandSnapshot
from .system import STIFFNESS_N_PER_MM, FreehandSystem

STIFFNESS_RANGE = (0.1, 100.0)  # N/mm
PERIOD_S = 0.02  # no hand is quicker; contact is computed in shorter steps
_KEY = "contact_stiffness_n_per_mm"


def of_free_hand(settings: ControlSettings) -> ControlSettings:
    """The same settings at the rate of a free hand."""
    return replace(settings, dt_s=PERIOD_S)


@dataclass(frozen=True, eq=False)
class FreehandSpec:
    """A free tool as ``runtime.SystemSpec``; the scene's fixtures guide and stop nothing here.

    Raises:
        InputError: the stiffness is outside 0.1 … 100 N/mm.
    """

    scene: SceneSpec
    control: ControlSettings
    contact_stiffness_n_per_mm: float = STIFFNESS_N_PER_MM

    world = "freehand"
    snapshot_type = FreehandSnapshot
    snapshot_numbers = RigidSpec.snapshot_numbers
    has_worker = False

    def __post_init__(self) -> None:
        within("the stiffness of contact in N/mm", self.contact_stiffness_n_per_mm, *STIFFNESS_RANGE)

    def build(self) -> FreehandSystem:
        """The system itself. Raises VfixError: tool, path or surface cannot be used."""
        return FreehandSystem(self.scene.build(), self.control, self.contact_stiffness_n_per_mm)

    def worker(self) -> Worker:
        raise InputError("a free tool has no background work")

    def __reduce__(self) -> tuple[Any, ...]:
        """Sent to another process with the parts of its scene."""
        return _from_process, (RigidSpec(self.scene, self.control), self.contact_stiffness_n_per_mm)

    def to_parts(self) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
        """See ``runtime.SystemSpec``. The scene's fixtures, which have no effect, are left out."""
        values, arrays = RigidSpec(replace(self.scene, fixtures=()), self.control).to_parts()
        return values | {_KEY: self.contact_stiffness_n_per_mm}, arrays

    @classmethod
    def from_parts(cls, values: dict[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Self:
        """The inverse. Raises InputError."""
        if _KEY not in values:
            raise InputError("the run does not say how stiff contact is")
        rigid = RigidSpec.from_parts(values, arrays)
        return cls(rigid.scene, rigid.control, float(values[_KEY]))


def _from_process(rigid: RigidSpec, stiffness: float) -> FreehandSpec:
    return FreehandSpec(rigid.scene, rigid.control, stiffness)
